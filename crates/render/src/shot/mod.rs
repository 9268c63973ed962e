//! A shot: the runs of all phenomena of a compiled scene, at a frame.

mod continuing;
mod data;
mod draw;
mod lit_plate;
mod reflection;
pub mod snapshot;
pub(crate) mod stepping;

use std::{collections::HashSet, sync::Arc};

use bansho_base::{
    frame::Frame,
    host::{
        observer::{Cancelled, Observer, PartGuard, Stage, StageGuard, StagePart},
        parallel::prelude::*,
    },
    image::Rect,
    math::DVec3,
    parameters::BuildError,
    phenomenon::{
        Prepared, SnapshotError,
        strip::{Shutter, View},
        surroundings::{Occluder, Publication, Surroundings, lights_of_parts},
    },
    world::wind::{Wind, WindChangeError},
};

use crate::{
    compiled::{ActiveRun, CompiledScene},
    composite::{
        composition::{self, StripScratches},
        glare::Pyramid,
        mirror::Mirror,
        moving_members::{Moments, MovingMember},
        plate_cache::PlateCache,
        slices::{self, Slice},
    },
    context::ShotContext,
    exposure_parts::{self, ExposureParts, PartCount, PreparedExposure},
    plan::Plan,
};

pub use data::PhenomenonLight;

/// Why a frame cannot be drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// The observer asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The picture or the depth of the plate cannot be read.
    #[error("plate.{}: {}", .0.key, .0.kind)]
    Plate(Box<BuildError>),
    /// A snapshot cannot be restored.
    #[error(transparent)]
    Snapshot(#[from] SnapshotError),
    /// The snapshot belongs to another scene, seed or version.
    #[error("the snapshot belongs to another scene, seed or version")]
    ForeignSnapshot,
}

/// A shot that is being drawn: [`advance`](Self::advance) to a frame, [`draw`](Self::draw) it.
///
/// It runs on the CPU, in the rayon pool of the caller, or on its thread (see [`bansho_base::host::parallel`]). The same scene and plan give the same bytes with any number of threads.
pub struct Shot {
    context: ShotContext,
    runs: Vec<ActiveRun>,
    plates: PlateCache,
    /// Number of the frame that the shot was advanced to.
    number: i64,
    /// Time at which that frame begins, s.
    time: f64,
    /// Whether the state was simulated, at least partly, with an earlier scene.
    has_earlier_state: bool,
    /// A frame whose memory the next one reuses.
    recycled: Option<Frame>,
    /// Memory for the glare of frames.
    pyramid: Pyramid,
    /// Shared by shots that are drawn at once, so that there are no more than threads.
    scratches: Arc<StripScratches>,
}

impl Shot {
    /// A shot of `compiled` in its initial state. Builds nothing.
    pub fn open(compiled: Arc<CompiledScene>, plan: Arc<Plan>) -> Self {
        Self::with_scratches(compiled, plan, Arc::new(composition::scratches()))
    }

    fn with_scratches(compiled: Arc<CompiledScene>, plan: Arc<Plan>, scratches: Arc<StripScratches>) -> Self {
        Self {
            runs: compiled.start(),
            number: plan.frames().start,
            time: plan.time(plan.frames().start),
            context: ShotContext::new(compiled, plan),
            plates: PlateCache::default(),
            has_earlier_state: false,
            recycled: None,
            pyramid: Pyramid::default(),
            scratches,
        }
    }

    /// Another shot of the same scene and plan, which draws the same frames at the same time as this one. `None` where frames follow from those before: where the
    /// scene is simulated in steps, or its wind was changed.
    pub fn independent(&self) -> Option<Self> {
        let is_closed_form = self.runs.iter().all(|run| run.stepping.is_none()) && self.context.wind.is_planned();
        let (compiled, plan) = (self.context.compiled.clone(), self.context.plan.clone());
        is_closed_form.then(|| Self::with_scratches(compiled, plan, self.scratches.clone()))
    }

    /// Steps all simulations to frame `number`; restarts them if they are past it.
    ///
    /// # Errors
    /// The observer asked to stop. The shot is then at some earlier step and may be advanced again.
    pub fn advance(&mut self, number: i64, observer: &dyn Observer) -> Result<(), RenderError> {
        let time = self.context.plan.time(number);
        if self.is_past(time) {
            self.restart();
        } else if time <= self.time {
            // What is drawn again is drawn with the wind of the scene.
            self.context.wind = self.context.compiled.wind().clone();
        }
        self.step_to(time, u64::MAX, observer)?;
        self.number = number;
        Ok(())
    }

    /// Steps all simulations to time `t` (s), but takes at most `max_steps` steps; returns the time that is owed, s. If any is, the shot is at the time
    /// that was reached, or at its former time if that is later. The time may be between frames and before the first; it must not be
    /// [past](Self::is_past) for simulations.
    ///
    /// # Errors
    /// The observer asked to stop. The shot is then at some earlier step and may be advanced again.
    pub fn advance_to(&mut self, t: f64, max_steps: u64, observer: &dyn Observer) -> Result<f64, RenderError> {
        let before = self.time;
        self.step_to(t, max_steps, observer)?;
        let shutter = self.context.plan.shutter_at(t);
        let behind = stepping::time_behind(&self.runs, shutter);
        self.time = if behind > 0.0 { (t - behind).max(before.min(t)) } else { t };
        self.number = self.context.plan.number_at(self.time);
        Ok(t - self.time)
    }

    /// Whether a simulation has been stepped beyond a state from which a frame at time `t` (s) is drawn.
    pub fn is_past(&self, t: f64) -> bool {
        let shutter = self.context.plan.shutter_at(t);
        self.runs.iter().any(|run| {
            run.steps_taken > run.steps_until(shutter)
                || run.as_stepped().is_some_and(|stepped| !stepped.keeps_states_for(shutter))
        })
    }

    /// Number of steps that simulations have to take until the first frame can be drawn.
    pub fn preroll_steps_left(&self) -> u64 {
        let plan = &self.context.plan;
        let shutter = plan.shutter_at(plan.time(plan.frames().start));
        self.runs.iter().map(|run| run.steps_until(shutter).saturating_sub(run.steps_taken)).sum()
    }

    /// Puts all simulations back to their initial states, before the preroll, and the wind to that of the scene.
    pub fn restart(&mut self) {
        let loop_s = self.context.compiled.scene().loop_s;
        // The runs of closed forms have no state, and keep what they have computed for earlier frames.
        for run in self.runs.iter_mut().filter(|run| run.stepping.is_some()) {
            *run = ActiveRun::start(&run.built, loop_s);
        }
        self.has_earlier_state = false;
        self.context.wind = self.context.compiled.wind().clone();
    }

    /// Time at which the frame begins that the shot was advanced to, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Changes the wind from the end of the current frame's exposure on: mean velocity (m/s) and turbulence intensity change linearly to these values within
    /// `transition_s`. Nothing jumps: gusts, drops and waves go on from where they are. It lasts until the shot
    /// restarts or [advances](Self::advance) to a frame that is not later.
    ///
    /// # Errors
    /// The scene is a seamless loop, whose wind is fixed, or a number is not finite.
    pub fn change_wind(&mut self, velocity: DVec3, gust: f64, transition_s: f64) -> Result<(), WindChangeError> {
        let close = self.context.plan.shutter_at(self.time).close;
        self.context.wind.change(close, velocity, gust, transition_s)?;
        self.has_earlier_state |= !self.context.wind.is_planned();
        Ok(())
    }

    fn step_to(&mut self, t: f64, max_steps: u64, observer: &dyn Observer) -> Result<(), RenderError> {
        let _stage = StageGuard::begin(observer, Stage::Advance);
        let shutter = self.context.plan.shutter_at(t);
        stepping::advance(&self.context, &mut self.runs, shutter, max_steps, observer)?;
        self.time = t;
        Ok(())
    }

    /// Gives back a frame that is no longer needed, so that the next one is drawn into its memory.
    pub fn recycle(&mut self, frame: Frame) {
        self.recycled = Some(frame);
    }

    /// The scene that is drawn.
    pub fn compiled(&self) -> &Arc<CompiledScene> {
        &self.context.compiled
    }

    /// The wind, with its changes during the shot.
    pub fn wind(&self) -> &Wind {
        &self.context.wind
    }

    /// The plan that is followed.
    pub fn plan(&self) -> &Arc<Plan> {
        &self.context.plan
    }

    /// Whether the state is the one to which the scene leads from its initial state. After [`replan`](Self::replan) it may differ until the
    /// simulations restart.
    pub fn is_exact(&self) -> bool {
        !self.has_earlier_state
    }

    /// The state of all simulations, for [`restore`](Self::restore).
    pub fn snapshot(&self) -> Vec<u8> {
        snapshot::write(&self.context.compiled, &self.runs)
    }

    /// Restores the state of a snapshot.
    ///
    /// # Errors
    /// The bytes are damaged or belong to another scene. The shot is then unchanged.
    pub fn restore(&mut self, snapshot: &[u8]) -> Result<(), RenderError> {
        let mut restored = self.context.compiled.start();
        snapshot::read(&self.context.compiled, snapshot, &mut restored)?;
        for (run, restored) in self.runs.iter_mut().zip(restored).filter(|(run, _)| run.stepping.is_some()) {
            *run = restored;
        }
        self.has_earlier_state = false;
        self.context.wind = self.context.compiled.wind().clone();
        Ok(())
    }

    /// What each phenomenon publishes during `shutter`.
    fn publications(&self, shutter: Shutter, observer: &dyn Observer) -> Vec<Publication> {
        self.runs
            .par_iter()
            .map(|run| {
                let _part = begin_preparation(run, false, observer);
                run.run.publish(shutter)
            })
            .collect()
    }

    /// Prepares the phenomena with the indices `which`, and cuts them into slices, whose members are positions in `which`.
    fn prepare<'a>(
        &'a self,
        which: &[usize],
        inputs: PreparationInputs<'a>,
        observer: &dyn Observer,
    ) -> Result<PreparedSlices<'a>, RenderError> {
        let PreparationInputs { view, surroundings, parts, is_mirrored } = inputs;
        let intervals: Vec<_> = which
            .par_iter()
            .map(|&index| {
                let run = &self.runs[index];
                let _part = begin_preparation(run, is_mirrored, observer);
                parts[index].depth_intervals(&*run.run, view, &surroundings[index])
            })
            .collect();
        let prepared: Vec<PreparedExposure> = which
            .par_iter()
            .map(|&index| {
                let run = &self.runs[index];
                let _part = begin_preparation(run, is_mirrored, observer);
                let aovs = run.built.phenomenon.info().aovs;
                exposure_parts::prepare(&*run.run, aovs, view, &surroundings[index], &parts[index], observer)
            })
            .collect::<Result<_, _>>()?;
        let names = self.table_names(which);
        let slices = slices::cut(&intervals, &names, lone_opaque_member(&prepared));
        let (prepared, moments) = self.moments(which, prepared, &slices, inputs, observer)?;
        Ok(PreparedSlices { slices, prepared, moments })
    }

    /// The wholes of prepared phenomena, and the moments of those that move. What blurs itself is prepared in parts where another one moves over its pixels.
    fn moments<'a>(
        &'a self,
        which: &[usize],
        prepared: Vec<PreparedExposure<'a>>,
        slices: &[Slice],
        inputs: PreparationInputs<'a>,
        observer: &dyn Observer,
    ) -> Result<(Vec<Box<dyn Prepared + 'a>>, Moments<'a>), RenderError> {
        let PreparationInputs { parts, is_mirrored, .. } = inputs;
        let mut rects = Vec::with_capacity(prepared.len());
        for (exposure, &index) in prepared.iter().zip(which) {
            let is_still = parts[index].parts.is_empty();
            rects.push(if is_still { Rect::default() } else { exposure.whole.moving_bounds() });
        }
        let members = prepared.into_par_iter().enumerate().map(
            |(member, PreparedExposure { whole, parts: mut parts_of_whole })| {
                let exposure = &parts[which[member]];
                if exposure.blurs_itself && overlaps_another(&rects, member) {
                    let run = &self.runs[which[member]];
                    let _part = begin_preparation(run, is_mirrored, observer);
                    parts_of_whole = exposure_parts::prepare_parts(&*run.run, exposure, observer)?;
                }
                let moves = !parts_of_whole.is_empty();
                let moving = moves.then(|| MovingMember::new(member, parts_of_whole, rects[member]));
                Ok((whole, moving))
            },
        );
        let members: Vec<(Box<dyn Prepared>, Option<MovingMember>)> = members.collect::<Result<_, Cancelled>>()?;
        let (wholes, moving): (Vec<_>, Vec<_>) = members.into_iter().unzip();
        Ok((wholes, Moments::new(moving.into_iter().flatten().collect(), slices)))
    }

    /// The names of those phenomena that have a table of their own; `None` for the tables that phenomena share.
    fn table_names(&self, which: &[usize]) -> Vec<Option<&str>> {
        let tables: HashSet<&str> =
            self.context.compiled.scene().instances.iter().map(|instance| instance.name.as_str()).collect();
        let names = which.iter().map(|&index| self.runs[index].info().name);
        names.map(|name| tables.contains(name).then_some(name)).collect()
    }

    /// The parts of the exposure in which each phenomenon is prepared, empty for those that are prepared as a whole and those not in `which`.
    fn exposure_parts<'a>(
        &'a self,
        which: &[usize],
        view: &View,
        surroundings: &[Surroundings<'a>],
        publications: &[Publication],
    ) -> Vec<ExposureParts<'a>> {
        let mut counts = vec![PartCount::default(); self.runs.len()];
        for &index in which {
            counts[index] = PartCount::of_run(&*self.runs[index].run, view, &surroundings[index]);
        }
        exposure_parts::nest(&mut counts);
        let mut parts_of_all = Vec::with_capacity(counts.len());
        for (index, count) in counts.into_iter().enumerate() {
            parts_of_all.push(ExposureParts::new(count, view, |part| {
                let mut of_part = surroundings[index].clone();
                of_part.others.shadow_casters = self.shadow_casters(index, part.shutter, publications);
                if !of_part.light_parts.is_empty() {
                    let fraction = (part.shutter.middle() - view.shutter.open) / view.shutter.duration();
                    of_part.others.lights = of_part.lights_at(fraction).to_vec();
                    of_part.light_parts = Vec::new();
                }
                of_part
            }));
        }
        parts_of_all
    }

    /// The shadow casters around phenomenon `index` during `part` of the exposure.
    fn shadow_casters(&self, index: usize, part: Shutter, publications: &[Publication]) -> Vec<Occluder> {
        let mut casters = Vec::new();
        for (other, publication) in publications.iter().enumerate() {
            let run = &self.runs[other];
            match publication.shadow_casters.as_slice() {
                [] => {}
                _ if other == index => {}
                // The state of a simulation is that of the whole exposure.
                shown if run.stepping.is_some() => casters.extend_from_slice(shown),
                _ => casters.extend(run.run.publish(part).shadow_casters),
            }
        }
        casters
    }

    /// The surroundings of each phenomenon.
    fn surroundings<'a>(
        &'a self,
        view: &View,
        publications: &[Publication],
        mirror: Option<&'a Mirror>,
    ) -> Vec<Surroundings<'a>> {
        let parts = self.light_parts(view.shutter, publications);
        let is_still = parts.is_empty() || view.path_cameras().is_still();
        let mut surroundings_of_all = Vec::with_capacity(self.runs.len());
        for index in 0..self.runs.len() {
            let mut surroundings = stepping::surroundings(&self.context, publications, index, view.shutter, mirror);
            for (part, publications) in &parts {
                surroundings.light_parts.push(stepping::lights(&self.context, publications, index, *part));
            }
            if !parts.is_empty() && is_still {
                surroundings.others.lights = lights_of_parts(&surroundings.light_parts);
            }
            surroundings_of_all.push(surroundings);
        }
        surroundings_of_all
    }

    /// What phenomena publish in each of the equal parts of an exposure in which lights hardly move; none if they stand still.
    fn light_parts(&self, shutter: Shutter, publications: &[Publication]) -> Vec<(Shutter, Vec<Publication>)> {
        /// Most lights in the surroundings of all phenomena in all parts, for the memory that they take.
        const MAX_LIGHTS: usize = 1 << 20;
        let scene = stepping::scene_publication(&self.context, shutter);
        let (mut count, mut lights) = (scene.light_parts, scene.lights.len());
        for publication in publications {
            count = count.max(publication.light_parts);
            lights += publication.lights.len();
        }
        while count > 1 && count * lights * self.runs.len() > MAX_LIGHTS {
            count /= 2;
        }
        if count <= 1 {
            return Vec::new();
        }
        let mut parts = Vec::with_capacity(count);
        for index in 0..count {
            let part = shutter.part(index, count);
            let mut during_part = Vec::with_capacity(self.runs.len());
            for (run, whole) in self.runs.iter().zip(publications) {
                // The state of a simulation is that of the whole exposure.
                let moves = whole.light_parts > 1 && run.stepping.is_none();
                during_part.push(if moves { run.run.publish(part) } else { whole.clone() });
            }
            parts.push((part, during_part));
        }
        parts
    }
}

/// What phenomena are prepared from.
#[derive(Clone, Copy)]
struct PreparationInputs<'a> {
    view: &'a View,
    /// Those of each phenomenon.
    surroundings: &'a [Surroundings<'a>],
    /// The parts of the exposure in which each phenomenon is prepared.
    parts: &'a [ExposureParts<'a>],
    /// Whether it is the reflection in a mirror.
    is_mirrored: bool,
}

/// Whether a rectangle overlaps any of the others.
fn overlaps_another(rects: &[Rect], index: usize) -> bool {
    let mut others = rects.iter().enumerate().filter(|(other, _)| *other != index);
    others.any(|(_, other)| !other.intersection(&rects[index]).is_empty())
}

/// Begins the preparation of a phenomenon, for the picture or for its reflection.
fn begin_preparation<'a>(run: &'a ActiveRun, is_mirrored: bool, observer: &'a dyn Observer) -> PartGuard<'a> {
    let phenomenon = Some(run.info().name);
    PartGuard::begin(observer, StagePart { stage: Stage::Prepare, phenomenon, is_mirrored })
}

/// Slices of depth, and the prepared phenomena to which their members refer.
struct PreparedSlices<'a> {
    slices: Vec<Slice>,
    prepared: Vec<Box<dyn Prepared + 'a>>,
    moments: Moments<'a>,
}

/// The only member with opaque surfaces; `None` if there are several, which would have to hide each other by their depth, or if something refracts the light from
/// behind it, for which surfaces must be before it or behind it.
fn lone_opaque_member(prepared: &[PreparedExposure]) -> Option<usize> {
    let mut opaque = prepared.iter().enumerate().filter(|(_, exposure)| exposure.whole.opaque_surfaces().is_some());
    let (member, _) = opaque.next()?;
    let is_lone = opaque.next().is_none() && !prepared.iter().any(|exposure| exposure.whole.may_refract());
    is_lone.then_some(member)
}
