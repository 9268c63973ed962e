//! Renders a frame or the shot to files, as `bansho render` does, on a thread of its own.

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread::JoinHandle,
};

use bansho::{
    Observer,
    job::{FrameDone, Job, JobError, JobObserver, JobStarted, SceneFile},
    media::{assets::InputLimits, files::naming::default_sequence},
};

/// A running job.
pub struct RenderJob {
    progress: Arc<Progress>,
    worker: Option<JoinHandle<Result<PathBuf, String>>>,
}

/// Why a job ended early.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum JobFailure {
    /// It failed or was stopped.
    Failed(String),
    /// A phenomenon panicked with this message.
    Panicked(String),
}

struct Progress {
    total: AtomicUsize,
    done: AtomicUsize,
    stop: AtomicBool,
    wake: Mutex<Box<dyn Fn() + Send>>,
}

impl Observer for Progress {
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

impl JobObserver for Progress {
    fn started(&self, started: &JobStarted) {
        self.total.store(started.frames, Ordering::Relaxed);
        self.done.store(started.kept, Ordering::Relaxed);
    }

    fn frame_done(&self, _frame: &FrameDone) {
        self.done.fetch_add(1, Ordering::Relaxed);
        self.wake();
    }
}

impl Progress {
    fn wake(&self) {
        self.wake.lock().unwrap_or_else(PoisonError::into_inner)();
    }
}

/// The job that renders `text` as if it were the file `path`, into `out/` beside it: all frames that do not exist yet, or only `number`.
pub fn job(text: &str, path: &Path, number: Option<i64>) -> Job {
    let scene = SceneFile {
        name: path.display().to_string(),
        stem: path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
        folder: path.parent().map(Path::to_path_buf).unwrap_or_default(),
        text: text.to_owned(),
        changes: Vec::new(),
        input_limits: InputLimits::default(),
    };
    let out = scene.folder.join("out").join(&scene.stem).join(default_sequence(&scene.stem));
    Job { resume: number.is_none(), frames: number.map(|number| vec![number]), out: Some(out), ..Job::new(scene) }
}

impl RenderJob {
    /// Starts `job`; `wake` is called after every frame and at the end.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn start(job: Job, wake: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let progress = Arc::new(Progress {
            total: AtomicUsize::new(0),
            done: AtomicUsize::new(0),
            stop: AtomicBool::new(false),
            wake: Mutex::new(Box::new(wake)),
        });
        let watched = progress.clone();
        let worker = std::thread::Builder::new().name("render".into()).spawn(move || {
            let result = job.prepare().and_then(|prepared| prepared.run(watched.as_ref()));
            watched.wake();
            result.map(|summary| summary.first_file).map_err(|error| match error {
                JobError::Cancelled => "stopped; whole frames stay, and rendering the shot goes on from there".into(),
                error => error.to_string(),
            })
        })?;
        Ok(Self { progress, worker: Some(worker) })
    }

    /// Number of frames done, and in total.
    pub fn progress(&self) -> [usize; 2] {
        [&self.progress.done, &self.progress.total].map(|count| count.load(Ordering::Relaxed))
    }

    /// Requests it to stop; finished frames stay.
    pub fn stop(&self) {
        self.progress.stop.store(true, Ordering::Relaxed);
    }

    /// The first written file, or the error, once the job has ended.
    pub fn finished(&mut self) -> Option<Result<PathBuf, JobFailure>> {
        let worker = self.worker.take_if(|worker| worker.is_finished())?;
        Some(match worker.join() {
            Ok(result) => result.map_err(JobFailure::Failed),
            Err(panic) => Err(JobFailure::Panicked(super::panic_message(panic.as_ref()))),
        })
    }
}

impl Drop for RenderJob {
    fn drop(&mut self) {
        self.stop();
    }
}
