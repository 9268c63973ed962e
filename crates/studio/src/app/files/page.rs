//! Files of a page: they come by way of the browser, and go back to it.

use std::path::Path;

use bansho::render::scene::Place;
use eframe::egui::{Context, Ui};

use super::{
    Files,
    browser::{self, Inbox},
};
use crate::{
    app::{session::Session, store::Store},
    player::{Event, Player, WorkerPlayer},
};

/// What the page knows of files.
pub(super) struct Shelf {
    /// Files that came by way of the browser.
    inbox: Inbox,
    /// What shall name the next file that comes.
    relink: Option<Place>,
    /// Makes a finished picture, in a worker of its own, so that the window's pictures go on meanwhile.
    finishing: Option<WorkerPlayer>,
}

impl Shelf {
    pub(super) fn new(_store: &Store) -> Self {
        Self { inbox: Inbox::default(), relink: None, finishing: None }
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
        if browser::ask_for_file(&self.shelf.inbox, ctx).is_err() {
            session.set_notice(Some("the browser cannot ask for files here".into()));
        }
    }

    /// Hands the scene to the browser, which saves it where it saves what it is given.
    pub(in crate::app) fn save(&mut self, session: &mut Session) {
        let text = session.document.text().clone();
        match browser::download(&format!("{}.toml", stem(session)), text.as_bytes()) {
            Ok(()) => session.document.mark_saved(text),
            Err(_) => session.set_notice(Some("the browser cannot save files here".into())),
        }
    }

    /// What the menu has for files of a page.
    pub(in crate::app) fn menu(&mut self, ui: &mut Ui, session: &mut Session) {
        ui.separator();
        if ui.button("Render still").on_hover_text("The finished picture of this frame, as a PNG").clicked() {
            self.render_still(ui.ctx(), session);
        }
        if self.shelf.finishing.is_some() && ui.button("Stop rendering").clicked() {
            self.shelf.finishing = None;
        }
    }

    /// Makes the present frame as `bansho render` does, to be saved once it is there.
    pub(in crate::app) fn render_still(&mut self, ctx: &Context, session: &mut Session) {
        let ctx = ctx.clone();
        let Ok(mut player) = WorkerPlayer::start(move || ctx.request_repaint()) else {
            session.set_notice(Some("the browser gives no worker to render in".into()));
            return;
        };
        session.given().iter().for_each(|(name, bytes)| player.give(name, bytes));
        player.wish(session.still());
        self.shelf.finishing = Some(player);
    }

    /// What goes on, for the status line.
    pub(in crate::app) fn progress(&self) -> Option<String> {
        self.shelf.finishing.as_ref().map(|_| "rendering the still…".into())
    }

    /// Hands a finished picture to the browser.
    fn take_still(&mut self, session: &mut Session) {
        let Some(player) = &mut self.shelf.finishing else { return };
        let notice = player.poll().into_iter().find_map(|event| match event {
            Event::Still { number, png } => Some(match browser::download(&still_name(session, number), &png) {
                Ok(()) => format!("rendered: {}", still_name(session, number)),
                Err(_) => "the browser cannot save files here".into(),
            }),
            Event::Judged { outcome: Err(error), .. } => Some(format!("the scene has faults: {error}")),
            Event::Failed { reason, .. } | Event::Panicked { message: reason, .. } => Some(reason),
            Event::Judged { .. } | Event::Drawn(_) | Event::Stage(..) => None,
        });
        if notice.is_some() {
            self.shelf.finishing = None;
            session.set_notice(notice);
        }
    }

    /// Takes in what the browser gave: a scene is opened, anything else laid into the one that is open.
    pub(super) fn tend_shelf(&mut self, ui: &Ui, session: &mut Session) {
        self.take_still(session);
        let dropped = ui.input(|input| input.raw.dropped_files.clone());
        dropped.into_iter().for_each(|file| browser::take_dropped(file, &self.shelf.inbox, ui.ctx()));
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
                None => session.lay_over(Path::new(&name)),
            }
        }
    }
}

/// The document's name without its ending.
fn stem(session: &Session) -> &str {
    let name = session.document.name();
    name.strip_suffix(".toml").unwrap_or(name)
}

/// What `bansho render` calls the picture of frame `number`.
fn still_name(session: &Session, number: i64) -> String {
    format!("{}.{number:04}.png", stem(session))
}
