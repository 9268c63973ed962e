//! Radiance of drops in the light of lamps and fires.

use std::sync::Arc;

use bansho_base::{
    math::{
        self, DVec3, approximations,
        simd::{LANES, Real},
    },
    phenomenon::surroundings::{Emitter, Light},
};

use super::{
    drop_phase_function::DropPhaseFunction, lamp_shadows::LampShadows, shadow_map::ShadowMap, tiles::lerp_color,
};
use crate::lanes::{LaneArray, Vec3Lanes, ZERO_LANES};

/// Steps of a [`ScatteringTable`].
const TABLE_STEPS: usize = 2048;

/// Radiance of a drop over its illuminance, `p / (4 pi)`, tabulated by the sine of half the scattering angle: this
/// needs only a square root of the cosine, and is finest in the forward direction.
#[derive(Debug)]
pub(crate) struct ScatteringTable {
    table: Vec<[f32; 3]>,
    /// Maximum over all colors and angles, 1/sr.
    max: f32,
}

impl ScatteringTable {
    pub(crate) fn new(phase_function: &DropPhaseFunction) -> Self {
        let mut table: Vec<[f32; 3]> = Vec::with_capacity(TABLE_STEPS + 1);
        for step in 0..=TABLE_STEPS {
            let half_sine = step as f32 / TABLE_STEPS as f32;
            let phase = phase_function.phase(1.0 - 2.0 * half_sine * half_sine);
            table.push(phase.map(|phase| phase * (0.25 / std::f32::consts::PI)));
        }
        let max = table.iter().flatten().copied().fold(0.0, f32::max);
        Self { table, max }
    }

    /// The value at the cosine of the scattering angle, 1/sr.
    #[inline(always)]
    pub(crate) fn at(&self, cos_deviation: f32) -> [f32; 3] {
        self.at_position(Self::position(cos_deviation))
    }

    /// The value at the sine of half the scattering angle (0 to 1), 1/sr.
    #[inline(always)]
    pub(super) fn at_half_sine(&self, half_sine: f32) -> [f32; 3] {
        self.at_position(half_sine * TABLE_STEPS as f32)
    }

    /// Table position for the cosine of the scattering angle.
    #[inline(always)]
    fn position(cos_deviation: f32) -> f32 {
        ((1.0 - cos_deviation) * 0.5).simd_clamp01().sqrt() * TABLE_STEPS as f32
    }

    /// Linear interpolation at a table position.
    #[inline(always)]
    fn at_position(&self, position: f32) -> [f32; 3] {
        let step = (position as i32 as usize).min(TABLE_STEPS - 1);
        lerp_color(self.table[step], self.table[step + 1], position - step as i32 as f32)
    }
}

/// The lamps and fires that light the drops.
#[derive(Clone, Copy)]
pub(crate) struct DropLighting<'a> {
    pub(crate) scattering: &'a ScatteringTable,
    pub(crate) lights: &'a [Light],
    /// The shadows of solids in their light.
    pub(crate) shadows: &'a LampShadows,
    /// Extinction coefficient between a light and a drop, 1/m.
    pub(crate) extinction: f64,
}

impl DropLighting<'_> {
    /// Mean radiance of a drop at `point` by one light, seen along `direction` (unit vector from the eye), ACEScg, cd/m^2:
    /// `E p / (4 pi)`. Computes for one drop what [`add`](Self::add) computes for sixteen.
    #[cfg(test)]
    pub(crate) fn radiance(&self, light: &Light, point: DVec3, direction: DVec3) -> [f32; 3] {
        let bansho_base::phenomenon::surroundings::IncidentLight { illuminance, toward, distance } =
            light.incident_light(point);
        if illuminance == [0.0; 3] {
            return [0.0; 3];
        }
        let transmittance = approximations::exp(-(self.extinction * distance) as f32);
        let scattered = self.scattering.at(toward.dot(direction) as f32);
        [0, 1, 2].map(|c| illuminance[c] * transmittance * scattered[c])
    }

    /// The lights, prepared for drops whose positions are relative to `eye`.
    pub(crate) fn prepare_lights(&self, eye: DVec3) -> Vec<PreparedLight> {
        self.lights.iter().map(|light| PreparedLight::new(light, self.shadows.of(&light.emitter), eye)).collect()
    }

    /// Adds the radiance of sixteen drops by a light, times `weights`.
    ///
    /// Weights of 0 are not skipped: a branch for each drop would be mispredicted and prevent vectorization.
    #[inline(always)]
    pub(crate) fn add(
        &self,
        light: &PreparedLight,
        positions: &Vec3Lanes,
        weights: &LaneArray,
        radiance: &mut [[f32; 3]; LANES],
    ) {
        let (mut factors, table_positions) = light.incident_light(positions, self.extinction as f32);
        if let Some(shadow) = &light.shadow {
            light.shade(shadow, positions, weights, &mut factors);
        }
        for i in 0..LANES {
            let (scattered, factor) = (self.scattering.at_position(table_positions[i]), factors[i] * weights[i]);
            for c in 0..3 {
                radiance[i][c] += light.intensity[c] * factor * scattered[c];
            }
        }
    }

    /// Upper bound on the radiance of drops within `radius` (m) of a point, in any color, cd/m^2.
    pub(crate) fn max_radiance(&self, center: DVec3, radius: f64) -> f32 {
        self.lights.iter().map(|light| max_illuminance(light, center, radius) * self.scattering.max).sum()
    }

    /// About the largest radiance of drops within `radius` (m) of a point, in any color, seen along `direction` (unit vector from the eye), cd/m^2. It
    /// considers the angle by which the light turns, and is far below [`max_radiance`](Self::max_radiance), since drops are brightest straight before a
    /// light.
    pub(crate) fn max_radiance_along(&self, center: DVec3, radius: f64, direction: DVec3) -> f32 {
        let radiances = self.lights.iter().map(|light| {
            let nearest = nearest_to_straight_on(light, center, radius, direction);
            let scattered = self.scattering.at(nearest as f32).into_iter().fold(0.0, f32::max);
            max_illuminance(light, center, radius) * scattered
        });
        radiances.sum()
    }
}

/// Cosine of the smallest angle between `direction` and light that travels to a point within `radius` (m) of `center`: that at the center, turned by the angle
/// under which the light sees the sphere.
fn nearest_to_straight_on(light: &Light, center: DVec3, radius: f64, direction: DVec3) -> f64 {
    let incident = light.incident_light(center);
    let cosine = incident.toward.dot(direction).clamp(-1.0, 1.0);
    let sine = math::sqrt(1.0 - cosine * cosine);
    // The sphere of a light within it is seen under a right angle; a directional light, whose distance is 0, sees every sphere as a point.
    let turn = (radius / incident.distance.max(radius)).min(1.0);
    let turn = if incident.distance > 0.0 { [math::sqrt(1.0 - turn * turn), turn] } else { [1.0, 0.0] };
    if sine <= turn[1] && cosine > 0.0 { 1.0 } else { cosine * turn[0] + sine * turn[1] }
}

/// Upper bound on the illuminance by a light within `radius` (m) of a point, in any color, lux.
fn max_illuminance(light: &Light, center: DVec3, radius: f64) -> f32 {
    let intensity = light.intensity.into_iter().fold(0.0, f32::max);
    let nearest = (light.incident_light(center).distance - radius).max(f64::MIN_POSITIVE);
    match light.emitter {
        Emitter::Directional { .. } => intensity,
        Emitter::Spot { position, axis, cos_outer, .. }
            if cone_misses_sphere(center - position, radius, axis, cos_outer) =>
        {
            0.0
        }
        Emitter::Point { radius: lamp, .. } => intensity / (nearest * nearest).max(lamp * lamp) as f32,
        Emitter::Spot { .. } => intensity / (nearest * nearest) as f32,
    }
}

/// [`Light::incident_light`] in single precision, for sixteen drops at a time.
pub(crate) struct PreparedLight {
    /// Position relative to the camera, m; for a directional light, the direction toward it.
    position: [f32; 3],
    /// 1 for a light with a position, 0 for a directional one.
    is_local: f32,
    /// Square of the radius of the lamp, within which the illuminance is constant, m^2.
    min_distance_squared: f32,
    /// Cone of a spot light: its axis, and slope and offset of the falloff as a function of the cosine of the angle
    /// from the axis; constant 1 for other lights.
    axis: [f32; 3],
    cone: [f32; 2],
    intensity: [f32; 3],
    /// What solids shadow.
    shadow: Option<Arc<ShadowMap>>,
}

impl PreparedLight {
    fn new(light: &Light, shadow: Option<&Arc<ShadowMap>>, eye: DVec3) -> Self {
        let no_cone = ([0.0; 3], [0.0, 1.0]);
        let (position, is_local, radius, (axis, cone)) = match light.emitter {
            Emitter::Directional { toward } => (toward, 0.0, 0.0, no_cone),
            Emitter::Point { position, radius } => (position - eye, 1.0, radius, no_cone),
            Emitter::Spot { position, axis, cos_inner, cos_outer } => {
                let rise = 1.0 / (cos_inner - cos_outer).max(1e-6);
                (position - eye, 1.0, 0.0, (axis.as_vec3().to_array(), [rise as f32, (-cos_outer * rise) as f32]))
            }
        };
        Self {
            position: position.as_vec3().to_array(),
            is_local,
            min_distance_squared: (radius * radius).max(1e-12) as f32,
            axis,
            cone,
            intensity: light.intensity,
            shadow: shadow.cloned(),
        }
    }

    /// Multiplies factors of the illuminance at sixteen positions by the fraction of the light that reaches them, where they and the weights are not 0.
    #[inline(always)]
    fn shade(&self, shadow: &ShadowMap, positions: &Vec3Lanes, weights: &LaneArray, factors: &mut LaneArray) {
        for i in 0..LANES {
            // A branch, unlike in the loops around it: a lookup reads memory at random, and few drops of a batch are in the picture and in the cone.
            if factors[i] * weights[i] > 0.0 {
                let offset = [0, 1, 2].map(|axis| positions[axis][i] - self.position[axis]);
                factors[i] *= shadow.visibility(offset);
            }
        }
    }

    /// For sixteen positions relative to the camera: illuminance over intensity, attenuated by the rain, and the table
    /// position in [`ScatteringTable`] of the scattering angle toward the camera.
    #[inline(always)]
    fn incident_light(&self, [xs, ys, zs]: &Vec3Lanes, extinction: f32) -> (LaneArray, LaneArray) {
        let (mut factors, mut table_positions) = (ZERO_LANES, ZERO_LANES);
        let [x, y, z] = self.position;
        for i in 0..LANES {
            let is_local = self.is_local;
            let offset = [x - is_local * xs[i], y - is_local * ys[i], z - is_local * zs[i]];
            let square = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
            let distance = square.sqrt();
            let inverse = 1.0 / distance.simd_max(f32::MIN_POSITIVE);
            let from = -(offset[0] * self.axis[0] + offset[1] * self.axis[1] + offset[2] * self.axis[2]) * inverse;
            let cone = from.fma(self.cone[0], self.cone[1]).simd_clamp01();
            let cone_factor = cone * cone * (3.0 - 2.0 * cone);
            let distance_squared = (is_local * square + (1.0 - is_local)).simd_max(self.min_distance_squared);
            factors[i] = cone_factor / distance_squared * approximations::exp(-extinction * is_local * distance);
            let drop_distance = (xs[i] * xs[i] + ys[i] * ys[i] + zs[i] * zs[i]).sqrt();
            let along = offset[0] * xs[i] + offset[1] * ys[i] + offset[2] * zs[i];
            table_positions[i] = ScatteringTable::position(along * inverse / drop_distance.simd_max(f32::MIN_POSITIVE));
        }
        (factors, table_positions)
    }
}

/// Whether a cone around `axis` misses a sphere at `offset` from its apex.
fn cone_misses_sphere(offset: DVec3, radius: f64, axis: DVec3, cos_outer: f64) -> bool {
    let distance = offset.length();
    if distance <= radius {
        return false;
    }
    let angle = math::acos((offset.dot(axis) / distance).clamp(-1.0, 1.0));
    angle - math::asin(radius / distance) > math::acos(cos_outer.clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use bansho_base::math::random::{Key, Purpose};

    use super::*;

    #[test]
    fn sixteen_drops_are_lit_as_one_is() {
        let scattering = ScatteringTable::new(&DropPhaseFunction::new());
        let position = DVec3::new(3.0, 4.0, -2.0);
        let emitters = [
            Emitter::Point { position, radius: 0.1 },
            Emitter::Directional { toward: DVec3::new(0.6, 0.8, 0.0) },
            Emitter::Spot { position, axis: -DVec3::Y, cos_inner: 0.7, cos_outer: 0.2 },
        ];
        let eye = DVec3::new(1000.0, 1.6, -500.0);
        for emitter in emitters {
            let moved = match emitter {
                Emitter::Point { position, radius } => Emitter::Point { position: position + eye, radius },
                Emitter::Spot { position, axis, cos_inner, cos_outer } => {
                    Emitter::Spot { position: position + eye, axis, cos_inner, cos_outer }
                }
                Emitter::Directional { .. } => emitter,
            };
            let lights = [Light { emitter: moved, intensity: [100.0, 50.0, 20.0] }];
            let shadows = LampShadows::default();
            let lighting =
                DropLighting { scattering: &scattering, lights: &lights, shadows: &shadows, extinction: 0.01 };
            let mut positions = [ZERO_LANES; 3];
            for i in 0..LANES {
                let u = Key::new(2, "beam").uniforms(i as u64, 0, Purpose::named("place"));
                (0..3).for_each(|axis| positions[axis][i] = 8.0 * u[axis] - 4.0);
            }
            let mut found = [[0.0; 3]; LANES];
            lighting.add(&lighting.prepare_lights(eye)[0], &positions, &[1.0; LANES], &mut found);
            let mut lit = 0;
            for i in 0..LANES {
                let direction = DVec3::from(positions.map(|row| f64::from(row[i])));
                let expected = lighting.radiance(&lights[0], eye + direction, direction.normalize());
                for c in 0..3 {
                    assert!(
                        (found[i][c] - expected[c]).abs() <= 2e-3 * expected[c].max(1e-3),
                        "{:?} {expected:?}",
                        found[i]
                    );
                }
                lit += usize::from(expected[0] > 0.0);
            }
            assert!(lit > 4, "{lit}");
        }
    }
}
