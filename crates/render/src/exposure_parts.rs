//! Motion blur of phenomena that show each part of an exposure as it is in its middle: their parts are prepared one by one and averaged.

use bansho_base::{
    frame::MetadataEntry,
    host::{
        observer::{Cancelled, Observer},
        scratch_pool::ScratchPool,
    },
    image::Rect,
    phenomenon::{
        Deflection, OpaqueSurfaces, PlateRole, Prepared, Run,
        strip::{AovDescriptor, DepthInterval, Strip, View},
        surroundings::Surroundings,
    },
};

/// Most parts of an exposure.
const MAX_PARTS: usize = 64;

/// A part of an exposure, as one phenomenon is prepared for it.
pub(crate) struct ExposurePart<'a> {
    pub(crate) view: View,
    pub(crate) surroundings: Surroundings<'a>,
}

/// The parts of an exposure in which a phenomenon is drawn; none if it is drawn as a whole.
pub(crate) fn exposure_parts<'a>(
    run: &dyn Run,
    view: &View,
    surroundings: &Surroundings<'a>,
    surroundings_of_part: impl Fn(&View) -> Surroundings<'a>,
) -> Vec<ExposurePart<'a>> {
    let count = run.exposure_parts(view, surroundings).min(MAX_PARTS);
    if count <= 1 {
        return Vec::new();
    }
    let part = |index| {
        let view = view.part(index, count);
        ExposurePart { surroundings: surroundings_of_part(&view), view }
    };
    (0..count).map(part).collect()
}

/// The depth intervals of a phenomenon in all parts of an exposure: each grows to hold its motion.
pub(crate) fn depth_intervals(run: &dyn Run, parts: &[ExposurePart]) -> Vec<DepthInterval> {
    let each: Vec<_> = parts.iter().map(|part| run.depth_intervals(&part.view, &part.surroundings)).collect();
    let hull = |a: &mut DepthInterval, b: &DepthInterval| (a.near, a.far) = (a.near.min(b.near), a.far.max(b.far));
    let mut intervals = each.first().cloned().unwrap_or_default();
    if each.iter().all(|others| others.len() == intervals.len()) {
        for others in &each {
            intervals.iter_mut().zip(others).for_each(|(interval, other)| hull(interval, other));
        }
        return intervals;
    }
    // What is behind the camera for a while has no interval then, so they cannot be told apart.
    let mut all: Vec<DepthInterval> = each.into_iter().flatten().collect();
    all.sort_by(|a, b| a.near.total_cmp(&b.near));
    all.dedup_by(|next, previous| {
        let touches = next.near <= previous.far;
        if touches {
            hull(previous, next);
        }
        touches
    });
    all
}

/// Prepares a phenomenon for each part of an exposure.
pub(crate) fn prepare<'a>(
    run: &'a dyn Run,
    aovs: &'static [AovDescriptor],
    parts: &'a [ExposurePart<'a>],
    observer: &dyn Observer,
) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
    let prepared = parts.iter().map(|part| run.prepare(&part.view, &part.surroundings, observer));
    let parts = prepared.collect::<Result<_, _>>()?;
    Ok(Box::new(PreparedParts { parts, aovs, scratches: ScratchPool::new(Strip::default) }))
}

/// The parts of an exposure, at least one, drawn as their mean.
struct PreparedParts<'a> {
    parts: Vec<Box<dyn Prepared + 'a>>,
    aovs: &'static [AovDescriptor],
    scratches: ScratchPool<Strip, fn() -> Strip>,
}

impl PreparedParts<'_> {
    fn middle(&self) -> &dyn Prepared {
        &*self.parts[self.parts.len() / 2]
    }
}

impl Prepared for PreparedParts<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        self.parts.iter().fold(Rect::default(), |all, part| all.union(&part.bounds(slice)))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let weight = 1.0 / self.parts.len() as f32;
        self.scratches.with(|scratch| {
            for part in &self.parts {
                let touched = part.bounds(slice).intersection(&strip.rect);
                if touched.is_empty() {
                    continue;
                }
                let drawn = if strip.aovs.is_empty() { touched } else { strip.rect };
                scratch.reset_within(drawn, strip);
                part.draw(slice, scratch);
                strip.add_exposure_part(scratch, weight, self.aovs);
            }
        });
    }

    fn metadata(&self) -> Vec<MetadataEntry> {
        self.middle().metadata()
    }

    fn may_refract(&self) -> bool {
        self.parts.iter().any(|part| part.may_refract())
    }

    fn opaque_surfaces(&self) -> Option<&OpaqueSurfaces> {
        self.middle().opaque_surfaces()
    }

    fn deflection(&self) -> Option<Deflection<'_>> {
        self.middle().deflection()
    }

    fn plate_role(&self) -> PlateRole {
        self.middle().plate_role()
    }
}
