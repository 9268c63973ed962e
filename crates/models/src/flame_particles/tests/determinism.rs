//! The same state whatever the threads, and from any snapshot.

use bansho_base::phenomenon::SnapshotError;

use super::*;
use crate::flame_particles::snapshot;

fn small() -> FlameParticlesParameters {
    FlameParticlesParameters { particles: 900, ..Default::default() }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let state = |threads| {
        let mut simulation = simulation(&small());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| World::default().run_steps(&mut simulation, -60, 0, |_, _| {}));
        snapshot::write(&simulation.particles)
    };
    let one = state(1);
    assert!(one.len() > 10_000);
    assert!(one == state(2) && one == state(3));
}

#[test]
fn a_restored_state_goes_on_as_if_nothing_had_been() {
    let mut whole = simulation(&small());
    World::default().run_steps(&mut whole, -60, -20, |_, _| {});
    let saved = snapshot::write(&whole.particles);
    World::default().run_steps(&mut whole, -20, 0, |_, _| {});
    let mut resumed = simulation(&small());
    resumed.particles = snapshot::read(&resumed.particles, &saved, 1).unwrap();
    World::default().run_steps(&mut resumed, -20, 0, |_, _| {});
    assert!(snapshot::write(&whole.particles) == snapshot::write(&resumed.particles));
}

#[test]
fn a_damaged_state_is_refused() {
    let mut simulation = simulation(&small());
    World::default().run_steps(&mut simulation, -20, 0, |_, _| {});
    let good = snapshot::write(&simulation.particles);
    let read = |bytes: &[u8], burners| snapshot::read(&simulation.particles, bytes, burners).err();
    assert_eq!(read(&good, 1), None);
    assert_eq!(read(&good, 0), Some(SnapshotError::Damaged), "a burner that is not there");
    assert_eq!(read(&good[..good.len() - 1], 1), Some(SnapshotError::Damaged));
    assert_eq!(read(&[], 1), Some(SnapshotError::Damaged));
    let mut newer = good;
    newer[0] = 99;
    assert_eq!(read(&newer, 1), Some(SnapshotError::Version { found: 99, known: 1 }));
}
