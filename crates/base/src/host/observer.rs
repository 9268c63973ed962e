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
    /// View transform, dither and quantization of frames whose light is kept. Where it is not, they are done strip by strip, as a part of
    /// [`Draw`](Self::Draw).
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

/// The work of one phenomenon in a stage, or what the renderer does there for all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StagePart<'a> {
    /// What is done: [`Stage::Advance`], [`Stage::Prepare`] or [`Stage::Draw`].
    pub stage: Stage,
    /// Name of the phenomenon; `None` for compositing: accumulation, exposure, plate, refraction.
    pub phenomenon: Option<&'a str>,
    /// Whether it is done for the reflection in a mirror. The reflection is drawn within [`Stage::Prepare`].
    pub is_mirrored: bool,
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

    /// This part of a stage begins on this thread: at a step, at the preparation of a frame, and for each strip of a picture. Parts are nested where
    /// compositing calls a phenomenon, and where a thread that waits for parallel work takes on other work.
    fn begin_part(&self, _part: StagePart) {}

    /// This part of a stage ends on this thread.
    fn end_part(&self, _part: StagePart) {}

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

/// RAII guard: the part of a stage lasts from its construction until it is dropped.
pub struct PartGuard<'a> {
    observer: &'a dyn Observer,
    part: StagePart<'a>,
}

impl<'a> PartGuard<'a> {
    /// Begins `part`.
    pub fn begin(observer: &'a dyn Observer, part: StagePart<'a>) -> Self {
        observer.begin_part(part);
        Self { observer, part }
    }
}

impl Drop for PartGuard<'_> {
    fn drop(&mut self) {
        self.observer.end_part(self.part);
    }
}

/// `Err(Cancelled)` once the observer wants to stop.
///
/// # Errors
/// The observer asked to stop.
pub fn check(observer: &dyn Observer) -> Result<(), Cancelled> {
    if observer.cancelled() { Err(Cancelled) } else { Ok(()) }
}
