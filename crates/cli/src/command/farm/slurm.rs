//! `bansho farm slurm`

use std::{
    env, fs, io,
    path::{self, Path, PathBuf},
    process::{Command, Output, Stdio},
    thread,
    time::Instant,
};

use bansho::{
    Unobserved,
    base::{
        host::{plural::counted, printable::printable},
        math::simd::set_vector_level,
    },
    job::{Job, PreparedJob},
    media::files::{input, overwrite_policy::OverwritePolicy},
};
use bansho_farm::{
    FarmError, FarmFolder, FarmPlan,
    chunks::{self, ChunkGrid, ChunkRequest},
    costs::{ProbeObserver, ShotCosts, check_space, probe_frames},
    machine,
    plan::FarmPlanOptions,
    products::Products,
    slurm::{self, Queue, SlurmOptions},
    status::{self, FrameCounts},
    task,
};

use super::{arguments, random_token, run_in_pool};
use crate::{
    args::{ChunkLength, SlurmArgs},
    exit::{ReportedError, UsageError},
    output::{print, print_foreign_lines, shell_word},
    progress::ProgressReporter,
};

/// `MaxArraySize` of a cluster that does not state another.
const MAX_ARRAY_SIZE: usize = 1001;

/// Plans the tasks of a shot, writes their scripts, and submits them.
pub(crate) fn run(args: &SlurmArgs) -> anyhow::Result<()> {
    if args.render.scene.as_os_str() == "-" {
        return Err(UsageError(
            "the scene is standard input, which tasks cannot read; allowed: a file in a shared folder".to_owned(),
        )
        .into());
    }
    // Before anything is drawn.
    args.sbatch.iter().chain(&args.partition).try_for_each(|option| task::check_printable(option))?;
    set_vector_level(args.render.work.vector_level)?;
    // The last job makes the contact sheet.
    let job = Job { contact_sheet: None, ..args.render.job()? };
    let folder = folder_of(&job)?;
    if args.submit {
        check_slurm(args)?;
    }
    check_no_active_jobs(&folder, args.submit)?;
    let arguments = arguments::of_render(env::args_os(), &["farm", "slurm"])?;
    let products = args.products.products(args.render.contact_sheet);
    let current = env::current_dir()?;
    let planning = Planning { args, job, folder, arguments, products, current, max_tasks: max_tasks(args) };
    let reporter = ProgressReporter::new(args.render.work.progress, args.render.work.stats);
    let mut planned = None;
    run_in_pool(args.render.work.threads, reporter, |reporter| {
        planned = Some(planning.plan(reporter)?);
        Ok(None)
    })?;
    let Some(planned) = planned else { return Ok(()) };
    print(&planned.summary)?;
    match (planned.is_complete, args.submit) {
        (true, _) => Ok(()),
        (false, true) => submit(&planning.folder),
        (false, false) => {
            Ok(print(&format!("submit: sh {}\n", shell_word(&planning.folder.root().join("submit.sh"))))?)
        }
    }
}

/// The folder of the plan, as all machines name it.
fn folder_of(job: &Job) -> anyhow::Result<FarmFolder> {
    Ok(FarmFolder::new(path::absolute(FarmFolder::beside(&task::sequence_name(job)?).root())?))
}

fn shown(path: &Path) -> String {
    printable(&path.display().to_string()).into_owned()
}

/// Largest list of jobs that is read, bytes.
const JOBS_BYTES: u64 = 64 << 10;

/// A program of Slurm with its output.
fn slurm_output(program: &str, arguments: &[&str]) -> io::Result<Output> {
    Command::new(program).args(arguments).stdin(Stdio::null()).output()
}

/// The names and numbers of the jobs that were submitted last, a job a line; `None` where none were.
fn submitted_jobs(folder: &FarmFolder) -> Option<String> {
    let text = input::read(&folder.jobs(), JOBS_BYTES).ok()?;
    Some(String::from_utf8_lossy(&text).into_owned())
}

/// What Slurm does with the jobs of a plan; `None` where none were submitted, or this machine cannot ask.
pub(super) fn queue(folder: &FarmFolder) -> Option<Queue> {
    let submitted = submitted_jobs(folder)?;
    // All jobs rather than these: the shot may be another user's, and Slurm refuses to list a job that it has forgotten.
    let format = format!("--format={}", Queue::SLURM_FORMAT);
    let output = slurm_output("squeue", &["--noheader", "--array", &format]).ok()?;
    output.status.success().then(|| Queue::of_slurm(&submitted, &String::from_utf8_lossy(&output.stdout)))
}

/// Checks that `sbatch` is there and takes the partition and all other options, before anything is drawn. What it says against them is passed on.
fn check_slurm(args: &SlurmArgs) -> anyhow::Result<()> {
    let partition = args.partition.iter().map(|partition| format!("--partition={partition}"));
    let mut test = Command::new("sbatch");
    test.args(["--test-only", "--wrap=true", "--time=1"]).args(partition).args(&args.sbatch);
    match test.stdin(Stdio::null()).stdout(Stdio::null()).output() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Err(UsageError(
            "--submit: there is no `sbatch` on the path; run this on a machine with Slurm, or omit --submit to only write the scripts"
                .to_owned(),
        )
        .into()),
        Err(error) => Err(anyhow::Error::from(error).context("sbatch")),
        Ok(output) if output.status.success() => Ok(()),
        Ok(output) => {
            print_foreign_lines(&output.stderr);
            Err(ReportedError::OtherProgram.into())
        }
    }
}

/// Refuses to plan again while jobs of the last plan are queued or running: they would find another plan than they were submitted for.
fn check_no_active_jobs(folder: &FarmFolder, is_needed: bool) -> anyhow::Result<()> {
    let Some(text) = submitted_jobs(folder) else { return Ok(()) };
    let submitted: Vec<&str> = text.lines().filter_map(|line| line.split_whitespace().nth(1)).collect();
    let queued = match slurm_output("squeue", &["--me", "--noheader", "--format=%F"]) {
        Ok(output) if output.status.success() => String::from_utf8_lossy(&output.stdout).into_owned(),
        _ if !is_needed => return Ok(()),
        Ok(output) => {
            print_foreign_lines(&output.stderr);
            return Err(ReportedError::OtherProgram.into());
        }
        Err(error) => return Err(anyhow::Error::from(error).context("squeue")),
    };
    let mut active: Vec<&str> = queued.lines().map(str::trim).filter(|id| submitted.contains(id)).collect();
    active.dedup();
    if active.is_empty() {
        return Ok(());
    }
    let ids = active.join(" ");
    Err(UsageError(format!(
        "jobs {ids} of this shot are queued or running; wait for them, or cancel them with `scancel {ids}`"
    ))
    .into())
}

/// The largest number of tasks of an array.
fn max_tasks(args: &SlurmArgs) -> usize {
    let stated = args.max_array_size.map(|size| size as usize);
    stated.or_else(max_array_size_of_cluster).unwrap_or(MAX_ARRAY_SIZE).max(1)
}

/// The largest array that the cluster takes; `None` where it does not say.
fn max_array_size_of_cluster() -> Option<usize> {
    let output = slurm_output("scontrol", &["show", "config"]).ok().filter(|output| output.status.success())?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let line = text.lines().find_map(|line| line.trim_start().strip_prefix("MaxArraySize"))?;
    line.trim_start_matches([' ', '=']).trim().parse().ok()
}

/// Runs `submit.sh`, whose words are those of `sbatch`.
fn submit(folder: &FarmFolder) -> anyhow::Result<()> {
    let status = Command::new("sh").arg(folder.root().join("submit.sh")).stdin(Stdio::null()).status()?;
    if status.success() { Ok(()) } else { Err(ReportedError::OtherProgram.into()) }
}

struct Planning<'a> {
    args: &'a SlurmArgs,
    job: Job,
    folder: FarmFolder,
    arguments: Vec<String>,
    products: Products,
    current: PathBuf,
    max_tasks: usize,
}

struct Planned {
    summary: String,
    is_complete: bool,
}

impl Planning<'_> {
    fn request(&self) -> ChunkRequest {
        let tiles = self.args.tiles[0] * self.args.tiles[1];
        ChunkRequest { task_s: 60.0 * f64::from(self.args.task_minutes), tiles, max_tasks: self.max_tasks }
    }

    /// Measures, cuts, and writes plan and scripts.
    fn plan(&self, reporter: &ProgressReporter) -> Result<Planned, FarmError> {
        let tiled = task::tile_job(&self.job, &self.folder, self.args.tiles, self.request().tiles / 2)?;
        let prepared = tiled.prepare()?;
        self.folder.check_files(prepared.overwrite_policy())?;
        let flipbook = self.products.check(&self.job, &self.current)?;
        let memory_bytes = prepared.memory_bytes();
        let finish_memory_bytes = flipbook.map_or(0.0, |flipbook| flipbook.memory_bytes()).max(memory_bytes);
        let earlier = self.earlier_plan(&prepared);
        let costs = match &earlier {
            Some(plan) => plan.costs,
            None => self.probe(&tiled, &prepared, reporter)?,
        };
        let chunk_frames = match (self.args.chunk, &earlier) {
            (ChunkLength::Frames(frames), _) => frames,
            (ChunkLength::Auto, Some(plan)) => plan.chunk_frames,
            (ChunkLength::Auto, None) => chunks::chunk_frames(prepared.frames(), &costs, &self.request())?,
        };
        let first_frame = prepared.plan().frames().start;
        let grid = ChunkGrid::new(first_frame, chunk_frames, prepared.frames().to_vec());
        chunks::check_task_count(&grid, &self.request())?;
        let digests = (0..grid.count()).map(|chunk| prepared.shot_digest(grid.chunk(chunk))).collect();
        let options = self.options(prepared.is_stepped() && grid.last_snapshot().is_some(), costs)?;
        let plan = FarmPlan::new(options, &grid, first_frame, chunk_frames, digests);
        self.write(&plan, &grid, [memory_bytes, finish_memory_bytes], prepared.overwrite_policy())
    }

    fn options(&self, snapshots: bool, costs: ShotCosts) -> Result<FarmPlanOptions, FarmError> {
        Ok(FarmPlanOptions {
            token: random_token(),
            arithmetic: machine::arithmetic_digest(&Unobserved)?,
            folder: self.current.clone(),
            arguments: self.arguments.clone(),
            tiles: self.args.tiles,
            snapshots,
            products: self.products.clone(),
            costs,
        })
    }

    /// The plan that this one continues: of the same picture, so that its costs and chunks are those of this one.
    fn earlier_plan(&self, prepared: &PreparedJob) -> Option<FarmPlan> {
        let plan = self.folder.read_plan().ok()?;
        if plan.arguments != self.arguments || plan.tiles != self.args.tiles || plan.folder != self.current {
            return None;
        }
        // The same options with a changed scene may cost anything.
        let first_digest = prepared.shot_digest(plan.grid().ok()?.chunk(0));
        (plan.digests.first() == Some(&first_digest)).then_some(plan)
    }

    /// Draws a few frames.
    fn probe(&self, job: &Job, prepared: &PreparedJob, reporter: &ProgressReporter) -> Result<ShotCosts, FarmError> {
        let frames = probe_frames(prepared.frames(), prepared.is_stepped());
        let snapshots = prepared.is_stepped().then(|| self.folder.snapshots());
        let every = prepared.is_stepped().then_some(i64::MAX as u64);
        // Not resumed: what exists already would not be measured.
        let job = Job {
            frames: Some(frames.clone()),
            resume: false,
            snapshots: snapshots.clone(),
            snapshot_every: every,
            ..job.clone()
        };
        let since = Instant::now();
        let clock = || since.elapsed().as_secs_f64();
        let observer = ProbeObserver::new(reporter, &clock);
        let drawn = job.prepare()?;
        drawn.run(&observer)?;
        let largest = frames.iter().map(|&number| file_bytes(&drawn.output().path(number))).max().unwrap_or(0);
        let first = prepared.plan().frames().start;
        let snapshot_bytes = snapshots.map_or(0, |folder| file_bytes(&folder.join(format!("state.{first}.bansho"))));
        Ok(ShotCosts { frame_bytes: largest, snapshot_bytes, ..observer.costs(&frames).unwrap_or_default() })
    }

    /// Writes the plan and its scripts. `memory_bytes` are of a task and of the last job.
    fn write(
        &self,
        plan: &FarmPlan,
        grid: &ChunkGrid,
        memory_bytes: [f64; 2],
        policy: &OverwritePolicy,
    ) -> Result<Planned, FarmError> {
        let states = status::task_states(&self.job, &self.folder, plan)?;
        let missing: Vec<usize> = states.iter().map(|states| FrameCounts::of(states).unfinished()).collect();
        let tasks: Vec<usize> = (0..missing.len()).filter(|&task| missing[task] > 0).collect();
        let frames: usize = missing.iter().sum();
        let chunks = tasks.iter().map(|task| task / plan.tile_count());
        let states = self.folder.snapshots();
        let last_snapshot = if plan.snapshots { task::last_missing_snapshot(&states, grid, chunks) } else { None };
        let snapshots = last_snapshot.map_or(0, |_| grid.snapshot_count());
        let is_complete = tasks.is_empty() && self.is_finished(plan)?;
        if !is_complete {
            // Before anything may fail, so that nothing is measured twice.
            self.folder.write_plan(plan, policy)?;
            let required = plan.costs.required_bytes(frames as u64, snapshots);
            check_space(self.folder.root(), required, available_bytes(self.folder.root()))?;
            let options = self.slurm_options(memory_bytes)?;
            for script in slurm::scripts(plan, &self.folder, &tasks, last_snapshot, &options)? {
                self.folder.write_script(&script, policy)?;
            }
        }
        let summary = summary(plan, tasks.len(), frames, last_snapshot.is_some(), &self.folder);
        Ok(Planned { summary, is_complete })
    }

    /// Whether the last job of an equal plan has made everything.
    fn is_finished(&self, plan: &FarmPlan) -> Result<bool, FarmError> {
        // What tasks reported is of the token of their plan, so the state is asked of that plan if it is of the same frames.
        let earlier = self.folder.read_plan().ok();
        let equal =
            earlier.as_ref().filter(|earlier| (&earlier.digests, &earlier.products) == (&plan.digests, &plan.products));
        Ok(status::status(&self.job, &self.folder, equal.unwrap_or(plan), None)?.is_complete())
    }

    fn slurm_options(&self, [memory_bytes, finish_memory_bytes]: [f64; 2]) -> Result<SlurmOptions, FarmError> {
        let program = self.args.program.clone().map_or_else(env::current_exe, Ok);
        Ok(SlurmOptions {
            program: program.map_err(|source| FarmError::Io { path: self.current.clone(), source })?,
            name: self.job.scene.stem.clone(),
            partition: self.args.partition.clone(),
            cpus: match self.args.render.work.threads {
                Some(threads) => usize::from(threads),
                None => thread::available_parallelism().map_or(1, usize::from),
            },
            memory_bytes,
            finish_memory_bytes,
            sbatch: self.args.sbatch.clone(),
        })
    }
}

/// Size of a file, bytes; 0 where there is none.
fn file_bytes(path: &Path) -> u64 {
    fs::metadata(path).map_or(0, |file| file.len())
}

/// Free bytes on the disk of a folder, or of the nearest folder above it that exists.
fn available_bytes(folder: &Path) -> Option<u64> {
    folder.ancestors().find(|folder| folder.is_dir()).and_then(|folder| fs4::available_space(folder).ok())
}

fn summary(plan: &FarmPlan, tasks: usize, frames: usize, with_snapshots: bool, folder: &FarmFolder) -> String {
    if tasks == 0 {
        return "all frames are whole\n".to_owned();
    }
    let ShotCosts { startup_s, step_s, draw_s, .. } = plan.costs;
    let stepping = if step_s > 0.0 { format!(", {step_s:.2} s a step") } else { String::new() };
    let snapshots = if with_snapshots { ", after a job that writes snapshots" } else { "" };
    format!(
        "{} in {} of up to {}{snapshots}: {}\nmeasured here: {draw_s:.2} s a frame{stepping}, {startup_s:.1} s before the first\n",
        counted(frames, "frame"),
        counted(tasks, "task"),
        counted(plan.chunk_frames as usize, "frame"),
        shown(folder.root())
    )
}
