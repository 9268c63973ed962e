//! The default texture: two layers of one table of domain-warped gradient noise that rise at different speeds.
//!
//! A single periodic table repeats when it has scrolled by its height. Here the scroll direction is slanted, so that the table
//! returns shifted by an irrational fraction of its width, and a second, finer layer rises faster with the opposite slant. Both
//! also make the pattern change as it rises, as in a real flame.

use std::sync::{Arc, LazyLock};

use bansho_base::{
    math,
    math::{
        random::{Key, Purpose},
        simd::Real,
    },
};

use super::{COLUMNS, FlameTexture, ROWS, TextureLayer, TextureTable};
use crate::sheet::animate::clock::Clock;

/// Lattice cells of the first octave along columns and rows; 32 and 64 texels wide.
const CELLS: [usize; 2] = [8, 8];
/// Table widths across the sheet, and table heights per sheet height, of the coarse layer.
const COARSE: [f64; 2] = [0.37, 0.243];
/// The noise table, common to all flames, which differ by their offsets.
pub(crate) static FRACTAL: LazyLock<Arc<TextureTable>> = LazyLock::new(|| Arc::new(TextureTable::new(&warped_noise())));

/// The texels of a table, row after row.
type Texels = Vec<f32>;

/// Periodic gradient noise (Perlin 1985, with the quintic fade of 2002) on a lattice that divides the table.
fn gradient_noise(cells: [usize; 2], key: Key, purpose: Purpose) -> Texels {
    let lattice = GradientLattice::new(cells, key, purpose);
    let (across, up) = (lattice_coordinates(COLUMNS, cells[0]), lattice_coordinates(ROWS, cells[1]));
    let mut texels = Vec::with_capacity(ROWS * COLUMNS);
    for y in &up {
        for x in &across {
            let (fx, fy) = (x.fraction, y.fraction);
            let below = math::f32::lerp(
                lattice.dot(x.cell, y.cell, [fx, fy]),
                lattice.dot(x.next_cell, y.cell, [fx - 1.0, fy]),
                x.fade,
            );
            let above = math::f32::lerp(
                lattice.dot(x.cell, y.next_cell, [fx, fy - 1.0]),
                lattice.dot(x.next_cell, y.next_cell, [fx - 1.0, fy - 1.0]),
                x.fade,
            );
            texels.push(math::f32::lerp(below, above, y.fade));
        }
    }
    texels
}

/// Random unit vectors at the nodes of a periodic lattice.
struct GradientLattice {
    columns: usize,
    /// Row by row.
    gradients: Vec<[f32; 2]>,
}

impl GradientLattice {
    fn new([columns, rows]: [usize; 2], key: Key, purpose: Purpose) -> Self {
        let mut gradients = Vec::with_capacity(columns * rows);
        for node in 0..columns * rows {
            let turn = key.uniforms(node as u64, 0, purpose)[0];
            let (sin, cos) = math::f32::sin_cos(std::f32::consts::TAU * turn);
            gradients.push([cos, sin]);
        }
        Self { columns, gradients }
    }

    /// Dot product of the gradient of a node and the offset from it.
    fn dot(&self, column: usize, row: usize, offset: [f32; 2]) -> f32 {
        let gradient = self.gradients[row * self.columns + column];
        gradient[0] * offset[0] + gradient[1] * offset[1]
    }
}

/// Position of a texel on a periodic lattice along one axis.
struct LatticeCoordinate {
    cell: usize,
    next_cell: usize,
    /// Fraction within the cell.
    fraction: f32,
    /// Quintic fade of the fraction.
    fade: f32,
}

/// Lattice coordinates of `count` texels on a lattice of `cells` cells.
fn lattice_coordinates(count: usize, cells: usize) -> Vec<LatticeCoordinate> {
    let width = count / cells;
    let coordinates = (0..count).map(|i| {
        let f = (i % width) as f32 / width as f32;
        let fade = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
        LatticeCoordinate { cell: i / width, next_cell: (i / width + 1) % cells, fraction: f, fade }
    });
    coordinates.collect()
}

/// Sum of octaves of noise, each with twice the frequency and `gain` times the amplitude of the previous one.
pub(crate) fn fractal_noise(count: usize, gain: f32, key: Key, name: Purpose) -> Texels {
    let mut sum = vec![0.0_f32; ROWS * COLUMNS];
    let mut amplitude = 1.0;
    for octave in 0..count {
        let purpose = Purpose(name.0.wrapping_add(octave as u32));
        let noise = gradient_noise(CELLS.map(|cells| cells << octave), key, purpose);
        sum.iter_mut().zip(noise).for_each(|(sum, noise)| *sum += amplitude * noise);
        amplitude *= gain;
    }
    sum
}

/// Domain-warped noise: its coordinates are displaced by other noise.
fn warped_noise() -> Texels {
    /// Displacement across and up at a noise value of 1, texels.
    const WARP_TEXELS: [f32; 2] = [34.0, 60.0];
    let key = Key::new(1985, "flame sheet fractal");
    let gas = TextureTable::new(&fractal_noise(4, 0.5, key, Purpose::named("gas")));
    let across = fractal_noise(2, 0.5, key, Purpose::named("stir across"));
    let up = fractal_noise(2, 0.5, key, Purpose::named("stir up"));
    let warped = (0..ROWS * COLUMNS).map(|i| {
        let column = WARP_TEXELS[0].fma(across[i], (i % COLUMNS) as f32);
        gas.bilinear(column, WARP_TEXELS[1].fma(up[i], (i / COLUMNS) as f32))
    });
    equalize_histogram(warped.collect())
}

/// Histogram equalization: replaces each value by its rank in [0, 1]. The paper requires a texture whose values are uniformly distributed.
fn equalize_histogram(texels: Texels) -> Texels {
    const BINS: usize = 4096;
    let low = texels.iter().copied().fold(f32::INFINITY, f32::min);
    let high = texels.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let scale = BINS as f32 / (high - low).max(f32::MIN_POSITIVE);
    // In bins; less than the last bin's end, so that the largest value is in it.
    let coordinates: Vec<f32> =
        texels.into_iter().map(|value| ((value - low) * scale).min(BINS as f32 - 0.001)).collect();
    let mut below = vec![0.0_f64; BINS + 1];
    coordinates.iter().for_each(|value| below[*value as usize + 1] += 1.0 / coordinates.len() as f64);
    for bin in 0..BINS {
        below[bin + 1] += below[bin];
    }
    let ranks = coordinates.into_iter().map(|coordinate| {
        let bin = coordinate as usize;
        math::lerp(below[bin], below[bin + 1], f64::from(coordinate) - bin as f64) as f32
    });
    ranks.collect()
}

/// Mean of two uniformly distributed numbers, equalized: their sum has a triangular distribution, whose cumulative distribution function is applied.
#[inline(always)]
pub(super) fn mix_equalized<N: Real>(a: N, b: N) -> N {
    let (sum, one) = (a + b, a.broadcast(1.0));
    let low = sum.simd_min(a.broadcast(2.0) - sum);
    let rank = a.broadcast(0.5) * low * low;
    sum.select_lt(one, rank, one - rank)
}

/// How one layer is mapped to the table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerMapping {
    /// Table widths across the sheet.
    pub(crate) widths: f64,
    /// Table widths of slant per sheet height.
    pub(crate) slant: f64,
    /// Table heights per sheet height.
    pub(crate) heights: f64,
    /// Speed relative to the scroll speed.
    pub(crate) rate: f64,
    /// Offset, in table widths and heights.
    pub(crate) start: [f64; 2],
}

impl LayerMapping {
    /// The mapping for tongues `width` times as wide and `length` times as long, which rise at `speed` times the scroll speed and repeat with the loop.
    pub(crate) fn fitted(self, [width, length]: [f64; 2], speed: f64, clock: &Clock) -> Self {
        let heights = self.heights / length;
        // The number of tables that pass in a loop is rounded to an integer: by a stretch of at most 25 %, and beyond that by the speed.
        let layer_speed = self.rate * speed.max(1e-3);
        let rounding = clock.waves(heights * layer_speed, 1.0) / (heights * layer_speed);
        let stretch = rounding.clamp(0.8, 1.25);
        let rate = layer_speed * rounding / stretch;
        let slant = clock.waves(self.slant * rate, 0.0) / rate;
        Self { widths: self.widths / width, slant, heights: heights * stretch, rate, ..self }
    }

    /// The mapping in texels after `scroll` sheet heights.
    pub(crate) fn after(self, scroll: f64) -> TextureLayer {
        let layer_scroll = self.rate * scroll;
        let column = math::reduce_phase(self.start[0] - self.slant * layer_scroll);
        let row = math::reduce_phase(self.start[1] - self.heights * layer_scroll);
        let (columns, rows) = (COLUMNS as f64, ROWS as f64);
        TextureLayer {
            columns_per_u: (columns * self.widths) as f32,
            columns_per_w: (columns * self.slant) as f32,
            first_column: columns as f32 * column,
            rows_per_w: (rows * self.heights) as f32,
            first_row: rows as f32 * row,
        }
    }
}

/// The layers of one flame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FractalLayers {
    mappings: [LayerMapping; 2],
    overlap: bool,
}

impl FractalLayers {
    /// Lattice cells of the first octave of the coarse layer, per sheet width and height, for tongues of the default size.
    pub(crate) const COARSE_CELLS: [f64; 2] = [COARSE[0] * CELLS[0] as f64, COARSE[1] * CELLS[1] as f64];

    /// Layers whose tongues are `width` times as wide and `length` times as long as the default, and which rise at `speed` times the scroll speed;
    /// `key` determines their offsets.
    pub(crate) fn new([width, length]: [f64; 2], speed: f64, key: Key, clock: &Clock) -> Self {
        let start = key.uniforms(0, 0, Purpose::named("fractal layers")).map(f64::from);
        let coarse = LayerMapping {
            widths: COARSE[0],
            slant: 0.061_8,
            heights: COARSE[1],
            rate: 1.0,
            start: [start[0], start[1]],
        };
        let fine =
            LayerMapping { widths: -0.71, slant: -0.104_7, heights: 0.419, rate: 1.21, start: [start[2], start[3]] };
        Self { mappings: [coarse, fine].map(|mapping| mapping.fitted([width, length], speed, clock)), overlap: false }
    }

    /// The same layers, which overlap instead of being mixed if `overlap`.
    pub(crate) fn overlapping(self, overlap: bool) -> Self {
        Self { overlap, ..self }
    }

    /// The texture after `scroll` sheet heights; `table` is [`FRACTAL`] or a filtered copy of it.
    pub(crate) fn at(&self, table: &Arc<TextureTable>, scroll: f64) -> FlameTexture {
        let kind = if self.overlap { FlameTexture::Overlapping } else { FlameTexture::Mixed };
        kind(table.clone(), self.layers(scroll))
    }

    /// The mappings of both layers to their table after `scroll` sheet heights.
    pub(crate) fn layers(&self, scroll: f64) -> [TextureLayer; 2] {
        self.mappings.map(|mapping| mapping.after(scroll))
    }

    /// Texels per sheet height, of the finer layer.
    pub(crate) fn texels_up(&self) -> f64 {
        ROWS as f64 * self.mappings[1].heights
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{math::simd::Lanes, parameters::animated::Animated};
    use fearless_simd::prelude::*;

    use super::*;

    fn layers(loop_s: Option<f64>) -> (FractalLayers, Clock) {
        let clock = Clock::new(Animated::from(1.1), loop_s);
        (FractalLayers::new([1.0, 1.0], 1.0, Key::new(3, "test"), &clock), clock)
    }

    /// 16 x 24 samples of the sheet at time `t`.
    fn picture(layers: &FractalLayers, clock: &Clock, t: f64) -> Vec<f32> {
        let texture = layers.at(&FRACTAL, clock.scroll(t));
        bansho_base::dispatch_baseline!(simd => {
            let u = Lanes::from_fn(simd, |i| i as f32 / 15.0);
            (0..24).flat_map(|j| texture.sample(u, u.broadcast(j as f32 / 23.0)).as_slice().to_vec()).collect()
        })
    }

    fn correlation(a: &[f32], b: &[f32]) -> f32 {
        let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
        let (mean_a, mean_b) = (mean(a), mean(b));
        let dot =
            |x: &[f32], y: &[f32], mx: f32, my: f32| x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum::<f32>();
        dot(a, b, mean_a, mean_b) / (dot(a, a, mean_a, mean_a) * dot(b, b, mean_b, mean_b)).sqrt()
    }

    #[test]
    fn every_value_is_as_frequent_as_every_other() {
        let mut counts = [0_usize; 10];
        let (layers, clock) = layers(None);
        for second in 0..400 {
            for value in picture(&layers, &clock, f64::from(second) * 1.37) {
                assert!((0.0..=1.0).contains(&value));
                counts[((value * 10.0) as usize).min(9)] += 1;
            }
        }
        let total: usize = counts.iter().sum();
        for count in counts {
            let frequency = count as f64 / total as f64;
            assert!((0.06..0.15).contains(&frequency), "{counts:?}");
        }
    }

    #[test]
    fn nothing_repeats_within_ten_minutes() {
        let (layers, clock) = layers(None);
        let first = picture(&layers, &clock, 100.0);
        assert!(correlation(&first, &picture(&layers, &clock, 100.005)) > 0.9);
        let mut worst = -1.0_f32;
        for step in 0..12_000 {
            let t = 101.5 + 0.05 * f64::from(step);
            worst = worst.max(correlation(&first, &picture(&layers, &clock, t)));
        }
        assert!(worst < 0.85, "{worst}");
    }

    #[test]
    fn a_loop_closes_whatever_its_length() {
        for length in [1.0, 2.4, 4.0, 7.3] {
            let (layers, clock) = layers(Some(length));
            let before = picture(&layers, &clock, 0.3);
            let after = picture(&layers, &clock, 0.3 + length);
            let value = |t: f64| {
                let texture = layers.at(&FRACTAL, clock.scroll(t));
                bansho_base::dispatch_baseline!(simd => texture.sample(Lanes::splat(simd, 0.3), Lanes::splat(simd, 0.3))[0])
            };
            let (just_short, start) = (value(length * (1.0 - 1e-9)), value(0.0));
            assert!((just_short - start).abs() < 1e-3, "{length}: {just_short} {start}");
            before.iter().zip(&after).for_each(|(a, b)| assert!((a - b).abs() < 1e-3));
        }
    }
}
