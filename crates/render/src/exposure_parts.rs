//! Motion blur of phenomena that show each part of an exposure as it is in its middle: their parts are prepared one by one and averaged.
//!
//! Where two things move over the same pixels, the mean of what they composite is not the composite of their means: then the moments of the exposure are
//! composited one by one ([`moments`](crate::composite::moments)), and what blurs itself is prepared in parts too.

use std::sync::Arc;

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
const MAX_PARTS: usize = 128;

/// A part of an exposure, as one phenomenon is prepared for it.
pub(crate) struct ExposurePart<'a> {
    pub(crate) view: View,
    pub(crate) surroundings: Surroundings<'a>,
}

/// Of how many equal parts the motion of a phenomenon during an exposure consists.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PartCount {
    /// Number of parts; at most 1 if nothing moves.
    pub(crate) count: usize,
    /// Whether its parts are drawn only where other things move over the same pixels, since it blurs itself elsewhere.
    pub(crate) blurs_itself: bool,
}

impl PartCount {
    /// The parts of a phenomenon, whatever else moves.
    pub(crate) fn of_run(run: &dyn Run, view: &View, surroundings: &Surroundings) -> Self {
        let count = run.exposure_parts(view, surroundings).min(MAX_PARTS);
        if count > 1 {
            return Self { count, blurs_itself: false };
        }
        Self { count: run.parts_when_composited(view, surroundings).min(MAX_PARTS), blurs_itself: true }
    }
}

/// Changes the numbers of parts as little as possible so that parts of one phenomenon begin and end with parts of the others: each becomes the largest number,
/// or a half, a quarter or an eighth of it. What moves alone keeps its number, and is not drawn in parts if it blurs itself.
pub(crate) fn nest(counts: &mut [PartCount]) {
    let mut moving: Vec<&mut PartCount> = counts.iter_mut().filter(|parts| parts.count > 1).collect();
    if moving.len() < 2 {
        moving.iter_mut().filter(|parts| parts.blurs_itself).for_each(|parts| parts.count = 1);
        return;
    }
    let wanted: Vec<usize> = moving.iter().map(|parts| parts.count).collect();
    // In an order that does not depend on that of the scene's tables, for the rounding of the sum.
    let mut sorted = wanted.clone();
    sorted.sort_unstable();
    let largest = sorted[sorted.len() - 1];
    let candidates = (1..=largest).filter(|total| is_enough(*total, largest));
    let best = candidates.min_by(|a, b| change(&sorted, *a).total_cmp(&change(&sorted, *b))).unwrap_or(largest);
    moving.iter_mut().zip(nested(&wanted, best)).for_each(|(parts, count)| parts.count = count);
}

/// How much the numbers of parts change relatively if the largest becomes `total`: the sum of squares.
fn change(wanted: &[usize], total: usize) -> f64 {
    let pairs = nested(wanted, total).into_iter().zip(wanted);
    let relative = pairs.map(|(nested, wanted)| nested as f64 / *wanted as f64 - 1.0);
    relative.map(|change| change * change).sum()
}

/// Whether a number of parts may replace a wanted one: what moves by a pixel in each of these may move by a pixel and a half.
fn is_enough(count: usize, wanted: usize) -> bool {
    10 * count >= 7 * wanted
}

/// Numbers of parts near to the wanted ones, of which the largest is at least `total`: halves, quarters or eighths of the same number.
fn nested(wanted: &[usize], total: usize) -> Vec<usize> {
    const MAX_HALVINGS: u32 = 3;
    let mut halvings = Vec::with_capacity(wanted.len());
    for &wanted in wanted {
        let most = (0..=MAX_HALVINGS).rev().find(|halvings| is_enough(total >> halvings, wanted));
        halvings.push(most.unwrap_or(0));
    }
    // MAX_PARTS is a multiple of every unit, so it remains the limit.
    let total = total.next_multiple_of(1 << halvings.iter().copied().max().unwrap_or(0));
    halvings.into_iter().map(|halvings| total >> halvings).collect()
}

/// The parts of an exposure in which a phenomenon is drawn, and how.
#[derive(Default)]
pub(crate) struct ExposureParts<'a> {
    /// Empty if it is only drawn as a whole.
    pub(crate) parts: Vec<ExposurePart<'a>>,
    /// See [`PartCount::blurs_itself`]: the parts then show their middle.
    pub(crate) blurs_itself: bool,
}

impl<'a> ExposureParts<'a> {
    pub(crate) fn new(
        PartCount { count, blurs_itself }: PartCount,
        view: &View,
        surroundings_of_part: impl Fn(&View) -> Surroundings<'a>,
    ) -> Self {
        if count <= 1 {
            return Self::default();
        }
        let mut parts = Vec::with_capacity(count);
        for index in 0..count {
            let view = view.part(index, count);
            let surroundings = surroundings_of_part(&view);
            parts.push(ExposurePart { surroundings, view: if blurs_itself { view.at_middle() } else { view } });
        }
        Self { parts, blurs_itself }
    }

    /// The depth intervals of a phenomenon during the exposure of a view.
    pub(crate) fn depth_intervals(
        &self,
        run: &dyn Run,
        view: &View,
        surroundings: &Surroundings,
    ) -> Vec<DepthInterval> {
        if self.parts.is_empty() || self.blurs_itself {
            return run.depth_intervals(view, surroundings);
        }
        depth_intervals(run, &self.parts)
    }
}

/// A phenomenon that is prepared for an exposure.
pub(crate) struct PreparedExposure<'a> {
    /// All of it, with motion blur.
    pub(crate) whole: Box<dyn Prepared + 'a>,
    /// Its parts; empty if it does not move, and for what blurs itself.
    pub(crate) parts: Vec<Arc<dyn Prepared + 'a>>,
}

/// The depth intervals of a phenomenon in all parts of an exposure: each grows to hold its motion.
fn depth_intervals(run: &dyn Run, parts: &[ExposurePart]) -> Vec<DepthInterval> {
    let each: Vec<_> = parts.iter().map(|part| run.depth_intervals(&part.view, &part.surroundings)).collect();
    let mut intervals = each.first().cloned().unwrap_or_default();
    if each.iter().all(|others| others.len() == intervals.len()) {
        for others in &each {
            intervals.iter_mut().zip(others).for_each(|(interval, other)| extend(interval, other));
        }
        return intervals;
    }
    // What is behind the camera for a while has no interval then, so they cannot be told apart.
    let mut all: Vec<DepthInterval> = each.into_iter().flatten().collect();
    all.sort_by(|a, b| a.near.total_cmp(&b.near));
    all.dedup_by(|next, previous| {
        let touches = next.near <= previous.far;
        if touches {
            extend(previous, next);
        }
        touches
    });
    all
}

/// Extends an interval so that it holds another one.
fn extend(interval: &mut DepthInterval, other: &DepthInterval) {
    interval.near = interval.near.min(other.near);
    interval.far = interval.far.max(other.far);
}

/// Prepares a phenomenon for the exposure of a view.
pub(crate) fn prepare<'a>(
    run: &'a dyn Run,
    aovs: &'static [AovDescriptor],
    view: &'a View,
    surroundings: &'a Surroundings<'a>,
    exposure: &'a ExposureParts<'a>,
    observer: &dyn Observer,
) -> Result<PreparedExposure<'a>, Cancelled> {
    if exposure.parts.is_empty() || exposure.blurs_itself {
        return Ok(PreparedExposure { whole: run.prepare(view, surroundings, observer)?, parts: Vec::new() });
    }
    let prepared = exposure.parts.iter().map(|part| run.prepare(&part.view, &part.surroundings, observer));
    let parts = prepared.map(|part| part.map(Arc::from)).collect::<Result<Vec<Arc<dyn Prepared>>, _>>()?;
    let whole = PreparedParts { parts: parts.clone(), aovs, scratches: ScratchPool::new(Strip::default) };
    Ok(PreparedExposure { whole: Box::new(whole), parts })
}

/// Prepares the parts of a phenomenon that blurs itself.
pub(crate) fn prepare_parts<'a>(
    run: &'a dyn Run,
    exposure: &'a ExposureParts<'a>,
    observer: &dyn Observer,
) -> Result<Vec<Arc<dyn Prepared + 'a>>, Cancelled> {
    let prepared = exposure.parts.iter().map(|part| run.prepare_part(&part.view, &part.surroundings, observer));
    prepared.map(|part| part.map(Arc::from)).collect()
}

/// The parts of an exposure, at least one, drawn as their mean.
struct PreparedParts<'a> {
    parts: Vec<Arc<dyn Prepared + 'a>>,
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

#[cfg(test)]
mod tests {
    use super::*;

    fn nested_counts(counts: &[usize]) -> Vec<usize> {
        let mut counts: Vec<PartCount> = counts.iter().map(|&count| PartCount { count, blurs_itself: false }).collect();
        nest(&mut counts);
        counts.iter().map(|parts| parts.count).collect()
    }

    #[test]
    fn parts_of_several_things_begin_together() {
        assert_eq!(nested_counts(&[1, 22, 1]), [1, 22, 1], "what moves alone keeps its number");
        assert_eq!(nested_counts(&[32, 23, 23, 23, 23]), [24; 5]);
        assert_eq!(nested_counts(&[22, 1, 11]), [22, 1, 11]);
        assert_eq!(nested_counts(&[23, 10]), [22, 11]);
        assert_eq!(nested_counts(&[23, 2, 7, 1]), [24, 3, 6, 1]);
        for largest in 2..=MAX_PARTS {
            for other in 2..=largest {
                let [a, b] = nested_counts(&[largest, other])[..] else { panic!() };
                let is_nested = a <= MAX_PARTS && a % b == 0 && is_enough(a, largest) && is_enough(b, other);
                assert!(is_nested, "{largest} {other}: {a} {b}");
            }
        }
    }

    #[test]
    fn what_blurs_itself_has_parts_only_beside_other_motion() {
        let mut counts = [PartCount { count: 8, blurs_itself: true }, PartCount { count: 1, blurs_itself: false }];
        nest(&mut counts);
        assert_eq!(counts.map(|parts| parts.count), [1, 1]);
        let mut counts = [PartCount { count: 8, blurs_itself: true }, PartCount { count: 5, blurs_itself: false }];
        nest(&mut counts);
        assert_eq!(counts.map(|parts| parts.count), [8, 4]);
    }
}
