//! A bar on the terminal.

use std::{fmt::Write, time::Duration};

use bansho::job::Outline;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use super::Result;
use crate::output::to_stderr;

/// Draws itself only where stderr is a terminal.
pub(super) struct Bar {
    bar: ProgressBar,
}

const TEMPLATE: &str = "{wide_bar} {pos}/{len}  {rate} frames/s  {eta} left";

impl Bar {
    pub(super) fn new() -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        let rate = |state: &ProgressState, text: &mut dyn Write| {
            // A rate that cannot be drawn is simply not drawn.
            let _ = write!(text, "{:.1}", state.per_sec());
        };
        if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
            bar.set_style(style.with_key("rate", rate));
        }
        Self { bar }
    }

    /// Frames that are there already move the bar but do not count for the rate.
    pub(super) fn started(&self, outline: &Outline) {
        self.bar.set_length(outline.total as u64);
        self.bar.set_position(outline.kept as u64);
        self.bar.reset_eta();
        self.bar.enable_steady_tick(Duration::from_millis(200));
    }

    pub(super) fn frame_done(&self) {
        self.bar.inc(1);
    }

    /// Does something to the terminal that the bar must not spoil.
    pub(super) fn beside(&self, action: impl FnOnce()) {
        self.bar.suspend(action);
    }

    pub(super) fn clear(&self) {
        self.bar.finish_and_clear();
    }

    pub(super) fn done(&self, result: &Result, seconds: f64) {
        self.clear();
        let Result { what, drawn, kept, files } = result;
        let kept = if *kept > 0 { format!(", {kept} were there already") } else { String::new() };
        let files: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
        let rate = *drawn as f64 / seconds.max(1e-9);
        to_stderr(&format!("{drawn} {what} in {seconds:.2} s, {rate:.1} a second{kept}: {}", files.join(", ")));
    }
}
