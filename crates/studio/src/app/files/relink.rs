//! Assets of the scene: relinked to other files, or added by dropping files on the window.

use std::path::Path;

use bansho::{
    base::parameters::{Table, Value},
    phenomena,
    scene::{ValuePath, operation::Operation},
};

use crate::{
    document::{PhenomenonId, editor_hints::editor_hints},
    editors,
    session::{Session, folder, selection::Selection},
};

/// Extensions of mesh files.
const MESHES: [&str; 2] = ["glb", "gltf"];
/// Extensions of picture files.
const PICTURES: [&str; 7] = ["png", "jpg", "jpeg", "exr", "webp", "tif", "tiff"];

impl Session {
    /// Sets `parameter` to the file `file`.
    pub fn relink(&mut self, parameter: &ValuePath, file: &Path) {
        let value = self.relative_name(file);
        self.edit("relink", &[Operation::Set { path: parameter.clone(), value }]);
        self.reload_assets();
    }

    /// The name of `file` in the scene: relative to the scene's folder if it is in that folder.
    fn relative_name(&self, file: &Path) -> Value {
        let folder = folder(self.path.as_deref());
        let absolute = folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf());
        let relative = file.strip_prefix(folder).or_else(|_| file.strip_prefix(absolute)).unwrap_or(file);
        Value::Text(relative.to_string_lossy().replace('\\', "/"))
    }

    /// Adds a dropped file to the scene: to the selected phenomenon if an editor or a
    /// [`MeshImport`](crate::document::editor_hints::MeshImport) of its kind takes the file, and a picture as the plate.
    pub(super) fn drop_file(&mut self, file: &Path, selection: &Selection) {
        let extension = file.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        // A file of the same name may have been read before.
        self.reload_assets();
        self.document.end_step();
        let name = self.relative_name(file);
        if editors::import_file(self, selection, &extension, name.clone()) {
            return;
        }
        if MESHES.contains(&extension.as_str()) {
            self.add_mesh(selection, name);
        } else if PICTURES.contains(&extension.as_str()) {
            let parameter = ValuePath::root().key("plate").key("image");
            self.edit("plate", &[Operation::Set { path: parameter, value: name }]);
        } else {
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            let reason = "only scenes (.toml), drawings (.svg), meshes (.glb, .gltf) and pictures (.png, .jpg, .exr, .webp, .tiff) can be added";
            self.set_notice(Some(format!("{name}: {reason}")));
        }
    }

    /// Adds the mesh file that the scene calls `name` to the selected phenomenon, or to the first whose kind takes meshes.
    fn add_mesh(&mut self, selection: &Selection, name: Value) {
        let selected = selection.phenomenon().into_iter();
        let first_of_kinds = phenomena().map(|kind| PhenomenonId { kind: kind.key, index: 0 });
        let mut imports = selected
            .chain(first_of_kinds)
            .filter_map(|phenomenon| Some((phenomenon.path(), editor_hints(phenomenon.kind).mesh_import?)));
        let Some((path, import)) = imports.find(|(path, _)| path.find(self.document.values()).is_some()) else {
            let kinds = phenomena().filter(|kind| editor_hints(kind.key).mesh_import.is_some()).map(|kind| kind.key);
            let kinds = kinds.collect::<Vec<_>>().join(" or ");
            self.set_notice(Some(format!("a mesh is added to a {kinds}, which this scene lacks: add one first")));
            return;
        };
        let mut item = Table::default();
        item.push(import.shape_key, Value::Text(import.shape.into()));
        item.push(import.file_key, name);
        self.edit("mesh", &[Operation::Append { path: path.key(import.list), value: Value::Table(item) }]);
    }
}
