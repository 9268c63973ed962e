//! Particles as structure of arrays.

use bansho_base::{host::parallel::prelude::*, math::DVec2};
use bansho_sph::{self, Cells};

/// Particles, each of which represents many precipitating electrons; one entry per particle in every array.
///
/// Sorting reorders the particles; only the id is persistent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AuroraParticles {
    /// Positions at 100 km altitude, km: x east, z south.
    pub positions: [Vec<f32>; 2],
    /// Velocities of these positions, km/s: x east, z south.
    pub velocities: [Vec<f32>; 2],
    /// Unique ids.
    pub ids: Vec<u64>,
    /// Fade-in and fade-out factor, 0 to 1; `powers_w` include it.
    pub fades: Vec<f32>,
    /// Whether the particle is fading out.
    pub dying: Vec<bool>,
    /// Central energy of the electrons that it represents, eV.
    pub energies_ev: Vec<f32>,
    /// Power of precipitation, W. The sum is the sheets' energy flux times their area.
    pub powers_w: Vec<f32>,
    /// Power without the fade factor, W.
    pub full_powers_w: Vec<f32>,
    /// Index of the nearest sheet, or the last one it was near.
    pub sheets: Vec<u32>,
    /// Position along that sheet as a fraction of its length, 0 to 1.
    pub arc_fractions: Vec<f32>,
}

/// Number of arrays of `f32`.
pub(super) const FLOAT_ARRAYS: usize = 9;

impl AuroraParticles {
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

    /// Total power, W.
    #[must_use]
    pub fn power_w(&self) -> f64 {
        self.powers_w.iter().map(|power| f64::from(*power)).sum()
    }

    /// Position of a particle, km.
    #[must_use]
    pub fn position(&self, index: usize) -> DVec2 {
        DVec2::new(f64::from(self.positions[0][index]), f64::from(self.positions[1][index]))
    }

    /// All arrays of `f32`: positions, velocities, fades, energies, powers, full powers, arc fractions.
    pub(super) fn float_arrays(&self) -> [&Vec<f32>; FLOAT_ARRAYS] {
        let ([x, z], [u, w]) = (&self.positions, &self.velocities);
        [x, z, u, w, &self.fades, &self.energies_ev, &self.powers_w, &self.full_powers_w, &self.arc_fractions]
    }

    /// Mutable [`Self::float_arrays`].
    pub(super) fn float_arrays_mut(&mut self) -> [&mut Vec<f32>; FLOAT_ARRAYS] {
        let ([x, z], [u, w]) = (&mut self.positions, &mut self.velocities);
        [
            x,
            z,
            u,
            w,
            &mut self.fades,
            &mut self.energies_ev,
            &mut self.powers_w,
            &mut self.full_powers_w,
            &mut self.arc_fractions,
        ]
    }

    /// Adds a particle without power.
    pub(super) fn push(&mut self, id: u64, position: DVec2, [east, south]: [f32; 2], fade: f32) {
        let values = [position.x as f32, position.y as f32, east, south, fade, 0.0, 0.0, 0.0, 0.0];
        self.float_arrays_mut().into_iter().zip(values).for_each(|(array, value)| array.push(value));
        self.ids.push(id);
        self.dying.push(false);
        self.sheets.push(0);
    }

    /// Removes particles for which `keep` is `false`, preserving the order.
    pub(super) fn retain(&mut self, keep: &[bool]) {
        self.float_arrays_mut().into_par_iter().for_each(|values| bansho_sph::retain(values, keep));
        bansho_sph::retain(&mut self.ids, keep);
        bansho_sph::retain(&mut self.dying, keep);
        bansho_sph::retain(&mut self.sheets, keep);
    }

    /// Permutes them into the order of `cells`, to which they were assigned.
    pub(super) fn reorder(&mut self, cells: &mut Cells<2>) {
        cells.reorder_all(self.float_arrays_mut());
        cells.reorder(&mut self.ids);
        cells.reorder(&mut self.dying);
        cells.reorder(&mut self.sheets);
    }
}
