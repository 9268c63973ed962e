//! A bar on the terminal.

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
    job::Outline,
};

use super::Result;
use crate::output::to_stderr;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

/// Draws itself only where stderr is a terminal.
pub(super) struct Bar {
    bar: ProgressBar,
    /// Frames that were there before.
    kept: Arc<AtomicU64>,
}

/// How fast `drawn` frames came, and how long the others will take: nobody knows before the first is there, which a long preroll comes before.
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
        let known = kept.clone();
        let write_pace = move |state: &ProgressState, text: &mut dyn Write| {
            let drawn = state.pos().saturating_sub(known.load(Ordering::Relaxed));
            // A pace that cannot be drawn is simply not drawn.
            let _ = text.write_str(&pace(drawn, state.per_sec(), state.eta()));
        };
        if let Ok(style) = ProgressStyle::with_template(TEMPLATE) {
            bar.set_style(style.with_key("pace", write_pace));
        }
        Self { bar, kept }
    }

    /// Frames that are there already move the bar but do not count for the rate.
    pub(super) fn started(&self, outline: &Outline) {
        self.bar.set_length(outline.total as u64);
        self.bar.set_position(outline.kept as u64);
        self.kept.store(outline.kept as u64, Ordering::Relaxed);
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
        let kept = if *kept > 0 {
            format!(", {kept} {} there already", if *kept == 1 { "was" } else { "were" })
        } else {
            String::new()
        };
        let files: Vec<String> = files.iter().map(|file| printable(&file.display().to_string()).into_owned()).collect();
        let rate = *drawn as f64 / seconds.max(1e-9);
        to_stderr(&format!(
            "{} in {seconds:.2} s, {rate:.1} a second{kept}: {}",
            counted(*drawn, what),
            files.join(", ")
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_knows_the_time_that_is_left_before_the_first_frame() {
        assert_eq!(pace(0, 0.0, Duration::ZERO), "before the first frame");
        let told = pace(3, 1.5, Duration::from_secs(8));
        assert!(told.starts_with("1.5 frames/s  8") && told.ends_with(" left"), "{told}");
    }
}
