//! What the ground is like at a place: its colour and where water stands.

use bansho_base::{
    color::acescg_from_srgb,
    math::{
        self, DVec2, MulAdd,
        random::{Key, Purpose},
    },
    noise::{Coordinate, Fractal, Noise, VARIANCE},
};

use super::{parameters::GroundParameters, wet_reflection::Facets};

/// Octaves of the ground's texture, each half as large and as strong as the one before.
const OCTAVES: usize = 8;
/// Strength of the largest octave, and of each over that of the one before. Soil and asphalt have most of their contrast in their grain:
/// were it as strong in their large patches, bright ground would look like clouds.
const STRENGTH: f64 = 0.2;
const GAIN: f64 = 1.24;
/// Height of an octave over that of the one before.
const RELIEF_GAIN: f64 = 0.6;
/// Standard deviation of the relief, which is roughly normal.
const DEVIATION: f64 = 0.34;
/// One octave at a time, so that each can fade where it is too small to be seen.
const SINGLE: Fractal = Fractal { octaves: 1, lacunarity: 2, gain: 0.5 };

/// Bumps of a film of water: size of the largest, m, octaves, each half as large as the one before, and their share of the film's
/// mean square slope.
const BUMP: f64 = 0.15;
const BUMPS: usize = 3;
const BUMP_SHARE: f64 = 0.4;
/// Slope of grains that stand out of the film, over that of the film.
const GRAIN: f64 = 3.0;
/// Greatest share of wet ground that is film between the grains.
const FILM_SHARE: f64 = 0.6;

/// The ground's pattern.
pub(super) struct Surface {
    albedo: [f32; 3],
    texture: f64,
    size: f64,
    octaves: Vec<Noise<2>>,
    puddles: f64,
    roughness: f64,
}

/// The ground at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Patch {
    /// Share of light that it throws back when dry.
    pub(super) albedo: [f32; 3],
    /// Share covered by puddles when wet.
    pub(super) puddle: f64,
    /// Share of the rest whose film of water is whole: grains stand out of it where the ground is high.
    pub(super) film: f64,
}

impl Surface {
    pub(super) fn new(parameters: &GroundParameters, key: Key) -> Self {
        let words = [0, 1].map(|part| key.words(part, 0, Purpose::named("ground")));
        let octaves =
            words.as_flattened().iter().take(OCTAVES).filter_map(|&seed| Noise::new(seed, SINGLE, [0, 0]).ok());
        Self {
            albedo: acescg_from_srgb(parameters.colour.map(|value| value as f32)),
            texture: parameters.texture,
            size: parameters.texture_size,
            octaves: octaves.collect(),
            puddles: parameters.puddles,
            roughness: parameters.roughness,
        }
    }

    /// The ground at a `place` (x, z), of which a pixel covers `footprint` m.
    pub(super) fn at(&self, place: DVec2, footprint: f64) -> Patch {
        let (mut grain, mut relief) = (0.0, 0.0);
        let (mut size, mut strength, mut height) = (self.size, STRENGTH, 1.0_f64);
        for octave in &self.octaves {
            let seen = math::smoothstep(1.0, 3.0, size / footprint.max(1e-9));
            if seen <= 0.0 {
                break;
            }
            let coordinates = [place.x / size, place.y / size].map(Coordinate::from_f64);
            let value = seen * f64::from(octave.at(coordinates));
            (grain, relief) = (strength.fma(value, grain), height.fma(value, relief));
            (size, strength, height) = (0.5 * size, GAIN * strength, RELIEF_GAIN * height);
        }
        let shade = math::exp(self.texture * grain) as f32;
        let albedo = self.albedo.map(|value| (value * shade).min(1.0));
        let pixels = self.size / footprint.max(1e-9);
        let seen = |first: f64, whole: f64| math::smoothstep(first, whole, pixels);
        Patch {
            albedo,
            puddle: math::lerp(self.puddles, self.puddle(relief), seen(1.0, 3.0)),
            // Its edges are sharp and its light strong: patches of a few pixels would be dashes at the horizon.
            film: math::lerp(0.5, film(relief), seen(2.0, 8.0)),
        }
    }

    /// The facets of wet ground at a `place` (x, z), of which a pixel covers `footprint` m, where `film` of it is whole.
    pub(super) fn facets(&self, place: DVec2, footprint: f64, film: f64) -> Facets {
        let each = math::sqrt(BUMP_SHARE / BUMPS as f64) * self.roughness;
        let deviation = math::sqrt(VARIANCE[0]);
        let (mut tilt, mut rest, mut size) = (DVec2::ZERO, self.roughness * self.roughness, BUMP);
        for pair in self.octaves.chunks_exact(2).take(BUMPS) {
            let seen = math::smoothstep(1.5, 5.0, size / footprint.max(1e-9));
            if seen <= 0.0 {
                break;
            }
            // Aside of the texture that has the same noise.
            let coordinates = [place.x / size + 61.3, place.y / size - 17.7].map(Coordinate::from_f64);
            let slope = [0, 1].map(|axis| f64::from(pair[axis].at(coordinates)) / deviation);
            tilt += DVec2::from(slope) * (seen * each);
            rest -= seen * seen * each * each;
            size *= 0.5;
        }
        let grain = GRAIN * self.roughness;
        Facets { tilt, slopes: [math::sqrt(rest), grain], film: FILM_SHARE * film }
    }

    /// Mean slope of wet ground, films and grains together.
    pub(super) fn mean_slope(&self) -> f64 {
        math::lerp(GRAIN, 1.0, 0.5 * FILM_SHARE) * self.roughness
    }

    /// Water stands where the ground lies low.
    fn puddle(&self, relief: f64) -> f64 {
        // The quantile at a share p of what is roughly normal is near the logistic's.
        let share = self.puddles.clamp(1e-6, 1.0 - 1e-6);
        let level = DEVIATION * math::ln(share / (1.0 - share)) / 1.7;
        1.0 - math::smoothstep(level - 0.12, level + 0.12, relief)
    }
}

/// Half of the ground has a film, with soft edges.
fn film(relief: f64) -> f64 {
    1.0 - math::smoothstep(-DEVIATION, DEVIATION, relief)
}

/// Share of light that water mirrors at an angle with cosine `cos` to its normal (Schlick 1994, n = 1.333).
pub(super) fn fresnel(cos: f64) -> f64 {
    let grazing = 1.0 - cos.clamp(0.0, 1.0);
    let fifth = grazing * grazing * grazing * grazing * grazing;
    0.0204 + 0.9796 * fifth
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn puddles_cover_the_share_asked_for_and_films_half_of_the_ground() {
        for share in [0.0, 0.2, 0.6, 1.0] {
            let parameters = GroundParameters { puddles: share, ..GroundParameters::default() };
            let surface = Surface::new(&parameters, Key::new(3, "ground"));
            let count = 40_000;
            let at = |i: i32| surface.at(DVec2::new(f64::from(i % 200) * 0.31, f64::from(i / 200) * 0.37), 1e-3);
            let mean = |of: fn(Patch) -> f64| (0..count).map(|i| of(at(i))).sum::<f64>() / f64::from(count);
            let (puddle, film) = (mean(|patch| patch.puddle), mean(|patch| patch.film));
            assert!((puddle - share).abs() < 0.07, "{share}: {puddle}");
            assert!((film - 0.5).abs() < 0.07, "{film}");
            assert!((surface.at(DVec2::ZERO, 1e3).puddle - share).abs() < 1e-9);
        }
    }

    #[test]
    fn ground_has_its_contrast_in_its_grain_not_in_clouds() {
        let surface = Surface::new(&GroundParameters::default(), Key::new(5, "ground"));
        let shade = |x: f64, z: f64| math::ln(f64::from(surface.at(DVec2::new(x, z), 1e-3).albedo[1]));
        // Squares of 0.4 m, each seen at 64 places.
        let (squares, side) = (900, 0.4);
        let (mut coarse, mut all) = (Vec::new(), Vec::new());
        for square in 0..squares {
            let corner = [square % 30, square / 30].map(|step| 1.7 * f64::from(step));
            let within = (0..64)
                .map(|i| shade(corner[0] + side / 8.0 * f64::from(i % 8), corner[1] + side / 8.0 * f64::from(i / 8)));
            let within: Vec<f64> = within.collect();
            coarse.push(within.iter().sum::<f64>() / 64.0);
            all.extend(within);
        }
        let variance = |values: &[f64]| {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / values.len() as f64
        };
        let share = variance(&coarse) / variance(&all);
        assert!(share < 0.15, "{share}");
    }

    #[test]
    fn water_mirrors_two_hundredths_from_above_and_all_at_the_horizon() {
        assert!((fresnel(1.0) - 0.0204).abs() < 1e-12);
        assert!((fresnel(0.0) - 1.0).abs() < 1e-12);
        assert!((0.05..0.07).contains(&fresnel(0.5)));
    }
}
