//! What the status line shows: the preview's frame rate, and frames that panicked.

use std::collections::BTreeSet;

use crate::document::Revision;

/// Frames of one revision of the document that panicked.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct PanickedFrames {
    revision: Option<Revision>,
    frames: BTreeSet<i64>,
    /// Whether all frames panic, as when building a phenomenon panics.
    all_frames: bool,
}

impl PanickedFrames {
    /// Records that `revision` panicked at `frame`; without one, at all frames.
    pub(crate) fn record(&mut self, revision: Revision, frame: Option<i64>) {
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

/// Frame rate of the preview: an exponential moving average of the intervals.
#[derive(Default)]
pub(crate) struct FrameRate {
    last: Option<f64>,
    mean_s: Option<f64>,
}

impl FrameRate {
    /// Records a frame at `now`, s.
    pub(crate) fn record_frame(&mut self, now: f64) {
        /// Weight of the newest interval.
        const NEWEST_WEIGHT: f64 = 0.15;
        if let Some(last) = self.last.replace(now) {
            let interval = now - last;
            self.mean_s = Some(self.mean_s.map_or(interval, |mean| mean + NEWEST_WEIGHT * (interval - mean)));
        }
    }

    /// Frames per second, after two frames.
    pub(crate) fn frames_per_s(&self) -> Option<f64> {
        self.mean_s.map(|mean| 1.0 / mean)
    }
}
