//! Columns of the chart that one thread draws the falls of sources in.
//!
//! They are worked on in a buffer that stays in the cache, and are then written to the picture at once.

use bansho_base::math::{self, MulAdd, approximations, simd::FourLanes};

use super::columns::LightStrip;
use crate::{
    render::{
        bin::source_bins::{Entry, Footprint, Source},
        project::{
            altitude_polynomial::{Descent, Descents, LineOfFall},
            chart::{Chart, Finder, STRIP},
            field_lines::FieldLines,
        },
    },
    single_collisions::rasterize::{QUAD, Quad, Trace},
};
use fearless_simd::Simd;

/// Columns that a thread draws at once: the more, the fewer sources are placed twice.
pub(crate) const GROUP: usize = 4 * STRIP;

/// Ranges of distance from one to twice as far, in each of which lines are seen alike but for a shift: a hundredth.
const RANGES_PER_OCTAVE: f32 = 70.0;
/// Ranges from 1 km on, to beyond the horizon.
const RANGES: usize = 12 * 70;
/// No column.
const NONE: u32 = u32::MAX;

/// How the lines of a column in a range of distance are seen, by the line in its middle.
#[derive(Clone, Copy)]
pub(crate) struct CachedDescent {
    column: u32,
    /// Distance of that line, km.
    pub(crate) distance: f32,
    pub(crate) descent: Descent,
}

/// What a thread keeps from group to group.
pub(crate) struct Group {
    /// Fours of rows of one column after those of another, of which those from `lit` on are valid.
    light: Vec<Quad>,
    lit: [[usize; 2]; GROUP],
    /// Fours of rows from column to column.
    stride: usize,
    /// What shows, by the first column where it does.
    entries: Vec<Entry>,
    /// Cosines and sines of the columns' longitudes, and as many more.
    units: [[f32; GROUP + STRIP]; 2],
    meridians: [[f32; 3]; GROUP],
    /// How lines were last seen in each range of distance, by an even and by an odd column.
    seen: Vec<CachedDescent>,
}

impl Group {
    pub(crate) fn new(chart: &Chart) -> Self {
        // Odd, so that the same row of many columns does not fall to one place of the cache.
        let stride = chart.rows.div_ceil(QUAD) | 1;
        Self {
            light: vec![Quad::DARK; stride * GROUP],
            lit: [[usize::MAX, 0]; GROUP],
            stride,
            entries: Vec::new(),
            units: [[0.0; GROUP + STRIP]; 2],
            meridians: [[0.0; 3]; GROUP],
            seen: (0..2 * RANGES).map(|slot| CachedDescent::none(slot / 2)).collect(),
        }
    }

    /// Begins with a group of the chart; gives what shows in it.
    pub(crate) fn begin(
        &mut self,
        number: usize,
        chart: &Chart,
        footprint: &Footprint,
        field: &FieldLines,
    ) -> Vec<Entry> {
        self.lit = [[usize::MAX, 0]; GROUP];
        for seen in &mut self.seen {
            seen.column = NONE;
        }
        for column in 0..GROUP {
            let unit = chart.unit(number * GROUP + column);
            self.meridians[column] = field.meridian(unit).single();
            for (values, value) in self.units.iter_mut().zip(unit) {
                values[column] = value as f32;
            }
        }
        self.sort(number, footprint);
        std::mem::take(&mut self.entries)
    }

    /// Sources that show first in one column one after the other: what is written stays in the nearest cache.
    fn sort(&mut self, number: usize, footprint: &Footprint) {
        let mut starts = [0; GROUP + 1];
        for entry in footprint.entries(number).flatten() {
            starts[entry.columns().start + 1] += 1;
        }
        for column in 0..GROUP {
            starts[column + 1] += starts[column];
        }
        self.entries.clear();
        self.entries.resize(starts[GROUP], Entry::default());
        for entry in footprint.entries(number).flatten() {
            let next = &mut starts[entry.columns().start];
            self.entries[*next] = *entry;
            *next += 1;
        }
    }

    /// Takes the list of entries back to be used again.
    pub(crate) fn end(&mut self, entries: Vec<Entry>) {
        self.entries = entries;
    }

    /// Cosines and sines from a column on.
    #[inline(always)]
    pub(crate) fn units(&self, column: usize) -> [[f32; STRIP]; 2] {
        let mut units = [[0.0; STRIP]; 2];
        for (units, all) in units.iter_mut().zip(&self.units) {
            units.copy_from_slice(&all[column..column + STRIP]);
        }
        units
    }

    /// The meridian of a column, and how far out on it a source lies, km.
    #[inline(always)]
    pub(crate) fn seen_by(&self, column: usize, source: &Source) -> (&[f32; 3], f32) {
        let [x, y] = source.across;
        (&self.meridians[column], x.fma(self.units[0][column], y * self.units[1][column]))
    }

    /// How a column sees lines about that distance, km.
    #[inline(always)]
    pub(crate) fn descent<S: Simd>(
        &mut self,
        simd: S,
        column: usize,
        distance: f32,
        (descents, finder): (&Descents, &Finder),
    ) -> &CachedDescent {
        let range = ((approximations::log2(distance) * RANGES_PER_OCTAVE).max(0.0) as usize).min(RANGES - 1);
        let seen = &mut self.seen[2 * range + column % 2];
        if seen.column != column as u32 {
            let line = LineOfFall::new(&self.meridians[column], seen.distance, finder);
            (seen.column, seen.descent) = (column as u32, descents.along(simd, &line));
        }
        seen
    }

    /// Adds a fall with weights to a column.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(&mut self, column: usize, trace: &Trace, weights: FourLanes<S>) {
        let (Some(first), Some(last)) = (trace.quads().first(), trace.quads().last()) else { return };
        let light = &mut self.light[column * self.stride..][..self.stride];
        light_up(light, &mut self.lit[column], [*first as usize, *last as usize + 1]);
        trace.add_to(light, weights);
    }

    /// Writes everything to the picture.
    pub(crate) fn write(&self, strip: LightStrip, rows: usize) {
        let columns = strip.light.chunks_mut(rows).zip(strip.lit);
        for ((own, lit), (light, rows_lit)) in self.light.chunks(self.stride).zip(&self.lit).zip(columns) {
            let [first, end] = *lit;
            if first >= end {
                continue;
            }
            let last = rows.min(end * QUAD);
            for (quad, light) in own[first..end].iter().zip(light[first * QUAD..last].chunks_mut(QUAD)) {
                let light = light.as_flattened_mut();
                light.copy_from_slice(&quad.0[..light.len()]);
            }
            *rows_lit = [(first * QUAD) as u32, last as u32];
        }
    }
}

impl CachedDescent {
    fn none(range: usize) -> Self {
        let distance = math::exp2((range as f64 + 0.5) / f64::from(RANGES_PER_OCTAVE)) as f32;
        Self { column: NONE, distance, descent: Descent::default() }
    }
}

/// Makes more of a column valid: what has been lit stays, what is new is dark.
#[inline(always)]
fn light_up(light: &mut [Quad], lit: &mut [usize; 2], [start, end]: [usize; 2]) {
    let end = end.min(light.len());
    if lit[0] > lit[1] {
        light[start..end].fill(Quad::DARK);
        *lit = [start, end];
    }
    if start < lit[0] {
        light[start..lit[0]].fill(Quad::DARK);
        lit[0] = start;
    }
    if end > lit[1] {
        light[lit[1]..end].fill(Quad::DARK);
        lit[1] = end;
    }
}
