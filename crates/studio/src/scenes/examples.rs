//! The files of the example scenes, embedded in the program or beside it, and files that the user added.

use std::{borrow::Cow, path::Path, sync::Arc};

use bansho_example_scenes::{ReadAssetError, plates};

use bansho::{
    Assets, MemoryAssets,
    base::{
        geometry::{mesh::Mesh, strokes::Drawing},
        host::assets::{AssetError, AssetProblem, DepthMap, NormalMap, Picture, PictureLayers},
    },
    media::{
        assets::{decode_depth, decode_normals, decode_picture},
        gltf::decode_mesh,
        limits::MemoryLimit,
        svg::decode_drawing,
    },
};

/// The files of the example scenes, and files added by the user. In a web page, plates of the examples are added once they are fetched.
#[derive(Clone, Debug, Default)]
pub struct BundledAssets {
    added_files: Vec<(String, Arc<[u8]>)>,
}

impl BundledAssets {
    /// Adds the file `name`, which replaces an added file of that name.
    pub fn add_file(&mut self, name: impl Into<String>, bytes: impl Into<Arc<[u8]>>) {
        let name = name.into();
        self.added_files.retain(|(other, _)| *other != name);
        self.added_files.push((name, bytes.into()));
    }

    /// The added files, with their names.
    pub fn added_files(&self) -> &[(String, Arc<[u8]>)] {
        &self.added_files
    }

    fn added_file(&self, name: &str) -> Option<&[u8]> {
        self.added_files.iter().find(|(added, _)| added == name).map(|(_, bytes)| bytes.as_ref())
    }

    /// Whether there is a file `name`.
    pub fn contains(&self, name: &str) -> bool {
        let is_embedded = bansho_example_scenes::embedded_asset(name).is_some();
        is_embedded || self.added_file(name).is_some() || plates::find(name).is_some()
    }

    /// The bytes of the file `name`, if there is one.
    pub fn bytes(&self, name: &str) -> Option<Cow<'_, [u8]>> {
        self.require(name).ok()
    }

    fn require(&self, name: &str) -> Result<Cow<'_, [u8]>, AssetError> {
        if let Some(bytes) = self.added_file(name) {
            return Ok(Cow::Borrowed(bytes));
        }
        bansho_example_scenes::read_asset(name).map_err(|ReadAssetError { problem, .. }| {
            // A page has no folders, and tells itself what could not be fetched.
            let is_told = is_plate(name) && cfg!(not(target_arch = "wasm32"));
            error(name, if is_told { AssetProblem::Reported(problem.to_string()) } else { AssetProblem::Missing })
        })
    }

    /// These files, and `files` for all other names.
    pub fn overlay_on(self, files: Arc<dyn Assets>) -> OverlayAssets {
        OverlayAssets { bundle: self, files }
    }
}

/// A [`BundledAssets`] layered over other assets.
pub struct OverlayAssets {
    bundle: BundledAssets,
    files: Arc<dyn Assets>,
}

impl OverlayAssets {
    fn source(&self, name: &str) -> &dyn Assets {
        if self.bundle.contains(name) || is_plate(name) { &self.bundle } else { self.files.as_ref() }
    }
}

impl Assets for OverlayAssets {
    fn picture(&self, path: &str, frame: i64) -> Result<Arc<Picture>, AssetError> {
        self.source(path).picture(path, frame)
    }

    fn picture_layers(&self, path: &str, frame: i64, layers: &PictureLayers) -> Result<Arc<Picture>, AssetError> {
        self.source(path).picture_layers(path, frame, layers)
    }

    fn depth(&self, path: &str, frame: i64, layer: Option<&str>) -> Result<Arc<DepthMap>, AssetError> {
        self.source(path).depth(path, frame, layer)
    }

    fn normals(&self, path: &str, frame: i64) -> Result<Arc<NormalMap>, AssetError> {
        self.source(path).normals(path, frame)
    }

    fn mesh(&self, path: &str) -> Result<Arc<Mesh>, AssetError> {
        self.source(path).mesh(path)
    }

    fn drawing(&self, path: &str) -> Result<Arc<Drawing>, AssetError> {
        self.source(path).drawing(path)
    }

    fn text(&self, path: &str) -> Result<Arc<str>, AssetError> {
        self.source(path).text(path)
    }

    fn digest(&self, path: &str, frame: i64) -> Result<[u8; 32], AssetError> {
        self.source(path).digest(path, frame)
    }
}

/// Whether a file is a plate of the example scenes.
fn is_plate(name: &str) -> bool {
    plates::path_in_scenes(name).is_some()
}

fn error(name: &str, problem: AssetProblem) -> AssetError {
    AssetError { path: name.to_owned(), problem }
}

fn extension(name: &str) -> &str {
    Path::new(name).extension().and_then(|extension| extension.to_str()).unwrap_or_default()
}

impl Assets for BundledAssets {
    fn picture(&self, path: &str, frame: i64) -> Result<Arc<Picture>, AssetError> {
        self.picture_layers(path, frame, &PictureLayers::default())
    }

    fn picture_layers(&self, path: &str, _frame: i64, layers: &PictureLayers) -> Result<Arc<Picture>, AssetError> {
        let picture = decode_picture(&self.require(path)?, extension(path), layers, MemoryLimit::default());
        picture.map(Arc::new).map_err(|problem| error(path, problem))
    }

    fn depth(&self, path: &str, _frame: i64, layer: Option<&str>) -> Result<Arc<DepthMap>, AssetError> {
        let depth = decode_depth(&self.require(path)?, extension(path), layer, MemoryLimit::default());
        depth.map(Arc::new).map_err(|problem| error(path, problem))
    }

    fn normals(&self, path: &str, _frame: i64) -> Result<Arc<NormalMap>, AssetError> {
        let normals = decode_normals(&self.require(path)?, extension(path), MemoryLimit::default());
        normals.map(Arc::new).map_err(|problem| error(path, problem))
    }

    fn mesh(&self, path: &str) -> Result<Arc<Mesh>, AssetError> {
        let bytes = self.require(path)?;
        let mesh = decode_mesh(
            &bytes,
            extension(path),
            // Buffers in files of their own; the limit of their size is for files from elsewhere.
            &|name, _| self.require(name).map(Cow::into_owned).map_err(|error| error.problem),
            MemoryLimit::default(),
        );
        mesh.map(Arc::new).map_err(|problem| error(path, problem))
    }

    fn drawing(&self, path: &str) -> Result<Arc<Drawing>, AssetError> {
        decode_drawing(&self.require(path)?).map(Arc::new).map_err(|problem| error(path, problem))
    }

    fn text(&self, path: &str) -> Result<Arc<str>, AssetError> {
        let bytes = self.require(path)?;
        let text = std::str::from_utf8(&bytes);
        text.map(Arc::from).map_err(|_| error(path, AssetProblem::Damaged("it is not UTF-8".into())))
    }

    fn digest(&self, path: &str, frame: i64) -> Result<[u8; 32], AssetError> {
        if !self.contains(path) {
            self.require(path)?;
        }
        // The name suffices: within a process its content never changes, unless a file is added, which creates a new bundle.
        let mut named = MemoryAssets::default();
        named.insert_text(path, "");
        named.digest(path, frame)
    }
}

#[cfg(test)]
mod tests {
    use bansho_example_scenes::{ExampleScene, SCENES};

    use super::*;
    use crate::document::check;

    #[test]
    fn all_examples_find_their_files() {
        let assets: Arc<dyn Assets> = Arc::new(BundledAssets::default());
        for ExampleScene { name, text, .. } in SCENES {
            let scene = bansho::compile_scene(name, text, assets.clone());
            assert!(scene.is_ok(), "{name}: {:?}", scene.err());
        }
        let scene = bansho_example_scenes::find("inagaki_haze").unwrap();
        assert!(check(scene.name, scene.text, &assets).is_ok());
    }

    #[test]
    fn a_plate_of_an_example_is_missing_until_it_is_fetched() {
        let mut bundle = BundledAssets::default();
        bundle.add_file("plates/fetched.jpg", *b"a picture");
        assert!(bundle.contains("plates/hearth.jpg") && !bundle.contains("plates/gone.jpg"));
        assert_eq!(bundle.bytes("plates/fetched.jpg").as_deref(), Some(&b"a picture"[..]));
    }

    #[test]
    fn added_files_are_found_and_others_are_missing() {
        let mut bundle = BundledAssets::default();
        assert_eq!(bundle.text("drawing.svg").unwrap_err().problem, AssetProblem::Missing);
        bundle.add_file("drawing.svg", *b"<svg/>");
        assert_eq!(&*bundle.text("drawing.svg").unwrap(), "<svg/>");
    }
}
