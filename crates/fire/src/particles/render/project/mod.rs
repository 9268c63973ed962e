//! Projection of particles to elliptical sprites: `perspective` for sixteen particles at a time, `any_lens` for one.

mod any_lens;
mod perspective;

use any_lens::AnyLensProjector;
use bansho_base::host::parallel::prelude::*;
use fearless_simd::dispatch;
use perspective::PerspectiveProjector;

use crate::particles::render::{
    buffer_pool::PooledVec,
    gas::{Gas, PARTICLES_PER_TASK},
    gas_view::GasView,
    splat::Ellipse,
};

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

/// Variance of a pixel's footprint, pixels^2, that is added to every sprite (as in EWA splatting), so that small sprites neither flicker nor vanish.
const PIXEL_FOOTPRINT: f64 = 0.18;

/// A kind of sprite: which particles it includes, and the record of each.
pub(crate) trait SpriteKind: Sync {
    type Record: Send + 'static;
    fn includes(&self, index: usize) -> bool;
    fn record(&self, projected: &ProjectedParticle) -> Self::Record;
}

/// Records of all included particles that are visible in a view, in order, one list per task.
pub(crate) fn project_particles<'a, K: SpriteKind>(
    gas: &Gas<'a>,
    view: &GasView,
    kind: &K,
) -> Vec<PooledVec<'a, K::Record>> {
    let projector = AnyLensProjector { view };
    let perspective = PerspectiveProjector::new(gas, view);
    let (count, level) = (gas.particles.len(), bansho_base::math::simd::level());
    let tasks = (0..count.div_ceil(PARTICLES_PER_TASK)).into_par_iter();
    let records_of_tasks = tasks.map(|task| {
        let range = task * PARTICLES_PER_TASK..((task + 1) * PARTICLES_PER_TASK).min(count);
        let mut records = gas.buffers.take(PARTICLES_PER_TASK);
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
    });
    records_of_tasks.collect()
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::CameraParameters,
        math::{
            DVec2, DVec3,
            random::{Key, Purpose},
        },
        parameters::animated::Animated,
        phenomenon::strip::{Shutter, View},
    };

    use super::*;
    use crate::particles::{
        GasParticles, Particle,
        render::{buffer_pool::BufferPool, gas::FadeOut},
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
        let mut particles = GasParticles::new(DVec3::new(0.1, -0.2, 0.05));
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
            buffers: &BufferPool::default(),
        };
        let view = GasView::new(&view);
        let (projector, mut one_by_one) = (AnyLensProjector { view: &view }, Vec::new());
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
                assert!(near(e.center[axis], f.center[axis], 1e-5) && near(e.half_size[axis], f.half_size[axis], 1e-5));
                assert!(near(a.motion[axis], b.motion[axis], 1e-4), "{a:?} {b:?}");
            }
            assert!((0..3).all(|i| (e.shape[i] - f.shape[i]).abs() < 1e-4 * f.shape[0].max(f.shape[2])), "{e:?} {f:?}");
        }
    }
}
