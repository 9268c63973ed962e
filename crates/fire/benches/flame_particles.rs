//! One step of a developed particle flame with all features: spawning, cell list, density, forces, neighbor sums, wind, vortex
//! rings, turbulence, combustion, integration; with 3,000, 30,000 and 100,000 particles.

mod support;

use std::{hint::black_box, sync::Arc};

use bansho_base::{
    host::assets::MemoryAssets,
    parameters::{Auto, animated::Animated},
    phenomenon::{Stepped, surroundings::Surroundings},
    world::{
        air::Air,
        wind::{Wind, WindParameters},
    },
};

use bansho_fire::particles::{FlameParticles, FlameParticlesParameters, FlameParticlesRun};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use support::pinned_pool;

fn step(criterion: &mut Criterion) {
    let velocity = Animated::from([1.0, 0.0, 0.3]);
    let wind = Wind::new(WindParameters { velocity, ..WindParameters::default() }, 1, None);
    let air = Air::default();
    let around = Surroundings { air: &air, ..Surroundings::from_wind(&wind) };
    let mut group = criterion.benchmark_group("flame particles step");
    group.sample_size(10);
    let pool = pinned_pool(2);
    for count in [3_000, 30_000, 100_000] {
        let parameters = FlameParticlesParameters { particles: count, preroll_s: Auto::Set(0.5), ..Default::default() };
        let step_s = parameters.step_s;
        let Ok(flame) = FlameParticles::new(parameters, "flame", 1, None, &MemoryAssets::default()) else { return };
        let mut run = FlameParticlesRun::new(Arc::new(flame));
        (-60..0).for_each(|step| run.step(f64::from(step) * step_s, &around));
        let id = format!("{count}");
        group.bench_function(id, |bencher| {
            pool.install(|| {
                bencher.iter_batched_ref(
                    || run.clone(),
                    |run| {
                        run.step(0.0, &around);
                        black_box(run.particles().len())
                    },
                    BatchSize::LargeInput,
                );
            });
        });
    }
    group.finish();
}

criterion_group!(benches, step);
criterion_main!(benches);
