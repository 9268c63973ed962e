//! The gas as particles: structure of arrays, one entry a particle in every array.

use bansho_base::math::DVec3;

/// One particle, for pushing into [`Particles`] and for tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particle {
    /// Number of its birth, unique in the run: the key of all its random numbers.
    pub birth: u64,
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
    pub life: f32,
    /// Share of its fuel that has not burnt: 1 at birth, 0 once burnt out.
    pub fuel: f32,
    /// Volume fraction of soot, dimensionless (1e-6 is one part in a million, usual in a yellow flame).
    pub soot: f32,
}

/// All living particles, in ascending order of [`birth`](Self::birth).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Particles {
    /// Where the positions count from, m.
    pub origin: DVec3,
    pub(crate) birth: Vec<u64>,
    pub(crate) position: [Vec<f32>; 3],
    pub(crate) velocity: [Vec<f32>; 3],
    pub(crate) birthplace: [Vec<f32>; 3],
    pub(crate) mass: Vec<f32>,
    pub(crate) density: Vec<f32>,
    pub(crate) temperature: Vec<f32>,
    pub(crate) support_radius: Vec<f32>,
    pub(crate) age: Vec<f32>,
    pub(crate) life: Vec<f32>,
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
        self.birth.len()
    }

    /// Whether none lives.
    pub fn is_empty(&self) -> bool {
        self.birth.is_empty()
    }

    /// Adds a particle, born where it is; its birth number must be greater than all others.
    pub fn push(&mut self, particle: Particle) {
        self.birth.push(particle.birth);
        for axis in 0..3 {
            self.position[axis].push(particle.position[axis]);
            self.birthplace[axis].push(particle.position[axis]);
            self.velocity[axis].push(particle.velocity[axis]);
        }
        for (values, value) in self.scalars_mut().into_iter().zip(particle.scalars()) {
            values.push(value);
        }
    }

    /// The particle at `index`; `None` beyond the last.
    pub fn get(&self, index: usize) -> Option<Particle> {
        if index >= self.len() {
            return None;
        }
        Some(Particle {
            birth: self.birth[index],
            position: std::array::from_fn(|axis| self.position[axis][index]),
            velocity: std::array::from_fn(|axis| self.velocity[axis][index]),
            mass: self.mass[index],
            density: self.density[index],
            temperature: self.temperature[index],
            support_radius: self.support_radius[index],
            age: self.age[index],
            life: self.life[index],
            fuel: self.fuel[index],
            soot: self.soot[index],
        })
    }

    /// Removes all for which `keep` of their index is false; the others keep their order.
    pub fn retain(&mut self, keep: impl Fn(usize) -> bool) {
        let kept: Vec<bool> = (0..self.len()).map(keep).collect();
        fn compact<T>(values: &mut Vec<T>, kept: &[bool]) {
            let mut index = 0;
            values.retain(|_| {
                index += 1;
                kept[index - 1]
            });
        }
        if kept.iter().all(|kept| *kept) {
            return;
        }
        compact(&mut self.birth, &kept);
        for axis in 0..3 {
            compact(&mut self.position[axis], &kept);
            compact(&mut self.birthplace[axis], &kept);
            compact(&mut self.velocity[axis], &kept);
        }
        self.scalars_mut().into_iter().for_each(|values| compact(values, &kept));
    }

    /// Numbers of birth, ascending.
    pub fn births(&self) -> &[u64] {
        &self.birth
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
    pub fn birthplaces(&self) -> [&[f32]; 3] {
        self.birthplace.each_ref().map(Vec::as_slice)
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
    pub fn lives(&self) -> &[f32] {
        &self.life
    }

    /// Shares of the fuel that have not burnt.
    pub fn fuels(&self) -> &[f32] {
        &self.fuel
    }

    /// Volume fractions of soot.
    pub fn soots(&self) -> &[f32] {
        &self.soot
    }

    pub(crate) fn scalars(&self) -> [&Vec<f32>; 8] {
        let Self { mass, density, temperature, support_radius, age, life, fuel, soot, .. } = self;
        [mass, density, temperature, support_radius, age, life, fuel, soot]
    }

    pub(crate) fn scalars_mut(&mut self) -> [&mut Vec<f32>; 8] {
        let Self { mass, density, temperature, support_radius, age, life, fuel, soot, .. } = self;
        [mass, density, temperature, support_radius, age, life, fuel, soot]
    }
}

impl Particle {
    fn scalars(&self) -> [f32; 8] {
        let Self { mass, density, temperature, support_radius, age, life, fuel, soot, .. } = *self;
        [mass, density, temperature, support_radius, age, life, fuel, soot]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn particle(birth: u64) -> Particle {
        let number = birth as f32;
        Particle {
            birth,
            position: [number, 2.0, 3.0],
            velocity: [0.0, number, 0.0],
            mass: 1.0,
            density: 0.25,
            temperature: 1500.0 + number,
            support_radius: 0.05,
            age: 0.0,
            life: number,
            fuel: 1.0,
            soot: number * 1e-6,
        }
    }

    #[test]
    fn removal_keeps_order_and_rows_together() {
        let mut particles = Particles::new(DVec3::ZERO);
        (1..=5).for_each(|birth| particles.push(particle(birth)));
        particles.retain(|index| index != 1 && index != 3);
        assert_eq!(particles.births(), [1, 3, 5]);
        assert_eq!((0..3).filter_map(|index| particles.get(index)).collect::<Vec<_>>(), [1, 3, 5].map(particle));
        assert_eq!(particles.get(3), None);
    }
}
