//! Births and deaths when the in-between shape is renewed (thesis, 2.3.4 and table 3.3).

use super::AuroraParticles;
use crate::simulate::field::sheet_charge::ScatteredParticle;
use crate::simulate::field::sheet_field::{ElectricField, full_cell_count};
use crate::simulate::sheets::refined_shape::RefinedShape;
use crate::{AuroraParameters, RelocationParameters};
use bansho_base::math::DVec2;
use bansho_base::math::random::{Key, Purpose, uniform};
use rayon::prelude::*;

const BIRTH: Purpose = Purpose::named("aurora birth");
const THINNING: Purpose = Purpose::named("aurora thinning");
/// The counts of table 3.3 are taken as those of a near cell that holds this many particles on average.
const TABLE_COUNT: f64 = 75.0;
/// Particles that a task of the thread pool finds the cells of, at least.
const TASK: usize = 4096;
/// By so much more is an interval filled than the table says: until the next renewal it stretches by up to a half, and its particles move on.
const AHEAD: f64 = 1.35;

/// Position and velocity of a particle that is born, km and km/s.
type Birth = (DVec2, [f32; 2]);

/// Table 3.3 for a number of particles, and the random numbers of births.
#[derive(Clone, Debug)]
pub(super) struct Relocation {
    parameters: RelocationParameters,
    count: f64,
    half_thickness: f64,
    key: Key,
}

/// Particles of each cell, those that stay alive.
struct CellOccupants {
    /// Where the list of each cell begins, and where the last one ends.
    starts: Vec<u32>,
    indices: Vec<u32>,
}

impl Relocation {
    pub(super) fn new(parameters: &AuroraParameters, key: Key) -> Self {
        Self {
            parameters: parameters.particles.relocation.clone(),
            count: parameters.particles.count as f64,
            half_thickness: parameters.half_thickness_km(),
            key,
        }
    }

    /// Lets strays and the surplus die and fills what is thin, by the shape, its scattered particles and the field from before the renewal.
    pub(super) fn relocate(
        &self,
        particles: &mut AuroraParticles,
        (field, refined, scattered): (&ElectricField, &RefinedShape, &[ScatteredParticle]),
        renewal: u32,
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
        let births = if self.parameters.scaled {
            let mut intervals = ArcIntervals::new(refined, scattered, self.count);
            intervals.fill(particles);
            let births = self.births_by_interval(&mut intervals, scattered, particles.len(), renewal);
            self.remove_surplus(particles, &mut intervals, renewal);
            births
        } else {
            self.births_by_cell(particles, &occupants, (field, refined), &near, *next_id, renewal)
        };
        for (position, velocity) in births {
            particles.push(*next_id, position, velocity, 0.0);
            *next_id += 1;
        }
    }

    /// How much of a whole cell the sheets cover of each near cell, from 0 to 1; 0 in others. All near cells count as whole where the table
    /// is taken to the letter.
    fn coverage(&self, field: &ElectricField, near: &[bool]) -> Vec<f64> {
        let full = full_cell_count(&field.counts).max(f64::MIN_POSITIVE);
        let fraction = |(count, near): (&f64, &bool)| match (near, self.parameters.scaled) {
            (false, _) => 0.0,
            (true, false) => 1.0,
            (true, true) => (count / full).min(1.0),
        };
        field.counts.values().iter().zip(near).map(fraction).collect()
    }

    /// What the counts of the table are multiplied by.
    fn scale(&self, coverage: &[f64]) -> f64 {
        let cells = coverage.iter().sum::<f64>().max(1.0);
        if self.parameters.scaled { self.count / (cells * TABLE_COUNT) } else { 1.0 }
    }

    /// In every cell with too many, those farthest from the shape die.
    fn remove_excess(
        &self,
        particles: &mut AuroraParticles,
        occupants: &CellOccupants,
        refined: &RefinedShape,
        scale: f64,
    ) {
        let most = self.parameters.deaths_above * scale;
        for cell in 0..occupants.starts.len() - 1 {
            let list = occupants.of(cell);
            let excess = (list.len() as f64 - most).min(self.parameters.deaths_at_most * scale).ceil();
            if excess < 1.0 {
                continue;
            }
            let distance = |index: u32| refined.distance(particles.position(index as usize)).unwrap_or(f64::INFINITY);
            let mut farthest: Vec<(f64, u32)> = list.iter().map(|index| (distance(*index), *index)).collect();
            farthest.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            farthest.iter().take(excess as usize).for_each(|entry| particles.dying[entry.1 as usize] = true);
        }
    }

    /// In every near cell with too few, the deficit appears at random, with the mean velocity of the cells around: positions and velocities, by
    /// the letter of the table.
    fn births_by_cell(
        &self,
        particles: &AuroraParticles,
        occupants: &CellOccupants,
        (field, refined): (&ElectricField, &RefinedShape),
        near: &[bool],
        first_id: u64,
        renewal: u32,
    ) -> Vec<Birth> {
        let columns = field.counts.size()[0];
        let origin = DVec2::from(field.counts.origin());
        let mut births = Vec::new();
        for cell in (0..near.len()).filter(|cell| near[*cell]) {
            let lack = self.parameters.births_below - occupants.of(cell).len() as f64;
            let deficit = lack.min(self.parameters.births_at_most).round();
            if deficit < 1.0 {
                continue;
            }
            let velocity = occupants.mean_velocity(particles, cell, columns);
            let corner = DVec2::new((cell % columns) as f64, (cell / columns) as f64);
            for _ in 0..deficit.min(self.room(particles.len() + births.len())) as u64 {
                let id = first_id + births.len() as u64;
                let [u, v, ..] = self.key.words(id, renewal, BIRTH).map(|word| f64::from(uniform(word)));
                let position = origin + (corner + DVec2::new(u, v)) * field.counts.spacing();
                births.push((refined.clamp_distance(position, self.half_thickness), velocity));
            }
        }
        births
    }

    /// Where an interval of the sheets holds too few, the deficit appears among the positions of its scattered particles, with the mean velocity
    /// there. All together are as many as the table gives to all near cells at most; where they are born is where they lack. Cells would not
    /// see that: where sheets bend, a full limb passes through the cells of an empty one.
    fn births_by_interval(
        &self,
        intervals: &mut ArcIntervals,
        scattered: &[ScatteredParticle],
        living: usize,
        renewal: u32,
    ) -> Vec<Birth> {
        let [below, most] =
            [self.parameters.births_below, self.parameters.births_at_most].map(|count| count / TABLE_COUNT);
        let lack = |interval: &ArcInterval| (AHEAD * below * interval.target_count - interval.count).max(0.0);
        let lacks: Vec<f64> = intervals.all().iter().map(lack).collect();
        let lacking: f64 = lacks.iter().sum();
        if lacking <= 0.0 {
            return Vec::new();
        }
        let given = (most * self.count).min(self.room(living)).min(lacking) / lacking;
        let chance = |(lack, interval): (&f64, &mut ArcInterval)| given * lack / interval.scattered.max(1.0);
        let chances: Vec<f64> = lacks.iter().zip(intervals.all()).map(chance).collect();
        let velocities: Vec<[f32; 2]> = (0..chances.len()).map(|index| intervals.velocity(index)).collect();
        let mut births = Vec::new();
        for (number, particle) in scattered.iter().enumerate() {
            let Some(index) =
                intervals.index(particle.sheet, particle.arc_fraction).filter(|index| chances[*index] > 0.0)
            else {
                continue;
            };
            if f64::from(self.key.uniforms(number as u64, renewal, BIRTH)[0]) < chances[index] {
                births.push((particle.position, velocities[index]));
                intervals.all()[index].count += 1.0;
            }
        }
        births
    }

    /// How many more particles may be born among so many.
    fn room(&self, living: usize) -> f64 {
        (MOST_PARTICLES * self.count - living as f64).max(0.0)
    }

    /// Lets the surplus over the wanted count die, in the stretches that hold more than their fraction.
    fn remove_surplus(&self, particles: &mut AuroraParticles, intervals: &mut ArcIntervals, renewal: u32) {
        let living: f64 = intervals.all().iter().map(|interval| interval.count).sum();
        let excess = |interval: &ArcInterval| (interval.count - interval.target_count).max(0.0);
        let excesses: Vec<f64> = intervals.all().iter().map(excess).collect();
        let fraction = (living - self.count) / excesses.iter().sum::<f64>().max(1.0);
        if fraction <= 0.0 {
            return;
        }
        let chance =
            |(excess, interval): (&f64, &mut ArcInterval)| (fraction * excess / interval.count.max(1.0)) as f32;
        let chances: Vec<f32> = excesses.iter().zip(intervals.all()).map(chance).collect();
        for (index, dying) in particles.dying.iter_mut().enumerate().filter(|(_, dying)| !**dying) {
            let Some(interval) = intervals.index(particles.sheets[index], particles.arc_fractions[index]) else {
                continue;
            };
            let chance = chances[interval];
            *dying = chance > 0.0 && self.key.uniforms(particles.ids[index], renewal, THINNING)[0] < chance;
        }
    }
}

/// However many births the table asks for, there are never more particles than this many times their number.
const MOST_PARTICLES: f64 = 4.0;

/// Cells that are near the shape: their scatter count is high and their potential low enough, beside the means over all cells.
pub(super) fn near_cells(field: &ElectricField, table: &RelocationParameters) -> Vec<bool> {
    let (counts, potential) = (field.counts.values(), field.potential.values());
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let (least, greatest) = (table.count * mean(counts), table.potential * mean(potential));
    // An empty shape has no near cells, whatever the fractions.
    let near = |(count, potential): (&f64, &f64)| *count > 0.0 && *count >= least && *potential <= greatest;
    counts.iter().zip(potential).map(near).collect()
}

/// The cell that a particle is in.
fn cell_of_particle(particles: &AuroraParticles, field: &ElectricField, index: usize) -> Option<usize> {
    field.counts.index(particles.position(index).to_array())
}

impl CellOccupants {
    fn new(particles: &AuroraParticles, cells_of: &[Option<usize>], cells: usize) -> Self {
        let live = || cells_of.iter().enumerate().filter(|(index, _)| !particles.dying[*index]);
        let mut starts = vec![0_u32; cells + 1];
        live().filter_map(|(_, cell)| *cell).for_each(|cell| starts[cell + 1] += 1);
        for cell in 0..cells {
            starts[cell + 1] += starts[cell];
        }
        let mut ends = starts.clone();
        let mut indices = vec![0; starts[cells] as usize];
        for (index, cell) in live().filter_map(|(index, cell)| Some((index, (*cell)?))) {
            indices[ends[cell] as usize] = index as u32;
            ends[cell] += 1;
        }
        Self { starts, indices }
    }

    fn of(&self, cell: usize) -> &[u32] {
        &self.indices[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// Mean velocity of those in the cell and the eight around it; rest where there is nobody.
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

/// A cell and the eight around it, of so many in rows of `columns`.
fn cells_around(cell: usize, columns: usize, cells: usize) -> impl Iterator<Item = usize> {
    let around = |position: usize, count: usize| position.saturating_sub(1)..(position + 2).min(count);
    let across = around(cell % columns, columns);
    around(cell / columns, cells / columns)
        .flat_map(move |row| across.clone().map(move |column| row * columns + column))
}

/// Stretches that all sheets together are cut into: half as long as those that must hold half their fraction.
const INTERVALS: f64 = 100.0;
/// Particles that an interval shall hold at least: fewer would come and go by chance.
const MIN_INTERVAL_COUNT: f64 = 32.0;

/// Stretches of the sheets about as long as each other, one sheet's after those of another.
#[derive(Clone, Debug)]
pub(super) struct ArcIntervals {
    /// Where each sheet's begin, and the end of all.
    starts: Vec<usize>,
    all: Vec<ArcInterval>,
}

/// What is known of an interval.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ArcInterval {
    /// Particles that it shall hold: as much of them all as it is of the sheets' length, like the power that they bring.
    pub(super) target_count: f64,
    /// Particles that were scattered about it: fewer than are due where another sheet lies close by.
    pub(super) scattered: f64,
    /// Particles that it holds and that stay alive, and the sum of their velocities, km/s.
    pub(super) count: f64,
    momentum: [f64; 2],
}

impl ArcIntervals {
    /// The intervals of a shape for so many particles, and what was scattered about each.
    pub(super) fn new(refined: &RefinedShape, scattered: &[ScatteredParticle], count: f64) -> Self {
        let lengths = refined.sheet_lengths();
        let whole = lengths.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let number = INTERVALS.min(count / MIN_INTERVAL_COUNT);
        let mut intervals = Self { all: Vec::new(), starts: vec![0] };
        for fraction in lengths.into_iter().map(|length| length / whole) {
            let own = (number * fraction).round().max(1.0);
            let interval = ArcInterval { target_count: count * fraction / own, ..ArcInterval::default() };
            intervals.all.extend(std::iter::repeat_n(interval, own as usize));
            intervals.starts.push(intervals.all.len());
        }
        for particle in scattered {
            if let Some(index) = intervals.index(particle.sheet, particle.arc_fraction) {
                intervals.all[index].scattered += 1.0;
            }
        }
        intervals
    }

    /// Finds what they hold.
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

    /// The stretch at a fraction of a sheet's length; none where there is no such sheet.
    pub(super) fn index(&self, sheet: u32, fraction: f32) -> Option<usize> {
        let (first, end) = (*self.starts.get(sheet as usize)?, *self.starts.get(sheet as usize + 1)?);
        let coordinate = f64::from(fraction) * (end - first) as f64;
        Some(first + (coordinate as usize).min(end - first - 1))
    }

    /// All of them, sheet by sheet.
    pub(super) fn all(&mut self) -> &mut [ArcInterval] {
        &mut self.all
    }

    /// Mean velocity of those in the interval at that index and in those beside it on the sheet, km/s; rest where there is nobody.
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
