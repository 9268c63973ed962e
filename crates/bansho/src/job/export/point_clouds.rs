//! Simulates a scene and writes its particles, without pictures: `bansho simulate`.

use std::{path::PathBuf, sync::Arc};

use bansho_base::host::observer::{Stage, StageGuard, check};
use bansho_media::{
    files::{atomic, naming::NumberedPath, overwrite_policy::OverwritePolicy},
    ply,
};
use bansho_render::{CompiledScene, Plan, PlanOptions, Shot};
use bansho_scene::SceneOptions;

use crate::job::{
    checks::{finished_files::FinishedFiles, outputs},
    error::{JobError, OptionError},
    observer::{FrameDone, JobObserver, JobStarted, Warning},
    pipeline::snapshots::Snapshots,
    render::{
        Summary,
        prepare::{SnapshotOptions, outside_range, selected_frames},
    },
    scene_file::SceneFile,
};

/// A simulation whose particles are written. Create it with [`Simulate::new`].
#[derive(Clone, Debug)]
pub struct Simulate {
    /// The scene.
    pub scene: SceneFile,
    /// The output files, such as `gas.####.ply`.
    pub particles: PathBuf,
    /// Frame numbers; `None` for all frames of the scene.
    pub frames: Option<Vec<i64>>,
    /// Replaces the scene's seed.
    pub seed: Option<u64>,
    /// Folder of snapshots.
    pub snapshots: Option<PathBuf>,
    /// Frames between snapshots; `None` for one snapshot a second.
    pub snapshot_every: Option<u64>,
    /// Whether files that Bansho did not make may be overwritten. Files that the scene is read from never are.
    pub overwrite: bool,
}

/// A checked simulation, ready to run.
pub struct PreparedSimulation {
    compiled: Arc<CompiledScene>,
    plan: Arc<Plan>,
    frames: Vec<i64>,
    pattern: NumberedPath,
    snapshots: Snapshots,
    overwrite: OverwritePolicy,
    warnings: Vec<Warning>,
}

impl Simulate {
    /// Writes all frames of `scene` to `particles`.
    pub fn new(scene: SceneFile, particles: PathBuf) -> Self {
        Self { scene, particles, frames: None, seed: None, snapshots: None, snapshot_every: None, overwrite: false }
    }

    /// Checks everything and writes nothing.
    ///
    /// # Errors
    /// The first obstacle: an invalid scene, a scene without particles, a name that cannot be used.
    pub fn prepare(&self) -> Result<PreparedSimulation, JobError> {
        let options = SceneOptions { seed: self.seed, ..SceneOptions::default() };
        let compiled = self.scene.compile(self.scene.parse()?.with_options(&options)?, &self.scene.assets())?;
        let plan = Arc::new(Plan::new(&compiled, &PlanOptions::default())?);
        if Shot::open(compiled.clone(), plan.clone()).point_clouds().is_empty() {
            return Err(OptionError::NoParticles.into());
        }
        let frames = selected_frames(self.frames.as_deref(), &plan)?;
        let pattern = NumberedPath::parse(&self.particles, "ply", frames.len())?;
        outputs::check_writable(&pattern.path(frames[0]))?;
        let overwrite = OverwritePolicy::new(outputs::input_files(&self.scene, &plan, &frames), self.overwrite);
        outputs::check_overwriting(&overwrite, frames.iter().map(|&number| pattern.path(number)))?;
        let snapshots = SnapshotOptions { folder: self.snapshots.as_deref(), interval: self.snapshot_every };
        let snapshots = snapshots.prepare(&compiled, &plan, &overwrite)?;
        let warnings = outside_range(&plan, &frames).into_iter().collect();
        Ok(PreparedSimulation { compiled, plan, frames, pattern, snapshots, overwrite, warnings })
    }
}

impl PreparedSimulation {
    /// Simulates and writes everything, in the caller's rayon pool.
    ///
    /// # Errors
    /// The observer canceled the job, or a file cannot be written; finished files are kept. Or finished files were removed or changed before
    /// the job ended.
    pub fn run(&self, observer: &dyn JobObserver) -> Result<Summary, JobError> {
        self.simulate(observer).map_err(|error| match error {
            JobError::Cancelled => JobError::ParticlesCancelled,
            other => other,
        })
    }

    fn simulate(&self, observer: &dyn JobObserver) -> Result<Summary, JobError> {
        self.warnings.iter().for_each(|warning| observer.warning(warning));
        let size = [self.plan.window().width, self.plan.window().height];
        observer.started(&JobStarted { frames: self.frames.len(), kept: 0, size });
        let mut shot = Shot::open(self.compiled.clone(), self.plan.clone());
        let (mut last, finished) = (None, FinishedFiles::default());
        for (index, &number) in self.frames.iter().enumerate() {
            check(observer).map_err(|_| JobError::Cancelled)?;
            let mut told = Vec::new();
            if last.is_none_or(|last| number != last + 1) {
                told = self.snapshots.warm_up(&mut shot, last, number, observer, observer)?;
            }
            shot.advance(number, observer).map_err(|error| JobError::from(error).in_frame(number))?;
            self.snapshots.save(&shot, number, &told, observer, observer)?;
            last = Some(number);
            let _stage = StageGuard::begin(observer, Stage::Write);
            let path = self.pattern.path(number);
            atomic::write_bytes(&path, &ply::encode(&shot.particles()), &self.overwrite)
                .map_err(|error| JobError::from(error).in_frame(number))?;
            finished.record(path.clone());
            observer.frame_done(&FrameDone { number, path: Some(path), drawn: index + 1 });
        }
        let mut frames = self.frames.clone();
        frames.retain(|&number| !finished.is_present(&self.pattern.path(number)));
        if !frames.is_empty() {
            return Err(JobError::FramesLost { frames, files: self.pattern.template_path() });
        }
        Ok(Summary { drawn: self.frames.len(), kept: 0, first_file: self.pattern.path(self.frames[0]) })
    }
}
