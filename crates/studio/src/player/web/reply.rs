//! Messages from the worker to the page.

use crate::{document::ReportedProblem, player::Picture};

/// A message of the worker.
pub(super) enum Reply {
    /// It is ready for messages.
    Ready,
    /// The scene of request `number` was checked: its exposure, or its faults.
    Checked { number: u64, found: Result<f32, Vec<ReportedProblem>> },
    /// A preview.
    Drawn { picture: Picture },
    /// A small picture of a stage.
    Stage { stage: usize, picture: Picture },
    /// A finished picture: its frame, and the file.
    FullQualityFrame { frame: i64, png: Vec<u8> },
    /// Why request `number` has no picture.
    Failed { number: u64, reason: String },
    /// What a phenomenon said when it panicked over request `number`. The worker has terminated.
    Panicked { number: u64, message: String },
    /// Nothing more comes of request `number`.
    Done { number: u64 },
}

/// What the page receives from a worker.
pub(super) enum WorkerMessage {
    Reply(Reply),
    /// It terminated: without a message, as when out of memory, or after it reported a panic.
    Terminated,
}
