//! Fingerprints of what pixels and states depend on: equal fingerprints, equal bytes.

use bansho_base::parameters::{Parameters, Table, Value};

use crate::plan::Plan;

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
    text("fps", &format_args!("{:?}", plan.fps()));
    text("camera", &Value::Table(plan.scene.camera.to_table()));
    text("plate", &Value::Table(plan.scene.plate.to_table()));
    for path in [&plan.scene.plate.image, &plan.scene.plate.depth].into_iter().flatten() {
        asset(plan, &path.0, number, &mut hasher);
    }
    *hasher.finalize().as_bytes()
}

/// A fingerprint of all that the state of stepped phenomena depends on: not the camera, the size or the exposure.
pub fn of_state(plan: &Plan) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    state(plan, &mut hasher);
    *hasher.finalize().as_bytes()
}

fn state(plan: &Plan, hasher: &mut blake3::Hasher) {
    let mut table = |label: &str, table: Table| {
        hasher.update(format!("{label} {}\n", Value::Table(table)).as_bytes());
    };
    table(&format!("bansho {VERSION} seed {} loop {:?} wind", plan.seed, plan.loop_s), plan.scene.wind.to_table());
    table("air", plan.scene.air.to_table());
    for light in &plan.scene.lights {
        table("light", light.to_table());
    }
    if let Some(sky) = &plan.scene.sky {
        table("sky", sky.to_table());
    }
    if let Some(ground) = &plan.scene.ground {
        table("ground", ground.to_table());
    }
    for obstacle in &plan.scene.obstacles {
        table("obstacle", obstacle.to_table());
    }
    let enabled = || plan.scene.instances.iter().filter(|instance| instance.enabled);
    for instance in enabled() {
        table(&format!("{} {:?}", instance.kind.key, instance.name), instance.source.canonical());
    }
    let obstacles = plan.scene.obstacles.iter().filter_map(|obstacle| Some(obstacle.file.as_ref()?.0.clone()));
    for path in obstacles.chain(enabled().flat_map(|instance| instance.source.assets())) {
        asset(plan, &path, plan.scene.picture.first_frame, hasher);
    }
}

/// An asset that vanished has a fingerprint too, so that its return draws the frame anew.
fn asset(plan: &Plan, path: &str, number: i64, hasher: &mut blake3::Hasher) {
    hasher.update(path.as_bytes());
    match plan.assets.digest(path, number) {
        Ok(digest) => hasher.update(&digest),
        Err(_) => hasher.update(b"missing"),
    };
}
