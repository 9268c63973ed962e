//! Measures one scene.

use std::{fs, path::Path, sync::Arc};

use bansho::{
    AlphaConvention, BitDepth, Observer, Plan, PlanOptions, Shot, Stage, StagePart, View,
    base::{
        camera::Lens,
        host::stage_times::{PartTimes, StageTimes},
    },
    compile_scene, display,
    media::assets::FileAssets,
};

use crate::{arguments::Arguments, clock::thread_time, pan::pan};

/// The times of a scene, ms.
pub(crate) struct SceneTimes {
    pub(crate) name: String,
    pub(crate) size: [usize; 2],
    /// Parsing the scene and building its phenomena.
    pub(crate) compile_ms: f64,
    /// Exposure, and the start of a loop.
    pub(crate) plan_ms: f64,
    /// The simulations' way to the first frame.
    pub(crate) preroll_ms: f64,
    /// Preparing and drawing the first frame, which fills caches.
    pub(crate) first_frame_ms: f64,
    pub(crate) still: FrameTimes,
    /// While the camera pans.
    pub(crate) pan: FrameTimes,
}

/// The times of one frame, ms: medians.
pub(crate) struct FrameTimes {
    /// Steps, preparation, drawing and view transform, on the thread that asks for them.
    pub(crate) total_ms: f64,
    pub(crate) view_ms: f64,
    pub(crate) parts: Vec<PartMedian>,
}

/// The time of a phenomenon in a stage, ms.
pub(crate) struct PartMedian {
    pub(crate) stage: Stage,
    pub(crate) phenomenon: Option<String>,
    pub(crate) is_mirrored: bool,
    pub(crate) ms: f64,
}

/// Observes parts by the CPU time of their threads.
#[derive(Default)]
struct PartObserver(StageTimes);

impl Observer for PartObserver {
    fn begin(&self, stage: Stage) {
        self.0.begin(stage, thread_time());
    }
    fn end(&self, stage: Stage) {
        self.0.end(stage, thread_time());
    }
    fn begin_part(&self, part: StagePart) {
        self.0.begin_part(part, thread_time());
    }
    fn end_part(&self, part: StagePart) {
        self.0.end_part(part, thread_time());
    }
}

/// Measures a scene, in the caller's pool.
pub(crate) fn scene(file: &Path, arguments: &Arguments) -> Result<SceneTimes, String> {
    let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let in_scene = |error: &dyn std::fmt::Display| format!("{name}: {error}");
    let text = fs::read_to_string(file).map_err(|error| in_scene(&error))?;
    let assets = Arc::new(FileAssets::new(file.parent().unwrap_or(Path::new(""))));
    let (compiled, compile_ms) = timed(|| compile_scene(&name, &text, assets));
    let compiled = compiled.map_err(|error| in_scene(&error))?;
    let is_dome = compiled.scene().camera.lens == Lens::Fisheye;
    let size = if is_dome { [arguments.dome_size; 2] } else { arguments.size };
    let options = PlanOptions { size: Some(size), ..PlanOptions::default() };
    let (plan, plan_ms) = timed(|| Plan::new(&compiled, &options));
    let plan = plan.map_err(|error| in_scene(&error))?;
    let first = plan.frames().start;
    let panning = moving(&plan, first + 2 * arguments.frames + 3);
    let mut shot = Shot::open(compiled, Arc::new(plan));
    let (advanced, preroll_ms) = timed(|| shot.advance(first, &bansho::Unobserved));
    advanced.map_err(|error| in_scene(&error))?;
    let (drawn, first_frame_ms) = timed(|| frame(&mut shot, first, &PartObserver::default()));
    drawn.map_err(|error| in_scene(&error))?;
    let count = arguments.frames;
    let still = frames(&mut shot, first + 1, count).map_err(|error| in_scene(&error))?;
    shot.replace_plan(Arc::new(panning));
    let pan = frames(&mut shot, first + count + 2, count).map_err(|error| in_scene(&error))?;
    Ok(SceneTimes { name, size, compile_ms, plan_ms, preroll_ms, first_frame_ms, still, pan })
}

/// The same plan with a camera that pans until frame `end`.
fn moving(plan: &Plan, end: i64) -> Plan {
    let end_s = plan.frames().map(|number| plan.time(number)).fold(plan.time(end.min(plan.frames().end)), f64::max);
    let mut moving = plan.clone();
    moving.camera = pan(&plan.camera, end_s);
    moving
}

/// Measures `count` frames after frame `start`, which is drawn before them: a camera that begins to move fills caches again.
fn frames(shot: &mut Shot, start: i64, count: i64) -> Result<FrameTimes, bansho::RenderError> {
    let observer = PartObserver::default();
    let (mut totals, mut views) = (Vec::new(), Vec::new());
    frame(shot, start, &bansho::Unobserved)?;
    for number in start + 1..=start + count {
        let (view_ms, total_ms) = timed(|| frame(shot, number, &observer));
        totals.push(total_ms);
        views.push(view_ms?);
    }
    let part = |part: PartTimes| {
        let PartTimes { stage, phenomenon, is_mirrored, frames } = part;
        PartMedian { stage, phenomenon, is_mirrored, ms: 1e3 * median(&frames) }
    };
    let parts = observer.0.parts().into_iter().map(part).collect();
    Ok(FrameTimes { total_ms: median(&totals), view_ms: median(&views), parts })
}

/// Draws a frame, and returns the time of its view transform, ms.
fn frame(shot: &mut Shot, number: i64, observer: &dyn Observer) -> Result<f64, bansho::RenderError> {
    let frame = bansho::draw(shot, number, observer)?;
    let (picture, view_ms) = timed(|| display(&frame, &View::DISPLAY, BitDepth::Eight, AlphaConvention::Encoded));
    std::hint::black_box(picture);
    shot.recycle(frame);
    Ok(view_ms)
}

/// The result of some work, and its CPU time on this thread, ms.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = thread_time();
    let result = work();
    (result, 1e3 * (thread_time() - start).as_secs_f64())
}

/// The median; of an even count, the upper one; 0 of nothing.
pub(crate) fn median(numbers: &[f64]) -> f64 {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}
