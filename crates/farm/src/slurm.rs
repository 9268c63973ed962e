//! Slurm: batch scripts for a check of the shared folder, snapshots, an array of tasks, and a last job, each after the one before it; and which of these
//! jobs `squeue` still lists.

use std::{collections::BTreeMap, fmt::Write, path::Path};

use bansho::{job::frames::format_list, media::files::provenance::COMMENT_LINE};
use serde::Serialize;

use super::{
    chunks::ChunkGrid,
    error::FarmError,
    plan::{FarmFolder, FarmPlan, Script},
    task::{check_printable, requested_memory_mib, script_path},
};

/// What is asked of Slurm.
#[derive(Clone, Debug, PartialEq)]
pub struct SlurmOptions {
    /// The program on all machines.
    pub program: std::path::PathBuf,
    /// Name of the jobs.
    pub name: String,
    /// The partition; `None` for the default one.
    pub partition: Option<String>,
    /// Cores of a task.
    pub cpus: usize,
    /// Estimated peak memory of a task, bytes.
    pub memory_bytes: f64,
    /// Estimated peak memory of the last job, bytes.
    pub finish_memory_bytes: f64,
    /// Further options of `sbatch` for all jobs, such as `--account=films`.
    pub sbatch: Vec<String>,
}

/// Largest number of machines that look at the shared folder before the array starts; as many as are free are taken.
const CHECKED_NODES: usize = 64;
/// Factor from the estimated to the requested time: other machines may be slower, and frames differ.
const TIME_HEADROOM: f64 = 2.0;
/// Time for what is not estimated, s: a cold file system, a busy machine.
const TIME_EXTRA_S: f64 = 600.0;
/// Time of the check of the shared folder, s.
const CHECK_S: f64 = 600.0;
/// Longest time limit that is asked for, minutes: a year.
const MAX_MINUTES: f64 = 525_600.0;

/// A time limit in whole minutes, as `sbatch` takes it.
fn minutes(seconds: f64) -> u64 {
    (seconds / 60.0).ceil().clamp(1.0, MAX_MINUTES) as u64
}

/// `text` as one word of a shell.
fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', r"'\''"))
}

/// `path` between the quotation marks of an option of `sbatch`, which replaces `%`.
fn escaped(path: &str) -> String {
    path.replace('%', "%%").replace('\\', r"\\").replace('"', "\\\"")
}

/// A job name without what Slurm or a shell would take for anything else.
fn job_name(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "._-".contains(c) { c } else { '_' }).collect()
}

/// Writes the scripts of one plan.
struct Writer<'a> {
    options: &'a SlurmOptions,
    plan: &'a FarmPlan,
    folder: &'a FarmFolder,
}

/// What differs between the scripts.
struct BatchJob {
    name: &'static str,
    /// Pattern of the log's name.
    log: &'static str,
    time_s: f64,
    memory_bytes: f64,
    cpus: usize,
    /// Further options of `sbatch`.
    options: Vec<String>,
    /// What runs the program, such as `srun`, with a space after it.
    launcher: &'static str,
    /// What is run, after the program and the folder.
    command: String,
}

impl Writer<'_> {
    fn script(&self, job: &BatchJob) -> Result<String, FarmError> {
        let logs = escaped(&script_path(&self.folder.logs())?);
        let mut directives = vec![
            format!("--job-name={}-{}", job_name(&self.options.name), job.name),
            format!("--output=\"{logs}/{}\"", job.log),
            "--open-mode=append".to_owned(),
            format!("--time={}", minutes(job.time_s)),
            format!("--mem={}M", requested_memory_mib(job.memory_bytes)),
            format!("--cpus-per-task={}", job.cpus),
        ];
        directives.extend(self.options.partition.iter().map(|partition| format!("--partition={partition}")));
        directives.extend(job.options.iter().chain(&self.options.sbatch).cloned());
        let mut text = format!("#!/bin/sh\n{COMMENT_LINE}");
        for directive in directives {
            check_printable(&directive)?;
            let _ = writeln!(text, "#SBATCH {directive}");
        }
        let program = quoted(&script_path(&self.options.program)?);
        let folder = quoted(&script_path(self.folder.root())?);
        let (token, launcher, command) = (quoted(&self.plan.token), job.launcher, &job.command);
        text += "# exec: a signal to the batch shell (B:TERM) must reach the program.\n";
        let _ = writeln!(text, "exec {launcher}{program} farm task {folder} --token {token} {command}");
        Ok(text)
    }

    fn check(&self, tasks: usize) -> BatchJob {
        BatchJob {
            name: "check",
            log: "check-%j.log",
            time_s: CHECK_S,
            memory_bytes: self.options.memory_bytes,
            cpus: 1,
            // Without a number of tasks, Slurm gives as many machines of the range as are free.
            options: vec![format!("--nodes=1-{}", tasks.clamp(1, CHECKED_NODES))],
            launcher: "srun --ntasks-per-node=1 ",
            command: "check".to_owned(),
        }
    }

    /// A job with all cores of a task that keeps what it has made when it is stopped, and goes on when it is queued once more.
    fn resumable(&self, name: &'static str, log: &'static str, estimated_s: f64, command: &str) -> BatchJob {
        BatchJob {
            name,
            log,
            time_s: TIME_EXTRA_S + TIME_HEADROOM * estimated_s,
            memory_bytes: self.options.memory_bytes,
            cpus: self.options.cpus,
            options: vec!["--requeue".to_owned(), "--signal=B:TERM@60".to_owned()],
            launcher: "",
            command: format!("{command} --threads \"${{SLURM_CPUS_PER_TASK:-1}}\""),
        }
    }

    /// Snapshots up to frame `last`.
    fn snapshots(&self, last: i64) -> BatchJob {
        let costs = &self.plan.costs;
        let time_s = costs.startup_s + last.abs_diff(self.plan.first_frame) as f64 * costs.step_s;
        self.resumable("snapshots", "snapshots-%j.log", time_s, &format!("snapshots --last={last}"))
    }

    /// The array of `tasks`, ascending.
    fn frames(&self, grid: &ChunkGrid, tasks: &[usize]) -> BatchJob {
        let (costs, tiles) = (&self.plan.costs, self.plan.tile_count());
        let longest = tasks.iter().map(|task| grid.chunk(task / tiles).len()).max().unwrap_or(0);
        // Where there are no snapshots, a chunk steps through all frames before it.
        let last = tasks.last().and_then(|task| grid.chunk(task / tiles).last());
        let warm_up_s = match self.plan.snapshots {
            true => 0.0,
            false => last.map_or(0, |last| last.abs_diff(self.plan.first_frame)) as f64 * costs.step_s,
        };
        // A chunk of every tenth frame steps over nine of ten.
        let span = grid.frames().last().map_or(0, |last| last.abs_diff(grid.frames()[0]) + 1);
        let steps_s = self.plan.chunk_frames.min(span) as f64 * costs.step_s;
        let time_s = costs.startup_s + warm_up_s + steps_s + longest as f64 * costs.draw_s;
        let mut job = self.resumable("frames", "frames-%A_%a.log", time_s, "frames --index \"$SLURM_ARRAY_TASK_ID\"");
        let numbers: Vec<i64> = tasks.iter().map(|&task| task as i64).collect();
        job.options.insert(0, format!("--array={}", format_list(&numbers)));
        job
    }

    /// Time of the flipbook: its frames are drawn twice at most, the first time to find what is lit.
    fn flipbook_s(&self, grid: &ChunkGrid) -> f64 {
        let Some(flipbook) = &self.plan.products.flipbook else { return 0.0 };
        let (costs, count) = (&self.plan.costs, flipbook.frame_count() as f64);
        let before = grid.frames().first().map_or(0, |first| first.abs_diff(self.plan.first_frame)) as f64;
        2.0 * (costs.startup_s + before * costs.step_s + count * costs.frame_s())
    }

    fn finish(&self, grid: &ChunkGrid) -> BatchJob {
        let costs = &self.plan.costs;
        // Reading and encoding take less than drawing.
        let time_s = costs.startup_s + grid.frames().len() as f64 * costs.draw_s.clamp(0.05, 2.0);
        let job = self.resumable("finish", "finish-%j.log", time_s + self.flipbook_s(grid), "finish");
        BatchJob { memory_bytes: self.options.finish_memory_bytes, ..job }
    }
}

/// The scripts of a plan whose tasks `tasks`, ascending, are not complete; the last one, `submit.sh`, submits the others. Snapshots are made first, up to
/// frame `last_snapshot`, or none.
///
/// # Errors
/// A path or an option cannot stand in a script.
pub fn scripts(
    plan: &FarmPlan,
    folder: &FarmFolder,
    tasks: &[usize],
    last_snapshot: Option<i64>,
    options: &SlurmOptions,
) -> Result<Vec<Script>, FarmError> {
    let writer = Writer { options, plan, folder };
    let grid = plan.grid()?;
    let mut jobs = vec![writer.check(tasks.len())];
    if !tasks.is_empty() {
        jobs.extend(last_snapshot.map(|last| writer.snapshots(last)));
        jobs.push(writer.frames(&grid, tasks));
    }
    jobs.push(writer.finish(&grid));
    let mut scripts = Vec::with_capacity(jobs.len() + 1);
    for job in &jobs {
        scripts.push(Script { name: format!("{}.sbatch", job.name), text: writer.script(job)? });
    }
    scripts.push(submit_script(&jobs, folder.root())?);
    Ok(scripts)
}

/// Submits each job after the one before it. If Slurm refuses one, those before it are canceled.
fn submit_script(jobs: &[BatchJob], root: &Path) -> Result<Script, FarmError> {
    let mut text = format!(
        "#!/bin/sh\n{COMMENT_LINE}# Submits the jobs to Slurm, each to begin when the one before it has succeeded, and prints their numbers.\n\
         set -eu\ncd {}\n\
         if test -h jobs || {{ test -s jobs && ! head -n 1 jobs | grep -q '^# bansho:'; }}; then\n  \
         echo 'jobs: already exists and was not made by Bansho' >&2\n  exit 1\nfi\nids=\n\
         cancel() {{ test -z \"$ids\" || scancel $ids; }}\ntrap cancel EXIT\n",
        quoted(&script_path(root)?)
    );
    let mut dependency = String::new();
    for BatchJob { name, .. } in jobs {
        // With `--parsable`, a cluster's name may follow the number.
        let _ = writeln!(
            text,
            "{name}=$(sbatch --parsable {dependency}{name}.sbatch)\n{name}=${{{name}%%;*}}\nids=\"$ids ${name}\""
        );
        dependency = format!("--dependency=afterok:\"${name}\" --kill-on-invalid-dep=yes ");
    }
    let _ = write!(text, "trap - EXIT\nrm -f jobs\nset -C\n{{\necho '{}'\n", COMMENT_LINE.trim_end());
    for BatchJob { name, .. } in jobs {
        let _ = writeln!(text, "echo \"{name} ${name}\"");
    }
    text += "} > jobs\nsed 1d jobs\n";
    Ok(Script { name: "submit.sh".to_owned(), text })
}

/// What Slurm does with a job that has not ended. A task that is killed writes no last line to its journal: only Slurm knows that it is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum QueueState {
    /// It waits for its turn, for the first time or once more.
    Waiting,
    /// It runs.
    Running,
}

/// States in which a job of Slurm has not begun.
const WAITING: [&str; 5] = ["PENDING", "REQUEUED", "REQUEUE_FED", "REQUEUE_HOLD", "SPECIAL_EXIT"];

/// The jobs of a plan that have not ended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Queue {
    /// By the name of the job and, of an array, the number of the task.
    states: BTreeMap<(String, Option<usize>), QueueState>,
}

impl Queue {
    /// Format of `squeue --noheader --array` for [`Self::of_slurm`]: the job, the task of an array, and the state.
    pub const SLURM_FORMAT: &str = "%F %K %T";

    /// The jobs that `submit.sh` submitted (a line has its name and its number), as far as they are `listed` by `squeue`.
    pub fn of_slurm(submitted: &str, listed: &str) -> Self {
        let names: BTreeMap<&str, &str> =
            submitted.lines().filter_map(|line| line.split_once(' ')).map(|(name, id)| (id.trim(), name)).collect();
        let mut states = BTreeMap::new();
        for line in listed.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            if let [id, task, state, ..] = words[..]
                && let Some(name) = names.get(id)
            {
                // COMPLETING is listed, too: such a job may still write its files.
                let state = if WAITING.contains(&state) { QueueState::Waiting } else { QueueState::Running };
                states.insert(((*name).to_owned(), task.parse().ok()), state);
            }
        }
        Self { states }
    }

    /// The state of task `task` of the array; `None` if it has ended or was never submitted.
    pub fn task(&self, task: usize) -> Option<QueueState> {
        self.states.get(&("frames".to_owned(), Some(task))).copied()
    }

    /// Whether no job waits or runs.
    pub fn is_empty(&self) -> bool {
        self.states.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        costs::ShotCosts,
        plan::tests::plan,
        products::{FlipbookRequest, Products},
    };

    fn options() -> SlurmOptions {
        SlurmOptions {
            program: "/opt/bansho's/bansho".into(),
            name: "wet street".into(),
            partition: Some("night".into()),
            cpus: 8,
            memory_bytes: 1e9,
            finish_memory_bytes: 2e9,
            sbatch: vec!["--account=films".into()],
        }
    }

    fn folder() -> FarmFolder {
        FarmFolder::new("/shots/10% gray/fire.farm".into())
    }

    fn text<'a>(scripts: &'a [Script], name: &str) -> &'a str {
        &scripts.iter().find(|script| script.name == name).unwrap().text
    }

    #[test]
    fn the_array_has_the_tasks_that_are_not_complete() {
        let scripts = scripts(&plan(), &folder(), &[0, 2], None, &options()).unwrap();
        let frames = text(&scripts, "frames.sbatch");
        for line in [
            "#SBATCH --array=0,2",
            "#SBATCH --requeue",
            "#SBATCH --signal=B:TERM@60",
            "#SBATCH --cpus-per-task=8",
            "#SBATCH --partition=night",
            "#SBATCH --account=films",
            "#SBATCH --job-name=wet_street-frames",
            // 1e9 / 2^20 * 1.5 + 256, rounded up
            "#SBATCH --mem=1687M",
            "#SBATCH --output=\"/shots/10%% gray/fire.farm/log/frames-%A_%a.log\"",
        ] {
            assert!(frames.lines().any(|found| found == line), "{line}\n{frames}");
        }
        let last = frames.lines().last().unwrap();
        assert_eq!(
            last,
            "exec '/opt/bansho'\\''s/bansho' farm task '/shots/10% gray/fire.farm' --token '0123' frames --index \"$SLURM_ARRAY_TASK_ID\" \
             --threads \"${SLURM_CPUS_PER_TASK:-1}\""
        );
    }

    #[test]
    fn each_job_depends_on_the_one_before_it() {
        let plan = FarmPlan { snapshots: true, ..plan() };
        let all = scripts(&plan, &folder(), &[0, 1, 2], Some(8), &options()).unwrap();
        let names: Vec<&str> = all.iter().map(|script| script.name.as_str()).collect();
        assert_eq!(names, ["check.sbatch", "snapshots.sbatch", "frames.sbatch", "finish.sbatch", "submit.sh"]);
        let submit = text(&all, "submit.sh");
        for line in [
            "check=$(sbatch --parsable check.sbatch)",
            "snapshots=$(sbatch --parsable --dependency=afterok:\"$check\" --kill-on-invalid-dep=yes snapshots.sbatch)",
            "frames=$(sbatch --parsable --dependency=afterok:\"$snapshots\" --kill-on-invalid-dep=yes frames.sbatch)",
            "finish=$(sbatch --parsable --dependency=afterok:\"$frames\" --kill-on-invalid-dep=yes finish.sbatch)",
        ] {
            assert!(submit.lines().any(|found| found == line), "{line}\n{submit}");
        }
        // Where all frames are whole, only the last job is left.
        let none = scripts(&plan, &folder(), &[], Some(8), &options()).unwrap();
        assert_eq!(none.len(), 3);
    }

    #[test]
    fn times_are_whole_minutes_with_headroom() {
        let costs = ShotCosts { startup_s: 30.0, step_s: 5.0, draw_s: 10.0, ..Default::default() };
        let plan = FarmPlan { costs, snapshots: true, ..plan() };
        let scripts = scripts(&plan, &folder(), &[0, 1, 2], Some(8), &options()).unwrap();
        // 600 s + 2 (30 + 4 (5 + 10)) s
        assert!(text(&scripts, "frames.sbatch").contains("#SBATCH --time=13\n"));
        // 600 s + 2 (30 + 8 * 5) s
        let snapshots = text(&scripts, "snapshots.sbatch");
        assert!(
            snapshots.contains("#SBATCH --time=13\n") && snapshots.contains(" snapshots --last=8 --threads"),
            "{snapshots}"
        );
        // 600 s + 2 (30 + 10 * 2) s; 2e9 / 2^20 * 1.5 + 256, rounded up
        let finish = text(&scripts, "finish.sbatch");
        assert!(finish.contains("#SBATCH --time=12\n") && finish.contains("#SBATCH --mem=3118M\n"), "{finish}");
        assert_eq!([0.0, 60.0, 61.0, f64::INFINITY].map(minutes), [1, 1, 2, 525_600]);
    }

    #[test]
    fn a_flipbook_takes_time_of_the_last_job() {
        let costs = ShotCosts { startup_s: 30.0, step_s: 5.0, draw_s: 10.0, ..Default::default() };
        let flipbook = Some(FlipbookRequest { path: "a.png".into(), grid: [4, 2], tile: None });
        let plan = FarmPlan { costs, products: Products { flipbook, ..Products::default() }, ..plan() };
        // 600 s + 2 (30 + 10 * 2 + 2 (30 + 8 * 15)) s
        assert!(
            text(&scripts(&plan, &folder(), &[], None, &options()).unwrap(), "finish.sbatch")
                .contains("#SBATCH --time=22\n")
        );
    }

    #[test]
    fn line_breaks_never_get_into_a_script() {
        let bad = SlurmOptions { partition: Some("a\n#SBATCH --uid=0".into()), ..options() };
        assert!(matches!(scripts(&plan(), &folder(), &[0], None, &bad), Err(FarmError::ControlCharacters { .. })));
        let folder = FarmFolder::new("/shots/a\nb".into());
        assert!(matches!(scripts(&plan(), &folder, &[0], None, &options()), Err(FarmError::ControlCharacters { .. })));
    }

    #[test]
    fn jobs_of_the_plan_are_found_among_all_others() {
        let submitted = "check 7\nframes 8\nfinish 9\n";
        let listed =
            "8 0 RUNNING\n8 3 PENDING\n8 4 REQUEUED\n9 N/A PENDING\n80 1 RUNNING\n\nnonsense\n8 2 COMPLETING\n";
        let queue = Queue::of_slurm(submitted, listed);
        let tasks: Vec<_> = (0..5).map(|task| queue.task(task)).collect();
        let (running, waiting) = (Some(QueueState::Running), Some(QueueState::Waiting));
        assert_eq!(tasks, [running, None, running, waiting, waiting]);
        assert!(!queue.is_empty());
        assert!(Queue::of_slurm(submitted, "80 1 RUNNING\n").is_empty());
        assert!(Queue::of_slurm("", listed).is_empty());
    }
}
