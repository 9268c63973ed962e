//! What a page hears from its worker.

use crate::{document::ReportedProblem, player::Picture};

/// What a worker says.
pub(super) enum Reply {
    /// It listens.
    Ready,
    /// The scene of wish `number` was checked: its exposure, or its faults.
    Checked { number: u64, found: Result<f32, Vec<ReportedProblem>> },
    /// A picture.
    Drawn { picture: Picture },
    /// A small picture of a stage.
    Stage { stage: usize, picture: Picture },
    /// A finished picture: its frame, and the file.
    FullQualityFrame { frame: i64, png: Vec<u8> },
    /// Why wish `number` has no picture.
    Failed { number: u64, reason: String },
    /// What a phenomenon said when it panicked over wish `number`. The worker is gone.
    Panicked { number: u64, message: String },
    /// Nothing more comes of wish `number`.
    Done { number: u64 },
}

/// What comes from a worker.
pub(super) enum WorkerMessage {
    Reply(Reply),
    /// It ended: without a word, as where memory runs out, or after it told of a panic.
    Terminated,
}
