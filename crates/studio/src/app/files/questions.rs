//! Modal dialogs: what to open, where to save, whether to discard unsaved work.

use std::path::PathBuf;

#[cfg(not(target_arch = "wasm32"))]
use bansho::scene::ValuePath;
use eframe::egui::Ui;

#[cfg(not(target_arch = "wasm32"))]
use super::dialog::FileDialog;
use crate::document::files::autosave::RecoveredWork;

/// An open question.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Question {
    /// Which file to open.
    #[cfg(not(target_arch = "wasm32"))]
    Open(FileDialog),
    /// Which file `parameter` shall name.
    #[cfg(not(target_arch = "wasm32"))]
    Relink { parameter: ValuePath, dialog: FileDialog },
    /// Which file to save to; `then` is performed after saving.
    #[cfg(not(target_arch = "wasm32"))]
    SaveAs { dialog: FileDialog, then: Option<PendingAction> },
    /// Whether the file `path` may be replaced, with the reason for asking; `then` is performed after saving.
    #[cfg(not(target_arch = "wasm32"))]
    Replace { path: PathBuf, message: String, then: Option<PendingAction> },
    /// Whether to save or discard unsaved work before this action.
    DiscardUnsaved(PendingAction),
    /// Whether to stop rendering and close.
    StopRendering,
    /// Whether to take the text of another program or save over it; `then` is performed after saving.
    #[cfg(not(target_arch = "wasm32"))]
    ChangedExternally { then: Option<PendingAction> },
}

/// What to do once unsaved work is saved or discarded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum PendingAction {
    /// Open a scene, with its file if it has one.
    Open { name: String, text: String, path: Option<PathBuf> },
    /// Open recovered work.
    Recover(RecoveredWork),
    /// Close the window.
    Close,
}

/// The answer to a question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    Confirm,
    Save,
    Cancel,
}

/// Shows the dialog. Returns the answer, if there is one.
pub(super) fn answer_ui(ui: &mut Ui, question: &mut Question) -> Option<Answer> {
    let mut chosen = question.body_ui(ui).then_some(Answer::Confirm);
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
        let text = match self {
            #[cfg(not(target_arch = "wasm32"))]
            Self::Open(dialog) => return dialog.ui(ui, "Open which scene?"),
            #[cfg(not(target_arch = "wasm32"))]
            Self::Relink { dialog, .. } => return dialog.ui(ui, "Replace it by which file?"),
            #[cfg(not(target_arch = "wasm32"))]
            Self::SaveAs { dialog, .. } => {
                // A double-click only chooses the name, since saving over a file needs another question.
                dialog.ui(ui, "Save as");
                return false;
            }
            #[cfg(not(target_arch = "wasm32"))]
            Self::Replace { message, .. } => message.as_str(),
            Self::DiscardUnsaved(_) => "There is unsaved work.",
            Self::StopRendering => {
                "Pictures are being rendered. Whole frames stay, and rendering the shot goes on from there."
            }
            #[cfg(not(target_arch = "wasm32"))]
            Self::ChangedExternally { .. } => "Another program changed the file, and there is unsaved work here.",
        };
        ui.label(text);
        false
    }

    /// The buttons and their answers.
    fn choices(&self) -> &'static [(&'static str, Answer)] {
        use Answer::{Cancel, Confirm, Save};
        match self {
            #[cfg(not(target_arch = "wasm32"))]
            Self::Open(_) => &[("Open", Confirm), ("Cancel", Cancel)],
            #[cfg(not(target_arch = "wasm32"))]
            Self::Relink { .. } => &[("Relink", Confirm), ("Cancel", Cancel)],
            #[cfg(not(target_arch = "wasm32"))]
            Self::SaveAs { .. } => &[("Save", Confirm), ("Cancel", Cancel)],
            #[cfg(not(target_arch = "wasm32"))]
            Self::Replace { .. } => &[("Replace it", Confirm), ("Another name", Save), ("Cancel", Cancel)],
            Self::DiscardUnsaved(_) => &[("Save", Save), ("Leave it", Confirm), ("Cancel", Cancel)],
            Self::StopRendering => &[("Stop and close", Confirm), ("Cancel", Cancel)],
            #[cfg(not(target_arch = "wasm32"))]
            Self::ChangedExternally { .. } => {
                &[("Take theirs", Confirm), ("Save mine", Save), ("Decide later", Cancel)]
            }
        }
    }
}
