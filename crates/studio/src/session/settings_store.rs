//! Persistent settings as named texts: files in the user's data folder, or entries of the browser's local storage.

use std::path::PathBuf;

#[cfg(not(target_arch = "wasm32"))]
use bansho::media::files::{atomic, overwrite_policy::OverwritePolicy};

/// A key-value store of texts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct SettingsStore {
    #[cfg(not(target_arch = "wasm32"))]
    home: Option<PathBuf>,
}

impl SettingsStore {
    /// A store in the folder `home`. Without one, nothing is stored.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn new(home: Option<PathBuf>) -> Self {
        Self { home }
    }

    /// A store in the browser's local storage; a page has no folders.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn new(_home: Option<PathBuf>) -> Self {
        Self {}
    }

    /// The file of the text `name`, if there is a folder.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn file(&self, name: &str) -> Option<PathBuf> {
        self.home.as_ref().map(|home| home.join(name))
    }

    /// The stored text `name`.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn read(&self, name: &str) -> Option<String> {
        std::fs::read_to_string(self.file(name)?).ok()
    }

    /// Stores `text` as `name`. Returns whether that succeeded.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn write(&self, name: &str, text: &str) -> bool {
        let policy = OverwritePolicy::any().without_links();
        self.file(name).is_none_or(|file| atomic::write_bytes(&file, text.as_bytes(), &policy).is_ok())
    }

    /// The stored text `name`.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn read(&self, name: &str) -> Option<String> {
        storage()?.get_item(&key(name)).ok()?
    }

    /// Stores `text` as `name`. Returns whether that succeeded.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn write(&self, name: &str, text: &str) -> bool {
        storage().is_some_and(|storage| storage.set_item(&key(name), text).is_ok())
    }

    /// The names of all stored texts whose first word is `prefix`, sorted.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn names(&self, prefix: &str) -> Vec<String> {
        let Some(storage) = storage() else { return Vec::new() };
        let count = storage.length().unwrap_or_default();
        let keys = (0..count).filter_map(|index| storage.key(index).ok()?);
        let names = keys.filter_map(|key_name| Some(key_name.strip_prefix(&key(""))?.to_owned()));
        let mut names: Vec<String> = names.filter(|name| name.split(' ').next() == Some(prefix)).collect();
        names.sort();
        names
    }

    /// Removes the text `name`.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn remove(&self, name: &str) {
        // A text that cannot be removed is offered for recovery again, which is harmless.
        let _ = storage().map(|storage| storage.remove_item(&key(name)));
    }
}

/// The key in the local storage. Other pages of the same origin share the storage.
#[cfg(target_arch = "wasm32")]
fn key(name: &str) -> String {
    format!("bansho-studio {name}")
}

/// The local storage of this page's origin, if the browser allows it.
#[cfg(target_arch = "wasm32")]
fn storage() -> Option<web_sys::Storage> {
    web_sys::window()?.local_storage().ok()?
}
