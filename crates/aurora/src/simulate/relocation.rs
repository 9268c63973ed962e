//! Births and deaths when the in-between shape is renewed (thesis, 2.3.4 and table 3.3).

use bansho_base::math::{
    DVec2,
    random::{Key, Purpose, uniform},
};

use super::{
    AuroraParticles,
    arc_intervals::{Stretch, Stretches},
};
use crate::{
    AuroraParameters, RelocationParameters,
    simulate::{
        field::{
            scatter::Scattered,
            sheet_field::{Field, full_count},
        },
        sheets::refined_shape::Course,
    },
};
use rayon::prelude::*;

const BIRTH: Purpose = Purpose::named("aurora birth");
const THINNING: Purpose = Purpose::named("aurora thinning");
/// The counts of table 3.3 are taken as those of a near cell that holds this many particles on average.
const TABLE_COUNT: f64 = 75.0;
/// Particles that a task of the thread pool finds the cells of, at least.
const TASK: usize = 4096;
/// By so much more is a stretch filled than the table says: until the next renewal it stretches by up to a half, and its particles move on.
const AHEAD: f64 = 1.35;

/// Place and velocity of a particle that is born, km and km/s.
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
struct Residents {
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
        (field, course, scattered): (&Field, &Course, &[Scattered]),
        renewal: u32,
        next_id: &mut u64,
    ) {
        let near = near_cells(field, &self.parameters);
        let scale = self.scale(&self.shares(field, &near));
        let homes = (0..particles.len()).into_par_iter().with_min_len(TASK);
        let homes: Vec<Option<usize>> = homes.map(|i| home(particles, field, i)).collect();
        for (index, home) in homes.iter().enumerate() {
            particles.dying[index] |= !home.is_some_and(|cell| near[cell]);
        }
        let residents = Residents::new(particles, &homes, near.len());
        self.cull(particles, &residents, course, scale);
        let births = if self.parameters.scaled {
            let mut stretches = Stretches::new(course, scattered, self.count);
            stretches.fill(particles);
            let births = self.births_along(&mut stretches, scattered, particles.len(), renewal);
            self.thin(particles, &mut stretches, renewal);
            births
        } else {
            self.births_by_cell(particles, &residents, (field, course), &near, *next_id, renewal)
        };
        for (place, velocity) in births {
            particles.push(*next_id, place, velocity, 0.0);
            *next_id += 1;
        }
    }

    /// How much of a whole cell the sheets cover of each near cell, from 0 to 1; 0 in others. All near cells count as whole where the table
    /// is taken to the letter.
    fn shares(&self, field: &Field, near: &[bool]) -> Vec<f64> {
        let full = full_count(&field.counts).max(f64::MIN_POSITIVE);
        let share = |(count, near): (&f64, &bool)| match (near, self.parameters.scaled) {
            (false, _) => 0.0,
            (true, false) => 1.0,
            (true, true) => (count / full).min(1.0),
        };
        field.counts.values().iter().zip(near).map(share).collect()
    }

    /// What the counts of the table are multiplied by.
    fn scale(&self, shares: &[f64]) -> f64 {
        let cells = shares.iter().sum::<f64>().max(1.0);
        if self.parameters.scaled { self.count / (cells * TABLE_COUNT) } else { 1.0 }
    }

    /// In every cell with too many, those farthest from the shape die.
    fn cull(&self, particles: &mut AuroraParticles, residents: &Residents, course: &Course, scale: f64) {
        let most = self.parameters.deaths_above * scale;
        for cell in 0..residents.starts.len() - 1 {
            let list = residents.of(cell);
            let excess = (list.len() as f64 - most).min(self.parameters.deaths_at_most * scale).ceil();
            if excess < 1.0 {
                continue;
            }
            let distance = |index: u32| course.distance(particles.place(index as usize)).unwrap_or(f64::INFINITY);
            let mut farthest: Vec<(f64, u32)> = list.iter().map(|index| (distance(*index), *index)).collect();
            farthest.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            farthest.iter().take(excess as usize).for_each(|entry| particles.dying[entry.1 as usize] = true);
        }
    }

    /// In every near cell with too few, the deficit appears at random, with the mean velocity of the cells around: places and velocities, by
    /// the letter of the table.
    fn births_by_cell(
        &self,
        particles: &AuroraParticles,
        residents: &Residents,
        (field, course): (&Field, &Course),
        near: &[bool],
        first_id: u64,
        renewal: u32,
    ) -> Vec<Birth> {
        let columns = field.counts.size()[0];
        let origin = DVec2::from(field.counts.origin());
        let mut births = Vec::new();
        for cell in (0..near.len()).filter(|cell| near[*cell]) {
            let lack = self.parameters.births_below - residents.of(cell).len() as f64;
            let deficit = lack.min(self.parameters.births_at_most).round();
            if deficit < 1.0 {
                continue;
            }
            let velocity = residents.mean_velocity(particles, cell, columns);
            let corner = DVec2::new((cell % columns) as f64, (cell / columns) as f64);
            for _ in 0..deficit.min(self.room(particles.len() + births.len())) as u64 {
                let id = first_id + births.len() as u64;
                let [u, v, ..] = self.key.words(id, renewal, BIRTH).map(|word| f64::from(uniform(word)));
                let place = origin + (corner + DVec2::new(u, v)) * field.counts.spacing();
                births.push((course.held(place, self.half_thickness), velocity));
            }
        }
        births
    }

    /// Where a stretch of the sheets holds too few, the deficit appears among the places of its scattered particles, with the mean velocity
    /// there. All together are as many as the table gives to all near cells at most; where they are born is where they lack. Cells would not
    /// see that: where sheets bend, a full limb passes through the cells of an empty one.
    fn births_along(
        &self,
        stretches: &mut Stretches,
        scattered: &[Scattered],
        living: usize,
        renewal: u32,
    ) -> Vec<Birth> {
        let [below, most] =
            [self.parameters.births_below, self.parameters.births_at_most].map(|count| count / TABLE_COUNT);
        let lack = |stretch: &Stretch| (AHEAD * below * stretch.due - stretch.found).max(0.0);
        let lacks: Vec<f64> = stretches.all().iter().map(lack).collect();
        let lacking: f64 = lacks.iter().sum();
        if lacking <= 0.0 {
            return Vec::new();
        }
        let given = (most * self.count).min(self.room(living)).min(lacking) / lacking;
        let chance = |(lack, stretch): (&f64, &mut Stretch)| given * lack / stretch.scattered.max(1.0);
        let chances: Vec<f64> = lacks.iter().zip(stretches.all()).map(chance).collect();
        let velocities: Vec<[f32; 2]> = (0..chances.len()).map(|index| stretches.velocity(index)).collect();
        let mut births = Vec::new();
        for (number, particle) in scattered.iter().enumerate() {
            let Some(index) = stretches.index(particle.sheet, particle.share).filter(|index| chances[*index] > 0.0)
            else {
                continue;
            };
            if f64::from(self.key.uniforms(number as u64, renewal, BIRTH)[0]) < chances[index] {
                births.push((particle.place, velocities[index]));
                stretches.all()[index].found += 1.0;
            }
        }
        births
    }

    /// How many more particles may be born among so many.
    fn room(&self, living: usize) -> f64 {
        (MOST_PARTICLES * self.count - living as f64).max(0.0)
    }

    /// Lets the surplus over the wanted count die, in the stretches that hold more than their share.
    fn thin(&self, particles: &mut AuroraParticles, stretches: &mut Stretches, renewal: u32) {
        let living: f64 = stretches.all().iter().map(|stretch| stretch.found).sum();
        let excess = |stretch: &Stretch| (stretch.found - stretch.due).max(0.0);
        let excesses: Vec<f64> = stretches.all().iter().map(excess).collect();
        let share = (living - self.count) / excesses.iter().sum::<f64>().max(1.0);
        if share <= 0.0 {
            return;
        }
        let chance = |(excess, stretch): (&f64, &mut Stretch)| (share * excess / stretch.found.max(1.0)) as f32;
        let chances: Vec<f32> = excesses.iter().zip(stretches.all()).map(chance).collect();
        for (index, dying) in particles.dying.iter_mut().enumerate().filter(|(_, dying)| !**dying) {
            let Some(stretch) = stretches.index(particles.sheets[index], particles.shares[index]) else { continue };
            let chance = chances[stretch];
            *dying = chance > 0.0 && self.key.uniforms(particles.ids[index], renewal, THINNING)[0] < chance;
        }
    }
}

/// However many births the table asks for, there are never more particles than this many times their number.
const MOST_PARTICLES: f64 = 4.0;

/// Cells that are near the shape: their scatter count is high and their potential low enough, beside the means over all cells.
pub(super) fn near_cells(field: &Field, table: &RelocationParameters) -> Vec<bool> {
    let (counts, potential) = (field.counts.values(), field.potential.values());
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let (least, greatest) = (table.count * mean(counts), table.potential * mean(potential));
    // An empty shape has no near cells, whatever the shares.
    let near = |(count, potential): (&f64, &f64)| *count > 0.0 && *count >= least && *potential <= greatest;
    counts.iter().zip(potential).map(near).collect()
}

/// The cell that a particle is in.
fn home(particles: &AuroraParticles, field: &Field, index: usize) -> Option<usize> {
    field.counts.index(particles.place(index).to_array())
}

impl Residents {
    fn new(particles: &AuroraParticles, homes: &[Option<usize>], cells: usize) -> Self {
        let live = || homes.iter().enumerate().filter(|(index, _)| !particles.dying[*index]);
        let mut starts = vec![0_u32; cells + 1];
        live().filter_map(|(_, home)| *home).for_each(|cell| starts[cell + 1] += 1);
        for cell in 0..cells {
            starts[cell + 1] += starts[cell];
        }
        let mut ends = starts.clone();
        let mut indices = vec![0; starts[cells] as usize];
        for (index, cell) in live().filter_map(|(index, home)| Some((index, (*home)?))) {
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
    let around = |place: usize, count: usize| place.saturating_sub(1)..(place + 2).min(count);
    let across = around(cell % columns, columns);
    around(cell / columns, cells / columns)
        .flat_map(move |row| across.clone().map(move |column| row * columns + column))
}
