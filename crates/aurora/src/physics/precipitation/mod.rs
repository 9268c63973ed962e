//! Precipitation: where electrons lose their energy in the atmosphere.
//!
//! [`fang2010`] has the altitude profiles by energy, [`energy_grid`] the energies of all tables and the spectra on them,
//! [`deposition`] the ionization table, [`electron_track`] tracks of single collisions whose mean is the table. [`hard_sphere`] is
//! the model of the thesis, with a few tracks adjusted to have the mean of all.

pub mod deposition;
pub mod electron_track;
pub mod energy_grid;
pub mod fang2010;
pub mod hard_sphere;
pub(crate) mod lateral_spread;

pub use deposition::Deposition;
pub use electron_track::{Collision, TrackLibrary, TrackSampler};
pub use energy_grid::Spectrum;
pub use hard_sphere::{HardSphereAtmosphere, HardSphereParameters};

bansho_base::choice! {
    /// Model of the energy loss of the electrons and of the light that they excite.
    pub enum TrackModel {
        /// The measured atmosphere: altitudes after Fang et al. (2010), colors and brightness as observed.
        Fang2010 = "fang_2010",
        /// Hard spheres, as in the thesis (2.4): one radius for all energies, five lines, and quenching at every contact.
        HardSphereAtmosphere = "hard_sphere",
    }
}

/// Mean energy loss per ion pair, eV (Rees 1989; Fang et al. 2010).
pub(crate) const ION_PAIR_EV: f64 = 35.0;
/// Energy loss per collision, eV (thesis, 2.4.1).
pub(crate) const COLLISION_EV: f64 = 100.0;
/// 1 mW in eV s^-1.
const EV_PER_S_PER_MW: f64 = 1e-3 / 1.602_176_634e-19;
