//! Rasterization of sprites: the cells that a sprite covers, and its weights there.
//!
//! Coordinates are in cells of the whole picture, so that rounding does not depend on the window.

use std::ops::Range;

use bansho_base::math::approximations;

use crate::particles::render::splat::{
    SplatSettings, Sprite,
    cap::Cap,
    grid::Raster,
    kernel::{MIN_S, Profile},
};

/// Cells per batch of weights: about one row of a sprite.
pub(crate) const COLUMNS: usize = 8;
/// Rows per batch of chords: about one sprite.
pub(crate) const ROWS: usize = 16;
/// Offsets of cells and rows from the one before the first. (They start at 1, since compilers would treat a zero as a special case.)
const LANE_OFFSETS: [f32; ROWS] =
    [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0];

/// A sprite in cell coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RasterizedSprite<const P: usize> {
    center: [f32; 2],
    /// Coefficient a of the ellipse: decrease of `s` along a row per squared distance from the row's middle.
    pub(crate) falloff: f32,
    /// b/a: shift of a row's middle to the left per row below the center.
    shear: f32,
    /// c - b^2/a: decrease of `s` at the row's middle per squared distance from the center.
    row_falloff: f32,
    /// First row of the grid that it touches, and one past the last.
    pub(crate) rows: [i32; 2],
    layer: usize,
    /// Values for that layer.
    values: [f32; P],
    /// Values for the next layer.
    next_values: [f32; P],
    spans_two_layers: bool,
    /// What it is instead of an ellipse.
    pub(crate) cap: Option<Cap>,
}

impl<const P: usize> RasterizedSprite<P> {
    #[inline(always)]
    pub(crate) fn new(settings: &SplatSettings, sprite: &Sprite<P>, cells: &Raster) -> Self {
        let ellipse = &sprite.ellipse;
        let cell = cells.size as f32;
        let widening = (settings.min_radius_cells * cell / ellipse.radius.max(1e-3)).max(1.0);
        let scale = cell * cell / (widening * widening);
        let center = cells.cell_coordinates(ellipse.center);
        let half_height = ellipse.half_size[1] * widening / cell * (1.0 - MIN_S).sqrt();
        let (first, last) = (cells.first[1], cells.first[1] + cells.rows as i32);
        let rows = [(center[1] - half_height).ceil(), (center[1] + half_height).floor() + 1.0];
        let rows = rows.map(|row| (row as i32).clamp(first, last));
        let [a, b, c] = ellipse.shape.map(|value| value * scale);
        let shear = b / a;
        let row_falloff = c - b * shear;
        // Widened sprites are attenuated.
        let attenuation = 1.0 / (widening * widening);
        let (mut values, mut next_values) = (sprite.values, sprite.values);
        for i in 0..P {
            values[i] *= attenuation * (1.0 - sprite.next_layer_weight);
            next_values[i] *= attenuation * sprite.next_layer_weight;
        }
        let (layer, spans_two_layers) = (sprite.layer, sprite.next_layer_weight > 0.0);
        let cap = ellipse.cap.map(|cap| Cap { falloff: cap.falloff / (widening * widening), ..cap });
        Self { center, falloff: a, shear, row_falloff, rows, layer, values, next_values, spans_two_layers, cap }
    }

    /// Chords of the sprite in the rows from `first` on, where `s = 1 - (a u^2 + 2 b u v + c v^2)` is large enough.
    #[inline(always)]
    pub(crate) fn chords(&self, first: i32, columns: &Range<i32>) -> Chords {
        let before = (first - 1) as f32;
        let (left, count) = (columns.start as f32, columns.len() as i32);
        let widest = 1.0 / self.falloff;
        let mut chords = Chords { middle: [0.0; ROWS], s_max: [0.0; ROWS], first: [0; ROWS], end: [0; ROWS] };
        for row in 0..ROWS {
            let v = before + LANE_OFFSETS[row] - self.center[1];
            let middle = self.center[0] - self.shear * v;
            let s_max = 1.0 - self.row_falloff * v * v;
            let half = ((s_max - MIN_S).max(0.0) * widest).sqrt();
            chords.middle[row] = middle;
            chords.s_max[row] = s_max;
            chords.first[row] = columns.start + truncate_clamped((middle - half).ceil() - left, count);
            chords.end[row] = columns.start + truncate_clamped((middle + half).floor() + 1.0 - left, count);
        }
        chords
    }

    /// Accumulates a run of cells that starts at column `x` of the grid. (Weights outside the sprite are 0.)
    #[inline(always)]
    pub(crate) fn add(&self, row: &mut [[f32; P]], x: usize, layers: usize, weights: &[f32; COLUMNS]) {
        match (P == 1 && layers == 1, self.spans_two_layers) {
            (true, _) => self.add_single_value(&mut row.as_flattened_mut()[x..], weights),
            (_, true) => self.add_run::<true>(&mut row[x * layers + self.layer..], layers, weights),
            (_, false) => self.add_run::<false>(&mut row[x * layers + self.layer..], layers, weights),
        }
    }

    #[inline(always)]
    fn add_run<const TWO_LAYERS: bool>(&self, run: &mut [[f32; P]], layers: usize, weights: &[f32; COLUMNS]) {
        let mut rest = run;
        for weight in weights {
            let Some((own, next)) = rest.split_first_mut() else { return };
            for i in 0..P {
                own[i] = self.values[i].mul_add(*weight, own[i]);
            }
            if TWO_LAYERS && let Some(next) = next.first_mut() {
                for i in 0..P {
                    next[i] = self.next_values[i].mul_add(*weight, next[i]);
                }
            }
            let Some((_, after)) = rest.split_at_mut_checked(layers) else { return };
            rest = after;
        }
    }

    /// Accumulates a run of cells with one value each: a SIMD vector holds consecutive cells.
    #[inline(always)]
    fn add_single_value(&self, cells: &mut [f32], weights: &[f32; COLUMNS]) {
        let value = self.values[0];
        match cells.first_chunk_mut::<COLUMNS>() {
            Some(cells) => {
                for lane in 0..COLUMNS {
                    cells[lane] = value.mul_add(weights[lane], cells[lane]);
                }
            }
            None => {
                for (cell, weight) in cells.iter_mut().zip(weights) {
                    *cell = value.mul_add(*weight, *cell);
                }
            }
        }
    }
}

/// Chords of a sprite in sixteen rows.
pub(crate) struct Chords {
    /// Column of the maximum of `s`, and `s` there.
    middle: [f32; ROWS],
    s_max: [f32; ROWS],
    /// First cell covered, and one past the last.
    pub(crate) first: [i32; ROWS],
    pub(crate) end: [i32; ROWS],
}

impl Chords {
    /// Weights of the cells of a row from column `x` on, where `s` decreases by `falloff` per squared column distance.
    #[inline(always)]
    pub(crate) fn weights(&self, profile: Profile, falloff: f32, row: usize, x: i32) -> [f32; COLUMNS] {
        let (before, middle, s_max) = ((x - 1) as f32, self.middle[row], self.s_max[row]);
        let mut weights = [0.0; COLUMNS];
        for lane in 0..COLUMNS {
            let u = before + LANE_OFFSETS[lane] - middle;
            let s = (-falloff * u).mul_add(u, s_max);
            let s = if s > 0.0 { s } else { 0.0 };
            weights[lane] = profile.at(s);
        }
        weights
    }
}

/// Truncated, and clamped to 0 ..= `max`.
#[inline(always)]
fn truncate_clamped(value: f32, max: i32) -> i32 {
    approximations::round_to_i32(value.max(0.0).min(max as f32))
}
