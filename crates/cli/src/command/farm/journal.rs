//! Observes the job of a task, and writes its journal.

use std::{io, path::Path, time::Instant};

use bansho::{
    Observer, Stage, StagePart,
    job::{FrameDone, JobObserver, JobStarted, Warning},
};
use bansho_farm::journal::{Journal, JournalEvent};

use crate::{output::print_message, progress::ProgressReporter, stats};

/// The journal of a task. Without one, where the disk is full, frames are drawn all the same.
pub(super) struct TaskJournal {
    journal: Option<Journal>,
    since: Instant,
    node: String,
    token: String,
    threads: usize,
}

impl TaskJournal {
    pub(super) fn create(folder: &Path, name: &str, token: &str, threads: usize) -> Self {
        let journal = Journal::create(folder, name);
        if let Err(error) = &journal {
            warn(error);
        }
        let node = ["SLURMD_NODENAME", "HOSTNAME"].iter().find_map(|name| std::env::var(name).ok());
        Self {
            journal: journal.ok(),
            since: Instant::now(),
            node: node.unwrap_or_else(|| "unknown".to_owned()),
            token: token.to_owned(),
            threads,
        }
    }

    fn seconds(&self) -> f64 {
        self.since.elapsed().as_secs_f64()
    }

    fn write(&self, event: &JournalEvent) {
        if let Some(Err(error)) = self.journal.as_ref().map(|journal| journal.write(event)) {
            warn(&error);
        }
    }

    /// The task begins. Once more where the numbers of frames are known.
    pub(super) fn start(&self, frames: usize, kept: usize) {
        let (node, token) = (self.node.clone(), self.token.clone());
        self.write(&JournalEvent::Start { node, token, frames, kept, threads: self.threads });
    }

    pub(super) fn end(&self, code: u8, message: Option<String>) {
        self.write(&JournalEvent::End { code, message, seconds: self.seconds(), cpu_seconds: stats::cpu_seconds() });
    }
}

fn warn(error: &io::Error) {
    print_message("warning", &format!("the journal of the task cannot be written: {error}"));
}

/// Passes everything on to the reporter, and frames to the journal.
pub(super) struct JournalObserver<'a> {
    pub(super) reporter: &'a ProgressReporter,
    pub(super) journal: &'a TaskJournal,
}

impl Observer for JournalObserver<'_> {
    fn begin(&self, stage: Stage) {
        self.reporter.begin(stage);
    }

    fn end(&self, stage: Stage) {
        self.reporter.end(stage);
    }

    fn begin_part(&self, part: StagePart) {
        self.reporter.begin_part(part);
    }

    fn end_part(&self, part: StagePart) {
        self.reporter.end_part(part);
    }

    fn cancelled(&self) -> bool {
        self.reporter.cancelled()
    }
}

impl JobObserver for JournalObserver<'_> {
    fn started(&self, started: &JobStarted) {
        self.journal.start(started.frames, started.kept);
        self.reporter.started(started);
    }

    fn frame_done(&self, frame: &FrameDone) {
        self.journal.write(&JournalEvent::Frame { number: frame.number, seconds: self.journal.seconds() });
        self.reporter.frame_done(frame);
    }

    fn warning(&self, warning: &Warning) {
        self.reporter.warning(warning);
    }
}
