//! Cancellation of work in progress. A simulation that was cancelled resumes where it stopped; a drawing that was cancelled is lost.

use std::sync::atomic::{AtomicBool, Ordering};

use bansho::{Observer, Stage};

/// Cancels work when `stop` returns true. Its argument is whether the shot is being advanced rather than drawn.
pub(super) struct Interruption<F> {
    advancing: AtomicBool,
    stop: F,
}

impl<F: Fn(bool) -> bool + Send + Sync> Interruption<F> {
    pub(super) fn new(stop: F) -> Self {
        Self { advancing: AtomicBool::new(false), stop }
    }

    fn set_advancing(&self, stage: Stage, active: bool) {
        if stage == Stage::Advance {
            self.advancing.store(active, Ordering::Relaxed);
        }
    }
}

impl<F: Fn(bool) -> bool + Send + Sync> Observer for Interruption<F> {
    fn begin(&self, stage: Stage) {
        self.set_advancing(stage, true);
    }

    fn end(&self, stage: Stage) {
        self.set_advancing(stage, false);
    }

    fn cancelled(&self) -> bool {
        (self.stop)(self.advancing.load(Ordering::Relaxed))
    }
}
