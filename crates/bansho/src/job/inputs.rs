//! What a scene is read from, over which no job may write.

use std::{fs, path::Path};

use bansho_media::{meshes, overwriting::InputFiles, plates::FileAssets};
use bansho_render::Plan;

use super::scene_file::SceneFile;

/// The files that a scene is read from: itself, and all that it names, in every frame of the shot and in `numbers`, and what those name.
pub(super) fn inputs(scene: &SceneFile, plan: &Plan, numbers: &[i64]) -> InputFiles {
    let files = FileAssets::new(&scene.folder);
    let first = plan.frames().start;
    let mut inputs = InputFiles::default();
    let name = Path::new(&scene.name);
    inputs.insert(name);
    // Its name is for people, and a folder that is not Unicode stands in it in another way.
    name.file_name().into_iter().for_each(|name| inputs.insert(&scene.folder.join(name)));
    for path in plan.scene().asset_paths() {
        let frames: Vec<i64> =
            if path.contains('#') { plan.frames().chain(numbers.iter().copied()).collect() } else { vec![first] };
        for file in frames.into_iter().filter_map(|frame| files.resolve(&path, frame).ok()) {
            inputs.insert(&file);
            insert_buffers(&mut inputs, &file);
        }
    }
    inputs
}

/// The files that a mesh in text names.
fn insert_buffers(inputs: &mut InputFiles, file: &Path) {
    if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gltf")) {
        let names = fs::read(file).map(|json| meshes::files_beside(&json)).unwrap_or_default();
        names.iter().for_each(|name| inputs.insert(&file.with_file_name(name)));
    }
}
