//! Bins of precipitation by longitude and distance from the observer's own field line.
//!
//! Every source is a patch with the separable kernel `(1 - r^2)^2`, wider than a chart cell so that single sources are
//! not visible. Sources are sorted into blocks of columns: each block is summed by one thread in a fixed order, so
//! results do not depend on the number of threads.

use std::{f64::consts::LN_2, ops::Range};

use bansho_base::{
    host::parallel::prelude::*,
    math::{
        self, approximations,
        simd::{FourLanes, Real},
    },
};
use fearless_simd::{Simd, dispatch, prelude::*};

use crate::render::project::{
    chart::{BLOCK_COLUMNS, Chart, ChartProjection},
    field_lines::FieldLines,
    visible_rows::VisibleRowTest,
};

/// Sources per task.
const TASK: usize = 4096;
/// Altitude for the width of bins, km: that of the lower border, the sharpest feature.
const SCALE_KM: f64 = 100.0;
/// Change of the altitude on a line of sight between neighboring far bins, km; more only where a chart row is taller.
const STEP_KM: f64 = 1.0;
/// Near bins per kernel support, and the limits of their width in chart rows. Wider bins would blur the edges of thin
/// sheets near the magnetic zenith.
const BINS_PER_REACH: f64 = 5.0;
const ROWS_PER_BIN: [f64; 2] = [0.5, 1.25];
/// Sources farther than this are below the horizon of an observer below the light, or of one above it at up to 500 km, km.
const MAX_DISTANCE_KM: f64 = 3000.0;
const MAX_DISTANCE_FROM_ABOVE_KM: f64 = 4000.0;
/// Minimum kernel support in cells, so that the sum does not depend on the subcell position.
const MIN_REACH_CELLS: f32 = 1.6;
/// Maximum entry spacing of prefiltered emission tables, relative to the altitude step between bins. Steps as large as
/// the emission layer need this spacing, else linear interpolation shows the pattern of the bins.
pub(crate) const MAX_ENTRY_PER_STEP: f32 = 2.0;
/// Maximum width, in near bins, over which prefiltered tables spread a bin's light: their filter spans two entries,
/// each less than twice as wide as requested.
const SMOOTHING_BINS: f32 = 4.0 * MAX_ENTRY_PER_STEP;
/// Normalization: one over the integral of `(1 - r^2)^2` over (-1, 1).
const NORM: f32 = 15.0 / 16.0;

/// Precipitation about one field line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FieldLineSource {
    /// Position in the plane perpendicular to the field, km.
    pub(crate) across: [f32; 2],
    /// Half-width of the kernel's support, km: standard deviation times [`REACH`].
    pub(crate) reach: f32,
    /// Fractional index of the electron energy in the energy grid.
    pub(crate) energy_node: f32,
    /// Power times the cosine to the vertical, 1000 W: for green, red and prompt light.
    pub(crate) power: [f32; 3],
    /// Random-number counter of its electron tracks: the particle's id or the cell's index.
    pub(crate) random_key: u32,
}

impl FieldLineSource {
    /// Distance from the observer's own field line, km.
    #[inline(always)]
    pub(crate) fn distance(&self) -> f32 {
        let [x, y] = self.across;
        x.fma(x, y * y).sqrt()
    }
}

/// Half-width of the kernel's support for a standard deviation of 1.
pub(crate) const REACH: f32 = 2.645_751_3;

/// Contents of a bin: power for green, red and prompt light in 1000 W per km of width, and their sum times the energy
/// node.
pub(crate) type Bin = [f32; 4];

/// The sources of a picture, sorted by the blocks of chart columns that they overlap.
pub(crate) struct SortedSources<'a> {
    sources: &'a [FieldLineSource],
    /// Output of each sorting task, in the order of the sources.
    chunks: Vec<SortedChunk>,
    bins: DistanceBins,
}

/// The sources of one sorting task, sorted by blocks.
struct SortedChunk {
    /// Start index of each block, and the total.
    starts: Vec<u32>,
    entries: Vec<BlockEntry>,
}

/// A source that overlaps a block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct BlockEntry {
    /// Index of the source.
    pub(crate) source: u32,
    /// First column of the block within the source's support, and one past the last.
    columns: [u16; 2],
}

impl BlockEntry {
    /// Columns of the block within the source's support.
    #[inline(always)]
    pub(crate) fn columns(&self) -> Range<usize> {
        self.columns[0] as usize..self.columns[1] as usize
    }
}

/// Columns within a source's support: the first, which may be outside the chart, and their number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ColumnSpan {
    first: i32,
    count: i32,
}

/// Distance bins: of constant width near the observer's field line, then proportional to the distance, so that the
/// altitude on a line of sight changes by a constant step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DistanceBins {
    /// Width of near bins, km, and its inverse.
    width: f64,
    per_width: f64,
    /// Distance at which far bins start, km, and the number of near bins.
    pub(crate) near_limit_km: f64,
    near: f64,
    /// Width of far bins divided by their distance, and far bins per octave of distance.
    relative_width: f64,
    per_octave: f64,
    /// Bin coordinate that far bins would have at 1 km.
    far_offset: f64,
    /// Number of bins.
    pub(crate) count: usize,
    /// Distance at which they end, km.
    max_distance_km: f64,
}

impl DistanceBins {
    /// Bins for patches of a standard deviation in km or more, on a chart with rows of `step` radians.
    pub(super) fn new(spread_km: f64, step: f64, field: &FieldLines) -> Self {
        let [nearest_km, farthest_km] = field.border_distances_km(SCALE_KM);
        let max_distance_km = if field.is_above_light() { MAX_DISTANCE_FROM_ABOVE_KM } else { MAX_DISTANCE_KM };
        let row = step * nearest_km;
        let width = (spread_km * f64::from(REACH) / BINS_PER_REACH).clamp(ROWS_PER_BIN[0] * row, ROWS_PER_BIN[1] * row);
        // A line of sight is at z = r cot a along the field, so a bin of relative width w changes z by w z: by the same step at all distances.
        let relative_width = (STEP_KM / farthest_km).max(2.0 * step);
        let near_limit_km = (width / relative_width).min(max_distance_km);
        let near = near_limit_km / width;
        let count = (near + math::ln(max_distance_km / near_limit_km) / relative_width).ceil().max(1.0) as usize;
        let per_octave = LN_2 / relative_width;
        // Near and far bins meet at the limit with the same coordinate.
        let far_offset = near - per_octave * math::log2(near_limit_km);
        Self {
            width,
            per_width: 1.0 / width,
            near_limit_km,
            near,
            relative_width,
            per_octave,
            far_offset,
            count,
            max_distance_km,
        }
    }

    /// Width of a bin at a distance, km.
    #[inline(always)]
    fn bin_width(&self, distance: f32) -> f32 {
        (self.relative_width as f32 * distance).max(self.width as f32)
    }

    /// Fractional bin coordinate of a distance; 0 is the near edge of the first bin.
    #[inline(always)]
    fn coordinate(&self, distance: f32) -> f32 {
        let far = approximations::log2(distance).fma(self.per_octave as f32, self.far_offset as f32);
        if distance < self.near_limit_km as f32 { distance * self.per_width as f32 } else { far }
    }

    /// Minimum kernel support along a meridian at a distance, km.
    #[inline(always)]
    pub(crate) fn min_reach(&self, distance: f32) -> f32 {
        MIN_REACH_CELLS * self.bin_width(distance)
    }

    /// Distance over which prefiltered tables spread the light of a bin along its meridian, km.
    #[inline(always)]
    pub(crate) fn smoothing_km(&self, distance: f32) -> f32 {
        if distance < self.near_limit_km as f32 { SMOOTHING_BINS * self.width as f32 } else { 0.0 }
    }

    /// Center and width of a bin, km.
    pub(crate) fn distance(&self, bin: usize) -> [f64; 2] {
        let coordinate = bin as f64 + 0.5;
        if coordinate < self.near {
            return [coordinate * self.width, self.width];
        }
        let distance = self.near_limit_km * math::exp((coordinate - self.near) * self.relative_width);
        [distance, self.relative_width * distance]
    }
}

/// Bins of one block, column by column.
#[derive(Default)]
pub(crate) struct BlockBins {
    bins: Vec<Bin>,
    /// First non-empty bin of each column, and one past the last.
    filled: [[usize; 2]; BLOCK_COLUMNS],
}

impl BlockBins {
    /// The non-empty bins of a column: index of the first, and the bins.
    pub(crate) fn column(&self, column: usize, bins: &DistanceBins) -> (usize, &[Bin]) {
        let [first, end] = self.filled[column];
        (first, &self.bins[column * bins.count..][first..end.max(first)])
    }
}

impl<'a> SortedSources<'a> {
    /// Sorts sources with at least the standard deviation `spread_km` into blocks of `block_columns` chart columns.
    /// Sources outside the visible rows are skipped.
    pub(crate) fn new(
        sources: &'a [FieldLineSource],
        chart: &Chart,
        block_columns: usize,
        field: &FieldLines,
        spread_km: f64,
    ) -> Self {
        let (projection, level) = (chart.projection(), bansho_base::math::simd::level());
        let bins = DistanceBins::new(spread_km, chart.row_step, field);
        let shown = VisibleRowTest::new(chart, field);
        let tasks = sources.par_chunks(TASK).enumerate();
        let chunks = tasks
            .map(|(task, sources)| {
                let mut spans = vec![ColumnSpan::default(); sources.len()];
                dispatch!(level, _simd => find_column_spans(sources, chart, &projection, &shown, &bins, &mut spans));
                SortedChunk::new(&spans, task * TASK, chart, block_columns)
            })
            .collect();
        Self { sources, chunks, bins }
    }

    /// Bins of distance.
    pub(crate) fn bins(&self) -> &DistanceBins {
        &self.bins
    }

    /// Sources of a block, in their original order, chunk by chunk.
    pub(crate) fn entries(&self, block: usize) -> impl Iterator<Item = &[BlockEntry]> {
        self.chunks
            .iter()
            .map(move |chunk| &chunk.entries[chunk.starts[block] as usize..chunk.starts[block + 1] as usize])
    }

    /// Number of sources of a block.
    pub(crate) fn count(&self, block: usize) -> usize {
        self.entries(block).map(<[BlockEntry]>::len).sum()
    }

    /// A source by its index.
    #[inline(always)]
    pub(crate) fn source(&self, index: u32) -> &FieldLineSource {
        &self.sources[index as usize]
    }

    /// Accumulates the sources of a block whose columns have these cosines and sines.
    #[inline(always)]
    pub(crate) fn accumulate<S: Simd>(
        &self,
        simd: S,
        block: usize,
        chart: &Chart,
        units: &[[f32; BLOCK_COLUMNS]; 2],
        sums: &mut BlockBins,
    ) {
        sums.bins.clear();
        // Column by column: a source adds to a run of bins in each of few columns, and the integration reads one column after the other.
        sums.bins.resize(BLOCK_COLUMNS * self.bins.count, [0.0; 4]);
        sums.filled = [[usize::MAX, 0]; BLOCK_COLUMNS];
        // One thread, in the order of the sources: the counting sort is stable and chunks come in order, so the sum has the same bits with any number
        // of threads.
        for entries in self.entries(block) {
            for entry in entries {
                let source = self.source(entry.source);
                let patch = PatchWeights::new(source, chart, units);
                let span = patch.bins(source, &self.bins);
                let [green, red, prompt] = source.power;
                let weights =
                    FourLanes::simd_from(simd, [green, red, prompt, (green + red + prompt) * source.energy_node]);
                for column in entry.columns() {
                    span.add(column, weights * patch.column_weights[column], &self.bins, sums);
                }
            }
        }
        for filled in &mut sums.filled {
            filled[0] = filled[0].min(filled[1]);
        }
    }
}

impl SortedChunk {
    /// Counting sort of sources, the first of which has index `first`, into blocks of `width` columns.
    fn new(spans: &[ColumnSpan], first: usize, chart: &Chart, width: usize) -> Self {
        let blocks = chart.columns.div_ceil(width);
        // Spans are walked twice, to count and to place, which is cheaper than a growing list for each block.
        let mut starts = vec![0_u32; blocks + 1];
        for span in spans {
            for_each_block(*span, chart, width, |block, _| starts[block + 1] += 1);
        }
        for block in 0..blocks {
            starts[block + 1] += starts[block];
        }
        let mut next = starts.clone();
        let mut entries = vec![BlockEntry::default(); starts[blocks] as usize];
        for (span, source) in spans.iter().zip(first..) {
            for_each_block(*span, chart, width, |block, columns| {
                entries[next[block] as usize] = BlockEntry { source: source as u32, columns };
                next[block] += 1;
            });
        }
        Self { starts, entries }
    }
}

/// Finds the chart columns within the support of each source.
#[inline(always)]
fn find_column_spans(
    sources: &[FieldLineSource],
    chart: &Chart,
    projection: &ChartProjection,
    shown: &VisibleRowTest,
    bins: &DistanceBins,
    spans: &mut [ColumnSpan],
) {
    for (source, span) in sources.iter().zip(spans) {
        let distance = source.distance();
        let margin_km = 2.0 * source.reach.max(MIN_REACH_CELLS * chart.column_step as f32 * distance)
            + bins.min_reach(distance)
            + bins.smoothing_km(distance);
        if shown.may_contain(source.across, distance, margin_km) {
            *span = ColumnSpan::covering(source, chart, projection, bins.max_distance_km as f32);
        }
    }
}

impl ColumnSpan {
    #[inline(always)]
    fn covering(source: &FieldLineSource, chart: &Chart, projection: &ChartProjection, max_distance_km: f32) -> Self {
        let step = chart.column_step as f32;
        let [x, y] = source.across;
        let distance = x.fma(x, y * y).sqrt();
        let reach = source.reach.max(MIN_REACH_CELLS * step * distance);
        if source.power == [0.0; 3] || distance > max_distance_km {
            return Self::default();
        }
        // A margin for rounding: the root below must not be taken of a negative number.
        if reach * 1.001 >= distance {
            // It includes the observer's own field line and can be seen at any longitude.
            return Self { first: 0, count: chart.columns as i32 };
        }
        let sine = reach / distance;
        // The arcsine of reach / distance.
        let half = approximations::atan2(sine, (1.0 - sine * sine).sqrt()) / step;
        let column = projection.column(approximations::atan2(y, x));
        let (first, end) = ((column - half - 0.5).ceil(), (column + half - 0.5).floor() + 1.0);
        Self { first: first as i32, count: ((end - first) as i32).min(chart.columns as i32) }
    }
}

/// Calls `each` with every block that a span overlaps, and its columns there.
#[inline]
fn for_each_block(span: ColumnSpan, chart: &Chart, width: usize, mut each: impl FnMut(usize, [u16; 2])) {
    let columns = chart.columns as i32;
    // A span across the seam of a full-circle chart also appears on the other side.
    let turns = if chart.wraps { &[0, columns, -columns][..] } else { &[0] };
    for turn in turns {
        let mut first = (span.first + turn).max(0) as usize;
        let end = (span.first + turn + span.count).clamp(0, columns) as usize;
        while first < end {
            let block = first / width;
            let from = first % width;
            let to = width.min(from + end - first);
            each(block, [from as u16, to as u16]);
            first += to - from;
        }
    }
}

/// Kernel weights of a source in the columns of a block.
pub(crate) struct PatchWeights {
    /// Weight per km of width.
    pub(crate) column_weights: [f32; BLOCK_COLUMNS],
    /// Distance along the meridian, km.
    pub(super) distances_km: [f32; BLOCK_COLUMNS],
}

impl PatchWeights {
    #[inline(always)]
    pub(crate) fn new(source: &FieldLineSource, chart: &Chart, [cosines, sines]: &[[f32; BLOCK_COLUMNS]; 2]) -> Self {
        let [x, y] = source.across;
        let per_reach = 1.0 / source.reach.max(MIN_REACH_CELLS * chart.column_step as f32 * source.distance());
        let (mut side, mut along) = ([0.0; BLOCK_COLUMNS], [0.0; BLOCK_COLUMNS]);
        for column in 0..BLOCK_COLUMNS {
            let offset = y.fma(cosines[column], -(x * sines[column])) * per_reach;
            // The kernel and its first derivative vanish at the edge, so that light does not jump when a moving source reaches another column.
            let shape = offset.fma(-offset, 1.0).max(0.0);
            side[column] = shape * shape * (NORM * per_reach);
            along[column] = x.fma(cosines[column], y * sines[column]);
        }
        Self { column_weights: side, distances_km: along }
    }

    /// Bins within its support along each column.
    #[inline(always)]
    fn bins(&self, source: &FieldLineSource, bins: &DistanceBins) -> PatchBins {
        let (mut middles, mut reaches) = ([0.0; BLOCK_COLUMNS], [0.0; BLOCK_COLUMNS]);
        for column in 0..BLOCK_COLUMNS {
            let along = self.distances_km[column];
            middles[column] = bins.coordinate(along);
            let reach = source.reach / bins.bin_width(along);
            reaches[column] = if reach > MIN_REACH_CELLS { reach } else { MIN_REACH_CELLS };
        }
        PatchBins { middles, reaches }
    }
}

/// Center and half-width of a patch along each column of a block, in bins.
struct PatchBins {
    middles: [f32; BLOCK_COLUMNS],
    reaches: [f32; BLOCK_COLUMNS],
}

impl PatchBins {
    #[inline(always)]
    fn add<S: Simd>(&self, column: usize, weights: FourLanes<S>, bins: &DistanceBins, sums: &mut BlockBins) {
        let (middle, reach) = (self.middles[column], self.reaches[column]);
        let first = (middle - reach - 0.5).ceil().max(0.0) as usize;
        let end = ((middle + reach - 0.5).floor() + 1.0).clamp(0.0, bins.count as f32) as usize;
        if first >= end {
            return;
        }
        let per_reach = 1.0 / reach;
        let weights = weights * (NORM * per_reach);
        let filled = &mut sums.filled[column];
        *filled = [filled[0].min(first), filled[1].max(end)];
        let mut offset = (first as f32 + 0.5 - middle) * per_reach;
        for bin in &mut sums.bins[column * bins.count..][first..end] {
            let shape = offset.fma(-offset, 1.0);
            *bin = weights.broadcast(shape * shape).fma(weights, FourLanes::simd_from(weights.simd, *bin)).into();
            offset += per_reach;
        }
    }
}
