//! The particles as arrays.

use bansho_base::math::DVec2;

use bansho_sph::{self, Cells};
use rayon::prelude::*;

/// Electrons that precipitate, each for many; one entry a particle in every array.
///
/// Sorting moves particles between slots: only the id stays with one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AuroraParticles {
    /// Where they pass 100 km altitude, km: x east, z south.
    pub positions: [Vec<f32>; 2],
    /// How fast that position moves, km/s: x east, z south.
    pub velocities: [Vec<f32>; 2],
    /// Birth ids, no two alike.
    pub ids: Vec<u64>,
    /// How much of it is there, 0 to 1: soft births and deaths. `powers_w` hold it already.
    pub fades: Vec<f32>,
    /// Whether it is on its way out.
    pub dying: Vec<bool>,
    /// Central energy of the electrons that it stands for, eV.
    pub energies_ev: Vec<f32>,
    /// Power that it brings into the air, W. All together are the sheets' energy flux times their area.
    pub powers_w: Vec<f32>,
    /// The same if it were all there, W.
    pub full_powers_w: Vec<f32>,
    /// The sheet that it is nearest to, as the shape's list has it; where it was last near one.
    pub sheets: Vec<u32>,
    /// Fraction of that sheet's length before it, 0 to 1.
    pub arc_fractions: Vec<f32>,
}

/// Arrays of `f32` that a particle has an entry in.
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

    /// Power of all together, W.
    #[must_use]
    pub fn power_w(&self) -> f64 {
        self.powers_w.iter().map(|power| f64::from(*power)).sum()
    }

    /// Position of a particle, km.
    #[must_use]
    pub fn position(&self, index: usize) -> DVec2 {
        DVec2::new(f64::from(self.positions[0][index]), f64::from(self.positions[1][index]))
    }

    /// All arrays of `f32`: positions, velocities, fades, energies, powers, full powers, fractions.
    pub(super) fn float_arrays(&self) -> [&Vec<f32>; FLOAT_ARRAYS] {
        let ([x, z], [u, w]) = (&self.positions, &self.velocities);
        [x, z, u, w, &self.fades, &self.energies_ev, &self.powers_w, &self.full_powers_w, &self.arc_fractions]
    }

    /// The same, to be changed.
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

    /// Adds one that has no power yet.
    pub(super) fn push(&mut self, id: u64, position: DVec2, [east, south]: [f32; 2], fade: f32) {
        let values = [position.x as f32, position.y as f32, east, south, fade, 0.0, 0.0, 0.0, 0.0];
        self.float_arrays_mut().into_iter().zip(values).for_each(|(values, number)| values.push(number));
        self.ids.push(id);
        self.dying.push(false);
        self.sheets.push(0);
    }

    /// Keeps those of which `keep` says so, in their order.
    pub(super) fn retain(&mut self, keep: &[bool]) {
        self.float_arrays_mut().into_par_iter().for_each(|values| bansho_sph::retain(values, keep));
        bansho_sph::retain(&mut self.ids, keep);
        bansho_sph::retain(&mut self.dying, keep);
        bansho_sph::retain(&mut self.sheets, keep);
    }

    /// Sorts them into cells, by cell and then by id.
    pub(super) fn sort(&mut self, cells: &mut Cells<2>) {
        cells.assign(self.positions.each_ref().map(Vec::as_slice), &self.ids);
        cells.reorder_all(self.float_arrays_mut());
        cells.reorder(&mut self.ids);
        cells.reorder(&mut self.dying);
        cells.reorder(&mut self.sheets);
    }
}
