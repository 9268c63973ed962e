//! Files of a page: they come by way of the browser, and go back to it.

use std::path::Path;

use bansho::{
    media::{naming, zip::Zip},
    render::scene::Place,
};

use super::{
    Files,
    browser_io::{self, Inbox, Parts},
    questions::Leaving,
    tell_end,
};
use crate::{
    app::panels::scene::Subject,
    player::{Event, Player, Wish, WorkerPlayer, render_job::Ended},
    session::{Session, settings_store::Store},
};
use eframe::egui::{Context, Ui};

/// What the page knows of files.
pub(super) struct Shelf {
    /// Files that came by way of the browser.
    inbox: Inbox,
    /// What shall name the next file that comes.
    relink: Option<Place>,
    rendering: Option<Rendering>,
}

/// Finished pictures under way, in a worker of their own, so that the window's go on meanwhile.
struct Rendering {
    player: WorkerPlayer,
    /// For the picture that is made now.
    wish: Wish,
    /// What the scene is called.
    stem: String,
    done: usize,
    total: usize,
    /// Where the pictures of a shot are gathered.
    shot: Option<Zip<Parts>>,
}

impl Shelf {
    pub(super) fn new(_store: &Store) -> Self {
        Self { inbox: Inbox::default(), relink: None, rendering: None }
    }
}

impl Files {
    /// Asks which file to open.
    pub(in crate::app) fn ask_to_open(&mut self, ctx: &Context, session: &mut Session) {
        self.shelf.relink = None;
        self.ask_for_file(ctx, session);
    }

    /// Asks which file `place` shall name.
    pub(in crate::app) fn ask_to_relink(&mut self, ctx: &Context, session: &mut Session, place: Place) {
        self.shelf.relink = Some(place);
        self.ask_for_file(ctx, session);
    }

    fn ask_for_file(&self, ctx: &Context, session: &mut Session) {
        if browser_io::ask_for_file(&self.shelf.inbox, ctx).is_err() {
            session.set_notice(Some("the browser cannot ask for files here".into()));
        }
    }

    /// Hands the scene to the browser, which saves it where it saves what it is given.
    pub(in crate::app) fn save(&mut self, session: &mut Session) {
        self.save_and(session, None);
    }

    /// Saves, and goes to `leaving` once that is done.
    pub(super) fn save_and(&mut self, session: &mut Session, leaving: Option<Leaving>) {
        let text = session.document.text().clone();
        match browser_io::download(&format!("{}.toml", stem(session)), &Parts::of(text.as_bytes())) {
            Ok(()) => {
                session.document.mark_saved(text);
                leaving.into_iter().for_each(|leaving| self.leave(session, leaving));
            }
            Err(_) => session.set_notice(Some("the browser cannot save files here".into())),
        }
    }

    /// What the menu has for files of a page.
    pub(in crate::app) fn menu(&mut self, ui: &mut Ui, session: &mut Session) {
        ui.separator();
        if ui.button("Render still").on_hover_text("The finished picture of this frame, as a PNG").clicked() {
            self.render_still(ui.ctx(), session);
        }
        if ui.button("Render shot").on_hover_text("The finished pictures of all frames, as PNGs in a ZIP").clicked() {
            self.render_shot(ui.ctx(), session);
        }
    }

    /// Makes the present frame as `bansho render` does, to be saved once it is there.
    pub(in crate::app) fn render_still(&mut self, ctx: &Context, session: &mut Session) {
        let number = session.transport.number();
        self.render(ctx, session, number, 1, None);
    }

    /// Makes all frames as `bansho render` does, to be saved together once they are there.
    pub(in crate::app) fn render_shot(&mut self, ctx: &Context, session: &mut Session) {
        let frames = session.transport.frames();
        let total = (frames.end() - frames.start() + 1) as usize;
        self.render(ctx, session, *frames.start(), total, Some(Zip::new(Parts::default())));
    }

    /// Makes `total` frames from `first` on as `bansho render` does; those of a `shot` are saved together.
    fn render(&mut self, ctx: &Context, session: &mut Session, first: i64, total: usize, shot: Option<Zip<Parts>>) {
        if self.progress().is_some() {
            session.set_notice(Some(
                "pictures are being rendered already; wait, or stop that with the cross beside its bar".into(),
            ));
            return;
        }
        let ctx = ctx.clone();
        let Ok(mut player) = WorkerPlayer::start(move || ctx.request_repaint()) else {
            session.set_notice(Some("the browser gives no worker to render in".into()));
            return;
        };
        session.given().iter().for_each(|(name, bytes)| player.give(name, bytes));
        let wish = session.finished(first);
        player.wish(wish.clone());
        self.shelf.rendering = Some(Rendering { player, wish, stem: stem(session).to_owned(), done: 0, total, shot });
    }

    /// Frames that are rendered, and all; `None` where nothing is.
    pub(in crate::app) fn progress(&self) -> Option<[usize; 2]> {
        self.shelf.rendering.as_ref().map(|rendering| [rendering.done, rendering.total])
    }

    /// Stops what is rendered.
    pub(in crate::app) fn stop_rendering(&mut self) {
        self.shelf.rendering = None;
    }

    /// Takes in finished pictures, and tells how rendering ended.
    fn tend_rendering(&mut self, session: &mut Session) {
        if let Some(ended) = self.shelf.rendering.as_mut().and_then(Rendering::tend) {
            self.shelf.rendering = None;
            tell_end(session, ended);
        }
    }

    /// Takes in what the browser gave: a scene is opened, anything else laid into the one that is open.
    pub(super) fn tend_shelf(&mut self, ui: &Ui, session: &mut Session, subject: &Subject) {
        self.tend_rendering(session);
        let dropped = ui.input(|input| input.raw.dropped_files.clone());
        dropped.into_iter().for_each(|file| browser_io::take_dropped(file, &self.shelf.inbox, ui.ctx()));
        let given = self.shelf.inbox.take();
        for (name, bytes) in given {
            if name.ends_with(".toml") {
                match String::from_utf8(bytes) {
                    Ok(text) => self.open_text(session, &name, text, None),
                    Err(_) => session.set_notice(Some(format!("{name}: is not UTF-8"))),
                }
                continue;
            }
            session.give(&name, bytes);
            match self.shelf.relink.take() {
                Some(place) => session.relink(&place, Path::new(&name)),
                None => session.lay_over(Path::new(&name), subject),
            }
        }
    }
}

/// The document's name without its ending.
fn stem(session: &Session) -> &str {
    let name = session.document.name();
    name.strip_suffix(".toml").unwrap_or(name)
}

impl Rendering {
    /// Takes in what was finished and asks for what comes next; how it ended, once it has.
    fn tend(&mut self) -> Option<Result<String, Ended>> {
        self.player.poll().into_iter().find_map(|event| match event {
            Event::Still { number, png } => self.take(number, &png).map_err(Ended::Failed).transpose(),
            Event::Judged { outcome: Err(error), .. } => {
                Some(Err(Ended::Failed(format!("the scene has faults: {error}"))))
            }
            Event::Failed { reason, .. } => Some(Err(Ended::Failed(reason))),
            Event::Panicked { message, .. } => Some(Err(Ended::Panicked(message))),
            Event::Judged { .. } | Event::Drawn(_) | Event::Stage(..) => None,
        })
    }

    /// Takes in the picture of frame `number`; what was saved, once that was the last.
    fn take(&mut self, number: i64, png: &[u8]) -> Result<Option<String>, String> {
        let name = naming::picture(&self.stem, number);
        self.done += 1;
        let Some(shot) = &mut self.shot else { return save(&name, &Parts::of(png)).map(Some) };
        shot.add(&name, png).map_err(|error| error.to_string())?;
        if self.done < self.total {
            self.wish.number = Some(number + 1);
            self.player.wish(self.wish.clone());
            return Ok(None);
        }
        let pictures = self.shot.take().map(Zip::finish).transpose().map_err(|error| error.to_string())?;
        save(&format!("{}.zip", self.stem), &pictures.unwrap_or_default()).map(Some)
    }
}

/// Hands a file to the browser; what the user is told.
fn save(name: &str, parts: &Parts) -> Result<String, String> {
    match browser_io::download(name, parts) {
        Ok(()) => Ok(format!("rendered: {name}")),
        Err(_) => Err("the browser cannot save files here".into()),
    }
}
