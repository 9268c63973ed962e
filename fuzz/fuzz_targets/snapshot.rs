//! Snapshots: any bytes are refused, or put a shot into a state from which it goes on to finite particles.
//!
//! The bits of the first byte say which shot; whether the others are a whole file or only what stands between header and checksum, which
//! are then made right, since a checksum would keep nearly every change from being looked at; and whether the shot goes on, which takes a
//! hundred times longer than to be restored.
#![no_main]

use std::{
    cell::RefCell,
    sync::{Arc, LazyLock},
};

use bansho_base::{assets::MemoryAssets, observer::Unobserved};
use bansho_fuzz::one_thread;
use bansho_render::{Backend, CpuBackend, Plan, PlanOptions, Scene, Shot, phenomena::KINDS};

const GAS: &str = "bansho = 1\n[picture]\nsize = [8, 6]\n[[flame_particles]]\nparticles = 60\npreroll_s = 0.0\n";
const AURORA: &str = "bansho = 1\n[picture]\nsize = [8, 6]\n[[aurora]]\npreroll_s = 0.0\nparticles = { count = 100 }\nfield = { cells = 16 }\n";

/// Bytes before the state of the first phenomenon: magic, version, key, number of phenomena.
const HEADER: usize = 8 + 4 + 32 + 8;
const CHECKSUM: usize = 32;

/// Bits of the first byte.
const IS_AURORA: u8 = 1;
const IS_STATE: u8 = 2;
const GOES_ON: u8 = 4 | 8;

fn plan(scene: &str) -> Arc<Plan> {
    let assets = MemoryAssets::default();
    let scene = Scene::parse("snapshot.toml", scene, KINDS, &assets).expect("the scene is right");
    Arc::new(Plan::new(scene, &PlanOptions::default(), Arc::new(assets)).expect("the scene can be planned"))
}

/// A shot of each scene, with the header of its snapshots.
fn open(plan: &Arc<Plan>) -> Box<dyn Shot> {
    CpuBackend.open(plan.clone()).expect("the shot opens")
}

thread_local! {
    static SHOTS: RefCell<Vec<(Box<dyn Shot>, Vec<u8>)>> = RefCell::new({
        let headed = |plan| {
            let shot = open(plan);
            let header = shot.snapshot()[..HEADER].to_vec();
            (shot, header)
        };
        PLANS.iter().map(headed).collect()
    });
}

static PLANS: LazyLock<[Arc<Plan>; 2]> = LazyLock::new(|| {
    one_thread();
    [plan(GAS), plan(AURORA)]
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((&first, rest)) = bytes.split_first() else { return };
    SHOTS.with_borrow_mut(|shots| {
        let (shot, header) = &mut shots[usize::from(first & IS_AURORA)];
        let whole = if first & IS_STATE == 0 { rest.to_vec() } else { sealed(header, rest) };
        if shot.restore(&whole).is_ok() {
            assert!(shot.snapshot().len() < whole.len() + HEADER + CHECKSUM, "a snapshot grows by being read");
            check_particles(shot.as_ref());
            if first & GOES_ON == GOES_ON {
                check_next(shot.as_mut());
            }
        }
    });
});

/// A state with a header and a checksum that are right.
fn sealed(header: &[u8], state: &[u8]) -> Vec<u8> {
    let contents = [header, state].concat();
    let checksum = *blake3::hash(&contents).as_bytes();
    [&contents[..], &checksum].concat()
}

fn check_particles(shot: &dyn Shot) {
    let points = shot.particles();
    let values = points.positions.iter().chain(&points.velocities).flatten();
    assert!(values.chain(points.quantities.values().flatten()).all(|value| value.is_finite()));
}

fn check_next(shot: &mut dyn Shot) {
    if shot.advance(1, &Unobserved).is_ok() && shot.draw(&Unobserved).is_ok() {
        check_particles(shot);
        let frame = shot.read().expect("what was drawn can be read");
        assert!(frame.beauty.pixels().iter().flatten().all(|value| value.is_finite()), "the picture is not finite");
    }
}
