//! Births and deaths when the in-between shape is renewed (thesis, 2.3.4 and table 3.3).

use bansho_base::{
    math::DVec2,
    random::{Key, Purpose, uniform},
};
use rayon::prelude::*;

use super::{
    AuroraParticles,
    course::Course,
    field::{Field, full_count},
};
use crate::aurora::{AuroraParameters, RelocationParameters};

const BIRTH: Purpose = Purpose::named("aurora birth");
const THINNING: Purpose = Purpose::named("aurora thinning");
/// The counts of table 3.3 are taken as those of a near cell that holds this many particles on average.
const TABLE_COUNT: f64 = 75.0;
/// Particles that a task of the thread pool finds the cells of, at least.
const TASK: usize = 4096;
/// How much a cell counts beside each of those around it where it is found what it lacks.
const OWN_WEIGHT: f64 = 12.0;

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

    /// Lets strays and the surplus die and fills what is thin, by the shape and field from before the renewal.
    pub(super) fn relocate(
        &self,
        particles: &mut AuroraParticles,
        field: &Field,
        course: &Course,
        renewal: u32,
        next_id: &mut u64,
    ) {
        let near = near_cells(field, &self.parameters);
        let shares = self.shares(field, &near);
        let scale = self.scale(&shares);
        let homes = (0..particles.len()).into_par_iter().with_min_len(TASK);
        let homes: Vec<Option<usize>> = homes.map(|i| home(particles, field, i)).collect();
        for (index, home) in homes.iter().enumerate() {
            particles.dying[index] |= !home.is_some_and(|cell| near[cell]);
        }
        let residents = Residents::new(particles, &homes, near.len());
        self.cull(particles, &residents, course, scale);
        for (place, velocity) in
            self.births(particles, &residents, (field, course), (&shares, scale), *next_id, renewal)
        {
            particles.push(*next_id, place, velocity, 0.0);
            *next_id += 1;
        }
        self.thin(particles, renewal);
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

    /// In every near cell with too few, the deficit appears at random, with the mean velocity of the cells around: places and velocities.
    fn births(
        &self,
        particles: &AuroraParticles,
        residents: &Residents,
        (field, course): (&Field, &Course),
        (shares, scale): (&[f64], f64),
        first_id: u64,
        renewal: u32,
    ) -> Vec<(DVec2, [f32; 2])> {
        let columns = field.counts.size()[0];
        let origin = DVec2::from(field.counts.origin());
        let mut births = Vec::new();
        for cell in (0..shares.len()).filter(|cell| shares[*cell] > 0.0) {
            let lack = self.lack(residents, (shares, scale), cell, columns);
            let deficit = lack.min(self.parameters.births_at_most * scale).round();
            if deficit < 1.0 {
                continue;
            }
            let velocity = residents.mean_velocity(particles, cell, columns);
            let corner = DVec2::new((cell % columns) as f64, (cell / columns) as f64);
            let room = MOST_PARTICLES * self.count - (particles.len() + births.len()) as f64;
            for _ in 0..deficit.min(room.max(0.0)) as u64 {
                let id = first_id + births.len() as u64;
                let [u, v, ..] = self.key.words(id, renewal, BIRTH).map(|word| f64::from(uniform(word)));
                let place = origin + (corner + DVec2::new(u, v)) * field.counts.spacing();
                births.push((course.held(place, self.half_thickness), velocity));
            }
        }
        births
    }

    /// How many a near cell lacks. Where the table is not taken to the letter, the cells around count too: particles that have swung to the
    /// one side of a sheet leave little to fill up on the other.
    fn lack(&self, residents: &Residents, (shares, scale): (&[f64], f64), cell: usize, columns: usize) -> f64 {
        let least = self.parameters.births_below * scale;
        if !self.parameters.scaled {
            return least * shares[cell] - residents.of(cell).len() as f64;
        }
        let (mut wanted, mut found) = (0.0, 0.0);
        for other in cells_around(cell, columns, shares.len()) {
            let weight = if other == cell { OWN_WEIGHT } else { 1.0 };
            wanted += weight * shares[other];
            found += weight * residents.of(other).len() as f64;
        }
        // The cell's own part of what all of them lack.
        (least * wanted - found) * shares[cell] / wanted
    }

    /// Lets the surplus over the wanted count die, evenly.
    fn thin(&self, particles: &mut AuroraParticles, renewal: u32) {
        let live = particles.dying.iter().filter(|dying| !**dying).count() as f64;
        let share = ((live - self.count) / live.max(1.0)) as f32;
        if self.parameters.scaled && share > 0.0 {
            for (dying, id) in particles.dying.iter_mut().zip(&particles.ids) {
                *dying |= self.key.uniforms(*id, renewal, THINNING)[0] < share;
            }
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
