//! Requirements of every phenomenon: independence of the number of threads, snapshots, finite numbers.

use bansho_base::{
    math::random::{Key, Purpose, uniform},
    parameters::{Parameters, Reader, sample},
    phenomenon::SnapshotError,
};

use super::*;
use crate::{FieldSolver, shapes::ShapeError};

fn stepped(threads: usize) -> Vec<u8> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let mut simulation = simulation(AuroraParameters { shapes: splitting(), preroll_s: 0.1, ..small() });
        (0..14).for_each(|_| simulation.step());
        simulation.snapshot()
    })
}

#[test]
fn threads_change_no_bit() {
    let one = stepped(1);
    assert!(stepped(3) == one && stepped(2) == one);
}

#[test]
fn a_snapshot_goes_on_as_if_nothing_had_happened() {
    let parameters = AuroraParameters { preroll_s: 0.0, shapes: becoming(Form::Fold), ..AuroraParameters::default() };
    let parameters = AuroraParameters { particles: small().particles, ..parameters };
    let mut first = simulation(parameters.clone());
    // Between two updates of the target, so that the field is that of an earlier time.
    (0..9).for_each(|_| first.step());
    let bytes = first.snapshot();
    let mut second = simulation(parameters);
    second.restore(&bytes).unwrap();
    assert!(second.snapshot() == bytes);
    for _ in 0..8 {
        first.step();
        second.step();
    }
    assert!(first.snapshot() == second.snapshot());
    assert_eq!(first.potential(), second.potential());
}

#[test]
fn what_is_no_snapshot_is_refused_and_changes_nothing() {
    let mut simulation = simulation(small());
    simulation.step();
    let bytes = simulation.snapshot();
    let refused = |simulation: &mut AuroraSimulation, bytes: &[u8]| simulation.restore(bytes).unwrap_err();
    for length in [0, 3, 11, 40, bytes.len() / 2, bytes.len() - 1] {
        assert_eq!(refused(&mut simulation, &bytes[..length]), SnapshotError::Damaged, "{length} bytes");
    }
    let longer: Vec<u8> = bytes.iter().copied().chain([0]).collect();
    assert_eq!(refused(&mut simulation, &longer), SnapshotError::Damaged);
    let other = [&[9, 0, 0, 0], &bytes[4..]].concat();
    assert_eq!(refused(&mut simulation, &other), SnapshotError::Version { found: 9, known: 3 });
    let mut elsewhere = super::simulation(AuroraParameters { shapes: becoming(Form::Peel), ..small() });
    assert_eq!(refused(&mut elsewhere, &bytes), SnapshotError::Damaged, "the usual shapes have two sheets");
    assert!(simulation.snapshot() == bytes);
}

#[test]
fn a_snapshot_holds_numbers_only() {
    let mut simulation = simulation(small());
    simulation.step();
    let bytes = simulation.snapshot();
    let count = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
    // After version, steps, next id, support, time and target updates: the two arc-length maps, each with coordinates, directions and
    // positions of every sheet.
    let (mut at, mut starts) = (40, Vec::new());
    for _ in 0..2 {
        let sheets = count(at);
        at += 8;
        for _ in 0..sheets {
            for size in [8, 1, 8] {
                starts.push(at + 8);
                at += 8 + size * count(at);
            }
        }
    }
    for size in [8, 1, 4] {
        at += 8 + size * count(at);
    }
    let mut refused = |at: usize, value: &[u8]| {
        let mut other = bytes.clone();
        other[at..at + value.len()].copy_from_slice(value);
        assert_eq!(simulation.restore(&other), Err(SnapshotError::Damaged), "at {at}");
    };
    for number in [f64::INFINITY, f64::NAN] {
        for at in [20, 28, starts[0], starts[2], starts[starts.len() - 1]] {
            refused(at, &number.to_le_bytes());
        }
        refused(at + 8, &(number as f32).to_le_bytes());
    }
    for counter in [4, 12] {
        refused(counter, &u64::MAX.to_le_bytes());
        refused(counter, &(1_u64 << 53).to_le_bytes());
    }
    refused(36, &u32::MAX.to_le_bytes());
    assert_eq!(simulation.restore(&bytes), Ok(()));
}

/// Random valid parameters with limited computing time.
fn random(trial: u64) -> Result<AuroraSimulation, ShapeError> {
    let key = Key::new(trial, "random aurora");
    let mut count = 0;
    let mut next = || {
        count += 1;
        f64::from(uniform(key.words(count, 0, Purpose(0))[0]))
    };
    let table = sample(AuroraParameters::table(), &mut next);
    let mut parameters = AuroraParameters::read_table(&table, &mut Reader::new(), &[]);
    parameters.particles.count = parameters.particles.count.min(1500);
    parameters.field.cells = parameters.field.cells.min(40);
    parameters.field.sweeps = parameters.field.sweeps.min(20);
    parameters.shapes.truncate(2);
    let assets = MemoryAssets::default();
    let sequence = Sequence::new(&parameters.shapes, &parameters.morphing, parameters.extent_km, &assets, None)?;
    Ok(AuroraSimulation::new(parameters, sequence, "random", trial))
}

#[test]
fn all_valid_parameters_give_numbers() {
    let mut tried = 0;
    for trial in 0..150 {
        let Ok(mut simulation) = random(trial) else { continue };
        tried += 1;
        (0..5).for_each(|_| simulation.step());
        let particles = simulation.particles();
        let half = (simulation.parameters().extent_km / 2.0) as f32;
        for values in particles.float_arrays() {
            assert!(values.iter().all(|value| value.is_finite()), "trial {trial}");
        }
        assert!(particles.positions.iter().flatten().all(|position| position.abs() <= half), "trial {trial}");
        assert!(particles.fades.iter().all(|fade| (0.0..=1.0).contains(fade)), "trial {trial}");
        assert!(particles.energies_ev.iter().all(|energy| (0.0..=1e5).contains(energy)), "trial {trial}");
        assert!(simulation.afterglow().red.powers_w().iter().all(|power| power.is_finite()), "trial {trial}");
    }
    assert!(tried > 40, "only {tried} of the random shapes are an aurora's");
}

#[test]
fn gauss_seidel_and_the_transform_move_particles_alike() {
    let mut parameters = AuroraParameters { preroll_s: 0.0, ..small() };
    parameters.field.cells = 48;
    parameters.particles.count = 2000;
    let mut exact = simulation(parameters.clone());
    parameters.field.solver = FieldSolver::GaussSeidel;
    parameters.field.tolerance = 1e-10;
    parameters.field.sweeps = 2000;
    let mut relaxed = simulation(parameters);
    let greatest = exact.potential().values().iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    for (exact, relaxed) in exact.potential().values().iter().zip(relaxed.potential().values()) {
        assert!((exact - relaxed).abs() < 1e-6 * greatest, "{exact} {relaxed}");
    }
    for _ in 0..4 {
        exact.step();
        relaxed.step();
    }
    let cell = exact.parameters().cell_km();
    let positions = |simulation: &AuroraSimulation| {
        let particles = simulation.particles();
        let mut positions: Vec<(u64, DVec2)> =
            (0..particles.len()).map(|index| (particles.ids[index], particles.position(index))).collect();
        positions.sort_by_key(|position| position.0);
        positions
    };
    for ((id, a), (other, b)) in positions(&exact).into_iter().zip(positions(&relaxed)) {
        assert!(id == other && a.distance(b) < 0.01 * cell, "{id}: {a} {b}");
    }
}
