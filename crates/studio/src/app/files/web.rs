//! Files in a web page: chosen or dropped by the user, plates that lie beside the page, and downloads.

use std::{cell::RefCell, collections::BTreeSet, path::Path, rc::Rc};

use bansho_example_scenes::plates;

use bansho::{
    media::{files::naming, zip::ZipWriter},
    scene::ValuePath,
};

use super::{
    Files,
    browser_io::{self, BlobParts, FetchedFile, Inbox, ReceivedFile},
    questions::PendingAction,
    report_end,
};
use crate::{
    document::Revision,
    player::{Event, FrameRequest, Player, WorkerPlayer, render_job::JobFailure},
    session::{Session, selection::Selection, settings_store::SettingsStore},
};
use eframe::egui::{Context, Ui};

/// The state of files in a page.
pub(super) struct PlatformFiles {
    /// Files that were chosen or dropped.
    inbox: Inbox,
    plates: PlateFetches,
    /// The parameter that is set to the next received file.
    relink: Option<ValuePath>,
    rendering: Option<Rendering>,
}

/// Plates of the example scenes, which lie in the folder `scenes` beside the page. They are fetched once a scene names them.
#[derive(Default)]
struct PlateFetches {
    /// The scene that was last searched for plates: number of the opened document, and revision.
    searched: Option<(u64, Revision)>,
    /// Names of the plates that this document asked for.
    requested: BTreeSet<String>,
    /// Number of plates that are on their way.
    pending: usize,
    fetched: Rc<RefCell<Vec<FetchedFile>>>,
}

impl PlateFetches {
    /// Adds plates that have arrived to the session, and asks for those that the scene names and that are not there.
    fn poll(&mut self, ctx: &Context, session: &mut Session) {
        for FetchedFile { name, bytes } in self.fetched.take() {
            self.pending -= 1;
            match bytes {
                Ok(bytes) => session.add_file(&name, bytes),
                Err(reason) => session.set_notice(Some(reason)),
            }
        }
        let scene = Some((session.opened, session.document.revision()));
        if self.searched != scene {
            if self.searched.map(|(opened, _)| opened) != Some(session.opened) {
                // Another document may ask again for what could not be had.
                self.requested.clear();
            }
            self.searched = scene;
            self.request_missing(ctx, session);
        }
        session.awaits_files = self.pending > 0;
    }

    fn request_missing(&mut self, ctx: &Context, session: &Session) {
        for name in session.missing_plates() {
            let Some(path) = plates::path_in_scenes(&name) else { continue };
            if self.requested.insert(name.clone()) {
                browser_io::fetch(format!("scenes/{path}"), name, &self.fetched, ctx);
                self.pending += 1;
            }
        }
    }
}

/// Full-quality rendering, in a worker of its own, so that the preview stays live.
struct Rendering {
    player: WorkerPlayer,
    /// The current request.
    request: FrameRequest,
    /// The name of the scene without its extension.
    stem: String,
    done: usize,
    total: usize,
    /// The archive of a shot's pictures.
    shot: Option<ZipWriter<BlobParts>>,
}

impl PlatformFiles {
    pub(super) fn new(_store: &SettingsStore) -> Self {
        Self { inbox: Inbox::default(), plates: PlateFetches::default(), relink: None, rendering: None }
    }
}

impl Files {
    /// Asks which file to open.
    pub(in crate::app) fn ask_to_open(&mut self, ctx: &Context, session: &mut Session) {
        self.platform.relink = None;
        self.ask_for_file(ctx, session);
    }

    /// Asks which file `parameter` shall name.
    pub(in crate::app) fn ask_to_relink(&mut self, ctx: &Context, session: &mut Session, parameter: ValuePath) {
        self.platform.relink = Some(parameter);
        self.ask_for_file(ctx, session);
    }

    fn ask_for_file(&self, ctx: &Context, session: &mut Session) {
        if browser_io::ask_for_file(&self.platform.inbox, ctx).is_err() {
            session.set_notice(Some("the browser cannot ask for files here".into()));
        }
    }

    /// Downloads the scene.
    pub(in crate::app) fn save(&mut self, session: &mut Session) {
        self.save_and(session, None);
    }

    /// Downloads the scene, and then performs `action`.
    pub(super) fn save_and(&mut self, session: &mut Session, action: Option<PendingAction>) {
        let text = session.document.text().clone();
        match browser_io::download(&format!("{}.toml", stem(session)), &BlobParts::new(text.as_bytes())) {
            Ok(()) => {
                session.document.mark_saved(text);
                action.into_iter().for_each(|action| self.proceed(session, action));
            }
            Err(_) => session.set_notice(Some("the browser cannot save files here".into())),
        }
    }

    /// The entries of the file menu for a web page.
    pub(in crate::app) fn menu_ui(&mut self, ui: &mut Ui, session: &mut Session) {
        ui.separator();
        if ui.button("Render still").on_hover_text("The finished picture of this frame, as a PNG").clicked() {
            self.render_still(ui.ctx(), session);
        }
        if ui.button("Render shot").on_hover_text("The finished pictures of all frames, as PNGs in a ZIP").clicked() {
            self.render_shot(ui.ctx(), session);
        }
    }

    /// Renders the current frame as `bansho render` does, and downloads it.
    pub(in crate::app) fn render_still(&mut self, ctx: &Context, session: &mut Session) {
        let number = session.transport.number();
        self.render(ctx, session, number, 1, None);
    }

    /// Renders all frames as `bansho render` does, and downloads them as an archive.
    pub(in crate::app) fn render_shot(&mut self, ctx: &Context, session: &mut Session) {
        let frames = session.transport.frames();
        let total = (frames.end() - frames.start() + 1) as usize;
        self.render(ctx, session, *frames.start(), total, Some(ZipWriter::new(BlobParts::default())));
    }

    /// Renders `total` frames from `first` on as `bansho render` does. Those of a `shot` are collected in an archive.
    fn render(
        &mut self,
        ctx: &Context,
        session: &mut Session,
        first: i64,
        total: usize,
        shot: Option<ZipWriter<BlobParts>>,
    ) {
        if self.progress().is_some() {
            session.set_notice(Some(
                "pictures are being rendered already; wait, or stop that with the cross beside its bar".into(),
            ));
            return;
        }
        let ctx = ctx.clone();
        let Ok(mut player) = WorkerPlayer::start(move || ctx.request_repaint()) else {
            session.set_notice(Some("the browser cannot start a worker for rendering".into()));
            return;
        };
        session.added_files().iter().for_each(|(name, bytes)| player.add_file(name, bytes));
        let request = session.full_quality_request(first);
        player.request(request.clone());
        self.platform.rendering =
            Some(Rendering { player, request, stem: stem(session).to_owned(), done: 0, total, shot });
    }

    /// Number of frames rendered, and in total; `None` where nothing is rendered.
    pub(in crate::app) fn progress(&self) -> Option<[usize; 2]> {
        self.platform.rendering.as_ref().map(|rendering| [rendering.done, rendering.total])
    }

    /// Stops rendering.
    pub(in crate::app) fn stop_rendering(&mut self) {
        self.platform.rendering = None;
    }

    /// Collects rendered frames, and reports how rendering ended.
    fn poll_rendering(&mut self, session: &mut Session) {
        if let Some(ended) = self.platform.rendering.as_mut().and_then(Rendering::poll) {
            self.platform.rendering = None;
            report_end(session, ended);
        }
    }

    /// Handles received files: a scene is opened, other files are added to the open scene.
    pub(super) fn poll_platform(&mut self, ui: &Ui, session: &mut Session, selection: &Selection) {
        self.poll_rendering(session);
        self.platform.plates.poll(ui.ctx(), session);
        let dropped = ui.input(|input| input.raw.dropped_files.clone());
        dropped.into_iter().for_each(|file| browser_io::receive_dropped(file, &self.platform.inbox, ui.ctx()));
        for ReceivedFile { name, bytes } in self.platform.inbox.take() {
            if name.ends_with(".toml") {
                match String::from_utf8(bytes) {
                    Ok(text) => self.open_text(session, &name, text, None),
                    Err(_) => session.set_notice(Some(format!("{name}: is not UTF-8"))),
                }
                continue;
            }
            session.add_file(&name, bytes);
            match self.platform.relink.take() {
                Some(parameter) => session.relink(&parameter, Path::new(&name)),
                None => session.drop_file(Path::new(&name), selection),
            }
        }
    }
}

/// The document's name without its extension.
fn stem(session: &Session) -> &str {
    let name = session.document.name();
    name.strip_suffix(".toml").unwrap_or(name)
}

impl Rendering {
    /// Collects finished frames and requests the next. Returns how rendering ended, once it has.
    fn poll(&mut self) -> Option<Result<String, JobFailure>> {
        self.player.poll().into_iter().find_map(|event| match event {
            Event::FullQualityFrame { number, png } => {
                self.add_frame(number, &png).map_err(JobFailure::Failed).transpose()
            }
            Event::Checked { outcome: Err(error), .. } => {
                Some(Err(JobFailure::Failed(format!("the scene has faults: {error}"))))
            }
            Event::Failed { reason, .. } => Some(Err(JobFailure::Failed(reason))),
            Event::Panicked { message, .. } => Some(Err(JobFailure::Panicked(message))),
            Event::Checked { .. } | Event::Drawn(_) | Event::Stage(..) => None,
        })
    }

    /// Adds frame `number`. Returns a message once it was the last and the download has started.
    fn add_frame(&mut self, number: i64, png: &[u8]) -> Result<Option<String>, String> {
        let name = naming::default_picture(&self.stem, number);
        self.done += 1;
        let Some(shot) = &mut self.shot else { return save(&name, &BlobParts::new(png)).map(Some) };
        shot.add(&name, png).map_err(|error| error.to_string())?;
        if self.done < self.total {
            self.request.number = Some(number + 1);
            self.player.request(self.request.clone());
            return Ok(None);
        }
        let pictures = self.shot.take().map(ZipWriter::finish).transpose().map_err(|error| error.to_string())?;
        save(&format!("{}.zip", self.stem), &pictures.unwrap_or_default()).map(Some)
    }
}

/// Downloads a file. Returns a message for the user.
fn save(name: &str, parts: &BlobParts) -> Result<String, String> {
    match browser_io::download(name, parts) {
        Ok(()) => Ok(format!("rendered: {name}")),
        Err(_) => Err("the browser cannot save files here".into()),
    }
}
