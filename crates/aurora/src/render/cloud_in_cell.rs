//! A coarse grid over the drawn square, on which values of the particles are summed: cloud in cell, the deposit of particle-mesh methods (Birdsall and Fuss 1969).

/// Square cells about the middle of the drawn square.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CloudInCellGrid {
    /// Width of a cell, km.
    pub(crate) cell_km: f64,
    /// Number of cells per side.
    pub(crate) side: usize,
}

impl CloudInCellGrid {
    /// Sums of values by cell, row by row. Each value is shared by the four cells nearest to its position (km, east and south), so that the sums change
    /// continuously as particles move, and their center of mass is that of the values.
    pub(crate) fn deposit(&self, [easts, souths]: &[Vec<f32>; 2], values: impl Iterator<Item = f32>) -> Vec<f32> {
        // In one thread, in order: the sum has the same bits whatever the threads, and a particle takes two nanoseconds.
        let mut sums = vec![0.0; self.side * self.side];
        let last = (self.side - 1) as f32;
        let middle = 0.5 * self.side as f32 - 0.5;
        let per_cell = (1.0 / self.cell_km) as f32;
        for ((east, south), value) in easts.iter().zip(souths).zip(values) {
            let x = (east * per_cell + middle).clamp(0.0, last);
            let y = (south * per_cell + middle).clamp(0.0, last);
            let (column, row) = ((x as usize).min(self.side - 2), (y as usize).min(self.side - 2));
            let (right, below) = (x - column as f32, y - row as f32);
            let at = row * self.side + column;
            sums[at] += value * (1.0 - right) * (1.0 - below);
            sums[at + 1] += value * right * (1.0 - below);
            sums[at + self.side] += value * (1.0 - right) * below;
            sums[at + self.side + 1] += value * right * below;
        }
        sums
    }

    /// Middle of a cell, km, east and south.
    pub(crate) fn middle_km(&self, index: usize) -> [f64; 2] {
        let first = 0.5 * self.side as f64 - 0.5;
        [index % self.side, index / self.side].map(|cell| (cell as f64 - first) * self.cell_km)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_and_centers_of_mass_are_those_of_the_values() {
        let grid = CloudInCellGrid { cell_km: 10.0, side: 9 };
        let (east, south, value) = (vec![-23.0, 14.0, 39.5], vec![40.0, -38.0, 0.0], [1.0, 2.5, 4.0_f32]);
        let sums = grid.deposit(&[east.clone(), south.clone()], value.into_iter());
        let (mut total, mut moment) = (0.0, [0.0; 2]);
        for (index, sum) in sums.iter().enumerate() {
            let [x, y] = grid.middle_km(index);
            total += f64::from(*sum);
            moment = [moment[0] + x * f64::from(*sum), moment[1] + y * f64::from(*sum)];
        }
        let expected =
            |place: &[f32]| place.iter().zip(value).map(|(place, value)| f64::from(place * value)).sum::<f64>();
        assert!((total - 7.5).abs() < 1e-5, "{total}");
        assert!(
            (moment[0] - expected(&east)).abs() < 1e-3 && (moment[1] - expected(&south)).abs() < 1e-3,
            "{moment:?}"
        );
    }
}
