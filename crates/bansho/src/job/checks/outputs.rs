//! Whether the output files can be written, checked before anything is drawn. The files that the scene is read from are never overwritten.

use std::{
    fs,
    path::{Path, PathBuf},
};

use bansho_media::{
    MediaError,
    assets::FileAssets,
    files::{
        file_identity::resolved,
        overwrite_policy::{InputFiles, OverwriteError, OverwritePolicy},
    },
};
use bansho_render::Plan;

use crate::job::{
    error::{JobError, OptionError},
    scene_file::SceneFile,
};

/// Checks that `path` can be written, without leaving a trace: creates an unnamed file in its folder, or in the nearest ancestor that exists.
///
/// # Errors
/// `path` is a folder, one of its folders is a file, or there is no permission.
pub(crate) fn check_writable(path: &Path) -> Result<(), MediaError> {
    if path.is_dir() {
        return Err(MediaError::IsFolder { path: path.to_path_buf() });
    }
    let folders = path.ancestors().skip(1);
    let mut folders = folders.map(|folder| if folder.as_os_str().is_empty() { Path::new(".") } else { folder });
    let Some(folder) = folders.find(|folder| fs::symlink_metadata(folder).is_ok()) else {
        return Ok(());
    };
    if !folder.is_dir() {
        return Err(MediaError::NotAFolder { path: path.to_path_buf() });
    }
    tempfile::tempfile_in(folder).map(drop).map_err(|source| MediaError::from_io(path, source))
}

/// Checks that every output is new or may be overwritten, as far as that is known in advance.
///
/// # Errors
/// The first output that is an input; else the first existing file that Bansho did not make, with the number of others.
pub(crate) fn check_overwriting(
    policy: &OverwritePolicy,
    outputs: impl IntoIterator<Item = PathBuf>,
) -> Result<(), JobError> {
    let mut folder = ResolvedFolder::default();
    let (mut unmarked, mut others) = (None, 0);
    for path in outputs {
        match policy.check(&folder.resolved(&path)) {
            Ok(()) => {}
            Err(OverwriteError::Input) => return Err(OptionError::OutputIsInput { path }.into()),
            Err(OverwriteError::NotMadeByBansho | OverwriteError::Link) if unmarked.is_none() => unmarked = Some(path),
            Err(OverwriteError::NotMadeByBansho | OverwriteError::Link) => others += 1,
        }
    }
    unmarked.map_or(Ok(()), |path| Err(OptionError::NotMadeByBansho { path, others }.into()))
}

/// Caches the resolved folder of the last path, since many outputs are in one folder.
#[derive(Default)]
struct ResolvedFolder {
    folder: PathBuf,
    resolved: Option<PathBuf>,
}

impl ResolvedFolder {
    fn resolved(&mut self, path: &Path) -> PathBuf {
        let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else { return resolved(path) };
        if self.folder != folder {
            *self = Self { folder: folder.to_path_buf(), resolved: None };
        }
        self.resolved.get_or_insert_with(|| resolved(folder)).join(name)
    }
}

/// The files that a scene is read from: its own file, the files that it names in the frames of the shot and in `numbers`, and the files that
/// those name.
pub(crate) fn input_files(scene: &SceneFile, plan: &Plan, numbers: &[i64]) -> InputFiles {
    let files = FileAssets::with_limits(&scene.folder, scene.input_limits.clone());
    let first = plan.frames().start;
    let mut inputs = InputFiles::default();
    let name = Path::new(&scene.name);
    inputs.insert(name);
    // `name` is for display: a folder that is not Unicode is changed in it.
    name.file_name().into_iter().for_each(|name| inputs.insert(&scene.folder.join(name)));
    for path in plan.scene().asset_paths() {
        let frames: Vec<i64> =
            if path.contains('#') { plan.frames().chain(numbers.iter().copied()).collect() } else { vec![first] };
        let found = frames.into_iter().filter_map(|frame| files.files(&path, frame).ok());
        found.flatten().for_each(|file| inputs.insert(&file));
    }
    inputs
}
