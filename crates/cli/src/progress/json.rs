//! One JSON object a line, for farms and programs around this one.

use std::path::Path;

use bansho::job::{FrameDone, Outline};
use serde_json::{Value, json};

use super::Result;
use crate::output::to_stdout;

pub(super) struct Json;

impl Json {
    pub(super) fn started(&self, outline: &Outline) {
        let Outline { total, kept, size } = outline;
        say(&json!({ "event": "start", "frames": total, "kept": kept, "size": size }));
    }

    pub(super) fn frame_done(&self, frame: &FrameDone, seconds: f64) {
        let FrameDone { number, path, drawn } = frame;
        let file = path.as_deref().map(shown);
        say(&json!({ "event": "frame", "number": number, "file": file, "drawn": drawn, "seconds": seconds }));
    }

    pub(super) fn done(&self, result: &Result, seconds: f64) {
        let Result { drawn, kept, files, .. } = result;
        let files: Vec<String> = files.iter().map(|file| shown(file)).collect();
        say(&json!({ "event": "done", "drawn": drawn, "kept": kept, "files": files, "seconds": seconds }));
    }

    pub(super) fn failed(&self, message: &str, code: u8) {
        say(&json!({ "event": "error", "message": message, "code": code }));
    }
}

/// JSON has no other way to say a name that is not Unicode.
fn shown(path: &Path) -> String {
    path.display().to_string()
}

/// Whoever stopped listening loses progress, not pictures.
fn say(event: &Value) {
    let _ = to_stdout(&format!("{event}\n"));
}
