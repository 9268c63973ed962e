//! Questions in the middle of the window: what to open, where to save, whether to leave unsaved work.

use std::path::PathBuf;

use eframe::egui::{self, Ui};

/// A question that waits for an answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Question {
    /// Which file to open.
    Open(String),
    /// Which file to save to.
    SaveAs(String),
    /// Whether unsaved work may be left, to open this or to close.
    Leave(Leaving),
    /// Whether to take what another program wrote.
    ChangedOutside(String),
}

/// Where to, once unsaved work may be left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Leaving {
    Open(PathBuf),
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
        Question::Open(path) => {
            path_field(ui, "Open which scene?", path);
            &[("Open", Answer::Do), ("Cancel", Answer::Cancel)]
        }
        Question::SaveAs(path) => {
            path_field(ui, "Save as", path);
            &[("Save", Answer::Do), ("Cancel", Answer::Cancel)]
        }
        Question::Leave(_) => {
            ui.label("There is unsaved work.");
            &[("Save", Answer::Save), ("Leave it", Answer::Do), ("Cancel", Answer::Cancel)]
        }
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

fn path_field(ui: &mut Ui, title: &str, path: &mut String) {
    let label = ui.label(title).id;
    ui.add(egui::TextEdit::singleline(path).desired_width(420.0)).labelled_by(label);
}
