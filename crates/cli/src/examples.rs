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
    /// What it says about itself: the first sentence of the comment that it begins with.
    pub(crate) fn about(&self) -> String {
        let lines = self.text.lines().map_while(|line| line.strip_prefix('#'));
        let comment = lines.map(str::trim).collect::<Vec<_>>().join(" ");
        match comment.split_once(". ") {
            Some((first, _)) => format!("{first}."),
            None => comment,
        }
    }
}
