//! One SPH step with about 35 neighbors per particle: cell list, density, pressure force, integration.
//!
//! Beside it are a version with all pairs (3,000 particles only: 100,000 would take a thousand times as long) and one with unsorted
//! particles, a hash map of cells and scalar code, whole and its lists of neighbors alone; and a step of the particle flame with all features.

mod support;

use std::{collections::HashMap, hint::black_box, sync::Arc};

use bansho_base::{
    host::assets::MemoryAssets,
    math::random::{Key, Purpose},
    phenomenon::{Phenomenon, Stepped, Stepping, surroundings::Surroundings},
    world::wind::{Wind, WindParameters},
};

use bansho_fire::particles::{FlameParticles, FlameParticlesParameters, FlameParticlesRun};
use bansho_sph::{Cells, Kernel, KernelShape, Particles, PressureForce, StateEquation, compute_densities};
use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use support::pinned_pool;

const NEIGHBORS: f64 = 35.0;
const SUPPORT: f32 = 0.1;
const STATE: StateEquation = StateEquation { rest_density: 0.0, negative_pressure: false };
const STIFFNESS: f32 = 1.0;
/// So short that the cloud stays as it is however often it is stepped.
const SECONDS: f32 = 1e-6;

/// Random particles of mass 1 in a box in which [`NEIGHBORS`] lie within the support radius.
fn cloud<const D: usize>(count: u64) -> Particles<D> {
    use std::f64::consts::PI;
    let support = f64::from(SUPPORT);
    let ball = if D == 2 { PI * support * support } else { 4.0 / 3.0 * PI * support * support * support };
    let volume = count as f64 / (NEIGHBORS / ball);
    let side = if D == 2 { volume.sqrt() } else { bansho_base::math::cbrt(volume) };
    let key = Key::new(1, "cloud");
    let mut particles = Particles::default();
    for id in 0..count {
        let uniforms = key.uniforms(id, 0, Purpose(1));
        particles.push(std::array::from_fn(|c| uniforms[c] * side as f32), [0.0; D], 1.0, id);
    }
    particles
}

/// All that a step needs.
struct Simulation<const D: usize> {
    particles: Particles<D>,
    cells: Cells<D>,
    force: PressureForce,
    densities: Vec<f32>,
    pressures: Vec<f32>,
    accelerations: [Vec<f32>; D],
}

impl<const D: usize> Simulation<D> {
    fn new(count: u64) -> Self {
        Self {
            particles: cloud(count),
            cells: Cells::new(SUPPORT),
            force: PressureForce::new(KernelShape::Spiky),
            densities: Vec::new(),
            pressures: Vec::new(),
            accelerations: std::array::from_fn(|_| Vec::new()),
        }
    }

    fn sort(&mut self) {
        self.particles.sort(&mut self.cells);
    }

    fn densities(&mut self) {
        compute_densities(&self.cells, KernelShape::Poly6, &self.particles.masses, &mut self.densities);
    }

    fn forces(&mut self) {
        self.pressures.clear();
        self.pressures.extend(self.densities.iter().map(|density| STATE.pressure(STIFFNESS, *density)));
        let Self { force, cells, particles, densities, pressures, accelerations } = self;
        force.compute_accelerations(cells, &particles.masses, densities, pressures, accelerations);
    }

    fn step(&mut self) {
        self.sort();
        self.densities();
        self.forces();
        self.particles.advance(&self.accelerations, SECONDS);
    }
}

/// Told of a neighbor, the offset from it, and its distance.
type Visitor<'a> = &'a mut dyn FnMut(usize, [f32; 3], f32);

/// A step one pair at a time, the neighbors of each particle found by `near`.
fn scalar_step(particles: &mut Particles<3>, near: &dyn Fn(&Particles<3>, usize, Visitor)) {
    let density_kernel = Kernel::<3>::new(KernelShape::Poly6, SUPPORT);
    let force_kernel = Kernel::<3>::new(KernelShape::Spiky, SUPPORT);
    let count = particles.len();
    let mut densities = vec![0.0; count];
    for i in 0..count {
        near(particles, i, &mut |j, _, distance| densities[i] += particles.masses[j] * density_kernel.value(distance));
    }
    let pressures: Vec<f32> = densities.iter().map(|density| STATE.pressure(STIFFNESS, *density)).collect();
    let mut accelerations: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; count]);
    for i in 0..count {
        near(particles, i, &mut |j, offset, distance| {
            if j != i {
                let push = particles.masses[j] * (pressures[i] + pressures[j]) / (2.0 * densities[i] * densities[j]);
                let factor = -push * force_kernel.derivative(distance) / distance;
                (0..3).for_each(|c| accelerations[c][i] += factor * offset[c]);
            }
        });
    }
    particles.advance(&accelerations, SECONDS);
}

/// Hands `j` to `visitor` if it is near `i`.
fn visit_if_near(particles: &Particles<3>, i: usize, j: usize, visitor: Visitor) {
    let offset: [f32; 3] = particles.positions.each_ref().map(|x| x[i] - x[j]);
    let squared = offset.iter().map(|x| x * x).sum::<f32>();
    if squared < SUPPORT * SUPPORT {
        visitor(j, offset, squared.sqrt());
    }
}

fn all_pairs_step(particles: &mut Particles<3>) {
    scalar_step(particles, &|particles, i, visitor| {
        (0..particles.len()).for_each(|j| visit_if_near(particles, i, j, visitor));
    });
}

/// Indices of the particles in each cell.
type CellMap = HashMap<[i32; 3], Vec<usize>>;

/// The cell of a particle, one support radius wide.
fn cell_of(particles: &Particles<3>, i: usize) -> [i32; 3] {
    particles.positions.each_ref().map(|x| (x[i] / SUPPORT).floor() as i32)
}

fn cell_map(particles: &Particles<3>) -> CellMap {
    let mut map = CellMap::new();
    (0..particles.len()).for_each(|i| map.entry(cell_of(particles, i)).or_default().push(i));
    map
}

/// Visits the neighbors of particle `i` in the cells around its own.
fn visit_neighbors(map: &CellMap, particles: &Particles<3>, i: usize, visitor: Visitor) {
    let [x, y, z] = cell_of(particles, i);
    for step in 0..27 {
        let key = [x + step % 3 - 1, y + step / 3 % 3 - 1, z + step / 9 - 1];
        map.get(&key).into_iter().flatten().for_each(|j| visit_if_near(particles, i, *j, visitor));
    }
}

fn unsorted_step(particles: &mut Particles<3>) {
    let map = cell_map(particles);
    scalar_step(particles, &|particles, i, visitor| visit_neighbors(&map, particles, i, visitor));
}

/// The neighbors of each particle, for which [`Cells`] lists candidates.
fn neighbor_lists(particles: &Particles<3>) -> Vec<Vec<usize>> {
    let map = cell_map(particles);
    let mut lists = vec![Vec::new(); particles.len()];
    for (i, list) in lists.iter_mut().enumerate() {
        visit_neighbors(&map, particles, i, &mut |j, _, _| list.push(j));
    }
    lists
}

/// Moves each particle by up to a twentieth of the support radius along each axis, farther than most do in a step.
fn displace(particles: &mut Particles<3>) {
    let key = Key::new(2, "displacement");
    for i in 0..particles.len() {
        let uniforms = key.uniforms(particles.ids[i], 0, Purpose(1));
        for c in 0..3 {
            particles.positions[c][i] += 0.05 * SUPPORT * (2.0 * uniforms[c] - 1.0);
        }
    }
}

/// A flame of a step that is not divided, which has burned long enough to be whole.
struct DetailFactors {
    run: FlameParticlesRun,
    stepping: Stepping,
    wind: Wind,
    steps: u64,
}

impl DetailFactors {
    fn new(particles: i64) -> Option<Self> {
        let mut parameters = FlameParticlesParameters { particles, ..Default::default() };
        parameters.fluid.max_substeps = 1;
        let flame = FlameParticles::new(parameters, "bench", 1, None, &MemoryAssets::default()).ok()?;
        let wind = Wind::new(WindParameters { velocity: [0.5, 0.0, 0.0].into(), ..Default::default() }, 1, None);
        let stepping = flame.info().stepping?;
        let mut burning = Self { run: FlameParticlesRun::new(Arc::new(flame)), stepping, wind, steps: 0 };
        (0..stepping.preroll_steps()).for_each(|_| burning.step());
        Some(burning)
    }

    fn step(&mut self) {
        self.run.step(self.stepping.time_after(self.steps), &Surroundings::from_wind(&self.wind));
        self.steps += 1;
    }
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sph");
    group.sample_size(20);
    for threads in [1, 2] {
        let pool = pinned_pool(threads);
        let name = if threads == 1 { "space, 1 thread" } else { "space, 2 threads" };
        for count in [3_000, 30_000, 100_000] {
            let mut simulation = Simulation::<3>::new(count);
            group.bench_function(BenchmarkId::new(name, count), |bencher| {
                pool.install(|| bencher.iter(|| simulation.step()));
            });
        }
        let name = if threads == 1 { "plane, 1 thread" } else { "plane, 2 threads" };
        let mut simulation = Simulation::<2>::new(120_000);
        group.bench_function(BenchmarkId::new(name, 120_000), |bencher| {
            pool.install(|| bencher.iter(|| simulation.step()));
        });
    }
    group.finish();

    for (threads, name) in [(1, "sph parts, 100000 in space, 1 thread"), (2, "sph parts, 100000 in space, 2 threads")] {
        let mut group = criterion.benchmark_group(name);
        group.sample_size(20);
        let pool = pinned_pool(threads);
        let mut simulation = Simulation::<3>::new(100_000);
        pool.install(|| simulation.step());
        group.bench_function("cells", |bencher| pool.install(|| bencher.iter(|| simulation.sort())));
        let mut moved = simulation.particles.clone();
        displace(&mut moved);
        let mut cells = Cells::new(SUPPORT);
        group.bench_function("cells of moved particles", |bencher| {
            pool.install(|| {
                bencher.iter_batched_ref(|| moved.clone(), |moved| moved.sort(&mut cells), BatchSize::PerIteration);
            });
        });
        group.bench_function("density", |bencher| pool.install(|| bencher.iter(|| simulation.densities())));
        group.bench_function("pressure", |bencher| pool.install(|| bencher.iter(|| simulation.forces())));
        group.finish();
    }

    let mut group = criterion.benchmark_group("burning gas, 1 thread");
    group.sample_size(20);
    if let Some(mut burning) = DetailFactors::new(30_000) {
        let pool = pinned_pool(1);
        group.bench_function("step of 30000", |bencher| pool.install(|| bencher.iter(|| burning.step())));
    }
    group.finish();

    let mut group = criterion.benchmark_group("sph naive, 1 thread");
    group.sample_size(10);
    let mut particles = cloud::<3>(3_000);
    group.bench_function("all pairs, 3000", |bencher| bencher.iter(|| all_pairs_step(black_box(&mut particles))));
    for count in [3_000, 30_000, 100_000] {
        let mut particles = cloud::<3>(count);
        group.bench_function(BenchmarkId::new("unsorted", count), |bencher| {
            bencher.iter(|| unsorted_step(black_box(&mut particles)));
        });
    }
    let particles = cloud::<3>(100_000);
    group.bench_function("neighbor lists, 100000", |bencher| bencher.iter(|| neighbor_lists(black_box(&particles))));
    group.finish();
}

criterion_group!(sph_benches, benches);
criterion_main!(sph_benches);
