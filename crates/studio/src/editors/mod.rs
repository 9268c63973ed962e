//! Editors made for one kind of phenomenon each. Everything else in the studio asks the descriptors of kinds and names none.

pub mod aurora;

use bansho::base::parameters::Value;
use eframe::egui::Ui;

use crate::{
    document::PhenomenonId,
    session::{Session, selection::Selection},
};
use aurora::AuroraEditor;

/// The editors, with their state.
#[derive(Default)]
pub(crate) struct KindEditors {
    aurora: AuroraEditor,
}

impl KindEditors {
    /// Whether phenomena of `kind` have an editor of their own.
    pub(crate) fn has_editor(&self, kind: &str) -> bool {
        kind == AuroraEditor::KIND
    }

    /// Shows the editor of `phenomenon`, if its kind has one.
    pub(crate) fn ui(&mut self, ui: &mut Ui, session: &mut Session, phenomenon: PhenomenonId) {
        if phenomenon.kind == AuroraEditor::KIND {
            self.aurora.ui(ui, session, phenomenon.index);
        }
    }
}

/// Extensions of drawing files.
const DRAWINGS: [&str; 2] = ["svg", "svgz"];

/// Adds a dropped file to the selected phenomenon, if an editor imports files with its extension: a drawing becomes the first shape of an
/// aurora. `name` is the file as the scene names it. Returns whether an editor imports such files; errors are shown in the status line.
pub(crate) fn import_file(session: &mut Session, selection: &Selection, extension: &str, name: Value) -> bool {
    let is_drawing = DRAWINGS.contains(&extension);
    if is_drawing {
        let aurora = selection.phenomenon_of(AuroraEditor::KIND);
        if let Err(error) = aurora::import_drawing(session, aurora.index, name) {
            session.set_notice(Some(error.to_string()));
        }
    }
    is_drawing
}
