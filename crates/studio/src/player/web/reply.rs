//! Messages from the worker to the page.

use crate::{document::CheckReport, player::Picture};

/// A message of the worker.
pub(super) enum Reply {
    /// It is ready for messages.
    Ready,
    /// The scene of request `number` was checked.
    Checked { number: u64, report: CheckReport },
    /// A preview.
    Drawn { picture: Picture },
    /// A small picture of a stage.
    Stage { stage: usize, picture: Picture },
    /// A full-quality frame as a PNG.
    FullQualityFrame { frame: i64, png: Vec<u8> },
    /// Request `number` failed.
    Failed { number: u64, reason: String },
    /// A phenomenon panicked while request `number` was served. The worker has terminated.
    Panicked { number: u64, message: String },
    /// Request `number` is finished.
    Done { number: u64 },
}

/// What the page receives from a worker.
pub(super) enum WorkerMessage {
    Reply(Reply),
    /// It terminated: without a message, as when out of memory, or after it reported a panic.
    Terminated,
}
