//! Opening, saving, rendering to files, autosave, and the dialogs for them. `native` is for file systems, `web` for browsers: both define
//! `PlatformFiles` and the same methods of [`Files`].

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

use self::unsaved::UnsavedWork;
use crate::{
    document::{Document, files, files::autosave::RecoveredWork},
    player::render_job::JobFailure,
    session::{Session, selection::Selection, settings_store::SettingsStore},
};
#[cfg(not(target_arch = "wasm32"))]
use native::PlatformFiles;
use questions::{Answer, PendingAction, Question, answer_ui};
#[cfg(target_arch = "wasm32")]
use web::PlatformFiles;

/// The file operations of the window, and the open question.
pub(super) struct Files {
    question: Option<Question>,
    pub(super) unsaved: UnsavedWork,
    closing: bool,
    platform: PlatformFiles,
}

impl Files {
    /// File operations with autosaves in `store`.
    pub(super) fn new(store: &SettingsStore) -> Self {
        Self { question: None, unsaved: UnsavedWork::new(store), closing: false, platform: PlatformFiles::new(store) }
    }

    /// Opens a bundled scene, after a question if there is unsaved work.
    pub(super) fn open_bundled(&mut self, session: &mut Session, name: &str, text: &str) {
        self.open_text(session, name, text.to_owned(), None);
    }

    /// Opens a scene that was read, after a question if there is unsaved work.
    fn open_text(&mut self, session: &mut Session, name: &str, text: String, path: Option<PathBuf>) {
        self.confirm_then(session, PendingAction::Open { name: name.to_owned(), text, path });
    }

    /// Opens recovered work, after a question if there is other unsaved work.
    pub(super) fn recover(&mut self, session: &mut Session, recovered: RecoveredWork) {
        self.confirm_then(session, PendingAction::Recover(recovered));
    }

    fn confirm_then(&mut self, session: &mut Session, action: PendingAction) {
        if session.document.is_dirty() {
            self.question = Some(Question::DiscardUnsaved(action));
        } else {
            self.proceed(session, action);
        }
    }

    /// Polls autosave, the platform's files and closing, and shows the open question.
    pub(super) fn poll(&mut self, ui: &mut Ui, session: &mut Session, selection: &Selection) {
        self.unsaved.poll_autosave(ui, session);
        self.poll_platform(ui, session, selection);
        self.confirm_close(ui, session);
        self.question_ui(ui, session);
    }

    /// Asks before closing with unsaved work, or while frames are rendered.
    fn confirm_close(&mut self, ui: &Ui, session: &mut Session) {
        let requested = ui.input(|input| input.viewport().close_requested());
        if self.closing {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        } else if requested && (session.document.is_dirty() || self.progress().is_some()) {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.confirm_then(session, PendingAction::Close);
        }
    }

    fn question_ui(&mut self, ui: &mut Ui, session: &mut Session) {
        let Some(mut question) = self.question.take() else { return };
        let answer = egui::Modal::new(ui.scope_id().with("question")).show(ui.ctx(), |ui| answer_ui(ui, &mut question));
        match answer.inner {
            None if answer.should_close() => {}
            None => self.question = Some(question),
            Some(Answer::Cancel) => {}
            Some(answer) => self.apply_answer(session, question, answer),
        }
        if self.closing {
            ui.ctx().request_repaint();
        }
    }

    fn apply_answer(&mut self, session: &mut Session, question: Question, answer: Answer) {
        match question {
            Question::DiscardUnsaved(action) => {
                if answer == Answer::Save {
                    self.save_and(session, Some(action));
                } else {
                    self.proceed(session, action);
                }
            }
            Question::StopRendering => {
                self.stop_rendering();
                self.closing = true;
            }
            #[cfg(not(target_arch = "wasm32"))]
            question => self.apply_native_answer(session, question, answer),
        }
    }

    fn proceed(&mut self, session: &mut Session, action: PendingAction) {
        match action {
            PendingAction::Open { name, text, path } => session.open(Document::new(name, text), path),
            PendingAction::Recover(recovered) => {
                let (document, path) = recovered_document(&recovered);
                session.open(document, path);
                self.unsaved.adopt(recovered, session);
            }
            PendingAction::Close if self.progress().is_some() => self.question = Some(Question::StopRendering),
            PendingAction::Close => self.closing = true,
        }
    }
}

/// Shows how rendering ended. After a panic the work is saved at once.
fn report_end(session: &mut Session, ended: Result<String, JobFailure>) {
    let message = match ended {
        Ok(message) | Err(JobFailure::Failed(message)) => message,
        Err(JobFailure::Panicked(message)) => session.panic_message(&message),
    };
    session.set_notice(Some(message));
}

/// Recovered work as an undoable edit of the file's current text.
fn recovered_document(recovered: &RecoveredWork) -> (Document, Option<PathBuf>) {
    let origin = Some(&recovered.origin).filter(|origin| !origin.is_empty());
    // A web page has no file system.
    let path = origin.filter(|_| !cfg!(target_arch = "wasm32")).map(PathBuf::from);
    let saved = path.as_deref().and_then(|path| files::read(path).ok()).unwrap_or_default();
    let mut document = Document::new(origin.map_or("scene", String::as_str), saved);
    document.replace("recover", &recovered.text);
    document.end_step();
    (document, path)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{player::PolledPlayer, scenes::examples::BundledAssets};

    #[test]
    fn a_panic_while_rendering_is_reported_and_the_work_saved_at_once() {
        let document = Document::new("scene", "bansho = 2\n");
        let mut session =
            Session::new(document, None, Box::<PolledPlayer>::default(), |_| Arc::new(BundledAssets::default()));
        report_end(&mut session, Err(JobFailure::Failed("the disk is full".into())));
        assert_eq!((session.notice(), session.autosave_now), (Some("the disk is full"), false));
        report_end(&mut session, Err(JobFailure::Panicked("broken on purpose".into())));
        assert!(session.notice().is_some_and(|notice| notice.contains("panicked") && notice.contains("on purpose")));
        assert!(session.autosave_now);
    }
}
