//! A shot on the processor: phenomena, their clocks, and the frame that was drawn last.

use std::sync::Arc;

use bansho_base::{
    geometry::point_cloud::PointCloud,
    host::observer::{self, Cancelled, Observer, Stage, StageGuard},
    image::{Channel, FigureSet, Frame, Rect},
    phenomenon::{
        LevelMirror, Phenomenon, Prepared,
        strip::View,
        surroundings::{Publication, Surroundings},
    },
};

use super::{
    behind::Behind,
    clock::{self, Clock},
    compose::{self, Composition, Outputs},
    haze,
    mirror::{self, Mirror},
    plate::{PlateCache, PlateFrame},
    snapshot,
};
use crate::{
    backend::{RenderError, Shot},
    fingerprint,
    phenomena::{self, Part},
    plan::Plan,
    slices::{self, Slice},
};

use rayon::prelude::*;

pub(super) struct CpuShot {
    plan: Arc<Plan>,
    phenomena: Vec<Box<dyn Phenomenon>>,
    /// What each phenomenon was made from.
    made_from: Vec<[u8; 32]>,
    clocks: Vec<Clock>,
    plates: PlateCache,
    number: i64,
    /// Whether the state was reached under another plan.
    carried: bool,
    frame: Option<Frame>,
    spent: Option<Frame>,
}

impl CpuShot {
    pub(super) fn open(plan: Arc<Plan>) -> Result<Self, RenderError> {
        let phenomena = plan.open()?;
        let clocks = vec![Clock { taken: 0 }; phenomena.len()];
        let number = plan.frames().start;
        Ok(Self {
            made_from: made_from(&plan),
            plan,
            phenomena,
            clocks,
            plates: PlateCache::default(),
            number,
            carried: false,
            frame: None,
            spent: None,
        })
    }

    fn begin_anew(&mut self) -> Result<(), RenderError> {
        self.phenomena = self.plan.open()?;
        self.clocks.fill(Clock { taken: 0 });
        self.carried = false;
        Ok(())
    }

    /// The phenomena of `plan` that are not here already, each with its clock; `None` for those that are.
    fn make_others(&self, plan: &Plan, made_from: &[[u8; 32]]) -> Result<Vec<Option<Made>>, RenderError> {
        let make = |(part, from): (&Part, &[u8; 32])| {
            if self.made_from.contains(from) {
                return Ok(None);
            }
            let mut phenomenon = part.open(plan)?;
            let clock = self.take_up(phenomenon.as_mut());
            Ok(Some((phenomenon, clock)))
        };
        phenomena::parts(&plan.scene).iter().zip(made_from).map(make).collect()
    }

    /// The clock of `phenomenon` after it took up the state that its namesake came to, at the same time; at its beginning where it cannot.
    fn take_up(&self, phenomenon: &mut dyn Phenomenon) -> Clock {
        let beginning = Clock { taken: 0 };
        let Some(stepping) = phenomenon.stepping() else { return beginning };
        let Some(index) = self.phenomena.iter().position(|old| old.name() == phenomenon.name()) else {
            return beginning;
        };
        let old = &self.phenomena[index];
        let taken = old.stepping().and_then(|own| stepping.steps_for(&own, self.clocks[index].taken));
        match taken {
            Some(taken) if phenomenon.restore(&old.snapshot()).is_ok() => Clock { taken },
            _ => beginning,
        }
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
        let publications: Vec<Publication> =
            self.phenomena.par_iter().map(|phenomenon| phenomenon.publish(view.shutter)).collect();
        let reflection = self.reflection(view, mirrored, &publications, observer)?;
        let surroundings = self.surroundings(view, &publications, reflection.as_ref());
        let all: Vec<usize> = (0..self.phenomena.len()).collect();
        let (slices, prepared) = self.prepare(&all, view, &surroundings, observer)?;
        drop(preparing);
        let _stage = StageGuard::begin(observer, Stage::Draw);
        observer::check(observer)?;
        // Where nothing lies behind, nothing is bent.
        let behind = plate.colour.is_some() || self.phenomena.len() > 1;
        let is_whole = view.window == Rect::of_size(view.size[0], view.size[1]);
        // Also where the window itself sees nothing bent: a picture before which light is bent is rounded otherwise everywhere.
        if !is_whole && behind && prepared.iter().any(|prepared| prepared.may_bend()) {
            return Ok(None);
        }
        let bends = behind && prepared.iter().any(|prepared| prepared.deflection().is_some());
        let composition = Composition {
            outputs: Outputs::of_plan(&self.plan),
            view,
            phenomena: &self.phenomena,
            prepared: &prepared,
            slices: &slices,
            plate,
            behind: Behind::plate(plate),
        };
        let header = self.plan.header(self.number);
        let mut frame = if bends {
            haze::frame(&composition, header, spent, observer)?
        } else {
            compose::frame(&composition, header, spent, observer)?
        };
        if self.plan.figures {
            frame.figures = self.figures(&prepared);
        }
        Ok(Some(frame))
    }

    /// The figures of every phenomenon that has any.
    fn figures(&self, prepared: &[Box<dyn Prepared + '_>]) -> Vec<FigureSet> {
        let names = self.phenomena.iter().map(|phenomenon| phenomenon.name().to_owned());
        let each = names.zip(prepared.iter().map(|prepared| prepared.figures()));
        each.filter(|(_, figures)| !figures.is_empty())
            .map(|(phenomenon, figures)| FigureSet { phenomenon, figures })
            .collect()
    }

    /// The first mirror, and the number of the phenomenon that it is.
    fn mirror(&self) -> Option<(usize, LevelMirror)> {
        let mirrors = self.phenomena.iter().enumerate();
        mirrors.filter_map(|(index, each)| Some((index, each.mirror()?))).next()
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
        let seen: Vec<usize> = (0..self.phenomena.len()).filter(|&index| index != number).collect();
        let (slices, prepared) = self.prepare(&seen, &view, &surroundings, observer)?;
        let composition = Composition {
            outputs: Outputs::RADIANCE,
            view: &view,
            phenomena: &self.phenomena,
            prepared: &prepared,
            slices: &slices,
            plate: mirrored,
            behind: Behind::plate(mirrored),
        };
        let mut seen = compose::frame(&composition, self.plan.header(self.number), None, observer)?.beauty;
        let sky = self.plan.sky(view.shutter.middle());
        // A sky that is not to be seen lights the ground, and stands in no still water.
        let is_seen = self.plan.scene.sky.as_ref().is_none_or(|sky| sky.visible);
        if is_seen && mirrored.colour.is_some() {
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
        let each = || which.par_iter().map(|&index| (&self.phenomena[index], &surroundings[index]));
        let intervals: Vec<_> = each().map(|(phenomenon, s)| phenomenon.depth_intervals(view, s)).collect();
        let prepared = each().map(|(phenomenon, s)| phenomenon.prepare(view, s, observer)).collect::<Result<_, _>>()?;
        Ok((slices::cut(&intervals), prepared))
    }

    /// What each phenomenon sees of all others.
    fn surroundings<'a>(
        &'a self,
        view: &View,
        publications: &[Publication],
        mirror: Option<&'a Mirror>,
    ) -> Vec<Surroundings<'a>> {
        let seen_by = |index| clock::surroundings(&self.plan, publications, index, view.shutter, mirror);
        (0..self.phenomena.len()).map(seen_by).collect()
    }
}

/// What each phenomenon of `plan` is made from. No two are alike, since names are unique.
fn made_from(plan: &Plan) -> Vec<[u8; 32]> {
    phenomena::parts(&plan.scene).iter().map(|part| fingerprint::of_part(plan, part)).collect()
}

/// A phenomenon with its clock.
type Made = (Box<dyn Phenomenon>, Clock);

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
        figures: whole.figures,
        content: Rect::of_size(window.width, window.height),
    })
}

impl Shot for CpuShot {
    fn advance(&mut self, number: i64, observer: &dyn Observer) -> Result<(), RenderError> {
        let _stage = StageGuard::begin(observer, Stage::Advance);
        self.frame = None;
        let shutter = self.plan.shutter(number);
        let mut pairs = self.phenomena.iter().zip(&self.clocks);
        if pairs.any(|(phenomenon, clock)| clock.taken > clock::steps_until(phenomenon.as_ref(), shutter)) {
            self.begin_anew()?;
        }
        clock::advance(&self.plan, &mut self.phenomena, &mut self.clocks, shutter, observer)?;
        self.number = number;
        Ok(())
    }

    fn draw(&mut self, observer: &dyn Observer) -> Result<(), RenderError> {
        let plate = {
            let _stage = StageGuard::begin(observer, Stage::Load);
            self.plates.frame(&self.plan, self.number)?
        };
        let mirrored = match self.mirror() {
            Some((_, mirror)) => self.plates.mirrored(&self.plan, mirror, observer)?,
            None => Arc::default(),
        };
        let mut view = self.plan.view(self.number);
        let spent = self.spent.take();
        let frame = match self.compose(&view, &plate, &mirrored, spent, observer)? {
            Some(frame) => frame,
            None => {
                let all = Rect::of_size(view.size[0], view.size[1]);
                view = view.through(all);
                let whole = self.compose(&view, &plate, &mirrored, None, observer)?;
                whole.and_then(|whole| crop(whole, self.plan.window)).ok_or(Cancelled)?
            }
        };
        self.frame = Some(frame);
        Ok(())
    }

    fn read(&mut self) -> Option<Frame> {
        self.frame.take()
    }

    fn recycle(&mut self, spent: Frame) {
        self.spent = Some(spent);
    }

    fn replan(&mut self, plan: Arc<Plan>) -> Result<(), RenderError> {
        let made_from = made_from(&plan);
        let new = self.make_others(&plan, &made_from)?;
        let mut old: Vec<_> = std::mem::take(&mut self.phenomena).into_iter().map(Some).collect();
        let mut carry = |(new, from): (Option<Made>, &[u8; 32])| match new {
            Some(made) => Some(made),
            None => {
                let index = self.made_from.iter().position(|own| own == from)?;
                Some((old[index].take()?, self.clocks[index]))
            }
        };
        let (phenomena, clocks): (Vec<_>, Vec<_>) = new.into_iter().zip(&made_from).filter_map(&mut carry).unzip();
        let goes_on = clocks.iter().any(|clock| clock.taken > 0);
        let same = fingerprint::of_state(&self.plan) == fingerprint::of_state(&plan);
        self.carried = goes_on && (self.carried || !same);
        if self.plan.scene.plate != plan.scene.plate {
            self.plates = PlateCache::default();
        }
        (self.plan, self.phenomena, self.clocks, self.made_from) = (plan, phenomena, clocks, made_from);
        (self.frame, self.spent) = (None, None);
        Ok(())
    }

    fn is_exact(&self) -> bool {
        !self.carried
    }

    fn particles(&self) -> PointCloud {
        let t = self.plan.shutter(self.number).middle();
        let mut all = PointCloud::default();
        self.phenomena.iter().filter_map(|phenomenon| phenomenon.particles(t)).for_each(|own| all.extend(&own));
        all
    }

    fn snapshot(&self) -> Vec<u8> {
        snapshot::write(&self.plan, &self.phenomena, &self.clocks)
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), RenderError> {
        let mut phenomena = self.plan.open()?;
        let clocks = snapshot::read(&self.plan, bytes, &mut phenomena)?;
        self.phenomena = phenomena;
        self.clocks = clocks;
        self.carried = false;
        self.frame = None;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::host::assets::MemoryAssets;

    use super::*;
    use crate::{phenomena::KINDS, plan::PlanOptions, scene::Scene};

    fn plan(text: &str) -> Arc<Plan> {
        let assets = Arc::new(MemoryAssets::default());
        let scene = Scene::parse("scene", text, KINDS, assets.as_ref()).unwrap();
        Arc::new(Plan::new(scene, &PlanOptions::default(), assets).unwrap())
    }

    #[test]
    fn only_what_changed_is_made_anew() {
        let text = "bansho = 1\n[wind]\n[sky]\n[[flame_sheet]]\n[[flame_sheet]]\nname = \"second\"\nheight = 1.0\n";
        let mut shot = CpuShot::open(plan(text)).unwrap();
        let made = |shot: &CpuShot| -> Vec<usize> {
            shot.phenomena.iter().map(|own| std::ptr::from_ref(own.as_ref()).addr()).collect()
        };
        let first = made(&shot);
        shot.replan(plan(&text.replace("[wind]", "[wind]\nvelocity = [1, 0, 0]"))).unwrap();
        assert_eq!(made(&shot), first, "wind is not theirs");
        shot.replan(plan(&text.replace("height = 1.0", "height = 2.0"))).unwrap();
        let second = made(&shot);
        assert_eq!([second[0], second[2]], [first[0], first[2]]);
        assert_ne!(second[1], first[1]);
        shot.replan(plan("bansho = 1\n[[flame_sheet]]\nname = \"second\"\nheight = 2.0\n")).unwrap();
        assert_eq!(made(&shot), [second[1]]);
        assert_eq!(shot.clocks.len(), 1);
    }

    #[test]
    fn gas_burns_on_when_its_flame_is_changed_also_where_it_would_burn_in_longer() {
        let text = "bansho = 1\n[[flame_particles]]\nparticles = 60\n[[flame_particles.burners]]\nheight = 0.8\n";
        let mut shot = CpuShot::open(plan(text)).unwrap();
        shot.advance(3, &bansho_base::host::observer::Unobserved).unwrap();
        let stands = |shot: &CpuShot| {
            let stepping = shot.phenomena[0].stepping().unwrap();
            (stepping.preroll_steps(), stepping.time_after(shot.clocks[0].taken), shot.particles())
        };
        let (preroll, time, gas) = stands(&shot);
        shot.replan(plan(&text.replace("0.8", "1.2"))).unwrap();
        let (longer, still, same) = stands(&shot);
        assert!(longer > preroll, "{longer} {preroll}");
        assert_eq!((still, same), (time, gas));
        assert!(!shot.is_exact() && shot.particles().positions.len() > 30);
        // Where steps are of another length its state is of no use.
        shot.replan(plan(
            &format!("{text}[flame_particles.look]\n").replace("particles = 60", "particles = 60\nstep_s = 0.01"),
        ))
        .unwrap();
        assert_eq!(shot.clocks[0].taken, 0);
    }
}
