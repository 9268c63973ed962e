//! Reports the progress, warnings and result of a job.

mod bar;
mod json;

use std::{io, path::PathBuf, sync::Arc, time::Instant};

use bansho::{
    Observer, Stage, StagePart,
    job::{FrameDone, JobError, JobObserver, JobStarted, Warning},
};

use self::{bar::Bar, json::Json};
use crate::{
    args::ProgressKind,
    exit::{self, ReportedError},
    flags, interrupt,
    output::{print_error_lines, print_message},
    stats::Stats,
};

/// The form of the progress report.
enum Display {
    Bar(Bar),
    Json(Json),
    None,
}

/// Observes a job: reports its progress and warnings, cancels it after a signal, and measures its stages.
pub(crate) struct ProgressReporter {
    display: Arc<Display>,
    stats: Option<Stats>,
    since: Instant,
}

/// The job is complete, but some events could not be written.
#[derive(Debug, thiserror::Error)]
#[error("progress was lost: {0}; all files are written")]
struct ProgressError(io::Error);

/// The result of a job, for the last line.
pub(crate) struct JobResult {
    /// What is counted: "frame" or "texture".
    pub(crate) unit: &'static str,
    /// Number drawn and written.
    pub(crate) drawn: usize,
    /// Number of existing ones that were kept.
    pub(crate) kept: usize,
    /// The files to name.
    pub(crate) files: Vec<PathBuf>,
}

impl ProgressReporter {
    pub(crate) fn new(kind: ProgressKind, stats: bool) -> Self {
        let display = match kind {
            ProgressKind::Bar => Display::Bar(Bar::new()),
            ProgressKind::Json => Display::Json(Json::default()),
            ProgressKind::None => Display::None,
        };
        Self { display: Arc::new(display), stats: stats.then(Stats::new), since: Instant::now() }
    }

    /// Tells the estimated peak memory of the job, bytes, for the statistics.
    pub(crate) fn set_estimated_memory(&self, bytes: f64) {
        self.stats.iter().for_each(|stats| stats.set_estimated_memory(bytes));
    }

    /// Tells how many frames the job draws at once, for the statistics.
    pub(crate) fn set_frames_in_flight(&self, count: usize) {
        self.stats.iter().for_each(|stats| stats.set_frames_in_flight(count));
    }

    /// Reports the result, and the statistics of a job with `threads` threads.
    ///
    /// # Errors
    /// The error of the job, or progress could not be written.
    pub(crate) fn finish(&self, result: Result<JobResult, JobError>, threads: usize) -> anyhow::Result<()> {
        let seconds = self.since.elapsed().as_secs_f64();
        let result = result.map_err(|error| self.fail(error))?;
        let stats = self.stats.as_ref().map(|stats| stats.report(result.drawn, threads));
        match &*self.display {
            Display::Bar(bar) => bar.done(&result, seconds),
            Display::Json(json) => {
                stats.iter().for_each(|stats| json.write(&stats.json()));
                json.done(&result, seconds);
            }
            Display::None => {}
        }
        if let Some(stats) = stats {
            print_error_lines(&stats.tables());
        }
        match &*self.display {
            Display::Json(json) => json.take_error().map_or(Ok(()), |error| Err(ProgressError(error).into())),
            Display::Bar(_) | Display::None => Ok(()),
        }
    }

    /// Prints that a signal ended the program because the job did not stop in time.
    pub(crate) fn forced_exit_message(&self) -> impl Fn() + Send + 'static {
        const MESSAGE: &str = "stopped; finished files are kept";
        let display = self.display.clone();
        move || {
            if let Display::Bar(bar) = &*display {
                bar.clear();
            }
            print_message("error", MESSAGE);
            if let Display::Json(json) = &*display {
                json.failed(MESSAGE, interrupt::exit_code());
            }
        }
    }

    fn fail(&self, error: JobError) -> anyhow::Error {
        if let Display::Bar(bar) = &*self.display {
            bar.clear();
        }
        exit::print_job_error(&error);
        let message = flags::error_message(&error);
        let reported = anyhow::Error::new(ReportedError::Job(error));
        if let Display::Json(json) = &*self.display {
            json.failed(&message, exit::code(&reported));
        }
        reported
    }
}

impl Observer for ProgressReporter {
    fn begin(&self, stage: Stage) {
        self.stats.iter().for_each(|stats| stats.begin(stage));
    }

    fn end(&self, stage: Stage) {
        self.stats.iter().for_each(|stats| stats.end(stage));
    }

    fn begin_part(&self, part: StagePart) {
        self.stats.iter().for_each(|stats| stats.begin_part(part));
    }

    fn end_part(&self, part: StagePart) {
        self.stats.iter().for_each(|stats| stats.end_part(part));
    }

    fn cancelled(&self) -> bool {
        interrupt::is_requested()
    }
}

impl JobObserver for ProgressReporter {
    fn started(&self, started: &JobStarted) {
        match &*self.display {
            Display::Bar(bar) => bar.started(started),
            Display::Json(json) => json.started(started),
            Display::None => {}
        }
    }

    fn frame_done(&self, frame: &FrameDone) {
        match &*self.display {
            Display::Bar(bar) => bar.frame_done(),
            Display::Json(json) => json.frame_done(frame, self.since.elapsed().as_secs_f64()),
            Display::None => {}
        }
    }

    fn warning(&self, warning: &Warning) {
        let message = flags::warning_message(warning);
        match &*self.display {
            // Otherwise the line of the bar would be torn.
            Display::Bar(bar) => bar.suspend(|| print_message("warning", &message)),
            Display::Json(_) | Display::None => print_message("warning", &message),
        }
    }
}
