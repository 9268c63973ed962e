//! Files on the disk: chosen, opened, saved, watched for what other programs do to them, and rendered.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use bansho::render::scene::Place;

use super::{
    Files,
    dialog::Chooser,
    questions::{Answer, Leaving, Question},
    save_as, tell_end,
};
use crate::{
    app::panels::scene::Subject,
    document::files::{self, Outside, Recent, watch::Watch},
    player::render_job::{self, Shooting},
    session::{Session, settings_store::Store},
};
use eframe::egui::{Context, Ui};

const BUSY: &str = "pictures are being rendered already; wait for them, or stop that with the cross beside its bar";

/// What the window knows of the disk.
pub(super) struct Shelf {
    recent: Recent,
    watch: Option<Watch>,
    shooting: Option<Shooting>,
}

impl Shelf {
    pub(super) fn new(store: &Store) -> Self {
        let recent = store.file("recent").map(Recent::read).unwrap_or_default();
        Self { recent, watch: None, shooting: None }
    }

    fn remember(&mut self, path: &Path) {
        // A list that cannot be kept is right until the window closes.
        let _ = self.recent.note(path);
    }
}

impl Files {
    /// Asks which file to open.
    pub(in crate::app) fn ask_to_open(&mut self, _ctx: &Context, session: &mut Session) {
        self.question = Some(Question::Open(Chooser::beside(session.path.as_deref())));
    }

    /// Asks which file `place` shall name.
    pub(in crate::app) fn ask_to_relink(&mut self, _ctx: &Context, session: &mut Session, place: Place) {
        self.question = Some(Question::Relink(place, Chooser::beside(session.path.as_deref()).of_pictures()));
    }

    /// Saves, or asks where to.
    pub(in crate::app) fn save(&mut self, session: &mut Session) {
        self.save_and(session, None);
    }

    /// Saves, or asks where to, and goes to `leaving` once that is done.
    pub(super) fn save_and(&mut self, session: &mut Session, leaving: Option<Leaving>) {
        let Some(path) = session.path.clone() else { return self.ask_where_to_save(session, leaving) };
        match files::outside(&session.document, &path) {
            // What is there was never seen here.
            Outside::Changed(text) if *text != **session.document.text() => {
                self.question = Some(Question::ChangedOutside(leaving));
            }
            Outside::Unreadable(reason) => {
                let what = format!("What lies in {} cannot be read: {reason}", path.display());
                self.question = Some(Question::Replace(path, what, leaving));
            }
            _ => self.save_to(session, path, leaving),
        }
    }

    fn ask_where_to_save(&mut self, session: &Session, leaving: Option<Leaving>) {
        let name = match &session.path {
            Some(path) => path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            None if session.document.name().ends_with(".toml") => session.document.name().to_owned(),
            None => "scene.toml".to_owned(),
        };
        self.question = Some(Question::SaveAs(Chooser::beside(session.path.as_deref()).naming(name), leaving));
    }

    /// Saves to `path`, whose name shall end as those of scenes do, unless another file would be lost.
    fn save_as(&mut self, session: &mut Session, path: PathBuf, leaving: Option<Leaving>) {
        let path = files::named_as_scene(path);
        if path.exists() && session.path.as_ref() != Some(&path) {
            let what = format!("There is a file of that name: {}", path.display());
            self.question = Some(Question::Replace(path, what, leaving));
        } else {
            self.save_to(session, path, leaving);
        }
    }

    fn save_to(&mut self, session: &mut Session, path: PathBuf, leaving: Option<Leaving>) {
        let moves = session.path.as_ref() != Some(&path);
        if let Err(reason) = write(session, &path, moves) {
            session.set_notice(Some(reason));
            return;
        }
        session.set_notice(None);
        self.shelf.remember(&path);
        if moves {
            session.path = Some(path);
            session.reload_assets();
        }
        if let Some(leaving) = leaving {
            self.leave(session, leaving);
        }
    }

    fn open(&mut self, session: &mut Session, path: PathBuf) {
        match files::read(&path) {
            Ok(text) => {
                self.shelf.remember(&path);
                self.open_text(session, &path.display().to_string(), text, Some(path));
            }
            Err(error) => session.set_notice(Some(error.to_string())),
        }
    }

    /// What the menu has for files on the disk.
    pub(in crate::app) fn menu(&mut self, ui: &mut Ui, session: &mut Session) {
        if ui.button("Save as…").clicked() {
            self.ask_where_to_save(session, None);
        }
        ui.menu_button("Recent", |ui| {
            for path in self.shelf.recent.paths().to_vec() {
                if ui.button(path.display().to_string()).clicked() {
                    self.open(session, path);
                }
            }
        });
        ui.separator();
        if ui.button("Render still").on_hover_text("This frame, as bansho render makes it").clicked() {
            self.render(session, true);
        }
        if ui.button("Render shot").on_hover_text("All frames, into out/ beside the scene").clicked() {
            self.render(session, false);
        }
        if ui.button("Reload plates and meshes").clicked() {
            session.reload_assets();
        }
    }

    /// Renders the present frame as `bansho render` does.
    pub(in crate::app) fn render_still(&mut self, _ctx: &Context, session: &mut Session) {
        self.render(session, true);
    }

    /// Renders all frames as `bansho render` does.
    pub(in crate::app) fn render_shot(&mut self, _ctx: &Context, session: &mut Session) {
        self.render(session, false);
    }

    /// Renders the present frame, or the whole shot, as `bansho render` does.
    fn render(&mut self, session: &mut Session, still: bool) {
        let Some(path) = session.path.clone() else {
            session.set_notice(Some("save the scene first; pictures are written beside its name, in out/".into()));
            return;
        };
        if self.progress().is_some() {
            session.set_notice(Some(BUSY.into()));
            return;
        }
        let number = still.then(|| session.transport.number());
        match Shooting::start(render_job::job(session.document.text(), &path, number), || {}) {
            Ok(shooting) => self.shelf.shooting = Some(shooting),
            Err(error) => session.set_notice(Some(format!("the system gives no thread to render on: {error}"))),
        }
    }

    /// Frames that are rendered, and all; 0 until they are counted. `None` where nothing is.
    pub(in crate::app) fn progress(&self) -> Option<[usize; 2]> {
        self.shelf.shooting.as_ref().map(Shooting::progress)
    }

    /// Asks what is rendered to stop; whole frames stay.
    pub(in crate::app) fn stop_rendering(&mut self) {
        self.shelf.shooting.iter().for_each(Shooting::stop);
    }

    pub(super) fn tend_shelf(&mut self, ui: &Ui, session: &mut Session, subject: &Subject) {
        self.watch_outside(ui, session);
        self.take_dropped(ui, session, subject);
        self.finish_job(ui, session);
    }

    /// Takes in what another program wrote into the file.
    fn watch_outside(&mut self, ui: &Ui, session: &mut Session) {
        let Some(path) = session.path.clone() else { return };
        if self.shelf.watch.as_ref().is_none_or(|watch| watch.path() != path) {
            let ctx = ui.ctx().clone();
            // Without a thread to look, the file is not watched.
            self.shelf.watch = Watch::start(&path, move || ctx.request_repaint()).ok();
        }
        if !self.shelf.watch.as_ref().is_some_and(Watch::touched) {
            return;
        }
        match files::outside(&session.document, &path) {
            Outside::Same => session.document.mark_gone(!path.exists()),
            Outside::Gone => {
                session.document.mark_gone(true);
                session.set_notice(Some(format!("{}: the file is gone; saving writes it anew", path.display())));
            }
            Outside::Unreadable(reason) => {
                let notice = format!("{}: another program wrote what cannot be read: {reason}", path.display());
                session.set_notice(Some(notice));
            }
            Outside::Changed(_) if session.document.differs() => self.question = Some(Question::ChangedOutside(None)),
            Outside::Changed(text) => take_outside(session, &text),
        }
    }

    /// A scene is opened, all else laid into the one that is open.
    fn take_dropped(&mut self, ui: &Ui, session: &mut Session, subject: &Subject) {
        let dropped: Vec<PathBuf> =
            ui.input(|input| input.raw.dropped_files.iter().map(|file| file.path().to_path_buf()).collect());
        let scene = dropped.iter().position(|path| files::is_named_as_scene(path));
        match scene {
            Some(scene) => {
                self.open(session, dropped[scene].clone());
                if dropped.len() > 1 {
                    session.set_notice(Some("of the files that were dropped, only the scene was taken".into()));
                }
            }
            None => dropped.iter().for_each(|path| session.lay_over(path, subject)),
        }
    }

    fn finish_job(&mut self, ui: &Ui, session: &mut Session) {
        let Some(shooting) = &mut self.shelf.shooting else { return };
        ui.ctx().request_repaint_after(Duration::from_millis(200));
        if let Some(result) = shooting.finished() {
            self.shelf.shooting = None;
            tell_end(session, result.map(|file| format!("written: {}", file.display())));
        }
    }

    pub(super) fn answered_about_disk(&mut self, session: &mut Session, question: Question, answer: Answer) {
        match (question, answer) {
            (Question::Open(chooser), _) => self.open(session, chooser.path()),
            (Question::Relink(place, chooser), _) => session.relink(&place, &chooser.path()),
            (Question::SaveAs(chooser, leaving), _) => self.save_as(session, chooser.path(), leaving),
            (Question::Replace(path, _, leaving), Answer::Do) => self.save_to(session, path, leaving),
            (Question::Replace(_, _, leaving), _) => self.ask_where_to_save(session, leaving),
            (Question::ChangedOutside(_), Answer::Do) => {
                let there = session.path.as_ref().map(|path| files::outside(&session.document, path));
                // As it is now: the other program may have gone on writing.
                match there {
                    Some(Outside::Changed(text)) => take_outside(session, &text),
                    Some(Outside::Unreadable(reason)) => session.set_notice(Some(reason)),
                    Some(Outside::Same | Outside::Gone) | None => {}
                }
            }
            (Question::ChangedOutside(leaving), Answer::Save) => {
                if let Some(path) = session.path.clone() {
                    self.save_to(session, path, leaving);
                }
            }
            (Question::ChangedOutside(_), Answer::Cancel) | (Question::Leave(_) | Question::StopRendering, _) => {}
        }
    }
}

/// Writes the scene to `path`; one that `moves` there, with its paths made right.
///
/// # Errors
/// Why it cannot be saved there; it stays as it was.
fn write(session: &mut Session, path: &Path, moves: bool) -> Result<(), String> {
    let text = if moves { save_as::follow(session, path) } else { Ok(session.document.text().clone()) };
    let text = text.map_err(|error| error.to_string())?;
    files::save(&mut session.document, path, text).map_err(|error| error.to_string())
}

/// Takes what another program wrote as an edit that can be undone.
fn take_outside(session: &mut Session, text: &str) {
    session.document.replace("edited elsewhere", text);
    session.document.seal();
    session.document.mark_saved(text.into());
}
