//! Fingerprints of what pixels and states depend on: equal fingerprints, equal bytes.

use bansho_base::{
    color::AlphaConvention,
    host::assets::Assets,
    parameters::{Parameters, Table, Value},
    world::obstacle::ObstacleParameters,
    world::sky::SkyParameters,
};
use bansho_environment::ground::GroundParameters;

use crate::{compiled::CompiledScene, display::BitDepth, plan::Plan};
use bansho_scene::{Instance, LightParameters, Scene};

/// A hash of everything that something depends on.
pub type Fingerprint = [u8; 32];

/// The version whose pictures these are; another version's frames are drawn anew.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A fingerprint of all that frame `number`'s pixels depend on.
pub fn of_frame(compiled: &CompiledScene, plan: &Plan, number: i64) -> Fingerprint {
    let mut hasher = blake3::Hasher::new();
    let assets = compiled.assets().as_ref();
    state(&plan.scene, assets, &mut hasher);
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
        asset(assets, &path.0, number, &mut hasher);
    }
    // The first one's light falls on all frames.
    plan.scene.plate.image.iter().for_each(|path| shared_asset(&plan.scene, assets, &path.0, &mut hasher));
    *hasher.finalize().as_bytes()
}

/// The fingerprint of a PNG of a frame: that of the frame's pixels, and of how they are stored where that may differ.
pub fn of_png(frame: Fingerprint, bits: BitDepth, alpha: AlphaConvention) -> Fingerprint {
    let stored = |fingerprint: Fingerprint, how: &[u8]| {
        *blake3::Hasher::new().update(&fingerprint).update(how).finalize().as_bytes()
    };
    let frame = if bits == BitDepth::Sixteen { stored(frame, b"16 bits") } else { frame };
    if alpha == AlphaConvention::Encoded { stored(frame, b"encoded alpha") } else { frame }
}

/// A fingerprint of all that the state of stepped phenomena depends on: not the camera, the size or the exposure.
pub fn of_state(compiled: &CompiledScene) -> Fingerprint {
    let mut hasher = blake3::Hasher::new();
    state(compiled.scene(), compiled.assets().as_ref(), &mut hasher);
    *hasher.finalize().as_bytes()
}

/// A hasher that knows the seed and the loop.
fn seeded(scene: &Scene) -> blake3::Hasher {
    let mut hasher = blake3::Hasher::new();
    hasher.update(format!("seed {} loop {:?}\n", scene.seed, scene.loop_s).as_bytes());
    hasher
}

/// A fingerprint of all that a phenomenon of the scene is built from.
pub(crate) fn of_instance(own: &Instance, scene: &Scene, assets: &dyn Assets) -> Fingerprint {
    let mut hasher = seeded(scene);
    instance(own, &mut hasher);
    own.parameters.assets().iter().for_each(|path| shared_asset(scene, assets, path, &mut hasher));
    *hasher.finalize().as_bytes()
}

/// A fingerprint of all that an obstacle is built from.
pub(crate) fn of_obstacle(obstacle: &ObstacleParameters, scene: &Scene, assets: &dyn Assets) -> Fingerprint {
    let mut hasher = blake3::Hasher::new();
    table("obstacle", obstacle.to_table(), &mut hasher);
    obstacle.file.iter().for_each(|path| shared_asset(scene, assets, &path.0, &mut hasher));
    *hasher.finalize().as_bytes()
}

/// A fingerprint of all that the lamps that are seen are built from.
pub(crate) fn of_lamps(lights: &[LightParameters], scene: &Scene) -> Fingerprint {
    let mut hasher = seeded(scene);
    lights.iter().for_each(|light| table("light", light.to_table(), &mut hasher));
    *hasher.finalize().as_bytes()
}

/// A fingerprint of all that the ground is built from.
pub(crate) fn of_ground(ground: &GroundParameters, scene: &Scene) -> Fingerprint {
    let mut hasher = seeded(scene);
    table("ground", ground.to_table(), &mut hasher);
    *hasher.finalize().as_bytes()
}

/// A fingerprint of all that the sky as a backdrop is built from.
pub(crate) fn of_sky(sky: &SkyParameters, scene: &Scene) -> Fingerprint {
    let mut hasher = seeded(scene);
    table("sky", sky.to_table(), &mut hasher);
    *hasher.finalize().as_bytes()
}

fn state(scene: &Scene, assets: &dyn Assets, hasher: &mut blake3::Hasher) {
    let seeded = format!("bansho {VERSION} seed {} loop {:?} wind", scene.seed, scene.loop_s);
    table(&seeded, scene.wind.to_table(), hasher);
    table("air", scene.air.to_table(), hasher);
    for light in &scene.lights {
        table("light", light.to_table(), hasher);
    }
    if let Some(sky) = &scene.sky {
        table("sky", sky.to_table(), hasher);
    }
    if let Some(ground) = &scene.ground {
        table("ground", ground.to_table(), hasher);
    }
    for obstacle in &scene.obstacles {
        table("obstacle", obstacle.to_table(), hasher);
    }
    let enabled = || scene.instances.iter().filter(|instance| instance.enabled);
    enabled().for_each(|own| instance(own, hasher));
    let obstacles = scene.obstacles.iter().filter_map(|obstacle| Some(obstacle.file.as_ref()?.0.clone()));
    obstacles
        .chain(enabled().flat_map(|own| own.parameters.assets()))
        .for_each(|path| shared_asset(scene, assets, &path, hasher));
}

fn table(label: &str, table: Table, hasher: &mut blake3::Hasher) {
    hasher.update(format!("{label} {}\n", Value::Table(table)).as_bytes());
}

fn instance(instance: &Instance, hasher: &mut blake3::Hasher) {
    table(&format!("{} {:?}", instance.kind.key, instance.name), instance.parameters.canonical(), hasher);
}

/// An asset that all frames have in common.
fn shared_asset(scene: &Scene, assets: &dyn Assets, path: &str, hasher: &mut blake3::Hasher) {
    asset(assets, path, scene.picture.first_frame, hasher);
}

/// An asset that vanished has a fingerprint too, so that its return draws the frame anew.
fn asset(assets: &dyn Assets, path: &str, number: i64, hasher: &mut blake3::Hasher) {
    hasher.update(path.as_bytes());
    match assets.digest(path, number) {
        Ok(digest) => hasher.update(&digest),
        Err(_) => hasher.update(b"missing"),
    };
}
