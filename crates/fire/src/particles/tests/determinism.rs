//! The same state whatever the threads, and from any snapshot.

use bansho_base::{
    camera::CameraParameters,
    host::observer::Unobserved,
    image::Rect,
    parameters::animated::Animated,
    phenomenon::{
        Prepared, SnapshotError,
        strip::{DepthInterval, Shutter, Strip, View},
    },
};

use super::*;
use crate::particles::{
    parameters::GasModel,
    render::{BufferPool, GasRenderingParameters, PreparedGas},
    simulate::snapshot,
};

fn small() -> FlameParticlesParameters {
    FlameParticlesParameters { particles: 900, ..Default::default() }
}

const GAS_MODELS: [GasModel; 2] = [GasModel::Combustion, GasModel::Euler];

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    GAS_MODELS.into_iter().for_each(compare_numbers_of_threads);
}

fn compare_numbers_of_threads(gas_model: GasModel) {
    // So many that every part of a step, and of the drawing, is split into several tasks.
    let parameters = FlameParticlesParameters { particles: 30_000, gas_model, ..Default::default() };
    let rendering = GasRenderingParameters::default();
    let camera = CameraParameters { position: Animated::from([0.0, 0.4, 3.0]), ..CameraParameters::default() };
    let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.04, [256, 192], 0);
    let (wind, buffers) = (Wind::new(WindParameters::default(), 1, None), BufferPool::default());
    let state = |threads| {
        let mut simulation = simulation(&parameters);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            World::default().run_steps(&mut simulation, -40, 0, |_, _| {});
            let gas = gas(&simulation, &buffers);
            let around = Surroundings::from_wind(&wind);
            let prepared = PreparedGas::new(gas, &rendering, &view, &around, &Unobserved).unwrap();
            let mut strip = Strip::default();
            strip.reset(Rect::from_size(256, 192), None, 0);
            prepared.draw(&DepthInterval::ALL, &mut strip);
            (simulation.particles.len(), snapshot::write(&simulation.particles), strip.radiance)
        })
    };
    let one = state(1);
    assert!(one.0 > 7_000 && one.2[0].iter().any(|value| *value > 0.0), "{} particles", one.0);
    for threads in [2, 3] {
        let more = state(threads);
        assert!(one.1 == more.1, "{threads} threads move it otherwise");
        assert!(one.2 == more.2, "{threads} threads draw it otherwise");
    }
}

#[test]
fn a_restored_state_goes_on_as_if_nothing_had_been() {
    for gas_model in GAS_MODELS {
        let parameters = FlameParticlesParameters { gas_model, ..small() };
        let mut whole = simulation(&parameters);
        World::default().run_steps(&mut whole, -60, -20, |_, _| {});
        let saved = snapshot::write(&whole.particles);
        World::default().run_steps(&mut whole, -20, 0, |_, _| {});
        let mut resumed = simulation(&parameters);
        resumed.particles = snapshot::read(&resumed.particles, &saved, 1).unwrap();
        World::default().run_steps(&mut resumed, -20, 0, |_, _| {});
        assert!(snapshot::write(&whole.particles) == snapshot::write(&resumed.particles));
    }
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
    for impossible in [f32::NAN, f32::INFINITY, -1e13] {
        let mut far = good.clone();
        let end = far.len() - 4;
        far[end..].copy_from_slice(&impossible.to_le_bytes());
        assert_eq!(read(&far, 1), Some(SnapshotError::Damaged), "{impossible}");
    }
    let mut newer = good;
    newer[0] = 99;
    assert_eq!(read(&newer, 1), Some(SnapshotError::Version { found: 99, known: 2 }));
}
