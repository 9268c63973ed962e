//! Modal dialogs: what to open, where to save, whether to discard unsaved work.

use std::path::PathBuf;

#[cfg(not(target_arch = "wasm32"))]
use bansho::scene::ValuePath;
use eframe::egui::Ui;

#[cfg(not(target_arch = "wasm32"))]
use super::dialog::FileDialog;
use crate::document::files::autosave::RecoveredWork;

/// A question that waits for an answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Question {
    /// Which file to open.
    #[cfg(not(target_arch = "wasm32"))]
    Open(FileDialog),
    /// Which file this place shall name.
    #[cfg(not(target_arch = "wasm32"))]
    Relink(ValuePath, FileDialog),
    /// Which file to save to, and where to then.
    #[cfg(not(target_arch = "wasm32"))]
    SaveAs(FileDialog, Option<PendingAction>),
    /// Whether this file may be replaced by what is saved, what is said of it, and where to then.
    #[cfg(not(target_arch = "wasm32"))]
    Replace(PathBuf, String, Option<PendingAction>),
    /// Whether unsaved work may be left, to open this or to close.
    Leave(PendingAction),
    /// Whether what is rendered may be stopped, to close.
    StopRendering,
    /// Whether to take what another program wrote, and where to once this is saved over it.
    #[cfg(not(target_arch = "wasm32"))]
    ChangedExternally(Option<PendingAction>),
}

/// What to do once unsaved work is saved or discarded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum PendingAction {
    /// A scene, and where it lies if it lies anywhere.
    Open {
        name: String,
        text: String,
        path: Option<PathBuf>,
    },
    /// Recovered work.
    Recover(RecoveredWork),
    Close,
}

/// What a question was answered with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    Do,
    Save,
    Cancel,
}

/// Shows the dialog. Returns the answer, if there is one.
pub(super) fn answer_ui(ui: &mut Ui, question: &mut Question) -> Option<Answer> {
    let mut chosen = question.body_ui(ui).then_some(Answer::Do);
    ui.horizontal(|ui| {
        for (text, answer) in question.choices() {
            if ui.button(*text).clicked() {
                chosen = Some(*answer);
            }
        }
    });
    chosen
}

impl Question {
    /// The content of the dialog. Returns whether it gave an answer, as a double-click on a file does.
    fn body_ui(&mut self, ui: &mut Ui) -> bool {
        let said = match self {
            #[cfg(not(target_arch = "wasm32"))]
            Self::Open(dialog) => return dialog.ui(ui, "Open which scene?"),
            #[cfg(not(target_arch = "wasm32"))]
            Self::Relink(_, dialog) => return dialog.ui(ui, "Which file in its stead?"),
            #[cfg(not(target_arch = "wasm32"))]
            Self::SaveAs(dialog, _) => {
                // A double-click chooses a name, to be saved over only after a question.
                dialog.ui(ui, "Save as");
                return false;
            }
            #[cfg(not(target_arch = "wasm32"))]
            Self::Replace(_, said, _) => said.as_str(),
            Self::Leave(_) => "There is unsaved work.",
            Self::StopRendering => {
                "Pictures are being rendered. Whole frames stay, and rendering the shot goes on from there."
            }
            #[cfg(not(target_arch = "wasm32"))]
            Self::ChangedExternally(_) => "Another program changed the file, and there is unsaved work here.",
        };
        ui.label(said);
        false
    }

    /// Its answers, as its buttons say them.
    fn choices(&self) -> &'static [(&'static str, Answer)] {
        use Answer::{Cancel, Do, Save};
        match self {
            #[cfg(not(target_arch = "wasm32"))]
            Self::Open(_) => &[("Open", Do), ("Cancel", Cancel)],
            #[cfg(not(target_arch = "wasm32"))]
            Self::Relink(..) => &[("Relink", Do), ("Cancel", Cancel)],
            #[cfg(not(target_arch = "wasm32"))]
            Self::SaveAs(..) => &[("Save", Do), ("Cancel", Cancel)],
            #[cfg(not(target_arch = "wasm32"))]
            Self::Replace(..) => &[("Replace it", Do), ("Another name", Save), ("Cancel", Cancel)],
            Self::Leave(_) => &[("Save", Save), ("Leave it", Do), ("Cancel", Cancel)],
            Self::StopRendering => &[("Stop and close", Do), ("Cancel", Cancel)],
            #[cfg(not(target_arch = "wasm32"))]
            Self::ChangedExternally(_) => &[("Take theirs", Do), ("Save mine", Save), ("Decide later", Cancel)],
        }
    }
}
