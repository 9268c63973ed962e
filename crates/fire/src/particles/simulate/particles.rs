//! Particles as a structure of arrays.

use std::ops::Range;

use bansho_base::{host::parallel::prelude::*, math::DVec3};
use bansho_sph::{Cells, retain};

/// Number of `f32` columns.
pub(crate) const FLOAT_COLUMNS: usize = 21;
/// Indices of the position columns.
const POSITION: Range<usize> = 0..3;
/// Index of the density column.
const DENSITY: usize = 14;

/// One particle, for [`GasParticles::push`] and for tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particle {
    /// Unique number within a run; all random numbers of the particle depend on it.
    pub id: u64,
    /// Position x, m, relative to [`GasParticles::origin`].
    pub position: [f32; 3],
    /// Velocity u, m/s.
    pub velocity: [f32; 3],
    /// Mass m, kg.
    pub mass: f32,
    /// Density rho at its position, eq. (3), kg/m^3.
    pub density: f32,
    /// Temperature T, K.
    pub temperature: f32,
    /// Support radius d of the kernel with which it is drawn, m; it grows as the particle entrains air.
    pub support_radius: f32,
    /// Time since it was spawned, s.
    pub age: f32,
    /// Age at which it is removed, s.
    pub max_age: f32,
    /// Fraction of fuel left: 1 when spawned, 0 when burnt out.
    pub fuel: f32,
    /// Volume fraction of soot (about 1e-6 in a yellow flame).
    pub soot: f32,
}

/// All particles, in the order of the cells that they were last sorted into.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GasParticles {
    /// Origin of positions, m.
    pub origin: DVec3,
    pub(crate) id: Vec<u64>,
    pub(crate) position: [Vec<f32>; 3],
    pub(crate) velocity: [Vec<f32>; 3],
    pub(crate) spawn_point: [Vec<f32>; 3],
    /// Velocity by which the air's motion advects the particle, m/s; included in `velocity`.
    pub(crate) drift: [Vec<f32>; 3],
    /// Burning rate relative to the mean.
    pub(crate) burn_rate: Vec<f32>,
    /// Index of the burner it came from.
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

impl GasParticles {
    /// No particles, with positions relative to `origin`.
    pub fn new(origin: DVec3) -> Self {
        Self { origin, ..Self::default() }
    }

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.id.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.id.is_empty()
    }

    /// Appends a particle of the first burner, spawned at its position. Its id must be unique.
    pub fn push(&mut self, particle: Particle) {
        self.push_from(0, 1.0, particle);
    }

    /// Appends a particle of a burner, with a burning rate relative to the mean.
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

    /// Keeps the particles whose mask is set, in their order.
    pub(crate) fn retain(&mut self, keep: &[bool]) {
        if keep.contains(&false) {
            retain(&mut self.id, keep);
            retain(&mut self.burner, keep);
            self.float_columns_mut().into_par_iter().for_each(|values| retain(values, keep));
        }
    }

    /// Sorts the particles, and the column `companion` with them, by cell, then by id. Densities are not sorted, since they are recomputed afterwards.
    pub(crate) fn sort(&mut self, cells: &mut Cells<3>, companion: &mut Vec<f32>) {
        cells.assign(self.positions(), &self.id);
        cells.reorder_assigned(self.position.each_mut(), &mut self.id);
        cells.reorder(&mut self.burner);
        let arrays = self.float_columns_mut().into_iter().enumerate();
        let arrays = arrays.filter(|(number, _)| !POSITION.contains(number) && *number != DENSITY);
        cells.reorder_all(arrays.map(|(_, values)| values).chain([companion]));
    }

    /// Unique ids.
    pub fn ids(&self) -> &[u64] {
        &self.id
    }

    /// Positions x, y and z relative to the origin, m.
    pub fn positions(&self) -> [&[f32]; 3] {
        self.position.each_ref().map(Vec::as_slice)
    }

    /// Velocities, m/s.
    pub fn velocities(&self) -> [&[f32]; 3] {
        self.velocity.each_ref().map(Vec::as_slice)
    }

    /// Positions at which they were spawned, relative to the origin, m: Lagrangian coordinates of the gas.
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

    /// Ages, s.
    pub fn ages(&self) -> &[f32] {
        &self.age
    }

    /// Ages at which they are removed, s.
    pub fn max_ages(&self) -> &[f32] {
        &self.max_age
    }

    /// Fractions of fuel left.
    pub fn fuel_fractions(&self) -> &[f32] {
        &self.fuel
    }

    /// Volume fractions of soot.
    pub fn soot_fractions(&self) -> &[f32] {
        &self.soot
    }

    /// All `f32` columns.
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

    /// All `f32` columns, mutable.
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
        let mut particles = GasParticles::new(DVec3::ZERO);
        (1..=5).for_each(|id| particles.push(particle(id)));
        particles.retain(&[true, false, true, false, true]);
        assert_eq!(particles.ids(), [1, 3, 5]);
        assert_eq!((0..3).filter_map(|index| particles.get(index)).collect::<Vec<_>>(), [1, 3, 5].map(particle));
        assert_eq!(particles.get(3), None);
    }
}
