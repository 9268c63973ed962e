//! Decay of the red line by altitude: its effective lifetime is 1 s at 150 km and two minutes at 400 km.
//!
//! The afterglow stores red light for three altitudes, each with its own lifetime. Light between two of them is split
//! by linear weights, so the decay is continuous in altitude.

use super::{PerEmitter, SpectralEmitter};
use crate::physics::atmosphere::level_altitude_km;

/// Number of altitudes for which the afterglow stores red light.
pub(crate) const RED_ALTITUDES: usize = 3;
/// The altitudes, km: the best three round values for electrons of 1 to 10 keV.
const RED_ALTITUDES_KM: [f64; RED_ALTITUDES] = [150.0, 220.0, 300.0];

/// Linear weights of the light at an altitude; their sum is 1.
#[must_use]
pub(crate) fn red_altitude_weights(altitude_km: f64) -> [f64; RED_ALTITUDES] {
    let mut weights = [0.0; RED_ALTITUDES];
    let above = RED_ALTITUDES_KM.partition_point(|altitude| *altitude <= altitude_km).clamp(1, RED_ALTITUDES - 1);
    let [low, high] = [RED_ALTITUDES_KM[above - 1], RED_ALTITUDES_KM[above]];
    let fraction = ((altitude_km - low) / (high - low)).clamp(0.0, 1.0);
    (weights[above - 1], weights[above]) = (1.0 - fraction, fraction);
    weights
}

/// Red light of each level, split by altitude in place of the emitters; the last component is 0.
#[must_use]
pub(crate) fn red_by_altitude(profile: &[PerEmitter<f64>]) -> Vec<PerEmitter<f64>> {
    let divided = profile.iter().enumerate().map(|(level, light)| {
        let [low, middle, high] = red_altitude_weights(level_altitude_km(level))
            .map(|weight| weight * light[SpectralEmitter::OxygenRed.index()]);
        [low, middle, high, 0.0]
    });
    divided.collect()
}

/// Lifetimes in s, averaged over the levels with the weights and the emission. `levels` yields emission and lifetime.
pub(super) fn mean_lifetimes(levels: impl Iterator<Item = (f64, f64)>) -> [f64; RED_ALTITUDES] {
    let (mut light, mut lifetimes) = ([0.0; RED_ALTITUDES], [0.0; RED_ALTITUDES]);
    for (level, (emission, lifetime)) in levels.enumerate() {
        for (altitude, weight) in red_altitude_weights(level_altitude_km(level)).into_iter().enumerate() {
            light[altitude] += weight * emission;
            lifetimes[altitude] += weight * emission * lifetime;
        }
    }
    std::array::from_fn(|altitude| lifetimes[altitude] / light[altitude].max(f64::MIN_POSITIVE))
}

#[cfg(test)]
mod tests {
    use bansho_base::math;

    use super::{super::Emission, *};
    use crate::physics::{
        atmosphere::{LEVELS, atmosphere},
        emission::quenching::lifetime,
        precipitation::spectrum::ARC,
    };

    #[test]
    fn every_altitude_counts_once() {
        for altitude_km in [80.0, 150.0, 185.0, 220.0, 299.0, 300.0, 800.0] {
            assert!((red_altitude_weights(altitude_km).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
        assert_eq!((red_altitude_weights(90.0), red_altitude_weights(500.0)), ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]));
        assert_eq!(red_altitude_weights(185.0), [0.5, 0.5, 0.0]);
    }

    /// The fraction of the red light that is left at most too long, or too short, after electrons of an energy have gone: by the altitudes, and
    /// by one lifetime for the whole column.
    fn errors(energy_ev: f64) -> [f64; 2] {
        let emission = Emission::new(atmosphere(), ARC);
        let (profile, air) = (emission.profile(energy_ev), atmosphere().levels());
        let light: Vec<f64> = profile.iter().map(|light| light[SpectralEmitter::OxygenRed.index()]).collect();
        let whole: f64 = light.iter().sum();
        let by_height = red_by_altitude(&profile);
        let sums: [f64; RED_ALTITUDES] =
            std::array::from_fn(|altitude| by_height.iter().map(|light| light[altitude]).sum());
        let lifetimes = emission.red_lifetimes(energy_ev);
        let column = emission.column(energy_ev).lifetime[SpectralEmitter::OxygenRed.index()];
        let mut errors = [0.0_f64; 2];
        for second in 0..300 {
            let left = |lifetime: f64| math::exp(-f64::from(second) / lifetime);
            let exact: f64 =
                (0..LEVELS).map(|level| light[level] * left(lifetime(SpectralEmitter::OxygenRed, &air[level]))).sum();
            let found: f64 = (0..RED_ALTITUDES).map(|altitude| sums[altitude] * left(lifetimes[altitude])).sum();
            errors[0] = errors[0].max((found - exact).abs() / whole);
            errors[1] = errors[1].max((whole * left(column) - exact).abs() / whole);
        }
        errors
    }

    #[test]
    fn red_light_fades_as_by_the_lifetime_at_each_height() {
        for (energy_ev, bound) in [(1e3, 0.05), (3e3, 0.05), (1e4, 0.08)] {
            let [by_height, by_column] = errors(energy_ev);
            assert!(by_height < bound && by_column > 2.5 * by_height, "{energy_ev}: {by_height} {by_column}");
        }
    }
}
