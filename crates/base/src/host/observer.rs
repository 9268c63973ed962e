//! Progress, stages and cancelling: the caller watches, the library only reports.

/// A part of the work whose time is worth knowing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// Reading pictures and other assets.
    Load,
    /// Stepping the phenomena to the frame's time.
    Advance,
    /// What phenomena prepare once a frame before pixels are drawn.
    Prepare,
    /// Drawing phenomena and compositing them.
    Draw,
    /// View transform, dither and quantizing.
    View,
    /// Compressing and writing files.
    Write,
}

impl Stage {
    /// Every stage, in the order of a frame's life.
    pub const ALL: [Self; 6] = [Self::Load, Self::Advance, Self::Prepare, Self::Draw, Self::View, Self::Write];

    /// Its name as `--stats` and `--progress json` print it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Load => "load",
            Self::Advance => "advance",
            Self::Prepare => "prepare",
            Self::Draw => "draw",
            Self::View => "view",
            Self::Write => "write",
        }
    }
}

/// Work was stopped because the observer asked for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Watches work; keeps the clock, since libraries do not read it. Called from several threads.
pub trait Observer: Send + Sync {
    /// Work of this kind begins on this thread.
    fn begin(&self, _stage: Stage) {}

    /// Work of this kind ends on this thread.
    fn end(&self, _stage: Stage) {}

    /// Whether to stop; asked at least once every strip of a picture and every simulation step.
    fn cancelled(&self) -> bool {
        false
    }
}

/// An observer that wants nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unobserved;

impl Observer for Unobserved {}

/// Reports a stage from its making until it is dropped.
pub struct StageGuard<'a> {
    observer: &'a dyn Observer,
    stage: Stage,
}

impl<'a> StageGuard<'a> {
    /// Begins `stage`.
    pub fn begin(observer: &'a dyn Observer, stage: Stage) -> Self {
        observer.begin(stage);
        Self { observer, stage }
    }
}

impl Drop for StageGuard<'_> {
    fn drop(&mut self) {
        self.observer.end(self.stage);
    }
}

/// `Err(Cancelled)` once the observer wants to stop.
///
/// # Errors
/// The observer asked to stop.
pub fn check(observer: &dyn Observer) -> Result<(), Cancelled> {
    if observer.cancelled() { Err(Cancelled) } else { Ok(()) }
}
