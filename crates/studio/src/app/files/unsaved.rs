//! Unsaved work is kept every few seconds, and offered at the next start where the studio did not end well.

use std::time::Duration;

use eframe::egui::Ui;

use crate::app::{session::Session, store::Store};
#[cfg(not(target_arch = "wasm32"))]
use crate::document::recovery::Autosave;
use crate::document::recovery::{self, Recovered};

/// Seconds between two looks at unsaved work.
const EVERY_S: f64 = 5.0;

/// Under which it is kept: a folder, or a text in the browser.
const NAME: &str = "unsaved";

/// Unsaved work, of now and of before.
pub(in crate::app) struct Unsaved {
    /// Work of a studio that did not end well.
    pub(in crate::app) recovered: Vec<Recovered>,
    last_kept: f64,
    #[cfg(not(target_arch = "wasm32"))]
    autosave: Option<Autosave>,
    #[cfg(target_arch = "wasm32")]
    store: Store,
}

impl Unsaved {
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn new(store: &Store) -> Self {
        let folder = store.file(NAME);
        Self {
            recovered: folder.as_deref().map(recovery::recoverable).unwrap_or_default(),
            last_kept: 0.0,
            // Where nothing can be kept, the studio works without.
            autosave: folder.and_then(|folder| Autosave::begin(&folder, "studio").ok()),
        }
    }

    #[cfg(target_arch = "wasm32")]
    pub(super) fn new(store: &Store) -> Self {
        let recovered = store.read(NAME).and_then(|kept| Recovered::of(&kept));
        Self { recovered: recovered.into_iter().collect(), last_kept: 0.0, store: store.clone() }
    }

    /// Looks now and then whether there is something to keep.
    pub(super) fn tend(&mut self, ui: &Ui, session: &mut Session) {
        let now = ui.input(|input| input.time);
        if now - self.last_kept < EVERY_S && !std::mem::take(&mut session.keep_now) {
            return;
        }
        self.last_kept = now;
        self.keep(session);
        if session.document.is_dirty() {
            ui.ctx().request_repaint_after(Duration::from_secs_f64(EVERY_S));
        }
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn keep(&self, session: &mut Session) {
        let kept = self.autosave.as_ref().map(|kept| kept.keep(&session.document, session.path.as_deref()));
        if let Some(Err(error)) = kept {
            session.set_notice(Some(format!("unsaved work cannot be kept: {error}")));
        }
    }

    /// What a page that was closed left there stays until it is recovered or there is other work.
    #[cfg(target_arch = "wasm32")]
    fn keep(&mut self, session: &mut Session) {
        let document = &session.document;
        if document.is_dirty() {
            if !self.store.write(NAME, &recovery::kept(document.name(), document.text())) {
                session.set_notice(Some("the browser keeps no unsaved work here; save it now and then".into()));
            }
        } else if self.recovered.is_empty() {
            self.store.forget(NAME);
        }
    }

    /// Forgets work that is open again.
    pub(in crate::app) fn forget(&mut self, recovered: &Recovered) {
        recovered.forget();
        self.recovered.retain(|other| other != recovered);
    }

    /// The window closed well.
    #[cfg(not(target_arch = "wasm32"))]
    pub(in crate::app) fn end(&mut self) {
        if let Some(autosave) = self.autosave.take() {
            autosave.end();
        }
    }

    /// Pages end without being asked.
    #[cfg(target_arch = "wasm32")]
    pub(in crate::app) fn end(&mut self) {}
}
