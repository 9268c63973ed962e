//! The gas as particles: structure of arrays, one entry a particle in every array.

use bansho_base::math::DVec3;

use bansho_sph::{Cells, retain};
use rayon::prelude::*;

/// How many arrays of numbers there are.
pub(crate) const FLOAT_COLUMNS: usize = 21;
/// Which of them are densities.
const DENSITY: usize = 14;

/// One particle, for pushing into [`Particles`] and for tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particle {
    /// Number of its birth, unique in the run: the key of all its random numbers.
    pub id: u64,
    /// Place x, m, from [`Particles::origin`].
    pub position: [f32; 3],
    /// Velocity u, m/s.
    pub velocity: [f32; 3],
    /// Mass m, kg.
    pub mass: f32,
    /// Density rho at its place, eq. (3), kg/m^3.
    pub density: f32,
    /// Temperature T, K.
    pub temperature: f32,
    /// Support radius d of the kernel with which it is drawn, m; grows as the particle mixes with air.
    pub support_radius: f32,
    /// Time since its birth, s.
    pub age: f32,
    /// Age at which it is removed, s.
    pub max_age: f32,
    /// Share of its fuel that has not burnt: 1 at birth, 0 once burnt out.
    pub fuel: f32,
    /// Volume fraction of soot, dimensionless (1e-6 is one part in a million, usual in a yellow flame).
    pub soot: f32,
}

/// All living particles, in the order of the cells that they were last sorted into.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Particles {
    /// Where the positions count from, m.
    pub origin: DVec3,
    pub(crate) id: Vec<u64>,
    pub(crate) position: [Vec<f32>; 3],
    pub(crate) velocity: [Vec<f32>; 3],
    pub(crate) spawn_point: [Vec<f32>; 3],
    /// The part of the velocity with which the air's own motion carries the particle, m/s.
    pub(crate) drift: [Vec<f32>; 3],
    /// How fast it burns beside the mean.
    pub(crate) burn_rate: Vec<f32>,
    /// Number of the burner it came from.
    pub(crate) burner: Vec<u32>,
    pub(crate) mass: Vec<f32>,
    pub(crate) density: Vec<f32>,
    pub(crate) temperature: Vec<f32>,
    pub(crate) support_radius: Vec<f32>,
    pub(crate) age: Vec<f32>,
    pub(crate) max_age: Vec<f32>,
    pub(crate) fuel: Vec<f32>,
    pub(crate) soot: Vec<f32>,
}

impl Particles {
    /// None, with positions counted from `origin`.
    pub fn new(origin: DVec3) -> Self {
        Self { origin, ..Self::default() }
    }

    /// How many live.
    pub fn len(&self) -> usize {
        self.id.len()
    }

    /// Whether none lives.
    pub fn is_empty(&self) -> bool {
        self.id.is_empty()
    }

    /// Adds a particle of the first burner, born where it is; no other may have its birth number.
    pub fn push(&mut self, particle: Particle) {
        self.push_from(0, 1.0, particle);
    }

    /// Adds a particle of a burner, which burns so much faster than the mean.
    pub(crate) fn push_from(&mut self, burner: u32, burn_rate: f32, particle: Particle) {
        self.id.push(particle.id);
        self.burner.push(burner);
        self.burn_rate.push(burn_rate);
        for axis in 0..3 {
            self.position[axis].push(particle.position[axis]);
            self.spawn_point[axis].push(particle.position[axis]);
            self.velocity[axis].push(particle.velocity[axis]);
            self.drift[axis].push(0.0);
        }
        for (values, value) in self.scalar_columns_mut().into_iter().zip(particle.scalars()) {
            values.push(value);
        }
    }

    /// The particle at `index`; `None` beyond the last.
    pub fn get(&self, index: usize) -> Option<Particle> {
        if index >= self.len() {
            return None;
        }
        Some(Particle {
            id: self.id[index],
            position: std::array::from_fn(|axis| self.position[axis][index]),
            velocity: std::array::from_fn(|axis| self.velocity[axis][index]),
            mass: self.mass[index],
            density: self.density[index],
            temperature: self.temperature[index],
            support_radius: self.support_radius[index],
            age: self.age[index],
            max_age: self.max_age[index],
            fuel: self.fuel[index],
            soot: self.soot[index],
        })
    }

    /// Removes all whose mask is not set; the others keep their order.
    pub(crate) fn retain(&mut self, keep: &[bool]) {
        if keep.contains(&false) {
            retain(&mut self.id, keep);
            retain(&mut self.burner, keep);
            self.float_columns_mut().into_par_iter().for_each(|values| retain(values, keep));
        }
    }

    /// Sorts them into cells, and what else is known of each; their numbers of birth order those of one cell. Their densities are to be
    /// found anew.
    pub(crate) fn sort(&mut self, cells: &mut Cells<3>, companion: &mut Vec<f32>) {
        cells.assign(self.positions(), &self.id);
        cells.reorder(&mut self.id);
        cells.reorder(&mut self.burner);
        let arrays = self.float_columns_mut().into_iter().enumerate().filter(|(number, _)| *number != DENSITY);
        cells.reorder_all(arrays.map(|(_, values)| values).chain([companion]));
    }

    /// Numbers of birth, no two alike.
    pub fn ids(&self) -> &[u64] {
        &self.id
    }

    /// Places x, y and z from the origin, m.
    pub fn positions(&self) -> [&[f32]; 3] {
        self.position.each_ref().map(Vec::as_slice)
    }

    /// Velocities, m/s.
    pub fn velocities(&self) -> [&[f32]; 3] {
        self.velocity.each_ref().map(Vec::as_slice)
    }

    /// Places where they were born, m from the origin: with the age they name the gas, whatever became of it.
    pub fn spawn_positions(&self) -> [&[f32]; 3] {
        self.spawn_point.each_ref().map(Vec::as_slice)
    }

    /// Masses m, kg.
    pub fn masses(&self) -> &[f32] {
        &self.mass
    }

    /// Densities rho, eq. (3), kg/m^3.
    pub fn densities(&self) -> &[f32] {
        &self.density
    }

    /// Temperatures T, K.
    pub fn temperatures(&self) -> &[f32] {
        &self.temperature
    }

    /// Support radii d for drawing, m.
    pub fn support_radii(&self) -> &[f32] {
        &self.support_radius
    }

    /// Times since birth, s.
    pub fn ages(&self) -> &[f32] {
        &self.age
    }

    /// Ages at removal, s.
    pub fn max_ages(&self) -> &[f32] {
        &self.max_age
    }

    /// Shares of the fuel that have not burnt.
    pub fn fuel_fractions(&self) -> &[f32] {
        &self.fuel
    }

    /// Volume fractions of soot.
    pub fn soot_fractions(&self) -> &[f32] {
        &self.soot
    }

    /// Every array of numbers, for what treats them all alike.
    pub(crate) fn float_columns(&self) -> [&Vec<f32>; FLOAT_COLUMNS] {
        let Self { position: [x, y, z], velocity: [u, v, w], spawn_point: [a, b, c], drift: [d, e, f], .. } = self;
        let Self { burn_rate, mass, density, temperature, support_radius, age, max_age, fuel, soot, .. } = self;
        [
            x,
            y,
            z,
            u,
            v,
            w,
            a,
            b,
            c,
            d,
            e,
            f,
            burn_rate,
            mass,
            density,
            temperature,
            support_radius,
            age,
            max_age,
            fuel,
            soot,
        ]
    }

    /// As [`float_columns`](Self::float_columns), to change them.
    pub(crate) fn float_columns_mut(&mut self) -> [&mut Vec<f32>; FLOAT_COLUMNS] {
        let Self {
            position: [x, y, z],
            velocity: [u, v, w],
            spawn_point: [a, b, c],
            drift: [d, e, f],
            burn_rate,
            mass,
            density,
            temperature,
            support_radius,
            age,
            max_age,
            fuel,
            soot,
            ..
        } = self;
        [
            x,
            y,
            z,
            u,
            v,
            w,
            a,
            b,
            c,
            d,
            e,
            f,
            burn_rate,
            mass,
            density,
            temperature,
            support_radius,
            age,
            max_age,
            fuel,
            soot,
        ]
    }

    fn scalar_columns_mut(&mut self) -> [&mut Vec<f32>; 8] {
        let Self { mass, density, temperature, support_radius, age, max_age, fuel, soot, .. } = self;
        [mass, density, temperature, support_radius, age, max_age, fuel, soot]
    }
}

impl Particle {
    fn scalars(&self) -> [f32; 8] {
        let Self { mass, density, temperature, support_radius, age, max_age, fuel, soot, .. } = *self;
        [mass, density, temperature, support_radius, age, max_age, fuel, soot]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn particle(id: u64) -> Particle {
        let number = id as f32;
        Particle {
            id,
            position: [number, 2.0, 3.0],
            velocity: [0.0, number, 0.0],
            mass: 1.0,
            density: 0.25,
            temperature: 1500.0 + number,
            support_radius: 0.05,
            age: 0.0,
            max_age: number,
            fuel: 1.0,
            soot: number * 1e-6,
        }
    }

    #[test]
    fn removal_keeps_order_and_rows_together() {
        let mut particles = Particles::new(DVec3::ZERO);
        (1..=5).for_each(|id| particles.push(particle(id)));
        particles.retain(&[true, false, true, false, true]);
        assert_eq!(particles.ids(), [1, 3, 5]);
        assert_eq!((0..3).filter_map(|index| particles.get(index)).collect::<Vec<_>>(), [1, 3, 5].map(particle));
        assert_eq!(particles.get(3), None);
    }
}
