//! Frames that are drawn and not yet written. Their number is bounded, so that memory does not grow. They are written in order, and if several fail, the error of the earliest frame is
//! kept.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{
        Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use bansho_base::{
    frame::Frame,
    host::observer::{Observer, Stage, StagePart},
};
use bansho_media::MediaError;

use crate::job::{error::JobError, observer::JobObserver};

/// Frames that are drawn and not yet written.
#[derive(Default)]
pub(crate) struct InFlightFrames {
    state: Mutex<State>,
    completed: Condvar,
    failed: AtomicBool,
}

#[derive(Default)]
struct State {
    unfinished: BTreeSet<usize>,
    /// Those of them whose light is in memory.
    with_light: BTreeSet<usize>,
    /// The failure that is told, and the index of its frame.
    error: Option<(usize, JobError)>,
    recycled: Option<Frame>,
}

/// Longest time that a thread without work sleeps before it checks again; a completed frame wakes it earlier.
const IDLE_WAIT: Duration = Duration::from_millis(1);

impl InFlightFrames {
    fn lock(&self) -> MutexGuard<'_, State> {
        // The lock is only held for inserts and removals, so the state is valid even if a thread panicked.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until frame `index` is less than `limit` ahead of the oldest unfinished one, and executes tasks of the pool in the meantime:
    /// in a pool of one thread no other thread does. The distance is counted in indices, so that the window of a video never overflows.
    /// `keeps_light` says whether the light of this frame is in memory.
    pub(crate) fn submit(&self, index: usize, limit: usize, keeps_light: bool) {
        let mut state = self.wait_until(|state| index < state.unfinished.first().copied().unwrap_or(index) + limit);
        state.unfinished.insert(index);
        if keeps_light {
            state.with_light.insert(index);
        }
    }

    /// Waits until the light of fewer than `max` frames is in memory, so that another one can be drawn, and executes tasks of the pool in the
    /// meantime.
    pub(crate) fn wait_for_light(&self, max: usize) {
        drop(self.wait_until(|state| state.with_light.len() < max));
    }

    fn wait_until(&self, is_reached: impl Fn(&State) -> bool) -> MutexGuard<'_, State> {
        loop {
            let state = self.lock();
            if is_reached(&state) {
                return state;
            }
            drop(state);
            if rayon::yield_now() != Some(rayon::Yield::Executed) {
                let state = self.lock();
                drop(self.completed.wait_timeout(state, IDLE_WAIT));
            }
        }
    }

    /// Keeps frame `index`, whose light is no longer needed: the next one reuses their memory.
    pub(crate) fn recycle(&self, index: usize, frame: Frame) {
        let mut state = self.lock();
        state.with_light.remove(&index);
        state.recycled = Some(frame);
        drop(state);
        self.completed.notify_all();
    }

    /// A finished frame to reuse, if there is one.
    pub(crate) fn take_recycled(&self) -> Option<Frame> {
        self.lock().recycled.take()
    }

    /// Keeps the failure of frame `index`, unless one before it has failed, and cancels the remaining work. Other frames can fail as a consequence of it and
    /// arrive here earlier; the cause takes their place.
    pub(crate) fn fail(&self, index: usize, error: JobError) {
        let mut state = self.lock();
        let is_told = state.error.as_ref().is_none_or(|(first, told)| {
            follows_from_another(told) || (index < *first && !follows_from_another(&error))
        });
        if is_told {
            state.error = Some((index, error));
        }
        drop(state);
        self.failed.store(true, Ordering::Relaxed);
    }

    /// Whether a frame failed.
    pub(crate) fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    /// The failure of the first frame that failed, if there was one, with the number of the frame; `numbers` are those of all frames.
    pub(crate) fn take_error(&self, numbers: &[i64]) -> Option<JobError> {
        self.lock().error.take().map(|(index, error)| error.in_frame(numbers[index]))
    }
}

/// Whether a failure only says that another one came before it.
fn follows_from_another(error: &JobError) -> bool {
    matches!(error, JobError::Cancelled | JobError::Media(MediaError::AlreadyFailed { .. }))
}

/// Commits encoded frames in the order of the job, whichever threads have encoded them: none is written after one that failed.
pub(crate) struct CommitQueue<E>(Mutex<Waiting<E>>);

struct Waiting<E> {
    /// Index of the frame that is committed next.
    next: usize,
    encoded: BTreeMap<usize, E>,
    /// Whether a thread commits frames; it stays so after a failure.
    is_committing: bool,
}

impl<E> Default for CommitQueue<E> {
    fn default() -> Self {
        Self(Mutex::new(Waiting { next: 0, encoded: BTreeMap::new(), is_committing: false }))
    }
}

impl<E> CommitQueue<E> {
    fn lock(&self) -> MutexGuard<'_, Waiting<E>> {
        // The lock is only held for inserts and removals.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Commits frame `index`, if those before it are, and after it those that have waited for it; otherwise it waits. While one thread commits, no other waits for it.
    ///
    /// # Errors
    /// The failure of a commit, with the index of its frame.
    pub(crate) fn push(
        &self,
        index: usize,
        encoded: E,
        commit: impl Fn(usize, E) -> Result<(), JobError>,
    ) -> Result<(), (usize, JobError)> {
        let mut waiting = self.lock();
        waiting.encoded.insert(index, encoded);
        if waiting.is_committing {
            return Ok(());
        }
        waiting.is_committing = true;
        loop {
            let next = waiting.next;
            let Some(encoded) = waiting.encoded.remove(&next) else {
                waiting.is_committing = false;
                return Ok(());
            };
            drop(waiting);
            commit(next, encoded).map_err(|error| (next, error))?;
            waiting = self.lock();
            waiting.next += 1;
        }
    }
}

/// Marks frame `index` as finished when it is dropped, also by a panic, so that no thread waits for it forever.
pub(crate) struct CompletionGuard<'a> {
    pub(crate) in_flight: &'a InFlightFrames,
    pub(crate) index: usize,
}

impl Drop for CompletionGuard<'_> {
    fn drop(&mut self) {
        let mut state = self.in_flight.lock();
        state.unfinished.remove(&self.index);
        state.with_light.remove(&self.index);
        drop(state);
        self.in_flight.completed.notify_all();
    }
}

/// The caller's observer, which also cancels once a frame has failed.
pub(crate) struct StopOnFailure<'a> {
    pub(crate) observer: &'a dyn JobObserver,
    pub(crate) in_flight: &'a InFlightFrames,
}

impl Observer for StopOnFailure<'_> {
    fn begin(&self, stage: Stage) {
        self.observer.begin(stage);
    }

    fn end(&self, stage: Stage) {
        self.observer.end(stage);
    }

    fn begin_part(&self, part: StagePart) {
        self.observer.begin_part(part);
    }

    fn end_part(&self, part: StagePart) {
        self.observer.end_part(part);
    }

    fn cancelled(&self) -> bool {
        self.in_flight.has_failed() || self.observer.cancelled()
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use crate::job::testing::{blank, plan};

    #[test]
    fn the_cause_of_a_failure_is_kept_whichever_thread_is_first() {
        let path = PathBuf::from("film.mov");
        let cause = || JobError::Media(MediaError::DiskFull { path: path.clone() });
        let consequence = || JobError::Media(MediaError::AlreadyFailed { path: path.clone() });
        for (failures, number) in [([cause(), consequence()], 14), ([consequence(), cause()], 13)] {
            let in_flight = InFlightFrames::default();
            failures.into_iter().zip([4, 3]).for_each(|(error, index)| in_flight.fail(index, error));
            assert!(in_flight.has_failed());
            let kept = in_flight.take_error(&[10, 11, 12, 13, 14]).unwrap();
            assert_eq!(kept.frame(), Some(number), "{kept:?}");
            assert!(matches!(kept.without_frame(), JobError::Media(MediaError::DiskFull { .. })), "{kept:?}");
        }
    }

    #[test]
    fn of_several_failures_that_of_the_first_frame_is_told() {
        let full = |name: &str| JobError::Media(MediaError::DiskFull { path: PathBuf::from(name) });
        let in_flight = InFlightFrames::default();
        in_flight.fail(7, full("7.png"));
        in_flight.fail(5, full("5.png"));
        in_flight.fail(6, full("6.png"));
        in_flight.fail(4, JobError::Cancelled);
        let numbers: Vec<i64> = (10..20).collect();
        let kept = in_flight.take_error(&numbers).unwrap();
        assert!(kept.to_string().starts_with("frame 15: 5.png: the disk is full"), "{kept}");
    }

    #[test]
    fn frames_are_committed_in_order_and_none_after_one_that_failed() {
        let order = CommitQueue::default();
        let committed = Mutex::new(Vec::new());
        let push = |index: usize| {
            order.push(index, index, |index, _| {
                committed.lock().unwrap().push(index);
                if index == 4 { Err(JobError::Cancelled) } else { Ok(()) }
            })
        };
        for index in [1, 0, 3] {
            push(index).unwrap();
        }
        assert_eq!(*committed.lock().unwrap(), [0, 1]);
        push(5).unwrap();
        push(4).unwrap();
        assert!(matches!(push(2), Err((4, JobError::Cancelled))));
        push(6).unwrap();
        assert_eq!(*committed.lock().unwrap(), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn the_light_of_a_frame_is_free_before_it_is_finished() {
        let in_flight = InFlightFrames::default();
        in_flight.submit(0, 2, true);
        in_flight.recycle(0, blank(&plan(), 0));
        // Would wait forever for light that is in use.
        in_flight.wait_for_light(1);
        assert!(in_flight.take_recycled().is_some());
        assert_eq!(in_flight.lock().unfinished, BTreeSet::from([0]));
        in_flight.submit(1, 2, true);
        // Also those of a frame that failed before it was recycled.
        drop(CompletionGuard { in_flight: &in_flight, index: 1 });
        in_flight.wait_for_light(1);
    }
}
