//! Fingerprints (BLAKE3) of everything that pixels, states and built objects depend on: equal fingerprints mean equal bytes.
//!
//! That of a frame is [`Plan::frame_fingerprint`](crate::Plan::frame_fingerprint), that of a simulation's state
//! [`CompiledScene::state_fingerprint`](crate::CompiledScene::state_fingerprint).

use std::fmt::Display;

use bansho_base::{
    color::{AlphaConvention, BitDepth},
    host::assets::Assets,
    parameters::{Parameters, Table, Value},
};
use bansho_scene::{Instance, Scene, SharedInstance};

/// A hash of everything that something depends on.
pub type Fingerprint = [u8; 32];

/// The version of this crate, since another version may draw other pixels.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The fingerprint of a PNG of a frame: that of the frame's pixels, combined with how they are stored where that is not the default.
pub fn of_png(frame: Fingerprint, bits: BitDepth, alpha: AlphaConvention) -> Fingerprint {
    let mut fingerprint = frame;
    if bits == BitDepth::Sixteen {
        fingerprint = combined(fingerprint, b"16 bits");
    }
    if alpha == AlphaConvention::Encoded {
        fingerprint = combined(fingerprint, b"encoded alpha");
    }
    fingerprint
}

/// The fingerprint of something with one more property.
fn combined(fingerprint: Fingerprint, property: &[u8]) -> Fingerprint {
    *blake3::Hasher::new().update(&fingerprint).update(property).finalize().as_bytes()
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
    own.parameters.asset_paths().iter().for_each(|path| hash_shared_asset(scene, assets, path, &mut hasher));
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

/// A fingerprint of all that a shared table is built from.
pub(crate) fn of_shared(table: &SharedInstance, scene: &Scene, assets: &dyn Assets) -> Fingerprint {
    let mut hasher = blake3::Hasher::new();
    hash_table(table.kind.key, table.parameters.canonical(), &mut hasher);
    table.parameters.asset_paths().iter().for_each(|path| hash_shared_asset(scene, assets, path, &mut hasher));
    *hasher.finalize().as_bytes()
}

/// A fingerprint of all from which the phenomenon is built that draws the shared tables called `key`: theirs.
pub(crate) fn of_drawn(key: &str, tables: &[Fingerprint], scene: &Scene) -> Fingerprint {
    let mut hasher = seeded(scene);
    hasher.update(key.as_bytes());
    tables.iter().for_each(|fingerprint| _ = hasher.update(fingerprint));
    *hasher.finalize().as_bytes()
}

/// Hashes all that the state of stepped phenomena depends on: not the camera, the size or the exposure.
pub(crate) fn hash_state(scene: &Scene, assets: &dyn Assets, hasher: &mut blake3::Hasher) {
    let seeded = format!("bansho {VERSION} seed {} loop {:?} wind", scene.seed, scene.loop_s);
    hash_table(&seeded, scene.wind.to_table(), hasher);
    hash_table("air", scene.air.to_table(), hasher);
    let mut shared: Vec<&SharedInstance> = scene.tables.iter().collect();
    shared.sort_by_key(|table| table.kind.shared_role().map(|role| role.fingerprint_order));
    for table in &shared {
        hash_table(table.kind.key, table.parameters.canonical(), hasher);
    }
    let enabled: Vec<&Instance> = scene.instances.iter().filter(|instance| instance.enabled).collect();
    for instance in &enabled {
        hash_instance(instance, hasher);
    }
    let files_of_tables = shared.iter().flat_map(|table| table.parameters.asset_paths());
    let files_of_phenomena = enabled.iter().flat_map(|instance| instance.parameters.asset_paths());
    for path in files_of_tables.chain(files_of_phenomena) {
        hash_shared_asset(scene, assets, &path, hasher);
    }
}

/// Hashes a line: a label and a value as text.
pub(crate) fn hash_line(label: &str, value: impl Display, hasher: &mut blake3::Hasher) {
    hasher.update(format!("{label} {value}\n").as_bytes());
}

/// Hashes a line: a label and a table as text.
pub(crate) fn hash_table(label: &str, table: Table, hasher: &mut blake3::Hasher) {
    hash_line(label, Value::Table(table), hasher);
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
