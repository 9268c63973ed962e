//! Frames between drawing and disk: a bounded number, so that memory does not grow, and the first failure of any.

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
    host::observer::{Observer, Stage},
};

use crate::job::{error::JobError, observer::JobObserver};

/// Frames that were drawn and are not yet written.
#[derive(Default)]
pub(crate) struct InFlightFrames {
    state: Mutex<State>,
    completed: Condvar,
    failed: AtomicBool,
}

#[derive(Default)]
struct State {
    unfinished: BTreeSet<usize>,
    error: Option<JobError>,
    recycled: Option<Frame>,
}

/// How long a thread that found no work sleeps before it looks again; a completed frame wakes it earlier.
const IDLE_WAIT: Duration = Duration::from_millis(1);

impl InFlightFrames {
    fn lock(&self) -> MutexGuard<'_, State> {
        // A thread that panicked held the lock only over inserts and removals, which leave no half-done state.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until frame `index` is fewer than `limit` behind the oldest unfinished one, and helps the pool meanwhile:
    /// in a pool of one thread nobody else would. Measured by index, so that a film's window never overflows.
    pub(crate) fn submit(&self, index: usize, limit: usize) {
        loop {
            let mut state = self.lock();
            let oldest = state.unfinished.first().copied().unwrap_or(index);
            if index < oldest + limit {
                state.unfinished.insert(index);
                return;
            }
            drop(state);
            if rayon::yield_now() != Some(rayon::Yield::Executed) {
                let state = self.lock();
                drop(self.completed.wait_timeout(state, IDLE_WAIT));
            }
        }
    }

    /// Keeps a finished frame, so that its memory can be used again.
    pub(crate) fn recycle(&self, frame: Frame) {
        self.lock().recycled = Some(frame);
    }

    /// A finished frame, if there is one.
    pub(crate) fn take_recycled(&self) -> Option<Frame> {
        self.lock().recycled.take()
    }

    /// Keeps the first failure; the rest of the work then stops.
    pub(crate) fn fail(&self, error: JobError) {
        self.lock().error.get_or_insert(error);
        self.failed.store(true, Ordering::Relaxed);
    }

    /// Whether some frame failed.
    pub(crate) fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    /// The failure, if there was one.
    pub(crate) fn take_error(&self) -> Option<JobError> {
        self.lock().error.take()
    }
}

/// Marks frame `index` as finished when it is dropped, even by a panic, so that nobody waits for it in vain.
pub(crate) struct CompletionGuard<'a> {
    pub(crate) in_flight: &'a InFlightFrames,
    pub(crate) index: usize,
}

impl Drop for CompletionGuard<'_> {
    fn drop(&mut self) {
        self.in_flight.lock().unfinished.remove(&self.index);
        self.in_flight.completed.notify_all();
    }
}

/// The caller's observer, which also wants to stop once a frame has failed.
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

    fn cancelled(&self) -> bool {
        self.in_flight.has_failed() || self.observer.cancelled()
    }
}
