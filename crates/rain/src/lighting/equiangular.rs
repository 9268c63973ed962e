//! Light of a lamp that the rain scatters toward the camera along one line of sight: equiangular quadrature (Kulla & Fajardo 2012), sixteen samples at a
//! time.
//!
//! With the distance s along the line, `u = s - s_0` counted from the point nearest to the lamp, and h the lamp's distance from that point, a lamp sees
//! the interval from `u1` to `u2` under the angle `atan2(h (u2 - u1), h^2 + u1 u2)`. In steps of equal angle `ds / r^2 = d(angle) / h`, so the
//! integrand has no peak near the lamp. Positions are counted from the start of an interval, which needs no tangent and keeps single precision sufficient.

use std::sync::Arc;

use bansho_base::{
    math::{
        DVec3, approximations,
        simd::{LANES, Real},
    },
    phenomenon::surroundings::{Emitter, Light},
};

use super::{
    drop_lighting::ScatteringTable, extinction::ExtinctionProfile, lamp_shadows::LampShadows, shadow_map::ShadowMap,
};
use crate::lanes::{LaneArray, ZERO_LANES};

/// Angle subtended at a lamp by one sample, radians.
const SAMPLE_ANGLE: f32 = 0.15;
/// Smallest distance of a ray from a lamp, m.
pub(super) const MIN_LAMP_DISTANCE: f64 = 0.02;
/// Distance of a lamp beyond which its light is neglected, m: single precision holds its powers.
const MAX_LAMP_DISTANCE: f64 = 1e9;
/// Square of the smallest distance between a lamp and a drop, m^2.
const MIN_SQUARE: f64 = 1e-12;
/// Largest number of points of a sample at which the shadow of a solid is looked up.
const MAX_SHADOW_POINTS: f32 = 24.0;
const TURNS_PER_RADIAN: f32 = (1.0 / std::f64::consts::TAU) as f32;

/// An interval of distances from the eye that lamps light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    /// m.
    pub(super) start: f64,
    /// m.
    pub(super) width: f32,
    /// Optical depth at its start, and its increase per meter.
    pub(super) depth: f32,
    pub(super) depth_slope: f32,
}

/// The rain around the eye.
pub(super) struct SightLineIntegrator<'a> {
    pub(super) scattering: &'a ScatteringTable,
    pub(super) extinction: ExtinctionProfile<'a>,
    pub(super) shadows: &'a LampShadows,
    /// Extinction coefficient between a light and a drop, 1/m.
    pub(super) light_extinction: f32,
    pub(super) intervals: &'a [Interval],
    pub(super) eye: DVec3,
    /// Height of the eye over the ground, m.
    pub(super) eye_height: f32,
}

/// A lamp as seen from a line of sight.
struct LampAtLine {
    /// Distance along the line of the point nearest to it, m.
    nearest: f64,
    /// Its distance from that point, at least [`MIN_LAMP_DISTANCE`], m.
    height: f32,
    /// The square of that distance, m^2, without the bound.
    height_squared: f32,
    /// The vector from the lamp to that point, m.
    from_lamp: [f32; 3],
    /// Square of the distance within which the illuminance is constant, m^2.
    min_square: f32,
    /// Cone of a spot: `falloff_slope (cos angle) + falloff_offset`, with `r cos angle = cone_offset + cone_slope u`.
    cone: [f32; 2],
    falloff: [f32; 2],
}

/// Samples of one lamp along a line of sight.
struct SampleBatch {
    count: usize,
    interval: [u32; LANES],
    /// Distance of the start of the interval from the eye, and from the point nearest to the lamp, m.
    start: LaneArray,
    u: LaneArray,
    width: LaneArray,
    depth: LaneArray,
    depth_slope: LaneArray,
    /// Angle at the lamp from the start to the sample, and of the sample itself, radians.
    angle: LaneArray,
    step: LaneArray,
}

impl SampleBatch {
    const EMPTY: Self = Self {
        count: 0,
        interval: [0; LANES],
        start: ZERO_LANES,
        u: ZERO_LANES,
        width: ZERO_LANES,
        depth: ZERO_LANES,
        depth_slope: ZERO_LANES,
        angle: ZERO_LANES,
        step: ZERO_LANES,
    };

    #[inline(always)]
    fn push(&mut self, index: usize, interval: &Interval, u: f32, angle: f32, step: f32) {
        let i = self.count % LANES;
        self.interval[i] = index as u32;
        self.start[i] = interval.start as f32;
        (self.u[i], self.width[i]) = (u, interval.width);
        (self.depth[i], self.depth_slope[i]) = (interval.depth, interval.depth_slope);
        (self.angle[i], self.step[i]) = (angle, step);
        self.count += 1;
    }

    /// Clears the lanes that are not in use: samples of no length.
    #[inline(always)]
    fn clear_unused(&mut self) {
        for i in 0..LANES {
            self.step[i] = if i < self.count { self.step[i] } else { 0.0 };
        }
    }
}

impl LampAtLine {
    /// `None` for a light at infinity, or so far away that its light is neglected.
    #[inline(always)]
    fn new(light: &Light, eye: DVec3, direction: DVec3) -> Option<Self> {
        let position = light.emitter.position()?;
        let offset = position - eye;
        let nearest = offset.dot(direction);
        let height = (offset - direction * nearest).length();
        let is_in_reach = nearest.abs() < MAX_LAMP_DISTANCE && height < MAX_LAMP_DISTANCE;
        if !is_in_reach {
            return None;
        }
        let (min_square, cone, falloff) = match light.emitter {
            Emitter::Spot { axis, cos_inner, cos_outer, .. } => {
                let rise = 1.0 / (cos_inner - cos_outer).max(1e-6);
                let cone = [(direction * nearest - offset).dot(axis), direction.dot(axis)];
                (MIN_SQUARE, cone, [rise, -cos_outer * rise])
            }
            Emitter::Point { radius, .. } => ((radius * radius).max(MIN_SQUARE), [0.0; 2], [0.0, 1.0]),
            Emitter::Directional { .. } => return None,
        };
        Some(Self {
            nearest,
            height: height.max(MIN_LAMP_DISTANCE) as f32,
            height_squared: (height * height) as f32,
            from_lamp: (direction * nearest - offset).as_vec3().to_array(),
            min_square: min_square as f32,
            cone: cone.map(|value| value as f32),
            falloff: falloff.map(|value| value as f32),
        })
    }
}

/// A line of sight, and the shadows in the light of a lamp.
struct LineOfSight<'a> {
    /// Unit vector.
    direction: [f32; 3],
    shadow: Option<&'a Arc<ShadowMap>>,
}

/// Sixteen samples in the light of a lamp.
struct LitSamples {
    /// `beta e^-tau ds / r^2`, with the lamp's cone.
    weights: LaneArray,
    /// Sine of half the scattering angle.
    half_sines: LaneArray,
    /// Distance u from the point nearest to the lamp, m.
    positions: LaneArray,
}

impl LampAtLine {
    /// Fraction of a sample around the position `u` (m), which subtends the angle `step` (radians) at the lamp, that no solid shadows: the mean over points in equal
    /// steps of the angle, as many as cells of the shadow map.
    #[inline(always)]
    fn visible_fraction(&self, shadow: &ShadowMap, direction: &[f32; 3], u: f32, step: f32) -> f32 {
        let h = self.height;
        let count = (step / shadow.cell_angle()).ceil().simd_max(1.0).simd_min(MAX_SHADOW_POINTS);
        let per_point = step / count;
        let mut visible = 0.0;
        for index in 0..count as i32 {
            let turns = per_point * (index as f32 + 0.5 - 0.5 * count) * TURNS_PER_RADIAN;
            let (sine, cosine) = (approximations::sin_turns(turns), approximations::cos_turns(turns));
            // h tan of the angle of u, turned: the addition theorem. Rounding must not lead beyond a right angle.
            let position = h * u.fma(cosine, h * sine) / h.fma(cosine, -(u * sine)).simd_max(1e-6 * h);
            let mut offset = self.from_lamp;
            for axis in 0..3 {
                offset[axis] = direction[axis].fma(position, offset[axis]);
            }
            visible += shadow.visibility(offset);
        }
        visible / count
    }
}

impl SightLineIntegrator<'_> {
    /// Light of some lamps that is scattered toward the eye, up to the start of each interval and up to the end of the last, added up from the eye
    /// into `sums` (one more than intervals); ACEScg, cd/m^2. The fourth component is 0.
    #[inline(always)]
    pub(super) fn accumulate(&self, direction: DVec3, lights: &[Light], sums: &mut [[f32; 4]]) {
        sums.fill([0.0; 4]);
        if direction == DVec3::ZERO {
            return;
        }
        for light in lights {
            match light.emitter {
                Emitter::Directional { toward } => self.add_directional(light, toward, direction, sums),
                Emitter::Point { .. } | Emitter::Spot { .. } => self.add_lamp(light, direction, sums),
            }
        }
        // Sums from the eye on: the light of any part of the line is then a difference of two of them, wherever a slice is cut.
        for k in 1..sums.len() {
            for c in 0..3 {
                sums[k][c] += sums[k - 1][c];
            }
        }
    }

    /// Adds the light of a lamp that is scattered within each interval: `integral of beta E p / (4 pi) e^-tau ds`.
    #[inline(always)]
    fn add_lamp(&self, light: &Light, direction: DVec3, sums: &mut [[f32; 4]]) {
        let Some(lamp) = LampAtLine::new(light, self.eye, direction) else { return };
        let h = lamp.height;
        let line = LineOfSight { direction: direction.as_vec3().to_array(), shadow: self.shadows.of(&light.emitter) };
        let mut batch = SampleBatch::EMPTY;
        for (index, interval) in self.intervals.iter().enumerate() {
            let u = (interval.start - lamp.nearest) as f32;
            // The angle between both ends as one arctangent: a difference of two would cancel for short intervals far from the lamp.
            let angle = approximations::atan2(h * interval.width, h.fma(h, u * (u + interval.width)));
            let samples = (angle * (1.0 / SAMPLE_ANGLE)).ceil().simd_max(1.0);
            let step = angle / samples;
            for sample in 0..samples as i32 {
                // Samples of different intervals share a batch: most intervals have a single one, and lanes would be idle.
                batch.push(index, interval, u, step * (sample as f32 + 0.5), step);
                if batch.count == LANES {
                    self.add_batch(light, &lamp, &line, &batch, sums);
                    batch.count = 0;
                }
            }
        }
        if batch.count > 0 {
            batch.clear_unused();
            self.add_batch(light, &lamp, &line, &batch, sums);
        }
    }

    #[inline(always)]
    fn add_batch(
        &self,
        light: &Light,
        lamp: &LampAtLine,
        line: &LineOfSight,
        batch: &SampleBatch,
        sums: &mut [[f32; 4]],
    ) {
        let LitSamples { mut weights, half_sines, positions } = self.lit_samples(lamp, line.direction[1], batch);
        if let Some(shadow) = line.shadow {
            for i in 0..LANES {
                // Neighboring samples are mostly all lit or none, so that this branch is predicted.
                if weights[i] > 0.0 {
                    weights[i] *= lamp.visible_fraction(shadow, &line.direction, positions[i], batch.step[i]);
                }
            }
        }
        let mut total = 0.0;
        for i in 0..LANES {
            total += weights[i];
        }
        // Most lines of sight miss the cone of a spot.
        if total == 0.0 {
            return;
        }
        for i in 0..LANES {
            // The table is uniform in the sine of half the angle, which resolves the peak of the phase function around straight on.
            let scattered = self.scattering.at_half_sine(half_sines[i]);
            let sum = &mut sums[batch.interval[i] as usize + 1];
            for c in 0..3 {
                sum[c] += light.intensity[c] * weights[i] * scattered[c];
            }
        }
    }

    /// The light of sixteen samples without shadows, on a line of sight that climbs by this height per meter.
    #[inline(always)]
    fn lit_samples(&self, lamp: &LampAtLine, climb: f32, batch: &SampleBatch) -> LitSamples {
        let h = lamp.height;
        let (mut weights, mut half_sines, mut distances) = (ZERO_LANES, ZERO_LANES, ZERO_LANES);
        let mut positions = ZERO_LANES;
        for i in 0..LANES {
            // The point at the angle from the start: the direction (h, u) at the lamp, turned by the angle.
            let turns = batch.angle[i] * TURNS_PER_RADIAN;
            let (sine, cosine) = (approximations::sin_turns(turns), approximations::cos_turns(turns));
            let from = batch.u[i];
            // h tan(a + angle) less h tan a, as one quotient: the difference of the tangents would cancel. It is clamped, since rounding may lead out
            // of the interval.
            let advance = sine * from.fma(from, h * h) / h.fma(cosine, -(from * sine));
            let advance = advance.simd_max(0.0).simd_min(batch.width[i]);
            let u = from + advance;
            positions[i] = u;
            // ds = (h^2 + u^2) / h da.
            let length = batch.step[i] * u.fma(u, h * h) / h;
            let square = u.fma(u, lamp.height_squared);
            let r = square.sqrt().simd_max(1e-9);
            let cone_cosine = u.fma(lamp.cone[1], lamp.cone[0]) / r;
            let cone = cone_cosine.fma(lamp.falloff[0], lamp.falloff[1]).simd_clamp01();
            let falloff = cone * cone * (3.0 - 2.0 * cone);
            // The light comes along (h, u): without cancellation, 2 r sin^2 (angle / 2) = r + u = h^2 / (r - u).
            let excess = if u < 0.0 { lamp.height_squared / (r - u) } else { r + u };
            half_sines[i] = (0.5 * excess / r).simd_clamp01().sqrt();
            distances[i] = batch.start[i] + advance;
            let depth = batch.depth_slope[i].fma(advance, batch.depth[i]) + self.light_extinction * r;
            let is_over_ground = climb.fma(distances[i], self.eye_height) >= 0.0;
            let weight = falloff * length / square.simd_max(lamp.min_square) * approximations::exp(-depth);
            weights[i] = if is_over_ground { weight } else { 0.0 };
        }
        let extinction = self.extinction.at_lanes(&distances);
        for i in 0..LANES {
            weights[i] *= extinction[i].simd_max(0.0);
        }
        LitSamples { weights, half_sines, positions }
    }

    /// Adds the light of a lamp at infinity, whose illuminance is the same everywhere: one sample for each interval.
    #[inline(always)]
    fn add_directional(&self, light: &Light, toward: DVec3, direction: DVec3, sums: &mut [[f32; 4]]) {
        let scattered = self.scattering.at(toward.dot(direction) as f32);
        for (index, interval) in self.intervals.iter().enumerate() {
            let half = 0.5 * interval.width;
            let distance = interval.start as f32 + half;
            let extinction = self.extinction.at(f64::from(distance)).max(0.0) as f32;
            let is_over_ground = (direction.y as f32).fma(distance, self.eye_height) >= 0.0;
            if !is_over_ground {
                continue;
            }
            let depth = interval.depth_slope.fma(half, interval.depth);
            let weight = extinction * interval.width * approximations::exp(-depth);
            for c in 0..3 {
                sums[index + 1][c] += light.intensity[c] * weight * scattered[c];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math;
    use fearless_simd::dispatch;

    use super::*;
    use crate::{
        Rain, RainParameters,
        lighting::{drop_lighting::DropLighting, extinction::RainExtinction},
        tests::{view_at, wind},
    };
    use bansho_base::phenomenon::surroundings::Surroundings;

    const DISTANCES: [f64; 8] = [0.0, 0.5, 1.3, 2.9, 5.2, 8.4, 21.0, 60.0];

    /// One light at a time, one sample at a time, in double precision, with tangents.
    fn naive(lighting: &DropLighting, profile: &ExtinctionProfile, eye: DVec3, line: DVec3, k: usize) -> [f64; 3] {
        let light = &lighting.lights[0];
        let [from, to] = [DISTANCES[k], DISTANCES[k + 1]];
        let sample = |at: f64, length: f64| {
            let point = eye + line * at;
            let is_over_ground = point.y >= profile.shutter_state.ground;
            let weight = profile.at(at) * length * math::exp(-0.01 * at) * f64::from(u8::from(is_over_ground));
            lighting.radiance(light, point, line).map(|value| f64::from(value) * weight)
        };
        let Some(position) = light.emitter.position() else { return sample(0.5 * (from + to), to - from) };
        let nearest = (position - eye).dot(line);
        let h = (position - eye - line * nearest).length().max(MIN_LAMP_DISTANCE);
        let [first, last] = [from, to].map(|s| math::atan((s - nearest) / h));
        let samples = ((last - first) / f64::from(SAMPLE_ANGLE)).ceil().max(1.0);
        let step = (last - first) / samples;
        (0..samples as usize).fold([0.0; 3], |sum: [f64; 3], index| {
            let offset = h * math::tan(first + step * (index as f64 + 0.5));
            let light = sample(nearest + offset, step * (h * h + offset * offset) / h);
            std::array::from_fn(|c| sum[c] + light[c])
        })
    }

    #[test]
    fn sixteen_samples_at_a_time_give_what_tangents_give_one_by_one() {
        let rain = Rain::new(RainParameters::default(), "rain", 1, None).unwrap();
        let (view, calm) = (view_at(1.0, 1.0 / 60.0, [64, 36]), wind([0.0; 3], 0.0));
        let shutter_state = rain.shutter_state(&view, &Surroundings::from_wind(&calm));
        let extinction = RainExtinction { all: 0.02, streaks: 0.008 };
        let profile = ExtinctionProfile { shutter_state: &shutter_state, extinction };
        let eye = DVec3::new(300.0, 1.6, -200.0);
        let interval = |pair: &[f64]| Interval {
            start: pair[0],
            width: (pair[1] - pair[0]) as f32,
            depth: (0.01 * pair[0]) as f32,
            depth_slope: 0.01,
        };
        let intervals: Vec<Interval> = DISTANCES.windows(2).map(interval).collect();
        let position = eye + DVec3::new(0.4, 2.0, -7.0);
        let axis = DVec3::new(0.1, -1.0, 0.2).normalize();
        let emitters = [
            Emitter::Point { position, radius: 0.05 },
            Emitter::Spot { position, axis, cos_inner: 0.9, cos_outer: 0.6 },
            Emitter::Directional { toward: DVec3::new(0.6, 0.8, 0.0) },
        ];
        let mut lit = 0;
        for emitter in emitters {
            let lights = [Light { emitter, intensity: [900.0, 500.0, 200.0] }];
            let shadows = LampShadows::default();
            let scattering = &rain.optics.scattering;
            let lighting = DropLighting { scattering, lights: &lights, shadows: &shadows, extinction: 0.02 };
            let integrator = SightLineIntegrator {
                scattering: lighting.scattering,
                extinction: profile,
                shadows: &shadows,
                light_extinction: 0.02,
                intervals: &intervals,
                eye,
                eye_height: (eye.y - shutter_state.ground) as f32,
            };
            for line in [[0.4, 2.0, -7.0], [0.0, 0.0, -1.0], [0.1, -0.3, -1.0], [0.41, 1.6, -7.0], [1.0, 0.2, 1.0]] {
                let line = DVec3::from(line).normalize();
                let mut sums = [[0.0; 4]; DISTANCES.len()];
                dispatch!(bansho_base::math::simd::level(), _simd => integrator.accumulate(line, &lights, &mut sums));
                let mut expected = [0.0; 3];
                for k in 0..intervals.len() {
                    let light = naive(&lighting, &profile, eye, line, k);
                    for c in 0..3 {
                        expected[c] += light[c];
                        let found = f64::from(sums[k + 1][c]);
                        assert!(
                            (found - expected[c]).abs() <= 2e-3 * expected[c] + 1e-9,
                            "{emitter:?} {line} {k}: {found} {}",
                            expected[c]
                        );
                    }
                    lit += usize::from(light[0] > 0.0);
                }
                let mut scalar = [[0.0; 4]; DISTANCES.len()];
                bansho_base::dispatch_baseline!(_simd => integrator.accumulate(line, &lights, &mut scalar));
                assert_eq!(sums, scalar, "at every vector width");
            }
        }
        assert!(lit > 60, "{lit}");
    }

    #[test]
    fn lamps_anywhere_give_finite_light() {
        let rain = Rain::new(RainParameters::default(), "rain", 1, None).unwrap();
        let (view, calm) = (view_at(1.0, 1.0 / 60.0, [64, 36]), wind([0.0; 3], 0.0));
        let shutter_state = rain.shutter_state(&view, &Surroundings::from_wind(&calm));
        let extinction = RainExtinction { all: 0.02, streaks: 0.008 };
        let intervals = [Interval { start: 0.0, width: 1e4, depth: 0.0, depth_slope: 0.02 }];
        let integrator = SightLineIntegrator {
            scattering: &rain.optics.scattering,
            extinction: ExtinctionProfile { shutter_state: &shutter_state, extinction },
            shadows: &LampShadows::default(),
            light_extinction: 0.02,
            intervals: &intervals,
            eye: DVec3::ZERO,
            eye_height: 1.0,
        };
        for offset in [0.0, 1e-30, 1e-3, 1e4, 9e8, 1e12, 1e200] {
            let emitter = Emitter::Point { position: DVec3::new(0.0, 0.0, -offset), radius: 0.0 };
            let mut sums = [[0.0; 4]; 2];
            let lights = [Light { emitter, intensity: [1e6; 3] }];
            dispatch!(bansho_base::math::simd::level(), _simd => integrator.accumulate(DVec3::NEG_Z, &lights, &mut sums));
            assert!(sums.iter().flatten().all(|value| value.is_finite() && *value >= 0.0), "{offset}: {sums:?}");
        }
    }
}
