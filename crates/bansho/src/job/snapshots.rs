//! Snapshots on disk: the state of stepped phenomena every so many frames, so that any frame is soon reached.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use bansho_base::observer::{Observer, Stage, StageGuard};
use bansho_media::atomic;
use bansho_render::{Plan, RenderError, Shot};

use super::{
    error::JobError,
    observer::{JobObserver, Note},
};

/// Where snapshots lie and how many frames lie between them. Files are called `state.<frame>.bansho`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Snapshots {
    /// `None` where nothing has a state, or none are wanted.
    folder: Option<PathBuf>,
    first_frame: i64,
    every: u64,
    /// Frames of one turn where the shot is a loop.
    turn: Option<i64>,
}

impl Snapshots {
    /// Snapshots in `folder`, `every` so many frames from the scene's first.
    pub(super) fn new(folder: PathBuf, plan: &Plan, every: u64) -> Self {
        let frames = plan.frames();
        let turn = plan.loop_s.map(|_| frames.end - frames.start);
        Self { folder: Some(folder), first_frame: frames.start, every, turn }
    }

    /// The frame of the first turn that shows what frame `number` shows.
    fn in_turn(&self, number: i64) -> i64 {
        self.turn.map_or(number, |turn| self.first_frame + (number - self.first_frame).rem_euclid(turn))
    }

    fn path(&self, folder: &Path, number: i64) -> PathBuf {
        folder.join(format!("state.{number}.bansho"))
    }

    /// Brings `shot` nearer to frame `number` by the latest snapshot that is of use: after frame `last`, where the shot
    /// stands, and not after `number`. One that is damaged or foreign is noted and left for [`keep`](Self::keep).
    pub(super) fn seek(&self, shot: &mut dyn Shot, last: Option<i64>, number: i64, observer: &dyn JobObserver) {
        let Some(folder) = &self.folder else { return };
        let (last, number) = (last.map(|last| self.in_turn(last)), self.in_turn(number));
        let past = last.filter(|&last| last <= number).unwrap_or(i64::MIN);
        let mut candidates = match numbers(folder) {
            Ok(numbers) => numbers,
            Err(error) => {
                observer.note(&Note::SnapshotUnreadable { path: folder.clone(), reason: error.to_string() });
                return;
            }
        };
        candidates.retain(|&candidate| candidate > past && candidate <= number);
        candidates.sort_unstable();
        for candidate in candidates.into_iter().rev() {
            let path = self.path(folder, candidate);
            match fs::read(&path).map(|bytes| shot.restore(&bytes)) {
                Ok(Ok(())) => return,
                Ok(Err(reason)) => observer.note(&Note::SnapshotRefused { path, reason }),
                Err(error) => observer.note(&Note::SnapshotUnreadable { path, reason: error.to_string() }),
            }
        }
    }

    /// Writes the state at frame `number` where one is due and the very same does not lie there yet.
    pub(super) fn keep(&self, shot: &dyn Shot, number: i64, observer: &dyn Observer) -> Result<(), JobError> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let number = self.in_turn(number);
        if !number.abs_diff(self.first_frame).is_multiple_of(self.every) {
            return Ok(());
        }
        let _stage = StageGuard::begin(observer, Stage::Write);
        let (path, state) = (self.path(folder, number), shot.snapshot());
        if fs::read(&path).is_ok_and(|there| there == state) {
            return Ok(());
        }
        Ok(atomic::write_bytes(&path, &state)?)
    }
}

/// Whether any phenomenon of the plan has a state.
///
/// # Errors
/// A phenomenon cannot be made.
pub(super) fn has_state(plan: &Plan) -> Result<bool, JobError> {
    let phenomena = plan.open().map_err(RenderError::from)?;
    Ok(phenomena.iter().any(|phenomenon| phenomenon.stepping().is_some()))
}

/// Frames of which there is a snapshot; a folder that is not there has none.
fn numbers(folder: &Path) -> io::Result<Vec<i64>> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries?,
    };
    let number = |entry: io::Result<fs::DirEntry>| {
        let name = entry.ok()?.file_name();
        name.to_str()?.strip_prefix("state.")?.strip_suffix(".bansho")?.parse().ok()
    };
    Ok(entries.filter_map(number).collect())
}
