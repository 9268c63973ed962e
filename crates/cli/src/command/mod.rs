//! The commands of the program. Those that are a single job, or a single call, are here.

pub(crate) mod check;
pub(crate) mod farm;
pub(crate) mod generated;
pub(crate) mod new;
pub(crate) mod plot;
pub(crate) mod studio;

use anyhow::{Context, ensure};
use bansho::{
    aurora::physics::{
        atmosphere::atmosphere,
        calibration::{self, CalibrationCheck},
    },
    base::math::simd::set_vector_level,
    job::JobError,
};

use crate::{
    args::{FlipbookArgs, RenderArgs, SimulateArgs, StreaksArgs, WorkArgs},
    interrupt,
    output::print,
    progress::{JobResult, ProgressReporter},
};

/// A pool of so many threads; of one for each core if there is no number.
fn thread_pool(threads: Option<u16>) -> anyhow::Result<rayon::ThreadPool> {
    let count = threads.map_or(0, usize::from);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
    pool.with_context(|| match threads {
        Some(count) => format!("--threads {count}: the system cannot start that many threads; allowed: fewer"),
        None => "the system cannot start one thread per core; --threads sets their number".to_owned(),
    })
}

/// Runs a job in a thread pool of its own, and reports its progress and its result.
fn run_job(
    args: &WorkArgs,
    job: impl FnOnce(&ProgressReporter) -> Result<JobResult, JobError> + Send,
) -> anyhow::Result<()> {
    set_vector_level(args.vector_level)?;
    let reporter = ProgressReporter::new(args.progress, args.stats);
    interrupt::set_grace_period(reporter.forced_exit_message());
    let pool = thread_pool(args.threads)?;
    let result = pool.install(|| job(&reporter));
    reporter.finish(result, pool.current_num_threads())
}

/// `bansho render`: draws a scene to files.
pub(crate) fn render(args: &RenderArgs) -> anyhow::Result<()> {
    run_job(&args.work, |reporter| {
        let job = args.job()?.prepare()?;
        reporter.set_estimated_memory(job.memory_bytes());
        reporter.set_frames_in_flight(job.frames_in_flight());
        let summary = job.run(reporter)?;
        Ok(JobResult { unit: "frame", drawn: summary.drawn, kept: summary.kept, files: vec![summary.first_file] })
    })
}

/// `bansho flipbook`: draws a scene as a flipbook for game engines.
pub(crate) fn flipbook(args: &FlipbookArgs) -> anyhow::Result<()> {
    run_job(&args.work, |reporter| {
        let flipbook = args.flipbook()?.prepare()?;
        let frames = flipbook.frame_count();
        reporter.set_frames_in_flight(flipbook.frames_in_flight());
        let summary = flipbook.run(reporter)?;
        Ok(JobResult { unit: "frame", drawn: frames, kept: 0, files: summary.files })
    })
}

/// `bansho simulate`: simulates a scene and writes its particles.
pub(crate) fn simulate(args: &SimulateArgs) -> anyhow::Result<()> {
    run_job(&args.work, |reporter| {
        let summary = args.simulation()?.prepare()?.run(reporter)?;
        Ok(JobResult { unit: "frame", drawn: summary.drawn, kept: summary.kept, files: vec![summary.first_file] })
    })
}

/// `bansho streaks`: writes streak textures of rain.
pub(crate) fn streaks(args: &StreaksArgs) -> anyhow::Result<()> {
    run_job(&args.work, |reporter| {
        let streaks = args.streaks().prepare()?;
        let index = streaks.run(reporter)?;
        Ok(JobResult { unit: "texture", drawn: streaks.texture_count(), kept: 0, files: vec![index] })
    })
}

/// `bansho calibrate`: prints the calibration of the aurora's light, and checks it against observations.
pub(crate) fn calibrate() -> anyhow::Result<()> {
    let calibration = calibration::calibrate(atmosphere());
    print(&calibration.to_string())?;
    let failed = calibration.checks.iter().filter(|check| !CalibrationCheck::holds(check)).count();
    ensure!(failed == 0, "{failed} of {} requirements are not met", calibration.checks.len());
    Ok(())
}
