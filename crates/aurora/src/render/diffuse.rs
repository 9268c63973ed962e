//! The diffuse aurora: a weak, structureless glow over tens of kilometers on both sides of the sheets, which nearly every photograph of an aurora shows.
//!
//! Its electrons come from the same region as those of the sheets, scattered by waves (Lui et al. 1973; Nishimura et al. 2020), so its place follows that of
//! the sheets: their power on a coarse grid, blurred to the width of the diffuse aurora, with patches that come and go. It has no state: a frame needs only
//! the particles of its time.

use bansho_base::{
    math::{
        self,
        random::{Key, Purpose},
    },
    noise::{Coordinate, Fractal, Noise},
};

use crate::{
    DiffuseParameters,
    render::cloud_in_cell::CloudInCellGrid,
    simulate::{AuroraParticles, afterglow::AfterglowCell},
};

/// Width of a cell, and of the light of a cell (standard deviation), relative to the width of the diffuse aurora. Cells are 1.33 of their spread apart, so that
/// their sum is even within 1 %.
const CELL: f64 = 0.8;
const CELL_SPREAD: f64 = 0.6;
/// Largest number of cells per side; for a narrower aurora in a large square cells are wider.
const MAX_SIDE: f64 = 512.0;
/// Half-width of the kernel of the blur in standard deviations.
const KERNEL_REACH: f64 = 3.0;
/// Cells with less than this fraction of the power of the strongest are left out.
const NEGLIGIBLE: f32 = 3e-3;
/// Octaves of the patches.
const PATCHES: Fractal = Fractal { octaves: 3, lacunarity: 2, gain: 0.6 };

/// The generator of the diffuse aurora.
#[derive(Clone, Debug)]
pub(crate) struct DiffuseAurora {
    parameters: DiffuseParameters,
    noise: Noise<3>,
    /// Standard deviation of the noise.
    deviation: f64,
    grid: CloudInCellGrid,
    /// Weights of the blur, from its middle outward; normalized over both sides.
    kernel: Vec<f32>,
}

impl DiffuseAurora {
    /// For a drawn square of side `extent_km`.
    pub(crate) fn new(parameters: &DiffuseParameters, extent_km: f64, key: Key) -> Self {
        let [seed, ..] = key.words(0, 0, Purpose::named("diffuse aurora"));
        let noise = Noise::new(seed, PATCHES, [0; 3]).expect("few octaves without a period are noise");
        let width_km = parameters.width_km;
        let reach_km = (KERNEL_REACH + CELL) * width_km;
        let whole_km = extent_km + 2.0 * reach_km;
        let cell_km = (CELL * width_km).max(whole_km / MAX_SIDE);
        // What is left of the width beside that of a cell's light and that of sharing a particle among cells, a triangle of a cell's width to each side.
        let spread_km = CELL_SPREAD * width_km;
        let blur_variance = width_km * width_km - spread_km * spread_km - cell_km * cell_km / 6.0;
        let blur_cells = math::sqrt(blur_variance.max(0.0)).max(0.1 * cell_km) / cell_km;
        let reach = (KERNEL_REACH * blur_cells).ceil() as usize;
        let mut kernel: Vec<f64> = Vec::with_capacity(reach + 1);
        for offset in 0..=reach {
            let distance = offset as f64 / blur_cells;
            kernel.push(math::exp(-0.5 * distance * distance));
        }
        let total = 2.0 * kernel.iter().sum::<f64>() - kernel[0];
        Self {
            parameters: parameters.clone(),
            noise,
            deviation: PATCHES.standard_deviation(3),
            grid: CloudInCellGrid { cell_km, side: (whole_km / cell_km).ceil() as usize },
            kernel: kernel.into_iter().map(|weight| (weight / total) as f32).collect(),
        }
    }

    /// Standard deviation of the light of a cell, km.
    pub(crate) fn cell_spread_km(&self) -> f64 {
        CELL_SPREAD * self.parameters.width_km
    }

    /// The cells that shine beside these particles at a time in s.
    pub(crate) fn cells(&self, particles: &AuroraParticles, time: f64) -> Vec<AfterglowCell<1>> {
        if self.parameters.fraction <= 0.0 {
            return Vec::new();
        }
        let sums = self.blurred(&self.grid.deposit(&particles.positions, particles.powers_w.iter().copied()));
        let strongest = sums.iter().copied().fold(0.0, f32::max);
        let mut cells = Vec::new();
        for (index, sum) in sums.into_iter().enumerate() {
            if sum <= NEGLIGIBLE * strongest {
                continue;
            }
            let [east, south] = self.grid.middle_km(index);
            cells.push(AfterglowCell {
                cell_index: index as u32,
                position_km: [east as f32, south as f32],
                powers_w: [sum * self.patch([east, south], time) as f32],
                energy_ev: self.parameters.energy_ev as f32,
            });
        }
        cells
    }

    /// The sums times the fraction, blurred along rows and columns.
    fn blurred(&self, sums: &[f32]) -> Vec<f32> {
        let (mut along_rows, mut blurred) = (vec![0.0; sums.len()], vec![0.0; sums.len()]);
        let fraction = self.parameters.fraction as f32;
        for (from, to) in sums.chunks(self.grid.side).zip(along_rows.chunks_mut(self.grid.side)) {
            for (column, power) in from.iter().enumerate().filter(|(_, power)| **power > 0.0) {
                for (offset, weight) in self.kernel.iter().enumerate() {
                    let share = fraction * weight * power;
                    if column + offset < self.grid.side {
                        to[column + offset] += share;
                    }
                    if offset > 0 && column >= offset {
                        to[column - offset] += share;
                    }
                }
            }
        }
        for (row, from) in along_rows.chunks(self.grid.side).enumerate() {
            if from.iter().all(|power| *power == 0.0) {
                continue;
            }
            for (offset, weight) in self.kernel.iter().enumerate() {
                let above = (offset > 0).then(|| row.checked_sub(offset)).flatten();
                let below = (row + offset < self.grid.side).then_some(row + offset);
                for to in above.into_iter().chain(below) {
                    let to = &mut blurred[to * self.grid.side..][..self.grid.side];
                    to.iter_mut().zip(from).for_each(|(sum, power)| *sum += weight * power);
                }
            }
        }
        blurred
    }

    /// Factor of the power of a position, with a mean of 1.
    fn patch(&self, position_km: [f64; 2], time: f64) -> f64 {
        let DiffuseParameters { contrast, patch_km, lifetime_s, .. } = self.parameters;
        if contrast <= 0.0 {
            return 1.0;
        }
        let [east, south] = position_km.map(|km| Coordinate::from_f64(km / patch_km));
        let noise = f64::from(self.noise.at([east, south, Coordinate::from_f64(time / lifetime_s)])) / self.deviation;
        math::exp(contrast * noise - 0.5 * contrast * contrast)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet of 200 km from west to east, of 1000 particles of 3 W.
    fn particles() -> AuroraParticles {
        AuroraParticles {
            positions: [(0..1000).map(|index| 0.2 * index as f32 - 100.0).collect(), vec![-20.0; 1000]],
            powers_w: vec![3.0; 1000],
            ..AuroraParticles::default()
        }
    }

    fn diffuse(parameters: DiffuseParameters) -> DiffuseAurora {
        DiffuseAurora::new(&parameters, 600.0, Key::new(3, "diffuse"))
    }

    fn power(cells: &[AfterglowCell<1>]) -> f64 {
        cells.iter().map(|cell| f64::from(cell.powers_w[0])).sum()
    }

    #[test]
    fn it_has_its_fraction_of_the_power_and_its_width() {
        for (width_km, fraction) in [(20.0, 0.4), (60.0, 1.5)] {
            let diffuse =
                diffuse(DiffuseParameters { width_km, fraction, contrast: 0.0, ..DiffuseParameters::default() });
            let cells = diffuse.cells(&particles(), 1.0);
            assert!((power(&cells) / (3000.0 * fraction) - 1.0).abs() < 0.02, "{}", power(&cells));
            let [mut sum, mut squares] = [0.0; 2];
            for cell in &cells {
                let (offset, power) = (f64::from(cell.position_km[1]) + 20.0, f64::from(cell.powers_w[0]));
                sum += power * offset;
                squares += power * offset * offset;
            }
            let own = diffuse.cell_spread_km();
            let width = (squares / power(&cells) + own * own).sqrt();
            assert!((sum / power(&cells)).abs() < 0.1 && (width / width_km - 1.0).abs() < 0.06, "{width}");
        }
        let none = diffuse(DiffuseParameters { fraction: 0.0, ..DiffuseParameters::default() });
        assert_eq!(none.cells(&particles(), 1.0), []);
    }

    #[test]
    fn patches_vary_by_their_contrast_and_keep_the_power() {
        let parameters = DiffuseParameters { contrast: 0.5, patch_km: 30.0, ..DiffuseParameters::default() };
        let diffuse = diffuse(parameters);
        let mut logarithms = Vec::new();
        for step in 0..4000 {
            let position = [f64::from(step % 63) * 11.0, f64::from(step / 63) * 13.0];
            logarithms.push(math::ln(diffuse.patch(position, f64::from(step) * 7.0)));
        }
        let mean = logarithms.iter().sum::<f64>() / 4000.0;
        let variance = logarithms.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / 4000.0;
        assert!((variance.sqrt() / 0.5 - 1.0).abs() < 0.12, "{}", variance.sqrt());
        let factor = logarithms.iter().map(|value| math::exp(*value)).sum::<f64>() / 4000.0;
        assert!((factor - 1.0).abs() < 0.06, "{factor}");
    }

    #[test]
    fn moving_particles_change_it_smoothly() {
        let diffuse = diffuse(DiffuseParameters { width_km: 10.0, contrast: 0.0, ..DiffuseParameters::default() });
        let mut moved = particles();
        let mut before = diffuse.cells(&moved, 0.0);
        for _ in 0..20 {
            moved.positions[1].iter_mut().for_each(|south| *south += 0.5);
            let after = diffuse.cells(&moved, 0.0);
            let powers = |cells: &[AfterglowCell<1>]| -> std::collections::BTreeMap<u32, f32> {
                cells.iter().map(|cell| (cell.cell_index, cell.powers_w[0])).collect()
            };
            let (old, new) = (powers(&before), powers(&after));
            let change: f32 = new.iter().map(|(index, power)| (power - old.get(index).unwrap_or(&0.0)).abs()).sum();
            assert!(f64::from(change) < 0.08 * power(&after), "{change}");
            before = after;
        }
    }
}
