//! Fingerprints (BLAKE3) of everything that pixels, states and built objects depend on: equal fingerprints mean equal bytes.
//!
//! That of a frame is [`Plan::frame_fingerprint`](crate::Plan::frame_fingerprint), that of a simulation's state
//! [`CompiledScene::state_fingerprint`](crate::CompiledScene::state_fingerprint).

use bansho_base::{
    color::{AlphaConvention, BitDepth},
    host::assets::Assets,
    parameters::{Parameters, Table, Value},
    world::obstacle::ObstacleParameters,
    world::sky::SkyParameters,
};
use bansho_environment::ground::GroundParameters;
use bansho_scene::{Instance, LightParameters, Scene};

/// A hash of everything that something depends on.
pub type Fingerprint = [u8; 32];

/// The version of this crate, since another version may draw other pixels.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The fingerprint of a PNG of a frame: that of the frame's pixels, combined with how they are stored where that is not the default.
pub fn of_png(frame: Fingerprint, bits: BitDepth, alpha: AlphaConvention) -> Fingerprint {
    let stored = |fingerprint: Fingerprint, how: &[u8]| {
        *blake3::Hasher::new().update(&fingerprint).update(how).finalize().as_bytes()
    };
    let frame = if bits == BitDepth::Sixteen { stored(frame, b"16 bits") } else { frame };
    if alpha == AlphaConvention::Encoded { stored(frame, b"encoded alpha") } else { frame }
}

/// A hasher of the seed and the length of the loop.
fn seeded(scene: &Scene) -> blake3::Hasher {
    let mut hasher = blake3::Hasher::new();
    hasher.update(format!("seed {} loop {:?}\n", scene.seed, scene.loop_s).as_bytes());
    hasher
}

/// A fingerprint of all that a phenomenon of the scene is built from.
pub(crate) fn of_instance(own: &Instance, scene: &Scene, assets: &dyn Assets) -> Fingerprint {
    let mut hasher = seeded(scene);
    hash_instance(own, &mut hasher);
    own.parameters.assets().iter().for_each(|path| hash_shared_asset(scene, assets, path, &mut hasher));
    *hasher.finalize().as_bytes()
}

/// A fingerprint of the parameters that a program has set in its change number `revision`: cheaper than one of the parameters themselves.
pub(crate) fn of_revision(name: &str, revision: u64) -> Fingerprint {
    *blake3::Hasher::new()
        .update(b"revision")
        .update(&revision.to_le_bytes())
        .update(name.as_bytes())
        .finalize()
        .as_bytes()
}

/// A fingerprint of all that an obstacle is built from.
pub(crate) fn of_obstacle(obstacle: &ObstacleParameters, scene: &Scene, assets: &dyn Assets) -> Fingerprint {
    let mut hasher = blake3::Hasher::new();
    hash_table("obstacle", obstacle.to_table(), &mut hasher);
    obstacle.file.iter().for_each(|path| hash_shared_asset(scene, assets, &path.0, &mut hasher));
    *hasher.finalize().as_bytes()
}

/// A fingerprint of all that the visible lamps are built from.
pub(crate) fn of_lamps(lights: &[LightParameters], scene: &Scene) -> Fingerprint {
    let mut hasher = seeded(scene);
    lights.iter().for_each(|light| hash_table("light", light.to_table(), &mut hasher));
    *hasher.finalize().as_bytes()
}

/// A fingerprint of all that the visible obstacles are built from: theirs.
pub(crate) fn of_solids(obstacles: &[Fingerprint], scene: &Scene) -> Fingerprint {
    let mut hasher = seeded(scene);
    hasher.update(b"solids");
    obstacles.iter().for_each(|fingerprint| _ = hasher.update(fingerprint));
    *hasher.finalize().as_bytes()
}

/// A fingerprint of all that the ground is built from.
pub(crate) fn of_ground(ground: &GroundParameters, scene: &Scene) -> Fingerprint {
    let mut hasher = seeded(scene);
    hash_table("ground", ground.to_table(), &mut hasher);
    *hasher.finalize().as_bytes()
}

/// A fingerprint of all that the sky as a backdrop is built from.
pub(crate) fn of_sky(sky: &SkyParameters, scene: &Scene) -> Fingerprint {
    let mut hasher = seeded(scene);
    hash_table("sky", sky.to_table(), &mut hasher);
    *hasher.finalize().as_bytes()
}

/// Hashes all that the state of stepped phenomena depends on: not the camera, the size or the exposure.
pub(crate) fn hash_state(scene: &Scene, assets: &dyn Assets, hasher: &mut blake3::Hasher) {
    let seeded = format!("bansho {VERSION} seed {} loop {:?} wind", scene.seed, scene.loop_s);
    hash_table(&seeded, scene.wind.to_table(), hasher);
    hash_table("air", scene.air.to_table(), hasher);
    for light in &scene.lights {
        hash_table("light", light.to_table(), hasher);
    }
    if let Some(sky) = &scene.sky {
        hash_table("sky", sky.to_table(), hasher);
    }
    if let Some(ground) = &scene.ground {
        hash_table("ground", ground.to_table(), hasher);
    }
    for obstacle in &scene.obstacles {
        hash_table("obstacle", obstacle.to_table(), hasher);
    }
    let enabled = || scene.instances.iter().filter(|instance| instance.enabled);
    enabled().for_each(|own| hash_instance(own, hasher));
    let obstacles = scene.obstacles.iter().filter_map(|obstacle| Some(obstacle.file.as_ref()?.0.clone()));
    obstacles
        .chain(enabled().flat_map(|own| own.parameters.assets()))
        .for_each(|path| hash_shared_asset(scene, assets, &path, hasher));
}

fn hash_table(label: &str, table: Table, hasher: &mut blake3::Hasher) {
    hasher.update(format!("{label} {}\n", Value::Table(table)).as_bytes());
}

fn hash_instance(instance: &Instance, hasher: &mut blake3::Hasher) {
    hash_table(&format!("{} {:?}", instance.kind.key, instance.name), instance.parameters.canonical(), hasher);
}

/// Hashes an asset that does not change between frames.
pub(crate) fn hash_shared_asset(scene: &Scene, assets: &dyn Assets, path: &str, hasher: &mut blake3::Hasher) {
    hash_asset(assets, path, scene.picture.first_frame, hasher);
}

/// Hashes the file that an asset path means in frame `number`. A missing file is hashed as `missing`, so that frames are drawn again when
/// it returns.
pub(crate) fn hash_asset(assets: &dyn Assets, path: &str, number: i64, hasher: &mut blake3::Hasher) {
    hasher.update(path.as_bytes());
    match assets.digest(path, number) {
        Ok(digest) => hasher.update(&digest),
        Err(_) => hasher.update(b"missing"),
    };
}
