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
    /// Work of a studio that did not end well.
    pub(crate) recovered: Vec<RecoveredWork>,
    /// Such work that is open again, to be forgotten once it is kept as this studio's own.
    reopened: Vec<RecoveredWork>,
    /// When something was kept last, s.
    last_kept: f64,
    /// What was kept last: a state of the document, and whether that was unsaved.
    kept: Option<(Revision, bool)>,
    #[cfg(not(target_arch = "wasm32"))]
    autosave: Option<Autosave>,
    /// Why nothing can be kept here, until the user was told.
    #[cfg(not(target_arch = "wasm32"))]
    untold: Option<String>,
    #[cfg(target_arch = "wasm32")]
    tabs: BrowserTabs,
}

impl UnsavedWork {
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn new(store: &SettingsStore) -> Self {
        let folder = store.file(NAME);
        let begun = folder.as_deref().map(|folder| Autosave::begin(folder, "studio")).transpose();
        // Where nothing can be kept, the studio works without, and says so once there is something to keep.
        let (autosave, untold) = match begun {
            Ok(autosave) => (autosave, None),
            Err(error) => (None, Some(error.to_string())),
        };
        Self {
            recovered: folder.as_deref().map(autosave::recoverable).unwrap_or_default(),
            reopened: Vec::new(),
            last_kept: 0.0,
            kept: None,
            autosave,
            untold,
        }
    }

    #[cfg(target_arch = "wasm32")]
    pub(super) fn new(store: &SettingsStore) -> Self {
        let tabs = BrowserTabs::begin(store.clone(), NAME);
        Self { recovered: Vec::new(), reopened: Vec::new(), last_kept: 0.0, kept: None, tabs }
    }

    /// Keeps what changed, now and then; where nothing did, nothing is done and the window may rest.
    pub(super) fn poll_autosave(&mut self, ui: &Ui, session: &mut Session) {
        #[cfg(target_arch = "wasm32")]
        self.recovered.extend(self.tabs.found(ui.ctx()));
        let at_once = std::mem::take(&mut session.autosave_now);
        let present = (session.document.revision(), session.document.is_dirty());
        if self.kept == Some(present) && !at_once {
            return;
        }
        let (now, held) = ui.input(|input| (input.time, input.pointer.any_down()));
        let wait_s = self.last_kept + INTERVAL_S - now;
        // What is under a hand may pass, as wind does that blows only while it is dragged.
        if !at_once && present.1 && (held || wait_s > 0.0) {
            ui.ctx().request_repaint_after(Duration::from_secs_f64(wait_s.max(0.1)));
            return;
        }
        self.last_kept = now;
        if self.keep(session) {
            self.reopened.drain(..).for_each(|reopened| forget(&reopened));
        }
        // What cannot be kept is not tried again until it changes.
        self.kept = Some(present);
    }

    /// Whether what is unsaved is kept now.
    #[cfg(not(target_arch = "wasm32"))]
    fn keep(&mut self, session: &mut Session) -> bool {
        if session.document.is_dirty()
            && let Some(reason) = self.untold.take()
        {
            session.set_notice(Some(format!("unsaved work is not kept here, so save it now and then: {reason}")));
        }
        let kept = self.autosave.as_ref().map(|kept| kept.keep(&session.document, session.path.as_deref()));
        if let Some(Err(error)) = &kept {
            session.set_notice(Some(format!("unsaved work cannot be kept: {error}")));
        }
        matches!(kept, Some(Ok(())))
    }

    /// Whether what is unsaved is kept now.
    #[cfg(target_arch = "wasm32")]
    fn keep(&mut self, session: &mut Session) -> bool {
        let document = &session.document;
        let work = document.is_dirty().then(|| autosave::kept(document.name(), document.text()));
        let kept = self.tabs.keep(work.as_deref());
        if !kept {
            session.set_notice(Some("the browser keeps no unsaved work here; save it now and then".into()));
        }
        kept
    }

    /// Keeps what was `recovered`, and is open again, as this studio's own work from now on.
    pub(super) fn adopt(&mut self, recovered: RecoveredWork, session: &mut Session) {
        self.recovered.retain(|other| *other != recovered);
        self.reopened.push(recovered);
        session.autosave_now = true;
    }

    /// Forgets work that is not wanted.
    pub(crate) fn forget(&mut self, recovered: &RecoveredWork) {
        forget(recovered);
        self.recovered.retain(|other| other != recovered);
    }

    /// The window closed well.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn end(&mut self) {
        if let Some(autosave) = self.autosave.take() {
            autosave.end();
        }
    }

    /// Pages end without being asked.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn end(&mut self) {}
}

#[cfg(not(target_arch = "wasm32"))]
fn forget(recovered: &RecoveredWork) {
    recovered.forget();
}

#[cfg(target_arch = "wasm32")]
fn forget(recovered: &RecoveredWork) {
    SettingsStore::default().remove(&recovered.kept_in.to_string_lossy());
}
