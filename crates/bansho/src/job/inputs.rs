//! What a scene is read from, over which no job may write.

use std::path::Path;

use bansho_media::{assets::FileAssets, output::overwrite_policy::InputFiles};
use bansho_render::Plan;

use super::scene_file::SceneFile;

/// The files that a scene is read from: itself, and all that it names, in every frame of the shot and in `numbers`, and what those name.
pub(super) fn inputs(scene: &SceneFile, plan: &Plan, numbers: &[i64]) -> InputFiles {
    let files = FileAssets::with_limits(&scene.folder, scene.inputs.clone());
    let first = plan.frames().start;
    let mut inputs = InputFiles::default();
    let name = Path::new(&scene.name);
    inputs.insert(name);
    // Its name is for people, and a folder that is not Unicode stands in it in another way.
    name.file_name().into_iter().for_each(|name| inputs.insert(&scene.folder.join(name)));
    for path in plan.scene().asset_paths() {
        let frames: Vec<i64> =
            if path.contains('#') { plan.frames().chain(numbers.iter().copied()).collect() } else { vec![first] };
        let found = frames.into_iter().filter_map(|frame| files.files(&path, frame).ok());
        found.flatten().for_each(|file| inputs.insert(&file));
    }
    inputs
}
