//! Stepping of simulated phenomena: fixed time steps in an order that does not depend on the frames.

use bansho_base::{
    host::observer::{self, Cancelled, Observer, PartGuard, Stage, StagePart},
    phenomenon::{
        strip::Shutter,
        surroundings::{Light, Publication, Surroundings},
    },
};

use crate::{compiled::ActiveRun, composite::mirror::Mirror, context::ShotContext};

/// The surroundings of phenomenon `index` during `shutter`.
pub(crate) fn surroundings<'a>(
    context: &'a ShotContext,
    publications: &[Publication],
    index: usize,
    shutter: Shutter,
    mirror: Option<&'a Mirror>,
) -> Surroundings<'a> {
    Surroundings {
        wind: &context.wind,
        air: &context.plan.scene.air,
        sky: context.sky(shutter.middle()),
        reflection: mirror.and_then(|mirror| mirror.picture.as_ref()),
        backdrop: mirror.and_then(|mirror| mirror.backdrop.as_ref()),
        plate_is_lit: context.plan.scene.lights_plate(),
        others: others(context, publications, index, shutter),
        light_parts: Vec::new(),
    }
}

/// The lights of all phenomena but `index`, and the scene's own, in the middle of `shutter`.
pub(crate) fn lights(
    context: &ShotContext,
    publications: &[Publication],
    index: usize,
    shutter: Shutter,
) -> Vec<Light> {
    let scene = context.plan.scene.tables.lights(shutter.middle());
    let others = publications.iter().enumerate().filter(|(other, _)| *other != index);
    scene.chain(others.flat_map(|(_, publication)| publication.lights.iter().copied())).collect()
}

/// What all phenomena but `index` publish during `shutter`, and the scene's own lights and solids.
fn others(context: &ShotContext, publications: &[Publication], index: usize, shutter: Shutter) -> Publication {
    let mut others = scene_publication(context, shutter);
    for (other, publication) in publications.iter().enumerate() {
        if other != index {
            others.extend(publication);
        }
    }
    others
}

/// The scene's own lights, solids and media during `shutter`.
pub(crate) fn scene_publication(context: &ShotContext, shutter: Shutter) -> Publication {
    let tables = &context.plan.scene.tables;
    Publication {
        lights: tables.lights(shutter.middle()).collect(),
        light_parts: tables.light_parts(shutter),
        extinction: tables.extinction(shutter.middle()),
        occluders: context.compiled.solids(shutter.middle()).collect(),
        ..Publication::default()
    }
}

/// Steps all phenomena to the states from which the exposure `shutter` is drawn. The one whose time is earliest steps next, so that the order
/// of steps depends only on the lengths of the steps. Stops after `max_steps`; returns how many steps were taken.
pub(crate) fn advance(
    context: &ShotContext,
    runs: &mut [ActiveRun],
    shutter: Shutter,
    max_steps: u64,
    observer: &dyn Observer,
) -> Result<u64, Cancelled> {
    for stepped in runs.iter_mut().filter_map(|run| run.run.as_stepped_mut()) {
        stepped.begin_exposure(shutter);
    }
    for taken in 0..max_steps {
        let earliest = (0..runs.len())
            .filter(|&index| runs[index].steps_taken < runs[index].steps_until(shutter))
            .filter_map(|index| Some((index, runs[index].stepping?.time_after(runs[index].steps_taken))))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((index, now)) = earliest else { return Ok(taken) };
        observer::check(observer)?;
        step(context, runs, index, now, observer);
    }
    Ok(max_steps)
}

/// Steps phenomenon `index` from the time `now`, s.
fn step(context: &ShotContext, runs: &mut [ActiveRun], index: usize, now: f64, observer: &dyn Observer) {
    let phenomenon = runs[index].built.phenomenon.clone();
    let name = Some(phenomenon.info().name);
    let _part = PartGuard::begin(observer, StagePart { stage: Stage::Advance, phenomenon: name, is_mirrored: false });
    let instant = Shutter { open: now, close: now };
    let publications: Vec<Publication> = runs.iter().map(|other| other.run.publish(instant)).collect();
    let surroundings = surroundings(context, &publications, index, instant, None);
    if let Some(stepped) = runs[index].run.as_stepped_mut() {
        stepped.step(now, &surroundings);
    }
    runs[index].steps_taken += 1;
}

/// Time by which the phenomena are behind the states from which `shutter` is drawn, s; 0 once all have been stepped there.
pub(crate) fn time_behind(runs: &[ActiveRun], shutter: Shutter) -> f64 {
    let mut longest = 0.0_f64;
    for run in runs {
        let (Some(stepping), Some(stepped)) = (run.stepping, run.as_stepped()) else { continue };
        if run.steps_taken < run.steps_until(shutter) {
            longest = longest.max(stepped.time_for(shutter) - stepping.time_after(run.steps_taken));
        }
    }
    longest
}
