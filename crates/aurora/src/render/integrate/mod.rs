//! Integration along lines of sight into the columns of a chart: for each meridian, the light of all field lines on it.
//!
//! A line of sight at colatitude a passes the field line at distance r from the observer's own at the coordinate r cot
//! a along the field. So the brightness is the integral over r of precipitation times volume emission at the altitude
//! of that point, divided by sin a.

pub(crate) mod column_buffer;
pub(crate) mod emission_profile;

use std::ops::Range;

use bansho_base::{
    host::{parallel::prelude::*, scratch_pool::ScratchPool},
    math::{
        approximations,
        simd::{FourLanes, HalfLanes, Real},
    },
};
use column_buffer::{ColumnBlock, ColumnBuffer, lerp_emitters};
use emission_profile::{BOTTOM_KM, EmissionProfile, EmissionProfiles, MIP_LEVELS, ProfilesAroundObserver};
use fearless_simd::{Simd, dispatch, prelude::*};

use crate::{
    physics::emission::PerEmitter,
    render::{
        bin::source_bins::{Bin, BlockBins, DistanceBins, MAX_ENTRY_PER_STEP, SortedSources},
        project::{
            chart::{BLOCK_COLUMNS, Chart},
            field_lines::{EarthShadow, FieldLine, FieldLines, Meridian, altitude},
        },
    },
};

/// Rows per batch.
const ROWS: usize = 16;
/// Where light varies slowly with altitude, it is computed every fourth row and interpolated linearly.
const KNOT_ROWS: usize = 4;
/// Altitude above which light varies slowly, km, and maximum spacing of knots as a fraction of their height above it.
const SLOW_KM: f32 = 110.0;
const MAX_KNOT_FRACTION: f32 = 0.1;
/// Altitude step between bins above which prefiltered tables are used, km: near the magnetic zenith a line of sight is
/// nearly parallel to the field.
const STEP_KM: f32 = 1.5;

/// Minimum and maximum entry spacing of prefiltered tables relative to the step. Small steps need less than the maximum
/// because the profile is smooth, and the lower border stays sharp.
const ENTRY_PER_STEP: [f32; 2] = [1.0 / STEP_KM, MAX_ENTRY_PER_STEP];
/// Steps above which the entry spacing exceeds the step, km.
const SMOOTH_KM: f32 = 12.0;

/// Inputs that all columns share.
struct ProfilePass<'a> {
    chart: &'a Chart,
    field: &'a FieldLines,
    profiles: &'a EmissionProfiles,
    /// For an observer who may be within the light.
    around_observer: Option<ProfilesAroundObserver<'a>>,
    bins: &'a DistanceBins,
    /// Center and width of every bin, km.
    distances: &'a [[f64; 2]],
    /// By row and by knot, padded by [`ROWS`].
    cotangents: &'a [f32],
    knots: &'a [f32],
    inverse_sines: &'a [f32],
    /// Largest height difference between the observer and [`SLOW_KM`], km.
    slow_height_km: f32,
}

impl ColumnBuffer {
    /// Integrates the binned sources into a buffer without light.
    pub(crate) fn integrate(
        mut self,
        field: &FieldLines,
        profiles: &EmissionProfiles,
        sorted_sources: &SortedSources,
    ) -> Self {
        let level = bansho_base::math::simd::level();
        // Padded by a batch of knots: a batch that begins at the last row or the last knot is still a whole array, and no kernel has a remainder
        // loop.
        let [cotangents, inverse_sines] = self.chart.row_tables(ROWS * KNOT_ROWS);
        let knots: Vec<f32> = cotangents.iter().copied().step_by(KNOT_ROWS).collect();
        let distances: Vec<_> =
            (0..sorted_sources.bins().count).map(|bin| sorted_sources.bins().distance(bin)).collect();
        let (chart, blocks) = self.blocks(BLOCK_COLUMNS);
        let pass = ProfilePass {
            chart,
            field,
            profiles,
            around_observer: field
                .is_above_light()
                .then(|| ProfilesAroundObserver::new(profiles, field.observer_altitude_km())),
            bins: sorted_sources.bins(),
            distances: &distances,
            cotangents: &cotangents,
            knots: &knots,
            inverse_sines: &inverse_sines,
            slow_height_km: field.border_distances_km(f64::from(SLOW_KM))[1] as f32,
        };
        let scratch_pool = ScratchPool::new(ProfileScratch::default);
        // Blocks differ in their number of sources by orders of magnitude, so each is a task of its own.
        blocks.with_max_len(1).for_each(|block| {
            scratch_pool
                .with(|scratch| dispatch!(level, simd => pass.integrate_block(simd, block, sorted_sources, scratch)));
        });
        self
    }
}

/// Light that varies slowly with altitude: for each group of [`KNOT_ROWS`] rows the values at its first row and one
/// past its last.
#[derive(Default)]
struct KnotBuffer {
    light: Vec<[PerEmitter<f32>; 2]>,
    /// First group that may be non-zero, and one past the last.
    valid_groups: [usize; 2],
}

impl KnotBuffer {
    /// Clears the buffer for a number of rows.
    fn clear(&mut self, rows: usize) {
        self.light.clear();
        self.light.resize(rows.div_ceil(KNOT_ROWS), [[0.0; 4]; 2]);
        self.valid_groups = [usize::MAX, 0];
    }

    /// Adds light at knots from index `first` on.
    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, first: usize, knots: &[PerEmitter<f32>]) {
        // A group stores both of its ends, although its far end is the next group's near end: the bin may stop there while other bins go on, and a
        // group must not be interpolated toward light that its bin does not have. Both ends are also one vector of eight, loaded and stored once.
        self.valid_groups = [self.valid_groups[0].min(first), self.valid_groups[1].max(first + knots.len() - 1)];
        for (sum, ends) in self.light[first..].iter_mut().zip(knots.windows(2)) {
            let sum = sum.as_flattened_mut();
            (HalfLanes::from_slice(simd, ends.as_flattened()) + HalfLanes::from_slice(simd, sum)).store_slice(sum);
        }
    }

    /// Interpolates it to the rows of the column.
    #[inline(always)]
    fn add_to<S: Simd>(&self, simd: S, light: &mut [PerEmitter<f32>]) {
        for knot in self.valid_groups[0]..self.valid_groups[1] {
            let [low, high] = &self.light[knot];
            let end = light.len().min((knot + 1) * KNOT_ROWS);
            for (row, light) in light[knot * KNOT_ROWS..end].iter_mut().enumerate() {
                let between = lerp_emitters(simd, low, high, row as f32 * (1.0 / KNOT_ROWS as f32));
                *light = (between + FourLanes::simd_from(simd, *light)).into();
            }
        }
    }
}

/// Buffers that a thread reuses from block to block.
#[derive(Default)]
struct ProfileScratch {
    sums: BlockBins,
    slow: KnotBuffer,
}

impl ProfilePass<'_> {
    #[inline(always)]
    fn integrate_block<S: Simd>(
        &self,
        simd: S,
        mut block: ColumnBlock,
        sorted_sources: &SortedSources,
        scratch: &mut ProfileScratch,
    ) {
        let ProfileScratch { sums, slow } = scratch;
        sorted_sources.accumulate(simd, block.number, self.chart, &self.chart.block_cos_sin(block.number), sums);
        for column in 0..BLOCK_COLUMNS {
            let meridian = self.field.meridian(self.chart.longitude_cos_sin(block.number * BLOCK_COLUMNS + column));
            let (first, bins) = sums.column(column, self.bins);
            slow.clear(self.chart.rows);
            for (number, bin) in bins.iter().enumerate() {
                self.accumulate_bin(simd, &meridian, first + number, bin, &mut block, column, slow);
            }
            let [first, end] = block.valid_rows[column].map(|row| row as usize);
            let valid = first.min(end)..end;
            let light = &mut block.light[column * self.chart.rows..][..self.chart.rows];
            // The last knots may extend past the valid rows.
            slow.add_to(simd, &mut light[..end]);
            // The 1 / sin a of the integral depends on the row alone: once per column, not once per bin.
            for (light, inverse) in light[valid.clone()].iter_mut().zip(&self.inverse_sines[valid]) {
                for value in light {
                    *value *= inverse;
                }
            }
        }
    }

    /// Adds the light of one bin on its meridian.
    #[inline(always)]
    fn accumulate_bin<S: Simd>(
        &self,
        simd: S,
        meridian: &Meridian,
        number: usize,
        bin: &Bin,
        block: &mut ColumnBlock,
        column: usize,
        slow: &mut KnotBuffer,
    ) {
        let [green, red, prompt, by_node] = *bin;
        let all = green + red + prompt;
        // An empty bin has no mean energy.
        if all <= 1e-12 {
            return;
        }
        // One profile for all sources of the bin, that of their mean node. A sum of profiles would make the integral proportional to sources times
        // rows; energies of neighbors differ little.
        let profile = self.profiles.at(by_node / all, red > 0.0);
        let [distance, width] = self.distances[number];
        let line = meridian.line(distance);
        // Prefiltered tables spread light to the rows of neighboring bins.
        let near = distance < self.bins.near_limit_km;
        let blurred = f64::from(self.bins.smoothing_km(distance as f32));
        let top = self.row_of_altitude(&line, distance, -blurred, profile.top_km);
        let bottom = self.row_of_altitude(&line, distance, blurred, profile.bottom_km);
        // Rows are counted from their centers, so a row belongs to the bin if its center is between the borders.
        let end = ((bottom.floor() + 1.0).max(0.0) as usize).min(self.chart.rows);
        let first = top.ceil().max(0.0) as usize;
        if first >= end {
            return;
        }
        // The bin's power already includes its width; the rest is per km along the line of sight.
        let weights = FourLanes::simd_from(simd, [green, red, prompt, prompt]);
        let (distance, width) = (distance as f32, width as f32);
        let shadow = self.field.is_above_light().then(|| meridian.earth_shadow());
        let sides = self.around_observer.as_ref().filter(|_| near).map(|profiles| profiles.at(by_node / all));
        let bin_rows = BinRows {
            line: &line,
            profile: &profile,
            sides,
            observer_altitude: self.field.observer_altitude_km() as f32 - BOTTOM_KM,
            distance,
            width,
            near,
            weights,
            shadow,
        };
        // From the first row of a group of knots on, since the interpolated light fills whole groups.
        let light = block.extend_valid_rows(column, &(first / KNOT_ROWS * KNOT_ROWS..end), self.chart.rows);
        // Near the magnetic zenith the altitude changes too fast from row to row for knots.
        let rest = if near { first } else { self.add_knot_rows(&bin_rows, first..end, slow) };
        self.add_dense_rows(&bin_rows, rest, &mut light[rest.min(end)..end]);
        if near {
            // The sheet continues beyond the observer's own field line; prefiltering spreads light from there too.
            let line = meridian.line(-f64::from(distance));
            let beyond = BinRows { line: &line, distance: -distance, ..bin_rows };
            self.add_dense_rows(&beyond, first, &mut light[first..end]);
        }
    }

    /// Adds the upper rows, in which light varies slowly; returns the first remaining row.
    #[inline(always)]
    fn add_knot_rows<S: Simd>(&self, bin_rows: &BinRows<S>, rows: Range<usize>, slow: &mut KnotBuffer) -> usize {
        let distance = bin_rows.distance;
        // Altitude difference between knots.
        // On a field line at distance r, a point at height h above or below the observer moves along it by (h^2 + r^2) / r for each radian of
        // colatitude.
        let knot_km = (KNOT_ROWS as f32 * self.chart.row_step as f32)
            * (self.slow_height_km * self.slow_height_km / distance + distance);
        let end = self.row_of_altitude(
            bin_rows.line,
            f64::from(distance),
            0.0,
            SLOW_KM + knot_km * (1.0 / MAX_KNOT_FRACTION),
        );
        let end = (end.max(0.0) as usize).min(rows.end.next_multiple_of(KNOT_ROWS));
        let (mut knot, last) = (rows.start / KNOT_ROWS, end / KNOT_ROWS);
        if knot >= last {
            return rows.start;
        }
        while knot < last {
            let Some(cotangents) = self.knots[knot..].first_chunk() else { break };
            let count = (last - knot + 1).min(ROWS);
            let mut light = [[0.0; 4]; ROWS];
            bin_rows.add(cotangents, &mut light[..count]);
            slow.add(bin_rows.weights.simd, knot, &light[..count]);
            // Batches share a knot: what is added are pairs of neighboring knots.
            knot += count - 1;
        }
        last * KNOT_ROWS
    }

    /// The row in which a line of sight passes an altitude on the field line at a distance, extended by the prefilter's
    /// spread: where the line of sight descends along the field, nearer bins appear farther down.
    #[inline(always)]
    fn row_of_altitude(&self, line: &FieldLine, distance: f64, blurred: f64, altitude_km: f32) -> f32 {
        let position = line.position_at_altitude(f64::from(altitude_km));
        let distance = distance + if position < 0.0 { -blurred } else { blurred };
        let colatitude = approximations::atan2(distance.max(0.0) as f32, position as f32);
        self.chart.projection().row(colatitude) - 0.5
    }

    /// Adds the light of a bin to rows from `first` on.
    #[inline(always)]
    fn add_dense_rows<S: Simd>(&self, bin_rows: &BinRows<S>, first: usize, light: &mut [PerEmitter<f32>]) {
        let mut from = 0;
        while from < light.len() {
            let Some(cotangents) = self.cotangents[first + from..].first_chunk() else { return };
            let to = (from + ROWS).min(light.len());
            bin_rows.add(cotangents, &mut light[from..to]);
            from = to;
        }
    }
}

/// Inputs for the rows of one bin.
struct BinRows<'a, S: Simd> {
    line: &'a FieldLine,
    profile: &'a EmissionProfile<'a>,
    /// What is above and below an observer who may be within the light, for near bins.
    sides: Option<[EmissionProfile<'a>; 2]>,
    /// Altitude of the observer above the lowest level, km.
    observer_altitude: f32,
    distance: f32,
    width: f32,
    /// Whether it is a near bin.
    near: bool,
    weights: FourLanes<S>,
    /// What the Earth hides, for an observer above the light.
    shadow: Option<EarthShadow>,
}

impl<S: Simd> BinRows<'_, S> {
    #[inline(always)]
    fn add(&self, cotangents: &[f32; ROWS], light: &mut [PerEmitter<f32>]) {
        let [constant, linear] = self.line.quadratic();
        let mut altitudes = [0.0; ROWS];
        for i in 0..ROWS {
            // The squared distance from the Earth's center is a quadratic of the coordinate along the field, which is r cot a.
            let position = self.distance * cotangents[i];
            altitudes[i] = altitude(position.fma(position + linear, constant)) - BOTTOM_KM;
        }
        // A loop of its own, so that both are vectorized; most observers are below the light and skip it.
        if let Some(shadow) = &self.shadow {
            for i in 0..ROWS {
                // Below all tables, where nothing shines.
                altitudes[i] = if shadow.hides(self.distance, cotangents[i]) { -1e6 } else { altitudes[i] };
            }
        }
        // Altitude change from bin to bin in the steepest row; for far bins it is proportional to the bin width, as the
        // profile is.
        if !self.near || self.width * cotangents[0].abs().max(cotangents[light.len() - 1].abs()) < STEP_KM {
            // Without a filter nothing is spread beyond the observer's own field line, and what is there is behind the observer.
            if self.sides.is_none() || self.distance > 0.0 {
                self.add_rows(self.profile.table(0), &altitudes, light);
            }
            return;
        }
        let mip_levels = self.mip_levels(cotangents);
        for i in 0..light.len() {
            let profile = self.profile_in_front(altitudes[i]);
            // Entries of level m are 2^m km apart. The first is dark, so the lowest altitude is at the second.
            let altitude = altitudes[i].fma(approximations::exp2(-mip_levels[i]), 1.0);
            self.add_row(profile.table(mip_levels[i] as usize), altitude, &mut light[i]);
        }
    }

    /// The profile without what is behind the observer, for a line of sight that passes this bin at an altitude above the lowest level, km. In front
    /// of the observer it stays on one side of the observer's altitude; bins beyond the observer's own field line are behind.
    #[inline(always)]
    fn profile_in_front(&self, altitude: f32) -> &EmissionProfile<'_> {
        let Some([above, below]) = &self.sides else { return self.profile };
        let is_higher = altitude > self.observer_altitude;
        if is_higher == (self.distance > 0.0) { above } else { below }
    }

    /// Mip level per row: coarser where the altitude changes more from bin to bin.
    #[inline(always)]
    fn mip_levels(&self, cotangents: &[f32; ROWS]) -> [f32; ROWS] {
        const MAX_LEVEL: f32 = (MIP_LEVELS - 1) as f32;
        let mut mip_levels = [0.0; ROWS];
        for i in 0..ROWS {
            let step = self.width * cotangents[i].abs();
            // Entries about as wide as the step filter out what neighboring bins would alias. Small steps take two thirds of their width, so that the
            // lower border stays sharp; beyond SMOOTH_KM entries are wider than the step, up to twice.
            let entry = step * (step * (1.0 / SMOOTH_KM)).clamp(ENTRY_PER_STEP[0], ENTRY_PER_STEP[1]);
            mip_levels[i] = approximations::log2(entry.max(1.0)).ceil().min(MAX_LEVEL);
        }
        mip_levels
    }

    /// Adds the light at altitudes above the lowest level, km.
    #[inline(always)]
    fn add_rows(&self, table: &[PerEmitter<f32>], altitudes: &[f32; ROWS], light: &mut [PerEmitter<f32>]) {
        for (light, altitude) in light.iter_mut().zip(altitudes) {
            self.add_row(table, altitude + 1.0, light);
        }
    }

    /// Adds the light at a fractional entry of `table`, whose ends are 0.
    #[inline(always)]
    fn add_row(&self, table: &[PerEmitter<f32>], altitude: f32, light: &mut PerEmitter<f32>) {
        // Clamped to the dark entries at both ends, instead of a test whether the altitude is within the profile. NaN, too, becomes dark.
        let altitude = altitude.max(0.0).min((table.len() - 1) as f32);
        let entry = (altitude as usize).min(table.len() - 2);
        let fraction = altitude - entry as f32;
        let value = lerp_emitters(self.weights.simd, &table[entry], &table[entry + 1], fraction);
        *light = value.fma(self.weights, FourLanes::simd_from(value.simd, *light)).into();
    }
}
