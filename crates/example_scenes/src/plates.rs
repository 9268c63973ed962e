//! The plates of the example scenes, which are files of an installation. They are looked for in these folders, in this order:
//!
//! 1. the folder that the environment variable `BANSHO_SCENES` names;
//! 2. `scenes` beside the program, as in a release archive;
//! 3. `../share/bansho/scenes` beside the program, as in a Unix installation or a Python environment;
//! 4. `scenes` in the current folder, as in the repository.

use std::{
    env, fs,
    path::{Path, PathBuf},
};

use crate::{PLATES, ReadAssetProblem};

/// The environment variable that names the folder of scenes.
pub const FOLDER_VARIABLE: &str = "BANSHO_SCENES";

/// The path of a plate within the folder of scenes, by the path that a scene names; `None` if no example scene names it.
pub fn path_in_scenes(named: &str) -> Option<&'static str> {
    PLATES.iter().find(|(path, _)| *path == named).map(|(_, within)| *within)
}

/// The file of a plate, by the path that a scene names; `None` if it is in no folder.
pub fn find(named: &str) -> Option<PathBuf> {
    let within = path_in_scenes(named)?;
    folders().into_iter().map(|folder| folder.join(within)).find(|file| file.is_file())
}

/// Reads a plate, by the path that a scene names.
pub(crate) fn read(named: &str) -> Result<Vec<u8>, ReadAssetProblem> {
    let file = find(named).ok_or(ReadAssetProblem::NotFound)?;
    fs::read(&file).map_err(|source| ReadAssetProblem::Io { file, source })
}

/// The folders where plates are looked for, for an error message.
pub(crate) fn searched_folders() -> String {
    folders().iter().map(|folder| format!("`{}`", folder.display())).collect::<Vec<_>>().join(", ")
}

fn folders() -> Vec<PathBuf> {
    let named = env::var_os(FOLDER_VARIABLE).filter(|folder| !folder.is_empty()).map(PathBuf::from);
    let program = env::current_exe().ok();
    let beside = program.as_deref().and_then(Path::parent);
    let mut folders: Vec<PathBuf> = named.into_iter().collect();
    if let Some(beside) = beside {
        folders.push(beside.join("scenes"));
        folders.extend(beside.parent().map(|prefix| prefix.join("share/bansho/scenes")));
    }
    folders.push(PathBuf::from("scenes"));
    folders
}
