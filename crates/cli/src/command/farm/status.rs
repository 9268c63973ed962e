//! `bansho farm status`

use std::{env, fmt::Write, path};

use bansho::{
    base::host::{
        plural::counted,
        printable::{printable, printable_excerpt},
    },
    job::{Job, SceneFile},
};
use bansho_farm::{
    FarmError, FarmFolder,
    status::{self, FarmStatus, FinishStatus, TaskState, TaskStatus},
    task,
};
use serde_json::{Value, json};

use super::{arguments, slurm};
use crate::{
    args::FarmStatusArgs,
    exit::ReportedError,
    output::{json_text, print},
};

/// Prints the state of a plan. It is an error if not all is whole, though one without a message.
pub(crate) fn run(args: &FarmStatusArgs) -> anyhow::Result<()> {
    let named = Job { out: args.out.clone(), ..Job::new(SceneFile::read(&args.scene)?) };
    let folder = FarmFolder::new(path::absolute(FarmFolder::beside(&task::sequence_name(&named)?).root())?);
    let plan = folder.read_plan()?;
    env::set_current_dir(&plan.folder).map_err(|source| FarmError::Io { path: plan.folder.clone(), source })?;
    let job = arguments::render_job(&plan.arguments)?;
    // Before the journals are read: what ends in between has written so.
    let queue = slurm::queue(&folder);
    let status = status::status(&job, &folder, &plan, queue.as_ref())?;
    print(&if args.json { format!("{}\n", json_text(&as_json(&status))) } else { as_text(&status) })?;
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
        text += &task_line(task, status.asked);
    }
    // Writing to a string cannot fail.
    let _ = match (&status.finish, status.unmade.first()) {
        (FinishStatus::Done, Some(path)) => {
            writeln!(text, "last job: done, but {} is missing", printable(&path.display().to_string()))
        }
        (FinishStatus::Done, _) => writeln!(text, "last job: done"),
        (FinishStatus::Failed { message }, _) => {
            writeln!(text, "last job: failed: {}", printable_excerpt(message))
        }
        (FinishStatus::Waiting, _) => writeln!(text, "last job: waits for the others"),
        (FinishStatus::Lost, _) => {
            writeln!(
                text,
                "last job: not queued, and neither are the others: they were killed or canceled; submit the rest again"
            )
        }
        (FinishStatus::Blocked { by }, _) => {
            let causes =
                by.iter().map(|(name, why)| format!("{} ({})", printable_excerpt(name), printable_excerpt(why)));
            let causes: Vec<String> = causes.collect();
            writeln!(text, "last job: did not run, because others failed: {}", causes.join("; "))
        }
    };
    if let (Some(frame), Some(left)) = (status.seconds_per_frame, status.seconds_left) {
        let tasks = status.running.max(1);
        let _ = writeln!(text, "{frame:.1} s a frame, {:.1} h left with {tasks} at a time", left / 3600.0);
    }
    text
}

fn task_line(task: &TaskStatus, asked: bool) -> String {
    let counts = &task.frames;
    let last = task.attempts.last();
    let on_node = last.map(|last| {
        let node = printable_excerpt(&last.node);
        format!(" on {node}, {} drawn there", counted(last.drawn, "frame"))
    });
    let on_node = on_node.unwrap_or_default();
    let state = match (task.state, last.and_then(|last| last.code)) {
        (TaskState::Done, _) => "done".to_owned(),
        (TaskState::Waiting, _) if last.is_some() => format!("waits to start again; started before{on_node}"),
        (TaskState::Waiting, _) => "not started".to_owned(),
        (TaskState::Running, _) if asked => format!("runs{on_node}"),
        (TaskState::Running, _) => format!("started{on_node}"),
        (TaskState::Lost, _) => format!("lost: started{on_node}, but neither ended nor queued"),
        (TaskState::Ended, code) => format!("ended{on_node}, with exit code {}", code.unwrap_or(0)),
    };
    format!(
        "task {}: frames {} to {}: {} whole, {} missing, {} stale, {} damaged; {state}\n",
        task.task, task.first, task.last, counts.whole, counts.missing, counts.stale, counts.damaged
    )
}
