//! Afterglow of the green and the red line, on maps of the plane at 100 km altitude.
//!
//! Blue and violet light is prompt. O(1S) has a lifetime of 0.8 s and O(1D) of up to two minutes, shorter at low
//! altitudes because of quenching. So green light lags slightly behind a moving sheet, and red light stays behind.
//! A map is sparse, and the power of each of its cells relaxes toward that of the particles in it.

use bansho_base::{
    host::{parallel, parallel::prelude::*},
    math,
};

use super::AuroraParticles;
use crate::physics::{
    emission::{Emission, SpectralEmitter, quenching::RED_ALTITUDES},
    precipitation::energy_grid::{NODES, node_coordinate, node_energy_ev},
};

/// Green cells per cell of the field.
const GREEN_FINENESS: f64 = 8.0;

/// Decay factors of both maps.
#[derive(Clone, Debug)]
pub(crate) struct AfterglowDecay {
    green: DecayFactors<1>,
    red: DecayFactors<RED_ALTITUDES>,
}

impl AfterglowDecay {
    /// For a step in s of the aurora's time; lifetimes are from `emission`.
    pub(crate) fn new(emission: &Emission, seconds: f64) -> Self {
        let green = SpectralEmitter::OxygenGreen.index();
        Self {
            green: DecayFactors::new(seconds, |energy_ev| [emission.column(energy_ev).lifetime[green]]),
            red: DecayFactors::new(seconds, |energy_ev| emission.red_lifetimes(energy_ev)),
        }
    }
}

/// The maps of both slow emitters.
#[derive(Clone, Debug, PartialEq)]
pub struct Afterglow {
    /// O(1S), 557.7 nm: cells an eighth as wide as the field's.
    pub green: AfterglowMap<1>,
    /// O(1D), 630.0 and 636.4 nm, by altitude: cells as wide as the field's.
    pub red: AfterglowMap<RED_ALTITUDES>,
}

impl Afterglow {
    /// Empty maps of a square of side `extent_km` whose field has cells of `cell_km`.
    #[must_use]
    pub fn new(extent_km: f64, cell_km: f64) -> Self {
        Self {
            green: AfterglowMap::new(extent_km, cell_km / GREEN_FINENESS),
            red: AfterglowMap::new(extent_km, cell_km),
        }
    }

    /// Advances both maps by one step.
    pub(crate) fn step(&mut self, particles: &AuroraParticles, decay: &AfterglowDecay) {
        parallel::join(|| self.green.step(particles, &decay.green), || self.red.step(particles, &decay.red));
    }

    /// Sets the maps to the steady state of `particles`.
    pub(crate) fn fill_steady_state(&mut self, particles: &AuroraParticles) {
        self.green.step(particles, &DecayFactors::instantaneous());
        self.red.step(particles, &DecayFactors::instantaneous());
    }
}

/// Cells per tile side.
const TILE_SIDE: usize = 8;
const TILE_CELLS: usize = TILE_SIDE * TILE_SIDE;
/// A tile is freed if no cell has as much power as this flux, mW/m^2, would add in a step: a tenth of a rayleigh.
const DARK_MW_PER_M2: f64 = 2e-4;
/// W for one mW/m^2 on one km^2.
const W_PER_KM2: f64 = 1e3;
const NO_TILE: u32 = u32::MAX;
/// Maximum width of merged blocks relative to the spread of their light.
const BLOCK_PER_SPREAD: f64 = 1.1;
/// Minimum number of particles per task.
const TASK: usize = 4096;
/// Tiles per task.
const TILES_PER_TASK: usize = 256;

/// A non-zero cell, or a block of merged cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AfterglowCell<const ALTITUDES: usize> {
    /// Row-major index of the cell, for a block of its first cell.
    pub cell_index: u32,
    /// Its center, for a block the centroid of its light, km: x east, z south.
    pub position_km: [f32; 2],
    /// Power per altitude, W: that of steady precipitation with the same light.
    pub powers_w: [f32; ALTITUDES],
    /// Power-weighted mean electron energy, eV.
    pub energy_ev: f32,
}

#[derive(Clone, Debug, PartialEq)]
struct Tile<const ALTITUDES: usize> {
    tile_position: u32,
    powers: [[f32; ALTITUDES]; TILE_CELLS],
    /// Power times energy, W eV.
    weighted: [[f32; ALTITUDES]; TILE_CELLS],
}

/// Decay factor of a cell's power per step, by electron energy.
#[derive(Clone, Debug)]
pub(super) struct DecayFactors<const ALTITUDES: usize> {
    /// By node of the energy grid.
    nodes: Vec<[f32; ALTITUDES]>,
}

impl<const ALTITUDES: usize> DecayFactors<ALTITUDES> {
    /// For a step in s and lifetimes in s by energy and altitude.
    pub(super) fn new(seconds: f64, lifetimes: impl Fn(f64) -> [f64; ALTITUDES]) -> Self {
        let mut nodes = vec![[0.0; ALTITUDES]; NODES];
        for (node, factors) in nodes.iter_mut().enumerate() {
            for (factor, lifetime) in factors.iter_mut().zip(lifetimes(node_energy_ev(node))) {
                if lifetime > 0.0 {
                    *factor = math::exp(-seconds / lifetime) as f32;
                }
            }
        }
        Self { nodes }
    }

    /// Decay to 0 in one step: the light follows the power at once.
    pub(super) fn instantaneous() -> Self {
        Self { nodes: vec![[0.0; ALTITUDES]; NODES] }
    }

    fn of(&self, energy_ev: f32) -> [f32; ALTITUDES] {
        self.nodes[((node_coordinate(energy_ev) + 0.5) as usize).min(NODES - 1)]
    }
}

impl<const ALTITUDES: usize> Tile<ALTITUDES> {
    const CELL: [f32; ALTITUDES] = [0.0; ALTITUDES];

    fn new(position: u32) -> Self {
        Self { tile_position: position, powers: [Self::CELL; TILE_CELLS], weighted: [Self::CELL; TILE_CELLS] }
    }

    /// Power-weighted mean electron energy, eV.
    fn energy_ev(&self) -> f32 {
        let [weighted, power] = [&self.weighted, &self.powers].map(|values| values.as_flattened().iter().sum::<f32>());
        weighted / power.max(f32::MIN_POSITIVE)
    }

    /// Applies the decay of one step. Returns the gain of the particles' power, and whether the tile is dark: no cell has as
    /// much power as `dark_w` would add.
    fn fade(&mut self, decay: &DecayFactors<ALTITUDES>, dark_w: f32) -> ([f32; ALTITUDES], bool) {
        // One factor for the whole tile, so that the loop below multiplies vectors by a constant.
        let decay_factors = decay.of(self.energy_ev());
        for values in self.powers.iter_mut().chain(&mut self.weighted) {
            for (value, factor) in values.iter_mut().zip(decay_factors) {
                *value *= factor;
            }
        }
        let gain = decay_factors.map(|factor| 1.0 - factor);
        let is_dark =
            self.powers.iter().all(|powers| powers.iter().zip(gain).all(|(power, gain)| *power < dark_w * gain));
        (gain, is_dark)
    }

    /// Sums of the powers and of their squares over cells and altitudes of all `tiles`.
    fn power_moments(tiles: &[Self]) -> [f64; 2] {
        let [mut sum, mut squares] = [0.0; 2];
        for power in tiles.iter().flat_map(|tile| tile.powers.as_flattened()) {
            let power = f64::from(*power);
            sum += power;
            squares += power * power;
        }
        [sum, squares]
    }
}

/// Power on square cells, stored in sparse tiles, once per altitude of the red line with its own lifetime.
///
/// Each cell relaxes toward the power of the particles in it, `dP/dt = (P_particles - P) / lifetime`: a steady sheet
/// shows its own power, and the light of one that has moved on fades. Diffusion of the excited atoms is applied later as a blur
/// ([`ColumnEmission::spread_km`](crate::physics::emission::ColumnEmission)). The lifetime is that of the local
/// mean energy, per tile of eight by eight cells: soft electrons emit at high altitudes, where it is long.
#[derive(Clone, Debug, PartialEq)]
pub struct AfterglowMap<const ALTITUDES: usize> {
    cell_km: f64,
    half_km: f64,
    /// Tiles per side.
    side: usize,
    /// Tile number by tile position, or [`NO_TILE`].
    numbers: Vec<u32>,
    tiles: Vec<Tile<ALTITUDES>>,
}

impl<const ALTITUDES: usize> AfterglowMap<ALTITUDES> {
    /// An empty map.
    pub(super) fn new(extent_km: f64, cell_km: f64) -> Self {
        let side = (extent_km / (cell_km * TILE_SIDE as f64)).ceil().max(1.0) as usize;
        Self { cell_km, half_km: extent_km / 2.0, side, numbers: vec![NO_TILE; side * side], tiles: Vec::new() }
    }

    /// Width of a cell, km.
    #[must_use]
    pub(crate) fn cell_km(&self) -> f64 {
        self.cell_km
    }

    /// All non-zero cells, in an order that does not depend on the number of threads.
    pub fn cells(&self) -> impl Iterator<Item = AfterglowCell<ALTITUDES>> + '_ {
        self.tiles.iter().flat_map(|tile| (0..TILE_CELLS).filter_map(|cell| self.cell(tile, cell)))
    }

    /// All cells with more than `min_relative_power` times the power of a typical cell, merged into blocks of `block` by `block`.
    pub(crate) fn bright_blocks(&self, min_relative_power: f32, block: usize) -> Vec<AfterglowCell<ALTITUDES>> {
        let min_power = min_relative_power * self.typical_w();
        self.blocks(block, |tile, cell| self.tiles[tile].powers[cell].iter().any(|power| *power > min_power))
    }

    /// Block side in cells that is still smooth after a blur with this standard deviation, km.
    pub(crate) fn block(&self, spread_km: f64) -> usize {
        [8, 4, 2].into_iter().find(|block| *block as f64 * self.cell_km <= BLOCK_PER_SPREAD * spread_km).unwrap_or(1)
    }

    /// Merges the `selected(tile, cell)` cells into blocks of `block` by `block`, a divisor of [`TILE_SIDE`].
    fn blocks(&self, block: usize, selected: impl Fn(usize, usize) -> bool + Sync) -> Vec<AfterglowCell<ALTITUDES>> {
        let tasks = self.tiles.par_chunks(TILES_PER_TASK).enumerate();
        let blocks: Vec<Vec<AfterglowCell<ALTITUDES>>> = tasks
            .map(|(task, tiles)| {
                let mut blocks = Vec::new();
                for (tile, number) in tiles.iter().zip(task * TILES_PER_TASK..) {
                    self.add_blocks_of_tile(tile, block, |cell| selected(number, cell), &mut blocks);
                }
                blocks
            })
            .collect();
        blocks.concat()
    }

    /// Appends the blocks of a tile's `selected(cell)` cells.
    fn add_blocks_of_tile(
        &self,
        tile: &Tile<ALTITUDES>,
        block: usize,
        selected: impl Fn(usize) -> bool,
        blocks: &mut Vec<AfterglowCell<ALTITUDES>>,
    ) {
        // Output index of each block.
        let mut numbers = [usize::MAX; TILE_CELLS];
        for cell in (0..TILE_CELLS).filter(|cell| selected(*cell)) {
            let Some(mut lit) = self.cell(tile, cell) else { continue };
            let [column, row] = self.column_and_row(tile, cell).map(|position| position / block * block);
            lit.cell_index = self.number_of([column, row]);
            // Blocks never reach into another tile, since their side divides that of a tile: a tile is merged without its neighbors.
            let block_number = &mut numbers[cell / TILE_SIDE / block * TILE_SIDE + cell % TILE_SIDE / block];
            if *block_number == usize::MAX {
                *block_number = blocks.len();
                blocks.push(lit);
            } else {
                blocks[*block_number] = AfterglowCell::merged_with(blocks[*block_number], lit);
            }
        }
    }

    /// Storage index of each particle's cell; out of range where there is no tile.
    fn cells_of(&self, particles: &AuroraParticles) -> Vec<u32> {
        let [xs, zs] = &particles.positions;
        let located = xs.par_iter().zip(zs).map(|(x, z)| self.locate([*x, *z]));
        // Saturates for `NO_TILE`.
        located
            .map(|(position, cell)| {
                self.numbers[position].saturating_mul(TILE_CELLS as u32).saturating_add(cell as u32)
            })
            .collect()
    }

    /// Power-weighted mean power of a cell, W, which is insensitive to many faint cells.
    fn typical_w(&self) -> f32 {
        // Fixed chunks, so that the sum does not depend on the number of threads.
        let partial_sums: Vec<[f64; 2]> = self.tiles.par_chunks(TILES_PER_TASK).map(Tile::power_moments).collect();
        let [sum, squares] =
            partial_sums.iter().fold([0.0; 2], |total, chunk| [total[0] + chunk[0], total[1] + chunk[1]]);
        (squares / f64::max(sum, f64::MIN_POSITIVE)) as f32
    }

    /// Total power per altitude, W.
    #[must_use]
    pub fn powers_w(&self) -> [f64; ALTITUDES] {
        self.cells().fold([0.0; ALTITUDES], |sum, cell| {
            std::array::from_fn(|height| sum[height] + f64::from(cell.powers_w[height]))
        })
    }

    /// Tile positions, and per tile the powers and the powers times energy of its cells.
    pub(crate) fn to_arrays(&self) -> (Vec<u32>, Vec<f32>) {
        let positions = self.tiles.iter().map(|tile| tile.tile_position).collect();
        let mut values = Vec::with_capacity(self.tiles.len() * 2 * TILE_CELLS * ALTITUDES);
        for tile in &self.tiles {
            values.extend_from_slice(tile.powers.as_flattened());
            values.extend_from_slice(tile.weighted.as_flattened());
        }
        (positions, values)
    }

    /// Inverse of [`Self::to_arrays`] for a map of this layout; `None` for inconsistent arrays.
    pub(crate) fn with_arrays(&self, positions: &[u32], values: &[f32]) -> Option<Self> {
        let cells = values.as_chunks::<ALTITUDES>().0;
        let (tiles, rest) = cells.as_chunks::<{ 2 * TILE_CELLS }>();
        if tiles.len() != positions.len() || !rest.is_empty() || cells.len() * ALTITUDES != values.len() {
            return None;
        }
        let mut map = Self { numbers: vec![NO_TILE; self.numbers.len()], tiles: Vec::new(), ..*self };
        for (position, values) in positions.iter().zip(tiles) {
            let number = map.numbers.get_mut(*position as usize).filter(|number| **number == NO_TILE)?;
            *number = map.tiles.len() as u32;
            let mut tile = Tile::new(*position);
            tile.powers.copy_from_slice(&values[..TILE_CELLS]);
            tile.weighted.copy_from_slice(&values[TILE_CELLS..]);
            map.tiles.push(tile);
        }
        Some(map)
    }

    /// Column and row of a cell in the map.
    fn column_and_row(&self, tile: &Tile<ALTITUDES>, cell: usize) -> [usize; 2] {
        let position = tile.tile_position as usize;
        [position % self.side * TILE_SIDE + cell % TILE_SIDE, position / self.side * TILE_SIDE + cell / TILE_SIDE]
    }

    /// Row-major index of a cell in the map.
    fn number_of(&self, [column, row]: [usize; 2]) -> u32 {
        (row * self.side * TILE_SIDE + column) as u32
    }

    /// Coordinate of the middle of a column or row, km.
    fn middle_km(&self, index: usize) -> f32 {
        ((index as f64 + 0.5) * self.cell_km - self.half_km) as f32
    }

    fn cell(&self, tile: &Tile<ALTITUDES>, cell: usize) -> Option<AfterglowCell<ALTITUDES>> {
        let powers_w = tile.powers[cell];
        let whole: f32 = powers_w.iter().sum();
        let [column, row] = self.column_and_row(tile, cell);
        (whole > 0.0).then(|| AfterglowCell {
            cell_index: self.number_of([column, row]),
            position_km: [self.middle_km(column), self.middle_km(row)],
            powers_w,
            energy_ev: tile.weighted[cell].iter().sum::<f32>() / whole,
        })
    }

    /// Advances by one step.
    pub(super) fn step(&mut self, particles: &AuroraParticles, decay: &DecayFactors<ALTITUDES>) {
        let dark_w = (DARK_MW_PER_M2 * W_PER_KM2 * self.cell_km * self.cell_km) as f32;
        let mut gain = self.fade(decay, dark_w);
        self.add_particles(particles, decay, &mut gain);
    }

    /// Applies the decay and frees dark tiles; returns the gain of the particles' power for each remaining tile.
    fn fade(&mut self, decay: &DecayFactors<ALTITUDES>, dark_w: f32) -> Vec<[f32; ALTITUDES]> {
        let tiles = self.tiles.par_iter_mut().with_min_len(TILES_PER_TASK);
        let (mut gain, mut dark): (Vec<_>, Vec<_>) = tiles.map(|tile| tile.fade(decay, dark_w)).unzip();
        let mut number = 0;
        while number < self.tiles.len() {
            if dark[number] {
                // The last tile takes the place of the freed one, so that tiles stay dense; the order of tiles depends on the history only, never on
                // threads.
                gain.swap_remove(number);
                dark.swap_remove(number);
                self.numbers[self.tiles[number].tile_position as usize] = NO_TILE;
                self.tiles.swap_remove(number);
                if let Some(moved) = self.tiles.get(number) {
                    self.numbers[moved.tile_position as usize] = number as u32;
                }
            } else {
                number += 1;
            }
        }
        gain
    }

    /// Adds the particles' power times the gain of their tile, sequentially, so that sums do not depend on threads. A
    /// new tile takes the gain of its first particle.
    fn add_particles(
        &mut self,
        particles: &AuroraParticles,
        decay: &DecayFactors<ALTITUDES>,
        gain: &mut Vec<[f32; ALTITUDES]>,
    ) {
        let [xs, zs] = &particles.positions;
        let positions = xs.par_iter().zip(zs).with_min_len(TASK).map(|(x, z)| self.locate([*x, *z]));
        let positions: Vec<(u32, u32)> = positions.map(|(position, cell)| (position as u32, cell as u32)).collect();
        let values = particles.powers_w.iter().zip(&particles.energies_ev);
        for ((position, cell), (power, energy)) in positions.into_iter().zip(values) {
            let (number, cell) = (self.number(position as usize), cell as usize);
            if number == gain.len() {
                gain.push(decay.of(*energy).map(|kept| 1.0 - kept));
            }
            let (tile, gains) = (&mut self.tiles[number], gain[number]);
            let (powers, weighted) = (&mut tile.powers[cell], &mut tile.weighted[cell]);
            // No `mul_add`: outside of vectorized loops it is a library call on targets without FMA.
            for i in 0..ALTITUDES {
                powers[i] += power * gains[i];
                weighted[i] += power * energy * gains[i];
            }
        }
    }

    /// Tile position and cell within the tile, for a position in km.
    #[inline(always)]
    fn locate(&self, position_km: [f32; 2]) -> (usize, usize) {
        let last = (self.side * TILE_SIDE) as f64 - 1.0;
        let per_km = 1.0 / self.cell_km;
        let [x, z] = position_km;
        let column = ((f64::from(x) + self.half_km) * per_km).clamp(0.0, last) as usize;
        let row = ((f64::from(z) + self.half_km) * per_km).clamp(0.0, last) as usize;
        (row / TILE_SIDE * self.side + column / TILE_SIDE, row % TILE_SIDE * TILE_SIDE + column % TILE_SIDE)
    }

    /// Tile number at a tile position; allocates the tile if necessary.
    fn number(&mut self, position: usize) -> usize {
        if self.numbers[position] == NO_TILE {
            self.numbers[position] = self.tiles.len() as u32;
            self.tiles.push(Tile::new(position as u32));
        }
        self.numbers[position] as usize
    }
}

impl<const ALTITUDES: usize> AfterglowCell<ALTITUDES> {
    /// Sum of two cells at their centroid, with the index of the first.
    fn merged_with(self, other: Self) -> Self {
        let whole = [self, other].map(|cell| cell.powers_w.iter().sum::<f32>());
        let fraction = whole[1] / (whole[0] + whole[1]);
        let mut merged = self;
        for (position, other) in merged.position_km.iter_mut().zip(other.position_km) {
            *position += fraction * (other - *position);
        }
        for (power, other) in merged.powers_w.iter_mut().zip(other.powers_w) {
            *power += other;
        }
        merged.energy_ev += fraction * (other.energy_ev - self.energy_ev);
        merged
    }
}

impl AfterglowMap<1> {
    /// Distributes each cell's power to the particles in it in proportion to their power. Returns the power per
    /// particle, W, and the cells without particles, merged into blocks of `block` by `block`; cells below
    /// `min_relative_power` times the power of a typical cell are skipped.
    pub(crate) fn distribute_to_particles(
        &self,
        particles: &AuroraParticles,
        min_relative_power: f32,
        block: usize,
    ) -> (Vec<f32>, Vec<AfterglowCell<1>>) {
        let cells = self.cells_of(particles);
        let mut sums = vec![0.0_f32; self.tiles.len() * TILE_CELLS];
        for (cell, power) in cells.iter().zip(&particles.powers_w) {
            if let Some(sum) = sums.get_mut(*cell as usize) {
                *sum += power;
            }
        }
        let powers = cells
            .par_iter()
            .zip(&particles.powers_w)
            .map(|(cell, power)| {
                let cell = *cell as usize;
                let sum = sums.get(cell).copied().unwrap_or_default();
                if sum > 0.0 { self.tiles[cell / TILE_CELLS].powers[cell % TILE_CELLS][0] * (power / sum) } else { 0.0 }
            })
            .collect();
        let min_power = min_relative_power * self.typical_w();
        let rest = self.blocks(block, |tile, cell| {
            let is_empty = sums[tile * TILE_CELLS + cell] <= 0.0;
            is_empty && self.tiles[tile].powers[cell][0] > min_power
        });
        (powers, rest)
    }
}

#[cfg(test)]
mod tests;
