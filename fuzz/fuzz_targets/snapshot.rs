//! Snapshots: any bytes are refused, or put a shot into a state from which it goes on to finite particles.
//!
//! The first byte says of which scene; the others are the state of its phenomenon. One input of a hundred, by its digest, is given to a whole
//! shot instead, with a header and a checksum that are right, since a checksum would keep nearly every change from being looked at, and goes
//! on from there; a few as they are. Shots make all of their scene anew to restore it, which takes hundreds of times longer.
#![no_main]

use std::{
    cell::RefCell,
    sync::{Arc, LazyLock},
};

use bansho_base::{host::{assets::MemoryAssets, observer::Unobserved}, phenomenon::Phenomenon, geometry::point_cloud::PointCloud};
use bansho_render::{Backend, CpuBackend, Plan, PlanOptions, Scene, Shot, phenomena::KINDS};
use bansho_fuzz::one_thread;

const GAS: &str = "bansho = 1\n[picture]\nsize = [8, 6]\n[[flame_particles]]\nparticles = 60\npreroll_s = 0.0\n";
const AURORA: &str = "bansho = 1\n[picture]\nsize = [8, 6]\n[[aurora]]\npreroll_s = 0.0\nparticles = { count = 100 }\nfield = { cells = 16 }\n";

/// Bytes before the state of the first phenomenon: magic, version, key, number of phenomena.
const HEADER: usize = 8 + 4 + 32 + 8;
/// Bytes before a phenomenon's own state: steps taken, length.
const CLOCK: usize = 8 + 8;

/// First bytes of an input's digest up to which it is given to a shot, as it is and with a header.
const AS_IT_IS: u8 = 0;
const GOES_ON: u8 = 2;

fn plan(scene: &str) -> Arc<Plan> {
    let assets = MemoryAssets::default();
    let scene = Scene::parse("snapshot.toml", scene, KINDS, &assets).expect("the scene is right");
    Arc::new(Plan::new(scene, &PlanOptions::default(), Arc::new(assets)).expect("the scene can be planned"))
}

fn open(plan: &Arc<Plan>) -> Restored {
    let shot = CpuBackend.open(plan.clone()).expect("the shot opens");
    let header = shot.snapshot()[..HEADER].to_vec();
    let phenomenon = plan.open().expect("its phenomena can be made").remove(0);
    Restored { shot, header, phenomenon }
}

/// A scene's shot, the header of its snapshots, and its phenomenon by itself.
struct Restored {
    shot: Box<dyn Shot>,
    header: Vec<u8>,
    phenomenon: Box<dyn Phenomenon>,
}

thread_local! {
    static SCENES: RefCell<Vec<Restored>> = RefCell::new(PLANS.iter().map(open).collect());
}

static PLANS: LazyLock<[Arc<Plan>; 2]> = LazyLock::new(|| {
    one_thread();
    [plan(GAS), plan(AURORA)]
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((&first, rest)) = bytes.split_first() else { return };
    SCENES.with_borrow_mut(|scenes| {
        let Restored { shot, header, phenomenon } = &mut scenes[usize::from(first & 1)];
        let digest = blake3::hash(bytes).as_bytes()[0];
        if digest <= AS_IT_IS {
            if shot.restore(rest).is_ok() {
                check(&shot.particles());
            }
        } else if digest <= GOES_ON {
            if shot.restore(&sealed(header, rest)).is_ok() {
                check(&shot.particles());
                check_next(shot.as_mut());
            }
        } else if rest.len() > CLOCK && phenomenon.restore(&rest[CLOCK..]).is_ok() {
            phenomenon.particles(0.0).iter().for_each(check);
            let again = phenomenon.snapshot();
            phenomenon.restore(&again).expect("what was restored is written as something that can be restored");
        }
    });
});

/// A state with a header and a checksum that are right.
fn sealed(header: &[u8], state: &[u8]) -> Vec<u8> {
    let contents = [header, state].concat();
    let checksum = *blake3::hash(&contents).as_bytes();
    [&contents[..], &checksum].concat()
}

fn check(points: &PointCloud) {
    let values = points.positions.iter().chain(&points.velocities).flatten();
    assert!(values.chain(points.quantities.values().flatten()).all(|value| value.is_finite()));
}

fn check_next(shot: &mut dyn Shot) {
    if shot.advance(1, &Unobserved).is_ok() && shot.draw(&Unobserved).is_ok() {
        check(&shot.particles());
        let frame = shot.read().expect("what was drawn can be read");
        assert!(frame.beauty.pixels().iter().flatten().all(|value| value.is_finite()), "the picture is not finite");
    }
}
