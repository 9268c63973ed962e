//! Frames that are drawn and not yet written. Their number is bounded, so that memory does not grow. The first failure is kept.

use std::{
    collections::BTreeSet,
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
    error: Option<JobError>,
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

    /// Keeps the first failure, and cancels the remaining work. A frame of a film that another thread writes can fail as a consequence of it and
    /// arrive here earlier; the cause takes its place.
    pub(crate) fn fail(&self, error: JobError) {
        let mut state = self.lock();
        if state.error.as_ref().is_none_or(follows_from_another) {
            state.error = Some(error);
        }
        drop(state);
        self.failed.store(true, Ordering::Relaxed);
    }

    /// Whether a frame failed.
    pub(crate) fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    /// The first failure, if there was one.
    pub(crate) fn take_error(&self) -> Option<JobError> {
        self.lock().error.take()
    }
}

/// Whether a failure only says that another one came before it.
fn follows_from_another(error: &JobError) -> bool {
    matches!(error, JobError::Media(MediaError::AlreadyFailed { .. }))
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
        for failures in [[cause(), consequence()], [consequence(), cause()]] {
            let in_flight = InFlightFrames::default();
            failures.into_iter().for_each(|error| in_flight.fail(error));
            assert!(in_flight.has_failed());
            let kept = in_flight.take_error();
            assert!(matches!(kept, Some(JobError::Media(MediaError::DiskFull { .. }))), "{kept:?}");
        }
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
