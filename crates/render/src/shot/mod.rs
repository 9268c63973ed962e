//! A shot: runs of everything that a compiled scene shows, and the frame that was drawn last.

mod snapshot;
pub(crate) mod stepping;

use std::sync::Arc;

use bansho_base::{
    geometry::point_cloud::PointCloud,
    host::observer::{self, Cancelled, Observer, Stage, StageGuard},
    image::{Channel, Frame, PhenomenonMetadata, Rect},
    phenomenon::{
        LevelMirror, Prepared, SnapshotError,
        kind::BuildError,
        strip::View,
        surroundings::{Publication, Surroundings},
    },
};
use rayon::prelude::*;

use crate::{
    compiled::{ActiveRun, CompiledScene, Participant},
    composite::{
        background::Behind,
        mirror::{self, Mirror},
        plate::{PlateCache, PlateFrame},
        refraction,
        slices::{self, Slice},
        strips::{self, Composition, Outputs},
    },
    context::ShotContext,
    fingerprint,
    plan::Plan,
};

/// Why a frame cannot be drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// The caller stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The plate of a frame cannot be had: its picture or its depth, which the fault names.
    #[error("plate.{}: {}", .0.key, .0.kind)]
    Plate(Box<BuildError>),
    /// A snapshot does not fit.
    #[error(transparent)]
    Snapshot(#[from] SnapshotError),
    /// The snapshot belongs to another scene, seed or version.
    #[error("the snapshot belongs to another scene, seed or version")]
    ForeignSnapshot,
}

/// A shot that is being drawn: [`advance`](Self::advance) to a frame, [`draw`](Self::draw) it, [`read`](Self::read) it.
///
/// It draws on the processor, in the rayon pool of the caller. Same scene and plan, same bytes, whatever the threads.
pub struct Shot {
    context: ShotContext,
    runs: Vec<ActiveRun>,
    plates: PlateCache,
    number: i64,
    /// Whether the state was reached under another scene.
    carried: bool,
    frame: Option<Frame>,
    spent: Option<Frame>,
}

impl Shot {
    /// A shot of `compiled`, planned as `plan` says, at its beginning. Takes no construction.
    pub fn open(compiled: Arc<CompiledScene>, plan: Arc<Plan>) -> Self {
        Self {
            runs: compiled.start(),
            number: plan.frames().start,
            context: ShotContext::new(compiled, plan),
            plates: PlateCache::default(),
            carried: false,
            frame: None,
            spent: None,
        }
    }

    /// Steps everything to frame `number`; begins anew where that lies in the past.
    ///
    /// # Errors
    /// The observer asked to stop; the shot then stands at some earlier step and may be advanced again.
    pub fn advance(&mut self, number: i64, observer: &dyn Observer) -> Result<(), RenderError> {
        let _stage = StageGuard::begin(observer, Stage::Advance);
        self.frame = None;
        let shutter = self.context.plan.shutter(number);
        if self.runs.iter().any(|run| run.taken > run.steps_until(shutter)) {
            self.runs = self.context.compiled.start();
            self.carried = false;
        }
        stepping::advance(&self.context, &mut self.runs, shutter, observer)?;
        self.number = number;
        Ok(())
    }

    /// Draws the frame that the shot was advanced to.
    ///
    /// # Errors
    /// The observer asked to stop, or the plate cannot be had.
    pub fn draw(&mut self, observer: &dyn Observer) -> Result<(), RenderError> {
        let plate = {
            let _stage = StageGuard::begin(observer, Stage::Load);
            self.plates.frame(&self.context, self.number)?
        };
        let mirrored = match self.mirror() {
            Some((_, mirror)) => self.plates.mirrored(&self.context, mirror, observer)?,
            None => Arc::default(),
        };
        let mut view = self.context.plan.view(self.number);
        let spent = self.spent.take();
        let frame = match self.compose(&view, &plate, &mirrored, spent, observer)? {
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

    /// Takes the frame that was drawn; `None` where none was since the last.
    pub fn read(&mut self) -> Option<Frame> {
        self.frame.take()
    }

    /// Gives back a frame that nobody needs any more, so that the next is drawn into its memory.
    pub fn recycle(&mut self, spent: Frame) {
        self.spent = Some(spent);
    }

    /// Goes on with another scene or plan, as an editor does while it is played. What is simulated keeps the state that it came to, where it
    /// can; what cannot begins anew.
    pub fn replan(&mut self, compiled: Arc<CompiledScene>, plan: Arc<Plan>) {
        let same = fingerprint::of_state(&self.context.compiled) == fingerprint::of_state(&compiled);
        let mut old: Vec<Option<ActiveRun>> = std::mem::take(&mut self.runs).into_iter().map(Some).collect();
        let taken_over: Vec<Option<ActiveRun>> =
            compiled.participants().iter().map(|participant| take_out(&mut old, participant)).collect();
        let loop_s = compiled.scene().loop_s;
        let go_on = |(participant, run): (&Participant, Option<ActiveRun>)| {
            run.unwrap_or_else(|| go_on_from(&old, ActiveRun::start(participant, loop_s)))
        };
        self.runs = compiled.participants().iter().zip(taken_over).map(go_on).collect();
        self.carried = self.runs.iter().any(|run| run.taken > 0) && (self.carried || !same);
        if self.context.plan.scene.plate != plan.scene.plate {
            self.plates = PlateCache::default();
        }
        self.context = ShotContext::new(compiled, plan);
        (self.frame, self.spent) = (None, None);
    }

    /// Whether the state is the one that the scene leads to from its beginning. After [`replan`](Self::replan) it need not be, until the
    /// shot begins anew.
    pub fn is_exact(&self) -> bool {
        !self.carried
    }

    /// The particles of everything that has any, at the frame that the shot was advanced to.
    pub fn particles(&self) -> PointCloud {
        let t = self.context.plan.shutter(self.number).middle();
        let mut all = PointCloud::default();
        self.runs.iter().filter_map(|run| run.run.export(t)).for_each(|own| all.extend(&own));
        all
    }

    /// The state of everything, for [`restore`](Self::restore).
    pub fn snapshot(&self) -> Vec<u8> {
        snapshot::write(&self.context.compiled, &self.runs)
    }

    /// Returns to the state of a snapshot.
    ///
    /// # Errors
    /// The bytes are damaged or belong to another scene; the shot is then unchanged.
    pub fn restore(&mut self, snapshot: &[u8]) -> Result<(), RenderError> {
        let mut runs = self.context.compiled.start();
        snapshot::read(&self.context.compiled, snapshot, &mut runs)?;
        (self.runs, self.carried, self.frame) = (runs, false, None);
        Ok(())
    }

    /// Draws the view; `None` where only the whole picture gives its parts rightly, since bent light comes from beyond.
    fn compose(
        &self,
        view: &View,
        plate: &PlateFrame,
        mirrored: &PlateFrame,
        spent: Option<Frame>,
        observer: &dyn Observer,
    ) -> Result<Option<Frame>, RenderError> {
        let preparing = StageGuard::begin(observer, Stage::Prepare);
        let publications: Vec<Publication> = self.runs.par_iter().map(|run| run.run.publish(view.shutter)).collect();
        let reflection = self.reflection(view, mirrored, &publications, observer)?;
        let surroundings = self.surroundings(view, &publications, reflection.as_ref());
        let all: Vec<usize> = (0..self.runs.len()).collect();
        let (slices, prepared) = self.prepare(&all, view, &surroundings, observer)?;
        drop(preparing);
        let _stage = StageGuard::begin(observer, Stage::Draw);
        observer::check(observer)?;
        // Where nothing lies behind, nothing is bent.
        let behind = plate.color.is_some() || self.runs.len() > 1;
        let is_whole = view.window == Rect::from_size(view.size[0], view.size[1]);
        // Also where the window itself sees nothing bent: a picture before which light is bent is rounded otherwise everywhere.
        if !is_whole && behind && prepared.iter().any(|prepared| prepared.may_bend()) {
            return Ok(None);
        }
        let bends = behind && prepared.iter().any(|prepared| prepared.deflection().is_some());
        let composition = Composition {
            outputs: Outputs::of_plan(&self.context.plan),
            view,
            runs: &self.runs,
            prepared: &prepared,
            slices: &slices,
            plate,
            behind: Behind::plate(plate),
        };
        let header = self.context.header(self.number);
        let mut frame = if bends {
            refraction::frame(&composition, header, spent, observer)?
        } else {
            strips::frame(&composition, header, spent, observer)?
        };
        if self.context.plan.metadata {
            frame.metadata = self.metadata(&prepared);
        }
        Ok(Some(frame))
    }

    /// The metadata of every phenomenon that has any.
    fn metadata(&self, prepared: &[Box<dyn Prepared + '_>]) -> Vec<PhenomenonMetadata> {
        let names = self.runs.iter().map(|run| run.info().name.to_owned());
        let each = names.zip(prepared.iter().map(|prepared| prepared.metadata()));
        each.filter(|(_, entries)| !entries.is_empty())
            .map(|(phenomenon, entries)| PhenomenonMetadata { phenomenon, entries })
            .collect()
    }

    /// The first mirror, and the number of the phenomenon that it is.
    fn mirror(&self) -> Option<(usize, LevelMirror)> {
        let mirrors = self.runs.iter().enumerate();
        mirrors.filter_map(|(index, each)| Some((index, each.info().mirror?))).next()
    }

    /// Everything but the first mirror, as it is seen in that mirror, before the `mirrored` plate.
    fn reflection(
        &self,
        view: &View,
        mirrored: &PlateFrame,
        publications: &[Publication],
        observer: &dyn Observer,
    ) -> Result<Option<Mirror>, RenderError> {
        let Some((number, mirror)) = self.mirror() else { return Ok(None) };
        let view = view.mirrored(mirror.height);
        let surroundings = self.surroundings(&view, publications, None);
        let seen: Vec<usize> = (0..self.runs.len()).filter(|&index| index != number).collect();
        let (slices, prepared) = self.prepare(&seen, &view, &surroundings, observer)?;
        let composition = Composition {
            outputs: Outputs::RADIANCE,
            view: &view,
            runs: &self.runs,
            prepared: &prepared,
            slices: &slices,
            plate: mirrored,
            behind: Behind::plate(mirrored),
        };
        let mut seen = strips::frame(&composition, self.context.header(self.number), None, observer)?.beauty;
        let sky = self.context.sky(view.shutter.middle());
        // A sky that is not to be seen lights the ground, and stands in no still water.
        let is_seen = self.context.plan.scene.sky.as_ref().is_none_or(|sky| sky.visible);
        if is_seen && mirrored.color.is_some() {
            mirror::lay_sky(&mut seen, &view, &sky, 1);
        }
        let backdrop = mirror::backdrop(mirrored, &view, &sky);
        Ok(Some(Mirror { seen, backdrop }))
    }

    /// Slices of the phenomena `which`, and those phenomena ready to draw; a slice's members count within `which`.
    fn prepare<'a>(
        &'a self,
        which: &[usize],
        view: &'a View,
        surroundings: &'a [Surroundings<'a>],
        observer: &dyn Observer,
    ) -> Result<Ready<'a>, RenderError> {
        let each = || which.par_iter().map(|&index| (&self.runs[index].run, &surroundings[index]));
        let intervals: Vec<_> = each().map(|(run, s)| run.depth_intervals(view, s)).collect();
        let prepared = each().map(|(run, s)| run.prepare(view, s, observer)).collect::<Result<_, _>>()?;
        Ok((slices::cut(&intervals), prepared))
    }

    /// What each phenomenon sees of all others.
    fn surroundings<'a>(
        &'a self,
        view: &View,
        publications: &[Publication],
        mirror: Option<&'a Mirror>,
    ) -> Vec<Surroundings<'a>> {
        let seen_by = |index| stepping::surroundings(&self.context, publications, index, view.shutter, mirror);
        (0..self.runs.len()).map(seen_by).collect()
    }
}

/// The run of what was built from the same, which then is no longer among the `old`.
fn take_out(old: &mut [Option<ActiveRun>], participant: &Participant) -> Option<ActiveRun> {
    let is_same = |run: &Option<ActiveRun>| {
        run.as_ref().is_some_and(|run| run.participant.fingerprint == participant.fingerprint)
    };
    let run = old.iter_mut().find(|run| is_same(run))?.take()?;
    Some(ActiveRun { participant: participant.clone(), ..run })
}

/// A `run` at its beginning, after it took up the state that its namesake among the `old` came to, at the same time; at its beginning where
/// it cannot.
fn go_on_from(old: &[Option<ActiveRun>], mut run: ActiveRun) -> ActiveRun {
    let namesake = old.iter().flatten().find(|old| old.info().name == run.info().name);
    let taken = namesake.and_then(|old| run.stepping?.steps_for(&old.stepping?, old.taken));
    if let (Some(taken), Some(state)) = (taken, namesake.and_then(|old| old.as_stepped()).map(|old| old.snapshot()))
        && run.run.as_stepped_mut().is_some_and(|stepped| stepped.restore(&state).is_ok())
    {
        run.taken = taken;
    }
    run
}

/// Slices of depth, and the phenomena that they count, ready to draw.
type Ready<'a> = (Vec<Slice>, Vec<Box<dyn Prepared + 'a>>);

/// The part `window` of a whole frame.
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
