//! The aurora's tables: their construction, and lookups compared with evaluation of the formulas at every point.

use std::hint::black_box;

use bansho_aurora::physics::{
    atmosphere::atmosphere,
    emission::{Emission, excitation::photons_per_ion_pair},
    precipitation::{
        TrackLibrary, TrackSampler,
        electron_track::TRACKS_PER_ENERGY,
        energy_grid::{self, ARC, node_energy_ev},
        fang2010::{AirLayer, MonoenergeticBeam},
    },
};
use bansho_base::math::random::Key;
use criterion::{Criterion, criterion_group, criterion_main};

const PARTICLES: u64 = 1000;

/// The light of a column of a spectrum from the formulas: every energy, every level.
fn column_by_formula(table: &Emission, energy_ev: f64) -> [f64; 3] {
    let (node, _) = energy_grid::locate(energy_ev);
    let shares = ARC.flux_fractions(node);
    let mut kilorayleigh = [0.0; 4];
    for air in atmosphere().levels() {
        let layer = AirLayer::new(air);
        let spectrum = shares.iter().enumerate().filter(|(_, share)| **share > 1e-12);
        let pairs: f64 =
            spectrum.map(|(node, share)| share * MonoenergeticBeam::new(node_energy_ev(node)).ionization(&layer)).sum();
        let photons = photons_per_ion_pair(air);
        kilorayleigh = std::array::from_fn(|i| kilorayleigh[i] + photons[i] * pairs * 1e-10);
    }
    table.color_of(kilorayleigh)
}

fn tables(criterion: &mut Criterion) {
    let table = Emission::new(atmosphere(), ARC);
    let mut group = criterion.benchmark_group("aurora light");
    group.sample_size(10);
    group.bench_function("open", |bencher| bencher.iter(|| black_box(Emission::new(atmosphere(), ARC))));
    group.bench_function("column/table", |bencher| bencher.iter(|| table.column_color(black_box(4321.0))));
    group.bench_function("column/naive: formulas", |bencher| {
        bencher.iter(|| column_by_formula(&table, black_box(4321.0)));
    });
    group.finish();
}

fn tracks(criterion: &mut Criterion) {
    let table = Emission::new(atmosphere(), ARC);
    let sampler = TrackSampler::new(table.deposition(), 0.002);
    let key = Key::new(1, "aurora");
    let node = energy_grid::locate(10_001.0).0;
    let library = TrackLibrary::new(&sampler, node..=node, key);
    let mut group = criterion.benchmark_group("aurora falls of 1000 particles, 10 keV");
    group.sample_size(10);
    group.bench_function("library", |bencher| {
        bencher.iter(|| {
            let particles = 0..PARTICLES;
            particles
                .flat_map(|particle| library.track(node, particle as u32 % TRACKS_PER_ENERGY))
                .fold(0.0, |sum, collision| sum + collision.altitude_km + collision.transverse_km[0])
        });
    });
    group.bench_function("naive: every fall drawn", |bencher| {
        bencher.iter(|| {
            let particles = 0..PARTICLES;
            particles
                .flat_map(|particle| sampler.sample_track(node, key, particle))
                .fold(0.0, |sum, collision| sum + collision.altitude_km + collision.transverse_km[0])
        });
    });
    group.finish();
}

criterion_group!(benches, tables, tracks);
criterion_main!(benches);
