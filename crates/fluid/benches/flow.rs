//! A time step of gas, and its pressure around solids, each with the naive way beside it: values at cells one at a time, carried along characteristics, and
//! conjugate gradients without a preconditioner.

use std::hint::black_box;

use bansho_base::{
    math::{DQuat, DVec3},
    phenomenon::surroundings::Occluder,
};
use bansho_fluid::{ActiveRows, Ambient, Flow, FlowSettings, Grid};
use criterion::{Criterion, criterion_group, criterion_main};

const SIZE: [usize; 3] = [64, 128, 64];
const SPACING: f64 = 0.03;
const SECONDS: f32 = 0.004;
const AIR: f32 = 1.2;

/// A column of hot gas above a floor.
fn flow() -> Flow {
    let origin = DVec3::new(-0.5 * SIZE[0] as f64 * SPACING, 0.0, -0.5 * SIZE[2] as f64 * SPACING);
    let settings = FlowSettings {
        has_floor: true,
        smagorinsky: 0.1,
        schmidt: 0.5,
        least_density: 0.15,
        ambient: Ambient { density: AIR, velocity: [0.4, 0.0, 0.0] },
    };
    let grid = Grid::new(SIZE, SPACING, origin);
    let mut flow = Flow::new(grid, settings);
    for y in 0..SIZE[1] {
        for (z, row) in grid.rows(y) {
            for x in 0..SIZE[0] {
                let center = grid.center([x, y, z]);
                if center.x * center.x + center.z * center.z < 0.16 && center.y < 2.0 {
                    flow.contents.density[row + x] = 0.3;
                    flow.contents.quantities[0][row + x] = 0.5;
                }
            }
        }
    }
    flow
}

/// Two logs that cross.
fn logs() -> [Occluder; 2] {
    [0.6_f64, -0.6].map(|turn| Occluder::Cylinder {
        center: DVec3::new(0.1 * turn, 0.25, 0.2 * turn),
        radius: 0.12,
        half_height: 0.5,
        rotation: DQuat::from_rotation_z(1.1 * turn) * DQuat::from_rotation_x(turn),
    })
}

/// A source of pressure in all cells that are not solid: the column of gas expands.
fn source(flow: &Flow) -> Vec<f32> {
    let at = |place: usize| {
        let index = flow.grid.index([place % SIZE[0], place / (SIZE[0] * SIZE[2]), place / SIZE[0] % SIZE[2]]);
        if flow.solids.contains(index) { 0.0 } else { flow.contents.quantities[0][index] }
    };
    (0..SIZE.iter().product()).map(at).collect()
}

fn step(flow: &mut Flow, active: &ActiveRows) {
    flow.transport(active, SECONDS);
    flow.accelerate([0.4, 0.0, 0.0], SECONDS);
}

/// Values at cells, carried along characteristics with lookups between eight cells (Stam 1999).
fn carry_naively(flow: &Flow, source: &[f32], target: &mut [f32]) {
    let grid = flow.grid;
    let [right, above, behind] = grid.strides();
    for y in 0..SIZE[1] {
        for z in 0..SIZE[2] {
            for x in 0..SIZE[0] {
                let index = grid.index([x, y, z]);
                let cell = [x, y, z];
                let place: [f32; 3] = std::array::from_fn(|axis| {
                    let stride = grid.strides()[axis];
                    let speed = 0.5 * (flow.velocity[axis][index] + flow.velocity[axis][index + stride]);
                    (cell[axis] as f32 - speed * SECONDS / SPACING as f32).clamp(0.0, (SIZE[axis] - 2) as f32)
                });
                let below = place.map(|value| value as usize);
                let [i, j, k]: [f32; 3] = std::array::from_fn(|axis| place[axis] - below[axis] as f32);
                let at = grid.index(below);
                let row = |start: usize| source[start] + i * (source[start + right] - source[start]);
                let layer = |start: usize| row(start) + k * (row(start + behind) - row(start));
                target[index] = layer(at) + j * (layer(at + above) - layer(at));
            }
        }
    }
}

/// The pressure for a source by conjugate gradients (Hestenes and Stiefel 1952), until the residual is a thousandth. Returns the number of iterations.
fn solve_naively(flow: &Flow, source: &[f32]) -> usize {
    let cells: usize = SIZE.iter().product();
    let apply = |pressure: &[f32], image: &mut [f32]| {
        for y in 0..SIZE[1] {
            for z in 0..SIZE[2] {
                for x in 0..SIZE[0] {
                    let at = (y * SIZE[2] + z) * SIZE[0] + x;
                    let mut sum = 0.0;
                    for (axis, stride) in [1, SIZE[0] * SIZE[2], SIZE[0]].into_iter().enumerate() {
                        for is_up in [false, true] {
                            let mut near = [x, y, z];
                            if near[axis] == if is_up { SIZE[axis] - 1 } else { 0 } {
                                sum -= if axis == 1 && !is_up { 0.0 } else { 2.0 * pressure[at] };
                                continue;
                            }
                            near[axis] = if is_up { near[axis] + 1 } else { near[axis] - 1 };
                            if !flow.solids.contains(flow.grid.index(near)) {
                                sum += pressure[if is_up { at + stride } else { at - stride }] - pressure[at];
                            }
                        }
                    }
                    image[at] = if flow.solids.contains(flow.grid.index([x, y, z])) { 0.0 } else { sum };
                }
            }
        }
    };
    let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>();
    let (mut residual, mut image, mut pressure) = (source.to_vec(), vec![0.0; cells], vec![0.0_f32; cells]);
    let mut direction = residual.clone();
    let mut square = dot(&residual, &residual);
    let target = 1e-6 * square;
    let mut iterations = 0;
    while square > target && iterations < 2000 {
        apply(&direction, &mut image);
        let length = (square / dot(&direction, &image)) as f32;
        for i in 0..cells {
            pressure[i] += length * direction[i];
            residual[i] -= length * image[i];
        }
        let next = dot(&residual, &residual);
        let weight = (next / square) as f32;
        (0..cells).for_each(|i| direction[i] = residual[i] + weight * direction[i]);
        square = next;
        iterations += 1;
    }
    black_box(pressure);
    iterations
}

fn bench(criterion: &mut Criterion) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let mut group = criterion.benchmark_group("half a million cells, one thread");
    group.sample_size(10);
    let active = ActiveRows::all(&flow().grid);
    for (name, solids) in [("without solids", Vec::new()), ("around two logs", logs().to_vec())] {
        let mut flow = flow();
        flow.set_solids(&solids);
        let source = source(&flow);
        pool.install(|| (0..5).for_each(|_| step(&mut flow, &active)));
        group.bench_function(format!("a step {name}"), |bencher| {
            bencher.iter(|| pool.install(|| step(&mut flow, &active)));
        });
        group.bench_function(format!("forces and pressure {name}"), |bencher| {
            bencher.iter(|| pool.install(|| flow.accelerate([0.4, 0.0, 0.0], SECONDS)));
        });
        group.bench_function(format!("pressure {name}, naive"), |bencher| {
            bencher.iter(|| solve_naively(&flow, &source));
        });
    }
    let flow = flow();
    let mut target = flow.contents.density.clone();
    group.bench_function("transport of one field, naive and of the first order", |bencher| {
        bencher.iter(|| carry_naively(&flow, &flow.contents.density, &mut target));
    });
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
