//! Cancellation of work in progress. A simulation that was cancelled resumes where it stopped; a drawing that was cancelled is lost.

use std::sync::atomic::{AtomicBool, Ordering};

use bansho::{Observer, Stage};

/// Asks `stop` whether to stop, and tells it whether the shot is being advanced rather than drawn.
pub(super) struct Interruption<F> {
    advancing: AtomicBool,
    stop: F,
}

impl<F: Fn(bool) -> bool + Send + Sync> Interruption<F> {
    pub(super) fn new(stop: F) -> Self {
        Self { advancing: AtomicBool::new(false), stop }
    }

    fn note(&self, stage: Stage, under_way: bool) {
        if stage == Stage::Advance {
            self.advancing.store(under_way, Ordering::Relaxed);
        }
    }
}

impl<F: Fn(bool) -> bool + Send + Sync> Observer for Interruption<F> {
    fn begin(&self, stage: Stage) {
        self.note(stage, true);
    }

    fn end(&self, stage: Stage) {
        self.note(stage, false);
    }

    fn cancelled(&self) -> bool {
        (self.stop)(self.advancing.load(Ordering::Relaxed))
    }
}
