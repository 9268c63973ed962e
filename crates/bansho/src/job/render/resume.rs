//! Which frames of a job are already there, whole and its own.

use bansho_media::output::resume::existing_fingerprint;

use super::{figures, finished_files::Finished, prepare::PreparedJob};
use crate::job::error::JobError;

use rayon::prelude::*;

impl PreparedJob {
    /// The frames that are still to be drawn; the files of the others are noted as finished. A frame that is cut off, damaged or of another
    /// scene counts as missing.
    pub(crate) fn missing(&self, finished: &Finished) -> Vec<i64> {
        if !self.resume {
            return self.frames.clone();
        }
        let is_missing = |&&number: &&i64| {
            // As they are before they are looked at, so that no later change is overlooked.
            self.format.files(&self.format.pattern.path(number)).for_each(|file| finished.note(file));
            !self.is_whole(number)
        };
        self.frames.par_iter().filter(is_missing).copied().collect()
    }

    /// Whether all frames of a sequence are there and whole. What was not touched since it was finished is: no more than a look at each
    /// file's length and time. Only what was touched, as by another program that makes the same frames, is read.
    ///
    /// # Errors
    /// Some are not.
    pub(crate) fn check_all_there(&self, finished: &Finished) -> Result<(), JobError> {
        let is_lost = |&&number: &&i64| {
            let mut files = self.format.files(&self.format.pattern.path(number));
            !files.all(|file| finished.is_untouched(&file)) && !self.is_whole(number)
        };
        let frames: Vec<i64> = self.frames.par_iter().filter(is_lost).copied().collect();
        let lost = || JobError::FramesLost { frames: frames.clone(), files: self.format.pattern.template_path() };
        if frames.is_empty() { Ok(()) } else { Err(lost()) }
    }

    /// Whether frame `number` of this very job is there, with its figures if it has some.
    fn is_whole(&self, number: i64) -> bool {
        let expected = self.format.fingerprint(self.plan.frame_fingerprint(number, self.compiled.assets().as_ref()));
        let path = self.format.pattern.path(number);
        let found = existing_fingerprint(&path, self.format.pattern.kind());
        found == Some(expected) && (!self.format.figures || figures::are_there(&path, expected))
    }
}
