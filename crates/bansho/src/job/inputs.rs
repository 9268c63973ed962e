//! No job may write over what its scene is made from.

use std::{
    collections::HashSet,
    fs,
    path::{Path, PathBuf},
};

use bansho_media::plates::FileAssets;
use bansho_render::Plan;

use super::{
    error::{Conflict, JobError},
    scene_file::SceneFile,
};

/// Whether any of the files to be written is one that the scene is read from, also by another name of it.
///
/// # Errors
/// The first that is.
pub(super) fn check_kept(
    scene: &SceneFile,
    plan: &Plan,
    numbers: &[i64],
    outputs: impl IntoIterator<Item = PathBuf>,
) -> Result<(), JobError> {
    let inputs = inputs(scene, plan, numbers);
    for path in outputs {
        // What is not there yet is nobody's.
        if fs::canonicalize(&path).is_ok_and(|file| inputs.contains(&file)) {
            return Err(Conflict::OverInput { path }.into());
        }
    }
    Ok(())
}

/// The files that a scene is read from: itself, and all that it names, in every frame of the shot and in `numbers`.
fn inputs(scene: &SceneFile, plan: &Plan, numbers: &[i64]) -> HashSet<PathBuf> {
    let files = FileAssets::new(&scene.folder);
    let first = plan.frames().start;
    let mut inputs: HashSet<PathBuf> = fs::canonicalize(Path::new(&scene.name)).into_iter().collect();
    for path in plan.scene().asset_paths() {
        let frames: Vec<i64> =
            if path.contains('#') { plan.frames().chain(numbers.iter().copied()).collect() } else { vec![first] };
        let found = frames.into_iter().filter_map(|frame| fs::canonicalize(files.resolve(&path, frame).ok()?).ok());
        inputs.extend(found);
    }
    inputs
}
