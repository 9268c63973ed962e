//! `bansho farm status`

use std::{env, fmt::Write, path};

use bansho::{
    base::host::printable::printable,
    farm::{
        FarmFolder,
        status::{self, FarmStatus, FinishStatus, TaskStatus},
        task,
    },
    job::{Job, SceneFile},
};
use serde_json::{Value, json};

use super::arguments;
use crate::{args::FarmStatusArgs, exit::ReportedError, output::print};

/// Prints the state of a plan. It is an error if not all is whole, though one without a message.
pub(crate) fn run(args: &FarmStatusArgs) -> anyhow::Result<()> {
    let named = Job { out: args.out.clone(), ..Job::new(SceneFile::read(&args.scene)?) };
    let folder = FarmFolder::new(path::absolute(FarmFolder::beside(&task::sequence_name(&named)?).root())?);
    let plan = folder.read_plan()?;
    env::set_current_dir(&plan.folder)?;
    let job = arguments::render_job(&plan.arguments)?;
    let status = status::status(&job, &folder, &plan)?;
    print(&if args.json { format!("{}\n", as_json(&status)) } else { as_text(&status) })?;
    if status.is_complete() { Ok(()) } else { Err(ReportedError::Incomplete.into()) }
}

fn as_json(status: &FarmStatus) -> Value {
    // Serializing plain data cannot fail.
    let mut value = serde_json::to_value(status).unwrap_or_default();
    value["complete"] = json!(status.is_complete());
    value
}

fn as_text(status: &FarmStatus) -> String {
    let frames = &status.frames;
    let mut text = format!(
        "frames: {} whole, {} missing, {} stale, {} damaged\n",
        frames.whole, frames.missing, frames.stale, frames.damaged
    );
    for task in status.tasks.iter().filter(|task| task.frames.unfinished() > 0) {
        text += &task_line(task);
    }
    // Writing to a string cannot fail.
    let _ = match (&status.finish, status.unmade.first()) {
        (FinishStatus::Done, Some(path)) => {
            writeln!(text, "last job: done, but {} is missing", printable(&path.display().to_string()))
        }
        (FinishStatus::Done, _) => writeln!(text, "last job: done"),
        (FinishStatus::Failed { message }, _) => writeln!(text, "last job: failed: {message}"),
        (FinishStatus::Waiting, _) => writeln!(text, "last job: waits for the others"),
        (FinishStatus::Blocked { by }, _) => {
            let causes: Vec<String> = by.iter().map(|(name, why)| format!("{name} ({why})")).collect();
            writeln!(text, "last job: did not run, because others failed: {}", causes.join("; "))
        }
    };
    if let (Some(frame), Some(left)) = (status.seconds_per_frame, status.seconds_left) {
        let tasks = status.running.max(1);
        let _ = writeln!(text, "{frame:.1} s a frame, {:.1} h left with {tasks} at a time", left / 3600.0);
    }
    text
}

fn task_line(task: &TaskStatus) -> String {
    let counts = &task.frames;
    let state = match task.attempts.last() {
        None => "not begun".to_owned(),
        Some(last) => match last.code {
            None => format!("begun on {}", last.node),
            Some(code) => format!("ended on {} with exit code {code}", last.node),
        },
    };
    format!(
        "task {}: frames {} to {}: {} whole, {} missing, {} stale, {} damaged; {state}\n",
        task.task, task.first, task.last, counts.whole, counts.missing, counts.stale, counts.damaged
    )
}
