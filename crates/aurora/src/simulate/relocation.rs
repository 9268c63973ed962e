//! Relocation: births and deaths when the in-between shape is updated (thesis, 2.3.4 and table 3.3).

use bansho_base::{
    host::parallel::prelude::*,
    math::{
        DVec2,
        random::{Key, Purpose, uniform},
    },
};

use super::AuroraParticles;
use crate::{
    AuroraParameters, RelocationParameters,
    simulate::{
        field::{
            sheet_charge::ScatteredParticle,
            sheet_field::{ElectricField, full_cell_count},
        },
        sheets::refined_shape::RefinedShape,
    },
};

const BIRTH: Purpose = Purpose::named("aurora birth");
const THINNING: Purpose = Purpose::named("aurora thinning");
/// Average number of particles per near cell that the counts of table 3.3 refer to.
const TABLE_COUNT: f64 = 75.0;
/// Minimum particles per task.
const TASK: usize = 4096;
/// Factor by which intervals are filled beyond the counts of the table: until the next update they stretch by up to a half
/// and particles move on.
const FILL_FACTOR: f64 = 1.35;

/// A new particle.
struct Birth {
    /// km.
    position: DVec2,
    /// km/s.
    velocity: [f32; 2],
}

/// Parameters of table 3.3 and the random key.
#[derive(Clone, Debug)]
pub(super) struct Relocation {
    parameters: RelocationParameters,
    count: f64,
    key: Key,
}

/// Particles of each cell that are not fading out.
struct CellOccupants {
    /// Start of each cell's list, and the total.
    starts: Vec<u32>,
    indices: Vec<u32>,
}

impl Relocation {
    pub(super) fn new(parameters: &AuroraParameters, key: Key) -> Self {
        Self { parameters: parameters.particles.relocation.clone(), count: parameters.particles.count as f64, key }
    }

    /// Marks stray and surplus particles for removal and adds missing ones, by the shape, scattered particles and field
    /// before the update.
    pub(super) fn relocate(
        &self,
        particles: &mut AuroraParticles,
        field: &ElectricField,
        refined: &RefinedShape,
        scattered: &[ScatteredParticle],
        update_index: u32,
        next_id: &mut u64,
    ) {
        let near = near_cells(field, &self.parameters);
        let scale = self.scale(&self.coverage(field, &near));
        let cells = (0..particles.len()).into_par_iter().with_min_len(TASK);
        let cells: Vec<Option<usize>> = cells.map(|i| cell_of_particle(particles, field, i)).collect();
        for (index, cell) in cells.iter().enumerate() {
            particles.dying[index] |= !cell.is_some_and(|cell| near[cell]);
        }
        let occupants = CellOccupants::new(particles, &cells, near.len());
        self.remove_excess(particles, &occupants, refined, scale);
        let births = if self.parameters.scale_counts {
            let mut intervals = ArcIntervals::new(refined, scattered, self.count);
            intervals.fill(particles);
            let births = self.births_by_interval(&mut intervals, scattered, particles.len(), update_index);
            self.remove_surplus(particles, &mut intervals, update_index);
            births
        } else {
            self.births_by_cell(particles, &occupants, field, &near, *next_id, update_index)
        };
        for Birth { position, velocity } in births {
            particles.push(*next_id, position, velocity, 0.0);
            *next_id += 1;
        }
    }

    /// Fraction of each near cell that the sheets cover, 0 to 1; 0 in other cells. 1 in all near cells if the table is
    /// applied literally.
    fn coverage(&self, field: &ElectricField, near: &[bool]) -> Vec<f64> {
        let full = full_cell_count(&field.counts).max(f64::MIN_POSITIVE);
        let mut coverage = vec![0.0; near.len()];
        for ((fraction, count), _) in
            coverage.iter_mut().zip(field.counts.values()).zip(near).filter(|(_, near)| **near)
        {
            *fraction = if self.parameters.scale_counts { (count / full).min(1.0) } else { 1.0 };
        }
        coverage
    }

    /// Scale factor of the table's counts.
    fn scale(&self, coverage: &[f64]) -> f64 {
        let cells = coverage.iter().sum::<f64>().max(1.0);
        if self.parameters.scale_counts { self.count / (cells * TABLE_COUNT) } else { 1.0 }
    }

    /// Removes the particles farthest from the shape in cells with too many.
    fn remove_excess(
        &self,
        particles: &mut AuroraParticles,
        occupants: &CellOccupants,
        refined: &RefinedShape,
        scale: f64,
    ) {
        let max_count = self.parameters.deaths_above * scale;
        for cell in 0..occupants.starts.len() - 1 {
            let list = occupants.of(cell);
            let excess = (list.len() as f64 - max_count).min(self.parameters.max_deaths * scale).ceil();
            if excess < 1.0 {
                continue;
            }
            let mut farthest = Vec::with_capacity(list.len());
            for index in list {
                let distance = refined.distance(particles.position(*index as usize)).unwrap_or(f64::INFINITY);
                farthest.push((distance, *index));
            }
            farthest.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            for (_, index) in farthest.into_iter().take(excess as usize) {
                particles.dying[index as usize] = true;
            }
        }
    }

    /// Adds the deficit of near cells at random positions with the mean velocity of the neighboring cells: the literal
    /// table.
    fn births_by_cell(
        &self,
        particles: &AuroraParticles,
        occupants: &CellOccupants,
        field: &ElectricField,
        near: &[bool],
        first_id: u64,
        update_index: u32,
    ) -> Vec<Birth> {
        let columns = field.counts.size()[0];
        let origin = DVec2::from(field.counts.origin());
        let mut births = Vec::new();
        for cell in (0..near.len()).filter(|cell| near[*cell]) {
            let deficit = self.parameters.births_below - occupants.of(cell).len() as f64;
            let count = deficit.min(self.parameters.max_births).round();
            if count < 1.0 {
                continue;
            }
            let velocity = occupants.mean_velocity(particles, cell, columns);
            let corner = DVec2::new((cell % columns) as f64, (cell / columns) as f64);
            for _ in 0..count.min(self.remaining_capacity(particles.len() + births.len())) as u64 {
                let id = first_id + births.len() as u64;
                let [u, v, ..] = self.key.words(id, update_index, BIRTH).map(|word| f64::from(uniform(word)));
                let position = origin + (corner + DVec2::new(u, v)) * field.counts.spacing();
                births.push(Birth { position, velocity });
            }
        }
        births
    }

    /// Adds the deficit of intervals at the positions of their scattered particles, with the local mean velocity. The
    /// total is limited to what the table allows for all near cells. Unlike cells, intervals detect an empty part of a
    /// sheet next to a full one.
    fn births_by_interval(
        &self,
        intervals: &mut ArcIntervals,
        scattered: &[ScatteredParticle],
        living: usize,
        update_index: u32,
    ) -> Vec<Birth> {
        let [births_below, max_births] =
            [self.parameters.births_below, self.parameters.max_births].map(|count| count / TABLE_COUNT);
        let mut deficits = Vec::new();
        for interval in intervals.all() {
            deficits.push((FILL_FACTOR * births_below * interval.target_count - interval.count).max(0.0));
        }
        let total_deficit: f64 = deficits.iter().sum();
        if total_deficit <= 0.0 {
            return Vec::new();
        }
        let filled_fraction =
            (max_births * self.count).min(self.remaining_capacity(living)).min(total_deficit) / total_deficit;
        // Each scattered particle of an interval is a candidate.
        let mut probabilities = Vec::with_capacity(deficits.len());
        for (deficit, interval) in deficits.iter().zip(intervals.all()) {
            probabilities.push(filled_fraction * deficit / interval.scattered.max(1.0));
        }
        let velocities: Vec<[f32; 2]> = (0..probabilities.len()).map(|index| intervals.velocity(index)).collect();
        let mut births = Vec::new();
        for (number, particle) in scattered.iter().enumerate() {
            let Some(index) =
                intervals.index(particle.sheet, particle.arc_fraction).filter(|index| probabilities[*index] > 0.0)
            else {
                continue;
            };
            if f64::from(self.key.uniforms(number as u64, update_index, BIRTH)[0]) < probabilities[index] {
                births.push(Birth { position: particle.position, velocity: velocities[index] });
                intervals.all()[index].count += 1.0;
            }
        }
        births
    }

    /// Remaining capacity for new particles.
    fn remaining_capacity(&self, living: usize) -> f64 {
        (MAX_PARTICLE_FACTOR * self.count - living as f64).max(0.0)
    }

    /// Removes the surplus over the requested count, from intervals with more than their target.
    fn remove_surplus(&self, particles: &mut AuroraParticles, intervals: &mut ArcIntervals, update_index: u32) {
        let living: f64 = intervals.all().iter().map(|interval| interval.count).sum();
        let excesses: Vec<f64> =
            intervals.all().iter().map(|interval| (interval.count - interval.target_count).max(0.0)).collect();
        let fraction = (living - self.count) / excesses.iter().sum::<f64>().max(1.0);
        if fraction <= 0.0 {
            return;
        }
        let mut probabilities = Vec::with_capacity(excesses.len());
        for (excess, interval) in excesses.iter().zip(intervals.all()) {
            probabilities.push((fraction * excess / interval.count.max(1.0)) as f32);
        }
        for (index, dying) in particles.dying.iter_mut().enumerate().filter(|(_, dying)| !**dying) {
            let Some(interval) = intervals.index(particles.sheets[index], particles.arc_fractions[index]) else {
                continue;
            };
            // Each particle has its own random number, keyed by its id: which ones go does not depend on how they are sorted.
            let probability = probabilities[interval];
            *dying =
                probability > 0.0 && self.key.uniforms(particles.ids[index], update_index, THINNING)[0] < probability;
        }
    }
}

/// Maximum number of particles relative to the requested count.
const MAX_PARTICLE_FACTOR: f64 = 4.0;

/// Near cells: scatter count and potential compared with their means over all cells.
pub(super) fn near_cells(field: &ElectricField, table: &RelocationParameters) -> Vec<bool> {
    let counts = field.counts.values();
    let min_count = table.scatter_count_threshold * mean(counts);
    let mut near = cells_of_low_potential(field, table);
    for (near, count) in near.iter_mut().zip(counts) {
        // An empty shape has no near cells, whatever the thresholds.
        *near &= *count > 0.0 && *count >= min_count;
    }
    near
}

/// Cells whose potential is low enough to be near the shape.
pub(super) fn cells_of_low_potential(field: &ElectricField, table: &RelocationParameters) -> Vec<bool> {
    let potential = field.potential.values();
    let max_potential = table.potential_threshold * mean(potential);
    potential.iter().map(|potential| *potential <= max_potential).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// The cell that a particle is in.
fn cell_of_particle(particles: &AuroraParticles, field: &ElectricField, index: usize) -> Option<usize> {
    field.counts.index(particles.position(index).to_array())
}

impl CellOccupants {
    fn new(particles: &AuroraParticles, cells_of: &[Option<usize>], cells: usize) -> Self {
        let mut located = Vec::with_capacity(particles.len());
        for (index, cell) in cells_of.iter().enumerate().filter(|(index, _)| !particles.dying[*index]) {
            located.extend(cell.map(|cell| (index, cell)));
        }
        // A counting sort by cell, in the order of the particles.
        let mut starts = vec![0_u32; cells + 1];
        for (_, cell) in &located {
            starts[cell + 1] += 1;
        }
        for cell in 0..cells {
            starts[cell + 1] += starts[cell];
        }
        let mut ends = starts.clone();
        let mut indices = vec![0; located.len()];
        for (index, cell) in located {
            indices[ends[cell] as usize] = index as u32;
            ends[cell] += 1;
        }
        Self { starts, indices }
    }

    fn of(&self, cell: usize) -> &[u32] {
        &self.indices[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// Mean velocity in the 3 x 3 cells around; 0 if they are empty.
    fn mean_velocity(&self, particles: &AuroraParticles, cell: usize, columns: usize) -> [f32; 2] {
        let (mut sum, mut count) = ([0.0_f64; 2], 0.0);
        for list in cells_around(cell, columns, self.starts.len() - 1).map(|cell| self.of(cell)) {
            count += list.len() as f64;
            for (axis, sum) in sum.iter_mut().enumerate() {
                *sum += list.iter().map(|i| f64::from(particles.velocities[axis][*i as usize])).sum::<f64>();
            }
        }
        sum.map(|sum| if count > 0.0 { (sum / count) as f32 } else { 0.0 })
    }
}

/// The 3 x 3 cells around a cell of a grid with `columns` columns.
fn cells_around(cell: usize, columns: usize, cells: usize) -> impl Iterator<Item = usize> {
    let [across, along] = [(cell % columns, columns), (cell / columns, cells / columns)]
        .map(|(position, count)| position.saturating_sub(1)..(position + 2).min(count));
    along.flat_map(move |row| across.clone().map(move |column| row * columns + column))
}

/// Number of intervals of all sheets: half as long as those for which half the target density is guaranteed.
const INTERVALS: f64 = 100.0;
/// Minimum target count per interval, against sampling noise.
const MIN_INTERVAL_COUNT: f64 = 32.0;

/// Intervals of about equal length, sheet by sheet.
#[derive(Clone, Debug)]
pub(super) struct ArcIntervals {
    /// Start of each sheet's intervals, and the total.
    starts: Vec<usize>,
    all: Vec<ArcInterval>,
}

/// State of an interval.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ArcInterval {
    /// Target number of particles, in proportion to its length.
    pub(super) target_count: f64,
    /// Number of scattered particles: below the target where another sheet is close by.
    pub(super) scattered: f64,
    /// Number of particles that are not fading out, and the sum of their velocities, km/s.
    pub(super) count: f64,
    momentum: [f64; 2],
}

impl ArcIntervals {
    /// Intervals of a shape for a number of particles, with their scatter counts.
    pub(super) fn new(refined: &RefinedShape, scattered: &[ScatteredParticle], count: f64) -> Self {
        let lengths = refined.sheet_lengths();
        let whole = lengths.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let number = INTERVALS.min(count / MIN_INTERVAL_COUNT);
        let mut intervals = Self { all: Vec::new(), starts: vec![0] };
        for fraction in lengths.into_iter().map(|length| length / whole) {
            let intervals_of_sheet = (number * fraction).round().max(1.0);
            let interval =
                ArcInterval { target_count: count * fraction / intervals_of_sheet, ..ArcInterval::default() };
            intervals.all.extend(std::iter::repeat_n(interval, intervals_of_sheet as usize));
            intervals.starts.push(intervals.all.len());
        }
        for particle in scattered {
            if let Some(index) = intervals.index(particle.sheet, particle.arc_fraction) {
                intervals.all[index].scattered += 1.0;
            }
        }
        intervals
    }

    /// Counts the particles.
    pub(super) fn fill(&mut self, particles: &AuroraParticles) {
        for index in (0..particles.len()).filter(|index| !particles.dying[*index]) {
            let Some(interval) = self.index(particles.sheets[index], particles.arc_fractions[index]) else { continue };
            let interval = &mut self.all[interval];
            interval.count += 1.0;
            for (sum, speeds) in interval.momentum.iter_mut().zip(&particles.velocities) {
                *sum += f64::from(speeds[index]);
            }
        }
    }

    /// Index of the interval at a fraction of a sheet's length; `None` for a missing sheet.
    pub(super) fn index(&self, sheet: u32, fraction: f32) -> Option<usize> {
        let (first, end) = (*self.starts.get(sheet as usize)?, *self.starts.get(sheet as usize + 1)?);
        let coordinate = f64::from(fraction) * (end - first) as f64;
        Some(first + (coordinate as usize).min(end - first - 1))
    }

    /// All intervals, sheet by sheet.
    pub(super) fn all(&mut self) -> &mut [ArcInterval] {
        &mut self.all
    }

    /// Mean velocity in an interval and its neighbors on the sheet, km/s; 0 if they are empty.
    pub(super) fn velocity(&self, index: usize) -> [f32; 2] {
        let sheet = self.starts.partition_point(|start| *start <= index);
        let beside = index.saturating_sub(1).max(self.starts[sheet - 1])..(index + 2).min(self.starts[sheet]);
        let (mut sum, mut count) = ([0.0; 2], 0.0);
        for interval in &self.all[beside] {
            count += interval.count;
            sum = [0, 1].map(|axis| sum[axis] + interval.momentum[axis]);
        }
        sum.map(|sum| if count > 0.0 { (sum / count) as f32 } else { 0.0 })
    }
}
