//! Progress, stages and cancellation: the library reports, the caller observes.

/// A stage of the work whose time is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// Reading pictures and other assets.
    Load,
    /// Stepping the phenomena to the frame's time.
    Advance,
    /// Preparing the phenomena, once per frame, before pixels are drawn.
    Prepare,
    /// Drawing phenomena and compositing them.
    Draw,
    /// View transform, dither and quantization.
    View,
    /// Compressing and writing files.
    Write,
}

impl Stage {
    /// All stages, in the order in which a frame passes through them.
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

/// Error: the observer asked to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Observes the work. Time is measured by implementations, since the library does not read clocks. Called from several threads.
pub trait Observer: Send + Sync {
    /// Work of this kind begins on this thread.
    fn begin(&self, _stage: Stage) {}

    /// Work of this kind ends on this thread.
    fn end(&self, _stage: Stage) {}

    /// Whether to stop; queried at least once per strip of a picture and per simulation step.
    fn cancelled(&self) -> bool {
        false
    }
}

/// An observer that does nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unobserved;

impl Observer for Unobserved {}

/// RAII guard: the stage lasts from its construction until it is dropped.
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
