//! The aurora's tables: opening them, and what they save against the formulas for every point.

use std::hint::black_box;

use bansho_base::math::random::Key;

use bansho_aurora::physics::{
    atmosphere::atmosphere,
    emission::{Emission, excitation::photons_per_ion_pair, table::colour_of},
    precipitation::{
        FallLibrary, Falls,
        electron_track::VARIANTS,
        energy_grid::{self, node_energy_ev},
        fang2010::{AirLayer, Monoenergetic},
        spectrum::ARC,
    },
};
use criterion::{Criterion, criterion_group, criterion_main};

const PARTICLES: u64 = 1000;

/// The light of a column of a spectrum from the formulas: every energy, every level.
fn column_by_formula(energy_ev: f64) -> [f64; 3] {
    let (node, _) = energy_grid::locate(energy_ev);
    let shares = ARC.shares(node);
    let mut kilorayleigh = [0.0; 4];
    for air in atmosphere().levels() {
        let layer = AirLayer::new(air);
        let spectrum = shares.iter().enumerate().filter(|(_, share)| **share > 1e-12);
        let pairs: f64 =
            spectrum.map(|(node, share)| share * Monoenergetic::new(node_energy_ev(node)).ionisation(&layer)).sum();
        let photons = photons_per_ion_pair(air);
        kilorayleigh = std::array::from_fn(|i| kilorayleigh[i] + photons[i] * pairs * 1e-10);
    }
    colour_of(kilorayleigh)
}

fn tables(criterion: &mut Criterion) {
    let table = Emission::new(atmosphere(), ARC);
    let mut group = criterion.benchmark_group("aurora light");
    group.sample_size(10);
    group.bench_function("open", |bencher| bencher.iter(|| black_box(Emission::new(atmosphere(), ARC))));
    group.bench_function("column/table", |bencher| bencher.iter(|| table.column_colour(black_box(4321.0))));
    group.bench_function("column/naive: formulas", |bencher| bencher.iter(|| column_by_formula(black_box(4321.0))));
    group.finish();
}

fn falls(criterion: &mut Criterion) {
    let table = Emission::new(atmosphere(), ARC);
    let falls = Falls::new(table.deposition(), 0.002);
    let key = Key::new(1, "aurora");
    let node = energy_grid::locate(10_001.0).0;
    let library = FallLibrary::new(&falls, node..=node, key);
    let mut group = criterion.benchmark_group("aurora falls of 1000 particles, 10 keV");
    group.sample_size(10);
    group.bench_function("library", |bencher| {
        bencher.iter(|| {
            let particles = 0..PARTICLES;
            particles
                .flat_map(|particle| library.fall(node, particle as u32 % VARIANTS))
                .fold(0.0, |sum, collision| sum + collision.altitude_km + collision.offset_km[0])
        });
    });
    group.bench_function("naive: every fall drawn", |bencher| {
        bencher.iter(|| {
            let particles = 0..PARTICLES;
            particles
                .flat_map(|particle| falls.fall(node, key, particle))
                .fold(0.0, |sum, collision| sum + collision.altitude_km + collision.offset_km[0])
        });
    });
    group.finish();
}

criterion_group!(benches, tables, falls);
criterion_main!(benches);
