//! How far a point is from the shape, answered near the shape only: the test with L_thr (thesis, 2.2.3).

use bansho_base::math::DVec2;

use super::{Shape, cells::CellGrid};

/// Cells along the reach: the finer they are, the fewer segments can be nearest to a place in one.
const CELLS_PER_REACH: f64 = 4.0;
/// Most cells along a side.
const MOST_CELLS: usize = 512;

/// Segments of a shape by the cells to whose places they can be nearest.
#[derive(Clone, Debug)]
pub struct Neighbourhood {
    reach: f64,
    grid: CellGrid,
    /// Where the list of each cell begins in `lists`, and where the last one ends.
    starts: Vec<u32>,
    lists: Vec<Segment>,
}

/// The place of a shape that is nearest to a point.
#[derive(Clone, Copy, Debug)]
pub(in crate::aurora) struct Nearest {
    /// Its segment, counted over all sheets in turn.
    pub(in crate::aurora) segment: usize,
    /// Share of the segment before it.
    pub(in crate::aurora) share: f64,
    /// Square of the distance, km^2.
    pub(in crate::aurora) square: f64,
    /// Signed distance from the line through the segment, negative on the left of the way along it, times the segment's length, km^2.
    pub(in crate::aurora) side: f64,
}

/// A segment: its number, its start, the way to its end, and one over the square of its length (0 where it has none).
#[derive(Clone, Copy, Debug)]
struct Segment {
    number: u32,
    start: DVec2,
    way: DVec2,
    inverse_square: f64,
}

impl Neighbourhood {
    /// What lies within `reach` km of `shape`.
    pub fn new(shape: &Shape, reach: f64) -> Self {
        let pairs = shape.sheets.iter().flat_map(|sheet| sheet.points.windows(2));
        let segments: Vec<Segment> =
            pairs.zip(0..).map(|(pair, number)| Segment::new(number, pair[0], pair[1])).collect();
        let ends = || segments.iter().flat_map(|segment| [segment.start, segment.start + segment.way]);
        let low = ends().fold(DVec2::INFINITY, DVec2::min);
        let high = ends().fold(DVec2::NEG_INFINITY, DVec2::max);
        let grid = if segments.is_empty() {
            CellGrid::new(DVec2::ZERO, DVec2::ZERO, 1.0, 1)
        } else {
            CellGrid::new(low - reach, high + reach, reach / CELLS_PER_REACH, MOST_CELLS)
        };
        let (starts, lists) = within(&grid, &segments, reach);
        let (starts, lists) = nearest_ones(&grid, &starts, &lists);
        Self { reach, grid, starts, lists }
    }

    /// Distance from `point` to the shape, km; `None` beyond the reach.
    pub fn distance(&self, point: DVec2) -> Option<f64> {
        self.nearest(point).map(|(_, distance)| distance)
    }

    /// The segment nearest to `point`, counted over all sheets in turn, and the distance to it, km; the first of several that
    /// are as near. `None` beyond the reach.
    #[inline]
    pub fn nearest(&self, point: DVec2) -> Option<(usize, f64)> {
        let nearest = self.nearest_place(point)?;
        Some((nearest.segment, nearest.square.sqrt()))
    }

    /// The place of the shape that is nearest to `point`; that on the first of several segments that are as near. `None` beyond the reach.
    #[inline]
    pub(in crate::aurora) fn nearest_place(&self, point: DVec2) -> Option<Nearest> {
        let cell = self.grid.cell_of(point);
        let mut nearest = Nearest { segment: 0, share: 0.0, square: f64::INFINITY, side: 0.0 };
        for segment in &self.lists[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
            let from_start = point - segment.start;
            let share = (from_start.dot(segment.way) * segment.inverse_square).clamp(0.0, 1.0);
            let square = from_start.distance_squared(segment.way * share);
            if square < nearest.square {
                // Times the length, the distance from the line through the segment.
                let side = from_start.perp_dot(segment.way);
                nearest = Nearest { segment: segment.number as usize, share, square, side };
            }
        }
        (nearest.square <= self.reach * self.reach).then_some(nearest)
    }
}

/// The segments within `reach` of each cell, one cell's after those of another, and where each cell's begin.
fn within(grid: &CellGrid, segments: &[Segment], reach: f64) -> (Vec<u32>, Vec<Segment>) {
    let mut starts = vec![0_u32; grid.count() + 1];
    let for_each = |segment: &Segment, visit: &mut dyn FnMut(usize)| {
        grid.for_each_passed(segment.start, segment.start + segment.way, reach, visit);
    };
    segments.iter().for_each(|segment| for_each(segment, &mut |cell| starts[cell + 1] += 1));
    for cell in 0..grid.count() {
        starts[cell + 1] += starts[cell];
    }
    let mut ends = starts.clone();
    let mut lists = vec![Segment::new(0, DVec2::ZERO, DVec2::ZERO); starts[grid.count()] as usize];
    for segment in segments {
        for_each(segment, &mut |cell| {
            lists[ends[cell] as usize] = *segment;
            ends[cell] += 1;
        });
    }
    (starts, lists)
}

/// Those of each cell that can be nearest to a place in it: no farther from its middle than the nearest one by more than twice the way from
/// there to its corners.
fn nearest_ones(grid: &CellGrid, starts: &[u32], lists: &[Segment]) -> (Vec<u32>, Vec<Segment>) {
    // A little more, so that rounding loses nothing.
    let slack = 2.0 * 1.001 * grid.half_diagonal();
    let (mut kept_starts, mut kept) = (vec![0], Vec::new());
    for (cell, ends) in starts.windows(2).enumerate() {
        let list = &lists[ends[0] as usize..ends[1] as usize];
        if !list.is_empty() {
            let middle = grid.middle(cell);
            let distance = |segment: &Segment| segment.distance_squared(middle).sqrt();
            let most = list.iter().map(distance).fold(f64::INFINITY, f64::min) + slack;
            kept.extend(list.iter().filter(|segment| distance(segment) <= most));
        }
        kept_starts.push(kept.len() as u32);
    }
    (kept_starts, kept)
}

impl Segment {
    fn new(number: u32, start: DVec2, end: DVec2) -> Self {
        let square = start.distance_squared(end);
        let inverse_square = if square > 0.0 { 1.0 / square } else { 0.0 };
        Self { number, start, way: end - start, inverse_square }
    }

    /// Square of the distance from a point.
    #[inline]
    fn distance_squared(&self, point: DVec2) -> f64 {
        let from_start = point - self.start;
        let share = (from_start.dot(self.way) * self.inverse_square).clamp(0.0, 1.0);
        from_start.distance_squared(self.way * share)
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::random::{Key, Purpose};

    use super::*;
    use crate::aurora::shapes::Sheet;

    fn sheet(points: Vec<DVec2>) -> Sheet {
        Sheet { flux: vec![1.0; points.len()], energy: vec![1.0; points.len()], points }
    }

    #[test]
    fn distances_to_a_segment_and_beyond_its_ends() {
        let shape = Shape { sheets: vec![sheet(vec![DVec2::ZERO, DVec2::new(10.0, 0.0)])] };
        let near = Neighbourhood::new(&shape, 5.0);
        assert_eq!(near.distance(DVec2::new(4.0, -3.0)), Some(3.0));
        assert_eq!(near.distance(DVec2::new(13.0, 4.0)), Some(5.0));
        assert_eq!(near.distance(DVec2::new(13.1, 4.0)), None);
        assert_eq!(near.distance(DVec2::new(1e9, f64::NAN)), None);
        assert_eq!(Neighbourhood::new(&Shape::default(), 5.0).distance(DVec2::ZERO), None);
    }

    #[test]
    fn the_cells_find_what_comparing_all_segments_finds() {
        let key = Key::new(2, "neighbourhood");
        let random = |index: u64| {
            let [x, y, ..] = key.uniforms(index, 0, Purpose::named("point"));
            DVec2::new(f64::from(x), f64::from(y)) * 200.0 - 100.0
        };
        let sheets = (0..4).map(|index| sheet((0..30).map(|point| random(100 * index + point)).collect())).collect();
        let shape = Shape { sheets };
        let near = Neighbourhood::new(&shape, 7.0);
        let pairs = shape.sheets.iter().flat_map(|sheet| sheet.points.windows(2));
        let segments: Vec<Segment> =
            pairs.zip(0..).map(|(pair, number)| Segment::new(number, pair[0], pair[1])).collect();
        let mut within = 0;
        for probe in 0..5_000 {
            let point = random(1000 + probe) * 1.2;
            let all = segments.iter().map(|segment| segment.distance_squared(point));
            let least = all.fold(f64::INFINITY, f64::min).sqrt();
            let expected = (least <= 7.0).then_some(least);
            within += usize::from(expected.is_some());
            assert_eq!(near.distance(point), expected);
        }
        assert!(within > 500);
    }
}
