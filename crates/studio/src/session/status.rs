//! What the status line shows: the preview's frame rate, and frames that panicked.

use std::collections::BTreeSet;

use crate::document::Revision;

/// Frames of one state of the document that panicked.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct PanickedFrames {
    revision: Option<Revision>,
    frames: BTreeSet<i64>,
    /// Whether no frame of it can be drawn, as where a phenomenon cannot even be made.
    all_frames: bool,
}

impl PanickedFrames {
    /// Notes that `revision` panicked at `frame`, or altogether.
    pub(crate) fn note(&mut self, revision: Revision, frame: Option<i64>) {
        if self.revision != Some(revision) {
            *self = Self { revision: Some(revision), ..Self::default() };
        }
        self.all_frames |= frame.is_none();
        self.frames.extend(frame);
    }

    /// Whether `frame` of `revision` panicked.
    pub(crate) fn contains(&self, revision: Revision, frame: i64) -> bool {
        self.revision == Some(revision) && (self.all_frames || self.frames.contains(&frame))
    }
}

/// Pictures a second, as they come while time passes.
#[derive(Default)]
pub(crate) struct FrameRate {
    last: Option<f64>,
    mean_s: Option<f64>,
}

impl FrameRate {
    /// A picture came at `now`, s.
    pub(crate) fn record_frame(&mut self, now: f64) {
        /// Share of the newest interval in the mean.
        const NEWEST_WEIGHT: f64 = 0.15;
        if let Some(last) = self.last.replace(now) {
            let interval = now - last;
            self.mean_s = Some(self.mean_s.map_or(interval, |mean| mean + NEWEST_WEIGHT * (interval - mean)));
        }
    }

    /// How many come a second, once two came.
    pub(crate) fn frames_per_s(&self) -> Option<f64> {
        self.mean_s.map(|mean| 1.0 / mean)
    }
}
