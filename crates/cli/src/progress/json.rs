//! One JSON object a line, for farms and programs around this one.

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
        say(&json!({ "event": "frame", "number": number, "file": path, "drawn": drawn, "seconds": seconds }));
    }

    pub(super) fn done(&self, result: &Result, seconds: f64) {
        let Result { drawn, kept, files } = result;
        say(&json!({ "event": "done", "drawn": drawn, "kept": kept, "files": files, "seconds": seconds }));
    }

    pub(super) fn failed(&self, message: &str, code: u8) {
        say(&json!({ "event": "error", "message": message, "code": code }));
    }
}

/// Whoever stopped listening loses progress, not pictures.
fn say(event: &Value) {
    let _ = to_stdout(&format!("{event}\n"));
}
