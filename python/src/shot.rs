//! A shot of a scene: its frames as light and as display codes, and what is in them as data.

use std::sync::Arc;

use bansho::{
    BitDepth, CompiledScene, DisplayOptions, GlareUse, Plan, PlanOptions, Rect, RenderError, SceneLinear, SceneOptions,
    View, ViewName,
    base::phenomenon::surroundings::Emitter,
    job::{FramesInFlight, OptionError},
};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    assets::Arrays,
    error, frame,
    frame_stream::{FrameNumbers, FrameStream},
    scene, work,
};

/// A shot: `bansho.Shot` is the class that users see.
#[pyclass(module = "bansho._bansho", frozen)]
pub(crate) struct Shot {
    shot: work::PoolMutex<bansho::Shot>,
    compiled: Arc<CompiledScene>,
    /// The tasks of all streams of frames, which share the caches of the compiled scene with `shot`.
    stream_tasks: Arc<work::TaskCount>,
    /// The plan of light, as for EXR files.
    light: Arc<Plan>,
    /// The plan of display codes, as for PNG files.
    finished: Arc<Plan>,
    is_stepped: bool,
    /// Name, unit and description of each AOV that the phenomena have.
    aovs: Vec<(String, &'static str, &'static str)>,
    threads: usize,
}

impl Shot {
    /// Does `work` with the shot at frame `number` under a plan.
    fn at_frame<R: Send>(
        &self,
        py: Python<'_>,
        number: i64,
        plan: &Arc<Plan>,
        draw: impl FnOnce(&mut bansho::Shot, &work::Interruption) -> Result<R, RenderError> + Send,
    ) -> PyResult<R> {
        self.stream_tasks.check_process()?;
        let done = self.shot.run(py, self.threads, |shot, interruption| {
            if !Arc::ptr_eq(shot.plan(), plan) {
                shot.replace_plan(plan.clone());
            }
            shot.advance(number, interruption)?;
            draw(shot, interruption)
        })?;
        done.map_err(|failed| error::render(&failed))
    }
}

#[pymethods]
impl Shot {
    /// Builds the phenomena of a scene and plans its shot.
    #[new]
    #[pyo3(signature = (text, name, arrays, *, size, seed, loop_s, crop, backdrop, layers, aovs, figures, overscan, view, threads))]
    #[allow(clippy::fn_params_excessive_bools, reason = "keywords of Python")]
    fn new(
        py: Python<'_>,
        text: &str,
        name: &str,
        arrays: &Arrays,
        size: Option<[usize; 2]>,
        seed: Option<u64>,
        loop_s: Option<f64>,
        crop: Option<[usize; 4]>,
        backdrop: bool,
        layers: bool,
        aovs: bool,
        figures: bool,
        overscan: bool,
        view: Option<&str>,
        threads: Option<i64>,
    ) -> PyResult<Self> {
        let threads = work::thread_count(threads)?;
        let options = SceneOptions { seed, loop_s, implied_backdrop: backdrop };
        let scene = scene::parse(text, name)?.with_options(&options).map_err(|looping| error::looping(&looping))?;
        let view = view.map(parse_view).transpose()?.unwrap_or_else(|| scene.picture.view.into());
        let crop = crop.map(|[x, y, width, height]| Rect { x, y, width, height });
        let glare = GlareUse::Never;
        let of_light =
            PlanOptions { size, overscan, crop, layers, aovs, metadata: figures, glare, display: Some(view) };
        let glare = if view == View::RAW { GlareUse::Stated } else { GlareUse::Always };
        let of_display = PlanOptions { size, crop, glare, display: Some(view), ..PlanOptions::default() };
        let assets = arrays.assets();
        let built = work::run(py, threads, |interruption| {
            let compiled = CompiledScene::build(Arc::new(scene), assets, None);
            let compiled = Arc::new(compiled.map_err(|errors| errors.located(name, text)).map_err(Refusal::Scene)?);
            let mut light = Plan::observed(&compiled, &of_light, interruption).map_err(Refusal::Plan)?;
            light.fingerprint_frames = false;
            let (exposure, start) = (light.exposure_ev100, light.loop_start);
            let finished = Plan::with_exposure_and_loop_start(light.scene().clone(), &of_display, exposure, start);
            let mut finished = finished.map_err(Refusal::Plan)?;
            (finished.depth, finished.fingerprint_frames) = (false, false);
            Ok((compiled, Arc::new(light), Arc::new(finished)))
        })?;
        let (compiled, light, finished) = built.map_err(|refusal| match refusal {
            Refusal::Scene(problems) => error::scene(&problems),
            Refusal::Plan(reason) => error::plan(&reason),
        })?;
        let is_stepped = compiled.is_stepped();
        let mut aovs = Vec::new();
        for phenomenon in compiled.phenomena() {
            let info = phenomenon.info();
            aovs.extend(info.aovs.iter().map(|aov| (format!("{}.{}", info.name, aov.name), aov.unit, aov.doc)));
        }
        let shot = work::PoolMutex::new(bansho::Shot::open(compiled.clone(), light.clone()));
        let stream_tasks = Arc::new(work::TaskCount::new());
        Ok(Self { shot, compiled, stream_tasks, light, finished, is_stepped, aovs, threads })
    }

    /// How many of `frames` frames of light are drawn at once: as many as `stated`, by default as many as the program draws. One where frames follow from
    /// each other.
    fn frames_in_flight(&self, py: Python<'_>, frames: usize, stated: Option<usize>) -> PyResult<usize> {
        self.stream_tasks.check_process()?;
        let stated = stated.map_or(FramesInFlight::Auto, FramesInFlight::Count);
        let at_once = work::run(py, self.threads, |_| stated.for_light(&self.compiled, &self.light, frames))?;
        at_once.map_err(|refused| match refused {
            OptionError::FramesInFlight { count, required_gib, max } => error::value(format!(
                "frames_in_flight: {count} frames would take {required_gib:.1} GiB; allowed: None, or 1 to {max}"
            )),
            other => error::value(other.to_string()),
        })
    }

    /// The light of `count` frames from `first` on, every `step`-th, of which `in_flight` are drawn at once: of a scene whose frames do not follow from each
    /// other.
    fn frame_stream(&self, first: i64, step: i64, count: usize, in_flight: usize) -> PyResult<FrameStream> {
        self.stream_tasks.check_process()?;
        // Shots of their own, so that other frames may be drawn meanwhile. Only they share their scratch memory.
        let original = bansho::Shot::open(self.compiled.clone(), self.light.clone());
        let mut shots: Vec<_> = std::iter::from_fn(|| original.independent()).take(in_flight).collect();
        if shots.is_empty() {
            shots.push(original);
        }
        FrameStream::new(shots, FrameNumbers { first, step, count }, self.threads, self.stream_tasks.clone())
    }

    /// Draws frame `number` as light.
    fn draw_light<'py>(&self, py: Python<'py>, number: i64) -> PyResult<Bound<'py, PyDict>> {
        let frame = self.at_frame(py, number, &self.light, |shot, observer| shot.draw(&SceneLinear, observer))?;
        frame::frame_dictionary(py, frame)
    }

    /// Draws frame `number` as display codes: what `bansho render` writes to a PNG.
    fn draw_display<'py>(
        &self,
        py: Python<'py>,
        number: i64,
        bits: u8,
        alpha: Option<&str>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let depth = match bits {
            8 => BitDepth::Eight,
            16 => BitDepth::Sixteen,
            _ => return Err(error::value(format!("bits: {bits}; allowed: 8, 16"))),
        };
        let view = self.finished.display;
        let convention = alpha.map(frame::parse_alpha).transpose()?;
        let options =
            DisplayOptions { view, depth, alpha: convention.unwrap_or_default(), over_black: convention.is_none() };
        let drawn = self.at_frame(py, number, &self.finished, |shot, observer| shot.draw(&options, observer))?;
        frame::display_array(py, drawn.image)
    }

    /// The particles of each phenomenon that has any, at the middle of the exposure of frame `number`.
    fn particles<'py>(&self, py: Python<'py>, number: i64) -> PyResult<Vec<(String, Bound<'py, PyDict>)>> {
        let clouds = self.at_frame(py, number, &self.light, |shot, _| Ok(shot.point_clouds()))?;
        clouds.into_iter().map(|(name, cloud)| Ok((name, frame::cloud_dictionary(py, cloud)?))).collect()
    }

    /// The lights with which phenomena light each other in frame `number`.
    fn lights<'py>(&self, py: Python<'py>, number: i64) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let lights = self.at_frame(py, number, &self.light, |shot, _| Ok(shot.lights()))?;
        let mut listed = Vec::with_capacity(lights.len());
        for light in lights {
            let dictionary = PyDict::new(py);
            let srgb = light.light.srgb();
            dictionary.set_item("phenomenon", light.phenomenon)?;
            let (kind, toward) = match light.light.emitter {
                Emitter::Point { .. } => ("point", None),
                Emitter::Spot { axis, .. } => ("spot", Some(-axis)),
                Emitter::Directional { toward } => ("directional", Some(toward)),
            };
            dictionary.set_item("kind", kind)?;
            let position = light.light.emitter.position();
            dictionary.set_item("position", position.map(|position| position.to_array()))?;
            dictionary.set_item("toward", toward.map(|toward| toward.to_array()))?;
            let radius = match light.light.emitter {
                Emitter::Point { radius, .. } => radius,
                Emitter::Spot { .. } | Emitter::Directional { .. } => 0.0,
            };
            dictionary.set_item("radius", radius)?;
            dictionary.set_item("color", srgb.color)?;
            dictionary.set_item("intensity", srgb.intensity)?;
            dictionary.set_item("acescg", light.light.intensity)?;
            listed.push(dictionary);
        }
        Ok(listed)
    }

    /// The camera of frame `number`.
    fn camera<'py>(&self, py: Python<'py>, number: i64) -> PyResult<Bound<'py, PyDict>> {
        frame::camera_dictionary(py, &self.light, number)
    }

    /// Time at which frame `number` begins, s.
    fn time(&self, number: i64) -> f64 {
        self.light.time(number)
    }

    /// The first frame, and the one after the last.
    #[getter]
    fn range(&self) -> (i64, i64) {
        let frames = self.light.frames();
        (frames.start, frames.end)
    }

    /// Width and height of the picture, pixels.
    #[getter]
    fn size(&self) -> [usize; 2] {
        self.light.size()
    }

    /// Exposure value at ISO 100.
    #[getter]
    fn exposure_ev100(&self) -> f32 {
        self.light.exposure_ev100
    }

    /// Frames per second, as a fraction.
    #[getter]
    fn fps(&self) -> (u32, u32) {
        (self.light.fps().frames, self.light.fps().seconds)
    }

    /// Whether anything is simulated in steps, so that frames follow from each other.
    #[getter]
    fn is_stepped(&self) -> bool {
        self.is_stepped
    }

    /// Name, unit and description of each AOV that the phenomena have.
    #[getter]
    fn aovs(&self) -> Vec<(String, &'static str, &'static str)> {
        self.aovs.clone()
    }

    /// Number of threads that draw.
    #[getter]
    fn threads(&self) -> usize {
        self.threads
    }
}

/// Why a shot cannot be opened.
enum Refusal {
    Scene(bansho::SceneError),
    Plan(bansho::PlanError),
}

/// The view of a name.
pub(crate) fn parse_view(name: &str) -> PyResult<View> {
    ViewName::from_name(name).map(View::from).ok_or_else(|| {
        let allowed = "\"display\", \"neutral\", \"agx\", \"standard\", \"raw\"";
        error::value(format!("view: {name:?}; allowed: {allowed}"))
    })
}
