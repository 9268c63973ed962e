//! Persistent settings as small named texts: files in the user's data folder, or the browser's local storage.

use std::path::PathBuf;

/// A key-value store of texts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct SettingsStore {
    #[cfg(not(target_arch = "wasm32"))]
    home: Option<PathBuf>,
}

impl SettingsStore {
    /// In `home`; nowhere without one.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn new(home: Option<PathBuf>) -> Self {
        Self { home }
    }

    /// At the browser: a page has no home.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn new(_home: Option<PathBuf>) -> Self {
        Self {}
    }

    /// The file of `name`, if there is a home.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn file(&self, name: &str) -> Option<PathBuf> {
        self.home.as_ref().map(|home| home.join(name))
    }

    /// The text `name`, if it is kept.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn read(&self, name: &str) -> Option<String> {
        std::fs::read_to_string(self.file(name)?).ok()
    }

    /// Keeps `text` as `name`; whether it could.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn write(&self, name: &str, text: &str) -> bool {
        self.file(name).is_none_or(|file| bansho::media::files::atomic::write_bytes(&file, text.as_bytes()).is_ok())
    }

    /// The text `name`, if it is kept.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn read(&self, name: &str) -> Option<String> {
        storage()?.get_item(&key(name)).ok()?
    }

    /// Keeps `text` as `name`; whether it could.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn write(&self, name: &str, text: &str) -> bool {
        storage().is_some_and(|storage| storage.set_item(&key(name), text).is_ok())
    }

    /// The names of all texts that are kept as `beginning`, or as that and more words; the first kept first.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn names(&self, beginning: &str) -> Vec<String> {
        let Some(storage) = storage() else { return Vec::new() };
        let count = storage.length().unwrap_or_default();
        let keys = (0..count).filter_map(|index| storage.key(index).ok()?);
        let names = keys.filter_map(|own| Some(own.strip_prefix(&key(""))?.to_owned()));
        let begins = |name: &String| name.split(' ').next() == Some(beginning);
        let mut names: Vec<String> = names.filter(begins).collect();
        names.sort();
        names
    }

    /// Keeps nothing as `name` any more.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn remove(&self, name: &str) {
        // What cannot be removed is offered again, which does no harm.
        let _ = storage().map(|storage| storage.remove_item(&key(name)));
    }
}

/// Other pages of the same server keep things too.
#[cfg(target_arch = "wasm32")]
fn key(name: &str) -> String {
    format!("bansho-studio {name}")
}

/// The local storage of this page's origin, where the browser grants it.
#[cfg(target_arch = "wasm32")]
fn storage() -> Option<web_sys::Storage> {
    web_sys::window()?.local_storage().ok()?
}
