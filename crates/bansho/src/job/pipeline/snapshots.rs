//! Snapshots on disk: the state of stepped phenomena at regular intervals, so that a shot reaches any frame in few steps.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use bansho_base::host::observer::{Observer, Stage, StageGuard};
use bansho_media::files::{atomic, file_identity::resolved, overwrite_policy::OverwritePolicy};
use bansho_render::{Plan, RenderError};

use super::FrameSource;
use crate::job::{
    checks::outputs,
    error::JobError,
    observer::{JobObserver, Warning},
};

/// The folder of snapshots and the interval between them. Files are called `state.<frame>.bansho`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Snapshots {
    /// `None` if nothing in the scene has a state, or no snapshots were requested.
    folder: Option<PathBuf>,
    first_frame: i64,
    interval: u64,
    /// Length of the loop in frames, if the shot is a loop.
    loop_frames: Option<i64>,
    /// Which existing files may be overwritten.
    overwrite: OverwritePolicy,
}

impl Snapshots {
    /// Snapshots in `folder` at every `interval`-th frame, counted from the scene's first.
    pub(crate) fn new(folder: PathBuf, plan: &Plan, interval: u64, overwrite: OverwritePolicy) -> Self {
        let frames = plan.frames();
        let loop_frames = plan.loop_s().map(|_| frames.end - frames.start);
        Self { folder: Some(folder), first_frame: frames.start, interval, loop_frames, overwrite }
    }

    /// Checks that every file in the folder with the name of a snapshot may be overwritten, since unusable ones are replaced.
    ///
    /// # Errors
    /// A file is not a snapshot of Bansho, or the scene is read from it.
    pub(crate) fn check(&self) -> Result<(), JobError> {
        let Some(folder) = &self.folder else { return Ok(()) };
        // A folder that cannot be read is reported when it is used.
        let mut numbers = numbers(&resolved(folder)).unwrap_or_default();
        numbers.sort_unstable();
        outputs::check_overwriting(&self.overwrite, numbers.into_iter().map(|number| self.path(folder, number)))
    }

    /// The frame of the first pass through the loop that shows the same as frame `number`.
    fn wrapped_frame(&self, number: i64) -> i64 {
        self.loop_frames.map_or(number, |length| self.first_frame + (number - self.first_frame).rem_euclid(length))
    }

    fn path(&self, folder: &Path, number: i64) -> PathBuf {
        folder.join(format!("state.{number}.bansho"))
    }

    /// Advances `shot`, which is at frame `last`, toward frame `number`: restores the latest usable snapshot, then steps to each frame before
    /// `number` at which a snapshot is due or was unusable, and writes it. Returns the frames whose snapshots were reported as unusable.
    ///
    /// # Errors
    /// The observer canceled the job, or a snapshot cannot be written.
    pub(crate) fn warm_up(
        &self,
        shot: &mut dyn FrameSource,
        last: Option<i64>,
        number: i64,
        stop_on_failure: &dyn Observer,
        observer: &dyn JobObserver,
    ) -> Result<Vec<i64>, JobError> {
        if self.folder.is_none() {
            return Ok(Vec::new());
        }
        let (last, number) = (last.map(|last| self.wrapped_frame(last)), self.wrapped_frame(number));
        let past = last.filter(|&last| last <= number);
        let sought = {
            let _stage = StageGuard::begin(stop_on_failure, Stage::Load);
            self.seek(shot, past, number, observer)
        };
        let earliest = sought.unusable.iter().copied().fold(self.first_frame, i64::min);
        let first = sought.restored.or(past).map_or(earliest, |reached| reached.saturating_add(1));
        for stop in (first..number).filter(|stop| self.is_due(*stop) || sought.unusable.contains(stop)) {
            shot.advance(stop, stop_on_failure)?;
            self.save(shot, stop, &sought.unusable, stop_on_failure, observer)?;
        }
        Ok(sought.unusable)
    }

    /// Steps through a shot and writes every snapshot that is due up to frame `last` and does not exist. Returns their number.
    ///
    /// # Errors
    /// The observer canceled the job, or a snapshot cannot be written.
    pub(crate) fn write_missing(
        &self,
        shot: &mut dyn FrameSource,
        last: i64,
        observer: &dyn JobObserver,
    ) -> Result<usize, JobError> {
        let Some(folder) = &self.folder else { return Ok(0) };
        let due =
            (self.first_frame..=self.wrapped_frame(last)).step_by(usize::try_from(self.interval).unwrap_or(usize::MAX));
        let mut missing = Vec::new();
        for number in due {
            // A damaged snapshot is reported by `warm_up`.
            let is_whole = read(&self.path(folder, number)).is_ok_and(|bytes| shot.check_snapshot(&bytes).is_ok());
            if !is_whole {
                missing.push(number);
            }
        }
        let mut reached = None;
        for &number in &missing {
            // From the latest one before it, which may have been written by another job; one that is unusable is replaced.
            self.warm_up(shot, reached, number, observer, observer)?;
            shot.advance(number, observer)?;
            self.save(shot, number, &missing, observer, observer)?;
            reached = Some(number);
        }
        Ok(missing.len())
    }

    /// Restores the latest usable snapshot after frame `past` and not after `number`. Warns of those that are damaged or belong to another
    /// scene.
    fn seek(
        &self,
        shot: &mut dyn FrameSource,
        past: Option<i64>,
        number: i64,
        observer: &dyn JobObserver,
    ) -> SeekResult {
        let mut result = SeekResult::default();
        let Some(folder) = &self.folder else { return result };
        let mut candidates = match numbers(folder) {
            Ok(numbers) => numbers,
            Err(error) => {
                observer.warning(&Warning::SnapshotUnreadable { path: folder.clone(), reason: error.to_string() });
                return result;
            }
        };
        candidates.retain(|&candidate| past.is_none_or(|past| candidate > past) && candidate <= number);
        candidates.sort_unstable();
        for candidate in candidates.into_iter().rev() {
            let path = self.path(folder, candidate);
            match read(&path).map(|bytes| shot.restore(&bytes)) {
                Ok(Ok(())) => {
                    result.restored = Some(candidate);
                    return result;
                }
                Ok(Err(reason)) => observer.warning(&Warning::SnapshotRejected { path, reason }),
                Err(error) => observer.warning(&Warning::SnapshotUnreadable { path, reason: error.to_string() }),
            }
            result.unusable.push(candidate);
        }
        result
    }

    /// Whether a snapshot is due at frame `number`.
    fn is_due(&self, number: i64) -> bool {
        number.abs_diff(self.first_frame).is_multiple_of(self.interval)
    }

    /// Writes the state at frame `number` if a snapshot is due or exists there, unless the file already contains this state. Warns of a snapshot that it
    /// replaces, unless its frame is among `reported`.
    pub(crate) fn save(
        &self,
        shot: &dyn FrameSource,
        number: i64,
        reported: &[i64],
        stages: &dyn Observer,
        observer: &dyn JobObserver,
    ) -> Result<(), JobError> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let number = self.wrapped_frame(number);
        let path = self.path(folder, number);
        if !self.is_due(number) && !path.exists() {
            return Ok(());
        }
        let _stage = StageGuard::begin(stages, Stage::Write);
        let state = shot.snapshot();
        match read(&path) {
            Ok(existing) if existing == state => return Ok(()),
            Ok(existing) if !reported.contains(&number) => {
                let reason =
                    shot.check_snapshot(&existing).map_or_else(RenderError::from, |()| RenderError::ForeignSnapshot);
                observer.warning(&Warning::SnapshotRejected { path: path.clone(), reason });
            }
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound || reported.contains(&number) => {}
            Err(error) => {
                observer.warning(&Warning::SnapshotUnreadable { path: path.clone(), reason: error.to_string() });
            }
        }
        Ok(atomic::write_bytes(&path, &state, &self.overwrite)?)
    }
}

/// The contents of a regular file: reading a pipe would block, reading a device might not end.
fn read(path: &Path) -> io::Result<Vec<u8>> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "is not a regular file"));
    }
    fs::read(path)
}

/// What a search for a snapshot found.
#[derive(Default)]
struct SeekResult {
    /// The frame whose snapshot was restored.
    restored: Option<i64>,
    /// Later frames with unusable snapshots.
    unusable: Vec<i64>,
}

/// Frames that have a snapshot; none if the folder does not exist.
fn numbers(folder: &Path) -> io::Result<Vec<i64>> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries?,
    };
    let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
    Ok(names.filter_map(|name| frame_of_snapshot(&name)).collect())
}

/// The frame in the name of a snapshot.
fn frame_of_snapshot(name: &str) -> Option<i64> {
    name.strip_prefix("state.")?.strip_suffix(".bansho")?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{
        error::OptionError,
        pipeline::draw_frames::draw_frames,
        testing::{self, CountingSource, FunctionSink, RecordingObserver, plan},
    };
    use bansho_base::{host::observer::Unobserved, phenomenon::SnapshotError};

    fn snapshots(folder: &tempfile::TempDir) -> Snapshots {
        Snapshots::new(folder.path().join("states"), &plan(), 5, OverwritePolicy::default())
    }

    /// Draws the frames and returns how many steps that took.
    fn steps(snapshots: &Snapshots, numbers: &[i64], observer: &RecordingObserver) -> usize {
        let mut source = CountingSource::new();
        let sink = FunctionSink::new(|_, _| Ok(()), 4);
        draw_frames(&mut source, numbers, snapshots, 1, &sink, observer).unwrap();
        source.steps
    }

    #[test]
    fn states_are_written_at_intervals_and_save_steps() {
        let folder = tempfile::tempdir().unwrap();
        let snapshots = snapshots(&folder);
        let all: Vec<i64> = (-4..12).collect();
        assert_eq!(steps(&snapshots, &all, &RecordingObserver::default()), 16);
        let mut written = numbers(snapshots.folder.as_deref().unwrap()).unwrap();
        written.sort_unstable();
        assert_eq!(written, [-4, 1, 6, 11]);
        // From the state at 6, and then from that at 11.
        assert_eq!(steps(&snapshots, &[8, 9, 12], &RecordingObserver::default()), 2 + 1 + 1);
        // A state before the frame that was reached is not used.
        assert_eq!(steps(&snapshots, &[9, 11], &RecordingObserver::default()), 3);
    }

    #[test]
    fn missing_states_are_written_without_drawing() {
        let folder = tempfile::tempdir().unwrap();
        let snapshots = snapshots(&folder);
        let write = |last: i64, observer: &RecordingObserver| {
            let mut source = CountingSource::new();
            (snapshots.write_missing(&mut source, last, observer).unwrap(), source.steps)
        };
        // -4, 1 and 6: eleven frames.
        assert_eq!(write(8, &RecordingObserver::default()), (3, 11));
        assert_eq!(write(8, &RecordingObserver::default()), (0, 0));
        let path = |number: i64| snapshots.path(snapshots.folder.as_deref().unwrap(), number);
        // Only the gap is stepped through: from -4 to 1, and from the state at 6 to 11.
        fs::remove_file(path(1)).unwrap();
        assert_eq!(write(11, &RecordingObserver::default()), (2, 5 + 5));
        assert_eq!([-4, 1, 6, 11].map(|number| fs::read(path(number)).unwrap()), [-4, 1, 6, 11].map(testing::state));
        // A damaged snapshot before a missing one is replaced, and reported once.
        fs::write(path(6), b"").unwrap();
        fs::remove_file(path(11)).unwrap();
        let observer = RecordingObserver::default();
        assert_eq!(write(11, &observer), (2, 10), "from the state at 1");
        assert_eq!(observer.warnings.lock().unwrap().len(), 1);
        assert_eq!(fs::read(path(6)).unwrap(), testing::state(6));
        let stopped = RecordingObserver::default();
        stopped.stop.store(true, std::sync::atomic::Ordering::Relaxed);
        fs::remove_file(path(11)).unwrap();
        assert!(snapshots.write_missing(&mut CountingSource::new(), 11, &stopped).is_err());
    }

    #[test]
    fn a_damaged_state_is_reported_skipped_and_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let snapshots = snapshots(&folder);
        steps(&snapshots, &(-4..9).collect::<Vec<_>>(), &RecordingObserver::default());
        let path = snapshots.path(snapshots.folder.as_deref().unwrap(), 6);
        let whole = fs::read(&path).unwrap();
        fs::write(&path, b"BANSHOSScut").unwrap();
        let observer = RecordingObserver::default();
        assert_eq!(steps(&snapshots, &[6, 7], &observer), 6, "from the state at 1");
        let reason = RenderError::Snapshot(SnapshotError::Damaged);
        assert_eq!(*observer.warnings.lock().unwrap(), [Warning::SnapshotRejected { path: path.clone(), reason }]);
        assert_eq!(fs::read(&path).unwrap(), whole);
    }

    #[test]
    fn a_damaged_state_that_is_replaced_on_the_way_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let snapshots = snapshots(&folder);
        let frames: Vec<i64> = (-4..9).collect();
        steps(&snapshots, &frames, &RecordingObserver::default());
        let path = snapshots.path(snapshots.folder.as_deref().unwrap(), 6);
        for (contents, reason) in [
            (b"BANSHOSScut".to_vec(), RenderError::Snapshot(SnapshotError::Damaged)),
            (testing::state(5), RenderError::ForeignSnapshot),
        ] {
            fs::write(&path, contents).unwrap();
            let observer = RecordingObserver::default();
            steps(&snapshots, &frames, &observer);
            assert_eq!(*observer.warnings.lock().unwrap(), [Warning::SnapshotRejected { path: path.clone(), reason }]);
            assert_eq!(fs::read(&path).unwrap(), testing::state(6));
        }
    }

    #[test]
    fn an_unusable_state_is_replaced_though_its_frame_is_not_drawn() {
        let folder = tempfile::tempdir().unwrap();
        let snapshots = snapshots(&folder);
        steps(&snapshots, &(-4..9).collect::<Vec<_>>(), &RecordingObserver::default());
        // Also a state that was not due, as a job with another interval leaves it.
        let states = snapshots.folder.as_deref().unwrap();
        let paths = [5, 6].map(|number| snapshots.path(states, number));
        paths.iter().for_each(|path| fs::write(path, b"").unwrap());
        let observer = RecordingObserver::default();
        assert_eq!(steps(&snapshots, &[8], &observer), 7, "from the state at 1");
        assert_eq!(observer.warnings.lock().unwrap().len(), 2);
        assert_eq!(paths.map(|path| fs::read(path).unwrap()), [5, 6].map(testing::state));
        let again = RecordingObserver::default();
        assert_eq!(
            (steps(&snapshots, &[8], &again), again.warnings.lock().unwrap().len()),
            (2, 0),
            "from the state at 6"
        );
    }

    #[test]
    fn warming_up_writes_the_states_that_are_due_before_its_frame() {
        let folder = tempfile::tempdir().unwrap();
        let snapshots = snapshots(&folder);
        assert_eq!(steps(&snapshots, &[8, 13], &RecordingObserver::default()), 18);
        let mut written = numbers(snapshots.folder.as_deref().unwrap()).unwrap();
        written.sort_unstable();
        assert_eq!(written, [-4, 1, 6, 11]);
    }

    #[test]
    fn other_files_in_the_folder_are_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["state..bansho", "state.x.bansho", "state.5", "notes.txt"] {
            fs::write(folder.path().join(name), b"mine").unwrap();
        }
        assert_eq!(numbers(folder.path()).unwrap(), Vec::<i64>::new());
        assert_eq!(numbers(&folder.path().join("gone")).unwrap(), Vec::<i64>::new());
    }

    #[test]
    #[cfg(feature = "fire")]
    fn states_of_the_renderer_carry_the_mark() {
        use std::sync::Arc;

        use bansho_base::host::assets::MemoryAssets;
        use bansho_media::files::provenance;
        use bansho_render::{PlanOptions, Shot};

        let assets = Arc::new(MemoryAssets::default());
        let text = "bansho = 2\n[[flame_particles]]\nparticles = 60\n";
        let compiled = crate::compile_scene("test", text, assets).unwrap();
        let plan = Plan::new(&compiled, &PlanOptions::default()).unwrap();
        let shot = Shot::open(compiled, Arc::new(plan));
        assert!(shot.snapshot().starts_with(&provenance::SNAPSHOT_MAGIC));
    }

    #[test]
    fn a_foreign_file_with_the_name_of_a_snapshot_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let mut snapshots = snapshots(&folder);
        let path = snapshots.path(snapshots.folder.as_deref().unwrap(), 6);
        snapshots.check().unwrap();
        steps(&snapshots, &(-4..9).collect::<Vec<_>>(), &RecordingObserver::default());
        snapshots.check().unwrap();
        fs::write(&path, "somebody's work").unwrap();
        let refused = snapshots.check();
        assert!(
            matches!(&refused, Err(JobError::Option(OptionError::NotMadeByBansho { path: file, others: 0 })) if *file == path)
        );
        snapshots.overwrite = OverwritePolicy::any();
        snapshots.check().unwrap();
        steps(&snapshots, &[8], &RecordingObserver::default());
        assert_eq!(fs::read(&path).unwrap(), testing::state(6));
    }

    #[test]
    fn a_loop_writes_the_states_of_one_pass() {
        let folder = tempfile::tempdir().unwrap();
        let mut snapshots = snapshots(&folder);
        snapshots.loop_frames = Some(10);
        assert_eq!([-4, 5, 6, 16, -5].map(|number| snapshots.wrapped_frame(number)), [-4, 5, -4, -4, 5]);
        let mut shot = CountingSource::new();
        snapshots.save(&shot, 6, &[], &Unobserved, &Unobserved).unwrap();
        assert_eq!(numbers(snapshots.folder.as_deref().unwrap()).unwrap(), [-4]);
        let observer = RecordingObserver::default();
        snapshots.warm_up(&mut shot, None, 7, &observer, &observer).unwrap();
        assert_eq!(shot.number, -5);
        // The frames of the second pass are those of the first.
        snapshots.warm_up(&mut shot, None, 15, &observer, &observer).unwrap();
        assert_eq!(shot.number, 1);
    }
}
