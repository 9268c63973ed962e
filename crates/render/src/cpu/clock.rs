//! Time of stepped phenomena: fixed steps in one order, whatever the frames.

use std::sync::OnceLock;

use bansho_base::{
    color,
    host::{
        observer::{self, Cancelled, Observer},
        once::get_or_make,
    },
    phenomenon::{
        Phenomenon, Remark,
        strip::Shutter,
        surroundings::{Neighbours, Publication, Surroundings},
    },
    world::sky::Sky,
};

use super::{faint::faint, mirror::Mirror};
use crate::{
    plan::{Plan, PlanError},
    scene::check::PLATE_LAYER,
};

/// How many steps a phenomenon has taken; 0 at its beginning, before the preroll.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Clock {
    /// Steps taken.
    pub(super) taken: u64,
}

/// Steps after which a phenomenon's state is the last one not after that which an exposure is drawn from; none for closed forms.
pub(super) fn steps_until(phenomenon: &dyn Phenomenon, shutter: Shutter) -> u64 {
    phenomenon.stepping().map_or(0, |stepping| stepping.steps_until(phenomenon.drawn_from(shutter)))
}

/// What phenomenon `index` is among during `shutter`.
pub(super) fn surroundings<'a>(
    plan: &'a Plan,
    publications: &[Publication],
    index: usize,
    shutter: Shutter,
    mirror: Option<&'a Mirror>,
) -> Surroundings<'a> {
    Surroundings {
        wind: &plan.wind,
        air: &plan.scene.air,
        sky: plan.sky(shutter.middle()),
        reflection: mirror.map(|mirror| &mirror.seen),
        backdrop: mirror.and_then(|mirror| mirror.backdrop.as_ref()),
        others: others(plan, publications, index, shutter),
    }
}

/// What everybody but `index` publishes during `shutter`, and the scene's own lights and obstacles.
fn others(plan: &Plan, publications: &[Publication], index: usize, shutter: Shutter) -> Publication {
    let mut others = of_scene(plan, shutter);
    for (other, publication) in publications.iter().enumerate() {
        if other != index {
            others.extend(publication);
        }
    }
    others
}

/// The scene's own lights and obstacles.
fn of_scene(plan: &Plan, shutter: Shutter) -> Publication {
    let lights = plan.scene.lights.iter().map(|light| light.at(shutter.middle())).collect();
    Publication { lights, occluders: plan.occluders.clone(), ..Publication::default() }
}

/// What there is in a scene at one moment.
struct Moment<'a> {
    shutter: Shutter,
    phenomena: &'a [Box<dyn Phenomenon>],
    scene: Publication,
    /// What phenomena publish, as far as anybody has asked.
    published: Vec<OnceLock<Publication>>,
    sky: Sky,
}

impl<'a> Moment<'a> {
    fn new(plan: &Plan, phenomena: &'a [Box<dyn Phenomenon>], shutter: Shutter) -> Self {
        Self {
            shutter,
            phenomena,
            scene: of_scene(plan, shutter),
            published: phenomena.iter().map(|_| OnceLock::new()).collect(),
            sky: plan.sky(shutter.middle()),
        }
    }

    fn remark(&self, index: usize) -> Option<Remark> {
        let published =
            |other: usize| get_or_make(&self.published[other], || self.phenomena[other].publish(self.shutter));
        let count = self.phenomena.len();
        let neighbours = Neighbours { scene: &self.scene, count, published: &published, own: index, sky: &self.sky };
        self.phenomena[index].remark(&neighbours)
    }
}

/// What users should know of how phenomena will look, each with its phenomenon's name.
///
/// Said only of what is so in the first, the middle and the last frame; that nothing lights it, only where nothing is simulated that may
/// shine later.
pub(crate) fn remarks(plan: &Plan) -> Result<Vec<(String, Remark)>, PlanError> {
    let phenomena = plan.open()?;
    let may_shine_later = phenomena.iter().any(|phenomenon| phenomenon.stepping().is_some());
    let frames = plan.frames();
    let shutters = [frames.start, (frames.start + frames.end) / 2, frames.end - 1].map(|number| plan.shutter(number));
    let moments = shutters.map(|shutter| Moment::new(plan, &phenomena, shutter));
    let remark = |index: usize| {
        let [first, middle, last] = moments.each_ref().map(|moment| moment.remark(index));
        let always = first.filter(|_| first == middle && middle == last)?;
        if may_shine_later && always == Remark::Unlit {
            return None;
        }
        Some((phenomena[index].name().to_owned(), always))
    };
    let plate = plan.assumed_plate_ev100().map(|ev100| {
        let white = color::white_luminance(ev100);
        (PLATE_LAYER.to_owned(), Remark::PlateExposureAssumed { ev100, white })
    });
    let looks = (0..phenomena.len()).filter_map(remark);
    Ok(plate.into_iter().chain(looks).chain(faint(plan, &phenomena)).collect())
}

/// Steps everybody until no state lies more than a step before that which an exposure is drawn from, always the one that is furthest
/// behind, so that the order of steps depends on nothing but the steps themselves.
pub(super) fn advance(
    plan: &Plan,
    phenomena: &mut [Box<dyn Phenomenon>],
    clocks: &mut [Clock],
    shutter: Shutter,
    observer: &dyn Observer,
) -> Result<(), Cancelled> {
    loop {
        let behind = (0..phenomena.len())
            .filter(|&index| clocks[index].taken < steps_until(phenomena[index].as_ref(), shutter))
            .filter_map(|index| Some((index, phenomena[index].stepping()?.time_after(clocks[index].taken))))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((index, now)) = behind else { return Ok(()) };
        observer::check(observer)?;
        let instant = Shutter { open: now, close: now };
        let publications: Vec<Publication> = phenomena.iter().map(|other| other.publish(instant)).collect();
        let surroundings = surroundings(plan, &publications, index, instant, None);
        phenomena[index].step(now, &surroundings);
        clocks[index].taken += 1;
    }
}
