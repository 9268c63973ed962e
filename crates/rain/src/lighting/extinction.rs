//! Extinction coefficient and meteorological visibility of rain.

use std::f64::consts::PI;

use bansho_base::math::simd::LANES;

use crate::{
    drops::{shutter_state::ShutterState, size_distribution::DropSizeDistribution},
    lanes::{LaneArray, ZERO_LANES},
};

/// Extinction efficiency Q of a drop. Drops are large compared with the wavelength, so the total Q is 2 (the extinction
/// paradox).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExtinctionEfficiency {
    /// Geometric cross section, Q = 1: consistent with the opacity of single streaks.
    Geometric,
    /// Geometric cross section and diffraction, Q = 2: for meteorological visibility.
    WithDiffraction,
}

impl ExtinctionEfficiency {
    /// Extinction efficiency Q.
    pub fn value(self) -> f64 {
        match self {
            Self::Geometric => 1.0,
            Self::WithDiffraction => 2.0,
        }
    }
}

/// Extinction coefficient `beta = Q (pi/4) integral of n D^2 dD` of the drops between two diameters (mm), 1/m.
pub fn extinction(sizes: &DropSizeDistribution, efficiency: ExtinctionEfficiency, diameters_mm: [f64; 2]) -> f64 {
    // n per m^3 per mm, D and dD in mm: mm^2 per m^3 are 1e-6 per m.
    efficiency.value() * 0.25e-6 * PI * sizes.moment(2, diameters_mm)
}

/// Extinction coefficients of a rain, with the gain of its opacity, 1/m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RainExtinction {
    /// Of all drops.
    pub(crate) all: f64,
    /// Of the drops that are drawn as streaks near the camera.
    pub(crate) streaks: f64,
}

/// Extinction coefficient of the medium as a function of the distance from the camera: of all drops that are not drawn as streaks.
#[derive(Clone, Copy)]
pub(super) struct ExtinctionProfile<'a> {
    pub(super) shutter_state: &'a ShutterState,
    pub(super) extinction: RainExtinction,
}

impl ExtinctionProfile<'_> {
    /// At a distance (m), 1/m.
    pub(super) fn at(&self, distance: f64) -> f64 {
        self.extinction.all - self.extinction.streaks * f64::from(self.shutter_state.streak_weight(distance as f32))
    }

    /// At sixteen distances.
    #[inline(always)]
    pub(super) fn at_lanes(&self, distances: &LaneArray) -> LaneArray {
        let (all, streaks) = (self.extinction.all as f32, self.extinction.streaks as f32);
        let mut coefficients = ZERO_LANES;
        for i in 0..LANES {
            coefficients[i] = all - streaks * self.shutter_state.streak_weight(distances[i]);
        }
        coefficients
    }
}

/// Meteorological visibility, m: the distance at which a black object has 2 % contrast against the horizon sky
/// (Koschmieder 1924), `3.912 / beta` with Q = 2; infinite without drops.
pub fn visibility(sizes: &DropSizeDistribution) -> f64 {
    /// -ln 0.02.
    const CONTRAST: f64 = 3.912_023_005_428_146;
    CONTRAST / extinction(sizes, ExtinctionEfficiency::WithDiffraction, DropSizeDistribution::ALL)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::reference::near;

    #[test]
    fn the_whole_distribution_has_its_closed_form() {
        // Integral of n D^2 is 16000 / Lambda^3; Lambda = 4.1 at 1 mm/h: 232.15 mm^2 per m^3, times pi/4 and 1e-6.
        let sizes = DropSizeDistribution::marshall_palmer(1.0);
        assert!(near(extinction(&sizes, ExtinctionEfficiency::Geometric, DropSizeDistribution::ALL), 1.82331e-4, 1e-5));
        assert!(near(
            extinction(&sizes, ExtinctionEfficiency::WithDiffraction, DropSizeDistribution::ALL),
            3.64662e-4,
            1e-5
        ));
        assert!(near(visibility(&sizes), 10_727.8, 1e-4));
        assert_eq!(visibility(&DropSizeDistribution::marshall_palmer(0.0)), f64::INFINITY);
    }

    #[test]
    fn parts_add_up_and_the_papers_bins_hold_28_to_52_percent() {
        // Of (x^2/2 + x + 1) e^-x with x = Lambda D, the difference between 0.9 and 2.1 mm.
        for (rate, share) in [(1.0, 0.27862), (5.0, 0.45455), (20.0, 0.5218)] {
            let sizes = DropSizeDistribution::marshall_palmer(rate);
            let between = |range| extinction(&sizes, ExtinctionEfficiency::Geometric, range);
            let [below, within, above] = [[0.0, 0.9], [0.9, 2.1], [2.1, f64::INFINITY]].map(between);
            let whole = between(DropSizeDistribution::ALL);
            assert!(near(below + within + above, whole, 1e-12));
            assert!(near(within / whole, share, 1e-3), "{rate} mm/h: {}", within / whole);
        }
    }
}
