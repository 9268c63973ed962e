//! Files of a page: they come by way of the browser, and go back to it.

use std::path::Path;

use bansho::render::scene::Place;
use eframe::egui::{Context, Ui};

use super::{
    Files,
    browser::{self, Inbox},
};
use crate::app::{session::Session, store::Store};

/// What the page knows of files.
pub(super) struct Shelf {
    /// Files that came by way of the browser.
    inbox: Inbox,
    /// What shall name the next file that comes.
    relink: Option<Place>,
}

impl Shelf {
    pub(super) fn new(_store: &Store) -> Self {
        Self { inbox: Inbox::default(), relink: None }
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
        let name = session.document.name().to_owned();
        let name = if name.ends_with(".toml") { name } else { format!("{name}.toml") };
        let text = session.document.text().clone();
        match browser::download(&name, &text) {
            Ok(()) => session.document.mark_saved(text),
            Err(_) => session.set_notice(Some("the browser cannot save files here".into())),
        }
    }

    /// A page has no folders.
    pub(in crate::app) fn menu(&mut self, _ui: &mut Ui, _session: &mut Session) {}

    /// A page has nowhere to write to.
    pub(in crate::app) fn render_still(&mut self, session: &mut Session) {
        session.set_notice(Some("save the scene; the program `bansho render` makes its pictures".into()));
    }

    /// Nothing is rendered here.
    pub(in crate::app) fn progress(&self) -> Option<String> {
        None
    }

    /// Takes in what the browser gave: a scene is opened, anything else laid into the one that is open.
    pub(super) fn tend_shelf(&mut self, ui: &Ui, session: &mut Session) {
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
