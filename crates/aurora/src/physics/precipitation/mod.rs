//! Where electrons that fall into the atmosphere spend their energy.
//!
//! [`fang2010`] is the calibrated answer, a profile over altitude for each energy; [`energy_grid`] the grid of energies on which tables stand;
//! [`spectrum`] mixes energies; [`deposition`] is the table of profiles; [`electron_track`] draws single collisions whose mean it is.
//! [`hard_sphere`] is the fall of Sekiguchi's thesis, [`quantile_matched`](crate::single_collisions::quantile_matched) a few such falls that have the mean of all.

pub mod deposition;
pub mod electron_track;
pub mod energy_grid;
pub mod fang2010;
pub mod hard_sphere;
pub(crate) mod lateral_spread;
pub mod spectrum;

pub use deposition::Deposition;
pub use electron_track::{Collision, TrackLibrary, TrackSampler};
pub use hard_sphere::HardSphereAtmosphere;
pub use spectrum::Spectrum;

bansho_base::choice! {
    /// What stops the electrons and what shines where they are stopped.
    pub enum TrackModel {
        /// Air as it is measured: heights after Fang et al. (2010), colours and brightness as observed.
        Fang = "fang",
        /// Hard spheres, as in the thesis (2.4): one radius for all energies, and green light only above 190 km.
        HardSphereAtmosphere = "hard_sphere",
    }
}

/// Mean energy that an electron loses for each ion pair that it makes, eV (Rees 1989; Fang et al. 2010).
pub const ION_PAIR_EV: f64 = 35.0;
/// Energy that an electron loses in a collision, eV (the thesis, section 2.4.1).
pub const COLLISION_EV: f64 = 100.0;
/// 1 mW in eV s^-1.
const EV_PER_S_PER_MW: f64 = 1e-3 / 1.602_176_634e-19;
