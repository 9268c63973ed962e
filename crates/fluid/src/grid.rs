//! The staggered grid and the layout of its fields in memory.

use bansho_base::math::{DVec3, simd::LANES};

/// Layers of ghost cells on every side of a field, as many as the reconstruction at a face reaches beyond it.
pub const GHOST_LAYERS: usize = 2;

/// A box of cubic cells. Scalars are at the centers of cells, component `a` of the velocity at the centers of the faces that are normal to axis `a` (Harlow and
/// Welch 1965): face `i` is between the cells `i - 1` and `i`.
///
/// In memory x varies fastest, then z, then y, so that a horizontal layer is contiguous: layers are the tasks of threads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Number of cells along x, y and z. The number along x is a multiple of [`LANES`], that along z is even.
    pub size: [usize; 3],
    /// Side of a cell, m.
    pub spacing: f64,
    /// The corner with the smallest coordinates, m.
    pub origin: DVec3,
}

impl Grid {
    /// The grid of at least `size` cells of side `spacing` (m) whose corner with the smallest coordinates is `origin`. The number of cells along x is raised to a
    /// multiple of [`LANES`], that along z to an even number, both to products of small primes, whose Fourier transforms are fast.
    #[must_use]
    pub fn new(size: [usize; 3], spacing: f64, origin: DVec3) -> Self {
        let [x, y, z] = size.map(|cells| cells.max(4));
        Self { size: [transformable(x, LANES), y, transformable(z, 2)], spacing, origin }
    }

    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.size.iter().product()
    }

    /// Distance in memory between neighbors along x, y and z.
    #[must_use]
    pub fn strides(&self) -> [usize; 3] {
        let row = self.size[0] + 2 * GHOST_LAYERS;
        [1, row * (self.size[2] + 2 * GHOST_LAYERS), row]
    }

    /// Number of values of a field, with its ghost cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.strides()[1] * (self.size[1] + 2 * GHOST_LAYERS)
    }

    /// Whether the grid has no cell. It never has none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cells() == 0
    }

    /// Place in memory of cell (x, y, z), and of its faces with the smaller coordinate.
    #[must_use]
    #[inline(always)]
    pub fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        let [_, plane, row] = self.strides();
        (y + GHOST_LAYERS) * plane + (z + GHOST_LAYERS) * row + x + GHOST_LAYERS
    }

    /// Center of a cell, m.
    #[must_use]
    pub fn center(&self, cell: [usize; 3]) -> DVec3 {
        self.origin + DVec3::from(cell.map(|index| (index as f64 + 0.5) * self.spacing))
    }

    /// Center of the face of a cell with the smaller coordinate along `axis`, m.
    #[must_use]
    pub fn face_center(&self, axis: usize, cell: [usize; 3]) -> DVec3 {
        let mut center = self.center(cell);
        center[axis] -= 0.5 * self.spacing;
        center
    }

    /// The corner with the largest coordinates, m.
    #[must_use]
    pub fn far_corner(&self) -> DVec3 {
        self.origin + DVec3::from(self.size.map(|cells| cells as f64 * self.spacing))
    }

    /// A point in cells from the corner with the smallest coordinates.
    #[must_use]
    pub fn point_in_cells(&self, point: DVec3) -> DVec3 {
        (point - self.origin) / self.spacing
    }

    /// The cells that share a face with a cell.
    pub(crate) fn neighbors(&self, cell: [usize; 3]) -> impl Iterator<Item = [usize; 3]> + use<> {
        let size = self.size;
        (0..6).filter_map(move |number| {
            let (axis, mut near) = (number / 2, cell);
            near[axis] = if number % 2 == 0 { cell[axis].checked_sub(1)? } else { cell[axis] + 1 };
            (near[axis] < size[axis]).then_some(near)
        })
    }

    /// The rows of a layer of cells: for each, its z and the place of its first cell.
    pub fn rows(&self, y: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
        let grid = *self;
        (0..grid.size[2]).map(move |z| (z, grid.index([0, y, z])))
    }
}

/// The least multiple of `step` from `count` on that has no prime factor above 7.
fn transformable(count: usize, step: usize) -> usize {
    let is_smooth = |count: &usize| {
        let mut rest = *count;
        for factor in [2, 3, 5, 7] {
            while rest.is_multiple_of(factor) {
                rest /= factor;
            }
        }
        rest == 1
    };
    (count.div_ceil(step)..).map(|times| times * step).find(is_smooth).unwrap_or(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_products_of_small_primes() {
        assert_eq!([1, 17, 169, 175, 200].map(|x| transformable(x, 16)), [16, 32, 192, 192, 224]);
        assert_eq!([4, 75, 76, 89, 97].map(|z| transformable(z, 2)), [4, 80, 80, 90, 98]);
    }

    #[test]
    fn neighbors_are_a_stride_apart() {
        let grid = Grid::new([20, 5, 7], 0.1, DVec3::new(-1.0, 0.0, 2.0));
        assert_eq!(grid.size, [32, 5, 8]);
        let [right, above, behind] = grid.strides();
        let here = grid.index([3, 2, 4]);
        assert_eq!(
            [grid.index([4, 2, 4]), grid.index([3, 3, 4]), grid.index([3, 2, 5])],
            [here + right, here + above, here + behind]
        );
        assert_eq!(grid.index([31, 4, 7]) + 2 * (right + above + behind), grid.len() - 1);
        assert!((grid.center([0, 0, 0]) - DVec3::new(-0.95, 0.05, 2.05)).length() < 1e-12);
        assert!((grid.point_in_cells(grid.center([3, 1, 2])) - DVec3::new(3.5, 1.5, 2.5)).length() < 1e-9);
    }
}
