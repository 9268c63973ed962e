//! Line integral of the poly6 kernel, and its gradient.
//!
//! Splatting evaluates the power 7/2 millions of times per frame. In `s^(7/2) = s^3 sqrt(s)` the square root is replaced by a cubic polynomial: it fits badly
//! only near s = 0, where s^3 is small. The error is below 1e-4 of the peak, at a quarter of the cost of a square root.

use std::f64::consts::PI;

/// Minimum `s = 1 - b^2/d^2` that is drawn: there a sprite has 1e-4 of its peak.
pub(crate) const MIN_S: f32 = 0.045;

/// The integral of poly6, eq. (2), along a ray at distance `b` from the center, 1/m^2: `9/(2 pi d^2) (1 - b^2/d^2)^(7/2)`. The exact form, to
/// which tests compare; pictures use `Profile::LINE`.
pub fn line_integral(b: f64, d: f64) -> f64 {
    let s = (1.0 - b * b / (d * d)).max(0.0);
    LINE_PEAK / (d * d) * s * s * s * s.sqrt()
}

/// The derivative of [`line_integral`] by `b`, 1/m^3: `-63/(2 pi d^4) (1 - b^2/d^2)^(5/2) b`.
pub fn line_gradient(b: f64, d: f64) -> f64 {
    let s = (1.0 - b * b / (d * d)).max(0.0);
    -7.0 * LINE_PEAK / (d * d * d * d) * s * s * s.sqrt() * b
}

/// Line integral through the center, times d^2: 9 / (2 pi).
pub(crate) const LINE_PEAK: f64 = 9.0 / (2.0 * PI);

/// Profile of a sprite as a function of `s = 1 - b^2/d^2`, 1 at the center: `s^3` times a cubic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Profile([f32; 4]);

impl Profile {
    /// `s^(7/2)`, the line integral of poly6.
    pub(crate) const LINE: Self = Self([0.243_703_22, 1.182_117_6, -0.600_629_2, 0.174_890_54]);
    /// `s^3`, poly6 itself: the paper's sprite (figure 2).
    pub(crate) const POLY6: Self = Self([1.0, 0.0, 0.0, 0.0]);

    #[inline(always)]
    pub(crate) fn at(self, s: f32) -> f32 {
        let [a, b, c, d] = self.0;
        let broken = if cfg!(feature = "broken-kernel") { 0.8 } else { 1.0 };
        broken * (s * s * s * cubic([a, b, c, d], s))
    }
}

#[inline(always)]
fn cubic([a, b, c, d]: [f32; 4], s: f32) -> f32 {
    d.mul_add(s, c).mul_add(s, b).mul_add(s, a)
}

/// Variance of a sprite along either axis relative to the square of its radius; 1/11 for `s^(7/2)` over a disc.
pub(crate) const VARIANCE: f64 = 1.0 / 11.0;

#[cfg(test)]
mod tests {
    use super::*;

    /// Poly6, eq. (2).
    fn poly6(r: f64, d: f64) -> f64 {
        let s = (d * d - r * r).max(0.0);
        315.0 / (64.0 * PI * bansho_base::math::pow(d, 9.0)) * s * s * s
    }

    #[test]
    fn the_line_integral_is_poly6_summed_along_the_ray() {
        let d = 0.3;
        for b in [0.0, 0.1, 0.2, 0.29, 0.31] {
            let steps = 20_000;
            let step = 2.0 * d / f64::from(steps);
            let distance = |i: i32| -d + step * (f64::from(i) + 0.5);
            let sum: f64 = (0..steps).map(|i| poly6((b * b + distance(i) * distance(i)).sqrt(), d) * step).sum();
            assert!((line_integral(b, d) - sum).abs() < 1e-6 * line_integral(0.0, d), "{b}: {sum}");
        }
    }

    #[test]
    fn the_line_integral_holds_the_whole_mass_and_its_variance() {
        let (d, steps) = (0.7, 4000);
        let step = d / f64::from(steps);
        let (mut mass, mut moment) = (0.0, 0.0);
        for i in 0..steps {
            let b = step * (f64::from(i) + 0.5);
            let ring = 2.0 * PI * b * step * line_integral(b, d);
            (mass, moment) = (mass + ring, moment + 0.5 * b * b * ring);
        }
        assert!((mass - 1.0).abs() < 1e-6, "{mass}");
        assert!((moment / (d * d) - VARIANCE).abs() < 1e-6, "{moment}");
    }

    #[test]
    fn the_gradient_is_the_slope_of_the_line_integral() {
        let (d, h) = (0.4, 1e-6);
        for b in [0.0, 0.05, 0.17, 0.3, 0.39, 0.5] {
            let slope = (line_integral(b + h, d) - line_integral(b - h, d)) / (2.0 * h);
            assert!((line_gradient(b, d) - slope).abs() < 1e-4 * line_integral(0.0, d) / d, "{b}: {slope}");
        }
    }

    #[test]
    fn profiles_are_as_near_as_they_say() {
        for i in 0..=1000 {
            let s = i as f32 / 1000.0;
            assert!((Profile::LINE.at(s) - s * s * s * s.sqrt()).abs() < 1e-4);
            assert_eq!(Profile::POLY6.at(s), s * s * s);
        }
        assert!((Profile::LINE.at(1.0) - 1.0).abs() < 1e-4);
    }
}
