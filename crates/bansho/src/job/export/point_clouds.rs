//! Simulates a scene and writes its particles, without pictures: `bansho simulate`.

use std::{path::PathBuf, sync::Arc};

use bansho_base::{
    geometry::point_cloud::PointCloud,
    host::observer::{Stage, StageGuard, check},
};
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
    pipeline::{
        draw_frames::advance,
        in_flight::{CompletionGuard, InFlightFrames, StopOnFailure},
        snapshots::Snapshots,
    },
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
        let finished = FinishedFiles::default();
        self.step_and_write(&finished, observer)?;
        let mut frames = self.frames.clone();
        frames.retain(|&number| !finished.is_present(&self.pattern.path(number)));
        if !frames.is_empty() {
            return Err(JobError::FramesLost { frames, files: self.pattern.template_path() });
        }
        Ok(Summary { drawn: self.frames.len(), kept: 0, first_file: self.pattern.path(self.frames[0]) })
    }

    /// Steps to each frame while another thread of the pool encodes and writes the particles of the one before it.
    fn step_and_write(&self, finished: &FinishedFiles, observer: &dyn JobObserver) -> Result<(), JobError> {
        let in_flight = InFlightFrames::default();
        let stop_on_failure = StopOnFailure { observer, in_flight: &in_flight };
        let mut shot = Shot::open(self.compiled.clone(), self.plan.clone());
        let mut last = None;
        let stepped = rayon::in_place_scope_fifo(|scope| {
            for (index, &number) in self.frames.iter().enumerate() {
                check(&stop_on_failure).map_err(|_| JobError::Cancelled)?;
                advance(&mut shot, last, number, &self.snapshots, &stop_on_failure, observer)?;
                last = Some(number);
                // Until the frame before it is written: there is never more than one cloud, and files are written in order.
                in_flight.submit(index, 1, false);
                if in_flight.has_failed() {
                    break;
                }
                let (cloud, in_flight) = (shot.particles(), &in_flight);
                scope.spawn_fifo(move |_| {
                    let _completion = CompletionGuard { in_flight, index };
                    if let Err(error) = self.write(index, cloud, finished, observer) {
                        in_flight.fail(index, error);
                    }
                });
            }
            Ok(())
        });
        // A frame that is not written also cancels the stepping: its failure is the one to report.
        in_flight.take_error(&self.frames).map_or(stepped, Err)
    }

    /// Encodes the particles of the frame at position `index` of the list and writes them.
    fn write(
        &self,
        index: usize,
        cloud: PointCloud,
        finished: &FinishedFiles,
        observer: &dyn JobObserver,
    ) -> Result<(), JobError> {
        let _stage = StageGuard::begin(observer, Stage::Write);
        let (number, encoded) = (self.frames[index], ply::encode(&cloud));
        drop(cloud);
        let path = self.pattern.path(number);
        atomic::write_bytes(&path, &encoded, &self.overwrite)?;
        finished.record(path.clone());
        observer.frame_done(&FrameDone { number, path: Some(path), drawn: index + 1 });
        Ok(())
    }
}

#[cfg(all(test, feature = "fire"))]
mod tests {
    use std::{
        collections::BTreeMap,
        fs,
        path::Path,
        sync::{
            Condvar, Mutex,
            atomic::{AtomicBool, AtomicUsize, Ordering},
        },
        time::Duration,
    };

    use bansho_base::host::observer::{Observer, Unobserved};
    use bansho_media::assets::InputLimits;

    use super::*;

    const GAS: &str =
        "bansho = 2\n[picture]\nsize = [48, 64]\nframes = 6\n[[flame_particles]]\nparticles = 120\npreroll_s = 0.1\n";

    /// Frames 0 to 5 of a small flame, to `p.####.ply` in a folder.
    fn prepared(folder: &Path) -> PreparedSimulation {
        let scene = SceneFile {
            name: "gas.toml".to_owned(),
            stem: "gas".to_owned(),
            folder: folder.to_owned(),
            text: GAS.to_owned(),
            changes: Vec::new(),
            input_limits: InputLimits::default(),
        };
        Simulate::new(scene, folder.join("p.####.ply")).prepare().unwrap()
    }

    fn in_pool<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
    }

    fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
        let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let files = entries.filter(|path| path.is_file());
        files.map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read(path).unwrap())).collect()
    }

    fn names(numbers: impl IntoIterator<Item = i64>) -> Vec<String> {
        numbers.into_iter().map(|number| format!("p.{number:04}.ply")).collect()
    }

    /// Records the frames that are written, and how the stages overlap.
    #[derive(Default)]
    struct StageObserver {
        /// Number of frames to which stepping has begun.
        steps: Mutex<usize>,
        step_begins: Condvar,
        /// Whether each frame but the last is written only while the next one is stepped.
        waits_for_next_step: bool,
        has_waited_in_vain: AtomicBool,
        writing: AtomicUsize,
        max_writing: AtomicUsize,
        written: Mutex<Vec<(i64, usize)>>,
        /// Number of the frame after which the job is canceled.
        cancel_after: Option<i64>,
    }

    impl Observer for StageObserver {
        fn begin(&self, stage: Stage) {
            match stage {
                Stage::Advance => {
                    *self.steps.lock().unwrap() += 1;
                    self.step_begins.notify_all();
                }
                Stage::Write => {
                    let writing = self.writing.fetch_add(1, Ordering::SeqCst) + 1;
                    self.max_writing.fetch_max(writing, Ordering::SeqCst);
                    let steps = (self.written.lock().unwrap().len() + 2).min(6);
                    if self.waits_for_next_step && !self.has_waited_in_vain.load(Ordering::SeqCst) {
                        let guard = self.steps.lock().unwrap();
                        let is_early = |begun: &mut usize| *begun < steps;
                        let timeout = Duration::from_secs(20);
                        let waited = self.step_begins.wait_timeout_while(guard, timeout, is_early).unwrap().1;
                        self.has_waited_in_vain.fetch_or(waited.timed_out(), Ordering::SeqCst);
                    }
                }
                _ => {}
            }
        }

        fn end(&self, stage: Stage) {
            if stage == Stage::Write {
                self.writing.fetch_sub(1, Ordering::SeqCst);
            }
        }

        fn cancelled(&self) -> bool {
            let last = self.written.lock().unwrap().last().map(|&(number, _)| number);
            self.cancel_after.is_some_and(|number| last >= Some(number))
        }
    }

    impl JobObserver for StageObserver {
        fn frame_done(&self, frame: &FrameDone) {
            self.written.lock().unwrap().push((frame.number, frame.drawn));
        }
    }

    #[test]
    fn files_are_those_of_single_frames_in_order_in_any_pool() {
        let folder = tempfile::tempdir().unwrap();
        let simulation = prepared(folder.path());
        let mut shot = Shot::open(simulation.compiled.clone(), simulation.plan.clone());
        let expected: BTreeMap<String, Vec<u8>> = (0..6)
            .map(|number| {
                shot.advance(number, &Unobserved).unwrap();
                (format!("p.{number:04}.ply"), ply::encode(&shot.particles()))
            })
            .collect();
        for threads in [1, 2, 5] {
            let observer = StageObserver::default();
            let summary = in_pool(threads, || simulation.run(&observer)).unwrap();
            assert_eq!((summary.drawn, summary.first_file), (6, folder.path().join("p.0000.ply")));
            assert!(files(folder.path()) == expected, "{threads} threads");
            assert_eq!(
                *observer.written.lock().unwrap(),
                (0..6).map(|number| (number, number as usize + 1)).collect::<Vec<_>>()
            );
        }
    }

    #[test]
    fn the_next_frame_is_stepped_while_one_is_written_and_one_cloud_is_in_memory() {
        let folder = tempfile::tempdir().unwrap();
        let observer = StageObserver { waits_for_next_step: true, ..StageObserver::default() };
        in_pool(3, || prepared(folder.path()).run(&observer)).unwrap();
        assert!(!observer.has_waited_in_vain.into_inner(), "the next frame is stepped after one is written");
        assert_eq!(observer.max_writing.into_inner(), 1);
        assert_eq!(observer.written.into_inner().unwrap().len(), 6);
    }

    #[test]
    fn a_frame_that_cannot_be_written_is_named_and_none_after_it_is_written() {
        for threads in [1, 3] {
            let folder = tempfile::tempdir().unwrap();
            let simulation = prepared(folder.path());
            fs::create_dir(folder.path().join("p.0003.ply")).unwrap();
            let error = in_pool(threads, || simulation.run(&Unobserved)).err().unwrap();
            assert_eq!(error.frame(), Some(3), "{error}");
            assert!(matches!(error.without_frame(), JobError::Media(_)), "{error:?}");
            assert_eq!(files(folder.path()).into_keys().collect::<Vec<_>>(), names(0..3));
        }
    }

    #[test]
    fn finished_files_of_a_canceled_simulation_are_kept_and_no_others_are_begun() {
        for threads in [1, 3] {
            let folder = tempfile::tempdir().unwrap();
            let observer = StageObserver { cancel_after: Some(2), ..StageObserver::default() };
            let error = in_pool(threads, || prepared(folder.path()).run(&observer)).err().unwrap();
            assert!(matches!(error, JobError::ParticlesCancelled), "{error:?}");
            let written = observer.written.into_inner().unwrap().len() as i64;
            // The frame after it may be stepped to by then.
            assert!((3..=4).contains(&written), "{written}");
            assert_eq!(files(folder.path()).into_keys().collect::<Vec<_>>(), names(0..written));
        }
    }
}
