//! Questions in the middle of the window: what to open, where to save, whether to leave unsaved work.

use std::path::PathBuf;

#[cfg(not(target_arch = "wasm32"))]
use bansho::render::scene::Place;
use eframe::egui::Ui;

#[cfg(not(target_arch = "wasm32"))]
use super::chooser::Chooser;
use crate::document::recovery::Recovered;

/// A question that waits for an answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Question {
    /// Which file to open.
    #[cfg(not(target_arch = "wasm32"))]
    Open(Chooser),
    /// Which file this place shall name.
    #[cfg(not(target_arch = "wasm32"))]
    Relink(Place, Chooser),
    /// Which file to save to, and where to then.
    #[cfg(not(target_arch = "wasm32"))]
    SaveAs(Chooser, Option<Leaving>),
    /// Whether this file may be replaced by what is saved, and where to then.
    #[cfg(not(target_arch = "wasm32"))]
    Replace(PathBuf, Option<Leaving>),
    /// Whether unsaved work may be left, to open this or to close.
    Leave(Leaving),
    /// Whether what is rendered may be stopped, to close.
    StopRendering,
    /// Whether to take what another program wrote, and where to once this is saved over it.
    #[cfg(not(target_arch = "wasm32"))]
    ChangedOutside(Option<Leaving>),
}

/// Where to, once unsaved work may be left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Leaving {
    /// A scene, and where it lies if it lies anywhere.
    Open {
        name: String,
        text: String,
        path: Option<PathBuf>,
    },
    /// Work of a studio that did not end well.
    Recover(Recovered),
    Close,
}

/// What a question was answered with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    Do,
    Save,
    Cancel,
}

/// Asks; what was answered, once it was.
pub(super) fn answer(ui: &mut Ui, question: &mut Question) -> Option<Answer> {
    let choices: &[(&str, Answer)] = match question {
        #[cfg(not(target_arch = "wasm32"))]
        Question::Open(chooser) => {
            if chooser.show(ui, "Open which scene?") {
                return Some(Answer::Do);
            }
            &[("Open", Answer::Do), ("Cancel", Answer::Cancel)]
        }
        #[cfg(not(target_arch = "wasm32"))]
        Question::Relink(_, chooser) => {
            if chooser.show(ui, "Which file in its stead?") {
                return Some(Answer::Do);
            }
            &[("Relink", Answer::Do), ("Cancel", Answer::Cancel)]
        }
        #[cfg(not(target_arch = "wasm32"))]
        Question::SaveAs(chooser, _) => {
            chooser.show(ui, "Save as");
            &[("Save", Answer::Do), ("Cancel", Answer::Cancel)]
        }
        #[cfg(not(target_arch = "wasm32"))]
        Question::Replace(path, _) => {
            ui.label(format!("There is a file of that name: {}", path.display()));
            &[("Replace it", Answer::Do), ("Another name", Answer::Save), ("Cancel", Answer::Cancel)]
        }
        Question::StopRendering => {
            ui.label("Pictures are being rendered. Whole frames stay, and rendering the shot goes on from there.");
            &[("Stop and close", Answer::Do), ("Cancel", Answer::Cancel)]
        }
        Question::Leave(_) => {
            ui.label("There is unsaved work.");
            &[("Save", Answer::Save), ("Leave it", Answer::Do), ("Cancel", Answer::Cancel)]
        }
        #[cfg(not(target_arch = "wasm32"))]
        Question::ChangedOutside(_) => {
            ui.label("Another program changed the file, and there is unsaved work here.");
            &[("Take theirs", Answer::Do), ("Save mine", Answer::Save), ("Decide later", Answer::Cancel)]
        }
    };
    let mut chosen = None;
    ui.horizontal(|ui| {
        for (text, answer) in choices {
            if ui.button(*text).clicked() {
                chosen = Some(*answer);
            }
        }
    });
    chosen
}
