//! Fingerprints of what pixels and states depend on: equal fingerprints, equal bytes.

use bansho_base::{
    color::AlphaConvention,
    parameters::{Parameters, Table, Value},
};

use crate::{display::BitDepth, phenomena::Part, plan::Plan, scene::Instance};

/// The version whose pictures these are; another version's frames are drawn anew.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A fingerprint of all that frame `number`'s pixels depend on.
pub fn of_frame(plan: &Plan, number: i64) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    state(plan, &mut hasher);
    let mut text = |label: &str, value: &dyn std::fmt::Display| {
        hasher.update(format!("{label} {value}\n").as_bytes());
    };
    text("time", &plan.time(number));
    text("number", &number);
    text("size", &format_args!("{:?} {:?}", plan.size, plan.window));
    text("exposure", &plan.exposure_ev100);
    text("outputs", &format_args!("{} {}", plan.layers, plan.aovs));
    text("view", &plan.display.name());
    if let Some(kelvin) = plan.scene.picture.white_balance_k {
        text("white balance", &kelvin);
    }
    text("fps", &format_args!("{:?}", plan.fps()));
    text("camera", &Value::Table(plan.scene.camera.to_table()));
    text("plate", &Value::Table(plan.scene.plate.to_table()));
    for path in [&plan.scene.plate.image, &plan.scene.plate.depth].into_iter().flatten() {
        asset(plan, &path.0, number, &mut hasher);
    }
    // The first one's light falls on all frames.
    plan.scene.plate.image.iter().for_each(|path| shared_asset(plan, &path.0, &mut hasher));
    *hasher.finalize().as_bytes()
}

/// The fingerprint of a PNG of a frame: that of the frame's pixels, and of how they are stored where that may differ.
pub fn of_png(frame: [u8; 32], bits: BitDepth, alpha: AlphaConvention) -> [u8; 32] {
    let stored = |fingerprint: [u8; 32], how: &[u8]| {
        *blake3::Hasher::new().update(&fingerprint).update(how).finalize().as_bytes()
    };
    let frame = if bits == BitDepth::Sixteen { stored(frame, b"16 bits") } else { frame };
    if alpha == AlphaConvention::Encoded { stored(frame, b"encoded alpha") } else { frame }
}

/// A fingerprint of all that the state of stepped phenomena depends on: not the camera, the size or the exposure.
pub fn of_state(plan: &Plan) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    state(plan, &mut hasher);
    *hasher.finalize().as_bytes()
}

/// A fingerprint of all that a part of the plan is made from.
pub(crate) fn of_part(plan: &Plan, part: &Part) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(format!("seed {} loop {:?}\n", plan.seed, plan.loop_s).as_bytes());
    match part {
        Part::Instance(own) => {
            instance(own, &mut hasher);
            own.source.assets().iter().for_each(|path| shared_asset(plan, path, &mut hasher));
        }
        Part::Lamps(lights) => lights.iter().for_each(|light| table("light", light.to_table(), &mut hasher)),
        Part::Ground(ground) => table("ground", ground.to_table(), &mut hasher),
        Part::Sky(sky) => table("sky", sky.to_table(), &mut hasher),
    }
    *hasher.finalize().as_bytes()
}

fn state(plan: &Plan, hasher: &mut blake3::Hasher) {
    let seeded = format!("bansho {VERSION} seed {} loop {:?} wind", plan.seed, plan.loop_s);
    table(&seeded, plan.scene.wind.to_table(), hasher);
    table("air", plan.scene.air.to_table(), hasher);
    for light in &plan.scene.lights {
        table("light", light.to_table(), hasher);
    }
    if let Some(sky) = &plan.scene.sky {
        table("sky", sky.to_table(), hasher);
    }
    if let Some(ground) = &plan.scene.ground {
        table("ground", ground.to_table(), hasher);
    }
    for obstacle in &plan.scene.obstacles {
        table("obstacle", obstacle.to_table(), hasher);
    }
    let enabled = || plan.scene.instances.iter().filter(|instance| instance.enabled);
    enabled().for_each(|own| instance(own, hasher));
    let obstacles = plan.scene.obstacles.iter().filter_map(|obstacle| Some(obstacle.file.as_ref()?.0.clone()));
    obstacles.chain(enabled().flat_map(|own| own.source.assets())).for_each(|path| shared_asset(plan, &path, hasher));
}

fn table(label: &str, table: Table, hasher: &mut blake3::Hasher) {
    hasher.update(format!("{label} {}\n", Value::Table(table)).as_bytes());
}

fn instance(instance: &Instance, hasher: &mut blake3::Hasher) {
    table(&format!("{} {:?}", instance.kind.key, instance.name), instance.source.canonical(), hasher);
}

/// An asset that all frames have in common.
fn shared_asset(plan: &Plan, path: &str, hasher: &mut blake3::Hasher) {
    asset(plan, path, plan.scene.picture.first_frame, hasher);
}

/// An asset that vanished has a fingerprint too, so that its return draws the frame anew.
fn asset(plan: &Plan, path: &str, number: i64, hasher: &mut blake3::Hasher) {
    hasher.update(path.as_bytes());
    match plan.assets.digest(path, number) {
        Ok(digest) => hasher.update(&digest),
        Err(_) => hasher.update(b"missing"),
    };
}
