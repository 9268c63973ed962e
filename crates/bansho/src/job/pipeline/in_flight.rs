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

    /// Keeps a finished frame, whose memory the next one reuses.
    pub(crate) fn recycle(&self, frame: Frame) {
        self.lock().recycled = Some(frame);
    }

    /// A finished frame to reuse, if there is one.
    pub(crate) fn take_recycled(&self) -> Option<Frame> {
        self.lock().recycled.take()
    }

    /// Keeps the first failure, and cancels the remaining work.
    pub(crate) fn fail(&self, error: JobError) {
        self.lock().error.get_or_insert(error);
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

/// Marks frame `index` as finished when it is dropped, also by a panic, so that no thread waits for it forever.
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
