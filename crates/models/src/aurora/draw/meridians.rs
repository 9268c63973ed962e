//! The picture of an aurora on its chart: along every meridian, the light of all field lines that are seen there.
//!
//! On a line of sight at colatitude a, the field line at distance r from the observer's own is passed at the place r cot a along the
//! field. So brightness is the integral over r of precipitation times the volume emission at the altitude of that place, over sin a.

use std::ops::Range;

use bansho_base::math::lanes;
use fearless_simd::{Level, Simd, dispatch, prelude::*};
use rayon::prelude::*;

use super::{
    chart::{Chart, Finder, STRIP},
    footprint::{Bin, Bins, Footprint, StripSums},
    geometry::{FieldLine, FieldLines, Meridian, altitude},
    profile::{BOTTOM_KM, Profile, Profiles, SPACINGS},
};
use crate::{
    aurora::light::PerEmitter,
    lanes::{FourLanes, Real},
};

/// Rows that are worked on at once.
const ROWS: usize = 16;
/// Steps of altitude from bin to bin above which smoothed tables are taken, km: near the magnetic zenith a line of sight runs along the field.
const STEP_KM: f32 = 1.5;

/// Nearer than so many widths of a bin, smoothed tables may be taken: 800 km / [`STEP_KM`].
const NEAR_BINS: f64 = 533.0;
/// Spacing of such tables in steps: at least 1 / [`STEP_KM`]. Steps as long as the light is high need 2, or linear interpolation lets the bins'
/// own pattern through; shorter ones need less, since the light itself is smooth, and keep its lower edge.
const ENTRY_PER_STEP: [f32; 2] = [1.0 / STEP_KM, 2.0];
/// Steps above which tables are more than a step apart, km.
const SMOOTH_KM: f32 = 12.0;
/// Widths of a bin that smoothing spreads light over at most: it reaches two entries far, each less than twice as wide as asked for.
const BLURRED_BINS: f64 = 4.0 * ENTRY_PER_STEP[1] as f64;

/// Brightness by emitter in kR, column after column, without what the air takes away.
pub(super) struct Meridians {
    pub(super) chart: Chart,
    pub(super) light: Vec<PerEmitter<f32>>,
    /// First row of each column that may hold light, and the one after the last.
    pub(super) lit: Vec<[u32; 2]>,
}

/// What all columns share.
struct Drawing<'a> {
    chart: &'a Chart,
    field: &'a FieldLines,
    profiles: &'a Profiles,
    bins: &'a Bins,
    /// Distance and width of every bin, km.
    distances: &'a [[f64; 2]],
    /// By row, and [`ROWS`] more.
    cotangents: &'a [f32],
    inverse_sines: &'a [f32],
}

impl Meridians {
    /// Draws the footprint's sources.
    pub(super) fn new(chart: Chart, field: &FieldLines, profiles: &Profiles, footprint: &Footprint) -> Self {
        let level = Level::new();
        let [mut cotangents, inverse_sines] = chart.row_tables();
        cotangents.resize(chart.rows + ROWS, 0.0);
        let distances: Vec<_> = (0..footprint.bins().count).map(|bin| footprint.bins().distance(bin)).collect();
        let mut picture = Self::dark(chart);
        let (chart, strips) = picture.strips();
        let drawing = Drawing {
            chart,
            field,
            profiles,
            bins: footprint.bins(),
            distances: &distances,
            cotangents: &cotangents,
            inverse_sines: &inverse_sines,
        };
        strips.for_each_init(StripSums::default, |sums, strip| {
            dispatch!(level, simd => drawing.strip(simd, strip, footprint, sums));
        });
        picture
    }

    /// A picture without light.
    pub(super) fn dark(chart: Chart) -> Self {
        Self { light: vec![[0.0; 4]; chart.columns * chart.rows], lit: vec![[u32::MAX, 0]; chart.columns], chart }
    }

    /// Its strips, each to be drawn by one thread.
    pub(super) fn strips(&mut self) -> (&Chart, impl IndexedParallelIterator<Item = LightStrip<'_>>) {
        let light = self.light.par_chunks_mut(STRIP * self.chart.rows);
        let strips = light.zip(self.lit.par_chunks_mut(STRIP)).enumerate();
        (&self.chart, strips.map(|(number, (light, lit))| LightStrip { number, light, lit }))
    }

    /// The picture with how to find places on it.
    pub(super) fn sampler(&self) -> Sampler<'_> {
        Sampler { meridians: self, finder: self.chart.finder() }
    }
}

/// [`STRIP`] columns of a picture.
pub(super) struct LightStrip<'a> {
    pub(super) number: usize,
    pub(super) light: &'a mut [PerEmitter<f32>],
    pub(super) lit: &'a mut [[u32; 2]],
}

impl LightStrip<'_> {
    /// One of its columns, of which these rows are lit.
    #[inline(always)]
    pub(super) fn light_up(&mut self, column: usize, rows: &Range<usize>, of: usize) -> &mut [PerEmitter<f32>] {
        let lit = &mut self.lit[column];
        *lit = [lit[0].min(rows.start as u32), lit[1].max(rows.end as u32)];
        &mut self.light[column * of..][..of]
    }
}

/// `low` and `high` mixed, `part` of the way from the one to the other.
#[inline(always)]
pub(super) fn mixed<S: Simd>(simd: S, low: &PerEmitter<f32>, high: &PerEmitter<f32>, part: f32) -> FourLanes<S> {
    let (low, high) = (FourLanes::simd_from(simd, *low), FourLanes::simd_from(simd, *high));
    low.like(part).fused(high - low, low)
}

/// A chart with how to find places on it.
pub(super) struct Sampler<'a> {
    meridians: &'a Meridians,
    finder: Finder,
}

impl Sampler<'_> {
    /// Adds the light at directions, linear between the cells of the chart.
    #[inline(always)]
    pub(super) fn add<S: Simd, const COUNT: usize>(
        &self,
        simd: S,
        longitude: &[f32; COUNT],
        colatitude: &[f32; COUNT],
        light: &mut [PerEmitter<f32>; COUNT],
    ) {
        let last = (self.meridians.chart.rows - 1) as f32;
        let (mut columns, mut rows) = ([0.0; COUNT], [0.0; COUNT]);
        for i in 0..COUNT {
            columns[i] = self.finder.column(longitude[i]) - 0.5;
            rows[i] = (self.finder.row(colatitude[i]) - 0.5).clamp(0.0, last);
        }
        for i in 0..COUNT {
            self.add_place(simd, columns[i], rows[i], &mut light[i]);
        }
    }

    /// The light at one direction.
    #[cfg(test)]
    pub(super) fn light(&self, longitude: f32, colatitude: f32) -> PerEmitter<f32> {
        let mut light = [[0.0; 4]];
        dispatch!(Level::new(), simd => self.add(simd, &[longitude], &[colatitude], &mut light));
        light[0]
    }

    #[inline(always)]
    fn add_place<S: Simd>(&self, simd: S, column: f32, row: f32, light: &mut PerEmitter<f32>) {
        let Meridians { chart, light: all, lit } = self.meridians;
        let left = column.floor();
        let (across, upper) = (column - left, row as usize);
        let part = row - upper as f32;
        let (left, right) = (self.held(left as i32), self.held(left as i32 + 1));
        let [first, end] = [lit[left][0].min(lit[right][0]), lit[left][1].max(lit[right][1])];
        if upper as u32 + 1 < first || upper as u32 >= end {
            return;
        }
        let lower = (upper + 1).min(chart.rows - 1);
        let (left, right) = (&all[left * chart.rows..][..chart.rows], &all[right * chart.rows..][..chart.rows]);
        let above = mixed(simd, &left[upper], &right[upper], across);
        let below = mixed(simd, &left[lower], &right[lower], across);
        *light = above.like(part).fused(below - above, above + FourLanes::simd_from(simd, *light)).into();
    }

    /// The column of the chart that stands for one less than a column beside it.
    #[inline(always)]
    fn held(&self, column: i32) -> usize {
        let chart = &self.meridians.chart;
        let columns = chart.columns as i32;
        let turned = match (chart.whole, column < 0, column >= columns) {
            (true, true, _) => column + columns,
            (true, _, true) => column - columns,
            _ => column,
        };
        turned.clamp(0, columns - 1) as usize
    }
}

impl Drawing<'_> {
    #[inline(always)]
    fn strip<S: Simd>(&self, simd: S, mut strip: LightStrip, footprint: &Footprint, sums: &mut StripSums) {
        footprint.sum(simd, strip.number, self.chart, &self.chart.single_units(strip.number), sums);
        for column in 0..STRIP {
            let meridian = self.field.meridian(self.chart.unit(strip.number * STRIP + column));
            let (first, bins) = sums.column(column, self.bins);
            for (number, bin) in bins.iter().enumerate() {
                self.bin(simd, &meridian, (first + number, bin), &mut strip, column);
            }
            let [first, end] = strip.lit[column].map(|row| row as usize);
            let lit = first.min(end)..end;
            let light = &mut strip.light[column * self.chart.rows..][lit.clone()];
            for (light, inverse) in light.iter_mut().zip(&self.inverse_sines[lit]) {
                for value in light {
                    *value *= inverse;
                }
            }
        }
    }

    /// The light of one bin on its meridian.
    #[inline(always)]
    fn bin<S: Simd>(
        &self,
        simd: S,
        meridian: &Meridian,
        (number, bin): (usize, &Bin),
        strip: &mut LightStrip,
        column: usize,
    ) {
        let [green, red, prompt, by_node] = *bin;
        let all = green + red + prompt;
        if all <= 1e-12 {
            return;
        }
        let profile = self.profiles.at(by_node / all, red > 0.0);
        let [distance, width] = self.distances[number];
        let line = meridian.line(distance);
        // Where tables are smoothed, light reaches rows of neighbouring bins.
        let blurred = if distance < NEAR_BINS * width { BLURRED_BINS * width } else { 0.0 };
        let top = self.row(&line, distance, -blurred, profile.top_km);
        let bottom = self.row(&line, distance, blurred, BOTTOM_KM);
        let end = ((bottom.floor() + 1.0).max(0.0) as usize).min(self.chart.rows);
        let rows = (top.ceil().max(0.0) as usize).min(end)..end;
        let light = &mut strip.light_up(column, &rows, self.chart.rows)[rows.clone()];
        // The bin holds precipitation times its width already; what is left is per km of sight.
        let weights = FourLanes::simd_from(simd, [green, red, prompt, prompt]);
        let width = width as f32;
        let stretch = Stretch { line: &line, profile: &profile, distance: distance as f32, width, weights };
        self.rows(&stretch, rows.start, light);
        if distance < blurred {
            // Beyond the observer's own field line the sheet goes on: what smoothing spreads from there would be missed.
            let line = meridian.line(-distance);
            let beyond = Stretch { line: &line, profile: &profile, distance: -distance as f32, width, weights };
            self.rows(&beyond, rows.start, light);
        }
    }

    /// The row in which a line of sight passes an altitude on the field line at a distance, moved down by what smoothing over bins of
    /// distance spreads: where the line of sight sinks along the field, nearer bins are those that show farther down.
    #[inline(always)]
    fn row(&self, line: &FieldLine, distance: f64, blurred: f64, altitude_km: f32) -> f32 {
        let place = line.place(f64::from(altitude_km));
        let distance = distance + if place < 0.0 { -blurred } else { blurred };
        let colatitude = lanes::atan2(distance.max(0.0) as f32, place as f32);
        self.chart.finder().row(colatitude) - 0.5
    }

    /// Adds the light of a stretch to rows from `first` on.
    #[inline(always)]
    fn rows<S: Simd>(&self, stretch: &Stretch<S>, first: usize, light: &mut [PerEmitter<f32>]) {
        let mut from = 0;
        while from < light.len() {
            let Some(cotangents) = self.cotangents[first + from..].first_chunk() else { return };
            let to = (from + ROWS).min(light.len());
            stretch.add(cotangents, &mut light[from..to]);
            from = to;
        }
    }
}

/// Some rows of one bin.
struct Stretch<'a, S: Simd> {
    line: &'a FieldLine,
    profile: &'a Profile<'a>,
    distance: f32,
    width: f32,
    weights: FourLanes<S>,
}

impl<S: Simd> Stretch<'_, S> {
    #[inline(always)]
    fn add(&self, cotangents: &[f32; ROWS], light: &mut [PerEmitter<f32>]) {
        let [constant, linear] = self.line.square();
        let mut heights = [0.0; ROWS];
        for i in 0..ROWS {
            let place = self.distance * cotangents[i];
            heights[i] = altitude(place.mul_add(place + linear, constant)) - BOTTOM_KM;
        }
        // From bin to bin the altitude changes by this at the steepest of these rows, the first.
        if self.width * cotangents[0].abs().max(cotangents[light.len() - 1].abs()) < STEP_KM {
            self.add_rows(self.profile.table(0), &heights, light);
            return;
        }
        let spacings = self.spacings(cotangents);
        for i in 0..light.len() {
            let height = heights[i].mul_add(lanes::exp2(-spacings[i]), 1.0);
            self.add_row(self.profile.table(spacings[i] as usize), height, &mut light[i]);
        }
    }

    /// The tables that rows take, as powers of two: their entries are farther apart where the altitude changes more from bin to bin.
    #[inline(always)]
    fn spacings(&self, cotangents: &[f32; ROWS]) -> [f32; ROWS] {
        const MOST: f32 = (SPACINGS - 1) as f32;
        let mut spacings = [0.0; ROWS];
        for i in 0..ROWS {
            let step = self.width * cotangents[i].abs();
            let entry = step * (step * (1.0 / SMOOTH_KM)).clamp(ENTRY_PER_STEP[0], ENTRY_PER_STEP[1]);
            spacings[i] = lanes::log2(entry.max(1.0)).ceil().min(MOST);
        }
        spacings
    }

    /// Adds the light at heights above the lowest level, km.
    #[inline(always)]
    fn add_rows(&self, table: &[PerEmitter<f32>], heights: &[f32; ROWS], light: &mut [PerEmitter<f32>]) {
        for (light, height) in light.iter_mut().zip(heights) {
            self.add_row(table, height + 1.0, light);
        }
    }

    /// Adds the light at a height in entries of `table`, which is dark at both ends.
    #[inline(always)]
    fn add_row(&self, table: &[PerEmitter<f32>], height: f32, light: &mut PerEmitter<f32>) {
        let height = height.max(0.0).min((table.len() - 1) as f32);
        let entry = (height as usize).min(table.len() - 2);
        let part = height - entry as f32;
        let value = mixed(self.weights.simd, &table[entry], &table[entry + 1], part);
        *light = value.fused(self.weights, FourLanes::simd_from(value.simd, *light)).into();
    }
}
