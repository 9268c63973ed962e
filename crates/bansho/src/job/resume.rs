//! Which frames of a job are already there, whole and its own.

use bansho_media::resume::existing_fingerprint;
use bansho_render::fingerprint;
use rayon::prelude::*;

use super::{figures, prepare::PreparedJob};

impl PreparedJob {
    /// The frames that are still to be drawn. A frame that is cut off, damaged or of another scene counts as missing.
    pub(super) fn missing(&self) -> Vec<i64> {
        if !self.resume {
            return self.frames.clone();
        }
        let is_missing = |&&number: &&i64| {
            let expected = self.format.fingerprint(fingerprint::of_frame(&self.plan, number));
            let path = self.format.pattern.path(number);
            existing_fingerprint(&path) != Some(expected) || self.format.figures && !figures::are_there(&path, expected)
        };
        self.frames.par_iter().filter(is_missing).copied().collect()
    }
}
