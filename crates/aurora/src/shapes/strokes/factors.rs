//! Flux and energy along a sheet, as factors of the aurora's own.

use std::sync::Arc;

use bansho_base::math::{curve::Curve, smoothstep};

use crate::shapes::SheetParameters;

/// What a scene says of them, for all sheets of one entry.
#[derive(Clone, Debug)]
pub(crate) struct FluxEnergyFactors {
    curves: Arc<[Curve; 2]>,
    /// Share of the length over which the flux rises from nothing at both ends.
    fade: f64,
}

impl FluxEnergyFactors {
    pub(super) fn new(parameters: &SheetParameters) -> Self {
        Self { curves: Arc::new([parameters.flux.clone(), parameters.energy.clone()]), fade: parameters.fade }
    }

    /// Flux and energy at that share of the length.
    pub(crate) fn at(&self, fraction: f64) -> [f64; 2] {
        let [flux, energy] = [0, 1].map(|index| self.curves[index].eval(fraction));
        let from_end = fraction.min(1.0 - fraction).max(0.0);
        [flux * smoothstep(0.0, self.fade, from_end), energy]
    }

    /// Whether both are the same at every place where a control point may be.
    pub(crate) fn are_those_of(&self, other: &Self) -> bool {
        const SAMPLES: usize = 512;
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs().max(b.abs());
        let same_at = |fraction: f64| {
            let [a, b] = [self.at(fraction), other.at(fraction)];
            near(a[0], b[0]) && near(a[1], b[1])
        };
        (self.curves == other.curves && self.fade == other.fade)
            || (0..=SAMPLES).all(|sample| same_at(sample as f64 / SAMPLES as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flux_rises_from_nothing_at_both_ends_and_energy_stays() {
        let factors = |fade: f64| FluxEnergyFactors::new(&SheetParameters { fade, ..SheetParameters::default() });
        let soft = factors(0.2);
        assert_eq!([0.0, 1.0].map(|fraction| soft.at(fraction)), [[0.0, 1.0]; 2]);
        assert_eq!([0.1, 0.9].map(|fraction| (soft.at(fraction)[0] - 0.5).abs() < 1e-12), [true; 2]);
        assert_eq!([0.2, 0.5, 0.8].map(|fraction| soft.at(fraction)), [[1.0; 2]; 3]);
        assert_eq!([0.0, 0.5, 1.0].map(|fraction| factors(0.0).at(fraction)), [[1.0; 2]; 3]);
        assert!(soft.are_those_of(&factors(0.2)) && !soft.are_those_of(&factors(0.1)));
    }
}
