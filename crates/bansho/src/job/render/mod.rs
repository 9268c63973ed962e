//! Renders a scene to files or to a contact sheet: `bansho render`.

pub(crate) mod contact_sheet;
pub(crate) mod metadata;
pub(crate) mod output;
pub(crate) mod prepare;
pub(crate) mod resume;

use std::{path::PathBuf, sync::atomic::AtomicUsize};

use bansho_base::host::observer::{Stage, StageGuard};
use bansho_media::{
    imageops::sprite_sheet::SheetLayout,
    output::sink::{FinishedPicture, FrameSlot},
};
use bansho_render::{SceneLinear, Shot};

use super::{
    checks::{finished_files::FinishedFiles, plates},
    error::JobError,
    observer::{JobObserver, JobStarted},
    pipeline::draw_frames::draw_frames,
    sheet::TileCollector,
};
use output::FileWriter;
use prepare::PreparedJob;

/// What a job did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Summary {
    /// Frames drawn.
    pub drawn: usize,
    /// Frames that existed already and were kept.
    pub kept: usize,
    /// The file of the first frame.
    pub first_file: PathBuf,
}

impl PreparedJob {
    /// Draws and writes everything, in the caller's rayon pool.
    ///
    /// # Errors
    /// The observer canceled the job, or a frame failed; finished frames are kept, and nothing else is written. Or finished frames were removed
    /// or changed before the job ended.
    pub fn run(&self, observer: &dyn JobObserver) -> Result<Summary, JobError> {
        self.warnings.iter().for_each(|warning| observer.warning(warning));
        let finished = FinishedFiles::default();
        let numbers = self.missing_frames(&finished);
        let kept = self.frames.len() - numbers.len();
        let size = [self.plan.window().width, self.plan.window().height];
        observer.started(&JobStarted { frames: self.frames.len(), kept, size });
        let done = match &self.sheet {
            Some(sheet) => self.run_contact_sheet(sheet, observer),
            None if numbers.is_empty() => Ok(()),
            None => self.run_files(&numbers, size, &finished, observer),
        };
        let kind = self.format.pattern.kind();
        done.map_err(|error| match plates::with_position(&self.scene, error) {
            error if self.sheet.is_some() => error.for_single_file("a sheet"),
            error if !kind.is_sequence() => error.for_single_file("a video"),
            error => error,
        })?;
        if self.sheet.is_none() && kind.is_sequence() {
            self.check_all_present(&finished)?;
        }
        Ok(Summary { drawn: numbers.len(), kept, first_file: self.format.pattern.path(self.frames[0]) })
    }

    /// Steps through the shot and writes every snapshot that is due up to frame `last` and does not exist, in the caller's rayon pool. Nothing is
    /// drawn. Tells how many were written.
    ///
    /// # Errors
    /// The observer canceled the job, or a snapshot cannot be written. Those before it are kept.
    pub fn write_snapshots(&self, last: i64, observer: &dyn JobObserver) -> Result<usize, JobError> {
        let mut shot = Shot::open(self.compiled.clone(), self.plan.clone());
        self.snapshots.write_missing(&mut shot, last, observer)
    }

    fn run_files(
        &self,
        numbers: &[i64],
        size: [usize; 2],
        finished: &FinishedFiles,
        observer: &dyn JobObserver,
    ) -> Result<(), JobError> {
        let max_in_flight = (rayon::current_num_threads() + 1).max(self.drawn_at_once);
        let sink =
            self.format.open(&self.plan, self.compiled.has_opaque_plate(), numbers.len(), size, max_in_flight)?;
        let mut shot = Shot::open(self.compiled.clone(), self.plan.clone());
        let (format, drawn) = (&self.format, AtomicUsize::new(0));
        match format.display_options(&sink) {
            Some(target) => {
                let files = FileWriter { format, target, sink: &sink, max_in_flight, observer, drawn, finished };
                draw_frames(&mut shot, numbers, &self.snapshots, self.drawn_at_once, &files, observer)?;
            }
            None => {
                let target = SceneLinear;
                let files = FileWriter { format, target, sink: &sink, max_in_flight, observer, drawn, finished };
                draw_frames(&mut shot, numbers, &self.snapshots, self.drawn_at_once, &files, observer)?;
            }
        }
        Ok(sink.finish()?)
    }

    /// Draws all frames into one picture and writes it.
    fn run_contact_sheet(&self, sheet: &SheetLayout, observer: &dyn JobObserver) -> Result<(), JobError> {
        let sink = self.format.open(&self.plan, self.compiled.has_opaque_plate(), 1, sheet.size(), 1)?;
        let collector = TileCollector::new(sheet.count, observer, |frame, observer| {
            contact_sheet::tile(frame, self.contact_background, &self.format, observer)
        });
        let mut shot = Shot::open(self.compiled.clone(), self.plan.clone());
        draw_frames(&mut shot, &self.frames, &self.snapshots, self.drawn_at_once, &collector, observer)?;
        let _stage = StageGuard::begin(observer, Stage::Write);
        let picture = contact_sheet::compose_contact_sheet(&collector.into_tiles(), sheet)?;
        let fingerprint = self.contact_sheet_fingerprint();
        sink.write(FrameSlot { index: 0, number: self.frames[0] }, FinishedPicture::Display(&picture, &fingerprint))?;
        Ok(sink.finish()?)
    }

    /// The fingerprint of the sheet, which differs from that of any frame.
    fn contact_sheet_fingerprint(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        for &number in &self.frames {
            hasher.update(&self.plan.frame_fingerprint(number, self.compiled.assets().as_ref()));
        }
        hasher.update(self.contact_background.name().as_bytes());
        self.format.fingerprint(*hasher.update(b"contact sheet").finalize().as_bytes())
    }
}
