//! Stochastic simplification of far billboards: a random subset of the drops, each drawn with a higher opacity, such that all together block the same area.
//!
//! Reference: R. L. Cook, J. Halstead, M. Planck and D. Ryu, "Stochastic simplification of aggregate detail" (2007). There the number of elements follows
//! from the size of an object in the picture; here from what a single drop contributes to a pixel, so that large and bright drops, which one sees one by
//! one, are all drawn, and no streak that stands for several drops is seen as one.

use std::f64::consts::PI;

use crate::drops::{classes::DropClassState, shutter_state::ShutterState};

/// How much of the drops of a billboard is drawn.
#[derive(Clone, Copy)]
pub(crate) struct StochasticSimplification {
    /// Radiance of display white, cd/m^2.
    pub(crate) white: f64,
    /// Contribution of a streak to a pixel, relative to display white, up to which it stands for several drops.
    pub(crate) max_contribution: f64,
}

impl StochasticSimplification {
    /// Fraction of the drops of a class at `distance` from the camera (m) that is drawn, above 0, at most 1; their opacity is divided by it. `radiance` is
    /// that of a drop there, cd/m^2.
    ///
    /// It is continuous in all that moves, so drops come and go one by one.
    pub(super) fn fraction(&self, state: &ShutterState, class: &DropClassState, distance: f64, radiance: f64) -> f64 {
        // A drop that is as bright as what is behind it still hides that: at most white.
        let contrast = 1.0 + radiance / self.white;
        (peak_opacity(state, class, distance) * contrast / self.max_contribution).clamp(f64::MIN_POSITIVE, 1.0)
    }
}

/// Largest opacity of a pixel behind a drop of a class at `distance` from the camera, m.
fn peak_opacity(state: &ShutterState, class: &DropClassState, distance: f64) -> f64 {
    let pixels_per_meter = state.cameras.middle().focal_pixels / distance.max(f64::MIN_POSITIVE);
    let diameter = 1e-3 * class.diameter_mm * pixels_per_meter;
    let length = class.speed * state.cameras.exposure_time * pixels_per_meter;
    let factor = state.opacity_factor(class.diameter_mm, class.speed);
    factor * 0.25 * PI * diameter * diameter / (length.max(1.0) * diameter.max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Method,
        tests::{rain, streaks, view_at, wind},
    };
    use bansho_base::phenomenon::surroundings::Surroundings;

    #[test]
    fn the_fraction_is_what_a_drop_shows_over_what_a_streak_may_show() {
        let calm = wind([0.0; 3], 0.0);
        let view = view_at(1.0, 1.0 / 60.0, [320, 180]);
        let rain = rain(streaks(Method::Billboards, 50.0), 1);
        let state = rain.shutter_state(&view, &Surroundings::from_wind(&calm));
        let class = state.classes.last().unwrap();
        let simplification = StochasticSimplification { white: 10.0, max_contribution: 0.01 };
        let fraction = |distance: f64, radiance: f64| simplification.fraction(&state, class, distance, radiance);
        // 90 pixels in tan 16 degrees are 313.9 pixels for a meter at a meter. A drop of 2 mm falls 10.8 cm at 6.49 m/s.
        assert!((class.diameter_mm - 2.0).abs() < 1e-9 && (class.speed - 6.49).abs() < 0.02, "{class:?}");
        let at_10_m = 0.25 * PI * 0.06278 * 0.06278 / (class.speed / 60.0 * 31.39);
        assert!((fraction(10.0, 0.0) / (at_10_m / 0.01) - 1.0).abs() < 1e-3, "{}", fraction(10.0, 0.0));
        // As bright as white, it counts for twice as much.
        assert!((fraction(10.0, 10.0) / fraction(10.0, 0.0) - 2.0).abs() < 1e-9);
        // A streak of many pixels weakens with the distance; one within a pixel with its square.
        assert!((fraction(20.0, 0.0) / fraction(10.0, 0.0) - 0.5).abs() < 1e-9);
        assert!((fraction(80.0, 0.0) / fraction(40.0, 0.0) - 0.25).abs() < 1e-9);
        assert_eq!(fraction(0.5, 1000.0), 1.0);
    }
}
