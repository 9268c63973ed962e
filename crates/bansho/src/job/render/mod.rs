//! Carrying out a prepared job.

pub(crate) mod draw_frames;
pub(crate) mod figures;
pub(crate) mod finished_files;
pub(crate) mod in_flight;
pub(crate) mod output;
pub(crate) mod prepare;
pub(crate) mod resume;

use std::{path::PathBuf, sync::atomic::AtomicUsize};

use bansho_render::Shot;

use super::{
    error::JobError,
    observer::{JobObserver, Outline},
};
use crate::job::{checks::plates, flipbook::contact_sheet};
use draw_frames::draw_frames;
use finished_files::Finished;
use output::ToFiles;
use prepare::PreparedJob;

/// What a job did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Summary {
    /// Frames drawn.
    pub drawn: usize,
    /// Frames that were there already.
    pub kept: usize,
    /// The first file that it wrote or would have written.
    pub first_file: PathBuf,
}

impl PreparedJob {
    /// Draws and writes everything, in the caller's rayon pool.
    ///
    /// # Errors
    /// The observer asked to stop, or the first failure of a frame. Frames that were finished by then stay, whole;
    /// nothing else does. Frames that were finished and are there no longer, or not whole, when all are.
    pub fn run(&self, observer: &dyn JobObserver) -> Result<Summary, JobError> {
        self.notes.iter().for_each(|note| observer.note(note));
        let finished = Finished::default();
        let numbers = self.missing(&finished);
        let kept = self.frames.len() - numbers.len();
        let size = [self.plan.window().width, self.plan.window().height];
        observer.started(&Outline { total: self.frames.len(), kept, size });
        let done = match &self.sheet {
            Some(sheet) => contact_sheet::run(self, sheet, observer),
            None if numbers.is_empty() => Ok(()),
            None => self.run_files(&numbers, size, &finished, observer),
        };
        let kind = self.format.pattern.kind();
        done.map_err(|error| match plates::located(&self.scene, error) {
            error if self.sheet.is_some() => error.of_whole("a sheet"),
            error if !kind.is_sequence() => error.of_whole("a film"),
            error => error,
        })?;
        if self.sheet.is_none() && kind.is_sequence() {
            self.check_all_there(&finished)?;
        }
        Ok(Summary { drawn: numbers.len(), kept, first_file: self.format.pattern.path(self.frames[0]) })
    }

    fn run_files(
        &self,
        numbers: &[i64],
        size: [usize; 2],
        finished: &Finished,
        observer: &dyn JobObserver,
    ) -> Result<(), JobError> {
        let window = rayon::current_num_threads() + 1;
        let sink = self.format.open(&self.plan, numbers.len(), size, window)?;
        let files = ToFiles { format: &self.format, sink, window, observer, drawn: AtomicUsize::new(0), finished };
        let mut shot = Shot::open(self.compiled.clone(), self.plan.clone());
        draw_frames(&mut shot, numbers, &self.snapshots, &files, observer)?;
        Ok(files.sink.finish()?)
    }
}
