//! The particles as arrays.

/// Electrons that precipitate, each for many; one entry a particle in every array.
///
/// Sorting moves particles between slots: only the id stays with one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AuroraParticles {
    /// Where they pass 100 km altitude, km: x east, z south.
    pub positions: [Vec<f32>; 2],
    /// How fast that place moves, km/s: x east, z south.
    pub velocities: [Vec<f32>; 2],
    /// Birth ids, no two alike.
    pub ids: Vec<u64>,
    /// How much of it is there, 0 to 1: soft births and deaths. `powers` hold it already.
    pub fades: Vec<f32>,
    /// Whether it is on its way out.
    pub dying: Vec<bool>,
    /// Central energy of the electrons that it stands for, eV.
    pub energies_ev: Vec<f32>,
    /// Power that it brings into the air, W. All together are the sheets' energy flux times their area.
    pub powers_w: Vec<f32>,
    /// The sheet that it is nearest to.
    pub sheets: Vec<u32>,
    /// Share of its sheet's length before it, 0 to 1.
    pub shares: Vec<f32>,
}

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
}
