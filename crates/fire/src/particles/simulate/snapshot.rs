//! Serialization of the particles: version, count, then column after column, little-endian.

use bansho_base::phenomenon::SnapshotError;

use super::particles::{FLOAT_COLUMNS, Particles};

const VERSION: u32 = 2;
/// Larger than any value of a simulated particle, and small enough that computations do not overflow.
const MAX_MAGNITUDE: f32 = 1e12;
/// Bytes per particle: id, burner, and all `f32` columns.
const BYTES_PER_PARTICLE: usize = 8 + 4 + 4 * FLOAT_COLUMNS;

/// Writes the particles; their origin follows from the parameters.
pub(crate) fn write(particles: &Particles) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(12 + BYTES_PER_PARTICLE * particles.len());
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend((particles.len() as u64).to_le_bytes());
    bytes.extend(particles.id.iter().flat_map(|id| id.to_le_bytes()));
    bytes.extend(particles.burner.iter().flat_map(|burner| burner.to_le_bytes()));
    for values in particles.float_columns() {
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }
    bytes
}

/// Reads particles with the origin of `particles`; `burners` is the number of burners.
pub(crate) fn read(particles: &Particles, bytes: &[u8], burners: usize) -> Result<Particles, SnapshotError> {
    let (version, rest) = bytes.split_first_chunk::<4>().ok_or(SnapshotError::Damaged)?;
    let found = u32::from_le_bytes(*version);
    if found != VERSION {
        return Err(SnapshotError::Version { found, known: VERSION });
    }
    let (count, rest) = rest.split_first_chunk::<8>().ok_or(SnapshotError::Damaged)?;
    let count = usize::try_from(u64::from_le_bytes(*count)).map_err(|_| SnapshotError::Damaged)?;
    if count.checked_mul(BYTES_PER_PARTICLE) != Some(rest.len()) {
        return Err(SnapshotError::Damaged);
    }
    let (id_bytes, rest) = rest.split_at(8 * count);
    let (burner_bytes, mut rest) = rest.split_at(4 * count);
    let mut read = Particles::new(particles.origin);
    read.id = id_bytes.as_chunks().0.iter().map(|bytes| u64::from_le_bytes(*bytes)).collect();
    read.burner = burner_bytes.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect();
    for values in read.float_columns_mut() {
        let (head, tail) = rest.split_at(4 * count);
        *values = head.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        rest = tail;
    }
    let are_burners_valid = read.burner.iter().all(|burner| (*burner as usize) < burners);
    // Comparisons with NaN are false.
    let are_values_valid =
        read.float_columns().iter().all(|values| values.iter().all(|value| value.abs() <= MAX_MAGNITUDE));
    if are_burners_valid && are_values_valid { Ok(read) } else { Err(SnapshotError::Damaged) }
}
