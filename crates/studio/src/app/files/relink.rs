//! Files that the scene names: relinked, or added by dropping them on the window.

use std::path::Path;

use bansho::{
    base::parameters::{Table, Value},
    scene::{ValuePath, operation::Operation},
};

use crate::{
    app::{KIND_WITH_BURNERS, KIND_WITH_SHAPES},
    editors::aurora::document::AuroraDrawing,
    session::{Session, folder, selection::Selection},
};

/// What a file that is dropped becomes, by the ending of its name.
const DRAWINGS: [&str; 1] = ["svg"];
const MESHES: [&str; 2] = ["glb", "gltf"];
const PICTURES: [&str; 4] = ["png", "jpg", "jpeg", "exr"];

impl Session {
    /// Lets `place` name the file `file`.
    pub fn relink(&mut self, place: &ValuePath, file: &Path) {
        let value = self.named(file);
        self.edit("relink", &[Operation::Set { path: place.clone(), value }]);
        self.reload_assets();
    }

    /// `file` as the scene names it: relative to its folder where it lies there.
    fn named(&self, file: &Path) -> Value {
        let folder = folder(self.path.as_deref());
        let whole = folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf());
        let relative = file.strip_prefix(folder).or_else(|_| file.strip_prefix(whole)).unwrap_or(file);
        Value::Text(relative.to_string_lossy().replace('\\', "/"))
    }

    /// Adds a dropped file to the scene: a drawing becomes the first shape of the selected aurora, a mesh a burner of the selected flame,
    /// a picture the plate.
    pub(super) fn drop_file(&mut self, file: &Path, selection: &Selection) {
        let ending = file.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        let is_one_of = |endings: &[&str]| endings.contains(&ending.as_str());
        // It may be another file of a name that was read before.
        self.reload_assets();
        self.document.end_step();
        if is_one_of(&DRAWINGS) {
            self.trace_drawing(file, selection.index_of(KIND_WITH_SHAPES));
        } else if is_one_of(&MESHES) {
            self.add_mesh_burner(file, selection.index_of(KIND_WITH_BURNERS));
        } else if is_one_of(&PICTURES) {
            let place = ValuePath::root().key("plate").key("image");
            self.edit("plate", &[Operation::Set { path: place, value: self.named(file) }]);
        } else {
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            let reason =
                "scenes (.toml), drawings (.svg), meshes (.glb, .gltf) and pictures (.png, .jpg, .exr) are taken";
            self.set_notice(Some(format!("{name}: {reason}")));
        }
    }

    fn trace_drawing(&mut self, file: &Path, index: usize) {
        let drawing = AuroraDrawing::read(self.document.values(), index, self.assets());
        let traced = drawing.map(|drawing| drawing.trace(self.named(file)));
        if let Err(reason) = traced.and_then(|traced| self.edit_shapes("drawing", &traced, index)) {
            self.set_notice(Some(reason.to_string()));
        }
    }

    fn add_mesh_burner(&mut self, file: &Path, index: usize) {
        let flame = ValuePath::root().key(KIND_WITH_BURNERS).index(index);
        if flame.find(self.document.values()).is_none() {
            self.set_notice(Some("a mesh burns in a particle flame, which this scene lacks: add one first".into()));
            return;
        }
        let mut burner = Table::default();
        burner.push("shape", Value::Text("mesh".into()));
        burner.push("file", self.named(file));
        self.edit("mesh", &[Operation::Append { path: flame.key("burners"), value: Value::Table(burner) }]);
    }
}
