//! Filaments: bright and dark stretches across the thickness of a sheet. Where a fold is seen along the sheet, the column is not one bar of even light but
//! several rays of different height beside each other, as in photographs.

use bansho_base::{
    math::{
        approximations,
        random::{Key, Purpose},
    },
    noise::{Coordinate, Fractal, LANES, Noise},
};
use fearless_simd::{Level, dispatch};

use crate::{AuroraParameters, RayParameters};

/// Octaves: filaments, and half as wide ones within them.
const FRACTAL: Fractal = Fractal { octaves: 2, lacunarity: 2, gain: 0.6 };

/// The pattern generator.
#[derive(Clone, Debug)]
pub(crate) struct FilamentPattern {
    rays: RayParameters,
    /// Along the sheet, across it, and in time.
    noise: Noise<3>,
    /// Standard deviations of the logarithms of brightness and energy, over that of the noise.
    brightness: f32,
    hardness: f32,
}

/// Positions of sixteen particles on their sheets.
pub(crate) struct FilamentInputs {
    /// Coordinate along the sheet, km.
    pub(crate) along_km: [f32; LANES],
    /// Distance from the middle of the sheet, km.
    pub(crate) across_km: [f32; LANES],
    /// 0 where the coordinate along the sheet jumps, 1 elsewhere.
    pub(crate) strength: [f32; LANES],
}

/// Factors for sixteen particles.
pub(crate) struct FilamentSample {
    /// Factor of the power before normalization.
    pub(crate) brightness: [f32; LANES],
    /// Factor of the energy.
    pub(crate) hardness: [f32; LANES],
}

impl FilamentPattern {
    /// `None` if nothing varies across the sheets.
    pub(crate) fn new(aurora: &AuroraParameters, key: Key) -> Option<Self> {
        let rays = aurora.rays.clone();
        let [seed, ..] = key.words(0, 0, Purpose::named("aurora filaments"));
        let noise = Noise::new(seed, FRACTAL, [0; 3]).expect("two octaves without a period are noise");
        let scale = rays.filament_contrast / FRACTAL.standard_deviation(3);
        let [brightness, hardness] = [rays.contrast, rays.energy_variation].map(|deviation| (scale * deviation) as f32);
        (brightness > 0.0 || hardness > 0.0).then_some(Self { rays, noise, brightness, hardness })
    }

    /// The factors at sixteen positions and a time, s.
    pub(crate) fn at(&self, level: Level, inputs: &FilamentInputs, time: f64) -> FilamentSample {
        dispatch!(level, _simd => self.sample(inputs, time))
    }

    #[inline(always)]
    fn sample(&self, inputs: &FilamentInputs, time: f64) -> FilamentSample {
        let age = Coordinate::from_f64(time / self.rays.lifetime_s);
        let (per_length, per_spacing) =
            ((1.0 / self.rays.filament_length_km) as f32, (1.0 / self.rays.filament_spacing_km) as f32);
        let (mut cells, mut fractions) = ([[age.cell; LANES]; 3], [[age.fraction; LANES]; 3]);
        for i in 0..LANES {
            let along = Coordinate::from_f32(inputs.along_km[i] * per_length);
            let across = Coordinate::from_f32(inputs.across_km[i] * per_spacing);
            (cells[0][i], cells[1][i]) = (along.cell, across.cell);
            (fractions[0][i], fractions[1][i]) = (along.fraction, across.fraction);
        }
        let noise = self.noise.lanes(&cells, &fractions);
        let mut sample = FilamentSample { brightness: [1.0; LANES], hardness: [1.0; LANES] };
        for i in 0..LANES {
            let value = inputs.strength[i] * noise[i];
            sample.brightness[i] = approximations::exp(self.brightness * value);
            sample.hardness[i] = approximations::exp(self.hardness * value);
        }
        sample
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math::{ln, simd::level};

    use super::*;

    const KEY: Key = Key::new(4, "filaments");

    /// Logarithms of brightness and hardness on lines across the sheet, every 25 m, at places 170 km apart.
    fn logarithms(pattern: &FilamentPattern, strength: f32, time: f64) -> [Vec<f64>; 2] {
        let mut all = [Vec::new(), Vec::new()];
        for place in 0..100_u16 {
            for batch in 0..20_u16 {
                let mut inputs = FilamentInputs {
                    along_km: [170.0 * f32::from(place); LANES],
                    across_km: [0.0; LANES],
                    strength: [strength; LANES],
                };
                for (lane, across) in inputs.across_km.iter_mut().enumerate() {
                    *across = 0.025 * (usize::from(batch) * LANES + lane) as f32 - 4.0;
                }
                let FilamentSample { brightness, hardness } = pattern.at(level(), &inputs, time);
                all[0].extend(brightness.map(|value| ln(f64::from(value))));
                all[1].extend(hardness.map(|value| ln(f64::from(value))));
            }
        }
        all
    }

    fn deviation(values: &[f64]) -> f64 {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / values.len() as f64).sqrt()
    }

    #[test]
    fn the_logarithms_vary_as_much_as_stated() {
        let pattern = FilamentPattern::new(&AuroraParameters::default(), KEY).unwrap();
        let RayParameters { contrast, energy_variation, filament_contrast, .. } = RayParameters::default();
        let [brightness, hardness] = logarithms(&pattern, 1.0, 3.0).map(|values| deviation(&values));
        assert!((brightness / (contrast * filament_contrast) - 1.0).abs() < 0.1, "{brightness}");
        assert!((hardness / (energy_variation * filament_contrast) - 1.0).abs() < 0.1, "{hardness}");
        assert!(logarithms(&pattern, 0.0, 3.0).iter().flatten().all(|value| *value == 0.0), "faded");
    }

    #[test]
    fn sheets_without_rays_have_no_filaments() {
        let mut aurora = AuroraParameters::default();
        (aurora.rays.contrast, aurora.rays.energy_variation) = (0.0, 0.0);
        assert!(FilamentPattern::new(&aurora, KEY).is_none());
    }

    /// Values half a spacing apart have less in common than those a tenth of the length apart.
    #[test]
    fn filaments_are_longer_than_wide_and_change_over_their_lifetime() {
        let pattern = FilamentPattern::new(&AuroraParameters::default(), KEY).unwrap();
        let at = |along: f32, across: f32, time: f64| {
            let mut inputs =
                FilamentInputs { along_km: [along; LANES], across_km: [across; LANES], strength: [1.0; LANES] };
            for (lane, along) in inputs.along_km.iter_mut().enumerate() {
                *along += 33.3 * lane as f32;
            }
            pattern.at(level(), &inputs, time).brightness
        };
        let difference = |along: f32, across: f32, time: f64| -> f32 {
            (0..200_u8)
                .map(|line| {
                    let across_km = 7.7 * f32::from(line);
                    let (here, there) = (at(0.0, across_km, 1.0), at(along, across_km + across, 1.0 + time));
                    here.iter().zip(there).map(|(a, b)| (a - b).abs()).sum::<f32>()
                })
                .sum()
        };
        let rays = RayParameters::default();
        let across = difference(0.0, 0.5 * rays.filament_spacing_km as f32, 0.0);
        assert!(difference(0.1 * rays.filament_length_km as f32, 0.0, 0.0) < 0.5 * across);
        assert!(difference(0.0, 0.0, 0.05 * rays.lifetime_s) < 0.3 * across);
        assert!(difference(0.0, 0.0, rays.lifetime_s) > 0.8 * across);
    }
}
