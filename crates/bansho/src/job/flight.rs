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
    host::observer::{Observer, Stage},
    image::Frame,
};

use super::{error::JobError, observer::JobObserver};

/// Frames that were drawn and are not yet where they belong.
#[derive(Default)]
pub(super) struct Flight {
    state: Mutex<State>,
    landed: Condvar,
    failed: AtomicBool,
}

#[derive(Default)]
struct State {
    unfinished: BTreeSet<usize>,
    error: Option<JobError>,
    spent: Option<Frame>,
}

/// How long a thread that found no work sleeps before it looks again; a landing wakes it earlier.
const NAP: Duration = Duration::from_millis(1);

impl Flight {
    fn lock(&self) -> MutexGuard<'_, State> {
        // A thread that panicked held the lock only over inserts and removals, which leave no half-done state.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until frame `index` is fewer than `limit` behind the oldest unfinished one, and helps the pool meanwhile:
    /// in a pool of one thread nobody else would. Measured by index, so that a film's window never overflows.
    pub(super) fn depart(&self, index: usize, limit: usize) {
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
                drop(self.landed.wait_timeout(state, NAP));
            }
        }
    }

    /// Keeps a finished frame, so that its memory can be used again.
    pub(super) fn keep_spent(&self, frame: Frame) {
        self.lock().spent = Some(frame);
    }

    /// A finished frame, if there is one.
    pub(super) fn take_spent(&self) -> Option<Frame> {
        self.lock().spent.take()
    }

    /// Keeps the first failure; the rest of the work then stops.
    pub(super) fn fail(&self, error: JobError) {
        self.lock().error.get_or_insert(error);
        self.failed.store(true, Ordering::Relaxed);
    }

    /// Whether some frame failed.
    pub(super) fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    /// The failure, if there was one.
    pub(super) fn take_error(&self) -> Option<JobError> {
        self.lock().error.take()
    }
}

/// Marks frame `index` as finished when it is dropped, even by a panic, so that nobody waits for it in vain.
pub(super) struct Landing<'a> {
    pub(super) flight: &'a Flight,
    pub(super) index: usize,
}

impl Drop for Landing<'_> {
    fn drop(&mut self) {
        self.flight.lock().unfinished.remove(&self.index);
        self.flight.landed.notify_all();
    }
}

/// The caller's observer, which also wants to stop once a frame has failed.
pub(super) struct Watch<'a> {
    pub(super) observer: &'a dyn JobObserver,
    pub(super) flight: &'a Flight,
}

impl Observer for Watch<'_> {
    fn begin(&self, stage: Stage) {
        self.observer.begin(stage);
    }

    fn end(&self, stage: Stage) {
        self.observer.end(stage);
    }

    fn cancelled(&self) -> bool {
        self.flight.has_failed() || self.observer.cancelled()
    }
}
