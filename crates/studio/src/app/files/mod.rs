//! The window's files: what is opened and saved, what is kept while it is unsaved, what waits to be asked. Where files
//! lie, on the disk or at the browser, is for its `Shelf` to know.

#[cfg(target_arch = "wasm32")]
pub(crate) mod browser_io;
#[cfg(target_arch = "wasm32")]
mod browser_tabs;
#[cfg(not(target_arch = "wasm32"))]
mod dialog;
#[cfg(not(target_arch = "wasm32"))]
mod native;
mod questions;
pub(crate) mod relink;
#[cfg(not(target_arch = "wasm32"))]
mod save_as;
mod unsaved;
#[cfg(target_arch = "wasm32")]
mod web;

use std::path::PathBuf;

use eframe::egui::{self, Ui};

use self::unsaved::Unsaved;
use crate::{
    app::panels::scene::Subject,
    document::{Document, files, files::autosave::Recovered},
    player::render_job::Ended,
    session::{Session, settings_store::Store},
};
#[cfg(not(target_arch = "wasm32"))]
use native::Shelf;
use questions::{Answer, Leaving, Question, answer};
#[cfg(target_arch = "wasm32")]
use web::Shelf;

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
        self.leave_after_asking(session, Leaving::Open { name: name.to_owned(), text, path });
    }

    /// Opens work of a studio that did not end well, after asking where that would lose work.
    pub(super) fn recover(&mut self, session: &mut Session, recovered: Recovered) {
        self.leave_after_asking(session, Leaving::Recover(recovered));
    }

    fn leave_after_asking(&mut self, session: &mut Session, leaving: Leaving) {
        if session.document.is_dirty() {
            self.question = Some(Question::Leave(leaving));
        } else {
            self.leave(session, leaving);
        }
    }

    /// What must be done now and then, and the question that waits. `subject` is what is chosen.
    pub(super) fn tend(&mut self, ui: &mut Ui, session: &mut Session, subject: &Subject) {
        self.unsaved.tend(ui, session);
        self.tend_shelf(ui, session, subject);
        self.hold_close(ui, session);
        self.ask(ui, session);
    }

    /// Closing with unsaved work asks first, and so does closing while pictures are rendered.
    fn hold_close(&mut self, ui: &Ui, session: &mut Session) {
        let wants = ui.input(|input| input.viewport().close_requested());
        if self.closing {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        } else if wants && (session.document.is_dirty() || self.progress().is_some()) {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.leave_after_asking(session, Leaving::Close);
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
                    self.save_and(session, Some(leaving));
                } else {
                    self.leave(session, leaving);
                }
            }
            Question::StopRendering => {
                self.stop_rendering();
                self.closing = true;
            }
            #[cfg(not(target_arch = "wasm32"))]
            question => self.answered_about_disk(session, question, answer),
        }
    }

    fn leave(&mut self, session: &mut Session, leaving: Leaving) {
        match leaving {
            Leaving::Open { name, text, path } => session.open(Document::new(name, text), path),
            Leaving::Recover(recovered) => {
                let (document, path) = reopened(&recovered);
                session.open(document, path);
                self.unsaved.keep_in_stead(recovered, session);
            }
            Leaving::Close if self.progress().is_some() => self.question = Some(Question::StopRendering),
            Leaving::Close => self.closing = true,
        }
    }
}

/// Tells the user how rendering ended: with this, or why not. After a panic the work is kept at once.
fn tell_end(session: &mut Session, ended: Result<String, Ended>) {
    let told = match ended {
        Ok(told) | Err(Ended::Failed(told)) => told,
        Err(Ended::Panicked(message)) => session.told_of_panic(&message),
    };
    session.set_notice(Some(told));
}

/// What was `recovered`, as an edit of what lies in its file now.
fn reopened(recovered: &Recovered) -> (Document, Option<PathBuf>) {
    let named = Some(&recovered.origin).filter(|origin| !origin.is_empty());
    // A page knows names, but no files.
    let path = named.filter(|_| !cfg!(target_arch = "wasm32")).map(PathBuf::from);
    let saved = path.as_deref().and_then(|path| files::read(path).ok()).unwrap_or_default();
    let mut document = Document::new(named.map_or("scene", String::as_str), saved);
    document.replace("recover", &recovered.text);
    document.seal();
    (document, path)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{player::SlicePlayer, scenes::examples::Bundle};

    #[test]
    fn a_panic_while_rendering_is_told_and_the_work_kept_at_once() {
        let document = Document::new("scene", "bansho = 1\n");
        let mut session = Session::new(document, None, Box::<SlicePlayer>::default(), |_| Arc::new(Bundle::default()));
        tell_end(&mut session, Err(Ended::Failed("the disk is full".into())));
        assert_eq!((session.notice(), session.keep_now), (Some("the disk is full"), false));
        tell_end(&mut session, Err(Ended::Panicked("broken on purpose".into())));
        assert!(session.notice().is_some_and(|notice| notice.contains("panicked") && notice.contains("on purpose")));
        assert!(session.keep_now);
    }
}
