//! Files in the file system: opening, saving, watching for changes by other programs, and rendering.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use bansho::scene::ValuePath;

use super::{
    Files,
    dialog::FileDialog,
    questions::{Answer, PendingAction, Question},
    report_end, save_as,
};
use crate::{
    document::files::{self, ExternalChange, RecentFiles, watch::FileWatcher},
    player::render_job::{self, RenderJob},
    session::{Session, selection::Selection, settings_store::SettingsStore},
};
use eframe::egui::{Context, Ui};

const BUSY: &str = "pictures are being rendered already; wait for them, or stop that with the cross beside its bar";

/// The state of files in the file system.
pub(super) struct PlatformFiles {
    recent: RecentFiles,
    watch: Option<FileWatcher>,
    render_job: Option<RenderJob>,
}

impl PlatformFiles {
    pub(super) fn new(store: &SettingsStore) -> Self {
        let recent = store.file("recent").map(RecentFiles::read).unwrap_or_default();
        Self { recent, watch: None, render_job: None }
    }

    fn remember(&mut self, path: &Path) {
        // A list that cannot be stored stays valid until the window closes.
        let _ = self.recent.add(path);
    }
}

impl Files {
    /// Asks which file to open.
    pub(in crate::app) fn ask_to_open(&mut self, _ctx: &Context, session: &mut Session) {
        self.question = Some(Question::Open(FileDialog::in_folder_of(session.path.as_deref())));
    }

    /// Asks which file `parameter` shall name.
    pub(in crate::app) fn ask_to_relink(&mut self, _ctx: &Context, session: &mut Session, parameter: ValuePath) {
        let dialog = FileDialog::in_folder_of(session.path.as_deref()).for_assets();
        self.question = Some(Question::Relink { parameter, dialog });
    }

    /// Saves, or asks where to.
    pub(in crate::app) fn save(&mut self, session: &mut Session) {
        self.save_and(session, None);
    }

    /// Saves, or asks where to, and then performs `action`.
    pub(super) fn save_and(&mut self, session: &mut Session, action: Option<PendingAction>) {
        let Some(path) = session.path.clone() else { return self.ask_where_to_save(session, action) };
        match files::external_change(&session.document, &path) {
            // The text in the file is that of another program.
            ExternalChange::Changed(text) if *text != **session.document.text() => {
                self.question = Some(Question::ChangedExternally { then: action });
            }
            ExternalChange::Unreadable(reason) => {
                let message = format!("{} cannot be read: {reason}", path.display());
                self.question = Some(Question::Replace { path, message, then: action });
            }
            _ => self.save_to(session, path, action),
        }
    }

    fn ask_where_to_save(&mut self, session: &Session, action: Option<PendingAction>) {
        let name = match &session.path {
            Some(path) => path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            None if session.document.name().ends_with(".toml") => session.document.name().to_owned(),
            None => "scene.toml".to_owned(),
        };
        let dialog = FileDialog::in_folder_of(session.path.as_deref()).with_name(name);
        self.question = Some(Question::SaveAs { dialog, then: action });
    }

    /// Saves to `path` with the extension of scenes, after a question if another file would be replaced.
    fn save_as(&mut self, session: &mut Session, path: PathBuf, action: Option<PendingAction>) {
        let path = files::with_scene_extension(path);
        if path.exists() && session.path.as_ref() != Some(&path) {
            let message = format!("There is a file of that name: {}", path.display());
            self.question = Some(Question::Replace { path, message, then: action });
        } else {
            self.save_to(session, path, action);
        }
    }

    fn save_to(&mut self, session: &mut Session, path: PathBuf, action: Option<PendingAction>) {
        let moves = session.path.as_ref() != Some(&path);
        if let Err(reason) = write(session, &path, moves) {
            session.set_notice(Some(reason));
            return;
        }
        session.set_notice(None);
        self.platform.remember(&path);
        if moves {
            session.path = Some(path);
            session.reload_assets();
        }
        if let Some(action) = action {
            self.proceed(session, action);
        }
    }

    fn open(&mut self, session: &mut Session, path: PathBuf) {
        match files::read(&path) {
            Ok(text) => {
                self.platform.remember(&path);
                self.open_text(session, &path.display().to_string(), text, Some(path));
            }
            Err(error) => session.set_notice(Some(error.to_string())),
        }
    }

    /// The entries of the file menu for a file system.
    pub(in crate::app) fn menu_ui(&mut self, ui: &mut Ui, session: &mut Session) {
        if ui.button("Save as…").clicked() {
            self.ask_where_to_save(session, None);
        }
        ui.menu_button("Recent", |ui| {
            for path in self.platform.recent.paths().to_vec() {
                if ui.button(path.display().to_string()).clicked() {
                    self.open(session, path);
                }
            }
        });
        ui.separator();
        if ui.button("Render still").on_hover_text("This frame, as bansho render draws it").clicked() {
            self.render(session, true);
        }
        if ui.button("Render shot").on_hover_text("All frames, into out/ beside the scene").clicked() {
            self.render(session, false);
        }
        if ui.button("Reload plates and meshes").clicked() {
            session.reload_assets();
        }
    }

    /// Renders the current frame as `bansho render` does.
    pub(in crate::app) fn render_still(&mut self, _ctx: &Context, session: &mut Session) {
        self.render(session, true);
    }

    /// Renders all frames as `bansho render` does.
    pub(in crate::app) fn render_shot(&mut self, _ctx: &Context, session: &mut Session) {
        self.render(session, false);
    }

    /// Renders the current frame, or the whole shot, as `bansho render` does.
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
        match RenderJob::start(render_job::job(session.document.text(), &path, number), || {}) {
            Ok(render_job) => self.platform.render_job = Some(render_job),
            Err(error) => session.set_notice(Some(format!("the system cannot start a thread for rendering: {error}"))),
        }
    }

    /// Number of frames rendered, and in total (0 until it is known); `None` where nothing is rendered.
    pub(in crate::app) fn progress(&self) -> Option<[usize; 2]> {
        self.platform.render_job.as_ref().map(RenderJob::progress)
    }

    /// Stops rendering; finished frames stay.
    pub(in crate::app) fn stop_rendering(&mut self) {
        self.platform.render_job.iter().for_each(RenderJob::stop);
    }

    pub(super) fn poll_platform(&mut self, ui: &Ui, session: &mut Session, selection: &Selection) {
        self.poll_external_change(ui, session);
        self.handle_dropped_files(ui, session, selection);
        self.poll_render_job(ui, session);
    }

    /// Checks whether another program changed the file.
    fn poll_external_change(&mut self, ui: &Ui, session: &mut Session) {
        let Some(path) = session.path.clone() else { return };
        if self.platform.watch.as_ref().is_none_or(|watch| watch.path() != path) {
            let ctx = ui.ctx().clone();
            // Without a thread, the file is not watched.
            self.platform.watch = FileWatcher::start(&path, move || ctx.request_repaint()).ok();
        }
        if !self.platform.watch.as_ref().is_some_and(FileWatcher::take_modified) {
            return;
        }
        match files::external_change(&session.document, &path) {
            ExternalChange::Unchanged => session.document.set_file_missing(!path.exists()),
            ExternalChange::Deleted => {
                session.document.set_file_missing(true);
                session.set_notice(Some(format!("{}: the file is gone; saving creates it again", path.display())));
            }
            ExternalChange::Unreadable(reason) => {
                let notice = format!("{}: another program wrote text that cannot be read: {reason}", path.display());
                session.set_notice(Some(notice));
            }
            ExternalChange::Changed(_) if session.document.is_modified() => {
                self.question = Some(Question::ChangedExternally { then: None });
            }
            ExternalChange::Changed(text) => apply_external_change(session, &text),
        }
    }

    /// Opens a dropped scene; adds other dropped files to the open scene.
    fn handle_dropped_files(&mut self, ui: &Ui, session: &mut Session, selection: &Selection) {
        let dropped: Vec<PathBuf> =
            ui.input(|input| input.raw.dropped_files.iter().map(|file| file.path().to_path_buf()).collect());
        let scene = dropped.iter().position(|path| files::has_scene_extension(path));
        match scene {
            Some(scene) => {
                self.open(session, dropped[scene].clone());
                if dropped.len() > 1 {
                    session.set_notice(Some("of the files that were dropped, only the scene was taken".into()));
                }
            }
            None => dropped.iter().for_each(|path| session.drop_file(path, selection)),
        }
    }

    fn poll_render_job(&mut self, ui: &Ui, session: &mut Session) {
        let Some(render_job) = &mut self.platform.render_job else { return };
        ui.ctx().request_repaint_after(Duration::from_millis(200));
        if let Some(result) = render_job.finished() {
            self.platform.render_job = None;
            report_end(session, result.map(|file| format!("written: {}", file.display())));
        }
    }

    pub(super) fn apply_native_answer(&mut self, session: &mut Session, question: Question, answer: Answer) {
        match (question, answer) {
            (Question::Open(dialog), _) => self.open(session, dialog.path()),
            (Question::Relink { parameter, dialog }, _) => session.relink(&parameter, &dialog.path()),
            (Question::SaveAs { dialog, then }, _) => self.save_as(session, dialog.path(), then),
            (Question::Replace { path, then, .. }, Answer::Confirm) => self.save_to(session, path, then),
            (Question::Replace { then, .. }, _) => self.ask_where_to_save(session, then),
            (Question::ChangedExternally { .. }, Answer::Confirm) => {
                let change = session.path.as_ref().map(|path| files::external_change(&session.document, path));
                // Read again, since the other program may have written more.
                match change {
                    Some(ExternalChange::Changed(text)) => apply_external_change(session, &text),
                    Some(ExternalChange::Unreadable(reason)) => session.set_notice(Some(reason)),
                    Some(ExternalChange::Unchanged | ExternalChange::Deleted) | None => {}
                }
            }
            (Question::ChangedExternally { then }, Answer::Save) => {
                if let Some(path) = session.path.clone() {
                    self.save_to(session, path, then);
                }
            }
            (Question::ChangedExternally { .. }, Answer::Cancel)
            | (Question::DiscardUnsaved(_) | Question::StopRendering, _) => {}
        }
    }
}

/// Writes the scene to `path`. If it is another file than before (`moves`), relative paths in the scene are adjusted.
///
/// # Errors
/// Why it cannot be saved there. The document is unchanged then.
fn write(session: &mut Session, path: &Path, moves: bool) -> Result<(), String> {
    let text = if moves { save_as::with_moved_paths(session, path) } else { Ok(session.document.text().clone()) };
    let text = text.map_err(|error| error.to_string())?;
    files::save(&mut session.document, path, text).map_err(|error| error.to_string())
}

/// Applies the text written by another program as an undoable edit.
fn apply_external_change(session: &mut Session, text: &str) {
    session.document.replace("edited elsewhere", text);
    session.document.end_step();
    session.document.mark_saved(text.into());
}
