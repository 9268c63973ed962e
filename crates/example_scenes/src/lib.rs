//! The example scenes of Bansho as text, with the bytes of the meshes that they name.
//!
//! Plates (photographs, their depths, albedos and normals) are not in the program. They are looked for in the folder `scenes` of the
//! installation; see [`plates`].
//!
//! ```
//! let scene = bansho_example_scenes::find("burning_mesh").unwrap();
//! assert!(scene.text.contains("bansho = "));
//! let files = scene.read_assets().unwrap();
//! assert!(files.iter().all(|(path, bytes)| path.ends_with(".glb") && !bytes.is_empty()));
//! ```

use std::{borrow::Cow, io, path::PathBuf};

pub mod plates;

/// An example scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExampleScene {
    /// The name of its file without `.toml`.
    pub name: &'static str,
    /// Its text, in TOML.
    pub text: &'static str,
    /// Paths of the files that it names, relative to the scene.
    pub asset_paths: &'static [&'static str],
}

include!(concat!(env!("OUT_DIR"), "/scenes.rs"));

/// A file of an example cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {problem}")]
pub struct ReadAssetError {
    /// The path that the scene names.
    pub path: String,
    /// What is wrong.
    pub problem: ReadAssetProblem,
}

/// Why a file of an example cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadAssetProblem {
    /// It is in no folder where plates are looked for.
    #[error(
        "this plate is not in the program, and not in {}; allowed: the folder `scenes` of a release archive or of the repository, \
         named by the environment variable {}",
        plates::searched_folders(),
        plates::FOLDER_VARIABLE
    )]
    NotFound,
    /// It was found and cannot be read.
    #[error("cannot read {}: {source}", .file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// Why it cannot be read.
        source: io::Error,
    },
}

/// A file that a scene names: its path relative to the scene, and its contents.
pub type SceneFile = (&'static str, Cow<'static, [u8]>);

impl ExampleScene {
    /// The first sentence of the comment at its beginning.
    pub fn summary(&self) -> String {
        let lines = self.text.lines().map_while(|line| line.strip_prefix('#'));
        let comment = lines.map(str::trim).collect::<Vec<_>>().join(" ");
        match comment.split_once(". ") {
            Some((first, _)) => format!("{first}."),
            None => comment,
        }
    }

    /// The files that it names: paths relative to the scene, and contents.
    ///
    /// # Errors
    /// A plate is not found, or cannot be read.
    pub fn read_assets(&self) -> Result<Vec<SceneFile>, ReadAssetError> {
        self.asset_paths.iter().map(|path| Ok((*path, read_asset(path)?))).collect()
    }
}

/// The scene of this name, if there is one.
pub fn find(name: &str) -> Option<&'static ExampleScene> {
    SCENES.iter().find(|scene| scene.name == name)
}

/// The contents of a file that a scene names and that is in the program, by its path relative to the scene. Two scenes that name the
/// same path name equal files.
pub fn embedded_asset(path: &str) -> Option<&'static [u8]> {
    ASSETS.iter().find(|(named, _)| *named == path).map(|(_, bytes)| *bytes)
}

/// The contents of a file that a scene names, by its path relative to the scene: from the program, or from a folder of [`plates`].
///
/// # Errors
/// It is not in the program, and is no plate that is found and can be read.
pub fn read_asset(path: &str) -> Result<Cow<'static, [u8]>, ReadAssetError> {
    match embedded_asset(path) {
        Some(bytes) => Ok(Cow::Borrowed(bytes)),
        None => match plates::read(path) {
            Ok(bytes) => Ok(Cow::Owned(bytes)),
            Err(problem) => Err(ReadAssetError { path: path.to_owned(), problem }),
        },
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn every_scene_has_a_summary_and_all_its_files() {
        assert!(SCENES.len() > 30);
        for scene in SCENES {
            assert!(scene.summary().len() > 10, "{}: {:?}", scene.name, scene.summary());
            let files = scene.read_assets().unwrap();
            assert!(files.len() == scene.asset_paths.len() && files.iter().all(|(_, bytes)| !bytes.is_empty()));
        }
        assert!(find("campfire").is_some() && find("campfires").is_none());
    }

    #[test]
    fn plates_are_not_in_the_program() {
        // A file is embedded once, whatever the paths by which scenes name it.
        let files: BTreeMap<*const u8, usize> = ASSETS.iter().map(|(_, bytes)| (bytes.as_ptr(), bytes.len())).collect();
        let embedded: usize = files.values().sum();
        assert!(
            files.len() < ASSETS.len() && embedded < 300_000,
            "{embedded} bytes are embedded in {} files",
            files.len()
        );
        assert!(embedded_asset("plates/hearth.jpg").is_none() && plates::path_in_scenes("plates/hearth.jpg").is_some());
    }

    #[test]
    fn a_file_of_no_scene_is_not_found() {
        let error = read_asset("plates/../../secret").unwrap_err();
        assert!(error.to_string().starts_with("plates/../../secret: this plate is not in the program"), "{error}");
    }
}
