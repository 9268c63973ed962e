//! The lights that arrive at sixteen points of the ground, in the shadows of obstacles.

use bansho_base::{
    color::luminance,
    math::{
        DVec3,
        simd::{LANES, Lanes, Real},
    },
    phenomenon::surroundings::{Emitter, Light, Occluder},
};
use fearless_simd::prelude::*;

use crate::shadow::{sky_visibility, visibility};

/// Radius of lamps for the width of half shadows, m; and the angular radius of sun and moon.
const SOURCE_RADIUS: f64 = 0.08;
const SUN_RADIUS: f64 = 0.004_65;
/// Distance that stands for infinity, m.
const FAR: f64 = 1e3;
/// Largest component of a vector from the camera to a light, m: squares of it are finite in single precision.
const MAX_OFFSET: f64 = 1e15;

/// A light in coordinates relative to the camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct GroundLight {
    /// ACEScg, as in [`Light`].
    pub(super) intensity: [f32; 3],
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
pub(super) struct ArrivingLight<S: Simd> {
    /// Illuminance on a plane that faces the light, relative to the light's intensity.
    pub(super) factor: Lanes<S>,
    /// Unit vectors toward the light.
    pub(super) toward: [Lanes<S>; 3],
    /// Distance from the light, m; 0 for a light at infinity.
    distance: Lanes<S>,
    /// Angular radius of a point light.
    pub(super) angular_radius: Lanes<S>,
}

impl GroundLight {
    pub(super) fn new(light: &Light, camera: DVec3) -> Self {
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
    pub(super) fn arriving<S: Simd>(&self, simd: S, points: &[Lanes<S>; 3]) -> ArrivingLight<S> {
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

/// What casts shadows on sixteen points.
pub(super) struct Shadows<'a> {
    pub(super) casters: &'a [Occluder],
    /// Position of the camera, m.
    pub(super) camera: DVec3,
    /// Components of the points relative to it, m.
    pub(super) points: [[f32; LANES]; 3],
}

impl Shadows<'_> {
    fn point(&self, lane: usize) -> DVec3 {
        self.camera + DVec3::from([0, 1, 2].map(|axis| f64::from(self.points[axis][lane])))
    }

    /// Fraction of a light that reaches each point where its luminance on a plane that faces it is more than next to nothing of `whole`, that of all
    /// lights; 1 elsewhere.
    pub(super) fn visibility<S: Simd>(
        &self,
        light: &GroundLight,
        arriving: &ArrivingLight<S>,
        whole: &[f32; LANES],
    ) -> [f32; LANES] {
        /// Fraction of all light.
        const NEGLIGIBLE: f32 = 1e-3;
        let (factors, distances) = (array(arriving.factor), array(arriving.distance));
        let toward = [0, 1, 2].map(|axis| array(arriving.toward[axis]));
        let strength = luminance(light.intensity);
        std::array::from_fn(|lane| {
            // Lane by lane: rays take different numbers of steps, and distances to solids are lookups in double precision. So first what needs no
            // ray.
            if toward[1][lane] <= 0.0 || factors[lane] * strength <= NEGLIGIBLE * whole[lane] {
                return 1.0;
            }
            let toward = DVec3::from([0, 1, 2].map(|axis| f64::from(toward[axis][lane]))).normalize_or_zero();
            let distance = f64::from(distances[lane]);
            let reach = if distance > 0.0 { distance - SOURCE_RADIUS } else { f64::INFINITY };
            let size = if distance > 0.0 { SOURCE_RADIUS / distance } else { SUN_RADIUS };
            visibility(self.casters, self.point(lane), toward, reach, size) as f32
        })
    }

    /// Fraction of the sky's light that reaches each point.
    pub(super) fn sky_visibility(&self) -> [f32; LANES] {
        std::array::from_fn(|lane| sky_visibility(self.casters, self.point(lane)) as f32)
    }

    /// Fraction of what is far away that each point sees in a direction (unit vectors), with the blur of a mean slope.
    pub(super) fn far_visibility<S: Simd>(&self, toward: &[Lanes<S>; 3], slope: Lanes<S>) -> [f32; LANES] {
        let (toward, slope) = ([0, 1, 2].map(|axis| array(toward[axis])), array(slope));
        std::array::from_fn(|lane| {
            let toward = DVec3::from([0, 1, 2].map(|axis| f64::from(toward[axis][lane]))).normalize_or_zero();
            visibility(self.casters, self.point(lane), toward, FAR, f64::from(slope[lane]).max(0.02)) as f32
        })
    }
}

/// The lanes of a vector.
#[inline(always)]
pub(super) fn array<S: Simd>(lanes: Lanes<S>) -> [f32; LANES] {
    let mut values = [0.0; LANES];
    lanes.store_slice(&mut values);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

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
            let (factors, ys) = bansho_base::dispatch_baseline!(simd => {
                let points = points.each_ref().map(|values| Lanes::from_slice(simd, values));
                let arriving = GroundLight::new(&light, camera).arriving(simd, &points);
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
