//! Particles to files, without pictures: what `bansho simulate` does.

use std::{path::PathBuf, sync::Arc};

use bansho_base::host::observer::{Stage, StageGuard, check};
use bansho_media::{
    files::{atomic, naming::NumberedPath, overwrite_policy::OverwritePolicy},
    ply,
};
use bansho_render::{CompiledScene, Plan, PlanOptions, Shot};
use bansho_scene::SceneOptions;

use crate::job::{
    checks::overwrite,
    error::{Conflict, JobError},
    observer::{FrameDone, JobObserver, Note, Outline},
    render::{
        Summary,
        finished_files::Finished,
        output,
        prepare::{assets, chosen_frames, outside, snapshots},
    },
    scene_file::SceneFile,
    snapshots::Snapshots,
};

/// Which particles are wanted, and where they go. Begin with [`Simulate::new`].
#[derive(Clone, Debug)]
pub struct Simulate {
    /// The scene.
    pub scene: SceneFile,
    /// Where particles go, such as `gas.####.ply`.
    pub particles: PathBuf,
    /// Frame numbers; the whole shot when left out.
    pub frames: Option<Vec<i64>>,
    /// Another seed than the scene's.
    pub seed: Option<u64>,
    /// Folder of snapshots.
    pub snapshots: Option<PathBuf>,
    /// Frames between snapshots; a second's worth when left out.
    pub snapshot_every: Option<u64>,
    /// Whether files that Bansho did not make may be written over. What the scene is read from never is.
    pub overwrite: bool,
}

/// A simulation that can be carried out, as far as can be known without doing so.
pub struct PreparedSimulation {
    compiled: Arc<CompiledScene>,
    plan: Arc<Plan>,
    frames: Vec<i64>,
    pattern: NumberedPath,
    snapshots: Snapshots,
    overwrite: OverwritePolicy,
    notes: Vec<Note>,
}

impl Simulate {
    /// All frames of `scene` to `particles`.
    pub fn new(scene: SceneFile, particles: PathBuf) -> Self {
        Self { scene, particles, frames: None, seed: None, snapshots: None, snapshot_every: None, overwrite: false }
    }

    /// Checks everything and writes nothing.
    ///
    /// # Errors
    /// The first thing that stands in the way: faults of the scene, a scene without particles, a name that cannot be used.
    pub fn prepare(&self) -> Result<PreparedSimulation, JobError> {
        let options = SceneOptions { seed: self.seed, ..SceneOptions::default() };
        let compiled = self.scene.compile(self.scene.parse()?.adapted(&options)?, &assets(&self.scene))?;
        let plan = Arc::new(Plan::new(&compiled, &PlanOptions::default())?);
        if compiled.phenomena().all(|phenomenon| phenomenon.clone().start().export(0.0).is_none()) {
            return Err(Conflict::NoParticles.into());
        }
        let frames = chosen_frames(self.frames.as_deref(), &plan)?;
        let pattern = NumberedPath::parse(&self.particles, "ply", frames.len())?;
        output::check_writable(&pattern.path(frames[0]))?;
        let overwrite = OverwritePolicy::new(overwrite::inputs(&self.scene, &plan, &frames), self.overwrite);
        overwrite::check(&overwrite, frames.iter().map(|&number| pattern.path(number)))?;
        let snapshots = snapshots(self.snapshots.as_deref(), self.snapshot_every, (&compiled, &plan), &overwrite)?;
        let notes = outside(&plan, &frames).into_iter().collect();
        Ok(PreparedSimulation { compiled, plan, frames, pattern, snapshots, overwrite, notes })
    }
}

impl PreparedSimulation {
    /// Simulates and writes everything, in the caller's rayon pool.
    ///
    /// # Errors
    /// The observer asked to stop, or the first file that cannot be written. Files that were finished stay, whole. Files that were finished
    /// and are there no longer when all are.
    pub fn run(&self, observer: &dyn JobObserver) -> Result<Summary, JobError> {
        self.simulate(observer).map_err(|error| match error {
            JobError::Cancelled => JobError::ParticlesCancelled,
            other => other,
        })
    }

    fn simulate(&self, observer: &dyn JobObserver) -> Result<Summary, JobError> {
        self.notes.iter().for_each(|note| observer.note(note));
        let size = [self.plan.window().width, self.plan.window().height];
        observer.started(&Outline { total: self.frames.len(), kept: 0, size });
        let mut shot = Shot::open(self.compiled.clone(), self.plan.clone());
        let (mut last, finished) = (None, Finished::default());
        for (index, &number) in self.frames.iter().enumerate() {
            check(observer).map_err(|_| JobError::Cancelled)?;
            if last.is_none_or(|last| number != last + 1) {
                self.snapshots.warm_up(&mut shot, last, number, observer, observer)?;
            }
            shot.advance(number, observer)?;
            self.snapshots.keep(&shot, number, observer)?;
            last = Some(number);
            let _stage = StageGuard::begin(observer, Stage::Write);
            let path = self.pattern.path(number);
            atomic::write_bytes_with(&path, &ply::encode(&shot.particles()), &self.overwrite)?;
            finished.note(path.clone());
            observer.frame_done(&FrameDone { number, path: Some(path), drawn: index + 1 });
        }
        let lost = |&&number: &&i64| !finished.is_there(&self.pattern.path(number));
        let frames: Vec<i64> = self.frames.iter().filter(lost).copied().collect();
        if !frames.is_empty() {
            return Err(JobError::FramesLost { frames, files: self.pattern.template_path() });
        }
        Ok(Summary { drawn: self.frames.len(), kept: 0, first_file: self.pattern.path(self.frames[0]) })
    }
}
