//! By which values a table follows the paper of its method to the letter.

/// How tables of a kind follow a paper.
#[derive(Clone, Copy, Debug)]
pub struct PaperSettings {
    /// Its authors.
    pub paper: &'static str,
    /// Values of the table's keys.
    pub settings: &'static [PaperSetting],
    /// Values of keys of the whole scene, such as `picture.view`.
    pub scene_settings: &'static [PaperSetting],
}

/// A key, and the values with which it follows the paper.
#[derive(Clone, Copy, Debug)]
pub struct PaperSetting {
    /// The key, with sub-tables separated by dots.
    pub key: &'static str,
    /// The values that do, in the syntax of scene files; an empty one is a key without a value.
    pub allowed: &'static [&'static str],
    /// Where the paper says so, or what the value is for: a phrase that follows the name of the paper and a comma.
    pub source: &'static str,
}

impl PaperSetting {
    /// A key and the values with which it follows the paper.
    #[must_use]
    pub const fn new(key: &'static str, allowed: &'static [&'static str], source: &'static str) -> Self {
        Self { key, allowed, source }
    }
}
