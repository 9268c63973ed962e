//! The window's files: what lies where, what is kept while it is unsaved, what is rendered.

use std::path::{Path, PathBuf};

#[cfg(target_arch = "wasm32")]
use super::browser;

use bansho::render::scene::Place;
use eframe::egui::{self, Ui};

use super::{
    chooser::Chooser,
    question::{Answer, Leaving, Question, answer},
    session::Session,
    store::Store,
    unsaved::Unsaved,
};
#[cfg(not(target_arch = "wasm32"))]
use crate::document::watch::Watch;
use crate::{
    document::{
        Document,
        files::{self, Recent},
    },
    player::shoot::{self, Shooting},
};

/// Files of the window: what lies where, and what waits to be asked.
pub(super) struct Files {
    pub(super) question: Option<Question>,
    pub(super) recent: Recent,
    pub(super) unsaved: Unsaved,
    #[cfg(not(target_arch = "wasm32"))]
    watch: Option<Watch>,
    closing: bool,
    pub(super) shooting: Option<Shooting>,
    /// Files that came by way of the browser.
    #[cfg(target_arch = "wasm32")]
    inbox: browser::Inbox,
}

impl Files {
    /// Files of a window that keeps what it must in `store`.
    pub(super) fn new(store: &Store) -> Self {
        Self {
            question: None,
            unsaved: Unsaved::new(store),
            recent: store.file("recent").map(Recent::read).unwrap_or_default(),
            #[cfg(not(target_arch = "wasm32"))]
            watch: None,
            closing: false,
            shooting: None,
            #[cfg(target_arch = "wasm32")]
            inbox: browser::Inbox::default(),
        }
    }

    /// What goes on with a job, for the status line.
    pub(super) fn progress(&self) -> Option<String> {
        let [done, total] = self.shooting.as_ref()?.progress();
        Some(if total == 0 { "rendering…".into() } else { format!("rendering: {done} of {total}") })
    }

    /// Asks which file to open.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn ask_to_open(&mut self, _ctx: &egui::Context, session: &mut Session) {
        self.question = Some(Question::Open(Chooser::beside(session.path.as_deref())));
    }

    /// Asks which file to open.
    #[cfg(target_arch = "wasm32")]
    pub(super) fn ask_to_open(&mut self, ctx: &egui::Context, session: &mut Session) {
        if browser::ask_for_file(&self.inbox, ctx).is_err() {
            session.set_notice(Some("the browser cannot ask for files here".into()));
        }
    }

    /// Asks which file `place` shall name.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn ask_to_relink(&mut self, _ctx: &egui::Context, session: &mut Session, place: Place) {
        self.question = Some(Question::Relink(place, Chooser::beside(session.path.as_deref()).of_pictures()));
    }

    /// Asks for a file, which then stands for the one that the scene names.
    #[cfg(target_arch = "wasm32")]
    pub(super) fn ask_to_relink(&mut self, ctx: &egui::Context, session: &mut Session, _place: Place) {
        self.ask_to_open(ctx, session);
    }

    /// Hands the scene to the browser, which saves it where it saves what it is given.
    #[cfg(target_arch = "wasm32")]
    pub(super) fn save(&mut self, session: &mut Session) {
        let name = session.document.name().to_owned();
        let name = if name.ends_with(".toml") { name } else { format!("{name}.toml") };
        let text = session.document.text().clone();
        match browser::download(&name, &text) {
            Ok(()) => session.document.mark_saved(text),
            Err(_) => session.set_notice(Some("the browser cannot save files here".into())),
        }
    }

    /// Saves, or asks where to.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn save(&mut self, session: &mut Session) {
        match session.path.clone() {
            Some(path) => self.save_to(session, path),
            None => self.ask_where_to_save(session),
        }
    }

    /// Asks where to save.
    pub(super) fn ask_where_to_save(&mut self, session: &Session) {
        let name = match &session.path {
            Some(path) => path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            None if session.document.name().ends_with(".toml") => session.document.name().to_owned(),
            None => "scene.toml".to_owned(),
        };
        self.question = Some(Question::SaveAs(Chooser::beside(session.path.as_deref()).naming(name)));
    }

    fn save_to(&mut self, session: &mut Session, path: PathBuf) {
        match files::save(&mut session.document, &path) {
            Ok(()) => {
                session.set_notice(None);
                self.remember(&path);
                if session.path.as_ref() != Some(&path) {
                    session.path = Some(path);
                    session.reload_assets();
                }
            }
            Err(error) => session.set_notice(Some(error.to_string())),
        }
    }

    fn remember(&mut self, path: &Path) {
        // A list that cannot be kept is right until the window closes.
        let _ = self.recent.note(path);
    }

    /// Opens `path`, after asking where that would lose work.
    pub(super) fn open(&mut self, session: &mut Session, path: PathBuf) {
        if session.document.is_dirty() {
            self.question = Some(Question::Leave(Leaving::Open(path)));
        } else {
            self.open_now(session, path);
        }
    }

    /// Opens one of the examples, after asking where that would lose work.
    pub(super) fn open_example(&mut self, session: &mut Session, name: &'static str, text: &'static str) {
        self.open_given(session, name, text.to_owned());
    }

    /// Opens a scene that no folder holds.
    fn open_given(&mut self, session: &mut Session, name: &str, text: String) {
        if session.document.is_dirty() {
            self.question = Some(Question::Leave(Leaving::OpenGiven(name.to_owned(), text)));
        } else {
            session.open(Document::new(name, text), None);
        }
    }

    fn open_now(&mut self, session: &mut Session, path: PathBuf) {
        match files::open(&path) {
            Ok(document) => {
                self.remember(&path);
                session.open(document, Some(path));
            }
            Err(error) => session.set_notice(Some(error.to_string())),
        }
    }

    /// Renders the present frame, or the whole shot, as `bansho render` does.
    pub(super) fn render(&mut self, session: &mut Session, still: bool) {
        let Some(path) = session.path.clone() else {
            session.set_notice(Some("save the scene first; pictures are written beside its name, in out/".into()));
            return;
        };
        let number = still.then(|| session.transport.number());
        match Shooting::start(shoot::job(session.document.text(), &path, number), || {}) {
            Ok(shooting) => self.shooting = Some(shooting),
            Err(error) => session.set_notice(Some(format!("the system gives no thread to render on: {error}"))),
        }
    }

    /// What must be done now and then, and the question that waits.
    pub(super) fn tend(&mut self, ui: &mut Ui, session: &mut Session) {
        self.unsaved.tend(ui, session);
        self.watch_outside(ui, session);
        self.take_dropped(ui, session);
        self.hold_close(ui, session);
        self.finish_job(ui, session);
        self.ask(ui, session);
    }

    /// A page's files are nobody else's.
    #[cfg(target_arch = "wasm32")]
    fn watch_outside(&mut self, _ui: &Ui, _session: &mut Session) {}

    /// Takes in what another program wrote into the file.
    #[cfg(not(target_arch = "wasm32"))]
    fn watch_outside(&mut self, ui: &Ui, session: &mut Session) {
        let Some(path) = session.path.clone() else { return };
        if self.watch.as_ref().is_none_or(|watch| watch.path() != path) {
            let ctx = ui.ctx().clone();
            // Without a thread to look, the file is not watched.
            self.watch = Watch::start(&path, move || ctx.request_repaint()).ok();
        }
        if !self.watch.as_ref().is_some_and(Watch::touched) {
            return;
        }
        let Some(text) = files::changed_outside(&session.document, &path) else { return };
        if session.document.is_dirty() {
            self.question = Some(Question::ChangedOutside(text.to_string()));
        } else {
            take_outside(session, &text);
        }
    }

    /// Takes in what the browser gave: a scene is opened, anything else laid into the one that is open.
    #[cfg(target_arch = "wasm32")]
    fn take_given(&mut self, session: &mut Session) {
        let given = std::mem::take(&mut *self.inbox.borrow_mut());
        for (name, bytes) in given {
            if name.ends_with(".toml") {
                match String::from_utf8(bytes) {
                    Ok(text) => self.open_given(session, &name, text),
                    Err(_) => session.set_notice(Some(format!("{name}: is not UTF-8"))),
                }
            } else {
                session.give(&name, bytes);
                session.lay_over(Path::new(&name));
            }
        }
    }

    #[cfg(target_arch = "wasm32")]
    fn take_dropped(&mut self, ui: &Ui, session: &mut Session) {
        let dropped = ui.input(|input| input.raw.dropped_files.clone());
        dropped.into_iter().for_each(|file| browser::take_dropped(file, &self.inbox, ui.ctx()));
        self.take_given(session);
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn take_dropped(&mut self, ui: &Ui, session: &mut Session) {
        let dropped = ui.input(|input| input.raw.dropped_files.first().map(|file| file.path().to_path_buf()));
        let Some(path) = dropped else { return };
        if path.extension().is_some_and(|extension| extension == "toml") {
            self.open(session, path);
        } else {
            session.lay_over(&path);
        }
    }

    /// Closing with unsaved work asks first.
    fn hold_close(&mut self, ui: &Ui, session: &Session) {
        let wants = ui.input(|input| input.viewport().close_requested());
        if wants && session.document.is_dirty() && !self.closing {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::CancelClose);
            self.question = Some(Question::Leave(Leaving::Close));
        }
    }

    fn finish_job(&mut self, ui: &Ui, session: &mut Session) {
        let Some(shooting) = &mut self.shooting else { return };
        ui.ctx().request_repaint_after(std::time::Duration::from_millis(200));
        if let Some(result) = shooting.finished() {
            self.shooting = None;
            session.set_notice(Some(match result {
                Ok(file) => format!("written: {}", file.display()),
                Err(reason) => reason,
            }));
        }
    }

    fn ask(&mut self, ui: &mut Ui, session: &mut Session) {
        let Some(mut question) = self.question.take() else { return };
        let answer = egui::Modal::new(ui.scope_id().with("question")).show(ui.ctx(), |ui| answer(ui, &mut question));
        match answer.inner {
            None if answer.should_close() => {}
            None => self.question = Some(question),
            Some(yes) => self.answered(ui, session, question, yes),
        }
    }

    fn answered(&mut self, ui: &Ui, session: &mut Session, question: Question, answer: Answer) {
        match (question, answer) {
            (_, Answer::Cancel) => {}
            (Question::Open(chooser), _) => self.open(session, chooser.path()),
            (Question::Relink(place, chooser), _) => session.relink(&place, &chooser.path()),
            (Question::SaveAs(chooser), _) => self.save_to(session, chooser.path()),
            (Question::ChangedOutside(text), Answer::Do) => take_outside(session, &text),
            (Question::ChangedOutside(_), Answer::Save) => self.save(session),
            (Question::Leave(leaving), answer) => {
                if answer == Answer::Save {
                    self.save(session);
                }
                if answer == Answer::Do || !session.document.is_dirty() {
                    self.leave(ui, session, leaving);
                }
            }
        }
    }

    fn leave(&mut self, ui: &Ui, session: &mut Session, leaving: Leaving) {
        match leaving {
            Leaving::Open(path) => self.open_now(session, path),
            Leaving::OpenGiven(name, text) => session.open(Document::new(name, text), None),
            Leaving::Close => {
                self.closing = true;
                ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
            }
        }
    }
}

/// Takes what another program wrote as an edit that can be undone.
fn take_outside(session: &mut Session, text: &str) {
    session.document.replace("edited elsewhere", text);
    session.document.seal();
    session.document.mark_saved(text.into());
}
