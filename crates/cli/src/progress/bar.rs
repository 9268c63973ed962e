//! The progress bar.

use std::{
    fmt::Write,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use bansho::{
    base::host::{plural::counted, printable::printable},
    job::JobStarted,
};

use super::JobResult;
use crate::output::print_error_lines;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

/// A progress bar on stderr, drawn only if that is a terminal.
pub(super) struct Bar {
    bar: ProgressBar,
    /// Number of frames that existed already.
    kept: Arc<AtomicU64>,
}

/// The frame rate and the remaining time. Both are unknown before the first frame, which may come after a long preroll.
fn pace(drawn: u64, per_second: f64, left: Duration) -> String {
    match drawn {
        0 => "before the first frame".to_owned(),
        _ => format!("{per_second:.1} frames/s  {} left", HumanDuration(left)),
    }
}

const TEMPLATE: &str = "{wide_bar} {pos}/{len}  {pace}";

impl Bar {
    pub(super) fn new() -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        let kept = Arc::new(AtomicU64::new(0));
        if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
            let kept = kept.clone();
            bar.set_style(style.with_key("pace", move |state: &ProgressState, text: &mut dyn Write| {
                let drawn = state.pos().saturating_sub(kept.load(Ordering::Relaxed));
                // A failure is ignored: the text is missing from the bar.
                let _ = text.write_str(&pace(drawn, state.per_sec(), state.eta()));
            }));
        }
        Self { bar, kept }
    }

    /// Frames that are kept move the bar, but do not count for the rate.
    pub(super) fn started(&self, started: &JobStarted) {
        self.bar.set_length(started.frames as u64);
        self.bar.set_position(started.kept as u64);
        self.kept.store(started.kept as u64, Ordering::Relaxed);
        self.bar.reset_eta();
        self.bar.enable_steady_tick(Duration::from_millis(200));
    }

    pub(super) fn frame_done(&self) {
        self.bar.inc(1);
    }

    /// Hides the bar during `action`, which prints to the terminal.
    pub(super) fn suspend(&self, action: impl FnOnce()) {
        self.bar.suspend(action);
    }

    pub(super) fn clear(&self) {
        self.bar.finish_and_clear();
    }

    pub(super) fn done(&self, result: &JobResult, seconds: f64) {
        self.clear();
        let JobResult { unit, drawn, kept, files } = result;
        let kept = if *kept > 0 {
            format!(", {kept} {} kept", if *kept == 1 { "was" } else { "were" })
        } else {
            String::new()
        };
        let files: Vec<String> = files.iter().map(|file| printable(&file.display().to_string()).into_owned()).collect();
        let rate = *drawn as f64 / seconds.max(1e-9);
        print_error_lines(&format!(
            "{} in {seconds:.2} s, {rate:.1} a second{kept}: {}",
            counted(*drawn, unit),
            files.join(", ")
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_remaining_time_is_unknown_before_the_first_frame() {
        assert_eq!(pace(0, 0.0, Duration::ZERO), "before the first frame");
        let text = pace(3, 1.5, Duration::from_secs(8));
        assert!(text.starts_with("1.5 frames/s  8") && text.ends_with(" left"), "{text}");
    }
}
