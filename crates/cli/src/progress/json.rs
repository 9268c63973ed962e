//! Progress as one JSON object a line, for render farms and other programs.

use std::{
    io,
    path::Path,
    sync::{Mutex, PoisonError},
};

use bansho::job::{FrameDone, JobStarted};
use serde_json::{Value, json};

use super::JobResult;
use crate::output::{json_text, print_all};

#[derive(Default)]
pub(super) struct Json {
    /// The first error of writing an event.
    error: Mutex<Option<io::Error>>,
}

impl Json {
    pub(super) fn started(&self, started: &JobStarted) {
        let JobStarted { frames, kept, size } = started;
        self.write(&json!({ "event": "start", "frames": frames, "kept": kept, "size": size }));
    }

    pub(super) fn frame_done(&self, frame: &FrameDone, seconds: f64) {
        let FrameDone { number, path, drawn } = frame;
        let file = path.as_deref().map(display);
        self.write(&json!({ "event": "frame", "number": number, "file": file, "drawn": drawn, "seconds": seconds }));
    }

    pub(super) fn done(&self, result: &JobResult, seconds: f64) {
        let JobResult { drawn, kept, files, .. } = result;
        let files: Vec<String> = files.iter().map(|file| display(file)).collect();
        self.write(&json!({ "event": "done", "drawn": drawn, "kept": kept, "files": files, "seconds": seconds }));
    }

    pub(super) fn failed(&self, message: &str, code: u8) {
        self.write(&json!({ "event": "error", "message": message, "code": code }));
    }

    /// The first error of writing an event, if there was one. A closed pipe is one: whoever asked for events has missed some.
    pub(super) fn take_error(&self) -> Option<io::Error> {
        self.error.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Writes an event. After an error the job continues, so that the pictures are not lost.
    pub(super) fn write(&self, event: &Value) {
        if let Err(error) = print_all(&format!("{}\n", json_text(event))) {
            self.error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        }
    }
}

/// A path as text. JSON cannot represent names that are not Unicode.
fn display(path: &Path) -> String {
    path.display().to_string()
}
