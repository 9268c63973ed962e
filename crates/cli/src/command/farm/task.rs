//! `bansho farm task`: what a batch system runs.

use std::{
    env, thread,
    time::{Duration, Instant},
};

use bansho::{
    Observer,
    farm::{FarmError, FarmFolder, FarmPlan, TaskCheck, finish, journal::task_name, task},
    job::{Job, PreparedJob},
};

use super::{
    arguments,
    journal::{JournalObserver, TaskJournal},
    run_in_pool,
};
use crate::{
    args::{ProgressKind, TaskArgs, TaskCommand, ThreadArgs},
    exit,
    progress::{JobResult, ProgressReporter},
};

/// How long a shared file system may take to show what another machine wrote.
const VISIBLE_AFTER: Duration = Duration::from_secs(60);
const POLL_INTERVAL: Duration = Duration::from_millis(500);

/// Runs a task and writes its journal.
pub(crate) fn run(args: &TaskArgs) -> anyhow::Result<()> {
    let folder = FarmFolder::new(args.folder.clone());
    let check = TaskCheck { folder: &folder, token: &args.token };
    // Before the journal: a folder that is not the shared one gets no file.
    wait_for_token(&check)?;
    let (name, threads) = match args.task {
        TaskCommand::Check => ("check".to_owned(), Some(1)),
        TaskCommand::Snapshots { threads: ThreadArgs { threads } } => ("snapshots".to_owned(), threads),
        TaskCommand::Frames { index, threads: ThreadArgs { threads } } => (task_name(index), threads),
        TaskCommand::Finish { threads: ThreadArgs { threads } } => ("finish".to_owned(), threads),
    };
    let journal = TaskJournal::create(&folder.journal(), &name, &args.token, threads.map_or(0, usize::from));
    journal.start(0, 0);
    let done = work(args.task, &folder, &check, threads, &journal);
    match &done {
        Ok(()) => journal.end(0, None),
        Err(error) => journal.end(exit::code(error), Some(format!("{error:#}"))),
    }
    done
}

fn wait_for_token(check: &TaskCheck<'_>) -> Result<(), FarmError> {
    let since = Instant::now();
    loop {
        match check.token() {
            Err(_) if since.elapsed() < VISIBLE_AFTER => thread::sleep(POLL_INTERVAL),
            seen => return seen,
        }
    }
}

fn work(
    command: TaskCommand,
    folder: &FarmFolder,
    check: &TaskCheck<'_>,
    threads: Option<u16>,
    journal: &TaskJournal,
) -> anyhow::Result<()> {
    let reporter = ProgressReporter::new(ProgressKind::Bar, false);
    // Relative paths of the arguments are those of the machine that planned the tasks.
    let plan = folder.read_plan()?;
    env::set_current_dir(&plan.folder).map_err(|source| FarmError::Io { path: plan.folder.clone(), source })?;
    let job = arguments::render_job(&plan.arguments)?;
    run_in_pool(threads, reporter, |reporter| {
        let observer = JournalObserver { reporter, journal };
        let plan = check.plan(&observer)?;
        let prepared = prepare(command, &job, folder, &plan, &observer)?;
        let Some(prepared) = prepared else { return Ok(None) };
        let summary = prepared.run(&observer)?;
        let files = vec![summary.first_file];
        Ok(Some(JobResult { unit: "frame", drawn: summary.drawn, kept: summary.kept, files }))
    })
}

/// What is to be drawn; the rest is done here.
fn prepare(
    command: TaskCommand,
    job: &Job,
    folder: &FarmFolder,
    plan: &FarmPlan,
    observer: &dyn Observer,
) -> Result<Option<PreparedJob>, FarmError> {
    match command {
        TaskCommand::Check => Ok(None),
        TaskCommand::Snapshots { .. } => task::snapshot_job(job, folder, plan),
        TaskCommand::Frames { index, .. } => task::chunk_job(job, folder, plan, index).map(Some),
        TaskCommand::Finish { .. } => finish::finish(job, folder, plan, observer).map(|()| None),
    }
}
