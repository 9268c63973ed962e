//! Writing files: the job of `bansho render`.

use std::{
    path::PathBuf,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
};

use bansho::{
    BitDepth, Observer, Rect,
    job::{FrameDone, Job, JobObserver, JobStarted, SceneFile, Warning},
    media::assets::InputLimits,
};
use pyo3::prelude::*;

use crate::{error, frame, shot, work};

/// What Python is told of a job while it runs.
#[derive(Default)]
struct Progress {
    frames: AtomicUsize,
    done: AtomicUsize,
    warnings: Mutex<Vec<String>>,
}

/// Passes what a job reports on, and asks it to stop after a signal.
struct Reporter<'a> {
    progress: &'a Progress,
    interruption: &'a work::Interruption,
}

impl Observer for Reporter<'_> {
    fn cancelled(&self) -> bool {
        self.interruption.cancelled()
    }
}

impl JobObserver for Reporter<'_> {
    fn started(&self, started: &JobStarted) {
        self.progress.frames.store(started.frames, Ordering::Relaxed);
        self.progress.done.store(started.kept, Ordering::Relaxed);
    }

    fn frame_done(&self, _frame: &FrameDone) {
        self.progress.done.fetch_add(1, Ordering::Relaxed);
    }

    fn warning(&self, warning: &Warning) {
        let mut warnings = self.progress.warnings.lock().unwrap_or_else(PoisonError::into_inner);
        warnings.push(warning.to_string());
    }
}

/// Writes frames of a scene to files, as `bansho render` does. Returns the file of the first frame, and the warnings.
#[pyfunction]
#[pyo3(signature = (text, name, folder, out, *, frames, size, seed, loop_s, crop, backdrop, layers, aovs, metadata, view, glare, bits, alpha, overwrite, resume, threads, progress))]
#[allow(clippy::fn_params_excessive_bools, reason = "keywords of Python")]
pub(crate) fn write_files(
    py: Python<'_>,
    text: String,
    name: String,
    folder: PathBuf,
    out: PathBuf,
    frames: Option<Vec<i64>>,
    size: Option<[usize; 2]>,
    seed: Option<u64>,
    loop_s: Option<f64>,
    crop: Option<[usize; 4]>,
    backdrop: bool,
    layers: bool,
    aovs: bool,
    metadata: bool,
    view: Option<&str>,
    glare: bool,
    bits: u8,
    alpha: Option<&str>,
    overwrite: bool,
    resume: bool,
    threads: Option<i64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(PathBuf, Vec<String>)> {
    let bits = match bits {
        8 => BitDepth::Eight,
        16 => BitDepth::Sixteen,
        _ => return Err(error::value(format!("bits: {bits}; allowed: 8, 16"))),
    };
    let stem =
        PathBuf::from(&name).file_stem().map_or_else(|| name.clone(), |stem| stem.to_string_lossy().into_owned());
    let scene = SceneFile { name, stem, folder, text, changes: Vec::new(), input_limits: InputLimits::default() };
    let job = Job {
        frames,
        size,
        crop: crop.map(|[x, y, width, height]| Rect { x, y, width, height }),
        seed,
        loop_s,
        transparent: !backdrop,
        layers,
        aovs,
        metadata,
        view: view.map(shot::parse_view).transpose()?,
        scene_linear_glare: glare,
        bits,
        alpha: alpha.map(frame::parse_alpha).transpose()?,
        out: Some(out),
        resume,
        overwrite,
        ..Job::new(scene)
    };
    let reported = Progress::default();
    let told = AtomicUsize::new(usize::MAX);
    let poll = |py: Python<'_>| {
        let (done, frames) = (reported.done.load(Ordering::Relaxed), reported.frames.load(Ordering::Relaxed));
        match &progress {
            Some(callback) if frames > 0 && told.swap(done, Ordering::Relaxed) != done => {
                callback.call1(py, (done, frames)).map(drop)
            }
            _ => Ok(()),
        }
    };
    let summary = work::run_and_poll(py, work::thread_count(threads)?, poll, |interruption| {
        job.prepare()?.run(&Reporter { progress: &reported, interruption })
    })?;
    let summary = summary.map_err(|failed| error::job(&failed))?;
    let warnings = reported.warnings.lock().unwrap_or_else(PoisonError::into_inner).clone();
    Ok((summary.first_file, warnings))
}
