//! Batch scripts for Slurm: a check of the shared folder, snapshots, an array of tasks, and a last job, each after the one before it.

use std::{fmt::Write, path::Path};

use bansho_media::files::provenance::COMMENT_LINE;

use super::{
    chunks::ChunkGrid,
    error::FarmError,
    plan::{FarmFolder, FarmPlan, Script},
    task::{check_printable, script_path},
};
use crate::job::frames::format_list;

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
/// Factor from the estimated to the requested memory.
const MEMORY_HEADROOM: f64 = 1.5;
/// Memory for what is not estimated, MiB.
const MEMORY_EXTRA_MIB: f64 = 256.0;
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

struct Writer<'a> {
    options: &'a SlurmOptions,
    plan: &'a FarmPlan,
    folder: &'a FarmFolder,
}

/// What differs between the scripts.
struct ScriptRequest<'a> {
    job: &'a str,
    /// Pattern of the log's name.
    log: &'a str,
    time_s: f64,
    memory_bytes: f64,
    cpus: usize,
    /// Further options, one a line.
    options: &'a [String],
    /// What is run, after the program and the folder.
    command: &'a str,
    /// What runs the program, such as `srun`.
    launcher: &'a str,
}

impl Writer<'_> {
    fn script(&self, request: &ScriptRequest<'_>) -> Result<String, FarmError> {
        let ScriptRequest { job, log, time_s, memory_bytes, cpus, options, command, launcher } = *request;
        let logs = escaped(&script_path(&self.folder.logs())?);
        let memory = (memory_bytes / f64::from(1 << 20) * MEMORY_HEADROOM + MEMORY_EXTRA_MIB).ceil();
        let mut directives = vec![
            format!("--job-name={}-{job}", job_name(&self.options.name)),
            format!("--output=\"{logs}/{log}\""),
            "--open-mode=append".to_owned(),
            format!("--time={}", minutes(time_s)),
            format!("--mem={memory}M"),
            format!("--cpus-per-task={cpus}"),
        ];
        directives.extend(self.options.partition.iter().map(|partition| format!("--partition={partition}")));
        directives.extend(options.iter().chain(&self.options.sbatch).cloned());
        let mut text = format!("#!/bin/sh\n{COMMENT_LINE}");
        for directive in directives {
            check_printable(&directive)?;
            let _ = writeln!(text, "#SBATCH {directive}");
        }
        let program = quoted(&script_path(&self.options.program)?);
        let folder = quoted(&script_path(self.folder.root())?);
        let token = quoted(&self.plan.token);
        text += "# exec: a signal to the batch shell (B:TERM) must reach the program.\n";
        let _ = writeln!(text, "exec {launcher}{program} farm task {folder} --token {token} {command}");
        Ok(text)
    }

    fn check(&self, tasks: usize) -> Result<String, FarmError> {
        // Without a number of tasks, Slurm gives as many machines of the range as are free.
        let options = [format!("--nodes=1-{}", tasks.clamp(1, CHECKED_NODES))];
        self.script(&ScriptRequest {
            job: "check",
            log: "check-%j.log",
            time_s: CHECK_S,
            memory_bytes: self.options.memory_bytes,
            cpus: 1,
            options: &options,
            command: "check",
            launcher: "srun --ntasks-per-node=1 ",
        })
    }

    /// Snapshots up to frame `last`.
    fn snapshots(&self, last: i64) -> Result<String, FarmError> {
        let costs = &self.plan.costs;
        let time_s = costs.startup_s + last.abs_diff(self.plan.first_frame) as f64 * costs.step_s;
        self.script(&ScriptRequest {
            job: "snapshots",
            log: "snapshots-%j.log",
            time_s: TIME_EXTRA_S + TIME_HEADROOM * time_s,
            memory_bytes: self.options.memory_bytes,
            cpus: self.options.cpus,
            options: &["--requeue".to_owned(), "--signal=B:TERM@60".to_owned()],
            command: &format!("snapshots --last={last} --threads \"${{SLURM_CPUS_PER_TASK:-1}}\""),
            launcher: "",
        })
    }

    fn frames(&self, grid: &ChunkGrid, tasks: &[usize]) -> Result<String, FarmError> {
        let numbers: Vec<i64> = tasks.iter().map(|&task| task as i64).collect();
        let longest = tasks.iter().map(|task| grid.chunk(task / self.plan.tile_count()).len()).max().unwrap_or(0);
        let costs = &self.plan.costs;
        // Where there are no snapshots, a chunk steps through all frames before it.
        let last = tasks.last().and_then(|task| grid.chunk(task / self.plan.tile_count()).last());
        let warm_up = match self.plan.snapshots {
            true => 0.0,
            false => last.map_or(0, |last| last.abs_diff(self.plan.first_frame)) as f64 * costs.step_s,
        };
        // A chunk of every tenth frame steps over nine of ten.
        let span = grid.frames().last().map_or(0, |last| last.abs_diff(grid.frames()[0]) + 1);
        let steps = self.plan.chunk_frames.min(span) as f64 * costs.step_s;
        let time_s = costs.startup_s + warm_up + steps + longest as f64 * costs.draw_s;
        let options =
            [format!("--array={}", format_list(&numbers)), "--requeue".to_owned(), "--signal=B:TERM@60".to_owned()];
        self.script(&ScriptRequest {
            job: "frames",
            log: "frames-%A_%a.log",
            time_s: TIME_EXTRA_S + TIME_HEADROOM * time_s,
            memory_bytes: self.options.memory_bytes,
            cpus: self.options.cpus,
            options: &options,
            command: "frames --index \"$SLURM_ARRAY_TASK_ID\" --threads \"${SLURM_CPUS_PER_TASK:-1}\"",
            launcher: "",
        })
    }

    /// Time of the flipbook: its frames are drawn twice at most, the first time to find what is lit.
    fn flipbook_s(&self, grid: &ChunkGrid) -> f64 {
        let Some(flipbook) = &self.plan.products.flipbook else { return 0.0 };
        let (costs, count) = (&self.plan.costs, flipbook.frame_count() as f64);
        let before = grid.frames().first().map_or(0, |first| first.abs_diff(self.plan.first_frame)) as f64;
        2.0 * (costs.startup_s + before * costs.step_s + count * costs.frame_s())
    }

    fn finish(&self, grid: &ChunkGrid) -> Result<String, FarmError> {
        let costs = &self.plan.costs;
        // Reading and encoding take less than drawing.
        let time_s = costs.startup_s + grid.frames().len() as f64 * costs.draw_s.clamp(0.05, 2.0);
        self.script(&ScriptRequest {
            job: "finish",
            log: "finish-%j.log",
            time_s: TIME_EXTRA_S + TIME_HEADROOM * (time_s + self.flipbook_s(grid)),
            memory_bytes: self.options.finish_memory_bytes,
            cpus: self.options.cpus,
            options: &["--requeue".to_owned(), "--signal=B:TERM@60".to_owned()],
            command: "finish --threads \"${SLURM_CPUS_PER_TASK:-1}\"",
            launcher: "",
        })
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
    let mut jobs = vec![("check", Script { name: "check.sbatch", text: writer.check(tasks.len())? })];
    if let Some(last) = last_snapshot.filter(|_| !tasks.is_empty()) {
        jobs.push(("snapshots", Script { name: "snapshots.sbatch", text: writer.snapshots(last)? }));
    }
    if !tasks.is_empty() {
        jobs.push(("frames", Script { name: "frames.sbatch", text: writer.frames(&grid, tasks)? }));
    }
    jobs.push(("finish", Script { name: "finish.sbatch", text: writer.finish(&grid)? }));
    let submit = submit_script(&jobs, folder.root())?;
    Ok(jobs.into_iter().map(|(_, script)| script).chain([submit]).collect())
}

/// Submits each job after the one before it. If Slurm refuses one, those before it are canceled.
fn submit_script(jobs: &[(&str, Script)], root: &Path) -> Result<Script, FarmError> {
    let mut text = format!(
        "#!/bin/sh\n{COMMENT_LINE}# Submits the jobs to Slurm, each to begin when the one before it has succeeded, and prints their numbers.\n\
         set -eu\ncd {}\n\
         if test -h jobs || {{ test -s jobs && ! head -n 1 jobs | grep -q '^# bansho:'; }}; then\n  \
         echo 'jobs: is there already and was not made by Bansho' >&2\n  exit 1\nfi\nids=\n\
         cancel() {{ test -z \"$ids\" || scancel $ids; }}\ntrap cancel EXIT\n",
        quoted(&script_path(root)?)
    );
    let mut previous = String::new();
    for (name, script) in jobs {
        let dependency = match previous.as_str() {
            "" => String::new(),
            previous => format!("--dependency=afterok:\"${previous}\" --kill-on-invalid-dep=yes "),
        };
        // With `--parsable`, a cluster's name may follow the number.
        let _ = writeln!(
            text,
            "{name}=$(sbatch --parsable {dependency}{})\n{name}=${{{name}%%;*}}\nids=\"$ids ${name}\"",
            script.name
        );
        (*name).clone_into(&mut previous);
    }
    let _ = write!(text, "trap - EXIT\nrm -f jobs\nset -C\n{{\necho '{}'\n", COMMENT_LINE.trim_end());
    for (name, _) in jobs {
        let _ = writeln!(text, "echo \"{name} ${name}\"");
    }
    text += "} > jobs\nsed 1d jobs\n";
    Ok(Script { name: "submit.sh", text })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::farm::{
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
        let names: Vec<&str> = all.iter().map(|script| script.name).collect();
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
        let costs = crate::farm::chunks::ShotCosts { startup_s: 30.0, step_s: 5.0, draw_s: 10.0, ..Default::default() };
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
        let costs = crate::farm::chunks::ShotCosts { startup_s: 30.0, step_s: 5.0, draw_s: 10.0, ..Default::default() };
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
}
