//! The state of all frames of a plan: from the frames themselves and the journals of tasks, and where it can be asked from the batch system, which alone
//! knows that a task was killed.

use std::path::PathBuf;

use bansho::job::{FrameState, Job};
use serde::Serialize;

use super::{
    chunks::ChunkGrid,
    error::FarmError,
    journal::{self, Attempt, Attempts},
    plan::{FarmFolder, FarmPlan},
    slurm::{Queue, QueueState},
    task,
};

/// Numbers of frames by the state of their files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FrameCounts {
    /// Complete, and of this scene and version.
    pub whole: usize,
    /// Without a file.
    pub missing: usize,
    /// Complete, of another scene, other options or another version.
    pub stale: usize,
    /// Truncated or damaged.
    pub damaged: usize,
}

impl FrameCounts {
    /// Counts states.
    pub fn of(states: &[FrameState]) -> Self {
        let mut counts = Self::default();
        for state in states {
            let count = match state {
                FrameState::Whole => &mut counts.whole,
                FrameState::Missing => &mut counts.missing,
                FrameState::Stale => &mut counts.stale,
                FrameState::Damaged => &mut counts.damaged,
            };
            *count += 1;
        }
        counts
    }

    /// Number of frames.
    pub fn total(&self) -> usize {
        self.whole + self.missing + self.stale + self.damaged
    }

    /// Number of frames that must be drawn.
    pub fn unfinished(&self) -> usize {
        self.total() - self.whole
    }
}

/// What became of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TaskState {
    /// All its frames are whole.
    Done,
    /// It has not started, or waits to start again.
    Waiting,
    /// It began and did not end. Unless the batch system was asked, it may have been killed.
    Running,
    /// It ended by itself, and frames are missing.
    Ended,
    /// It began and did not end, and the batch system knows it no longer: it was killed or canceled.
    Lost,
}

/// The state of a task.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TaskStatus {
    /// Its number.
    pub task: usize,
    /// Its first frame.
    pub first: i64,
    /// Its last frame.
    pub last: i64,
    /// The tile that it draws.
    pub tile: usize,
    /// What became of it.
    pub state: TaskState,
    /// Its frames.
    #[serde(flatten)]
    pub frames: FrameCounts,
    /// The attempts at it, in their order.
    pub attempts: Vec<Attempt>,
}

/// The state of the job that comes after all tasks.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "state", rename_all = "lowercase")]
pub enum FinishStatus {
    /// It found all frames whole, and made the film.
    Done,
    /// It failed.
    Failed {
        /// Its message.
        message: String,
    },
    /// It did not run, because what it depends on failed.
    Blocked {
        /// What failed, by the names of journals, and why.
        by: Vec<(String, String)>,
    },
    /// It waits for tasks.
    Waiting,
    /// The batch system knows no job of the plan any longer: they were killed or canceled.
    Lost,
}

/// The state of a plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FarmStatus {
    /// The frames of the shot.
    pub frames: FrameCounts,
    /// The tasks.
    pub tasks: Vec<TaskStatus>,
    /// The job after all tasks.
    pub finish: FinishStatus,
    /// Whether the batch system was asked.
    pub asked: bool,
    /// What the last job makes and has not made: the film, the contact sheet, the files of the flipbook.
    pub unmade: Vec<PathBuf>,
    /// Time of a frame within its task, s, from the journals.
    pub seconds_per_frame: Option<f64>,
    /// Number of tasks that run.
    pub running: usize,
    /// Time until all frames are drawn, s, if as many tasks run as now; of one task where none runs.
    pub seconds_left: Option<f64>,
}

impl FarmStatus {
    /// Whether all frames are whole, and the film, the contact sheet and the flipbook are made.
    pub fn is_complete(&self) -> bool {
        self.frames.unfinished() == 0 && self.unmade.is_empty()
    }
}

/// The job of all frames of `grid`, to ask for their states: a file that Bansho did not make is no obstacle, since nothing is written.
fn asking(job: &Job, grid: &ChunkGrid) -> Job {
    Job { frames: Some(grid.frames().to_vec()), overwrite: true, ..job.clone() }
}

/// The state of each frame of each task, in the order of tasks.
///
/// # Errors
/// The job cannot be prepared, or the plan is damaged.
pub fn task_states(job: &Job, folder: &FarmFolder, plan: &FarmPlan) -> Result<Vec<Vec<FrameState>>, FarmError> {
    let (grid, tiles) = (plan.grid()?, plan.tile_count());
    let mut of_tasks = vec![Vec::new(); plan.task_count()];
    for tile in 0..tiles {
        let job = asking(&task::tile_job(job, folder, plan.tiles, tile)?, &grid);
        let mut states = job.prepare()?.frame_states().into_iter();
        for chunk in 0..grid.count().min(plan.digests.len()) {
            of_tasks[chunk * tiles + tile] = states.by_ref().take(grid.chunk(chunk).len()).collect();
        }
    }
    Ok(of_tasks)
}

/// The chunks of `grid` with frames of `job` that are not whole in all their tiles.
///
/// # Errors
/// The job cannot be prepared.
pub fn unfinished_chunks(
    job: &Job,
    folder: &FarmFolder,
    grid: &ChunkGrid,
    tiles: [usize; 2],
) -> Result<Vec<usize>, FarmError> {
    let mut unfinished = vec![false; grid.count()];
    for tile in 0..tiles[0] * tiles[1] {
        let job = Job { frames: Some(grid.frames().to_vec()), ..task::tile_job(job, folder, tiles, tile)? };
        let mut states = job.prepare()?.frame_states().into_iter();
        for (chunk, unfinished) in unfinished.iter_mut().enumerate() {
            let of_chunk = states.by_ref().take(grid.chunk(chunk).len());
            *unfinished |= of_chunk.filter(|state| *state != FrameState::Whole).count() > 0;
        }
    }
    Ok((0..grid.count()).filter(|&chunk| unfinished[chunk]).collect())
}

/// The state of the frames of a plan, whose job is `job`. `queue` is what the batch system knew before this is called, so that a task that ends meanwhile has
/// written so.
///
/// # Errors
/// The job cannot be prepared, or the plan is damaged.
pub fn status(job: &Job, folder: &FarmFolder, plan: &FarmPlan, queue: Option<&Queue>) -> Result<FarmStatus, FarmError> {
    let (grid, tiles) = (plan.grid()?, plan.tile_count());
    let attempts = journal::read(&folder.journal());
    let states = task_states(job, folder, plan)?;
    let whole_job = asking(job, &grid);
    let frames = match tiles {
        1 => FrameCounts::of(&states.concat()),
        // Tiles count only when they are joined.
        _ => FrameCounts::of(&whole_job.prepare()?.frame_states()),
    };
    let mut tasks = Vec::with_capacity(states.len());
    for (task, states) in states.iter().enumerate() {
        let (chunk, frames) = (grid.chunk(task / tiles), FrameCounts::of(states));
        let attempts = attempts.get(&journal::task_name(task)).cloned().unwrap_or_default();
        tasks.push(TaskStatus {
            task,
            first: chunk.first().copied().unwrap_or(0),
            last: chunk.last().copied().unwrap_or(0),
            tile: task % tiles,
            state: task_state(&frames, attempts.last(), plan, queue.map(|queue| queue.task(task))),
            frames,
            attempts,
        });
    }
    let finish = finish_status(&attempts, &tasks, plan, queue);
    let made = plan.products.paths(&whole_job, &plan.folder)?.into_iter();
    // What is there from before is of other frames, perhaps.
    let unmade = made.filter(|path| finish != FinishStatus::Done || !path.is_file()).collect();
    let seconds_per_frame = seconds_per_frame(&tasks);
    let running = tasks.iter().filter(|task| task.state == TaskState::Running).count();
    let left: usize = tasks.iter().map(|task| task.frames.unfinished()).sum();
    let seconds_left = seconds_per_frame.map(|seconds| seconds * left as f64 / running.max(1) as f64);
    Ok(FarmStatus { frames, tasks, finish, asked: queue.is_some(), unmade, seconds_per_frame, running, seconds_left })
}

/// The mean time of a frame over all attempts that drew any, s: startup and steps of their tasks are part of it.
fn seconds_per_frame(tasks: &[TaskStatus]) -> Option<f64> {
    let (mut drawn, mut seconds) = (0, 0.0);
    for attempt in tasks.iter().flat_map(|task| &task.attempts).filter(|attempt| attempt.drawn > 0) {
        drawn += attempt.drawn;
        seconds += attempt.seconds;
    }
    (drawn > 0).then(|| seconds / drawn as f64)
}

/// What became of a task whose last attempt is `attempt`. `queued` is what the batch system says of it, if it was asked.
fn task_state(
    frames: &FrameCounts,
    attempt: Option<&Attempt>,
    plan: &FarmPlan,
    queued: Option<Option<QueueState>>,
) -> TaskState {
    let attempt = attempt.filter(|attempt| attempt.token == plan.token);
    let has_ended = attempt.map(|attempt| attempt.code.is_some());
    match (frames.unfinished(), queued, has_ended) {
        (0, ..) => TaskState::Done,
        (_, Some(Some(QueueState::Running)), _) => TaskState::Running,
        (_, Some(Some(QueueState::Waiting)), _) | (_, _, None) => TaskState::Waiting,
        (_, _, Some(true)) => TaskState::Ended,
        (_, Some(None), Some(false)) => TaskState::Lost,
        (_, None, Some(false)) => TaskState::Running,
    }
}

/// Why an attempt failed; `None` if it did not, or belongs to an earlier plan.
fn failure(attempt: Option<&Attempt>, plan: &FarmPlan) -> Option<String> {
    let attempt = attempt.filter(|attempt| attempt.token == plan.token)?;
    let code = attempt.code.filter(|&code| code != 0)?;
    Some(format!("exit code {code} on {}: {}", attempt.node, attempt.message.as_deref().unwrap_or("no message")))
}

/// The last attempt at what `name` is about.
fn last_attempt<'a>(attempts: &'a Attempts, name: &str) -> Option<&'a Attempt> {
    attempts.get(name).and_then(|attempts| attempts.last())
}

fn finish_status(attempts: &Attempts, tasks: &[TaskStatus], plan: &FarmPlan, queue: Option<&Queue>) -> FinishStatus {
    let finish = last_attempt(attempts, "finish").filter(|attempt| attempt.token == plan.token);
    match (finish.and_then(|finish| finish.code), failure(finish, plan)) {
        (Some(0), _) => return FinishStatus::Done,
        (_, Some(message)) => return FinishStatus::Failed { message },
        _ => {}
    }
    // The check runs on many machines at once, of which one may fail.
    let checks = attempts.get("check").into_iter().flatten();
    let check = checks.filter_map(|attempt| failure(Some(attempt), plan)).next();
    let before =
        [("check".to_owned(), check), ("snapshots".to_owned(), failure(last_attempt(attempts, "snapshots"), plan))];
    let of_tasks = tasks
        .iter()
        .filter(|task| task.frames.unfinished() > 0)
        .map(|task| (journal::task_name(task.task), failure(task.attempts.last(), plan)));
    let by: Vec<_> = before.into_iter().chain(of_tasks).filter_map(|(name, why)| Some((name, why?))).collect();
    match (by.is_empty(), queue) {
        (false, _) => FinishStatus::Blocked { by },
        (true, Some(queue)) if queue.is_empty() => FinishStatus::Lost,
        (true, _) => FinishStatus::Waiting,
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use bansho::{Unobserved, job::SceneFile, media::files::overwrite_policy::OverwritePolicy};

    use super::*;
    use crate::{
        journal::JournalEvent,
        plan::tests::plan,
        products::{FlipbookRequest, Products},
    };

    const SCENE: &str = "bansho = 2\n[picture]\nsize = [8, 8]\nframes = 10\n";

    /// A job of ten empty frames in `folder`, and its plan of three chunks.
    fn shot(folder: &tempfile::TempDir, text: &str) -> (Job, FarmFolder, FarmPlan) {
        let scene = SceneFile::read_stream("scene", text.as_bytes()).unwrap();
        let out = folder.path().join("a.####.png");
        let farm = FarmFolder::beside(&out);
        let job = Job { out: Some(out), ..Job::new(scene) };
        let plan = plan();
        let prepared = job.prepare().unwrap();
        let digests = (0..3).map(|chunk| prepared.shot_digest(plan.grid().unwrap().chunk(chunk))).collect();
        let plan = FarmPlan { digests, ..plan };
        farm.write_plan(&plan, &OverwritePolicy::default()).unwrap();
        (job, farm, plan)
    }

    fn start(plan: &FarmPlan) -> JournalEvent {
        JournalEvent::Start { node: "n1".into(), token: plan.token.clone(), frames: 4, kept: 0, threads: 1 }
    }

    fn end(code: u8, message: &str) -> JournalEvent {
        JournalEvent::End { code, message: Some(message.into()), seconds: 8.0, cpu_seconds: None }
    }

    #[test]
    fn frames_are_counted_by_their_files() {
        let folder = tempfile::tempdir().unwrap();
        let (job, farm, plan) = shot(&folder, SCENE);
        assert_eq!(
            status(&job, &farm, &plan, None).unwrap().frames,
            FrameCounts { missing: 10, ..FrameCounts::default() }
        );
        task::chunk_job(&job, &farm, &plan, 1).unwrap().run(&Unobserved).unwrap();
        let path = |number: u32| folder.path().join(format!("a.{number:04}.png"));
        // Another seed, which an empty picture does not show, and a truncated file.
        let other = Job { seed: Some(9), frames: Some(vec![0]), ..job.clone() };
        other.prepare().unwrap().run(&Unobserved).unwrap();
        let whole = fs::read(path(5)).unwrap();
        fs::write(path(5), &whole[..whole.len() - 3]).unwrap();
        let found = status(&job, &farm, &plan, None).unwrap();
        assert_eq!(found.frames, FrameCounts { whole: 3, missing: 5, stale: 1, damaged: 1 });
        assert_eq!(found.tasks[1].frames, FrameCounts { whole: 3, damaged: 1, ..FrameCounts::default() });
        assert_eq!((found.tasks[2].first, found.tasks[2].last), (8, 9));
        assert!(!found.is_complete());
        (0..3).for_each(|index| drop(task::chunk_job(&job, &farm, &plan, index).unwrap().run(&Unobserved).unwrap()));
        assert!(status(&job, &farm, &plan, None).unwrap().is_complete());
        // A film from before is not that of these frames, until the last job has run.
        let products = Products { film: Some(folder.path().join("a.mp4")), ..Products::default() };
        let film = FarmPlan { products, ..plan };
        fs::write(folder.path().join("a.mp4"), "an earlier one").unwrap();
        assert!(!status(&job, &farm, &film, None).unwrap().is_complete());
        let journal = journal::Journal::create(&farm.journal(), "finish").unwrap();
        journal.write(&start(&film)).unwrap();
        journal.write(&end(0, "")).unwrap();
        assert!(status(&job, &farm, &film, None).unwrap().is_complete());
        fs::remove_file(folder.path().join("a.mp4")).unwrap();
        assert!(!status(&job, &farm, &film, None).unwrap().is_complete());
    }

    #[test]
    fn tasks_of_a_changed_scene_refuse() {
        let folder = tempfile::tempdir().unwrap();
        let (job, farm, plan) = shot(&folder, SCENE);
        let (changed, ..) = (Job { seed: Some(5), ..job.clone() }, ());
        assert!(matches!(task::chunk_job(&changed, &farm, &plan, 0), Err(FarmError::SceneChanged)));
        assert!(matches!(task::chunk_job(&job, &farm, &plan, 3), Err(FarmError::NoSuchTask { index: 3, count: 3 })));
    }

    #[test]
    fn tiles_have_the_digest_of_the_whole_picture() {
        let folder = tempfile::tempdir().unwrap();
        let (job, farm, plan) = shot(&folder, SCENE);
        let tiled = FarmPlan { tiles: [2, 2], ..plan };
        let prepared = task::chunk_job(&job, &farm, &tiled, 7).unwrap();
        assert_eq!(prepared.frames(), [4, 5, 6, 7]);
        assert_eq!(prepared.output().path(4), folder.path().join("a.farm/tiles/3/a.0004.png"));
    }

    #[test]
    fn the_time_left_follows_from_journals() {
        let folder = tempfile::tempdir().unwrap();
        let (job, farm, plan) = shot(&folder, SCENE);
        for task in 0..2 {
            let journal = journal::Journal::create(&farm.journal(), &journal::task_name(task)).unwrap();
            journal.write(&start(&plan)).unwrap();
            journal.write(&JournalEvent::Frame { number: 0, seconds: 6.0 }).unwrap();
        }
        let found = status(&job, &farm, &plan, None).unwrap();
        // 10 frames of 6 s by two tasks.
        assert_eq!((found.running, found.seconds_left), (2, Some(30.0)));
        assert_eq!(found.finish, FinishStatus::Waiting);
    }

    #[test]
    fn what_failed_is_why_the_last_job_did_not_run() {
        let folder = tempfile::tempdir().unwrap();
        let (job, farm, plan) = shot(&folder, SCENE);
        let write = |name: &str, event: JournalEvent| {
            let journal = journal::Journal::create(&farm.journal(), name).unwrap();
            journal.write(&start(&plan)).unwrap();
            journal.write(&event).unwrap();
        };
        write("task-2", end(143, "stopped"));
        write("task-1", end(1, "disk full"));
        write("task-1", JournalEvent::Frame { number: 4, seconds: 1.0 });
        let FinishStatus::Blocked { by } = status(&job, &farm, &plan, None).unwrap().finish else {
            panic!("a task failed")
        };
        assert_eq!(by, [("task-2".to_owned(), "exit code 143 on n1: stopped".to_owned())], "task 1 was begun again");
        // A plan that was submitted again knows nothing of it.
        let again = FarmPlan { token: "new".into(), ..plan.clone() };
        assert_eq!(status(&job, &farm, &again, None).unwrap().finish, FinishStatus::Waiting);
        write("finish", end(0, ""));
        assert_eq!(status(&job, &farm, &plan, None).unwrap().finish, FinishStatus::Done);
    }

    #[test]
    fn a_task_that_the_batch_system_does_not_know_is_lost() {
        let folder = tempfile::tempdir().unwrap();
        let (job, farm, plan) = shot(&folder, SCENE);
        for task in 0..2 {
            let journal = journal::Journal::create(&farm.journal(), &journal::task_name(task)).unwrap();
            journal.write(&start(&plan)).unwrap();
        }
        let found = |listed: Option<&str>| {
            let queue = listed.map(|listed| Queue::of_slurm("frames 5\nfinish 6\n", listed));
            let found = status(&job, &farm, &plan, queue.as_ref()).unwrap();
            let states: Vec<TaskState> = found.tasks.iter().map(|task| task.state).collect();
            (states, found.running, found.finish)
        };
        use TaskState::{Lost, Running, Waiting};
        assert_eq!(found(None), (vec![Running, Running, Waiting], 2, FinishStatus::Waiting));
        let listed = "5 0 RUNNING\n5 2 PENDING\n6 N/A PENDING\n";
        assert_eq!(found(Some(listed)), (vec![Running, Lost, Waiting], 1, FinishStatus::Waiting));
        assert_eq!(found(Some("5 0 PENDING\n5 1 RUNNING\n")).0, [Waiting, Running, Waiting], "task 0 was requeued");
        assert_eq!(found(Some("")), (vec![Lost, Lost, Waiting], 0, FinishStatus::Lost));
        // One that failed says so, whatever the batch system has forgotten.
        let journal = journal::Journal::create(&farm.journal(), "task-1").unwrap();
        journal.write(&start(&plan)).unwrap();
        journal.write(&end(1, "disk full")).unwrap();
        let (states, _, finish) = found(Some(""));
        assert_eq!(states[1], TaskState::Ended);
        assert!(matches!(finish, FinishStatus::Blocked { .. }));
    }

    #[test]
    fn all_files_of_a_flipbook_must_be_there() {
        let folder = tempfile::tempdir().unwrap();
        let (job, farm, plan) = shot(&folder, SCENE);
        (0..3).for_each(|index| drop(task::chunk_job(&job, &farm, &plan, index).unwrap().run(&Unobserved).unwrap()));
        let flipbook = Some(FlipbookRequest { path: folder.path().join("flip.png"), grid: [3, 2], tile: None });
        let plan = FarmPlan { products: Products { flipbook, ..Products::default() }, ..plan };
        let journal = journal::Journal::create(&farm.journal(), "finish").unwrap();
        journal.write(&start(&plan)).unwrap();
        crate::finish::finish(&job, &farm, &plan, &Unobserved).unwrap();
        let unmade = || status(&job, &farm, &plan, None).unwrap().unmade.len();
        assert_eq!(unmade(), 4, "until the last job says that these are of this plan");
        journal.write(&end(0, "")).unwrap();
        assert_eq!(unmade(), 0);
        fs::remove_file(folder.path().join("flip_motion.png")).unwrap();
        assert_eq!(unmade(), 1);
        assert!(!status(&job, &farm, &plan, None).unwrap().is_complete());
    }
}
