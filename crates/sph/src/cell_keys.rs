//! Cells of particles, and the keys by which they are sorted.

use bansho_base::{host::parallel::prelude::*, math::approximations::round_to_i32};
use fearless_simd::dispatch;

use super::sorting::{MIN_PARTICLES_PER_TASK, ParticleKeys};

/// Cells along x per support radius. Short cells keep the candidate ranges of a row short.
pub(super) const CELLS_PER_RADIUS_X: i32 = 4;
/// Cell coordinates are clamped to this distance from the origin, in support radii, so that a key of three axes fits 64 bits.
const MAX_CELL_COORDINATE: i32 = 1 << 18;
/// Cells are larger than the support radius by this factor, so that rounding never separates two neighbors by more than one cell.
const CELL_SIZE_MARGIN: f32 = 1.001;

/// Cells along one axis.
#[derive(Clone, Copy, Debug)]
struct CellAxis {
    /// Cells per unit of length.
    scale: f32,
    max_coordinate: f32,
}

impl CellAxis {
    /// Cells along axis `c`, for a support radius.
    fn new(c: usize, support_radius: f32) -> Self {
        let along = if c == 0 { CELLS_PER_RADIUS_X } else { 1 };
        let scale = 1.0 / (support_radius * CELL_SIZE_MARGIN);
        Self { scale: scale * along as f32, max_coordinate: (MAX_CELL_COORDINATE * along) as f32 }
    }

    /// The cell that holds a coordinate; 0 for NaN. Neither a cast to `i32`, which saturates, nor, without SSE4.1, `floor` vectorizes.
    #[inline(always)]
    fn cell(&self, value: f32) -> i32 {
        let scaled = (value * self.scale).clamp(-self.max_coordinate, self.max_coordinate);
        let scaled = if scaled.is_nan() { 0.0 } else { scaled };
        let nearest = round_to_i32(scaled);
        nearest - i32::from(nearest as f32 > scaled)
    }

    /// First and last cell of some coordinates.
    #[inline(always)]
    fn bounds(&self, component: &[f32]) -> [i32; 2] {
        let (mut first, mut last) = (i32::MAX, i32::MIN);
        for value in component {
            let cell = self.cell(*value);
            (first, last) = (first.min(cell), last.max(cell));
        }
        [first, last]
    }

    /// Adds the bits of this axis to keys: the cells of coordinates, counted from `lower`, shifted to their place.
    #[inline(always)]
    fn add_to_keys(&self, component: &[f32], lower: i32, shift: u32, keys: &mut [u64]) {
        for (key, value) in keys.iter_mut().zip(component) {
            *key |= u64::from((self.cell(*value) - lower) as u32) << shift;
        }
    }
}

/// Packs cell coordinates into 64-bit keys, x in the lowest bits.
#[derive(Clone, Copy, Debug)]
pub(super) struct KeyLayout<const D: usize> {
    lower: [i32; D],
    shift: [u32; D],
    pub(super) bits: u32,
}

impl<const D: usize> KeyLayout<D> {
    /// For cells from the first to the last of each axis, with a margin of one support radius on each side.
    pub(super) fn new(bounds: &[[i32; 2]; D]) -> Self {
        let (mut lower, mut shift, mut bits) = ([0; D], [0; D], 0);
        for c in 0..D {
            let [first, last] = bounds[c];
            let margin = if c == 0 { CELLS_PER_RADIUS_X } else { 1 };
            shift[c] = bits;
            bits += u32::BITS - ((last - first + 2 * margin) as u32).leading_zeros();
            lower[c] = first - margin;
        }
        Self { lower, shift, bits }
    }

    /// Largest key in the row of a key: all bits of x are set.
    pub(super) fn last_of_row(&self, key: u64) -> u64 {
        key | ((1 << self.shift[1]) - 1)
    }

    /// First key of the row of a key.
    pub(super) fn first_of_row(&self, key: u64) -> u64 {
        key >> self.shift[1] << self.shift[1]
    }

    /// Key offsets to the cell of the same x in each neighboring row; wrapping.
    pub(super) fn rows(&self) -> impl Iterator<Item = u64> {
        let shift = self.shift;
        (0..3_usize.pow(D as u32 - 1)).map(move |row| {
            (1..D).fold(0, |sum: u64, c| {
                let step = row / 3_usize.pow(c as u32 - 1) % 3;
                sum.wrapping_add((step as u64).wrapping_sub(1) << shift[c])
            })
        })
    }
}

/// The keys of particles.
pub(super) struct CellKeys<'a, const D: usize> {
    positions: [&'a [f32]; D],
    axes: [CellAxis; D],
    pub(super) layout: KeyLayout<D>,
}

impl<'a, const D: usize> CellKeys<'a, D> {
    /// The keys of particles, at least one, by cells for a support radius.
    pub(super) fn new(positions: [&'a [f32]; D], support_radius: f32) -> Self {
        let axes = std::array::from_fn(|c| CellAxis::new(c, support_radius));
        let mut bounds = [[0; 2]; D];
        for c in 0..D {
            bounds[c] = bounds_of(&axes[c], positions[c]);
        }
        Self { positions, axes, layout: KeyLayout::new(&bounds) }
    }
}

/// First and last cell of some coordinates, at least one.
fn bounds_of(axis: &CellAxis, component: &[f32]) -> [i32; 2] {
    let level = bansho_base::math::simd::level();
    let bounds = component.par_chunks(MIN_PARTICLES_PER_TASK).map(|part| dispatch!(level, _simd => axis.bounds(part)));
    bounds.reduce_with(|[a, b], [c, d]| [a.min(c), b.max(d)]).unwrap_or_default()
}

impl<const D: usize> ParticleKeys for CellKeys<'_, D> {
    fn bits(&self) -> u32 {
        self.layout.bits
    }

    fn key(&self, index: usize) -> u64 {
        let mut key = [0];
        for c in 0..D {
            let component = &self.positions[c][index..=index];
            self.axes[c].add_to_keys(component, self.layout.lower[c], self.layout.shift[c], &mut key);
        }
        key[0]
    }

    fn write_keys(&self, first: usize, keys: &mut [u64]) {
        let level = bansho_base::math::simd::level();
        keys.fill(0);
        for c in 0..D {
            let component = &self.positions[c][first..first + keys.len()];
            let (axis, lower, shift) = (&self.axes[c], self.layout.lower[c], self.layout.shift[c]);
            dispatch!(level, _simd => axis.add_to_keys(component, lower, shift, keys));
        }
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math::random::{Key, Purpose};

    use super::*;

    #[test]
    fn cells_are_rounded_down_to_integers_and_clamped() {
        let axis = CellAxis { scale: 2.0, max_coordinate: 1_048_576.0 };
        let (most, below_one) = (1 << 20, 1.0_f32.next_down());
        for (scaled, cell) in [
            (0.0, 0),
            (-0.0, 0),
            (0.5, 0),
            (below_one, 0),
            (1.0, 1),
            (1.5, 1),
            (2.5, 2),
            (-1e-30, -1),
            (-0.5, -1),
            (-1.0, -1),
            (-1.5, -2),
            (-below_one, -1),
            (-1.000_000_1, -2),
            (1_048_575.94, most - 1),
            (1_048_576.0, most),
            (1e30, most),
            (f32::INFINITY, most),
            (-1e30, -most),
            (f32::NEG_INFINITY, -most),
            (f32::NAN, 0),
        ] {
            assert_eq!(axis.cell(scaled / 2.0), cell, "{scaled}");
        }
    }

    #[test]
    fn keys_written_together_are_those_of_each_particle_and_ordered_like_cells_by_z_then_y_then_x() {
        let key = Key::new(3, "cell keys");
        let mut positions = [const { Vec::new() }; 3];
        for id in 0..1000 {
            let uniforms = key.uniforms(id, 0, Purpose(1));
            positions.iter_mut().zip(uniforms).for_each(|(values, uniform)| values.push(20.0 * uniform - 10.0));
        }
        let keys = CellKeys::new(positions.each_ref().map(Vec::as_slice), 1.5);
        let mut written = vec![0; 900];
        keys.write_keys(100, &mut written);
        let mut particles: Vec<usize> = (100..1000).collect();
        assert!(particles.iter().all(|index| written[index - 100] == keys.key(*index)));
        assert!(written.iter().all(|key| *key < 1 << keys.layout.bits));
        particles.sort_by_key(|index| keys.key(*index));
        let cells = |index: usize| [2, 1, 0].map(|c| CellAxis::new(c, 1.5).cell(positions[c][index]));
        assert!(particles.is_sorted_by_key(|index| cells(*index)));
        for pair in particles.windows(2) {
            let [one, other] = [pair[0], pair[1]].map(|index| keys.layout.first_of_row(keys.key(index)));
            assert_eq!(one == other, cells(pair[0])[..2] == cells(pair[1])[..2]);
        }
    }
}
