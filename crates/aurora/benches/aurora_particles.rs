//! A step of 120,000 particles of the aurora, all in, and one in which the in-between shape is renewed; beside this the thesis's way to solve
//! for the field.

use bansho_base::host::assets::MemoryAssets;

use bansho_aurora::{AuroraParameters, FieldSolver, shapes::Sequence, simulate::AuroraSimulation};
use criterion::{Criterion, criterion_group, criterion_main};

/// The default aurora, developed and in motion; its target is updated at intervals of so many frames.
fn simulation(update_interval_frames: f64, solver: FieldSolver) -> Option<AuroraSimulation> {
    let mut parameters = AuroraParameters::default();
    parameters.particles.count = 120_000;
    parameters.morphing.update_interval_frames = update_interval_frames;
    parameters.field.solver = solver;
    // As near to the exact answer as the transform comes in a scene: no cell changes by a thousandth of a sheet's depth.
    parameters.field.tolerance = 1e-3;
    parameters.field.sweeps = 2000;
    let assets = MemoryAssets::default();
    let sequence = Sequence::new(&parameters.shapes, &parameters.morphing, parameters.extent_km, &assets, None).ok()?;
    let mut simulation = AuroraSimulation::new(parameters, sequence, "bench", 1);
    (0..30).for_each(|_| simulation.step());
    Some(simulation)
}

fn steps(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("aurora step 120,000");
    group.sample_size(20);
    for (name, update_interval_frames, solver) in [
        ("every sixth renewed", 6.0, FieldSolver::SineTransform),
        ("renewed", 1.0, FieldSolver::SineTransform),
        ("renewed, naive: Gauss-Seidel", 1.0, FieldSolver::GaussSeidel),
    ] {
        let Some(mut simulation) = simulation(update_interval_frames, solver) else { continue };
        group.bench_function(name, |bencher| bencher.iter(|| simulation.step()));
    }
    group.finish();
}

criterion_group!(benches, steps);
criterion_main!(benches);
