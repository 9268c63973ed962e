//! Lights that arrive at sixteen points at a time.

use fearless_simd::prelude::*;
use glam::DVec3;

use super::surroundings::{Emitter, Light};
use crate::math::simd::{Lanes, Real};

/// Largest component of a vector from the camera to a light, m: squares of it are finite in single precision.
const MAX_OFFSET: f64 = 1e15;

/// A light in coordinates relative to the camera.
#[derive(Clone, Copy, Debug)]
pub struct RelativeLight {
    /// ACEScg, as in [`Light`].
    pub intensity: [f32; 3],
    geometry: Geometry,
}

#[derive(Clone, Copy, Debug)]
enum Geometry {
    /// A light at infinity: unit vector toward it.
    Directional([f32; 3]),
    /// A light at a finite distance.
    Near {
        /// Vector from the camera, m.
        offset: [f32; 3],
        /// Radius, m.
        radius: f32,
        cone: Option<Cone>,
    },
}

/// The cone of a spot: axis, and the cosines of the angles of full intensity and of none.
#[derive(Clone, Copy, Debug)]
struct Cone {
    axis: [f32; 3],
    cos_inner: f32,
    cos_outer: f32,
}

/// Light that arrives at sixteen points.
pub struct ArrivingLight<S: Simd> {
    /// Illuminance on a plane that faces the light, relative to the light's intensity.
    pub factor: Lanes<S>,
    /// Unit vectors toward the light.
    pub toward: [Lanes<S>; 3],
    /// Distance from the light, m; 0 for a light at infinity.
    pub distance: Lanes<S>,
    /// Angular radius of a point light.
    pub angular_radius: Lanes<S>,
}

impl RelativeLight {
    /// A light in the coordinates of a camera at this position.
    #[must_use]
    pub fn new(light: &Light, camera: DVec3) -> Self {
        let geometry = match light.emitter {
            Emitter::Directional { toward } => Geometry::Directional(toward.as_vec3().to_array()),
            Emitter::Point { position, radius } => Geometry::Near {
                offset: offset_from_camera(position, camera),
                radius: radius.min(MAX_OFFSET) as f32,
                cone: None,
            },
            Emitter::Spot { position, axis, cos_inner, cos_outer } => {
                let axis = axis.as_vec3().to_array();
                let cone = Cone { axis, cos_inner: cos_inner as f32, cos_outer: cos_outer as f32 };
                Geometry::Near { offset: offset_from_camera(position, camera), radius: 0.0, cone: Some(cone) }
            }
        };
        Self { intensity: light.intensity, geometry }
    }

    /// The light that arrives at points relative to the camera, without shadows: [`Light::incident_light`].
    #[inline(always)]
    pub fn arriving<S: Simd>(&self, simd: S, points: &[Lanes<S>; 3]) -> ArrivingLight<S> {
        let (zero, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let (offset, radius, cone) = match &self.geometry {
            Geometry::Directional([x, y, z]) => {
                let toward = [Lanes::splat(simd, *x), Lanes::splat(simd, *y), Lanes::splat(simd, *z)];
                return ArrivingLight { factor: one, toward, distance: zero, angular_radius: zero };
            }
            Geometry::Near { offset, radius, cone } => (offset, *radius, cone),
        };
        let x = Lanes::splat(simd, offset[0]) - points[0];
        let y = Lanes::splat(simd, offset[1]) - points[1];
        let z = Lanes::splat(simd, offset[2]) - points[2];
        let square = x.fma(x, y.fma(y, z * z));
        // At the light itself the direction is any: the lower bounds only keep infinities and NaN away.
        let per_distance = square.simd_max(Lanes::splat(simd, 1e-24)).simd_rsqrt();
        let toward = [x * per_distance, y * per_distance, z * per_distance];
        // Within the sphere the illuminance is that on its surface.
        let mut factor = one / square.simd_max(Lanes::splat(simd, (radius * radius).max(1e-12)));
        if let Some(cone) = cone {
            factor *= cone.falloff(&toward);
        }
        let distance = square * per_distance;
        let angular_radius = Lanes::splat(simd, radius) / distance.simd_max(Lanes::splat(simd, radius.max(1e-12)));
        ArrivingLight { factor, toward, distance, angular_radius }
    }
}

/// The vector from the camera to a position, m.
fn offset_from_camera(position: DVec3, camera: DVec3) -> [f32; 3] {
    let offset = (position - camera).clamp(DVec3::splat(-MAX_OFFSET), DVec3::splat(MAX_OFFSET));
    offset.as_vec3().to_array()
}

impl Cone {
    /// Fraction of the intensity toward points from which the light is seen in directions (unit vectors).
    #[inline(always)]
    fn falloff<S: Simd>(&self, toward: &[Lanes<S>; 3]) -> Lanes<S> {
        let [x, y, z] = *toward;
        let [along_x, along_y, along_z] = self.axis;
        let cos = x.fma(x.broadcast(-along_x), y.fma(x.broadcast(-along_y), z * x.broadcast(-along_z)));
        let range = (self.cos_inner - self.cos_outer).max(1e-9);
        let t = ((cos - x.broadcast(self.cos_outer)) / x.broadcast(range)).simd_clamp01();
        t * t * x.broadcast(-2.0).fma(t, x.broadcast(3.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::simd::LANES;

    fn array<S: Simd>(lanes: Lanes<S>) -> [f32; LANES] {
        let mut values = [0.0; LANES];
        lanes.store_slice(&mut values);
        values
    }

    #[test]
    fn lights_arrive_at_sixteen_points_as_at_each() {
        let camera = DVec3::new(100.0, 2.0, -50.0);
        let position = DVec3::new(101.0, 3.0, -52.0);
        let axis = DVec3::new(0.3, -1.0, 0.1).normalize();
        let emitters = [
            Emitter::Point { position, radius: 0.2 },
            Emitter::Point { position: DVec3::new(100.0, 0.0, -50.0), radius: 0.0 },
            Emitter::Spot { position, axis, cos_inner: 0.95, cos_outer: 0.7 },
            Emitter::Directional { toward: DVec3::new(0.6, 0.8, 0.0) },
        ];
        for emitter in emitters {
            let light = Light { emitter, intensity: [5.0; 3] };
            let places: [[f64; 3]; LANES] =
                std::array::from_fn(|i| [0.3 * i as f64 - 2.0, -2.0, 0.1 * (i * i) as f64 - 6.0]);
            let points = [0, 1, 2].map(|axis| places.map(|place| place[axis] as f32));
            let (factors, ys) = crate::dispatch_baseline!(simd => {
                let points = points.each_ref().map(|values| Lanes::from_slice(simd, values));
                let arriving = RelativeLight::new(&light, camera).arriving(simd, &points);
                (array(arriving.factor), array(arriving.toward[1]))
            });
            for i in 0..LANES {
                let exact = light.incident_light(camera + DVec3::from(places[i]));
                let found = 5.0 * factors[i];
                assert!(
                    (found - exact.illuminance[0]).abs() <= 2e-5 * exact.illuminance[0].max(1e-3),
                    "{emitter:?} {i}"
                );
                assert!((f64::from(ys[i]) - exact.toward.y).abs() < 1e-5, "{emitter:?} {i}");
            }
        }
    }
}
