//! One JSON object a line, for farms and programs around this one.

use std::{
    io,
    path::Path,
    sync::{Mutex, PoisonError},
};

use bansho::job::{FrameDone, Outline};
use serde_json::{Value, json};

use super::Result;
use crate::output::to_stdout;

#[derive(Default)]
pub(super) struct Json {
    /// Why an event could not be written, the first time.
    unwritten: Mutex<Option<io::Error>>,
}

impl Json {
    pub(super) fn started(&self, outline: &Outline) {
        let Outline { total, kept, size } = outline;
        self.say(&json!({ "event": "start", "frames": total, "kept": kept, "size": size }));
    }

    pub(super) fn frame_done(&self, frame: &FrameDone, seconds: f64) {
        let FrameDone { number, path, drawn } = frame;
        let file = path.as_deref().map(shown);
        self.say(&json!({ "event": "frame", "number": number, "file": file, "drawn": drawn, "seconds": seconds }));
    }

    pub(super) fn done(&self, result: &Result, seconds: f64) {
        let Result { drawn, kept, files, .. } = result;
        let files: Vec<String> = files.iter().map(|file| shown(file)).collect();
        self.say(&json!({ "event": "done", "drawn": drawn, "kept": kept, "files": files, "seconds": seconds }));
    }

    pub(super) fn failed(&self, message: &str, code: u8) {
        self.say(&json!({ "event": "error", "message": message, "code": code }));
    }

    /// Why an event could not be written, if one could not. Whoever stopped listening loses progress, which is no error.
    pub(super) fn take_fault(&self) -> Option<io::Error> {
        self.unwritten.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Goes on after a failure: what cannot be told must not cost the pictures.
    fn say(&self, event: &Value) {
        if let Err(error) = to_stdout(&format!("{event}\n")) {
            self.unwritten.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        }
    }
}

/// JSON has no other way to say a name that is not Unicode.
fn shown(path: &Path) -> String {
    path.display().to_string()
}
