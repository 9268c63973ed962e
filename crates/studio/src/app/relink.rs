//! Files that the scene names: linked anew, or laid into it by dropping them on the window.

use std::path::Path;

use bansho::{
    base::parameters::Value,
    render::scene::{Place, operation::Operation},
};

use super::session::{Session, folder};
use crate::document::drawing::Drawing;

impl Session {
    /// Lets `place` name the file `file`.
    pub fn relink(&mut self, place: &Place, file: &Path) {
        let value = self.named(file);
        self.edit("relink", &[Operation::Set { place: place.clone(), value }]);
        self.reload_assets();
    }

    /// `file` as the scene names it: relative to its folder where it lies there.
    fn named(&self, file: &Path) -> Value {
        let folder = folder(self.path.as_deref());
        let whole = folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf());
        let relative = file.strip_prefix(folder).or_else(|_| file.strip_prefix(whole)).unwrap_or(file);
        Value::Text(relative.to_string_lossy().replace('\\', "/"))
    }

    /// Takes a file that was dropped on the window: a drawing becomes the aurora's first shape, a picture the plate.
    pub fn lay_over(&mut self, file: &Path) {
        let value = self.named(file);
        if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("svg")) {
            match Drawing::read(self.document.values(), 0, self.assets()) {
                Ok(drawing) => self.edit("drawing", &drawing.trace(value)),
                Err(reason) => self.set_notice(Some(reason.to_string())),
            }
        } else {
            let place = Place::root().key("plate").key("image");
            self.edit("plate", &[Operation::Set { place, value }]);
        }
    }
}
