//! The shape as a function of time.

use bansho_base::{
    host::{assets::Assets, parallel::prelude::*},
    math::{self, DVec2},
};

use super::{
    Correspondence, FRAME_S, GapLight, MorphingParameters, Shape, ShapeError, ShapeErrorKind, ShapeParameters, Sheet,
    parameters::TRANSITION_S,
};
use crate::shapes::{
    control_points::{TrackedControlPoints, drawn_shapes, track_control_points},
    interpolation::{self, Bridge, Gap, GapFlux, Knot, ShapeTiming, SheetEnd, find_velocities},
    strokes::intersection::passes,
};

/// Weights of uniform spacing relative to distance, in order of preference: larger ones are tried if sheets cross during a
/// transition.
const EVENNESS: [f64; 4] = [0.01, 0.03, 0.1, 1.0];

/// Times per transition at which crossings are counted.
const CHECKED_TIMES: usize = 32;

/// All key shapes and in-between shapes (thesis, 2.2.2): splines in time through corresponding control points.
///
/// The shape is continuous in time, also at splits and merges. Points are clamped to the drawn square.
#[derive(Clone, Debug)]
pub struct Sequence {
    tracked: TrackedControlPoints,
    timing: ShapeTiming,
    half_km: f64,
    gap_light: GapLight,
    /// The first shape whose transition has crossing sheets.
    crossing: Option<usize>,
    loop_s: Option<f64>,
}

/// Ids of the control points of the shape at a time; a control point keeps its id in whichever sheet and position it is
/// listed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ControlPointIds<'a> {
    /// Ids by sheet.
    pub(crate) sheets: &'a [Vec<usize>],
    /// Number of completed cycles of a loop through all shapes; then ids of the last shape are replaced by those of the
    /// first.
    pub(crate) cycle: i64,
    /// Sorted pairs of coincident tracks of the last and the first shape.
    repeated: &'a [[usize; 2]],
}

impl<'a> ControlPointIds<'a> {
    /// Ids without a sequence.
    #[cfg(test)]
    pub(crate) fn alone(sheets: &'a [Vec<usize>]) -> Self {
        Self { sheets, cycle: 0, repeated: &[] }
    }

    /// Id of a control point in the next cycle of the loop.
    pub(crate) fn after_cycle(&self, track: usize) -> Option<usize> {
        let index = self.repeated.binary_search_by_key(&track, |pair| pair[0]).ok()?;
        Some(self.repeated[index][1])
    }
}

/// A time within the sequence: at a key shape, or at a fraction between two.
enum SequencePosition {
    At(usize),
    Between(usize, f64),
}

impl Sequence {
    /// The sequence of `shapes` on a drawn square of side `extent_km`; the default shapes if there are none.
    ///
    /// With `loop_s` it repeats after that time: cyclically if the last shape equals the first, else back and forth.
    ///
    /// # Errors
    ///
    /// Invalid shapes, with sheet and point; see [`ShapeErrorKind`].
    pub fn new(
        shapes: &[ShapeParameters],
        morphing: &MorphingParameters,
        extent_km: f64,
        assets: &dyn Assets,
        loop_s: Option<f64>,
    ) -> Result<Self, ShapeError> {
        if let Some(seconds) = loop_s.filter(|seconds| !(*seconds > 0.0 && seconds.is_finite())) {
            return Err(ShapeError { key: "loop".into(), kind: ShapeErrorKind::LoopLength { seconds } });
        }
        let default_shapes = super::parameters::default_shapes(extent_km);
        let shapes = if shapes.is_empty() { &default_shapes[..] } else { shapes };
        let timing = timing(shapes)?;
        let drawn = drawn_shapes(shapes, extent_km, assets)?;
        let mut best = Self {
            tracked: TrackedControlPoints::default(),
            timing,
            half_km: extent_km / 2.0,
            gap_light: morphing.gap_light,
            crossing: None,
            loop_s: None,
        };
        let mut fewest_crossings = usize::MAX;
        // The weight matters only where points are matched automatically.
        let is_automatic = morphing.correspondence == Correspondence::Automatic;
        for &evenness in if is_automatic { &EVENNESS[..] } else { &EVENNESS[..1] } {
            let mut tracked = track_control_points(shapes, &drawn, morphing, extent_km, evenness)?;
            let closed = loop_s.is_some() && tracked.is_closed;
            find_velocities(&mut tracked.tracks, &best.timing, closed);
            let candidate = Self { tracked, timing: best.timing.clone(), ..best };
            let crossings = candidate.crossings();
            if crossings < fewest_crossings {
                (best, fewest_crossings) = (candidate, crossings);
            }
            if fewest_crossings == 0 {
                break;
            }
        }
        let crossing = best.first_crossing();
        Ok(Self { loop_s, crossing, ..best })
    }

    /// Arrival time of each key shape, s, without a loop.
    pub fn arrivals(&self) -> &[f64] {
        &self.timing.arrivals
    }

    /// Total duration, s, without a loop.
    pub fn duration(&self) -> f64 {
        self.timing.departures[self.timing.departures.len() - 1]
    }

    /// The shape at time `t`, s, constant before the first and after the last key shape. The flux fades toward gaps.
    pub fn at(&self, t: f64) -> Shape {
        let (index, fraction) = match self.position_at(t) {
            SequencePosition::At(index) => {
                return self.shape(&self.tracked.shapes[index], |track| self.tracked.tracks[track].knot(index));
            }
            SequencePosition::Between(index, fraction) => (index, fraction),
        };
        let mut shape = self.shape(&self.tracked.strands[index], |track| {
            self.tracked.tracks[track].between(index, fraction, &self.timing)
        });
        let faded: &[Gap] = if self.gap_light == GapLight::Faded { &self.tracked.gaps[index] } else { &[] };
        for gap in faded {
            let (state, _) = self.gap(gap, index, fraction);
            for SheetEnd { sheet, is_end } in gap.ends.iter().filter_map(|end| self.end(*end, index)) {
                interpolation::fade_toward_gap(&mut shape.sheets[sheet], is_end, state.ends);
            }
        }
        shape
    }

    /// Ids of the control points of [`Self::at`].
    pub(crate) fn control_point_ids(&self, t: f64) -> ControlPointIds<'_> {
        let sheets = match self.position_at(t) {
            SequencePosition::At(index) => &self.tracked.shapes[index],
            SequencePosition::Between(index, _) => &self.tracked.strands[index],
        };
        let turns = self.loop_s.filter(|_| self.tracked.is_closed).map_or(0.0, |loop_s| (t / loop_s).floor());
        ControlPointIds { sheets, cycle: turns as i64, repeated: &self.tracked.repeated }
    }

    /// Bridges over narrow gaps between the sheets of [`Self::at`].
    pub fn bridges(&self, t: f64) -> Vec<Bridge> {
        let SequencePosition::Between(index, fraction) = self.position_at(t) else { return Vec::new() };
        if self.gap_light == GapLight::Full {
            return Vec::new();
        }
        self.tracked.gaps[index].iter().filter_map(|gap| self.bridge(gap, index, fraction)).collect()
    }

    /// The bridge over a gap in the transition from shape `index`, with the mean flux and energy of its ends; `None` if no light crosses it.
    fn bridge(&self, gap: &Gap, index: usize, fraction: f64) -> Option<Bridge> {
        let (state, knots) = self.gap(gap, index, fraction);
        let ends = [self.end(gap.ends[0], index)?, self.end(gap.ends[1], index)?];
        let [flux, energy] = [0, 1].map(|value| 0.5 * (knots[0].factors[value] + knots[1].factors[value]));
        let bridge = Bridge { ends, flux: flux * state.across, energy };
        (bridge.flux > 0.0).then_some(bridge)
    }

    /// Position of a time within the sequence.
    fn position_at(&self, t: f64) -> SequencePosition {
        let t = self.phase(t);
        let next = self.timing.arrivals.partition_point(|&arrival| arrival <= t).max(1);
        let index = next - 1;
        let departure = self.timing.departures[index];
        if t <= departure || next == self.timing.arrivals.len() {
            return SequencePosition::At(index);
        }
        SequencePosition::Between(index, (t - departure) / (self.timing.arrivals[next] - departure))
    }

    /// State of a gap in the transition from shape `index`, and its two ends.
    fn gap(&self, gap: &Gap, index: usize, fraction: f64) -> (GapFlux, [Knot; 2]) {
        let tracks = gap.ends.map(|track| &self.tracked.tracks[track]);
        let now = tracks.map(|track| track.between(index, fraction, &self.timing));
        let widest = tracks.map(|track| track.knot(index + usize::from(gap.opens)));
        let [width, max_width] = [now, widest].map(|[a, b]| a.position.distance(b.position));
        let from_closed = if gap.opens { fraction } else { 1.0 - fraction };
        (GapFlux::new(width, max_width, from_closed), now)
    }

    /// The end of a strand in the transition from shape `index` at which this control point is.
    fn end(&self, track: usize, index: usize) -> Option<SheetEnd> {
        let strands = self.tracked.strands[index].iter().enumerate();
        let mut ends = strands.filter_map(|(sheet, strand)| {
            let is_end = strand.last() == Some(&track);
            (is_end || strand.first() == Some(&track)).then_some(SheetEnd { sheet, is_end })
        });
        ends.next()
    }

    /// Start and end positions of all control points in the transition from shape `index`, km, by strand: a splitting
    /// sheet has two strands, two merging sheets are still two. Empty for the last shape.
    pub fn control_point_paths(&self, index: usize) -> Vec<Vec<[DVec2; 2]>> {
        let mut paths = Vec::new();
        for strand in self.tracked.strands.get(index).into_iter().flatten() {
            let tracks = strand.iter().map(|&track| &self.tracked.tracks[track]);
            paths.push(tracks.map(|track| [index, index + 1].map(|knot| track.knot(knot).position)).collect());
        }
        paths
    }

    /// Times at which transitions are checked for crossings, s, each with the index of the previous shape.
    fn checked_times(&self) -> Vec<(usize, f64)> {
        let ShapeTiming { arrivals, departures } = &self.timing;
        let mut times = Vec::with_capacity((arrivals.len() - 1) * CHECKED_TIMES);
        for index in 0..arrivals.len() - 1 {
            let span = arrivals[index + 1] - departures[index];
            for check in 0..CHECKED_TIMES {
                let fraction = (check as f64 + 0.5) / CHECKED_TIMES as f64;
                times.push((index, departures[index] + fraction * span));
            }
        }
        times
    }

    /// Total number of crossings at these times.
    fn crossings(&self) -> usize {
        self.checked_times().into_par_iter().map(|(_, time)| self.at(time).crossings()).sum()
    }

    /// The first shape, counted from 0, whose transition has sheets that cross each other or themselves.
    pub fn crossing(&self) -> Option<usize> {
        self.crossing
    }

    /// Computes [`Self::crossing`].
    fn first_crossing(&self) -> Option<usize> {
        let mut before: Option<(usize, Shape)> = None;
        for (index, time) in self.checked_times() {
            let now = self.at(time);
            let passes = before.as_ref().is_some_and(|(from, before)| *from == index && passes(before, &now));
            if passes || now.crossings() > 0 {
                return Some(index + 1);
            }
            before = Some((index, now));
        }
        None
    }

    /// Flux and energy factors of every control point at every key shape; those of in-between shapes are between them.
    pub fn factors(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.tracked.tracks.iter().flat_map(|track| &track.knots).map(|knot| knot.factors)
    }

    /// Time within the sequence, with the loop applied.
    fn phase(&self, t: f64) -> f64 {
        let Some(loop_s) = self.loop_s else { return t };
        let turns = t / loop_s;
        let turn = turns - turns.floor();
        if self.tracked.is_closed {
            turn * self.duration()
        } else {
            0.5 * self.duration() * (1.0 - math::cos(std::f64::consts::TAU * turn))
        }
    }

    /// The shape whose sheets have these tracks, each at the state `knot(track)`, within the drawn square.
    fn shape(&self, sheets: &[Vec<usize>], knot: impl Fn(usize) -> Knot) -> Shape {
        let half = DVec2::splat(self.half_km);
        let mut shape = Shape::default();
        for tracks in sheets {
            let mut sheet = Sheet::default();
            for &track in tracks {
                let Knot { position, factors: [flux, energy] } = knot(track);
                sheet.points.push(position.clamp(-half, half));
                sheet.flux.push(flux);
                sheet.energy.push(energy);
            }
            shape.sheets.push(sheet);
        }
        shape
    }
}

/// Arrival and departure times of each shape.
fn timing(shapes: &[ShapeParameters]) -> Result<ShapeTiming, ShapeError> {
    let mut timing = ShapeTiming { arrivals: Vec::new(), departures: Vec::new() };
    for (index, shape) in shapes.iter().enumerate() {
        let after = match (shape.transition_s, shape.transition_frames) {
            (Some(_), Some(_)) => {
                return Err(ShapeError::in_shape(index, "transition_frames", ShapeErrorKind::SecondsAndFrames));
            }
            (Some(seconds), None) => seconds,
            (None, Some(frames)) => frames * FRAME_S,
            (None, None) => TRANSITION_S,
        };
        if index == 0 {
            check_first_shape(shape)?;
        }
        let arrival = timing.departures.last().map_or(0.0, |departure| departure + after);
        timing.arrivals.push(arrival);
        timing.departures.push(arrival + shape.hold_s);
    }
    Ok(timing)
}

/// Checks that the first shape has nothing of a transition, since there is no shape before it.
fn check_first_shape(shape: &ShapeParameters) -> Result<(), ShapeError> {
    let times =
        [("transition_s", shape.transition_s.is_some()), ("transition_frames", shape.transition_frames.is_some())];
    if let Some((key, _)) = times.into_iter().find(|(_, is_set)| *is_set) {
        return Err(ShapeError::in_shape(0, key, ShapeErrorKind::TimeBeforeFirstShape));
    }
    let changes =
        [("split", shape.split.is_empty()), ("merge", shape.merge.is_empty()), ("link", shape.link.is_empty())];
    if let Some((key, _)) = changes.into_iter().find(|(_, is_empty)| !is_empty) {
        return Err(ShapeError::in_shape(0, key, ShapeErrorKind::ChangeBeforeFirstShape));
    }
    Ok(())
}
