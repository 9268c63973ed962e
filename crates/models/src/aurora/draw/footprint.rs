//! Where the precipitation comes down, by longitude and distance from the observer's own field line.
//!
//! Every source is a small patch with a smooth edge, `(1 - r^2)^2` in each direction: broad enough for the chart's cells, so that none
//! is ever seen alone. Sources are sorted into strips of columns, so that no two threads share a sum and every sum has one order.

use std::ops::Range;

use bansho_base::math::{self, lanes};
use fearless_simd::{Level, Simd, dispatch, prelude::*};
use rayon::prelude::*;

use super::chart::{Chart, Finder, STRIP};
use crate::lanes::{FourLanes, Real};

/// Sources that a task of the thread pool sorts.
const TASK: usize = 4096;
/// Altitude of the light whose rows are told apart, km: that of lower edges.
const SCALE_KM: f64 = 100.0;
/// Bins within the reach of a patch, where so many take up 1 to [`MOST_ROWS`] rows of the chart each.
const BINS_PER_REACH: f64 = 2.5;
const MOST_ROWS: f64 = 2.5;
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

impl Source {
    /// Distance from the observer's own field line, km.
    #[inline(always)]
    pub(super) fn distance(&self) -> f32 {
        let [x, y] = self.across;
        x.mul_add(x, y * y).sqrt()
    }
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
    entries: Vec<Entry>,
    bins: Bins,
}

/// A source that shows in a strip.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Entry {
    /// Number of the source.
    pub(super) source: u32,
    /// The first column of the strip that it may reach, and the one after the last.
    columns: [u16; 2],
}

impl Entry {
    /// The columns of the strip that it may reach.
    #[inline(always)]
    pub(super) fn columns(&self) -> Range<usize> {
        self.columns[0] as usize..self.columns[1] as usize
    }
}

/// Columns that a source reaches: the first, which may lie before or behind the chart, and how many.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Span {
    first: i32,
    count: i32,
}

/// Bins of distance: of one width as far as patches need it, even in the angle at which they are seen at [`SCALE_KM`] above from there on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bins {
    /// Width of near bins, km, and its inverse.
    width: f64,
    per_width: f64,
    /// How far they go, km, at what angle that is, and how many there are to there.
    near_to: f64,
    near_angle: f64,
    near: f64,
    /// Angle of a far bin, radians, and its inverse.
    step: f64,
    per_step: f64,
    /// How many there are.
    pub(super) count: usize,
}

impl Bins {
    /// Bins for patches of a standard deviation in km or more, on a chart with rows of `step` radians.
    pub(super) fn new(spread_km: f64, step: f64) -> Self {
        let row = step * SCALE_KM;
        let width = (spread_km * f64::from(REACH) / BINS_PER_REACH).clamp(row, MOST_ROWS * row);
        // From there on even angles are wider.
        let near_to = (SCALE_KM * math::sqrt(width / row - 1.0)).min(FARTHEST_KM);
        let (near, near_angle) = (near_to / width, math::atan(near_to / SCALE_KM));
        let far = math::atan(FARTHEST_KM / SCALE_KM) - near_angle;
        let count = (near + far / step).ceil();
        let step = far.max(1e-9) / (count - near).max(1e-9);
        let (per_width, per_step) = (1.0 / width, 1.0 / step);
        Self { width, per_width, near_to, near_angle, near, step, per_step, count: count as usize }
    }

    /// Width of a bin at a distance, km.
    #[inline(always)]
    fn width(&self, distance: f32) -> f32 {
        const SCALE: f32 = SCALE_KM as f32;
        (self.step as f32 * distance.mul_add(distance / SCALE, SCALE)).max(self.width as f32)
    }

    /// Place of a distance among the bins; 0 is the nearer edge of the first.
    #[inline(always)]
    fn place(&self, distance: f32) -> f32 {
        const PER_SCALE: f32 = (1.0 / SCALE_KM) as f32;
        let beyond = lanes::atan2(distance * PER_SCALE, 1.0) - self.near_angle as f32;
        let far = beyond.mul_add(self.per_step as f32, self.near as f32);
        if distance < self.near_to as f32 { distance * self.per_width as f32 } else { far }
    }

    /// Least reach of a patch along a meridian at a distance, km.
    #[inline(always)]
    pub(super) fn least_reach(&self, distance: f32) -> f32 {
        LEAST_CELLS * self.width(distance)
    }

    /// Distance of a bin's middle, and its width, km.
    pub(super) fn distance(&self, bin: usize) -> [f64; 2] {
        let place = bin as f64 + 0.5;
        if place < self.near {
            return [place * self.width, self.width];
        }
        let (sin, cos) = math::sin_cos((place - self.near).mul_add(self.step, self.near_angle));
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
    /// Sorts sources, of this standard deviation in km or more, by the strips of a chart.
    pub(super) fn new(sources: &'a [Source], chart: &Chart, spread_km: f64) -> Self {
        let finder = chart.finder();
        let level = Level::new();
        let mut spans = vec![Span::default(); sources.len()];
        spans.par_chunks_mut(TASK).zip(sources.par_chunks(TASK)).for_each(|(spans, sources)| {
            dispatch!(level, _simd => find_spans(sources, chart, &finder, spans));
        });
        let strips = chart.columns / STRIP;
        let mut starts = vec![0_u32; strips + 1];
        for span in &spans {
            pieces(*span, chart, |strip, _| starts[strip + 1] += 1);
        }
        for strip in 0..strips {
            starts[strip + 1] += starts[strip];
        }
        let mut next = starts.clone();
        let mut entries = vec![Entry::default(); starts[strips] as usize];
        for (source, span) in spans.iter().enumerate() {
            pieces(*span, chart, |strip, columns| {
                entries[next[strip] as usize] = Entry { source: source as u32, columns };
                next[strip] += 1;
            });
        }
        Self { sources, starts, entries, bins: Bins::new(spread_km, chart.row_step) }
    }

    /// Bins of distance.
    pub(super) fn bins(&self) -> &Bins {
        &self.bins
    }

    /// What shows in a strip.
    #[inline(always)]
    pub(super) fn entries(&self, strip: usize) -> &[Entry] {
        &self.entries[self.starts[strip] as usize..self.starts[strip + 1] as usize]
    }

    /// A source by its number.
    #[inline(always)]
    pub(super) fn source(&self, number: u32) -> &Source {
        &self.sources[number as usize]
    }

    /// Adds up the sources of a strip whose columns have these cosines and sines.
    #[inline(always)]
    pub(super) fn sum<S: Simd>(
        &self,
        simd: S,
        strip: usize,
        chart: &Chart,
        units: &[[f32; STRIP]; 2],
        sums: &mut StripSums,
    ) {
        sums.bins.clear();
        sums.bins.resize(STRIP * self.bins.count, [0.0; 4]);
        sums.filled = [[usize::MAX, 0]; STRIP];
        for entry in self.entries(strip) {
            let source = self.source(entry.source);
            let patch = Patch::new(source, chart, units);
            let span = patch.bins(source, &self.bins);
            let [green, red, prompt] = source.power;
            let weights = FourLanes::simd_from(simd, [green, red, prompt, (green + red + prompt) * source.node]);
            for column in entry.columns() {
                span.add(column, weights * patch.side[column], &self.bins, sums);
            }
        }
        for filled in &mut sums.filled {
            filled[0] = filled[0].min(filled[1]);
        }
    }
}

/// The columns that every source reaches.
#[inline(always)]
fn find_spans(sources: &[Source], chart: &Chart, finder: &Finder, spans: &mut [Span]) {
    for (source, span) in sources.iter().zip(spans) {
        *span = Span::of(source, chart, finder);
    }
}

impl Span {
    #[inline(always)]
    fn of(source: &Source, chart: &Chart, finder: &Finder) -> Self {
        let step = chart.column_step as f32;
        let [x, y] = source.across;
        let distance = x.mul_add(x, y * y).sqrt();
        let reach = source.reach.max(LEAST_CELLS * step * distance);
        if source.power == [0.0; 3] || distance > FARTHEST_KM as f32 {
            return Self::default();
        }
        if reach * 1.001 >= distance {
            // It lies about the observer's own field line and may show anywhere.
            return Self { first: 0, count: chart.columns as i32 };
        }
        let share = reach / distance;
        let half = lanes::atan2(share, (1.0 - share * share).sqrt()) / step;
        let column = finder.column(lanes::atan2(y, x));
        let (first, end) = ((column - half - 0.5).ceil(), (column + half - 0.5).floor() + 1.0);
        Self { first: first as i32, count: ((end - first) as i32).min(chart.columns as i32) }
    }
}

/// Calls `each` with every strip that a span touches and the columns there.
#[inline]
fn pieces(span: Span, chart: &Chart, mut each: impl FnMut(usize, [u16; 2])) {
    let columns = chart.columns as i32;
    // A span that passes the seam of a whole chart shows on its other side too.
    let turns = if chart.whole { &[0, columns, -columns][..] } else { &[0] };
    for turn in turns {
        let mut first = (span.first + turn).max(0) as usize;
        let end = (span.first + turn + span.count).clamp(0, columns) as usize;
        while first < end {
            let strip = first / STRIP;
            let from = first % STRIP;
            let to = STRIP.min(from + end - first);
            each(strip, [from as u16, to as u16]);
            first += to - from;
        }
    }
}

/// A source as the columns of a strip see it.
pub(super) struct Patch {
    /// Share of it per km of width.
    pub(super) side: [f32; STRIP],
    /// How far out it lies, km.
    pub(super) along: [f32; STRIP],
}

impl Patch {
    #[inline(always)]
    pub(super) fn new(source: &Source, chart: &Chart, [cosines, sines]: &[[f32; STRIP]; 2]) -> Self {
        let [x, y] = source.across;
        let per_reach = 1.0 / source.reach.max(LEAST_CELLS * chart.column_step as f32 * source.distance());
        let (mut side, mut along) = ([0.0; STRIP], [0.0; STRIP]);
        for column in 0..STRIP {
            let away = y.mul_add(cosines[column], -(x * sines[column])) * per_reach;
            let shape = away.mul_add(-away, 1.0).max(0.0);
            side[column] = shape * shape * (NORM * per_reach);
            along[column] = x.mul_add(cosines[column], y * sines[column]);
        }
        Self { side, along }
    }

    /// The bins that it covers along the columns.
    #[inline(always)]
    fn bins(&self, source: &Source, bins: &Bins) -> BinSpans {
        let (mut middles, mut reaches) = ([0.0; STRIP], [0.0; STRIP]);
        for column in 0..STRIP {
            let along = self.along[column];
            middles[column] = bins.place(along);
            let reach = source.reach / bins.width(along);
            reaches[column] = if reach > LEAST_CELLS { reach } else { LEAST_CELLS };
        }
        BinSpans { middles, reaches }
    }
}

/// Where along each column of a strip a patch lies, and how far it reaches, in bins.
struct BinSpans {
    middles: [f32; STRIP],
    reaches: [f32; STRIP],
}

impl BinSpans {
    #[inline(always)]
    fn add<S: Simd>(&self, column: usize, weights: FourLanes<S>, bins: &Bins, sums: &mut StripSums) {
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
        let mut away = (first as f32 + 0.5 - middle) * per_reach;
        for bin in &mut sums.bins[column * bins.count..][first..end] {
            let shape = away.mul_add(-away, 1.0);
            *bin = weights.like(shape * shape).fused(weights, FourLanes::simd_from(weights.simd, *bin)).into();
            away += per_reach;
        }
    }
}
