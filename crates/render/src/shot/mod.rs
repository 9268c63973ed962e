//! A shot: the runs of all phenomena of a compiled scene, and the last frame.

mod snapshot;
pub(crate) mod stepping;

use std::sync::Arc;

use bansho_base::{
    frame::{Channel, Frame, PhenomenonMetadata},
    geometry::point_cloud::PointCloud,
    host::observer::{self, Cancelled, Observer, Stage, StageGuard},
    image::Rect,
    parameters::BuildError,
    phenomenon::{
        LevelMirror, Prepared, SnapshotError,
        strip::{Shutter, View},
        surroundings::{Light, Publication, Surroundings},
    },
};
use rayon::prelude::*;

use crate::{
    compiled::{ActiveRun, BuiltPhenomenon, CompiledScene},
    composite::{
        background::Background,
        hiding::HidingDepth,
        mirror::{self, Mirror},
        plate::PlateFrame,
        plate_cache::PlateCache,
        refraction,
        slices::{self, Slice},
        strips::{self, Composition, Outputs},
    },
    context::ShotContext,
    plan::Plan,
};

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

/// A light with which a phenomenon lights the others.
#[derive(Clone, Debug, PartialEq)]
pub struct PhenomenonLight {
    /// Name of the phenomenon in the scene.
    pub phenomenon: String,
    /// The light: geometry in m, world coordinates with y up; intensity in ACEScg, candela for points.
    pub light: Light,
}

/// A shot that is being drawn: [`advance`](Self::advance) to a frame, [`draw`](Self::draw) it, [`read`](Self::read) it.
///
/// It runs on the CPU, in the rayon pool of the caller. The same scene and plan give the same bytes with any number of threads.
pub struct Shot {
    context: ShotContext,
    runs: Vec<ActiveRun>,
    plates: PlateCache,
    /// Number of the frame that the shot was advanced to.
    number: i64,
    /// Whether the state was simulated, at least partly, with an earlier scene.
    has_earlier_state: bool,
    frame: Option<Frame>,
    /// A frame whose memory the next one reuses.
    recycled: Option<Frame>,
}

impl Shot {
    /// A shot of `compiled` in its initial state. Builds nothing.
    pub fn open(compiled: Arc<CompiledScene>, plan: Arc<Plan>) -> Self {
        Self {
            runs: compiled.start(),
            number: plan.frames().start,
            context: ShotContext::new(compiled, plan),
            plates: PlateCache::default(),
            has_earlier_state: false,
            frame: None,
            recycled: None,
        }
    }

    /// Steps all simulations to frame `number`; restarts them if they are past it.
    ///
    /// # Errors
    /// The observer asked to stop. The shot is then at some earlier step and may be advanced again.
    pub fn advance(&mut self, number: i64, observer: &dyn Observer) -> Result<(), RenderError> {
        let _stage = StageGuard::begin(observer, Stage::Advance);
        self.frame = None;
        let shutter = self.context.plan.shutter(number);
        if self.runs.iter().any(|run| run.steps_taken > run.steps_until(shutter)) {
            self.runs = self.context.compiled.start();
            self.has_earlier_state = false;
        }
        stepping::advance(&self.context, &mut self.runs, shutter, observer)?;
        self.number = number;
        Ok(())
    }

    /// Draws the frame that the shot was advanced to.
    ///
    /// # Errors
    /// The observer asked to stop, or the plate cannot be read.
    pub fn draw(&mut self, observer: &dyn Observer) -> Result<(), RenderError> {
        let plate = {
            let _stage = StageGuard::begin(observer, Stage::Load);
            let ShotContext { compiled, plan, .. } = &self.context;
            let plate = self.plates.frame(compiled, plan, self.number);
            plate.map_err(|error| RenderError::Plate(Box::new(error)))?
        };
        let mirrored = match self.mirror() {
            Some((_, mirror)) => self.plates.mirrored(&self.context.plan, mirror, observer)?,
            None => Arc::default(),
        };
        let mut view = self.context.plan.view(self.number);
        let recycled = self.recycled.take();
        let frame = match self.compose(&view, &plate, &mirrored, recycled, observer)? {
            Some(frame) => frame,
            None => {
                let all = Rect::from_size(view.size[0], view.size[1]);
                view = view.with_window(all);
                let whole = self.compose(&view, &plate, &mirrored, None, observer)?;
                whole.and_then(|whole| crop(whole, self.context.plan.window)).ok_or(Cancelled)?
            }
        };
        self.frame = Some(frame);
        Ok(())
    }

    /// Takes the frame that was drawn; `None` if none was drawn since the last call.
    pub fn read(&mut self) -> Option<Frame> {
        self.frame.take()
    }

    /// Gives back a frame that is no longer needed, so that the next one is drawn into its memory.
    pub fn recycle(&mut self, frame: Frame) {
        self.recycled = Some(frame);
    }

    /// Continues with another scene or plan, as an editor does during playback. Simulations keep their state where the edited phenomenon can
    /// restore it; the others restart.
    pub fn replan(&mut self, compiled: Arc<CompiledScene>, plan: Arc<Plan>) {
        let is_same_scene = self.context.compiled.state_fingerprint() == compiled.state_fingerprint();
        let mut old: Vec<Option<ActiveRun>> = std::mem::take(&mut self.runs).into_iter().map(Some).collect();
        let kept: Vec<Option<ActiveRun>> =
            compiled.enabled().iter().map(|built| take_equal_run(&mut old, built)).collect();
        let loop_s = compiled.scene().loop_s;
        let kept_or_restored = |(built, run): (&BuiltPhenomenon, Option<ActiveRun>)| {
            run.unwrap_or_else(|| restored_from_namesake(&old, ActiveRun::start(built, loop_s)))
        };
        self.runs = compiled.enabled().iter().zip(kept).map(kept_or_restored).collect();
        let has_stepped = self.runs.iter().any(|run| run.steps_taken > 0);
        self.has_earlier_state = has_stepped && (self.has_earlier_state || !is_same_scene);
        if self.context.plan.scene.plate != plan.scene.plate {
            self.plates = PlateCache::default();
        }
        self.context = ShotContext::new(compiled, plan);
        (self.frame, self.recycled) = (None, None);
    }

    /// Whether the state is the one to which the scene leads from its initial state. After [`replan`](Self::replan) it may differ until the
    /// simulations restart.
    pub fn is_exact(&self) -> bool {
        !self.has_earlier_state
    }

    /// The particles of all phenomena, at the middle of the exposure of the frame that the shot was advanced to: the gas of particle flames, the electrons of
    /// simulated auroras, and the drops of rain that the camera sees as streaks. The phenomena follow each other in the order of the scene.
    ///
    /// Positions are in m and velocities in m/s, world coordinates with y up. The other [quantities](PointCloud::quantities) state their name and unit
    /// themselves ([`Quantity`](bansho_base::geometry::point_cloud::Quantity)); they are 0 for particles that lack one.
    pub fn particles(&self) -> PointCloud {
        let mut all = PointCloud::default();
        self.point_clouds().into_iter().for_each(|(_, cloud)| all.extend(&cloud));
        all
    }

    /// The [particles](Self::particles) of each phenomenon that can have any, with its name in the scene. They may be none at this frame.
    pub fn point_clouds(&self) -> Vec<(String, PointCloud)> {
        let view = self.context.plan.view(self.number);
        let publications = self.publications(view.shutter);
        let surroundings = self.surroundings(&view, &publications, None);
        let each = self.runs.iter().zip(&surroundings);
        each.filter_map(|(run, surroundings)| Some((run.info().name.to_owned(), run.run.export(&view, surroundings)?)))
            .collect()
    }

    /// The lights with which phenomena light each other, at the frame that the shot was advanced to: of each flame the points that approximate its emission,
    /// of an aurora a directional light. Lamps and the sky of the scene are not among them. The phenomena follow each other in the order of the scene.
    pub fn lights(&self) -> Vec<PhenomenonLight> {
        let publications = self.publications(self.context.plan.shutter(self.number));
        let of_run = |(run, publication): (&ActiveRun, Publication)| {
            let phenomenon = run.info().name.to_owned();
            publication.lights.into_iter().map(move |light| PhenomenonLight { phenomenon: phenomenon.clone(), light })
        };
        self.runs.iter().zip(publications).flat_map(of_run).collect()
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
        let mut runs = self.context.compiled.start();
        snapshot::read(&self.context.compiled, snapshot, &mut runs)?;
        (self.runs, self.has_earlier_state, self.frame) = (runs, false, None);
        Ok(())
    }

    /// Draws the view. `None` if the window is not the whole picture and light is refracted: it may come from outside the window, so the whole
    /// picture must be drawn and cropped.
    fn compose(
        &self,
        view: &View,
        plate: &PlateFrame,
        mirrored: &PlateFrame,
        recycled: Option<Frame>,
        observer: &dyn Observer,
    ) -> Result<Option<Frame>, RenderError> {
        let preparing = StageGuard::begin(observer, Stage::Prepare);
        let publications = self.publications(view.shutter);
        let reflection = self.reflection(view, mirrored, &publications, observer)?;
        let surroundings = self.surroundings(view, &publications, reflection.as_ref());
        let all: Vec<usize> = (0..self.runs.len()).collect();
        let PreparedSlices { slices, prepared } = self.prepare(&all, view, &surroundings, observer)?;
        drop(preparing);
        let _stage = StageGuard::begin(observer, Stage::Draw);
        observer::check(observer)?;
        // Only what is behind refracting air is refracted.
        let has_background = plate.color.is_some() || self.runs.len() > 1;
        let is_whole = view.window == Rect::from_size(view.size[0], view.size[1]);
        // Also if nothing in the window is refracted: compositing in groups of slices rounds all pixels differently.
        if !is_whole && has_background && prepared.iter().any(|prepared| prepared.may_refract()) {
            return Ok(None);
        }
        let is_refracted = has_background && prepared.iter().any(|prepared| prepared.deflection().is_some());
        let composition = Composition {
            outputs: Outputs::of_plan(&self.context.plan),
            view,
            runs: &self.runs,
            prepared: &prepared,
            slices: &slices,
            plate,
            hiding: &HidingDepth::new(&prepared, plate),
            background: Background::plate(plate),
        };
        let header = self.context.header(self.number);
        let mut frame = if is_refracted {
            refraction::draw_frame(&composition, header, recycled, observer)?
        } else {
            strips::draw_frame(&composition, header, recycled, observer)?
        };
        if self.context.plan.metadata {
            frame.metadata = self.metadata(&prepared);
        }
        Ok(Some(frame))
    }

    /// What each phenomenon publishes during `shutter`.
    fn publications(&self, shutter: Shutter) -> Vec<Publication> {
        self.runs.par_iter().map(|run| run.run.publish(shutter)).collect()
    }

    /// The metadata of every phenomenon that has any.
    fn metadata(&self, prepared: &[Box<dyn Prepared + '_>]) -> Vec<PhenomenonMetadata> {
        let names = self.runs.iter().map(|run| run.info().name.to_owned());
        let each = names.zip(prepared.iter().map(|prepared| prepared.metadata()));
        each.filter(|(_, entries)| !entries.is_empty())
            .map(|(phenomenon, entries)| PhenomenonMetadata { phenomenon, entries })
            .collect()
    }

    /// The first mirror, and the index of its phenomenon.
    fn mirror(&self) -> Option<(usize, LevelMirror)> {
        let mirrors = self.runs.iter().enumerate();
        mirrors.filter_map(|(index, each)| Some((index, each.info().mirror?))).next()
    }

    /// The reflection in the first mirror: all other phenomena, in front of the `mirrored` plate.
    fn reflection(
        &self,
        view: &View,
        mirrored: &PlateFrame,
        publications: &[Publication],
        observer: &dyn Observer,
    ) -> Result<Option<Mirror>, RenderError> {
        let Some((mirror_index, mirror)) = self.mirror() else { return Ok(None) };
        let view = view.mirrored(mirror.height);
        let surroundings = self.surroundings(&view, publications, None);
        let others: Vec<usize> = (0..self.runs.len()).filter(|&index| index != mirror_index).collect();
        let PreparedSlices { slices, prepared } = self.prepare(&others, &view, &surroundings, observer)?;
        let composition = Composition {
            outputs: Outputs::RADIANCE,
            view: &view,
            runs: &self.runs,
            prepared: &prepared,
            slices: &slices,
            plate: mirrored,
            hiding: &HidingDepth::new(&prepared, mirrored),
            background: Background::plate(mirrored),
        };
        let mut image = strips::draw_frame(&composition, self.context.header(self.number), None, observer)?.beauty;
        let sky = self.context.sky(view.shutter.middle());
        // An invisible sky lights the ground, but is not reflected in still water.
        let is_visible = self.context.plan.scene.sky.as_ref().is_none_or(|sky| sky.visible);
        if is_visible && mirrored.color.is_some() {
            mirror::composite_sky(&mut image, &view, &sky, 1);
        }
        let backdrop = mirror::backdrop(mirrored, &view, &sky);
        Ok(Some(Mirror { image, backdrop }))
    }

    /// Prepares the phenomena with the indices `which`, and cuts them into slices, whose members are positions in `which`.
    fn prepare<'a>(
        &'a self,
        which: &[usize],
        view: &'a View,
        surroundings: &'a [Surroundings<'a>],
        observer: &dyn Observer,
    ) -> Result<PreparedSlices<'a>, RenderError> {
        let each = || which.par_iter().map(|&index| (&self.runs[index].run, &surroundings[index]));
        let intervals: Vec<_> = each().map(|(run, s)| run.depth_intervals(view, s)).collect();
        let prepared = each().map(|(run, s)| run.prepare(view, s, observer)).collect::<Result<_, _>>()?;
        Ok(PreparedSlices { slices: slices::cut(&intervals), prepared })
    }

    /// The surroundings of each phenomenon.
    fn surroundings<'a>(
        &'a self,
        view: &View,
        publications: &[Publication],
        mirror: Option<&'a Mirror>,
    ) -> Vec<Surroundings<'a>> {
        let of_phenomenon = |index| stepping::surroundings(&self.context, publications, index, view.shutter, mirror);
        (0..self.runs.len()).map(of_phenomenon).collect()
    }
}

/// Takes the run of an equal phenomenon, one with the same fingerprint, out of `old`.
fn take_equal_run(old: &mut [Option<ActiveRun>], built: &BuiltPhenomenon) -> Option<ActiveRun> {
    let is_equal = |run: &Option<ActiveRun>| run.as_ref().is_some_and(|run| run.built.fingerprint == built.fingerprint);
    let run = old.iter_mut().find(|run| is_equal(run))?.take()?;
    Some(ActiveRun { built: built.clone(), ..run })
}

/// `run`, which is in its initial state, with the state of the run in `old` whose phenomenon has the same name, at the same time. Unchanged
/// where it cannot restore that state.
fn restored_from_namesake(old: &[Option<ActiveRun>], mut run: ActiveRun) -> ActiveRun {
    let namesake = old.iter().flatten().find(|old| old.info().name == run.info().name);
    let steps = namesake.and_then(|old| run.stepping?.steps_for(&old.stepping?, old.steps_taken));
    if let (Some(steps), Some(state)) = (steps, namesake.and_then(|old| old.as_stepped()).map(|old| old.snapshot()))
        && run.run.as_stepped_mut().is_some_and(|stepped| stepped.restore(&state).is_ok())
    {
        run.steps_taken = steps;
    }
    run
}

/// Slices of depth, and the prepared phenomena to which their members refer.
struct PreparedSlices<'a> {
    slices: Vec<Slice>,
    prepared: Vec<Box<dyn Prepared + 'a>>,
}

/// The region `window` of a whole frame.
fn crop(whole: Frame, window: Rect) -> Option<Frame> {
    let width = whole.beauty.width();
    let plane = |values: &[f32]| -> Vec<f32> {
        let row = |y| values[y * width + window.x..][..window.width].iter().copied();
        (window.y..window.bottom()).flat_map(row).collect()
    };
    let channels = whole.channels.iter().map(|channel| Channel { values: plane(&channel.values), ..channel.clone() });
    Some(Frame {
        beauty: whole.beauty.crop(window)?,
        depth: whole.depth.as_deref().map(plane),
        channels: channels.collect(),
        header: whole.header,
        opaque: whole.opaque,
        metadata: whole.metadata,
        content: Rect::from_size(window.width, window.height),
    })
}
