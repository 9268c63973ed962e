//! `bansho farm task`: what a batch system runs.

use std::{
    env, fs, thread,
    time::{Duration, Instant},
};

use bansho_farm::{FarmError, FarmFolder, TaskCheck, finish, journal::task_name, task};

use super::{
    arguments, flipbook_result,
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
    let machine = machine_identity();
    let check = TaskCheck { folder: &folder, token: &args.token, machine: machine.as_deref() };
    // Before the journal: a folder that is not the shared one gets no file.
    wait_for(|| check.token())?;
    let (name, threads) = match args.task {
        TaskCommand::Check => ("check".to_owned(), Some(1)),
        TaskCommand::Snapshots { threads: ThreadArgs { threads }, .. } => ("snapshots".to_owned(), threads),
        TaskCommand::Frames { index, threads: ThreadArgs { threads } } => (task_name(index), threads),
        TaskCommand::Finish { threads: ThreadArgs { threads } } => ("finish".to_owned(), threads),
    };
    let journal = TaskJournal::create(&folder.journal(), &name, &args.token, threads.map_or(0, usize::from));
    journal.start(0, 0);
    let done = work(args.task, &folder, &check, threads, &journal);
    match &done {
        Ok(()) => journal.end(0, None),
        Err(error) => journal.end(exit::code(error), Some(exit::message(error))),
    }
    done
}

/// What tells this machine from all others, and from itself after it was started again, perhaps as another one of a cloud.
fn machine_identity() -> Option<String> {
    fs::read_to_string("/proc/sys/kernel/random/boot_id").ok().map(|id| id.trim().to_owned())
}

/// Waits until a shared file system shows what `check` looks for.
pub(super) fn wait_for(check: impl Fn() -> Result<(), FarmError>) -> Result<(), FarmError> {
    let since = Instant::now();
    loop {
        match check() {
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
        match command {
            TaskCommand::Check => Ok(None),
            TaskCommand::Snapshots { last, .. } => {
                task::plan_snapshots(&job, folder, &plan, last, &observer).map(|_| None)
            }
            TaskCommand::Frames { index, .. } => {
                let summary = task::chunk_job(&job, folder, &plan, index)?.run(&observer)?;
                let files = vec![summary.first_file];
                Ok(Some(JobResult { unit: "frame", drawn: summary.drawn, kept: summary.kept, files }))
            }
            // Frames of a flipbook are not for the journal, which has those of the shot.
            TaskCommand::Finish { .. } => Ok(finish::finish(&job, folder, &plan, reporter)?.map(flipbook_result)),
        }
    })
}
