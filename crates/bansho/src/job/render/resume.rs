//! Which frames of a job exist already and are complete.

use bansho_media::output::frame_file::existing_fingerprint;

use super::{metadata, prepare::PreparedJob};
use crate::job::{checks::finished_files::FinishedFiles, error::JobError};

use rayon::prelude::*;

/// What is in the file of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameState {
    /// The frame, complete.
    Whole,
    /// There is no file.
    Missing,
    /// A complete frame of another scene, of other options or of another version.
    Stale,
    /// A frame that is truncated or damaged.
    Damaged,
}

impl PreparedJob {
    /// What is in the file of each frame of a sequence.
    pub fn frame_states(&self) -> Vec<FrameState> {
        self.frames.par_iter().map(|&number| self.frame_state(number)).collect()
    }

    fn frame_state(&self, number: i64) -> FrameState {
        let path = self.format.pattern.path(number);
        let expected = self.expected_fingerprint(number);
        match existing_fingerprint(&path, self.format.pattern.kind()) {
            Some(found) if found != expected => FrameState::Stale,
            Some(_) if self.format.metadata && !metadata::exists(&path, expected) => FrameState::Missing,
            Some(_) => FrameState::Whole,
            None if path.exists() => FrameState::Damaged,
            None => FrameState::Missing,
        }
    }

    /// A digest, hexadecimal, of all that the pixels of `frames` depend on, whatever region of the picture the job draws.
    pub fn shot_digest(&self, frames: &[i64]) -> String {
        let whole = self.plan.at_size(self.plan.size());
        let assets = self.compiled.assets();
        let fingerprints: Vec<[u8; 32]> =
            frames.par_iter().map(|&number| whole.frame_fingerprint(number, assets.as_ref())).collect();
        blake3::hash(fingerprints.as_flattened()).to_hex().to_string()
    }

    /// The fingerprint in the file of frame `number`, if it is the frame of this job.
    pub fn expected_fingerprint(&self, number: i64) -> [u8; 32] {
        self.format.fingerprint(self.plan.frame_fingerprint(number, self.compiled.assets().as_ref()))
    }

    /// The frames to draw. The files of the others are recorded as finished. A frame that is truncated, damaged or of another scene is drawn
    /// again.
    pub(crate) fn missing_frames(&self, finished: &FinishedFiles) -> Vec<i64> {
        if !self.resume {
            return self.frames.clone();
        }
        let missing = self.frames.par_iter().copied().filter(|&number| {
            // Recorded before they are checked, so that a change in between is noticed at the end.
            self.format.files(&self.format.pattern.path(number)).for_each(|file| finished.record(file));
            !self.is_complete(number)
        });
        missing.collect()
    }

    /// Checks that all frames of a sequence exist and are complete. Files with the length and modification time at which they were finished are
    /// not read; only changed ones are, as those of a second program that runs the same job.
    ///
    /// # Errors
    /// Some frames are missing or incomplete.
    pub(crate) fn check_all_present(&self, finished: &FinishedFiles) -> Result<(), JobError> {
        let lost = self.frames.par_iter().copied().filter(|&number| {
            let mut files = self.format.files(&self.format.pattern.path(number));
            !files.all(|file| finished.is_unchanged(&file)) && !self.is_complete(number)
        });
        let frames: Vec<i64> = lost.collect();
        if frames.is_empty() {
            return Ok(());
        }
        Err(JobError::FramesLost { frames, files: self.format.pattern.template_path() })
    }

    /// Whether frame `number` of this job exists and is complete, with its metadata if the job writes it.
    fn is_complete(&self, number: i64) -> bool {
        let expected = self.expected_fingerprint(number);
        let path = self.format.pattern.path(number);
        existing_fingerprint(&path, self.format.pattern.kind()) == Some(expected)
            && (!self.format.metadata || metadata::exists(&path, expected))
    }
}
