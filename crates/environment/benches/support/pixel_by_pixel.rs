//! The ground one pixel at a time in double precision: the naive version of `ground`, without obstacles and plates.
//!
//! The equations are those of the table in `ground/mod.rs`; every pixel evaluates all of them again.

use std::f64::consts::{PI, TAU};

use bansho_base::{
    color::acescg_from_srgb,
    math::{
        self, DVec2, DVec3, MulAdd,
        random::{Key, Purpose, uniform_f64},
    },
    noise::{Coordinate, Fractal, Noise, VARIANCE},
    phenomenon::{
        strip::{Strip, View},
        surroundings::{Emitter, Reflection, Surroundings},
    },
    world::gravity::STANDARD_GRAVITY,
};
use bansho_environment::ground::{GroundKind, GroundParameters};

/// Octaves of the ground's texture, each of half the size of the one before.
const OCTAVES: usize = 8;
/// Amplitude of the largest octave, and the ratio of successive amplitudes. Soil and asphalt have most of their
/// contrast at the scale of grains: with as much at large scales, bright ground would look like clouds.
const BASE_AMPLITUDE: f64 = 0.2;
const AMPLITUDE_GAIN: f64 = 1.24;
/// Ratio of successive heights in the relief.
const RELIEF_GAIN: f64 = 0.6;
/// Standard deviation of the relief, which is approximately normal.
const RELIEF_DEVIATION: f64 = 0.34;
/// Octaves are evaluated one by one, so that each fades out where a pixel cannot resolve it.
const SINGLE_OCTAVE: Fractal = Fractal { octaves: 1, lacunarity: 2, gain: 0.5 };

/// Bumps of a film of water: size of the largest, m, octaves of half the size each, and the fraction of the film's
/// slope variance that they carry.
const BUMP_SIZE: f64 = 0.15;
const BUMP_OCTAVES: usize = 3;
const BUMP_VARIANCE_FRACTION: f64 = 0.4;
/// Slope of grains that protrude from the film, relative to that of the film.
const GRAIN_SLOPE_RATIO: f64 = 3.0;
/// Largest fraction of wet ground that is film between the grains.
const MAX_FILM_FRACTION: f64 = 0.6;

/// The pattern of the ground.
struct Surface {
    albedo: [f32; 3],
    texture: f64,
    size: f64,
    octaves: Vec<Noise<2>>,
    puddles: f64,
    roughness: f64,
}

/// The ground at one position.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SurfaceSample {
    /// Albedo when dry.
    albedo: [f32; 3],
    /// Fraction covered by puddles when wet.
    puddle: f64,
    /// Fraction of the rest with an unbroken film of water; high ground has grains that protrude from it.
    film: f64,
}

impl Surface {
    fn new(parameters: &GroundParameters, key: Key) -> Self {
        let words = [0, 1].map(|id| key.words(id, 0, Purpose::named("ground")));
        let octaves =
            words.as_flattened().iter().take(OCTAVES).filter_map(|&seed| Noise::new(seed, SINGLE_OCTAVE, [0, 0]).ok());
        Self {
            albedo: acescg_from_srgb(parameters.color.map(|value| value as f32)),
            texture: parameters.texture,
            size: parameters.texture_size,
            octaves: octaves.collect(),
            puddles: parameters.puddles,
            roughness: parameters.roughness,
        }
    }

    /// The ground at a position (x, z), filtered with a pixel's `footprint`, m.
    fn at(&self, position: DVec2, footprint: f64) -> SurfaceSample {
        let (mut grain, mut relief) = (0.0, 0.0);
        let (mut size, mut amplitude, mut height) = (self.size, BASE_AMPLITUDE, 1.0_f64);
        for octave in &self.octaves {
            let visibility = math::smoothstep(1.0, 3.0, size / footprint.max(1e-9));
            if visibility <= 0.0 {
                break;
            }
            let coordinates = [position.x / size, position.y / size].map(Coordinate::from_f64);
            let value = visibility * f64::from(octave.at(coordinates));
            (grain, relief) = (amplitude.fma(value, grain), height.fma(value, relief));
            (size, amplitude, height) = (0.5 * size, AMPLITUDE_GAIN * amplitude, RELIEF_GAIN * height);
        }
        let shade = math::exp(self.texture * grain) as f32;
        let albedo = self.albedo.map(|value| (value * shade).min(1.0));
        let pixels = self.size / footprint.max(1e-9);
        let visibility = |first: f64, whole: f64| math::smoothstep(first, whole, pixels);
        SurfaceSample {
            albedo,
            puddle: math::lerp(self.puddles, self.puddle_fraction(relief), visibility(1.0, 3.0)),
            // Films have sharp edges and strong highlights: filtered earlier, so that the horizon has no flicker of
            // dashes.
            film: math::lerp(0.5, film_fraction(relief), visibility(2.0, 8.0)),
        }
    }

    /// The microfacets of wet ground at a position (x, z), filtered with a pixel's `footprint`, m; `film` is the
    /// fraction with a film.
    fn microfacets(&self, position: DVec2, footprint: f64, film: f64) -> Microfacets {
        let amplitude = math::sqrt(BUMP_VARIANCE_FRACTION / BUMP_OCTAVES as f64) * self.roughness;
        let deviation = math::sqrt(VARIANCE[0]);
        let (mut tilt, mut unresolved_variance, mut size) = (DVec2::ZERO, self.roughness * self.roughness, BUMP_SIZE);
        for pair in self.octaves.chunks_exact(2).take(BUMP_OCTAVES) {
            let visibility = math::smoothstep(1.5, 5.0, size / footprint.max(1e-9));
            if visibility <= 0.0 {
                break;
            }
            // Offset, because the texture uses the same noise.
            let coordinates = [position.x / size + 61.3, position.y / size - 17.7].map(Coordinate::from_f64);
            let slope = [0, 1].map(|axis| f64::from(pair[axis].at(coordinates)) / deviation);
            tilt += DVec2::from(slope) * (visibility * amplitude);
            unresolved_variance -= visibility * visibility * amplitude * amplitude;
            size *= 0.5;
        }
        let grain = GRAIN_SLOPE_RATIO * self.roughness;
        Microfacets { tilt, slopes: [math::sqrt(unresolved_variance), grain], film: MAX_FILM_FRACTION * film }
    }

    /// Fraction of puddles: water collects where the relief is low.
    fn puddle_fraction(&self, relief: f64) -> f64 {
        // The normal quantile at a probability p is approximately the logistic one.
        let fraction = self.puddles.clamp(1e-6, 1.0 - 1e-6);
        let level = RELIEF_DEVIATION * math::ln(fraction / (1.0 - fraction)) / 1.7;
        1.0 - math::smoothstep(level - 0.12, level + 0.12, relief)
    }
}

/// Fraction of film: half of the ground, with soft edges.
fn film_fraction(relief: f64) -> f64 {
    1.0 - math::smoothstep(-RELIEF_DEVIATION, RELIEF_DEVIATION, relief)
}

/// The film of water at a position.
struct Microfacets {
    tilt: DVec2,
    slopes: [f64; 2],
    film: f64,
}

/// Fresnel reflectance of water at the cosine of the angle of incidence (Schlick 1994, n = 1.333).
fn fresnel(cos: f64) -> f64 {
    let grazing = 1.0 - cos.clamp(0.0, 1.0);
    let fifth = grazing * grazing * grazing * grazing * grazing;
    0.0204 + 0.9796 * fifth
}

impl Microfacets {
    /// Radiance toward `viewer` for an illuminance of one lux from `light` on a plane that faces it: `F D G / (4
    /// cos_viewer)` (Cook & Torrance 1982). A light of angular diameter `width` widens the distribution.
    fn specular_lobe(&self, light: DVec3, viewer: DVec3, width: f64) -> f64 {
        let Some(half) = (light + viewer).try_normalize() else { return 0.0 };
        if light.y <= 0.0 || viewer.y <= 0.0 {
            return 0.0;
        }
        let slope = DVec2::new(-half.x, -half.z) / half.y - self.tilt;
        let square = slope.length_squared();
        let weight = |slope: f64| {
            gtr3_distribution_with_masking(square, math::hypot(slope.max(1e-3), 0.25 * width), light.y, viewer.y)
        };
        let microfacets = math::lerp(weight(self.slopes[1]), weight(self.slopes[0]), self.film);
        let cos_squared = half.y * half.y;
        fresnel(viewer.dot(half)) * microfacets / (4.0 * viewer.y.max(1e-3) * cos_squared * cos_squared)
    }

    /// Mean slope toward a viewer.
    fn mean_slope(&self) -> f64 {
        math::lerp(self.slopes[1], self.slopes[0], self.film)
    }
}

/// GTR distribution D of facets whose slope differs by the root of `square` from the mean, times Smith masking and
/// shadowing G for the cosines of light and viewer.
fn gtr3_distribution_with_masking(square: f64, slope: f64, light: f64, viewer: f64) -> f64 {
    /// Square of the scale at which the median slope equals that of a Gaussian: `2 ln 2 / (sqrt 2 - 1)`.
    const MEDIAN: f64 = 3.346_817;
    let width = MEDIAN * slope * slope;
    let tail = 1.0 + square / width;
    let masking = |cos: f64| 0.5 * (math::sqrt(1.0 + width * (1.0 / (cos * cos).max(1e-9) - 1.0)) - 1.0);
    2.0 / (PI * width * tail * tail * tail * (1.0 + masking(light) + masking(viewer)))
}

/// Number of waves in the sum: enough to show no beat, few enough to evaluate at every pixel.
const WAVE_COUNT: usize = 14;
/// Ratio of the longest to the shortest wavelength.
const LENGTH_RATIO: f64 = 40.0;
/// Largest angle between a wave and the wind, radians.
const MAX_ANGLE: f64 = 0.42 * PI;

/// One wave: slope = amplitude * cos(k . x - omega t + phase) along k.
#[derive(Clone, Copy, Debug)]
struct Wave {
    vector: DVec2,
    length: f64,
    phase: f64,
    slope: DVec2,
}

/// The waves at one time.
#[derive(Clone, Debug)]
struct Waves {
    waves: Vec<Wave>,
}

/// The slope of the water at a position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct WaveSlope {
    /// Slope along x and z, of the waves that a pixel resolves.
    resolved: DVec2,
    /// Fraction of the slope variance in waves too short to be resolved.
    unresolved: f64,
}

impl Waves {
    /// Waves with an r.m.s. `slope` and a maximum wavelength `longest` (m), in a wind toward `heading`, at time `t`. In
    /// a loop every wave is periodic in `loop_s` seconds.
    fn new(key: Key, slope: f64, longest: f64, heading: DVec2, t: f64, loop_s: Option<f64>) -> Self {
        let wave = |index: usize| {
            let words = key.words(index as u64, 0, Purpose::named("wave"));
            let [turn, phase] = [uniform_f64(words[0], words[1]), uniform_f64(words[2], words[3])];
            let fraction = index as f64 / (WAVE_COUNT - 1) as f64;
            let length = longest * math::pow(LENGTH_RATIO, -fraction);
            let along = heading.rotate(unit_vector((2.0 * turn - 1.0) * MAX_ANGLE));
            let number = TAU / length;
            // Dispersion relation of deep water: omega^2 = g k.
            let frequency = quantize_frequency(math::sqrt(STANDARD_GRAVITY * number) / TAU, loop_s) * t;
            let amplitude = slope * math::sqrt(2.0 / WAVE_COUNT as f64);
            Wave {
                vector: along * number,
                length,
                phase: TAU * (phase - frequency.rem_euclid(1.0)),
                slope: along * amplitude,
            }
        };
        Self { waves: (0..WAVE_COUNT).map(wave).collect() }
    }

    /// The slope at a position (x, z), filtered with a pixel's `footprint`, m.
    fn slope(&self, position: DVec2, footprint: f64) -> WaveSlope {
        let mut slope = WaveSlope::default();
        for wave in &self.waves {
            // Below two pixels a wave is not resolved, from six pixels on wholly.
            let visibility = math::smoothstep(2.0, 6.0, wave.length / footprint.max(1e-9));
            if visibility > 0.0 {
                slope.resolved += wave.slope * (visibility * math::cos(wave.vector.dot(position) + wave.phase));
            }
            slope.unresolved += (1.0 - visibility * visibility) / WAVE_COUNT as f64;
        }
        slope
    }
}

/// Rounds a frequency (1/s) to a whole number of periods in the loop.
fn quantize_frequency(frequency: f64, loop_s: Option<f64>) -> f64 {
    loop_s.map_or(frequency, |seconds| (frequency * seconds).round().max(1.0) / seconds)
}

/// The unit vector at an angle.
fn unit_vector(angle: f64) -> DVec2 {
    let (sin, cos) = math::sin_cos(angle);
    DVec2::new(cos, sin)
}

/// Depth at which the ground ends, m.
const HORIZON: f64 = 1e6;

/// Where the line of sight of a pixel meets the ground.
struct Hit {
    pixel: DVec2,
    point: DVec3,
    depth: f64,
    cos: f64,
    footprint: f64,
    coverage: f64,
}

/// One frame of the ground.
pub(crate) struct PixelByPixel<'a> {
    parameters: &'a GroundParameters,
    view: &'a View,
    surroundings: &'a Surroundings<'a>,
    wetness: f64,
    surface: Surface,
    waves: Waves,
}

impl<'a> PixelByPixel<'a> {
    /// The ground of a view.
    pub(crate) fn new(
        parameters: &'a GroundParameters,
        seed: u64,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
    ) -> Self {
        let (key, t) = (Key::new(seed, "ground"), view.shutter.middle());
        let wind = surroundings.wind.planned_mean(t);
        let heading = DVec2::new(wind.x, wind.z).try_normalize().unwrap_or(DVec2::X);
        let wetness = if parameters.kind == GroundKind::Water { 1.0 } else { parameters.wetness.at(t) };
        Self {
            parameters,
            view,
            surroundings,
            wetness,
            surface: Surface::new(parameters, key),
            waves: Waves::new(key, parameters.waves, parameters.wave_length, heading, t, None),
        }
    }

    /// Draws it into a strip.
    pub(crate) fn draw(&self, strip: &mut Strip) {
        let rect = strip.rect;
        for index in 0..strip.len() {
            let pixel = DVec2::new((rect.x + index % rect.width) as f64, (rect.y + index / rect.width) as f64) + 0.5;
            if let Some(hit) = self.hit(pixel) {
                let transmittance = 1.0 - hit.coverage as f32;
                strip.add_behind(index, self.radiance(&hit), [transmittance; 3], hit.depth as f32);
            }
        }
    }

    fn hit(&self, pixel: DVec2) -> Option<Hit> {
        let camera = &self.view.camera;
        let direction = camera.direction(pixel)?;
        let length = direction.length();
        let cos = -direction.y / length;
        // A pixel subtends about 1 / focal radians.
        let coverage = (cos * camera.focal_pixels + 0.5).clamp(0.0, 1.0);
        let camera_height = camera.position.y - self.parameters.height;
        if coverage <= 0.0 || camera_height <= 0.0 {
            return None;
        }
        let cos = cos.max(0.5 / camera.focal_pixels);
        let distance = (camera_height / cos).min(HORIZON * 0.5);
        let depth = distance / length;
        let footprint = distance / (camera.focal_pixels * math::sqrt(cos.max(1e-6)));
        Some(Hit { pixel, point: camera.position + direction * depth, depth, cos, footprint, coverage })
    }

    fn radiance(&self, hit: &Hit) -> [f32; 3] {
        let position = DVec2::new(hit.point.x, hit.point.z);
        let sample = self.surface.at(position, hit.footprint);
        let (diffuse, specular) = (self.diffuse(hit, &sample), self.specular(hit, &sample));
        [0, 1, 2].map(|c| hit.coverage as f32 * (diffuse[c] + specular[c]))
    }

    fn diffuse(&self, hit: &Hit, sample: &SurfaceSample) -> [f32; 3] {
        let mut illuminance = self.surroundings.sky.horizontal_illuminance();
        for light in &self.surroundings.others.lights {
            let (each, toward) = light.illuminance(hit.point);
            (0..3).for_each(|c| illuminance[c] = each[c].fma(toward.y.max(0.0) as f32, illuminance[c]));
        }
        let wet = (1.0 - 0.55 * self.wetness) * (1.0 - 0.4 * self.wetness * sample.puddle);
        let water = self.parameters.kind == GroundKind::Water;
        let albedo = if water { [0.02; 3] } else { sample.albedo.map(|value| value * wet as f32) };
        [0, 1, 2].map(|c| illuminance[c] * albedo[c] / std::f32::consts::PI)
    }

    fn specular(&self, hit: &Hit, sample: &SurfaceSample) -> [f32; 3] {
        if self.wetness <= 0.0 {
            return [0.0; 3];
        }
        let mirrored = |pixel: DVec2| self.surroundings.reflection.map_or([0.0; 4], |seen| sampled(seen, pixel));
        let fresnel = fresnel(hit.cos) as f32;
        if self.parameters.kind == GroundKind::Water {
            let slope = self.waves.slope(DVec2::new(hit.point.x, hit.point.z), hit.footprint);
            let (color, unresolved) = (mirrored(self.reflected_pixel(hit, slope)), slope.unresolved as f32);
            // The tests blur nothing: their reflection is even along both axes where waves are not resolved.
            let blurred = mirrored(hit.pixel);
            return [0, 1, 2].map(|c| fresnel * unresolved.fma(blurred[c], (1.0 - unresolved) * color[c]));
        }
        let (color, glossy) = (mirrored(hit.pixel), self.glossy_reflection(hit, sample));
        let (puddle, wetness) = (sample.puddle as f32, self.wetness as f32);
        [0, 1, 2].map(|c| wetness * (puddle * fresnel).fma(color[c], (1.0 - puddle) * glossy[c]))
    }

    fn glossy_reflection(&self, hit: &Hit, sample: &SurfaceSample) -> [f32; 3] {
        let position = DVec2::new(hit.point.x, hit.point.z);
        let microfacets = self.surface.microfacets(position, hit.footprint, sample.film);
        let viewer = (self.view.camera.position - hit.point).normalize_or_zero();
        let rise = math::hypot(viewer.y, microfacets.mean_slope());
        let sky = self.surroundings.sky.radiance(DVec3::new(-viewer.x, rise, -viewer.z).normalize());
        let mut radiance = sky.map(|value| value * fresnel(rise) as f32);
        for light in &self.surroundings.others.lights {
            let (illuminance, toward) = light.illuminance(hit.point);
            let width = match light.emitter {
                Emitter::Point { position, radius } => radius / (position - hit.point).length().max(radius),
                Emitter::Directional { .. } | Emitter::Spot { .. } => 0.0,
            };
            let weight = microfacets.specular_lobe(toward, viewer, width) as f32;
            (0..3).for_each(|c| radiance[c] = illuminance[c].fma(weight, radiance[c]));
        }
        radiance
    }

    /// The pixel of the mirrored picture that a tilted wave shows, for distant objects: the reflection turns by twice
    /// the tilt.
    fn reflected_pixel(&self, hit: &Hit, slope: WaveSlope) -> DVec2 {
        let camera = &self.view.camera;
        let view_direction = (hit.point - camera.position).normalize_or_zero();
        let normal = DVec3::new(-slope.resolved.x, 1.0, -slope.resolved.y).normalize();
        let reflected = view_direction - 2.0 * view_direction.dot(normal) * normal;
        let below = DVec3::new(reflected.x, -reflected.y.abs(), reflected.z);
        camera.project(camera.position + below * HORIZON).map_or(hit.pixel, |position| position.pixel)
    }
}

/// The picture in the mirror at a position in pixels of the view.
fn sampled(reflection: &Reflection, pixel: DVec2) -> [f32; 4] {
    let position = pixel / reflection.pixel_size as f64 - DVec2::Y * reflection.first_row as f64;
    reflection.image.sample_bilinear(position)
}
