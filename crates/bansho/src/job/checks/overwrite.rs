//! Which files a job may overwrite, checked before anything is drawn: never those that the scene is read from.

use std::path::{Path, PathBuf};

use bansho_media::{
    assets::FileAssets,
    files::{
        file_identity::resolved,
        overwrite_policy::{InputFiles, OverwriteError, OverwritePolicy},
    },
};
use bansho_render::Plan;

use crate::job::{
    error::{Conflict, JobError},
    scene_file::SceneFile,
};

/// Whether every file to be written is new or may be written over, as far as can be known before it is.
///
/// # Errors
/// The first that work is made from; else the first that Bansho did not make, and how many more there are.
pub(crate) fn check(policy: &OverwritePolicy, outputs: impl IntoIterator<Item = PathBuf>) -> Result<(), JobError> {
    let mut folder = Folder::default();
    let (mut unmarked, mut others) = (None, 0);
    for path in outputs {
        match policy.check(&folder.resolved(&path)) {
            Ok(()) => {}
            Err(OverwriteError::Input) => return Err(Conflict::OverInput { path }.into()),
            Err(OverwriteError::NotMadeByBansho) if unmarked.is_none() => unmarked = Some(path),
            Err(OverwriteError::NotMadeByBansho) => others += 1,
        }
    }
    unmarked.map_or(Ok(()), |path| Err(Conflict::Unmarked { path, others }.into()))
}

/// The folder of the last path, and where it is: many files lie in one.
#[derive(Default)]
struct Folder {
    named: PathBuf,
    resolved: Option<PathBuf>,
}

impl Folder {
    fn resolved(&mut self, path: &Path) -> PathBuf {
        let (Some(named), Some(name)) = (path.parent(), path.file_name()) else { return resolved(path) };
        if self.named != named {
            *self = Self { named: named.to_path_buf(), resolved: None };
        }
        self.resolved.get_or_insert_with(|| resolved(named)).join(name)
    }
}

/// The files that a scene is read from: itself, and all that it names, in every frame of the shot and in `numbers`, and what those name.
pub(crate) fn inputs(scene: &SceneFile, plan: &Plan, numbers: &[i64]) -> InputFiles {
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
