//! Serialization of the gas: version, time, then the fields, little-endian.

use bansho_base::{phenomenon::SnapshotError, world::air::Air};

use super::Simulation;

const VERSION: u32 = 2;
/// Numbers before the fields.
const HEAD: usize = 5;
/// Larger than any value of a simulated field, and small enough that computations do not overflow.
const MAX_MAGNITUDE: f32 = 1e7;

/// The state at a time; without gas before the first step.
pub(crate) fn write(time: f64, simulation: Option<&Simulation>) -> Vec<u8> {
    let mut bytes = Vec::new();
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(time.to_le_bytes());
    let Some(simulation) = simulation else { return bytes };
    bytes.extend([simulation.air.temperature_k, simulation.air.pressure_pa].into_iter().flat_map(f64::to_le_bytes));
    let wind = simulation.flow.ambient().velocity;
    let head = [simulation.emission_factor, simulation.recent_burning];
    bytes.extend(head.into_iter().chain(wind).flat_map(f32::to_le_bytes));
    for field in simulation.flow.state() {
        bytes.extend(field.iter().flat_map(|value| value.to_le_bytes()));
    }
    bytes
}

/// The time and the state; `start` makes one before the first step, on the coarse grid or on the fine one.
pub(crate) fn read(
    bytes: &[u8],
    start: impl Fn(bool) -> Simulation,
) -> Result<(f64, Option<Simulation>), SnapshotError> {
    let (version, rest) = bytes.split_first_chunk::<4>().ok_or(SnapshotError::Damaged)?;
    let found = u32::from_le_bytes(*version);
    if found != VERSION {
        return Err(SnapshotError::Version { found, known: VERSION });
    }
    let (time, rest) = rest.split_first_chunk::<8>().ok_or(SnapshotError::Damaged)?;
    let time = f64::from_le_bytes(*time);
    if !time.is_finite() {
        return Err(SnapshotError::Damaged);
    }
    if rest.is_empty() {
        return Ok((time, None));
    }
    let (air, rest) = rest.split_first_chunk::<16>().ok_or(SnapshotError::Damaged)?;
    let air = air.as_chunks::<8>().0;
    let air = Air { temperature_k: f64::from_le_bytes(air[0]), pressure_pa: f64::from_le_bytes(air[1]) };
    // Comparisons with NaN are false.
    if !((100.0..1000.0).contains(&air.temperature_k) && (1.0..1e9).contains(&air.pressure_pa)) {
        return Err(SnapshotError::Damaged);
    }
    let (values, remainder) = rest.as_chunks::<4>();
    if !remainder.is_empty() {
        return Err(SnapshotError::Damaged);
    }
    let count = values.len();
    let mut values = values.iter().map(|bytes| f32::from_le_bytes(*bytes));
    let mut next = || values.next().filter(|value| value.abs() <= MAX_MAGNITUDE).ok_or(SnapshotError::Damaged);
    let mut simulation = [true, false]
        .into_iter()
        .map(start)
        .find(|simulation| HEAD + simulation.flow.state().map(Vec::len).sum::<usize>() == count)
        .ok_or(SnapshotError::Damaged)?;
    let (factor, burning) = (next()?, next()?);
    if !((0.0..=1000.0).contains(&factor) && burning >= 0.0) {
        return Err(SnapshotError::Damaged);
    }
    let velocity = [next()?, next()?, next()?];
    simulation.set_air(air, velocity);
    (simulation.emission_factor, simulation.recent_burning) = (factor, burning);
    for field in simulation.flow.state_mut() {
        for value in field {
            *value = next()?;
        }
    }
    let contents = &simulation.flow.contents;
    let are_densities_valid = contents.density.iter().all(|density| (1e-4..1e4).contains(density));
    let [mixture, deficit] = &contents.quantities;
    let are_mixtures_valid = mixture.iter().all(|mixture| (-0.01..=1.01).contains(mixture));
    let are_deficits_valid = deficit.iter().all(|deficit| (-1.0..=1e4).contains(deficit));
    if !(are_densities_valid && are_mixtures_valid && are_deficits_valid) || values.next().is_some() {
        return Err(SnapshotError::Damaged);
    }
    simulation.restore_active();
    Ok((time, Some(simulation)))
}
