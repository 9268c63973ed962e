//! Where the precipitation comes down, by longitude and distance from the observer's own field line.
//!
//! Every source is a small patch with a smooth edge, `(1 - r^2)^2` in each direction: broad enough for the chart's cells, so that none
//! is ever seen alone. Sources are sorted into strips of columns, so that no two threads share a sum and every sum has one order.

use std::ops::Range;

use bansho_base::math::{self, lanes};
use rayon::prelude::*;

use super::chart::{Chart, STRIP};

/// Scale of the distances, km: bins are as narrow as a row of the chart at 100 km altitude.
const SCALE_KM: f64 = 100.0;
/// Distances beyond this lie behind the horizon, km.
const FARTHEST_KM: f64 = 3000.0;
/// Least reach of a patch in cells, so that its sum does not depend on where between the cells it lies.
const LEAST_CELLS: f32 = 1.6;
/// `(1 - r^2)^2` has this integral over (-1, 1), inverted.
const NORM: f32 = 15.0 / 16.0;

/// Precipitation about one field line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Source {
    /// The line's place across the field, km.
    pub(super) across: [f32; 2],
    /// How far the patch reaches, km: its standard deviation times [`REACH`].
    pub(super) reach: f32,
    /// Place of the electrons' energy among the nodes of the grid of energies.
    pub(super) node: f32,
    /// Power times the cosine to the vertical, 1000 W: for green, red and prompt light.
    pub(super) power: [f32; 3],
}

/// Reach of a patch for a standard deviation of 1.
pub(super) const REACH: f32 = 2.645_751_3;

/// What the bins of a footprint hold: power for green, red and prompt light in 1000 W per km of width, and the sum of all times the
/// node of their energy.
pub(super) type Bin = [f32; 4];

/// The sources of a picture, sorted by strips of the chart.
pub(super) struct Footprint<'a> {
    sources: &'a [Source],
    /// Index of the first entry of every strip, and of the end.
    starts: Vec<u32>,
    entries: Vec<u32>,
    spans: Vec<Span>,
    bins: Bins,
}

/// Columns that a source reaches: the first, which may lie before or behind the chart, and how many.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Span {
    first: i32,
    count: i32,
}

/// Bins of distance: even in the angle at which they are seen at [`SCALE_KM`] above.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bins {
    step: f64,
    /// How many there are.
    pub(super) count: usize,
}

impl Bins {
    /// Bins of at most `step` radians.
    pub(super) fn new(step: f64) -> Self {
        let farthest = math::atan(FARTHEST_KM / SCALE_KM);
        let count = (farthest / step).ceil().max(1.0);
        Self { step: farthest / count, count: count as usize }
    }

    /// Least reach of a patch along a meridian at a distance, km.
    #[inline(always)]
    pub(super) fn least_reach(&self, distance: f32) -> f32 {
        const SCALE: f32 = SCALE_KM as f32;
        LEAST_CELLS * self.step as f32 * distance.mul_add(distance / SCALE, SCALE)
    }

    /// Distance of a bin's middle, and its width, km.
    pub(super) fn distance(&self, bin: usize) -> [f64; 2] {
        let (sin, cos) = math::sin_cos((bin as f64 + 0.5) * self.step);
        [SCALE_KM * sin / cos, SCALE_KM * self.step / (cos * cos)]
    }
}

/// One strip's sums: bins of one column after those of another.
#[derive(Default)]
pub(super) struct StripSums {
    bins: Vec<Bin>,
    /// First and last filled bin of each column, and one past it.
    filled: [[usize; 2]; STRIP],
}

impl StripSums {
    /// The filled stretch of a column: number of its first bin, and the bins.
    pub(super) fn column(&self, column: usize, bins: &Bins) -> (usize, &[Bin]) {
        let [first, end] = self.filled[column];
        (first, &self.bins[column * bins.count..][first..end.max(first)])
    }
}

impl<'a> Footprint<'a> {
    /// Sorts sources by the strips of a chart; distances are in bins of `step` radians.
    pub(super) fn new(sources: &'a [Source], chart: &Chart, step: f64) -> Self {
        let finder = chart.finder();
        let level = fearless_simd::Level::new();
        let spans: Vec<Span> = sources
            .par_chunks(4096)
            .flat_map_iter(|part| fearless_simd::dispatch!(level, _simd => spans(part, chart, &finder)))
            .collect();
        let strips = chart.columns / STRIP;
        let mut starts = vec![0_u32; strips + 1];
        for span in &spans {
            strips_of(*span, chart, |strip| starts[strip + 1] += 1);
        }
        for strip in 0..strips {
            starts[strip + 1] += starts[strip];
        }
        let mut next = starts.clone();
        let mut entries = vec![0; starts[strips] as usize];
        for (index, span) in spans.iter().enumerate() {
            strips_of(*span, chart, |strip| {
                entries[next[strip] as usize] = index as u32;
                next[strip] += 1;
            });
        }
        Self { sources, starts, entries, spans, bins: Bins::new(step) }
    }

    /// Bins of distance.
    pub(super) fn bins(&self) -> &Bins {
        &self.bins
    }

    /// Calls `each` with the index of every source that a strip shows, the source, and the columns of the strip that it reaches.
    #[inline(always)]
    pub(super) fn for_each(&self, strip: usize, chart: &Chart, mut each: impl FnMut(u32, &Source, Range<usize>)) {
        // A span that passes the seam of a whole chart shows on its other side too.
        let (turn, shifts) = if chart.whole { (chart.columns as i32, &[0, -1, 1][..]) } else { (0, &[0][..]) };
        for entry in &self.entries[self.starts[strip] as usize..self.starts[strip + 1] as usize] {
            let span = self.spans[*entry as usize];
            for shift in shifts {
                let first = span.first + shift * turn - (strip * STRIP) as i32;
                let columns = first.max(0)..(first + span.count).min(STRIP as i32);
                if !columns.is_empty() {
                    let columns = columns.start as usize..columns.end as usize;
                    each(*entry, &self.sources[*entry as usize], columns);
                }
            }
        }
    }

    /// Adds up the sources of a strip whose columns have these cosines and sines.
    #[inline(always)]
    pub(super) fn sum(&self, strip: usize, chart: &Chart, units: &[[f32; 2]; STRIP], sums: &mut StripSums) {
        sums.bins.clear();
        sums.bins.resize(STRIP * self.bins.count, [0.0; 4]);
        sums.filled = [[usize::MAX, 0]; STRIP];
        self.for_each(strip, chart, |_, source, columns| {
            let patch = Patch::new(source, chart, &self.bins);
            for column in columns {
                patch.add(column, units[column], &self.bins, sums);
            }
        });
        for filled in &mut sums.filled {
            filled[0] = filled[0].min(filled[1]);
        }
    }
}

#[inline(always)]
fn spans(sources: &[Source], chart: &Chart, finder: &super::chart::Finder) -> Vec<Span> {
    let step = chart.column_step as f32;
    let span = |source: &Source| {
        let [x, y] = source.across;
        let distance = x.mul_add(x, y * y).sqrt();
        let reach = source.reach.max(LEAST_CELLS * step * distance);
        if source.power == [0.0; 3] || distance > FARTHEST_KM as f32 {
            return Span::default();
        }
        if reach * 1.001 >= distance {
            // It lies about the observer's own field line and may show anywhere.
            return Span { first: 0, count: chart.columns as i32 };
        }
        let share = reach / distance;
        let half = lanes::atan2(share, (1.0 - share * share).sqrt()) / step;
        let column = finder.column(lanes::atan2(y, x));
        let (first, end) = ((column - half - 0.5).ceil(), (column + half - 0.5).floor() + 1.0);
        let count = (end - first) as i32;
        if chart.whole {
            Span { first: first as i32, count: count.min(chart.columns as i32) }
        } else {
            let first = (first as i32).max(0);
            Span { first, count: (end.min(chart.columns as f32) as i32 - first).max(0) }
        }
    };
    sources.iter().map(span).collect()
}

/// Calls `each` once for every strip that a span touches.
fn strips_of(span: Span, chart: &Chart, mut each: impl FnMut(usize)) {
    if span.count <= 0 {
        return;
    }
    let strips = (chart.columns / STRIP) as i32;
    let first = span.first.div_euclid(STRIP as i32);
    let last = (span.first + span.count - 1).div_euclid(STRIP as i32).min(first + strips - 1);
    for strip in first..=last {
        each(strip.rem_euclid(strips) as usize);
    }
}

/// A source, made ready to be added to columns.
pub(super) struct Patch {
    across: [f32; 2],
    weights: Bin,
    /// Inverse reach to the side, 1/km.
    per_reach: f32,
    reach: f32,
    per_step: f32,
}

impl Patch {
    #[inline(always)]
    pub(super) fn new(source: &Source, chart: &Chart, bins: &Bins) -> Self {
        let [x, y] = source.across;
        let distance = x.mul_add(x, y * y).sqrt();
        let per_reach = 1.0 / source.reach.max(LEAST_CELLS * chart.column_step as f32 * distance);
        let [green, red, prompt] = source.power;
        let all = (green + red + prompt) * source.node;
        Self {
            across: source.across,
            weights: [green, red, prompt, all],
            per_reach,
            reach: source.reach,
            per_step: (1.0 / bins.step) as f32,
        }
    }

    /// Distance from the observer's own field line, km.
    #[inline(always)]
    pub(super) fn distance(&self) -> f32 {
        let [x, y] = self.across;
        x.mul_add(x, y * y).sqrt()
    }

    /// Share of it per km of width at a column, from the column's cosine and sine.
    #[inline(always)]
    pub(super) fn side(&self, [cos, sin]: [f32; 2]) -> f32 {
        let [x, y] = self.across;
        let side = y.mul_add(cos, -(x * sin)) * self.per_reach;
        let shape = side.mul_add(-side, 1.0).max(0.0);
        shape * shape * NORM * self.per_reach
    }

    /// How far out it lies along a column, km.
    #[inline(always)]
    pub(super) fn along(&self, [cos, sin]: [f32; 2]) -> f32 {
        self.across[0].mul_add(cos, self.across[1] * sin)
    }

    #[inline(always)]
    fn add(&self, column: usize, unit: [f32; 2], bins: &Bins, sums: &mut StripSums) {
        const PER_SCALE: f32 = (1.0 / SCALE_KM) as f32;
        let side = self.side(unit);
        if side <= 0.0 {
            return;
        }
        // Along the column in bins, and its reach there.
        let along = self.along(unit) * PER_SCALE;
        let middle = lanes::atan2(along, 1.0) * self.per_step;
        let reach = (self.reach * PER_SCALE / along.mul_add(along, 1.0) * self.per_step).max(LEAST_CELLS);
        let first = (middle - reach - 0.5).ceil().max(0.0) as usize;
        let end = ((middle + reach - 0.5).floor() + 1.0).clamp(0.0, bins.count as f32) as usize;
        if first >= end {
            return;
        }
        let per_reach = 1.0 / reach;
        let weight = side * NORM * per_reach;
        let weights = self.weights.map(|value| value * weight);
        let filled = &mut sums.filled[column];
        *filled = [filled[0].min(first), filled[1].max(end)];
        let target = &mut sums.bins[column * bins.count..][first..end];
        for (number, bin) in target.iter_mut().enumerate() {
            let away = ((first + number) as f32 + 0.5 - middle) * per_reach;
            let shape = away.mul_add(-away, 1.0);
            let shape = shape * shape;
            for i in 0..4 {
                bin[i] = weights[i].mul_add(shape, bin[i]);
            }
        }
    }
}
