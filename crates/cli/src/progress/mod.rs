//! What the user sees while a job runs.

mod bar;
mod json;

use std::{sync::Arc, time::Instant};

use bansho::{
    Observer, Stage,
    job::{FrameDone, JobError, JobObserver, Note, Outline},
};

use self::{bar::Bar, json::Json};
use crate::{
    exit::{self, ReportedJobError},
    flags, interrupt,
    output::{self, to_stderr},
    stats::Stats,
};

/// `--progress`
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum ProgressKind {
    /// A bar on stderr with frames a second and the time left, where stderr is a terminal; then one line.
    #[default]
    Bar,
    /// One JSON object a line on stdout: start, frame, done, error.
    Json,
    /// Nothing but warnings and errors.
    None,
}

/// Where progress goes.
enum Shown {
    Bar(Bar),
    Json(Json),
    Nothing,
}

/// Watches a job for the user: progress, warnings, signals, times.
pub(crate) struct Watcher {
    shown: Arc<Shown>,
    stats: Option<Stats>,
    since: Instant,
}

/// All work was done, but not all of its progress could be reported.
#[derive(Debug, thiserror::Error)]
#[error("progress was lost: {0}; all files are written")]
struct Unwritten(std::io::Error);

/// What a job came to, for the last line.
pub(crate) struct Result {
    /// What one thing that was drawn is called.
    pub(crate) what: &'static str,
    pub(crate) drawn: usize,
    pub(crate) kept: usize,
    pub(crate) files: Vec<std::path::PathBuf>,
}

impl Watcher {
    pub(crate) fn new(kind: ProgressKind, stats: bool) -> Self {
        let shown = match kind {
            ProgressKind::Bar => Shown::Bar(Bar::new()),
            ProgressKind::Json => Shown::Json(Json::default()),
            ProgressKind::None => Shown::Nothing,
        };
        Self { shown: Arc::new(shown), stats: stats.then(Stats::new), since: Instant::now() }
    }

    /// Tells how it ended, statistics last. `threads` drew.
    ///
    /// # Errors
    /// Why the job failed, or progress could not be written.
    pub(crate) fn finish(&self, result: std::result::Result<Result, JobError>, threads: usize) -> anyhow::Result<()> {
        let seconds = self.since.elapsed().as_secs_f64();
        let result = result.map_err(|error| self.fail(error))?;
        match &*self.shown {
            Shown::Bar(bar) => bar.done(&result, seconds),
            Shown::Json(json) => json.done(&result, seconds),
            Shown::Nothing => {}
        }
        if let Some(stats) = &self.stats {
            to_stderr(&stats.table(result.drawn, threads));
        }
        match &*self.shown {
            Shown::Json(json) => json.take_fault().map_or(Ok(()), |error| Err(Unwritten(error).into())),
            Shown::Bar(_) | Shown::Nothing => Ok(()),
        }
    }

    /// What tells the user that a signal ended the program because the work did not stop by itself.
    pub(crate) fn telling_the_end(&self) -> impl Fn() + Send + 'static {
        const MESSAGE: &str = "stopped; whole files stay";
        let shown = self.shown.clone();
        move || {
            if let Shown::Bar(bar) = &*shown {
                bar.clear();
            }
            output::tell("error", MESSAGE);
            if let Shown::Json(json) = &*shown {
                json.failed(MESSAGE, interrupt::exit_code());
            }
        }
    }

    fn fail(&self, error: JobError) -> anyhow::Error {
        if let Shown::Bar(bar) = &*self.shown {
            bar.clear();
        }
        exit::report_job_error(&error);
        let message = flags::error(&error);
        let reported = anyhow::Error::new(ReportedJobError(error));
        if let Shown::Json(json) = &*self.shown {
            json.failed(&message, exit::code(&reported));
        }
        reported
    }
}

impl Observer for Watcher {
    fn begin(&self, stage: Stage) {
        self.stats.iter().for_each(|stats| stats.begin(stage));
    }

    fn end(&self, stage: Stage) {
        self.stats.iter().for_each(|stats| stats.end(stage));
    }

    fn cancelled(&self) -> bool {
        interrupt::came()
    }
}

impl JobObserver for Watcher {
    fn started(&self, outline: &Outline) {
        match &*self.shown {
            Shown::Bar(bar) => bar.started(outline),
            Shown::Json(json) => json.started(outline),
            Shown::Nothing => {}
        }
    }

    fn frame_done(&self, frame: &FrameDone) {
        match &*self.shown {
            Shown::Bar(bar) => bar.frame_done(),
            Shown::Json(json) => json.frame_done(frame, self.since.elapsed().as_secs_f64()),
            Shown::Nothing => {}
        }
    }

    fn note(&self, note: &Note) {
        let warn = || output::tell("warning", &flags::note(note));
        if let Shown::Bar(bar) = &*self.shown { bar.beside(warn) } else { warn() }
    }
}
