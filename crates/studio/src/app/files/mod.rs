//! The window's files: what is opened and saved, what is kept while it is unsaved, what waits to be asked. Where files
//! lie, on the disk or at the browser, is for its `Shelf` to know.

#[cfg(target_arch = "wasm32")]
pub(super) mod browser;
#[cfg(not(target_arch = "wasm32"))]
mod chooser;
#[cfg(not(target_arch = "wasm32"))]
mod disk;
#[cfg(target_arch = "wasm32")]
mod page;
mod question;
mod unsaved;

use std::path::PathBuf;

use eframe::egui::{self, Ui};

#[cfg(not(target_arch = "wasm32"))]
use self::disk::Shelf;
#[cfg(target_arch = "wasm32")]
use self::page::Shelf;
use self::{
    question::{Answer, Leaving, Question, answer},
    unsaved::Unsaved,
};
use super::{session::Session, store::Store};
use crate::document::Document;

/// Files of the window: what lies where, and what waits to be asked.
pub(super) struct Files {
    question: Option<Question>,
    pub(super) unsaved: Unsaved,
    closing: bool,
    shelf: Shelf,
}

impl Files {
    /// Files of a window that keeps what it must in `store`.
    pub(super) fn new(store: &Store) -> Self {
        Self { question: None, unsaved: Unsaved::new(store), closing: false, shelf: Shelf::new(store) }
    }

    /// Opens a scene that the studio brings along, after asking where that would lose work.
    pub(super) fn open_bundled(&mut self, session: &mut Session, name: &str, text: &str) {
        self.open_text(session, name, text.to_owned(), None);
    }

    /// Opens a scene that was read, after asking where that would lose work.
    fn open_text(&mut self, session: &mut Session, name: &str, text: String, path: Option<PathBuf>) {
        let document = Leaving::Open { name: name.to_owned(), text, path };
        if session.document.is_dirty() {
            self.question = Some(Question::Leave(document));
        } else {
            self.leave(session, document);
        }
    }

    /// What must be done now and then, and the question that waits.
    pub(super) fn tend(&mut self, ui: &mut Ui, session: &mut Session) {
        self.unsaved.tend(ui, session);
        self.tend_shelf(ui, session);
        self.hold_close(ui, session);
        self.ask(ui, session);
    }

    /// Closing with unsaved work asks first.
    fn hold_close(&mut self, ui: &Ui, session: &Session) {
        let wants = ui.input(|input| input.viewport().close_requested());
        if self.closing {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        } else if wants && session.document.is_dirty() {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.question = Some(Question::Leave(Leaving::Close));
        }
    }

    fn ask(&mut self, ui: &mut Ui, session: &mut Session) {
        let Some(mut question) = self.question.take() else { return };
        let answer = egui::Modal::new(ui.scope_id().with("question")).show(ui.ctx(), |ui| answer(ui, &mut question));
        match answer.inner {
            None if answer.should_close() => {}
            None => self.question = Some(question),
            Some(Answer::Cancel) => {}
            Some(yes) => self.answered(session, question, yes),
        }
        if self.closing {
            ui.ctx().request_repaint();
        }
    }

    fn answered(&mut self, session: &mut Session, question: Question, answer: Answer) {
        match question {
            Question::Leave(leaving) => {
                if answer == Answer::Save {
                    self.save(session);
                }
                if answer == Answer::Do || !session.document.is_dirty() {
                    self.leave(session, leaving);
                }
            }
            #[cfg(not(target_arch = "wasm32"))]
            question => self.answered_about_disk(session, question, answer),
        }
    }

    fn leave(&mut self, session: &mut Session, leaving: Leaving) {
        match leaving {
            Leaving::Open { name, text, path } => session.open(Document::new(name, text), path),
            Leaving::Close => self.closing = true,
        }
    }
}
