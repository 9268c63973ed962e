//! Autosave: unsaved work is stored every few seconds while it changes, and offered at the next start after a crash.

use std::time::Duration;

use eframe::egui::Ui;

#[cfg(target_arch = "wasm32")]
use super::browser_tabs::BrowserTabs;
#[cfg(not(target_arch = "wasm32"))]
use crate::document::files::autosave::Autosave;
use crate::{
    document::{
        Revision,
        files::autosave::{self, RecoveredWork},
    },
    session::{Session, settings_store::SettingsStore},
};

/// Seconds between two autosaves.
const INTERVAL_S: f64 = 5.0;

/// The folder of autosaves, or the prefix of their names in the browser.
const NAME: &str = "unsaved";

/// The autosave of this session, and recovered work of others.
pub(crate) struct UnsavedWork {
    /// Work of studios that crashed.
    pub(crate) recovered: Vec<RecoveredWork>,
    /// Recovered work that is open, to be discarded once it is saved as this studio's own.
    reopened: Vec<RecoveredWork>,
    /// The time of the last autosave, s.
    last_saved_s: f64,
    /// The last autosave: the revision of the document, and whether it was unsaved.
    saved: Option<(Revision, bool)>,
    #[cfg(not(target_arch = "wasm32"))]
    autosave: Option<Autosave>,
    /// Why autosave does not work, until the user was warned.
    #[cfg(not(target_arch = "wasm32"))]
    pending_warning: Option<String>,
    #[cfg(target_arch = "wasm32")]
    tabs: BrowserTabs,
}

impl UnsavedWork {
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn new(store: &SettingsStore) -> Self {
        let folder = store.file(NAME);
        let begun = folder.as_deref().map(|folder| Autosave::begin(folder, "studio")).transpose();
        // Without autosave the studio warns once there is unsaved work.
        let (autosave, pending_warning) = match begun {
            Ok(autosave) => (autosave, None),
            Err(error) => (None, Some(error.to_string())),
        };
        Self {
            recovered: folder.as_deref().map(autosave::recoverable).unwrap_or_default(),
            reopened: Vec::new(),
            last_saved_s: 0.0,
            saved: None,
            autosave,
            pending_warning,
        }
    }

    #[cfg(target_arch = "wasm32")]
    pub(super) fn new(store: &SettingsStore) -> Self {
        let tabs = BrowserTabs::begin(store.clone(), NAME);
        Self { recovered: Vec::new(), reopened: Vec::new(), last_saved_s: 0.0, saved: None, tabs }
    }

    /// Saves unsaved work at intervals if it changed; otherwise no repaint is requested.
    pub(super) fn poll_autosave(&mut self, ui: &Ui, session: &mut Session) {
        #[cfg(target_arch = "wasm32")]
        self.recovered.extend(self.tabs.take_found(ui.ctx()));
        let at_once = std::mem::take(&mut session.autosave_now);
        let current = (session.document.revision(), session.document.is_dirty());
        if self.saved == Some(current) && !at_once {
            return;
        }
        let (now, is_down) = ui.input(|input| (input.time, input.pointer.any_down()));
        let wait_s = self.last_saved_s + INTERVAL_S - now;
        // A drag may be temporary, as that of the wind is.
        if !at_once && current.1 && (is_down || wait_s > 0.0) {
            ui.ctx().request_repaint_after(Duration::from_secs_f64(wait_s.max(0.1)));
            return;
        }
        self.last_saved_s = now;
        if self.save(session) {
            self.reopened.drain(..).for_each(|reopened| discard(&reopened));
        }
        // After an error, the next attempt is made after the next change.
        self.saved = Some(current);
    }

    /// Saves unsaved work. Returns whether that succeeded.
    #[cfg(not(target_arch = "wasm32"))]
    fn save(&mut self, session: &mut Session) -> bool {
        if session.document.is_dirty()
            && let Some(reason) = self.pending_warning.take()
        {
            session.set_notice(Some(format!("unsaved work is not kept here, so save it now and then: {reason}")));
        }
        let saved = self.autosave.as_ref().map(|autosave| autosave.save(&session.document, session.path.as_deref()));
        if let Some(Err(error)) = &saved {
            session.set_notice(Some(format!("unsaved work cannot be kept: {error}")));
        }
        matches!(saved, Some(Ok(())))
    }

    /// Saves unsaved work. Returns whether that succeeded.
    #[cfg(target_arch = "wasm32")]
    fn save(&mut self, session: &mut Session) -> bool {
        let document = &session.document;
        let work = document.is_dirty().then(|| autosave::encode(document.name(), document.text()));
        let saved = self.tabs.store(work.as_deref());
        if !saved {
            session.set_notice(Some("the browser keeps no unsaved work here; save it now and then".into()));
        }
        saved
    }

    /// Treats `recovered`, which was opened, as this studio's own work.
    pub(super) fn adopt(&mut self, recovered: RecoveredWork, session: &mut Session) {
        self.recovered.retain(|other| *other != recovered);
        self.reopened.push(recovered);
        session.autosave_now = true;
    }

    /// Discards recovered work.
    pub(crate) fn discard(&mut self, recovered: &RecoveredWork) {
        discard(recovered);
        self.recovered.retain(|other| other != recovered);
    }

    /// Removes the autosave when the window closes.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn end(&mut self) {
        if let Some(autosave) = self.autosave.take() {
            autosave.end();
        }
    }

    /// Web pages are closed without a call.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn end(&mut self) {}
}

#[cfg(not(target_arch = "wasm32"))]
fn discard(recovered: &RecoveredWork) {
    recovered.discard();
}

#[cfg(target_arch = "wasm32")]
fn discard(recovered: &RecoveredWork) {
    SettingsStore::default().remove(&recovered.stored_as.to_string_lossy());
}
