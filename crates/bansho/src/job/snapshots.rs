//! Snapshots on disk: the state of stepped phenomena every so many frames, so that any frame is soon reached.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use bansho_base::host::observer::{Observer, Stage, StageGuard};
use bansho_media::files::{atomic, file_identity::resolved, overwrite_policy::OverwritePolicy};
use bansho_render::Plan;

use super::{
    error::JobError,
    observer::{JobObserver, Note},
};
use crate::job::{checks::overwrite, render::draw_frames::FrameSource};

/// Where snapshots lie and how many frames lie between them. Files are called `state.<frame>.bansho`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Snapshots {
    /// `None` where nothing has a state, or none are wanted.
    folder: Option<PathBuf>,
    first_frame: i64,
    every: u64,
    /// Frames of one turn where the shot is a loop.
    turn: Option<i64>,
    /// Which files that are there may be written over.
    overwrite: OverwritePolicy,
}

impl Snapshots {
    /// Snapshots in `folder`, `every` so many frames from the scene's first.
    pub(crate) fn new(folder: PathBuf, plan: &Plan, every: u64, overwrite: OverwritePolicy) -> Self {
        let frames = plan.frames();
        let turn = plan.loop_s().map(|_| frames.end - frames.start);
        Self { folder: Some(folder), first_frame: frames.start, every, turn, overwrite }
    }

    /// Whether everything in the folder that is called like a snapshot may be written over: any of it that is of no use is made anew.
    ///
    /// # Errors
    /// Something is not a snapshot of Bansho, or the scene is read from it.
    pub(crate) fn check(&self) -> Result<(), JobError> {
        let Some(folder) = &self.folder else { return Ok(()) };
        // A folder that cannot be read is told when it is used.
        let mut numbers = numbers(&resolved(folder)).unwrap_or_default();
        numbers.sort_unstable();
        overwrite::check(&self.overwrite, numbers.into_iter().map(|number| self.path(folder, number)))
    }

    /// The frame of the first turn that shows what frame `number` shows.
    fn in_turn(&self, number: i64) -> i64 {
        self.turn.map_or(number, |turn| self.first_frame + (number - self.first_frame).rem_euclid(turn))
    }

    fn path(&self, folder: &Path, number: i64) -> PathBuf {
        folder.join(format!("state.{number}.bansho"))
    }

    /// Brings `shot` nearer to frame `number`: by the latest snapshot that is of use, and then to every frame before `number`
    /// of which a snapshot is due or was refused, which is kept anew. Frame `last` is where the shot stands.
    ///
    /// # Errors
    /// The observer asked to stop, or a snapshot cannot be written.
    pub(crate) fn warm_up(
        &self,
        shot: &mut dyn FrameSource,
        last: Option<i64>,
        number: i64,
        stop_on_failure: &dyn Observer,
        observer: &dyn JobObserver,
    ) -> Result<(), JobError> {
        if self.folder.is_none() {
            return Ok(());
        }
        let (last, number) = (last.map(|last| self.in_turn(last)), self.in_turn(number));
        let past = last.filter(|&last| last <= number);
        let found = {
            let _stage = StageGuard::begin(stop_on_failure, Stage::Load);
            self.seek(shot, past, number, observer)
        };
        let earliest = found.refused.iter().copied().fold(self.first_frame, i64::min);
        let first = found.restored.or(past).map_or(earliest, |stands| stands.saturating_add(1));
        for stop in (first..number).filter(|stop| self.is_due(*stop) || found.refused.contains(stop)) {
            shot.advance(stop, stop_on_failure)?;
            self.keep(shot, stop, stop_on_failure)?;
        }
        Ok(())
    }

    /// Puts `shot` at the latest snapshot after frame `past` and not after `number` that is of use. Those that are damaged or
    /// foreign are noted.
    fn seek(&self, shot: &mut dyn FrameSource, past: Option<i64>, number: i64, observer: &dyn JobObserver) -> Found {
        let mut found = Found::default();
        let Some(folder) = &self.folder else { return found };
        let mut candidates = match numbers(folder) {
            Ok(numbers) => numbers,
            Err(error) => {
                observer.note(&Note::SnapshotUnreadable { path: folder.clone(), reason: error.to_string() });
                return found;
            }
        };
        candidates.retain(|&candidate| past.is_none_or(|past| candidate > past) && candidate <= number);
        candidates.sort_unstable();
        for candidate in candidates.into_iter().rev() {
            let path = self.path(folder, candidate);
            match read(&path).map(|bytes| shot.restore(&bytes)) {
                Ok(Ok(())) => {
                    found.restored = Some(candidate);
                    return found;
                }
                Ok(Err(reason)) => observer.note(&Note::SnapshotRefused { path, reason }),
                Err(error) => observer.note(&Note::SnapshotUnreadable { path, reason: error.to_string() }),
            }
            found.refused.push(candidate);
        }
        found
    }

    /// Whether a snapshot of frame `number` is wanted.
    fn is_due(&self, number: i64) -> bool {
        number.abs_diff(self.first_frame).is_multiple_of(self.every)
    }

    /// Writes the state at frame `number` where one is due, or lies there, and it is not the very same.
    pub(crate) fn keep(&self, shot: &dyn FrameSource, number: i64, observer: &dyn Observer) -> Result<(), JobError> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let number = self.in_turn(number);
        let path = self.path(folder, number);
        if !self.is_due(number) && !path.exists() {
            return Ok(());
        }
        let _stage = StageGuard::begin(observer, Stage::Write);
        let state = shot.snapshot();
        if read(&path).is_ok_and(|there| there == state) {
            return Ok(());
        }
        Ok(atomic::write_bytes_with(&path, &state, &self.overwrite)?)
    }
}

/// What an ordinary file holds: a pipe would be waited for, a device has no end.
fn read(path: &Path) -> io::Result<Vec<u8>> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "is no ordinary file"));
    }
    fs::read(path)
}

/// What lay in the folder on the way to a frame.
#[derive(Default)]
struct Found {
    /// The frame at which the shot stands now, by its snapshot.
    restored: Option<i64>,
    /// Later ones whose snapshots are of no use.
    refused: Vec<i64>,
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

#[cfg(test)]
mod tests {
    use std::sync::{Arc, atomic::Ordering};

    use bansho_base::{host::observer::Unobserved, phenomenon::SnapshotError};
    use bansho_render::RenderError;

    use super::*;
    use crate::job::{
        error::Conflict,
        render::draw_frames::draw_frames,
        testing::{self, Counter, Finisher, Witness, plan},
    };

    fn snapshots(folder: &tempfile::TempDir) -> Snapshots {
        Snapshots::new(folder.path().join("states"), &plan(), 5, OverwritePolicy::default())
    }

    /// Draws the frames and says how many steps that took.
    fn steps(snapshots: &Snapshots, numbers: &[i64], witness: &Witness) -> usize {
        let counter = Counter { steps: Arc::default() };
        let finish = Finisher { each: |_, _| Ok(()), window: 4 };
        draw_frames(&mut counter.shot(), numbers, snapshots, &finish, witness).unwrap();
        counter.steps.load(Ordering::Relaxed)
    }

    #[test]
    fn states_are_kept_every_so_many_frames_and_spare_steps() {
        let folder = tempfile::tempdir().unwrap();
        let snapshots = snapshots(&folder);
        let all: Vec<i64> = (-4..12).collect();
        assert_eq!(steps(&snapshots, &all, &Witness::default()), 16);
        let mut there = numbers(snapshots.folder.as_deref().unwrap()).unwrap();
        there.sort_unstable();
        assert_eq!(there, [-4, 1, 6, 11]);
        // From the state at 6, and then from that at 11.
        assert_eq!(steps(&snapshots, &[8, 9, 12], &Witness::default()), 2 + 1 + 1);
        // A state before the one that was reached already is of no use.
        assert_eq!(steps(&snapshots, &[9, 11], &Witness::default()), 3);
    }

    #[test]
    fn a_damaged_state_is_told_left_for_an_earlier_one_and_made_anew() {
        let folder = tempfile::tempdir().unwrap();
        let snapshots = snapshots(&folder);
        steps(&snapshots, &(-4..9).collect::<Vec<_>>(), &Witness::default());
        let path = snapshots.path(snapshots.folder.as_deref().unwrap(), 6);
        let whole = fs::read(&path).unwrap();
        fs::write(&path, b"BANSHOSScut").unwrap();
        let witness = Witness::default();
        assert_eq!(steps(&snapshots, &[6, 7], &witness), 6, "from the state at 1");
        let reason = RenderError::Snapshot(SnapshotError::Damaged);
        assert_eq!(*witness.notes.lock().unwrap(), [Note::SnapshotRefused { path: path.clone(), reason }]);
        assert_eq!(fs::read(&path).unwrap(), whole);
    }

    #[test]
    fn what_was_refused_is_made_anew_though_its_frame_is_not_drawn() {
        let folder = tempfile::tempdir().unwrap();
        let snapshots = snapshots(&folder);
        steps(&snapshots, &(-4..9).collect::<Vec<_>>(), &Witness::default());
        // Also a state that was not due, as another job with another rhythm leaves it.
        let states = snapshots.folder.as_deref().unwrap();
        let paths = [5, 6].map(|number| snapshots.path(states, number));
        paths.iter().for_each(|path| fs::write(path, b"").unwrap());
        let witness = Witness::default();
        assert_eq!(steps(&snapshots, &[8], &witness), 7, "from the state at 1");
        assert_eq!(witness.notes.lock().unwrap().len(), 2);
        assert_eq!(paths.map(|path| fs::read(path).unwrap()), [5, 6].map(testing::state));
        let again = Witness::default();
        assert_eq!((steps(&snapshots, &[8], &again), again.notes.lock().unwrap().len()), (2, 0), "from the state at 6");
    }

    #[test]
    fn warming_up_leaves_the_states_that_are_due_on_its_way() {
        let folder = tempfile::tempdir().unwrap();
        let snapshots = snapshots(&folder);
        assert_eq!(steps(&snapshots, &[8, 13], &Witness::default()), 18);
        let mut there = numbers(snapshots.folder.as_deref().unwrap()).unwrap();
        there.sort_unstable();
        assert_eq!(there, [-4, 1, 6, 11]);
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
    fn states_of_the_renderer_bear_the_mark() {
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
    fn what_is_called_like_a_snapshot_and_is_none_stays() {
        let folder = tempfile::tempdir().unwrap();
        let mut snapshots = snapshots(&folder);
        let path = snapshots.path(snapshots.folder.as_deref().unwrap(), 6);
        snapshots.check().unwrap();
        steps(&snapshots, &(-4..9).collect::<Vec<_>>(), &Witness::default());
        snapshots.check().unwrap();
        fs::write(&path, "somebody's work").unwrap();
        let refused = snapshots.check();
        assert!(
            matches!(&refused, Err(JobError::Conflict(Conflict::Unmarked { path: file, others: 0 })) if *file == path)
        );
        snapshots.overwrite = OverwritePolicy::any();
        snapshots.check().unwrap();
        steps(&snapshots, &[8], &Witness::default());
        assert_eq!(fs::read(&path).unwrap(), testing::state(6));
    }

    #[test]
    fn a_loop_keeps_the_states_of_one_turn() {
        let folder = tempfile::tempdir().unwrap();
        let mut snapshots = snapshots(&folder);
        snapshots.turn = Some(10);
        assert_eq!([-4, 5, 6, 16, -5].map(|number| snapshots.in_turn(number)), [-4, 5, -4, -4, 5]);
        let counter = Counter { steps: Arc::default() };
        let mut shot = counter.shot();
        snapshots.keep(&shot, 6, &Unobserved).unwrap();
        assert_eq!(numbers(snapshots.folder.as_deref().unwrap()).unwrap(), [-4]);
        let witness = Witness::default();
        snapshots.warm_up(&mut shot, None, 7, &witness, &witness).unwrap();
        assert_eq!(shot.number, -5);
        // The end of a turn lies after its beginning, and frames of the next turn are those of the first.
        snapshots.warm_up(&mut shot, None, 15, &witness, &witness).unwrap();
        assert_eq!(shot.number, 1);
    }
}
