//! A two-dimensional grid of square cells.

/// Cell-centered values; 0 outside.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid2 {
    layout: GridLayout,
    values: Vec<f64>,
}

/// Geometry of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
struct GridLayout {
    size: [usize; 2],
    spacing: f64,
    origin: [f64; 2],
}

impl GridLayout {
    /// Cell below a position on each axis, by cell centers, and the interpolation fractions toward the next.
    ///
    /// Positions are clamped to one ghost cell around the grid.
    fn split(&self, position: [f64; 2]) -> ([isize; 2], [f64; 2]) {
        let at: [f64; 2] = std::array::from_fn(|c| {
            let cells = (position[c] - self.origin[c]) / self.spacing - 0.5;
            cells.max(-1.0).min(self.size[c] as f64)
        });
        let whole = at.map(f64::floor);
        (whole.map(|cell| cell as isize), [at[0] - whole[0], at[1] - whole[1]])
    }
}

impl Grid2 {
    /// A grid of zeros with `size` columns and rows and its lower corner at `origin`; `spacing` is the cell width,
    /// above 0.
    #[must_use]
    pub fn new(size: [usize; 2], spacing: f64, origin: [f64; 2]) -> Self {
        Self { layout: GridLayout { size, spacing, origin }, values: vec![0.0; size[0] * size[1]] }
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        self.layout.size
    }

    /// Width of a cell.
    #[must_use]
    pub fn spacing(&self) -> f64 {
        self.layout.spacing
    }

    /// Lower corner of the first cell.
    #[must_use]
    pub fn origin(&self) -> [f64; 2] {
        self.layout.origin
    }

    /// All values, row by row.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// All values, row by row.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// Value of a cell; 0 in the ghost cells outside.
    #[must_use]
    pub fn at(&self, column: isize, row: isize) -> f64 {
        let [columns, rows] = self.layout.size;
        let inside = (0..columns as isize).contains(&column) && (0..rows as isize).contains(&row);
        if inside { self.values[row as usize * columns + column as usize] } else { 0.0 }
    }

    /// Column and row of the cell at a position, if inside.
    #[must_use]
    pub fn cell(&self, position: [f64; 2]) -> Option<[usize; 2]> {
        let GridLayout { size, spacing, origin } = self.layout;
        let cell: [f64; 2] = std::array::from_fn(|c| ((position[c] - origin[c]) / spacing).floor());
        let inside = (0..2).all(|c| (0.0..size[c] as f64).contains(&cell[c]));
        inside.then(|| cell.map(|cell| cell as usize))
    }

    /// Index into [`values`](Self::values) of the cell at a position, if inside.
    #[must_use]
    pub fn index(&self, position: [f64; 2]) -> Option<usize> {
        self.cell(position).map(|[column, row]| row * self.layout.size[0] + column)
    }

    /// Bilinear interpolation between cell centers.
    #[must_use]
    pub fn sample(&self, position: [f64; 2]) -> f64 {
        let ([i, j], [s, t]) = self.layout.split(position);
        let lower = s.mul_add(self.at(i + 1, j) - self.at(i, j), self.at(i, j));
        let upper = s.mul_add(self.at(i + 1, j + 1) - self.at(i, j + 1), self.at(i, j + 1));
        t.mul_add(upper - lower, lower)
    }

    /// Gradient at cell centers by central differences: (2.8) and (2.9) of the thesis without their sign.
    #[must_use]
    pub fn gradient(&self) -> Gradient2 {
        let [columns, rows] = self.layout.size;
        let half = 0.5 / self.layout.spacing;
        let mut values = Vec::with_capacity(columns * rows);
        for j in 0..rows as isize {
            for i in 0..columns as isize {
                let [along_x, along_z] = [self.at(i + 1, j) - self.at(i - 1, j), self.at(i, j + 1) - self.at(i, j - 1)];
                values.push([half * along_x, half * along_z]);
            }
        }
        Gradient2 { layout: self.layout, values }
    }
}

/// Cell-centered gradient of a [`Grid2`].
#[derive(Clone, Debug, PartialEq)]
pub struct Gradient2 {
    layout: GridLayout,
    values: Vec<[f64; 2]>,
}

impl Gradient2 {
    /// Gradients, row by row.
    #[must_use]
    pub fn values(&self) -> &[[f64; 2]] {
        &self.values
    }

    /// The gradient in a cell; outside of the grid that in the nearest one.
    fn at(&self, column: isize, row: isize) -> [f64; 2] {
        let [columns, rows] = self.layout.size.map(|count| count as isize);
        let (column, row) = (column.clamp(0, columns - 1), row.clamp(0, rows - 1));
        self.values[(row * columns + column) as usize]
    }

    /// Bilinear interpolation between cell centers, clamped to the outermost.
    #[must_use]
    pub fn sample(&self, position: [f64; 2]) -> [f64; 2] {
        if self.values.is_empty() {
            return [0.0; 2];
        }
        let ([i, j], [s, t]) = self.layout.split(position);
        let (a, b, c, d) = (self.at(i, j), self.at(i + 1, j), self.at(i, j + 1), self.at(i + 1, j + 1));
        std::array::from_fn(|k| {
            let (lower, upper) = (s.mul_add(b[k] - a[k], a[k]), s.mul_add(d[k] - c[k], c[k]));
            t.mul_add(upper - lower, lower)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `2 x - 3 z + 5` on cells of 0.5 from (1, -2).
    fn plane() -> Grid2 {
        let mut grid = Grid2::new([6, 4], 0.5, [1.0, -2.0]);
        for index in 0..24 {
            let (x, z) = (1.25 + 0.5 * (index % 6) as f64, -1.75 + 0.5 * (index / 6) as f64);
            grid.values_mut()[index] = 2.0 * x - 3.0 * z + 5.0;
        }
        grid
    }

    #[test]
    fn a_plane_is_sampled_exactly() {
        let grid = plane();
        for [x, z] in [[1.25, -1.75], [2.0, -1.1], [3.75, -0.25], [2.9, -0.6]] {
            assert!((grid.sample([x, z]) - (2.0 * x - 3.0 * z + 5.0)).abs() < 1e-12, "{x} {z}");
        }
    }

    #[test]
    fn outside_is_nothing() {
        let grid = plane();
        assert_eq!(grid.sample([-100.0, -1.0]), 0.0);
        assert_eq!(grid.sample([2.0, f64::INFINITY]), 0.0);
        // Half way to the ghost cell on the left.
        assert!((grid.sample([1.0, -1.75]) - 0.5 * grid.at(0, 0)).abs() < 1e-12);
        assert_eq!((grid.at(-1, 0), grid.at(0, 4)), (0.0, 0.0));
        assert!(grid.sample([f64::NAN, 0.0]).is_finite());
    }

    #[test]
    fn gradient_of_a_plane_is_its_slope() {
        let gradient = plane().gradient();
        let [x, z] = gradient.sample([2.4, -1.0]);
        bansho_base::assert_measured!("equation (2.8): difference of the slope in x", x - 2.0, 0.0, 1e-12);
        bansho_base::assert_measured!("equation (2.9): difference of the slope in z", z + 3.0, 0.0, 1e-12);
        // By hand: between the ghost cell (0) and the second cell (2 * 1.75 + 3 * 1.75 + 5 = 13.75) over one unit.
        assert!((gradient.values()[0][0] - 13.75).abs() < 1e-12);
        assert_eq!(gradient.sample([-9.0, -9.0]), gradient.values()[0]);
        assert_eq!(Grid2::new([0, 0], 1.0, [0.0; 2]).gradient().sample([0.0; 2]), [0.0; 2]);
    }

    #[test]
    fn positions_map_to_cells() {
        let grid = plane();
        assert_eq!(grid.cell([1.0, -2.0]), Some([0, 0]));
        assert_eq!(grid.cell([3.99, -0.01]), Some([5, 3]));
        assert_eq!((grid.cell([4.0, -1.0]), grid.cell([2.0, -2.01]), grid.cell([f64::NAN, -1.0])), (None, None, None));
    }
}
