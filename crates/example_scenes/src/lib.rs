//! The example scenes of Bansho as text, with the bytes of the pictures and meshes that they name.
//!
//! ```
//! let scene = bansho_example_scenes::find("burning_mesh").unwrap();
//! assert!(scene.text.contains("bansho = "));
//! assert!(scene.assets().all(|(path, bytes)| path.ends_with(".glb") && !bytes.is_empty()));
//! ```

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
    pub fn assets(&self) -> impl Iterator<Item = (&'static str, &'static [u8])> {
        self.asset_paths.iter().filter_map(|path| Some((*path, asset(path)?)))
    }
}

/// The scene of this name, if there is one.
pub fn find(name: &str) -> Option<&'static ExampleScene> {
    SCENES.iter().find(|scene| scene.name == name)
}

/// The contents of a file that a scene names, by its path relative to the scene. Two scenes that name the same path name equal files.
pub fn asset(path: &str) -> Option<&'static [u8]> {
    ASSETS.iter().find(|(own, _)| *own == path).map(|(_, bytes)| *bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_has_a_summary_and_all_its_files() {
        assert!(SCENES.len() > 30);
        for scene in SCENES {
            assert!(scene.summary().len() > 10, "{}: {:?}", scene.name, scene.summary());
            assert_eq!(scene.assets().count(), scene.asset_paths.len(), "{}", scene.name);
        }
        assert!(find("campfire").is_some() && find("campfires").is_none());
    }
}
