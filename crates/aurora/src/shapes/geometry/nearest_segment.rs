//! Nearest-segment queries within a maximum distance: the test against L_thr (thesis, 2.2.3).

use bansho_base::math::DVec2;

use super::cell_grid::CellGrid;
use crate::shapes::Shape;

/// Cells per query radius: smaller cells have fewer candidate segments.
const CELLS_PER_REACH: f64 = 4.0;
/// Maximum number of cells along a side.
const MAX_CELLS_PER_SIDE: usize = 512;
/// Approximate maximum number of cells within the radius, which bounds the cost for long shapes.
const MAX_CELLS_WITHIN_REACH: f64 = 40_000.0;

/// A uniform grid with the candidate segments of each cell.
#[derive(Clone, Debug)]
pub struct NearestSegmentGrid {
    reach: f64,
    grid: CellGrid,
    /// Start of each cell's list in `lists`, and the total.
    starts: Vec<u32>,
    lists: Vec<SegmentGeometry>,
}

/// The point of a shape that is nearest to a query point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearestPoint {
    /// Its segment index, counted over all sheets.
    pub(crate) segment: usize,
    /// Fraction along the segment.
    pub(crate) fraction: f64,
    /// Square of the distance, km^2.
    pub(crate) distance_squared: f64,
    /// Signed distance from the line through the segment, negative to the left, times the segment's length, km^2.
    pub(crate) cross: f64,
}

/// Index, start and direction of a segment, and one over its squared length (0 for a degenerate one).
#[derive(Clone, Copy, Debug)]
struct SegmentGeometry {
    number: u32,
    start: DVec2,
    direction: DVec2,
    inverse_square: f64,
}

impl NearestSegmentGrid {
    /// A grid for queries within `reach` km of `shape`.
    pub fn new(shape: &Shape, reach: f64) -> Self {
        let pairs = shape.sheets.iter().flat_map(|sheet| sheet.points.windows(2));
        let segments: Vec<SegmentGeometry> =
            pairs.zip(0..).map(|(pair, number)| SegmentGeometry::new(number, pair[0], pair[1])).collect();
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for segment in &segments {
            let end = segment.start + segment.direction;
            low = low.min(segment.start).min(end);
            high = high.max(segment.start).max(end);
        }
        let grid = if segments.is_empty() {
            CellGrid::new(DVec2::ZERO, DVec2::ZERO, 1.0, 1)
        } else {
            let area = 2.0 * reach * (shape.length() + reach);
            let cell = (reach / CELLS_PER_REACH).max((area / MAX_CELLS_WITHIN_REACH).sqrt());
            CellGrid::new(low - reach, high + reach, cell, MAX_CELLS_PER_SIDE)
        };
        let (starts, lists) = nearest_candidates(&grid, &segments, reach);
        Self { reach, grid, starts, lists }
    }

    /// Distance from `point` to the shape, km; `None` beyond the reach.
    pub fn distance(&self, point: DVec2) -> Option<f64> {
        self.nearest(point).map(|(_, distance)| distance)
    }

    /// Index of the segment nearest to `point`, counted over all sheets, and its distance, km; the first one at equal
    /// distance. `None` beyond the reach.
    #[inline]
    pub fn nearest(&self, point: DVec2) -> Option<(usize, f64)> {
        let nearest = self.nearest_point(point)?;
        Some((nearest.segment, nearest.distance_squared.sqrt()))
    }

    /// The point of the shape that is nearest to `point`, on the first segment at equal distance. `None` beyond the
    /// reach.
    #[inline]
    pub(crate) fn nearest_point(&self, point: DVec2) -> Option<NearestPoint> {
        let cell = self.grid.cell_of(point);
        let mut nearest = NearestPoint { segment: 0, fraction: 0.0, distance_squared: f64::INFINITY, cross: 0.0 };
        // The lists hold the segments themselves, not their indices: a query reads one run of memory.
        for segment in &self.lists[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
            let from_start = point - segment.start;
            let fraction = (from_start.dot(segment.direction) * segment.inverse_square).clamp(0.0, 1.0);
            let square = from_start.distance_squared(segment.direction * fraction);
            if square < nearest.distance_squared {
                // Cross product: distance from the line times the length.
                let side = from_start.perp_dot(segment.direction);
                nearest =
                    NearestPoint { segment: segment.number as usize, fraction, distance_squared: square, cross: side };
            }
        }
        (nearest.distance_squared <= self.reach * self.reach).then_some(nearest)
    }
}

/// A run of cells within reach of a segment.
struct CellRun {
    segment: u32,
    /// First cell, and the index of its distance in the common list.
    cell: u32,
    first: u32,
}

/// Candidate lists of all cells: a segment is kept if its distance from the cell's center exceeds that of the nearest
/// segment by at most the cell's diagonal. Distances are computed per run of cells.
fn nearest_candidates(grid: &CellGrid, segments: &[SegmentGeometry], reach: f64) -> (Vec<u32>, Vec<SegmentGeometry>) {
    let (mut runs, mut squares) = (Vec::new(), Vec::new());
    let mut min_squares = vec![f32::INFINITY; grid.count()];
    for (number, segment) in segments.iter().enumerate() {
        grid.for_each_run(segment.start, segment.start + segment.direction, reach, |cells| {
            let (cell, first) = (cells.start, squares.len());
            runs.push(CellRun { segment: number as u32, cell: cell as u32, first: first as u32 });
            squares.resize(first + cells.len(), 0.0);
            segment.fill_squares(grid.center(cell), grid.side(), &mut squares[first..]);
            for (min_square, square) in min_squares[cells].iter_mut().zip(&squares[first..]) {
                *min_square = if *square < *min_square { *square } else { *min_square };
            }
        });
    }
    // Margin for rounding.
    let slack = (2.0 * 1.001 * grid.half_diagonal()) as f32;
    let max_squares: Vec<f32> =
        min_squares.iter().map(|square| (square.sqrt() + slack) * (square.sqrt() + slack)).collect();
    // A counting sort by cell, in the order of the segments: the first pass counts the candidates, the second stores them.
    let mut starts = vec![0_u32; grid.count() + 1];
    for_each_candidate(&runs, &squares, &max_squares, |cell, _| starts[cell + 1] += 1);
    for cell in 0..grid.count() {
        starts[cell + 1] += starts[cell];
    }
    let mut next = starts.clone();
    let mut lists = vec![SegmentGeometry::new(0, DVec2::ZERO, DVec2::ZERO); starts[grid.count()] as usize];
    for_each_candidate(&runs, &squares, &max_squares, |cell, segment| {
        lists[next[cell] as usize] = segments[segment as usize];
        next[cell] += 1;
    });
    (starts, lists)
}

/// Visits each cell with each of its segments whose squared distance is at most the cell's `max_squares`, run by run.
fn for_each_candidate(runs: &[CellRun], squares: &[f32], max_squares: &[f32], mut visit: impl FnMut(usize, u32)) {
    for (index, run) in runs.iter().enumerate() {
        let end = runs.get(index + 1).map_or(squares.len(), |next| next.first as usize);
        let distances = &squares[run.first as usize..end];
        for (cell, square) in (run.cell as usize..).zip(distances) {
            if *square <= max_squares[cell] {
                visit(cell, run.segment);
            }
        }
    }
}

impl SegmentGeometry {
    fn new(number: u32, start: DVec2, end: DVec2) -> Self {
        let square = start.distance_squared(end);
        let inverse_square = if square > 0.0 { 1.0 / square } else { 0.0 };
        Self { number, start, direction: end - start, inverse_square }
    }

    /// Squared distances of `squares.len()` points in a row, `spacing` apart, starting at `first`.
    fn fill_squares(&self, first: DVec2, spacing: f64, squares: &mut [f32]) {
        let from_start = first - self.start;
        let ([x, y], [u, v]) =
            ([from_start.x as f32, from_start.y as f32], [self.direction.x as f32, self.direction.y as f32]);
        // In f32, twice as many lanes as in f64; the margin of `max_squares` covers the rounding.
        let (spacing, per_square) = (spacing as f32, self.inverse_square.min(f64::from(f32::MAX)) as f32);
        for (index, square) in squares.iter_mut().enumerate() {
            let x = x + spacing * index as f32;
            let fraction = ((x * u + y * v) * per_square).clamp(0.0, 1.0);
            let (beside, below) = (x - fraction * u, y - fraction * v);
            *square = beside * beside + below * below;
        }
    }

    /// Square of the distance from a point.
    #[cfg(test)]
    fn distance_squared(&self, point: DVec2) -> f64 {
        let from_start = point - self.start;
        let fraction = (from_start.dot(self.direction) * self.inverse_square).clamp(0.0, 1.0);
        from_start.distance_squared(self.direction * fraction)
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math::random::{Key, Purpose};

    use super::*;
    use crate::shapes::Sheet;

    fn sheet(points: Vec<DVec2>) -> Sheet {
        Sheet { flux: vec![1.0; points.len()], energy: vec![1.0; points.len()], points }
    }

    #[test]
    fn distances_to_a_segment_and_beyond_its_ends() {
        let shape = Shape { sheets: vec![sheet(vec![DVec2::ZERO, DVec2::new(10.0, 0.0)])] };
        let near = NearestSegmentGrid::new(&shape, 5.0);
        assert_eq!(near.distance(DVec2::new(4.0, -3.0)), Some(3.0));
        assert_eq!(near.distance(DVec2::new(13.0, 4.0)), Some(5.0));
        assert_eq!(near.distance(DVec2::new(13.1, 4.0)), None);
        assert_eq!(near.distance(DVec2::new(1e9, f64::NAN)), None);
        assert_eq!(NearestSegmentGrid::new(&Shape::default(), 5.0).distance(DVec2::ZERO), None);
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
        let near = NearestSegmentGrid::new(&shape, 7.0);
        let pairs = shape.sheets.iter().flat_map(|sheet| sheet.points.windows(2));
        let segments: Vec<SegmentGeometry> =
            pairs.zip(0..).map(|(pair, number)| SegmentGeometry::new(number, pair[0], pair[1])).collect();
        let mut within = 0;
        for probe in 0..5_000 {
            let point = random(1000 + probe) * 1.2;
            let all = segments.iter().map(|segment| segment.distance_squared(point));
            let min_squares = all.fold(f64::INFINITY, f64::min).sqrt();
            let expected = (min_squares <= 7.0).then_some(min_squares);
            within += usize::from(expected.is_some());
            assert_eq!(near.distance(point), expected);
        }
        assert!(within > 500);
    }
}
