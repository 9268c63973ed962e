//! A block of chart columns in which one thread rasterizes the electron tracks of sources.
//!
//! The buffer fits into the cache and is written to the picture once.

use bansho_base::math::{self, MulAdd, approximations, simd::FourLanes};
use fearless_simd::Simd;

use super::rasterize::{QUAD_ROWS, RowQuad, TrackRasterizer};
use crate::render::{
    bin::source_bins::{BlockEntry, FieldLineSource, SortedSources},
    integrate::column_buffer::ColumnBlock,
    project::{
        altitude_polynomial::{ProjectedFieldLine, RowPolynomialBasis, RowPolynomials},
        chart::{BLOCK_COLUMNS, Chart, ChartProjection},
        field_lines::FieldLines,
    },
};

/// Columns per block of single collisions: the wider, the fewer sources are projected more than once.
pub(crate) const COLLISION_BLOCK_COLUMNS: usize = 4 * BLOCK_COLUMNS;

/// Distance intervals per octave, in each of which field lines differ by a shift of their rows only, to within a
/// hundredth.
const RANGES_PER_OCTAVE: f32 = 70.0;
/// Number of intervals, from 1 km to beyond the horizon.
const RANGES: usize = 12 * 70;
/// No column.
const NONE: u32 = u32::MAX;

/// Projection of the field line at the center of a distance interval, for one column.
#[derive(Clone, Copy)]
pub(crate) struct CachedProjection {
    column: u32,
    /// Distance of that line, km.
    pub(crate) distance: f32,
    pub(crate) polynomials: RowPolynomials,
}

/// The accumulation buffer of a block, which a thread reuses from block to block.
pub(crate) struct CollisionBlock {
    /// Groups of four rows, column by column; only those within `valid` are initialized.
    light: Vec<RowQuad>,
    valid: [[usize; 2]; COLLISION_BLOCK_COLUMNS],
    /// Groups of four rows per column.
    stride: usize,
    /// Sources of the block, sorted by their first column.
    entries: Vec<BlockEntry>,
    /// Cosines and sines of the columns' longitudes, padded by [`BLOCK_COLUMNS`].
    units: [[f32; COLLISION_BLOCK_COLUMNS + BLOCK_COLUMNS]; 2],
    meridians: [[f32; 3]; COLLISION_BLOCK_COLUMNS],
    /// Direct-mapped cache of projections by distance interval and column parity.
    cache: Vec<CachedProjection>,
}

impl CollisionBlock {
    pub(crate) fn new(chart: &Chart) -> Self {
        // Odd, to avoid cache-set aliasing between the same row of neighboring columns.
        let stride = chart.rows.div_ceil(QUAD_ROWS) | 1;
        Self {
            light: vec![RowQuad::DARK; stride * COLLISION_BLOCK_COLUMNS],
            valid: [[usize::MAX, 0]; COLLISION_BLOCK_COLUMNS],
            stride,
            entries: Vec::new(),
            units: [[0.0; COLLISION_BLOCK_COLUMNS + BLOCK_COLUMNS]; 2],
            meridians: [[0.0; 3]; COLLISION_BLOCK_COLUMNS],
            cache: (0..2 * RANGES).map(|slot| CachedProjection::none(slot / 2)).collect(),
        }
    }

    /// Starts a block of the chart and returns its sources.
    pub(crate) fn begin(
        &mut self,
        index: usize,
        chart: &Chart,
        sorted_sources: &SortedSources,
        field: &FieldLines,
    ) -> Vec<BlockEntry> {
        self.valid = [[usize::MAX, 0]; COLLISION_BLOCK_COLUMNS];
        for cached in &mut self.cache {
            cached.column = NONE;
        }
        for column in 0..COLLISION_BLOCK_COLUMNS {
            let unit = chart.longitude_cos_sin(index * COLLISION_BLOCK_COLUMNS + column);
            self.meridians[column] = field.meridian(unit).coefficients_f32();
            for (values, value) in self.units.iter_mut().zip(unit) {
                values[column] = value as f32;
            }
        }
        self.sort(index, sorted_sources);
        std::mem::take(&mut self.entries)
    }

    /// Counting sort by first column, for cache locality of the writes.
    fn sort(&mut self, index: usize, sorted_sources: &SortedSources) {
        let mut starts = [0; COLLISION_BLOCK_COLUMNS + 1];
        for entry in sorted_sources.entries(index).flatten() {
            starts[entry.columns().start + 1] += 1;
        }
        for column in 0..COLLISION_BLOCK_COLUMNS {
            starts[column + 1] += starts[column];
        }
        self.entries.clear();
        self.entries.resize(starts[COLLISION_BLOCK_COLUMNS], BlockEntry::default());
        for entry in sorted_sources.entries(index).flatten() {
            let next = &mut starts[entry.columns().start];
            self.entries[*next] = *entry;
            *next += 1;
        }
    }

    /// Returns the entry list for reuse.
    pub(crate) fn recycle(&mut self, entries: Vec<BlockEntry>) {
        self.entries = entries;
    }

    /// Cosines and sines from a column on.
    #[inline(always)]
    pub(crate) fn units(&self, column: usize) -> [[f32; BLOCK_COLUMNS]; 2] {
        let mut units = [[0.0; BLOCK_COLUMNS]; 2];
        for (units, all) in units.iter_mut().zip(&self.units) {
            units.copy_from_slice(&all[column..column + BLOCK_COLUMNS]);
        }
        units
    }

    /// The meridian of a column, and the source's distance along it, km.
    #[inline(always)]
    pub(crate) fn meridian_and_distance(&self, column: usize, source: &FieldLineSource) -> (&[f32; 3], f32) {
        let [x, y] = source.across;
        (&self.meridians[column], x.fma(self.units[0][column], y * self.units[1][column]))
    }

    /// The cached projection of field lines at about that distance in km, for a column.
    #[inline(always)]
    pub(crate) fn cached_projection<S: Simd>(
        &mut self,
        simd: S,
        column: usize,
        distance: f32,
        basis: &RowPolynomialBasis,
        projection: &ChartProjection,
    ) -> &CachedProjection {
        let range = ((approximations::log2(distance) * RANGES_PER_OCTAVE).max(0.0) as usize).min(RANGES - 1);
        let cached = &mut self.cache[2 * range + column % 2];
        if cached.column != column as u32 {
            let line = ProjectedFieldLine::new(&self.meridians[column], cached.distance, projection);
            (cached.column, cached.polynomials) = (column as u32, basis.fit(simd, &line));
        }
        cached
    }

    /// Adds a rasterized track with weights to a column.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(&mut self, column: usize, rasterizer: &TrackRasterizer, weights: FourLanes<S>) {
        let (Some(first), Some(last)) = (rasterizer.active_quads().first(), rasterizer.active_quads().last()) else {
            return;
        };
        let light = &mut self.light[column * self.stride..][..self.stride];
        extend_valid_quads(light, &mut self.valid[column], [*first as usize, *last as usize + 1]);
        rasterizer.add_to(light, weights);
    }

    /// Writes the block to the picture.
    pub(crate) fn write(&self, block: ColumnBlock, rows: usize) {
        let columns = block.light.chunks_mut(rows).zip(block.valid_rows);
        for ((quads, valid), (light, valid_rows)) in self.light.chunks(self.stride).zip(&self.valid).zip(columns) {
            let [first, end] = *valid;
            if first >= end {
                continue;
            }
            let last = rows.min(end * QUAD_ROWS);
            for (quad, light) in quads[first..end].iter().zip(light[first * QUAD_ROWS..last].chunks_mut(QUAD_ROWS)) {
                let light = light.as_flattened_mut();
                light.copy_from_slice(&quad.0[..light.len()]);
            }
            *valid_rows = [(first * QUAD_ROWS) as u32, last as u32];
        }
    }
}

impl CachedProjection {
    fn none(range: usize) -> Self {
        let distance = math::exp2((range as f64 + 0.5) / f64::from(RANGES_PER_OCTAVE)) as f32;
        Self { column: NONE, distance, polynomials: RowPolynomials::default() }
    }
}

/// Extends the valid range of a column; new quads are cleared.
#[inline(always)]
fn extend_valid_quads(light: &mut [RowQuad], valid: &mut [usize; 2], [start, end]: [usize; 2]) {
    let end = end.min(light.len());
    if valid[0] > valid[1] {
        light[start..end].fill(RowQuad::DARK);
        *valid = [start, end];
    }
    if start < valid[0] {
        light[start..valid[0]].fill(RowQuad::DARK);
        valid[0] = start;
    }
    if end > valid[1] {
        light[valid[1]..end].fill(RowQuad::DARK);
        valid[1] = end;
    }
}
