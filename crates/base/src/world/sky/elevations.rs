//! Radiance that was measured as a function of elevation alone, from a photograph.

use std::f64::consts::PI;

use crate::math::{self, MulAdd};

/// Number of elevation bands, of equal width in the sine of the elevation.
const BANDS: usize = 24;
/// Steps of the integral over the upper hemisphere.
const STEPS: usize = 96;

/// Radiance (ACEScg) as a function of elevation, independent of azimuth: linear between the centers of bands of equal solid angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElevationProfile {
    bands: [[f32; 3]; BANDS],
    /// Illuminance of open, horizontal ground.
    horizontal: [f32; 3],
}

/// A sample of the radiance from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElevationSample {
    /// Sine of the direction's elevation.
    pub sine: f64,
    /// Solid angle that it represents, in any unit.
    pub weight: f64,
    /// Radiance, ACEScg.
    pub radiance: [f32; 3],
}

impl ElevationProfile {
    /// The mean of `samples` in each band; a band without samples takes the mean of the nearest band that has some. `None` without samples.
    pub fn from_samples(samples: impl IntoIterator<Item = ElevationSample>) -> Option<Self> {
        let mut sums = [[0.0_f64; 4]; BANDS];
        for ElevationSample { sine, weight, radiance } in samples {
            let sum = &mut sums[((position(sine) + 0.5) as usize).min(BANDS - 1)];
            (0..3).for_each(|c| sum[c] = weight.fma(f64::from(radiance[c]), sum[c]));
            sum[3] += weight;
        }
        let seen: Vec<usize> = (0..BANDS).filter(|band| sums[*band][3] > 0.0).collect();
        let mut bands = [[0.0; 3]; BANDS];
        for (band, radiance) in bands.iter_mut().enumerate() {
            // Elevations that are not in the picture have the light of the nearest one that is.
            let nearest = seen.iter().min_by_key(|other| other.abs_diff(band))?;
            let [red, green, blue, weight] = sums[*nearest];
            *radiance = [red, green, blue].map(|sum| (sum / weight) as f32);
        }
        Some(Self::new(bands))
    }

    fn new(bands: [[f32; 3]; BANDS]) -> Self {
        let mut horizontal = [0.0_f64; 3];
        for step in 0..STEPS {
            let sine = (step as f64 + 0.5) / STEPS as f64;
            let radiance = interpolate(&bands, sine);
            (0..3).for_each(|c| horizontal[c] += f64::from(radiance[c]) * 2.0 * PI * sine / STEPS as f64);
        }
        Self { bands, horizontal: horizontal.map(|value| value as f32) }
    }

    /// The same light, scaled by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f32) -> Self {
        Self {
            bands: self.bands.map(|band| band.map(|value| value * factor)),
            horizontal: self.horizontal.map(|value| value * factor),
        }
    }

    /// Radiance from directions with this sine of the elevation.
    pub(super) fn radiance(&self, sine: f64) -> [f32; 3] {
        interpolate(&self.bands, sine)
    }

    /// [`radiance`](Self::radiance) for many sines, as one array per component, with the same bits. It vectorizes, which a cast to an integer does not.
    #[inline(always)]
    pub(super) fn radiances<const N: usize>(&self, sines: &[f64; N]) -> [[f32; N]; 3] {
        /// Added to a number from 0 to 2^51 it rounds it, and its lowest bits are then the integer.
        const ROUND: f64 = (1_u64 << 52) as f64;
        let (mut lower, mut fractions) = ([0; N], [0.0; N]);
        for i in 0..N {
            let position = position(sines[i]);
            let nearest = (position + ROUND) - ROUND;
            let below = if nearest > position { nearest - 1.0 } else { nearest };
            let below = if below > (BANDS - 2) as f64 { (BANDS - 2) as f64 } else { below };
            // Within the table for NaN too.
            lower[i] = ((below + ROUND).to_bits() as u32).min(BANDS as u32 - 2);
            fractions[i] = position - below;
        }
        let mut planes = [[0.0; N]; 3];
        for c in 0..3 {
            for i in 0..N {
                let lower = lower[i] as usize;
                let [from, to] = [f64::from(self.bands[lower][c]), f64::from(self.bands[lower + 1][c])];
                planes[c][i] = math::lerp(from, to, fractions[i]) as f32;
            }
        }
        planes
    }

    /// Illuminance of open, horizontal ground.
    pub(super) fn horizontal_illuminance(&self) -> [f32; 3] {
        self.horizontal
    }

    /// Whether it emits no light.
    pub(super) fn is_dark(&self) -> bool {
        self.bands.as_flattened().iter().all(|value| *value <= 0.0)
    }
}

/// Position of a sine of elevation in units of bands, relative to the center of the lowest.
fn position(sine: f64) -> f64 {
    (0.5 * (sine + 1.0) * BANDS as f64 - 0.5).clamp(0.0, (BANDS - 1) as f64)
}

fn interpolate(bands: &[[f32; 3]; BANDS], sine: f64) -> [f32; 3] {
    let position = position(sine);
    let lower = (position as usize).min(BANDS - 2);
    let fraction = position - lower as f64;
    std::array::from_fn(|c| math::lerp(f64::from(bands[lower][c]), f64::from(bands[lower + 1][c]), fraction) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(sine: f64, value: f32) -> ElevationSample {
        ElevationSample { sine, weight: 1.0, radiance: [value, 0.5 * value, 0.0] }
    }

    #[test]
    fn a_uniform_surrounding_has_its_radiance_everywhere_and_pi_of_it_on_the_ground() {
        let even = ElevationProfile::from_samples([sample(0.1, 3.0)]).unwrap();
        for sine in [-1.0, -0.3, 0.0, 0.8, 1.0] {
            assert_eq!(even.radiance(sine), [3.0, 1.5, 0.0]);
        }
        assert!((f64::from(even.horizontal_illuminance()[0]) - 3.0 * PI).abs() < 1e-3);
        assert_eq!(even.scaled(2.0).radiance(0.2), [6.0, 3.0, 0.0]);
        assert!(!even.is_dark() && even.scaled(0.0).is_dark());
        assert_eq!(ElevationProfile::from_samples([]), None);
    }

    #[test]
    fn many_sines_have_the_bits_of_each_alone() {
        let rising = (0..500).map(|i| sample(f64::from(i) / 250.0 - 1.0, (i * i) as f32));
        let profile = ElevationProfile::from_samples(rising).unwrap();
        let last = [1.0, -1.0, 0.0, 2.0, -3.0, 1.0 - 1.0 / BANDS as f64, f64::NAN];
        let sines: [f64; 107] = std::array::from_fn(|i| *last.get(i).unwrap_or(&(i as f64 / 53.0 - 1.0)));
        let planes = profile.radiances(&sines);
        for (i, sine) in sines.into_iter().enumerate() {
            let alone = profile.radiance(sine);
            assert_eq!([0, 1, 2].map(|c| planes[c][i].to_bits()), alone.map(f32::to_bits), "{sine}");
        }
    }

    #[test]
    fn bright_sky_over_dark_ground_stays_above_and_goes_on_beyond_what_was_seen() {
        let seen = (0..200).map(|i| {
            let sine = f64::from(i) / 199.0 - 0.5;
            sample(sine, if sine > 0.0 { 8.0 } else { 1.0 })
        });
        let profile = ElevationProfile::from_samples(seen).unwrap();
        assert_eq!([1.0, 0.2, -0.2, -1.0].map(|sine| profile.radiance(sine)[0]), [8.0, 8.0, 1.0, 1.0]);
        let rising = (0..40).map(|i| profile.radiance(f64::from(i) / 200.0 - 0.1)[0]).collect::<Vec<_>>();
        assert!(rising.is_sorted(), "{rising:?}");
    }
}
