//! In-between shapes: the path of a control point through the key shapes is a cubic spline in time (thesis, 2.2.2), and flux fades toward the gaps where
//! a sheet splits or two sheets merge.
//!
//! Before a gap opens, the flux decreases over some distance on both sides; the ends then separate while dark. Merging ends stay dim until they are close,
//! then brighten together.

use bansho_base::math::{DVec2, lerp, smoothstep};

use super::{Sheet, geometry::polyline::cumulative_lengths};

/// Arrival and departure times of each shape, s.
#[derive(Clone, Debug)]
pub(crate) struct ShapeTiming {
    pub(crate) arrivals: Vec<f64>,
    pub(crate) departures: Vec<f64>,
}

impl ShapeTiming {
    /// Duration of the transition from shape `index` to the next, s.
    fn span(&self, index: usize) -> f64 {
        self.arrivals[index + 1] - self.departures[index]
    }

    fn is_held(&self, index: usize) -> bool {
        self.departures[index] > self.arrivals[index]
    }
}

/// State of a control point at one shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Knot {
    pub(crate) position: DVec2,
    /// Factors of flux and energy there.
    pub(crate) factors: [f64; 2],
}

impl Knot {
    pub(crate) fn lerp(self, other: Self, fraction: f64) -> Self {
        let factors = [0, 1].map(|index| lerp(self.factors[index], other.factors[index], fraction));
        Self { position: self.position.lerp(other.position, fraction), factors }
    }
}

/// The two control points between which a point is inserted, and the fraction from the first to the second.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parents {
    pub(crate) tracks: [usize; 2],
    pub(crate) fraction: f64,
}

/// A control point from the shape where it is inserted to the last one that has it.
#[derive(Clone, Debug)]
pub(crate) struct ControlPointTrack {
    /// Index of its first shape.
    pub(super) first_shape: usize,
    pub(super) parents: Option<Parents>,
    pub(crate) knots: Vec<Knot>,
    /// Velocity at each knot, km/s.
    velocities: Vec<DVec2>,
}

/// Boundary condition of a spline.
#[derive(Clone, Copy)]
enum SplineEnd {
    /// Zero curvature.
    Natural,
    Velocity(DVec2),
}

impl ControlPointTrack {
    pub(crate) fn new(first_shape: usize, parents: Option<Parents>, knot: Knot) -> Self {
        Self { first_shape, parents, knots: vec![knot], velocities: Vec::new() }
    }

    /// The knot at shape `index`, which must be one of its shapes.
    pub(crate) fn knot(&self, index: usize) -> Knot {
        self.knots[index - self.first_shape]
    }

    /// Interpolates between shape `index` and the next, at a fraction of the time between them.
    pub(crate) fn between(&self, index: usize, fraction: f64, timing: &ShapeTiming) -> Knot {
        let knot_index = index - self.first_shape;
        let [from, to] = [self.knots[knot_index], self.knots[knot_index + 1]];
        let span = timing.span(index);
        let [out, into] = [self.velocities[knot_index] * span, self.velocities[knot_index + 1] * span];
        let displacement = to.position - from.position;
        let position = from.position
            + fraction
                * (out
                    + fraction
                        * (3.0 * displacement - 2.0 * out - into + fraction * (out + into - 2.0 * displacement)));
        Knot { position, ..from.lerp(to, smoothstep(0.0, 1.0, fraction)) }
    }
}

/// Computes the velocities of all tracks. Velocities are 0 at held shapes. Free ends have zero curvature; with only two
/// shapes the motion eases in and out. An inserted point starts with its parents' velocity, and also ends with it if it
/// exists for one transition only. With `closed`, points that return to their start have one velocity there.
pub(crate) fn find_velocities(tracks: &mut [ControlPointTrack], timing: &ShapeTiming, closed: bool) {
    for index in 0..tracks.len() {
        let (done, remaining) = tracks.split_at_mut(index);
        let Some(track) = remaining.first_mut() else { return };
        let parent_velocities =
            track.parents.map(|parents| [0, 1].map(|later| parents.velocity(track.first_shape + later, done)));
        track.velocities = velocities(track, timing, parent_velocities, closed);
    }
}

impl Parents {
    /// Interpolated velocity of the parents at shape `index`.
    fn velocity(&self, index: usize, tracks: &[ControlPointTrack]) -> DVec2 {
        let [first, second] = self.tracks.map(|parent| {
            let parent = &tracks[parent];
            parent.velocities.get(index - parent.first_shape).copied().unwrap_or_default()
        });
        first.lerp(second, self.fraction)
    }
}

/// Velocity of a track at each of its knots, km/s: one spline from each held shape to the next.
fn velocities(
    track: &ControlPointTrack,
    timing: &ShapeTiming,
    parent_velocities: Option<[DVec2; 2]>,
    closed: bool,
) -> Vec<DVec2> {
    let count = track.knots.len();
    let closing_velocity = closed.then(|| closing_velocity(track, timing)).flatten();
    let mut velocities = vec![DVec2::ZERO; count];
    let mut from = 0;
    while from + 1 < count {
        let held = (from + 1..count - 1).find(|&knot_index| timing.is_held(track.first_shape + knot_index));
        let to = held.unwrap_or(count - 1);
        let spans: Vec<f64> = (from..to).map(|knot_index| timing.span(track.first_shape + knot_index)).collect();
        let positions: Vec<DVec2> = track.knots[from..=to].iter().map(|knot| knot.position).collect();
        let ends = [from, to].map(|knot_index| {
            if timing.is_held(track.first_shape + knot_index) {
                return SplineEnd::Velocity(DVec2::ZERO);
            }
            match (knot_index, parent_velocities) {
                (0, Some([velocity, _])) => SplineEnd::Velocity(velocity),
                (1, Some([_, velocity])) if count == 2 => SplineEnd::Velocity(velocity),
                _ => closing_velocity.map_or(SplineEnd::Natural, SplineEnd::Velocity),
            }
        });
        velocities[from..=to].copy_from_slice(&spline(&positions, &spans, ends));
        from = to;
    }
    velocities
}

/// Velocity at the common start and end position of a closed track, if it returns.
fn closing_velocity(track: &ControlPointTrack, timing: &ShapeTiming) -> Option<DVec2> {
    let count = track.knots.len();
    let [first, last] = [track.knots[0], track.knots[count - 1]].map(|knot| knot.position);
    let returns = track.first_shape == 0 && count == timing.arrivals.len() && first.distance(last) < 1e-3;
    (returns && count > 2).then(|| {
        let displacement = track.knots[1].position - track.knots[count - 2].position;
        displacement / (timing.span(0) + timing.span(count - 2))
    })
}

/// Velocities of the C2 cubic spline through `positions` (tridiagonal system, Thomas algorithm).
fn spline(positions: &[DVec2], spans: &[f64], mut ends: [SplineEnd; 2]) -> Vec<DVec2> {
    let last = spans.len();
    if last == 1 && matches!(ends, [SplineEnd::Natural, SplineEnd::Natural]) {
        ends = [SplineEnd::Velocity(DVec2::ZERO); 2];
    }
    let slopes: Vec<DVec2> = positions.windows(2).zip(spans).map(|(pair, span)| (pair[1] - pair[0]) / *span).collect();
    let (mut ratios, mut values): (Vec<f64>, Vec<DVec2>) = (Vec::new(), Vec::new());
    for i in 0..=last {
        let row = if i == 0 {
            TridiagonalRow::of_end(ends[0], slopes[0])
        } else if i == last {
            TridiagonalRow::of_end(ends[1], slopes[last - 1]).mirrored()
        } else {
            TridiagonalRow::of_inner([spans[i - 1], spans[i]], [slopes[i - 1], slopes[i]])
        };
        let TridiagonalRow { lower, diagonal, upper, right } = row;
        let (ratio, value) = if i == 0 { (0.0, DVec2::ZERO) } else { (ratios[i - 1], values[i - 1]) };
        let pivot = diagonal - lower * ratio;
        ratios.push(upper / pivot);
        values.push((right - value * lower) / pivot);
    }
    for i in (0..last).rev() {
        let next = values[i + 1];
        values[i] -= next * ratios[i];
    }
    values
}

/// A row of a tridiagonal system: lower v(i-1) + diagonal v(i) + upper v(i+1) = right.
struct TridiagonalRow {
    lower: f64,
    diagonal: f64,
    upper: f64,
    /// Right-hand side.
    right: DVec2,
}

impl TridiagonalRow {
    /// The row of an inner knot, for the time spans and slopes of the segments before and after it: the second derivative
    /// is continuous there.
    fn of_inner(spans: [f64; 2], slopes: [DVec2; 2]) -> Self {
        let [before, after] = [1.0 / spans[0], 1.0 / spans[1]];
        Self {
            lower: before,
            diagonal: 2.0 * (before + after),
            upper: after,
            right: 3.0 * (slopes[0] * before + slopes[1] * after),
        }
    }

    /// The first row, for a boundary condition and the slope of the first segment.
    fn of_end(end: SplineEnd, slope: DVec2) -> Self {
        match end {
            SplineEnd::Natural => Self { lower: 0.0, diagonal: 2.0, upper: 1.0, right: 3.0 * slope },
            SplineEnd::Velocity(velocity) => Self { lower: 0.0, diagonal: 1.0, upper: 0.0, right: velocity },
        }
    }

    /// The corresponding last row.
    fn mirrored(self) -> Self {
        Self { lower: self.upper, upper: self.lower, ..self }
    }
}

/// Gaps narrower than this, km, and than half of their maximum width, are bridged by light.
const BRIDGED_KM: f64 = 40.0;
/// Length over which the flux fades toward a gap, km, and its maximum as a fraction of the sheet.
const FADE_KM: f64 = 60.0;
const MAX_FADE_FRACTION: f64 = 0.35;
/// Fraction of the transition, on the side of the maximum width, over which ends change between drawn and dark.
const DARKENING: f64 = 0.15;

/// Two control points that coincide where the gap is closed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gap {
    pub(crate) ends: [usize; 2],
    /// Whether it opens (a split) or closes (a merge).
    pub(crate) opens: bool,
}

/// State of a gap at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GapFlux {
    /// Factor of the flux at both ends.
    pub(crate) ends: f64,
    /// Factor of the flux across the gap.
    pub(crate) across: f64,
}

/// Light across a narrow gap between two ends of sheets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bridge {
    /// The two ends.
    pub ends: [SheetEnd; 2],
    /// Factor of the aurora's flux.
    pub flux: f64,
    /// Factor of the aurora's energy.
    pub energy: f64,
}

/// The start or the end of a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SheetEnd {
    /// Index of the sheet.
    pub sheet: usize,
    /// Whether it is the end, else the start.
    pub is_end: bool,
}

impl GapFlux {
    /// A gap of width `width`, km, and maximum width `max_width`, at a fraction of the time from closed to maximum width.
    pub(crate) fn new(width: f64, max_width: f64, fraction: f64) -> Self {
        let limit = BRIDGED_KM.min(0.5 * max_width);
        let closed = if limit > 0.0 { 1.0 - smoothstep(0.0, limit, width) } else { 1.0 };
        // At maximum width the sheets are as drawn.
        let free = 1.0 - smoothstep(1.0 - DARKENING, 1.0, fraction);
        Self { ends: 1.0 - (1.0 - closed) * free, across: closed * free }
    }
}

/// Fades the flux of a sheet toward its end, or else its start, down to a fraction.
pub(crate) fn fade_toward_gap(sheet: &mut Sheet, is_end: bool, fraction: f64) {
    let lengths = cumulative_lengths(&sheet.points);
    let whole = lengths.last().copied().unwrap_or(0.0);
    let fade_km = FADE_KM.min(MAX_FADE_FRACTION * whole);
    for (flux, length) in sheet.flux.iter_mut().zip(&lengths) {
        let from_end = if is_end { whole - length } else { *length };
        let risen = if fade_km > 0.0 { smoothstep(0.0, fade_km, from_end) } else { 1.0 };
        *flux *= 1.0 - (1.0 - fraction) * (1.0 - risen);
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math::DVec2;

    use super::*;

    fn timing(arrivals: &[f64], departures: &[f64]) -> ShapeTiming {
        ShapeTiming { arrivals: arrivals.to_vec(), departures: departures.to_vec() }
    }

    fn track(xs: &[f64]) -> ControlPointTrack {
        let knot = |x: f64| Knot { position: DVec2::new(x, 0.0), factors: [1.0, 1.0] };
        let mut track = ControlPointTrack::new(0, None, knot(xs[0]));
        track.knots.extend(xs[1..].iter().map(|&x| knot(x)));
        track
    }

    fn solved(xs: &[f64], timing: &ShapeTiming, closed: bool) -> ControlPointTrack {
        let mut tracks = [track(xs)];
        find_velocities(&mut tracks, timing, closed);
        let [track] = tracks;
        track
    }

    /// Natural spline through 0, 1, 0 at t = 0, 1, 2: velocities 3/2, 0, -3/2, and 11/16 at t = 1/2.
    #[test]
    fn three_shapes_make_a_natural_spline() {
        let timing = timing(&[0.0, 1.0, 2.0], &[0.0, 1.0, 2.0]);
        let track = solved(&[0.0, 1.0, 0.0], &timing, false);
        assert_eq!(track.velocities.iter().map(|v| v.x).collect::<Vec<_>>(), [1.5, 0.0, -1.5]);
        assert!((track.between(0, 0.5, &timing).position.x - 0.6875).abs() < 1e-15);
    }

    #[test]
    fn two_shapes_ease_in_and_out() {
        let timing = timing(&[0.0, 4.0], &[0.0, 4.0]);
        let track = solved(&[0.0, 8.0], &timing, false);
        let at = |fraction: f64| track.between(0, fraction, &timing).position.x;
        assert_eq!([at(0.0), at(0.25), at(0.5), at(1.0)], [0.0, 1.25, 4.0, 8.0]);
    }

    #[test]
    fn a_held_shape_stands_still() {
        let timing = timing(&[0.0, 1.0, 4.0, 5.0], &[0.0, 2.0, 4.0, 5.0]);
        let track = solved(&[0.0, 1.0, 2.0, 0.0], &timing, false);
        assert_eq!(track.velocities[1], DVec2::ZERO);
        assert!(track.velocities[0].x > 0.0 && track.velocities[3].x < 0.0);
    }

    /// With uneven times the second derivative must be the same on both sides of each inner knot.
    #[test]
    fn the_second_derivative_is_continuous() {
        let timing = timing(&[0.0, 0.7, 3.0, 3.4, 9.0], &[0.0, 0.7, 3.0, 3.4, 9.0]);
        let track = solved(&[0.0, 5.0, -2.0, 1.0, 7.0], &timing, false);
        let bend = |index: usize, fraction: f64| {
            let h = 1e-4;
            let at = |fraction: f64| track.between(index, fraction, &timing).position.x;
            let span = timing.span(index);
            (at(fraction - h) - 2.0 * at(fraction) + at(fraction + h)) / (h * span * h * span)
        };
        for knot in 1..4 {
            // A cubic's second derivative is linear, so that its values beyond the piece are exact too.
            assert!((bend(knot - 1, 1.0) - bend(knot, 0.0)).abs() < 1e-3, "knot {knot}");
        }
        assert!(bend(0, 0.0).abs() < 1e-3 && bend(3, 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_closed_way_passes_its_start_with_one_velocity() {
        let timing = timing(&[0.0, 1.0, 2.0, 3.0], &[0.0, 1.0, 2.0, 3.0]);
        let track = solved(&[0.0, 1.0, -1.0, 0.0], &timing, true);
        assert_eq!(track.velocities[0], track.velocities[3]);
        assert_eq!(track.velocities[0].x, 1.0);
    }

    #[test]
    fn what_is_born_moves_on_as_its_parents() {
        let timing = timing(&[0.0, 1.0, 2.0], &[0.0, 1.0, 2.0]);
        let mut tracks = vec![track(&[0.0, 1.0, 0.0]), track(&[0.0, 3.0, 8.0])];
        let parents = Parents { tracks: [0, 1], fraction: 0.5 };
        let mut child =
            ControlPointTrack::new(1, Some(parents), Knot { position: DVec2::new(2.0, 0.0), factors: [1.0; 2] });
        child.knots.push(Knot { position: DVec2::new(9.0, 0.0), factors: [3.0; 2] });
        tracks.push(child);
        find_velocities(&mut tracks, &timing, false);
        assert_eq!(tracks[2].velocities[0], tracks[0].velocities[1].midpoint(tracks[1].velocities[1]));
        assert_eq!(tracks[2].between(1, 0.5, &timing).factors, [2.0; 2]);
    }

    #[test]
    fn light_passes_over_narrow_gaps_only_and_ends_are_as_drawn_at_the_wide_side() {
        assert_eq!(GapFlux::new(0.0, 100.0, 0.0), GapFlux { ends: 1.0, across: 1.0 });
        assert_eq!(GapFlux::new(41.0, 100.0, 0.5), GapFlux { ends: 0.0, across: 0.0 });
        assert_eq!(GapFlux::new(100.0, 100.0, 1.0), GapFlux { ends: 1.0, across: 0.0 });
        let half = GapFlux::new(20.0, 100.0, 0.3);
        assert!((half.ends - 0.5).abs() < 1e-12 && half.across == half.ends);
        // A gap that never gets wide is dark by half of its width.
        assert_eq!(GapFlux::new(4.0, 8.0, 0.5).across, 0.0);
        assert_eq!(GapFlux::new(0.0, 0.0, 0.5).across, 1.0);
    }

    #[test]
    fn flux_fades_toward_the_gap_alone() {
        let points: Vec<DVec2> = (0..41).map(|index| DVec2::new(10.0 * f64::from(index), 0.0)).collect();
        let mut sheet = Sheet { flux: vec![2.0; points.len()], energy: vec![1.0; points.len()], points };
        fade_toward_gap(&mut sheet, true, 0.25);
        assert_eq!((sheet.flux[40], sheet.flux[0], sheet.flux[34]), (0.5, 2.0, 2.0));
        assert!(sheet.flux.windows(2).all(|pair| pair[1] <= pair[0]));
        // Half of the way up between.
        assert!((sheet.flux[37] - 2.0 * 0.625).abs() < 1e-12);
    }
}
