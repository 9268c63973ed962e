//! The scenes that come with the program.

/// A scene that comes with the program.
pub(crate) struct Example {
    pub(crate) name: &'static str,
    pub(crate) text: &'static str,
    pub(crate) assets: &'static [Asset],
}

/// A picture that an example names.
pub(crate) struct Asset {
    /// Relative to the scene.
    pub(crate) path: &'static str,
    pub(crate) bytes: &'static [u8],
}

include!(concat!(env!("OUT_DIR"), "/examples.rs"));

impl Example {
    /// What it says about itself: its first comment.
    pub(crate) fn about(&self) -> &'static str {
        let comment = self.text.lines().find_map(|line| line.strip_prefix('#'));
        comment.unwrap_or_default().trim()
    }
}
