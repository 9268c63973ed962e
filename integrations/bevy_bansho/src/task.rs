//! Opens an effect and draws its pictures in background tasks, so that no frame of the program waits.

use std::{collections::HashSet, time::Duration};

use bansho::{Effect, EffectError, LiveEffect, WindParameters, base::phenomenon::surroundings::Light, f16};
use bevy::{
    platform::time::Instant,
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, futures::check_ready, futures_lite::future::yield_now},
};

use crate::{Wind, view::View};

/// Steps of the preroll of a simulation between which other tasks may run.
const PREROLL_STEPS: u64 = 8;
/// Longest time that a simulation which is too slow tries to catch up, s.
const MAX_OWED_S: f64 = 0.25;

/// A change of an effect before its next picture.
pub(crate) type Change = Box<dyn FnOnce(&mut LiveEffect) -> Result<(), EffectError> + Send + Sync>;

/// What the next picture is drawn with.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Request {
    /// Camera, and the surface that shows the picture.
    pub(crate) view: View,
    /// Width and height, pixels.
    pub(crate) pixels: UVec2,
    /// Exposure value; `None` for that of the effect.
    pub(crate) exposure_ev100: Option<f32>,
    /// Wind; `None` for that of the effect.
    pub(crate) wind: Option<Wind>,
}

/// A finished picture.
pub(crate) struct Drawn {
    /// Premultiplied linear sRGB in half floats, rows from the top.
    pub(crate) pixels: Vec<u8>,
    /// Lights of the effect, in its coordinates.
    pub(crate) lights: Vec<Light>,
    /// The view for which it was drawn.
    pub(crate) view: View,
    /// Its time, s.
    pub(crate) time_s: f64,
    /// How long it took.
    pub(crate) drawing_time: Duration,
}

/// What a task returns.
struct Finished {
    live: Box<LiveEffect>,
    /// Memory for the next picture.
    halves: Vec<f16>,
    /// The wind that was set last.
    wind: Option<Wind>,
    /// `None` if the effect was only opened.
    drawn: Option<Drawn>,
    /// Simulated time that is missing, s.
    owed_s: f64,
    /// What could not be changed.
    problems: Vec<EffectError>,
}

type EffectResult = Result<Finished, EffectError>;

/// The state of an effect, which is in the task while one runs.
enum Stage {
    Described(Box<Effect>),
    Busy(Task<EffectResult>),
    /// Nothing has changed since the last picture, not even the time.
    Idle(Box<Finished>),
    Failed,
}

/// An effect that is opened and drawn in tasks, one at a time.
pub(crate) struct EffectTask {
    stage: Stage,
    /// Time since the last picture was begun, s.
    elapsed_s: f64,
    /// With what it was drawn.
    last_request: Option<Request>,
    changes: Vec<Change>,
    /// Problems that were logged already.
    logged: HashSet<String>,
}

impl EffectTask {
    pub(crate) fn new(effect: Effect) -> Self {
        let stage = Stage::Described(Box::new(effect));
        Self { stage, elapsed_s: 0.0, last_request: None, changes: Vec::new(), logged: HashSet::new() }
    }

    pub(crate) fn push_change(&mut self, change: Change) {
        self.changes.push(change);
    }

    pub(crate) fn has_failed(&self) -> bool {
        matches!(self.stage, Stage::Failed)
    }

    /// Lets `dt` seconds pass. Takes the picture if it is finished, and begins the next one.
    pub(crate) fn update(&mut self, dt: f64, request: Request) -> Option<Drawn> {
        self.elapsed_s += dt;
        let (stage, drawn) = match std::mem::replace(&mut self.stage, Stage::Failed) {
            Stage::Described(effect) => (Stage::Busy(open(*effect, request)), None),
            Stage::Busy(mut task) => match check_ready(&mut task) {
                Some(result) => self.finish(result, request),
                None => (Stage::Busy(task), None),
            },
            Stage::Idle(finished) => (self.begin(*finished, request), None),
            Stage::Failed => (Stage::Failed, None),
        };
        self.stage = stage;
        drawn
    }

    /// Takes what a task returned, and begins the next picture.
    fn finish(&mut self, result: EffectResult, request: Request) -> (Stage, Option<Drawn>) {
        let mut finished = match result {
            Ok(finished) => finished,
            Err(problem) => {
                error!("this effect is not drawn any more: {problem}");
                return (Stage::Failed, None);
            }
        };
        for problem in finished.problems.drain(..).map(|problem| problem.to_string()) {
            if self.logged.insert(problem.clone()) {
                error!("the effect goes on unchanged: {problem}");
            }
        }
        let drawn = finished.drawn.take();
        // Its time begins when it is open.
        self.elapsed_s = if drawn.is_some() { self.elapsed_s + finished.owed_s.min(MAX_OWED_S) } else { 0.0 };
        (self.begin(finished, request), drawn)
    }

    /// Begins the next picture if anything is different in it.
    fn begin(&mut self, finished: Finished, request: Request) -> Stage {
        if self.elapsed_s == 0.0 && self.changes.is_empty() && self.last_request == Some(request) {
            return Stage::Idle(Box::new(finished));
        }
        self.last_request = Some(request);
        let (passed_s, changes) = (std::mem::take(&mut self.elapsed_s), std::mem::take(&mut self.changes));
        Stage::Busy(draw(finished, passed_s, request, changes))
    }
}

/// Opens the effect, and runs its preroll in pieces, between which other effects are drawn.
fn open(effect: Effect, request: Request) -> Task<EffectResult> {
    AsyncComputeTaskPool::get().spawn(async move {
        let [width, height] = request.pixels.to_array().map(|pixels| pixels as usize);
        let mut effect = effect.size(width, height).preroll_in_pieces();
        if let Some(wind) = request.wind {
            let velocity = wind.velocity.as_dvec3().to_array().into();
            effect = effect.wind(WindParameters { velocity, gust: wind.gust.into(), ..WindParameters::default() });
        }
        if let Some(exposure_ev100) = request.exposure_ev100 {
            effect = effect.exposure_ev100(exposure_ev100.into());
        }
        let mut live = Box::new(effect.open()?);
        while live.preroll(PREROLL_STEPS)? > 0 {
            yield_now().await;
        }
        let halves = vec![f16::ZERO; width * height * 4];
        let wind = request.wind.filter(|wind| blows(&live, *wind));
        Ok(Finished { live, halves, wind, drawn: None, owed_s: 0.0, problems: Vec::new() })
    })
}

/// Whether the scene of an effect has the wind already.
fn blows(live: &LiveEffect, wind: Wind) -> bool {
    let scene = &live.shot().compiled().scene().wind;
    scene.velocity.at(live.time()) == wind.velocity.as_dvec3().to_array() && scene.gust == f64::from(wind.gust)
}

/// Draws the picture after `passed_s` seconds.
fn draw(state: Finished, passed_s: f64, request: Request, changes: Vec<Change>) -> Task<EffectResult> {
    AsyncComputeTaskPool::get().spawn(async move {
        let begin = Instant::now();
        let Finished { mut live, mut halves, wind, mut problems, .. } = state;
        problems.extend(changes.into_iter().filter_map(|change| change(&mut live).err()));
        problems.extend(request.apply(&mut live, wind));
        let picture = live.advance(passed_s)?;
        let (time_s, owed_s) = (picture.time_s(), picture.owed_s());
        // Both have the size with which the effect was opened.
        if let Err(error) = picture.write_rgba16f(&mut halves) {
            error!("the picture is not shown: {error}");
        }
        let pixels = bytes_of(&halves);
        let lights = live.lights().into_iter().map(|light| light.light).collect();
        let drawn = Drawn { pixels, lights, view: request.view, time_s, drawing_time: begin.elapsed() };
        Ok(Finished { live, halves, wind: request.wind.or(wind), drawn: Some(drawn), owed_s, problems })
    })
}

impl Request {
    /// Sets camera, exposure and wind; returns what could not be set.
    fn apply(&self, live: &mut LiveEffect, last_wind: Option<Wind>) -> impl Iterator<Item = EffectError> {
        let plan = live.shot().plan();
        let camera = self.view.camera.applied_to(&plan.camera);
        let exposure_ev100 = self.exposure_ev100.filter(|exposure_ev100| *exposure_ev100 != plan.exposure_ev100);
        let camera = live.set_camera(camera);
        let exposure = exposure_ev100.map_or(Ok(()), |exposure_ev100| live.set_exposure_ev100(exposure_ev100.into()));
        let wind = self
            .wind
            .filter(|wind| Some(*wind) != last_wind)
            .map_or(Ok(()), |wind| live.set_wind(wind.velocity.as_dvec3().to_array(), wind.gust.into()));
        [camera, exposure, wind].into_iter().filter_map(Result::err)
    }
}

/// The bytes of half floats.
fn bytes_of(halves: &[f16]) -> Vec<u8> {
    let mut bytes = vec![0; 2 * halves.len()];
    for (bytes, half) in bytes.as_chunks_mut().0.iter_mut().zip(halves) {
        *bytes = half.to_ne_bytes();
    }
    bytes
}
