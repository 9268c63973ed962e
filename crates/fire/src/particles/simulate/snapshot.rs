//! Serialization of the particles: version, count, then column after column, little-endian.

use bansho_base::phenomenon::SnapshotError;

use super::particles::{FLOAT_COLUMNS, GasParticles};

const VERSION: u32 = 2;
/// Larger than any value of a simulated particle, and small enough that computations do not overflow.
const MAX_MAGNITUDE: f32 = 1e12;
/// Bytes per particle: id, burner, and all `f32` columns.
const BYTES_PER_PARTICLE: usize = 8 + 4 + 4 * FLOAT_COLUMNS;

/// Writes the particles; their origin follows from the parameters.
pub(crate) fn write(particles: &GasParticles) -> Vec<u8> {
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

/// Splits what [`write()`] wrote from what follows it. All bytes of another version are taken for a state, which [`read`] refuses.
pub(crate) fn split_first(bytes: &[u8]) -> Result<(&[u8], &[u8]), SnapshotError> {
    if bytes.first_chunk::<4>().is_some_and(|version| u32::from_le_bytes(*version) != VERSION) {
        return Ok((bytes, &[]));
    }
    let count = bytes.get(4..12).and_then(|count| count.try_into().ok()).map(u64::from_le_bytes);
    let count = count.and_then(|count| usize::try_from(count).ok()).ok_or(SnapshotError::Damaged)?;
    let length = count.checked_mul(BYTES_PER_PARTICLE).and_then(|length| length.checked_add(12));
    length.and_then(|length| bytes.split_at_checked(length)).ok_or(SnapshotError::Damaged)
}

/// Reads particles with the origin of `particles`; `burners` is the number of burners.
pub(crate) fn read(particles: &GasParticles, bytes: &[u8], burners: usize) -> Result<GasParticles, SnapshotError> {
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
    let mut read = GasParticles::new(particles.origin);
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
