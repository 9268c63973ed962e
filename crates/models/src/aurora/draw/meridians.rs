//! The picture of an aurora on its chart: along every meridian, the light of all field lines that are seen there.
//!
//! On a line of sight at colatitude a, the field line at distance r from the observer's own is passed at the place r cot a along the
//! field. So brightness is the integral over r of precipitation times the volume emission at the altitude of that place, over sin a.

use std::ops::Range;

use bansho_base::math::lanes;
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::{
    chart::{Chart, Finder, STRIP},
    footprint::{Bin, Bins, Footprint, StripSums},
    geometry::{FieldLine, FieldLines, Meridian, altitude},
    profile::{BOTTOM_KM, Profile, Profiles, SPACINGS},
};
use crate::aurora::light::PerEmitter;

/// Rows that are worked on at once.
const ROWS: usize = 16;
/// Steps of altitude from bin to bin above which smoothed tables are taken, km: near the magnetic zenith a line of sight runs along the field.
const STEP_KM: f32 = 1.5;

/// Nearer than so many widths of a bin, smoothed tables may be taken: 600 km / [`STEP_KM`].
const NEAR_BINS: f64 = 400.0;
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
}

/// What all columns share.
struct Drawing<'a> {
    chart: &'a Chart,
    field: &'a FieldLines,
    profiles: &'a Profiles,
    bins: &'a Bins,
    /// Distance and width of every bin, km.
    distances: &'a [[f64; 2]],
    cotangents: &'a [f32],
    inverse_sines: &'a [f32],
}

impl Meridians {
    /// Draws the footprint's sources.
    pub(super) fn new(chart: Chart, field: &FieldLines, profiles: &Profiles, footprint: &Footprint) -> Self {
        let level = Level::new();
        let [cotangents, inverse_sines] = chart.row_tables();
        let distances: Vec<_> = (0..footprint.bins().count).map(|bin| footprint.bins().distance(bin)).collect();
        let mut light = vec![[0.0; 4]; chart.columns * chart.rows];
        let drawing = Drawing {
            chart: &chart,
            field,
            profiles,
            bins: footprint.bins(),
            distances: &distances,
            cotangents: &cotangents,
            inverse_sines: &inverse_sines,
        };
        light.par_chunks_mut(STRIP * chart.rows).enumerate().for_each_init(
            StripSums::default,
            |sums, (strip, light)| {
                dispatch!(level, _simd => drawing.strip(strip, footprint, sums, light));
            },
        );
        Self { chart, light }
    }

    /// The picture with how to find places on it.
    pub(super) fn sampler(&self) -> Sampler<'_> {
        Sampler { meridians: self, finder: self.chart.finder() }
    }
}

/// A chart with how to find places on it.
pub(super) struct Sampler<'a> {
    meridians: &'a Meridians,
    finder: Finder,
}

impl Sampler<'_> {
    /// Light at a direction, linear between the cells of the chart.
    #[inline(always)]
    pub(super) fn light(&self, longitude: f32, colatitude: f32) -> PerEmitter<f32> {
        let chart = &self.meridians.chart;
        let (columns, rows) = (chart.columns as i32, chart.rows);
        let column = self.finder.column(longitude) - 0.5;
        let row = (self.finder.row(colatitude) - 0.5).clamp(0.0, (rows - 1) as f32);
        let left = column.floor();
        let (upper, part) = (row as usize, row - row.floor());
        let lower = (upper + 1).min(rows - 1);
        let across = column - left;
        let held = |column: i32| { if chart.whole { column.rem_euclid(columns) } else { column.clamp(0, columns - 1) } }
            as usize;
        let [left, right] =
            [left as i32, left as i32 + 1].map(|column| &self.meridians.light[held(column) * rows..][..rows]);
        let mut light = [0.0; 4];
        for i in 0..4 {
            let above = across.mul_add(right[upper][i] - left[upper][i], left[upper][i]);
            let below = across.mul_add(right[lower][i] - left[lower][i], left[lower][i]);
            light[i] = part.mul_add(below - above, above);
        }
        light
    }
}

impl Drawing<'_> {
    #[inline(always)]
    fn strip(&self, strip: usize, footprint: &Footprint, sums: &mut StripSums, light: &mut [PerEmitter<f32>]) {
        let units: [[f64; 2]; STRIP] = std::array::from_fn(|column| self.chart.unit(strip * STRIP + column));
        footprint.sum(strip, self.chart, &units.map(|unit| unit.map(|value| value as f32)), sums);
        for (column, light) in light.chunks_exact_mut(self.chart.rows).enumerate() {
            let meridian = self.field.meridian(units[column]);
            let (first, bins) = sums.column(column, self.bins);
            for (number, bin) in bins.iter().enumerate() {
                self.bin(&meridian, first + number, bin, light);
            }
            for (light, inverse) in light.iter_mut().zip(self.inverse_sines) {
                light.iter_mut().for_each(|value| *value *= inverse);
            }
        }
    }

    /// The light of one bin on its meridian.
    #[inline(always)]
    fn bin(&self, meridian: &Meridian, number: usize, bin: &Bin, light: &mut [PerEmitter<f32>]) {
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
        let row = |distance: f64, altitude_km: f32| {
            let colatitude = lanes::atan2(distance.max(0.0) as f32, line.place(f64::from(altitude_km)) as f32);
            self.chart.finder().row(colatitude) - 0.5
        };
        let first = row(distance - blurred, profile.top_km).ceil().max(0.0) as usize;
        let end = ((row(distance + blurred, BOTTOM_KM).floor() + 1.0).max(0.0) as usize).min(light.len());
        // The bin holds precipitation times its width already; what is left is per km of sight.
        let weights = [green, red, prompt, prompt];
        let width = width as f32;
        let stretch = Stretch { line: &line, profile: &profile, distance: distance as f32, width, weights };
        self.rows(&stretch, first..end, light);
        if distance < blurred {
            // Beyond the observer's own field line the sheet goes on: what smoothing spreads from there would be missed.
            let line = meridian.line(-distance);
            let beyond = Stretch { line: &line, profile: &profile, distance: -distance as f32, width, weights };
            self.rows(&beyond, first..end, light);
        }
    }

    #[inline(always)]
    fn rows(&self, stretch: &Stretch, rows: Range<usize>, light: &mut [PerEmitter<f32>]) {
        let mut from = rows.start;
        while from < rows.end {
            let to = (from + ROWS).min(rows.end);
            stretch.add(&self.cotangents[from..to], &mut light[from..to]);
            from = to;
        }
    }
}

/// Some rows of one bin.
struct Stretch<'a> {
    line: &'a FieldLine,
    profile: &'a Profile<'a>,
    distance: f32,
    width: f32,
    weights: [f32; 4],
}

impl Stretch<'_> {
    #[inline(always)]
    fn add(&self, cotangents: &[f32], light: &mut [PerEmitter<f32>]) {
        let [constant, linear] = self.line.square();
        let mut heights = [0.0; ROWS];
        let mut padded = [0.0; ROWS];
        padded[..cotangents.len()].copy_from_slice(cotangents);
        for (height, cotangent) in heights.iter_mut().zip(padded) {
            let place = self.distance * cotangent;
            *height = altitude(place.mul_add(place + linear, constant)) - BOTTOM_KM;
        }
        // From bin to bin the altitude changes by this at the steepest of these rows, the first.
        if self.width * padded[0].abs().max(padded[cotangents.len() - 1].abs()) < STEP_KM {
            let table = self.profile.table(0);
            for (light, height) in light.iter_mut().zip(heights) {
                self.add_row(table, height + 1.0, light);
            }
            return;
        }
        for ((light, height), cotangent) in light.iter_mut().zip(heights).zip(padded) {
            let step = self.width * cotangent.abs();
            let entry = step * (step * (1.0 / SMOOTH_KM)).clamp(ENTRY_PER_STEP[0], ENTRY_PER_STEP[1]);
            let spacing = lanes::log2(entry.max(1.0)).ceil();
            let spacing = (spacing as usize).min(SPACINGS - 1);
            let scale = 1.0 / (1_u32 << spacing) as f32;
            self.add_row(self.profile.table(spacing), height.mul_add(scale, 1.0), light);
        }
    }

    /// Adds the light at a height in entries of `table`, which is dark at both ends.
    #[inline(always)]
    fn add_row(&self, table: &[PerEmitter<f32>], height: f32, light: &mut PerEmitter<f32>) {
        let height = height.clamp(0.0, (table.len() - 2) as f32);
        let entry = (height as usize).min(table.len() - 2);
        let part = height - entry as f32;
        let (low, high) = (&table[entry], &table[entry + 1]);
        for i in 0..4 {
            let value = part.mul_add(high[i] - low[i], low[i]);
            light[i] = value.mul_add(self.weights[i], light[i]);
        }
    }
}
