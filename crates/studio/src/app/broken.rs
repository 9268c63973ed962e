//! What panicked, which is not drawn again unless that is asked for.

use std::collections::BTreeSet;

use crate::document::Revision;

/// Frames of one state of the document that panicked.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Broken {
    of: Option<Revision>,
    frames: BTreeSet<i64>,
    /// Whether no frame of it can be drawn, as where a phenomenon cannot even be made.
    whole: bool,
}

impl Broken {
    /// Notes that `revision` panicked at `frame`, or altogether.
    pub(crate) fn note(&mut self, revision: Revision, frame: Option<i64>) {
        if self.of != Some(revision) {
            *self = Self { of: Some(revision), ..Self::default() };
        }
        self.whole |= frame.is_none();
        self.frames.extend(frame);
    }

    /// Whether `frame` of `revision` panicked.
    pub(crate) fn holds(&self, revision: Revision, frame: i64) -> bool {
        self.of == Some(revision) && (self.whole || self.frames.contains(&frame))
    }
}
