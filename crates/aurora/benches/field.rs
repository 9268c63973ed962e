//! Poisson's equation on the aurora's grid of 256 x 256 cells, with relaxation beside it.

mod support;

use std::hint::black_box;

use bansho_aurora::simulate::field::{Grid2, PoissonSolver, gauss_seidel_sweep};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use support::pinned_pool;

const SIDE: usize = 256;

/// A band of charge across the middle of a square grid.
fn charges(side: usize) -> Grid2 {
    let mut grid = Grid2::new([side, side], 1.0, [0.0; 2]);
    grid.values_mut()[side * side / 2 - 3 * side..side * side / 2 + 3 * side].fill(1.0);
    grid
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("poisson");
    for (threads, name) in [(1, "1 thread"), (2, "2 threads")] {
        let pool = pinned_pool(threads);
        for side in [SIDE - 1, SIDE] {
            let (solver, source) = (PoissonSolver::new([side, side], 1.0, 0.0), charges(side));
            group.bench_function(format!("transform {side}, {name}"), |bencher| {
                pool.install(|| {
                    bencher.iter_batched_ref(|| source.clone(), |grid| solver.solve(grid), BatchSize::LargeInput);
                });
            });
        }
    }
    let source = charges(SIDE);
    let mut potential = Grid2::new([SIDE, SIDE], 1.0, [0.0; 2]);
    group.sample_size(10);
    group.bench_function("naive: 100 Gauss-Seidel sweeps of 256", |bencher| {
        bencher.iter(|| (0..100).map(|_| gauss_seidel_sweep(black_box(&mut potential), &source, 0.0)).sum::<f64>());
    });
    group.finish();
}

criterion_group!(field_benches, benches);
criterion_main!(field_benches);
