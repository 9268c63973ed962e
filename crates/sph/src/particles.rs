//! Particles as structure of arrays, and their time integration.

use bansho_base::host::parallel::prelude::*;
use fearless_simd::dispatch;

use super::{
    cells::Cells,
    error::{ParticleArray, SphError},
    sorting::MIN_PARTICLES_PER_TASK,
};

/// Particles in `D` dimensions as structure of arrays.
///
/// Positions are relative to an origin chosen by the owner: the nearer to it, the finer a 32-bit float resolves them. Sorting moves
/// particles between indices; only the id stays with a particle.
#[derive(Clone, Debug)]
pub struct Particles<const D: usize> {
    /// Positions, one array per component.
    pub positions: [Vec<f32>; D],
    /// Velocities, one array per component.
    pub velocities: [Vec<f32>; D],
    /// Masses, all above 0.
    pub masses: Vec<f32>,
    /// Unique particle ids.
    pub ids: Vec<u64>,
}

impl<const D: usize> Default for Particles<D> {
    fn default() -> Self {
        Self {
            positions: [const { Vec::new() }; D],
            velocities: [const { Vec::new() }; D],
            masses: Vec::new(),
            ids: Vec::new(),
        }
    }
}

impl<const D: usize> Particles<D> {
    /// Checks that all arrays have one value per particle, that positions and velocities are finite, and that masses are finite and above 0.
    ///
    /// # Errors
    /// The first array of another length, else the first bad value.
    ///
    /// ```
    /// use bansho_sph::{ParticleArray, Particles, SphError};
    ///
    /// let mut particles = Particles::<2>::default();
    /// particles.push([0.0, f32::INFINITY], [0.0, 0.0], 1.0, 7);
    /// let error = particles.check();
    /// assert_eq!(error, Err(SphError::Value { array: ParticleArray::Position(1), index: 0, value: f32::INFINITY }));
    /// ```
    pub fn check(&self) -> Result<(), SphError> {
        let expected = self.len();
        let positions = self.positions.iter().enumerate().map(|(axis, values)| (ParticleArray::Position(axis), values));
        let velocities =
            self.velocities.iter().enumerate().map(|(axis, values)| (ParticleArray::Velocity(axis), values));
        let arrays: Vec<_> = positions.chain(velocities).chain([(ParticleArray::Mass, &self.masses)]).collect();
        if let Some((array, values)) = arrays.iter().find(|(_, values)| values.len() != expected) {
            return Err(SphError::Length { array: *array, expected, found: values.len() });
        }
        for (array, values) in arrays {
            let least = if array == ParticleArray::Mass { f32::MIN_POSITIVE } else { f32::MIN };
            if let Some(index) = values.iter().position(|value| !(least..=f32::MAX).contains(value)) {
                return Err(SphError::Value { array, index, value: values[index] });
            }
        }
        Ok(())
    }

    /// Number of particles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// Appends a particle.
    pub fn push(&mut self, position: [f32; D], velocity: [f32; D], mass: f32, id: u64) {
        for c in 0..D {
            self.positions[c].push(position[c]);
            self.velocities[c].push(velocity[c]);
        }
        self.masses.push(mass);
        self.ids.push(id);
    }

    /// Keeps the particles whose mask is set, in their order; particles beyond the end of the mask are removed. Use [`retain`] with the same mask on other arrays.
    pub fn retain(&mut self, keep: &[bool]) {
        self.positions.iter_mut().chain(&mut self.velocities).for_each(|values| retain(values, keep));
        retain(&mut self.masses, keep);
        retain(&mut self.ids, keep);
    }

    /// Sorts by cell, then by id.
    ///
    /// Other arrays are permuted into the same order by [`Cells::reorder`].
    ///
    /// # Panics
    /// If the arrays differ in length ([`check`](Self::check) tells), or there are more than 2^27 particles.
    pub fn sort(&mut self, cells: &mut Cells<D>) {
        cells.assign(self.positions.each_ref().map(Vec::as_slice), &self.ids);
        cells.reorder_assigned(self.positions.each_mut(), &mut self.ids);
        cells.reorder_all(self.velocities.iter_mut().chain([&mut self.masses]));
    }

    /// Semi-implicit (symplectic) Euler: `v += a dt`, then `x += v dt`.
    ///
    /// # Panics
    /// If there is not one acceleration per particle.
    pub fn advance(&mut self, accelerations: &[Vec<f32>; D], seconds: f32) {
        let level = bansho_base::math::simd::level();
        for c in 0..D {
            assert_eq!(accelerations[c].len(), self.len(), "one acceleration per particle");
            let positions = self.positions[c].par_chunks_mut(MIN_PARTICLES_PER_TASK);
            let chunks = positions.zip(self.velocities[c].par_chunks_mut(MIN_PARTICLES_PER_TASK));
            chunks.zip(accelerations[c].par_chunks(MIN_PARTICLES_PER_TASK)).for_each(
                |((positions, velocities), accelerations)| {
                    dispatch!(level, _simd => advance(positions, velocities, accelerations, seconds));
                },
            );
        }
    }
}

#[inline(always)]
fn advance(positions: &mut [f32], velocities: &mut [f32], accelerations: &[f32], seconds: f32) {
    for ((position, velocity), acceleration) in positions.iter_mut().zip(velocities).zip(accelerations) {
        *velocity = acceleration.mul_add(seconds, *velocity);
        *position = velocity.mul_add(seconds, *position);
    }
}

/// Keeps the entries of `values` whose mask is set; entries beyond the end of the mask are removed.
pub fn retain<T>(values: &mut Vec<T>, keep: &[bool]) {
    let mut mask = keep.iter();
    values.retain(|_| mask.next().copied().unwrap_or(false));
}
