//! Meshes as glTF, text and binary: any bytes are refused, or are triangles within the bounds that a mesh promises.
#![no_main]

use bansho_base::{
    geometry::mesh::{MAX_TRIANGLES, Mesh},
    host::assets::AssetProblem,
};
use bansho_media::{gltf::decode_mesh, limits::MemoryLimit};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    // A file beside it is itself, or is missing.
    let beside = |name: &str, _: u64| if name.len() < 8 { Ok(bytes.to_vec()) } else { Err(AssetProblem::Missing) };
    for extension in ["gltf", "glb"] {
        if let Ok(mesh) = decode_mesh(bytes, extension, &beside, MemoryLimit::default()) {
            check(&mesh);
        }
    }
});

fn check(mesh: &Mesh) {
    assert!(!mesh.is_empty() && mesh.len() <= MAX_TRIANGLES);
    let [low, high] = mesh.bounds();
    assert!(low.is_finite() && high.is_finite() && low.cmple(high).all());
    for triangle in mesh.triangles() {
        assert!(triangle.iter().all(|corner| corner.cmpge(low).all() && corner.cmple(high).all()));
    }
}
