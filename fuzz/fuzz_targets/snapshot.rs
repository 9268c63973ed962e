//! Snapshots: any bytes are refused, or put a shot into a state from which it goes on to finite particles.
//!
//! The first byte says of which scene; the others are the state of its phenomenon. One input of a hundred, by its digest, is given to a whole
//! shot instead, with a header and a checksum that are right, since a checksum would keep nearly every change from being looked at, and goes
//! on from there; a few as they are. Shots start all runs of their scene anew to restore it, which takes longer.
#![no_main]

use std::{
    cell::RefCell,
    sync::{Arc, LazyLock},
};

use bansho_base::{
    camera::CameraParameters,
    geometry::point_cloud::PointCloud,
    host::{assets::MemoryAssets, observer::Unobserved},
    phenomenon::{
        Run,
        strip::{Shutter, View},
        surroundings::Surroundings,
    },
    world::wind::{Wind, WindParameters},
};
use bansho::compile_scene;
use bansho_render::{CompiledScene, Plan, PlanOptions, Shot};
use bansho_fuzz::one_thread;

const GAS: &str = "bansho = 2\n[picture]\nsize = [8, 6]\n[[flame_particles]]\nparticles = 60\npreroll_s = 0.0\n";
const VOLUME: &str = "bansho = 2\n[picture]\nsize = [8, 6]\n[[flame_volume]]\nresolution = 6\npreroll_s = 0.0\n";
const AURORA: &str = "bansho = 2\n[picture]\nsize = [8, 6]\n[[aurora]]\npreroll_s = 0.0\nparticles = { count = 100 }\nfield = { cells = 16 }\n";

/// Bytes before the state of the first phenomenon: magic, version, key, number of phenomena.
const HEADER: usize = 8 + 4 + 32 + 8;
/// Bytes before a phenomenon's own state: steps taken, length.
const CLOCK: usize = 8 + 8;

/// First bytes of an input's digest up to which it is given to a shot, as it is and with a header.
const AS_IT_IS: u8 = 0;
const GOES_ON: u8 = 2;

fn compiled(scene: &str) -> Arc<CompiledScene> {
    compile_scene("snapshot.toml", scene, Arc::new(MemoryAssets::default())).expect("the scene is right")
}

fn open(compiled: &Arc<CompiledScene>) -> Restored {
    let plan = Plan::new(compiled, &PlanOptions::default()).expect("the scene can be planned");
    let shot = Shot::open(compiled.clone(), Arc::new(plan));
    let header = shot.snapshot()[..HEADER].to_vec();
    let run = compiled.phenomena().next().expect("it shows a phenomenon").clone().start();
    Restored { shot, header, run }
}

/// A scene's shot, the header of its snapshots, and a run of its phenomenon by itself.
struct Restored {
    shot: Shot,
    header: Vec<u8>,
    run: Box<dyn Run>,
}

thread_local! {
    static SCENES: RefCell<Vec<Restored>> = RefCell::new(COMPILED.iter().map(open).collect());
}

static COMPILED: LazyLock<[Arc<CompiledScene>; 3]> = LazyLock::new(|| {
    one_thread();
    [compiled(GAS), compiled(AURORA), compiled(VOLUME)]
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((&first, rest)) = bytes.split_first() else { return };
    SCENES.with_borrow_mut(|scenes| {
        let Restored { shot, header, run } = &mut scenes[usize::from(first % 3)];
        let digest = blake3::hash(bytes).as_bytes()[0];
        if digest <= AS_IT_IS {
            if shot.restore(rest).is_ok() {
                check(&shot.particles());
            }
        } else if digest <= GOES_ON {
            if shot.restore(&sealed(header, rest)).is_ok() {
                check(&shot.particles());
                check_next(shot);
            }
        } else if rest.len() > CLOCK {
            let stepped = run.as_stepped_mut().expect("it is stepped");
            if stepped.restore(&rest[CLOCK..]).is_ok() {
                let again = stepped.snapshot();
                stepped.restore(&again).expect("what was restored is written as something that can be restored");
                let shutter = Shutter { open: 0.0, close: 0.0 };
                let view = View::new(CameraParameters::default(), shutter, 0.0, [8, 6], 0);
                let wind = Wind::new(WindParameters::default(), 1, None);
                run.export_particles(&view, &Surroundings::from_wind(&wind)).iter().for_each(check);
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

fn check(points: &PointCloud) {
    let values = points.positions.iter().chain(&points.velocities).flatten();
    assert!(values.chain(points.quantities.values().flatten()).all(|value| value.is_finite()));
}

fn check_next(shot: &mut Shot) {
    if let Ok(frame) = bansho::draw(shot, 1, &Unobserved) {
        check(&shot.particles());
        assert!(frame.beauty.pixels().iter().flatten().all(|value| value.is_finite()), "the picture is not finite");
    }
}
