//! Projection of particles to elliptical sprites, for every lens.

use bansho_base::{
    camera::{Camera, Lens, Projection},
    math::{DMat2, DVec2, DVec3},
    phenomenon::strip::View,
};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::perspective::PerspectiveProjector;
use crate::particles::render::{
    gas::Gas,
    prepared::PARTICLES_PER_TASK,
    splat::{
        kernel::{LINE_PEAK, VARIANCE},
        scratch_pool::PooledVec,
    },
};

/// An ellipse in the picture: `q = a u^2 + 2 b u v + c v^2` is 1 at its edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ellipse {
    /// Center, pixels from the picture's top left corner.
    pub(crate) center: [f32; 2],
    /// a, b and c, 1/pixel^2.
    pub(crate) shape: [f32; 3],
    /// Half extents of its bounding box, pixels.
    pub(crate) reach: [f32; 2],
    /// Semi-minor axis, pixels.
    pub(crate) radius: f32,
    /// Line integral through the center, for a particle of 1 m^3 with an absorption coefficient of 1/m.
    pub(crate) peak: f32,
}

/// A projected particle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProjectedParticle {
    pub(crate) index: usize,
    pub(crate) ellipse: Ellipse,
    pub(crate) depth: f64,
    /// Motion until the next frame, pixels to the right and down.
    pub(crate) motion: [f32; 2],
    /// Pixels per meter.
    pub(crate) scale: f32,
}

/// Sprites with coordinates beyond this are discarded, pixels.
pub(crate) const MAX_PIXEL_COORDINATE: f64 = 1e6;

/// Variance of a pixel's footprint, pixels^2, that is added to every sprite (as in EWA splatting), so that the smallest neither
/// flicker nor vanish.
pub(crate) const PIXEL_FOOTPRINT: f64 = 0.18;

/// Which particles become sprites, and what is recorded of each.
pub(crate) trait SpriteKind: Sync {
    type Record: Send + 'static;
    fn includes(&self, index: usize) -> bool;
    fn record(&self, projected: &ProjectedParticle) -> Self::Record;
}

/// Records of all particles that a view sees, in order, one list per task.
pub(crate) fn project_particles<'a, K: SpriteKind>(
    gas: &Gas<'a>,
    view: &View,
    kind: &K,
) -> Vec<PooledVec<'a, K::Record>> {
    let projector = ParticleProjector::new(view);
    let perspective = PerspectiveProjector::new(gas, view, &projector.next, projector.shutter_fraction);
    let (count, level) = (gas.particles.len(), Level::new());
    let of_task = |task: usize| {
        let range = task * PARTICLES_PER_TASK..((task + 1) * PARTICLES_PER_TASK).min(count);
        let mut records = gas.scratch.take(PARTICLES_PER_TASK);
        records.clear();
        match &perspective {
            Some(perspective) => {
                dispatch!(level, _simd => perspective.project(gas, range.clone(), kind, &mut records));
            }
            None => {
                for index in range.filter(|index| kind.includes(*index)) {
                    projector.project(gas, index, |projected| records.push(kind.record(&projected)));
                }
            }
        }
        records
    };
    (0..count.div_ceil(PARTICLES_PER_TASK)).into_par_iter().map(of_task).collect()
}

/// The camera at this frame and the next.
struct ParticleProjector<'a> {
    view: &'a View,
    next: Camera,
    /// Exposure time as a fraction of the frame interval.
    shutter_fraction: f64,
}

impl<'a> ParticleProjector<'a> {
    fn new(view: &'a View) -> Self {
        let frame = (view.next_middle - view.shutter.middle()).max(1e-9);
        Self { view, next: view.camera_at(view.next_middle), shutter_fraction: view.shutter.duration() / frame }
    }

    /// Projects a particle and passes it to `each`; twice where it crosses the seam of a panorama.
    #[inline(always)]
    fn project(&self, gas: &Gas, index: usize, mut each: impl FnMut(ProjectedParticle)) {
        let position = gas.position(index, self.view.shutter.middle());
        let camera = &self.view.camera;
        let Some(first) = camera.project(position) else { return };
        let after = self.next.project(gas.position(index, self.view.next_middle));
        let motion = after.map_or(DVec2::ZERO, |after| across_seam(camera, after.pixel - first.pixel));
        let mut at = |projection: Projection| {
            if let Some(ellipse) = self.ellipse(gas, index, position, &projection, motion * self.shutter_fraction) {
                let (depth, scale) = (projection.depth, projection.pixels_per_meter as f32);
                each(ProjectedParticle { index, ellipse, depth, motion: motion.as_vec2().to_array(), scale });
            }
        };
        at(first);
        if camera.lens == Lens::Panorama {
            let turn = std::f64::consts::TAU * camera.focal_pixels;
            let side = if first.pixel.x > camera.principal_point.x { -turn } else { turn };
            at(Projection { pixel: first.pixel + DVec2::new(side, 0.0), ..first });
        }
    }

    /// The ellipse of a ball at `projection` with a motion blur of `blur` pixels.
    ///
    /// The sprite is widened by the variance of a box of that length and of the pixel's footprint; its integral is unchanged.
    fn ellipse(
        &self,
        gas: &Gas,
        index: usize,
        position: DVec3,
        projection: &Projection,
        blur: DVec2,
    ) -> Option<Ellipse> {
        let camera = &self.view.camera;
        let radius = f64::from(gas.particles.support_radius[index]);
        let lens = lens_jacobian(camera, position, projection);
        let ball = lens * lens.transpose() * (radius * radius);
        let smear =
            outer(blur) * (1.0 / (12.0 * VARIANCE)) + DMat2::from_diagonal(DVec2::splat(PIXEL_FOOTPRINT / VARIANCE));
        let matrix = ball + smear;
        let (trace, determinant) = (matrix.x_axis.x + matrix.y_axis.y, matrix.determinant());
        if !(determinant > 0.0 && determinant.is_finite()) {
            return None;
        }
        let inverse = matrix.inverse();
        let least = 0.5 * trace - (0.25 * trace * trace - determinant).max(0.0).sqrt();
        let reach = DVec2::new(matrix.x_axis.x.sqrt(), matrix.y_axis.y.sqrt());
        let size = DVec2::new(camera.size[0], camera.size[1]);
        let center = projection.pixel;
        let shown = (center + reach).cmpgt(DVec2::ZERO).all() && (center - reach).cmplt(size).all();
        if !(shown && center.abs().max_element() < MAX_PIXEL_COORDINATE) {
            return None;
        }
        let in_front = in_front(projection.depth, camera.near, radius);
        let peak = LINE_PEAK * in_front * lens.determinant().abs() / determinant.sqrt();
        (peak > 0.0).then_some(Ellipse {
            center: center.as_vec2().to_array(),
            shape: [inverse.x_axis.x, inverse.x_axis.y, inverse.y_axis.y].map(|value| value as f32),
            reach: reach.as_vec2().to_array(),
            radius: least.max(0.0).sqrt() as f32,
            peak: peak as f32,
        })
    }
}

/// Fraction of a ball in front of the camera, where the camera is inside the ball.
fn in_front(depth: f64, near: f64, radius: f64) -> f64 {
    bansho_base::math::smoothstep(near, near + radius, depth)
}

/// The shorter way around a panorama.
fn across_seam(camera: &Camera, step: DVec2) -> DVec2 {
    if camera.lens != Lens::Panorama {
        return step;
    }
    let turn = std::f64::consts::TAU * camera.focal_pixels;
    DVec2::new(step.x - (step.x / turn).round() * turn, step.y)
}

fn outer(v: DVec2) -> DMat2 {
    DMat2::from_cols(v * v.x, v * v.y)
}

/// Jacobian of the projection: pixels to the right and down per meter across the line of sight. A multiple of the identity for a
/// perspective lens, by finite differences for others.
fn lens_jacobian(camera: &Camera, position: DVec3, projection: &Projection) -> DMat2 {
    let round = DMat2::from_diagonal(DVec2::new(projection.pixels_per_meter, -projection.pixels_per_meter));
    if camera.lens == Lens::Perspective {
        return round;
    }
    let ray = (position - camera.position).normalize_or(DVec3::Z);
    let (one, two) = ray.any_orthonormal_pair();
    let step = 1e-4 * projection.depth;
    let moved = |direction: DVec3| {
        let seen = camera.project(position + direction * step)?;
        Some(across_seam(camera, seen.pixel - projection.pixel) / step)
    };
    match (moved(one), moved(two)) {
        (Some(one), Some(two)) => limit_anisotropy(DMat2::from_cols(one, two), projection.pixels_per_meter),
        _ => round,
    }
}

/// Limits the anisotropy of sprites near a panorama's poles.
fn limit_anisotropy(matrix: DMat2, scale: f64) -> DMat2 {
    const MOST: f64 = 40.0;
    let longest = matrix.x_axis.length().max(matrix.y_axis.length());
    if longest > MOST * scale { matrix * (MOST * scale / longest) } else { matrix }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::CameraParameters,
        math::random::{Key, Purpose},
        parameters::animated::Animated,
        phenomenon::strip::Shutter,
    };

    use super::*;
    use crate::particles::{
        Particle, Particles,
        render::{gas::FadeOut, splat::scratch_pool::ScratchPool},
    };

    struct Everything;

    impl SpriteKind for Everything {
        type Record = ProjectedParticle;

        fn includes(&self, _index: usize) -> bool {
            true
        }

        fn record(&self, projected: &ProjectedParticle) -> ProjectedParticle {
            *projected
        }
    }

    #[test]
    fn sixteen_at_a_time_are_seen_as_one_by_one() {
        let camera = CameraParameters {
            position: Animated::from([0.3, 0.4, 1.5]),
            target: Animated::from([0.0, 0.2, 0.0]),
            roll_deg: Animated::from(7.0),
            shift: [0.02, -0.01],
            ..CameraParameters::default()
        };
        let view = View::new(camera, Shutter { open: 1.0, close: 1.02 }, 1.04, [320, 180], 0);
        let mut particles = Particles::new(DVec3::new(0.1, -0.2, 0.05));
        for id in 0..333 {
            let random = Key::new(5, "seen").uniforms(id, 0, Purpose::named("place")).map(|u| 4.0 * (u - 0.5));
            let [x, y, z, w] = random;
            particles.push(Particle {
                id,
                position: [x, y, z],
                velocity: [3.0 * w, 2.0 * x, y],
                mass: 1e-4,
                density: 0.2,
                temperature: 1700.0,
                support_radius: 0.05 + 0.04 * w.abs(),
                age: 0.1,
                max_age: 1.0,
                fuel: 0.5,
                soot: 1e-7,
            });
        }
        let gas = Gas {
            particles: &particles,
            time: 0.99,
            air_temperature_k: 293.15,
            detail_speed: 0.5,
            base: DVec3::ZERO,
            size: DVec2::ONE,
            key: Key::new(1, "flame"),
            fade_out: FadeOut::NEVER,
            scratch: &ScratchPool::default(),
        };
        let (projector, mut one_by_one) = (ParticleProjector::new(&view), Vec::new());
        (0..particles.len()).for_each(|index| projector.project(&gas, index, |projected| one_by_one.push(projected)));
        let projected = project_particles(&gas, &view, &Everything);
        let together: Vec<ProjectedParticle> = projected.iter().flat_map(|task| task.iter().copied()).collect();
        assert!(one_by_one.len() > 40 && one_by_one.len() < 300, "{}", one_by_one.len());
        assert_eq!(together.len(), one_by_one.len());
        for (a, b) in together.iter().zip(&one_by_one) {
            let near = |a: f32, b: f32, allowed: f32| (a - b).abs() <= allowed * (1.0 + b.abs());
            let (e, f) = (&a.ellipse, &b.ellipse);
            assert_eq!(a.index, b.index);
            assert!((a.depth - b.depth).abs() < 1e-5 && near(a.scale, b.scale, 1e-5));
            assert!(near(e.radius, f.radius, 1e-5) && (e.peak / f.peak - 1.0).abs() < 1e-3, "{e:?} {f:?}");
            for axis in 0..2 {
                assert!(near(e.center[axis], f.center[axis], 1e-5) && near(e.reach[axis], f.reach[axis], 1e-5));
                assert!(near(a.motion[axis], b.motion[axis], 1e-4), "{a:?} {b:?}");
            }
            assert!((0..3).all(|i| (e.shape[i] - f.shape[i]).abs() < 1e-4 * f.shape[0].max(f.shape[2])), "{e:?} {f:?}");
        }
    }
}
