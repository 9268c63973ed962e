//! How much light is scattered how far.
//!
//! Glare of lenses and of the eye falls with a power of the angle between 2 and 3 (Vos 1984; McCann and Rizzi, "Camera and visual veiling glare in HDR images",
//! J. SID 15, 2007). Here the point spread function is a mixture of Gaussians whose energy in each octave of width falls as `sigma^-1/3`, from
//! [`MIN_SIGMA_DEG`] to [`MAX_SIGMA_DEG`]: between these angles it falls with the power 2.33, below it is flat, beyond it ends.
//!
//! A [`Pyramid`](super::Pyramid) blurs by standard deviations `sigma_k = sqrt((4^k - 1) / 2)` pixels, `k = 0, 1, 2, ...`. Each Gaussian of the mixture is divided
//! among the two of them around it such that its variance is kept.

use bansho_base::math;

/// Smallest standard deviation of the mixture, degrees.
const MIN_SIGMA_DEG: f64 = 0.12;
/// Largest standard deviation of the mixture, degrees.
const MAX_SIGMA_DEG: f64 = 2.2;
/// The energy in an octave falls with this power of its standard deviation.
const ENERGY_EXPONENT: f64 = -1.0 / 3.0;
/// Gaussians by which the mixture is represented, evenly spaced in the logarithm of sigma.
const GAUSSIANS: usize = 64;

/// The point spread function for one size of pixels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PointSpread {
    /// Fractions of the light that the levels 1, 2, ... of the pyramid scatter.
    weights: Vec<f32>,
}

/// Variance of the blur of a level, square pixels.
fn variance(level: usize) -> f64 {
    (math::exp2(2.0 * level as f64) - 1.0) / 2.0
}

/// The level whose blur is at most, and the next at least, as wide as a variance in square pixels, and the fraction of the next in their mixture.
fn level_and_fraction(square_pixels: f64) -> (usize, f64) {
    let mut level = 0;
    while variance(level + 1) < square_pixels {
        level += 1;
    }
    (level, (square_pixels - variance(level)) / (variance(level + 1) - variance(level)))
}

impl PointSpread {
    /// The spread of a `fraction` of the light, where a radian is `focal_pixels` pixels. `None` if nothing is scattered.
    pub(crate) fn new(fraction: f64, focal_pixels: f64) -> Option<Self> {
        if fraction <= 0.0 {
            return None;
        }
        let pixels_per_degree = focal_pixels.to_radians();
        let octaves = math::log2(MAX_SIGMA_DEG / MIN_SIGMA_DEG);
        let mut weights = Vec::new();
        let mut sum = 0.0;
        for index in 0..GAUSSIANS {
            let octave = octaves * (index as f64 + 0.5) / GAUSSIANS as f64;
            let sigma = MIN_SIGMA_DEG * math::exp2(octave) * pixels_per_degree;
            let energy = math::exp2(ENERGY_EXPONENT * octave);
            let (level, wider) = level_and_fraction(sigma * sigma);
            weights.resize(weights.len().max(level + 2), 0.0);
            weights[level] += energy * (1.0 - wider);
            weights[level + 1] += energy * wider;
            sum += energy;
        }
        // Level 0 is the light that stays in its pixel.
        let scattered: Vec<f32> = weights[1..].iter().map(|weight| (fraction * weight / sum) as f32).collect();
        Some(Self { weights: scattered })
    }

    /// Fractions of the light that the levels 1, 2, ... scatter.
    pub(super) fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// The fraction of its light that a pixel loses.
    pub(super) fn scattered(&self) -> f32 {
        self.weights.iter().sum()
    }

    /// Pixels beyond which no light is scattered. The kernel of level k is a B-spline of order 6 (two of order 3 of spacing `2^k`, less one pixel), so it is 0
    /// from `3 * 2^k` on.
    pub(super) fn reach(&self) -> usize {
        3 << self.weights.len()
    }

    /// Side of the largest blocks of the pyramid, pixels.
    pub(super) fn largest_block(&self) -> usize {
        1 << self.weights.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Variance of the spread as a whole, square degrees, and the fraction that is scattered.
    fn moments(spread: &PointSpread, focal_pixels: f64) -> [f64; 2] {
        let per_degree = focal_pixels.to_radians();
        let weights = spread.weights.iter().enumerate();
        let sum: f64 = weights.map(|(index, weight)| f64::from(*weight) * variance(index + 1)).sum();
        [sum / (per_degree * per_degree), f64::from(spread.scattered())]
    }

    #[test]
    fn the_same_light_goes_equally_far_in_every_size() {
        // Integrals over the octaves of sigma: energy sigma^-1/3, times sigma^2 for the variance.
        let [low, high] = [MIN_SIGMA_DEG, MAX_SIGMA_DEG];
        let power = |exponent: f64| (math::pow(high, exponent) - math::pow(low, exponent)) / exponent;
        let expected = 0.03 * power(2.0 - 1.0 / 3.0) / power(-1.0 / 3.0);
        for focal_pixels in [187.0, 750.0, 1500.0, 9000.0] {
            let spread = PointSpread::new(0.03, focal_pixels).unwrap();
            let [variance, scattered] = moments(&spread, focal_pixels);
            assert!((variance / expected - 1.0).abs() < 2e-3, "{focal_pixels}: {variance} is not {expected}");
            assert!(scattered <= 0.030_001, "{focal_pixels}: {scattered}");
            // With large pixels a part of the light stays in its pixel.
            assert!(focal_pixels < 1000.0 || scattered > 0.0299, "{focal_pixels}: {scattered}");
            let reach_deg = spread.reach() as f64 / focal_pixels.to_radians();
            assert!((2.0 * MAX_SIGMA_DEG..8.6 * MAX_SIGMA_DEG).contains(&reach_deg), "{focal_pixels}: {reach_deg}");
        }
    }

    #[test]
    fn without_glare_nothing_is_scattered() {
        assert_eq!(PointSpread::new(0.0, 1500.0), None);
    }
}
