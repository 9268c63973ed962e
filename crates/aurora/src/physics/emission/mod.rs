//! Emission of excited atoms and molecules: photons, lifetime, diffusion and color.
//!
//! [`emitter`] lists the excited states and their lines, [`quenching`] their radiated fraction, [`excitation`] their
//! production. [`table`] is the table of photons by energy and altitude, [`lifetime`] the decay and diffusion,
//! [`red_line_altitudes`] the altitude dependence of the red line's decay. [`collisions`] has the photons of single
//! collisions and the rules of the thesis, `table_2_1` its way from lines to color. [`extinction`](crate::physics::extinction) is the lower atmosphere.
//! [`calibration`](super::calibration) compares all of it with observations.

pub mod collisions;
pub mod emitter;
pub mod excitation;
pub mod lifetime;
pub mod quenching;
pub mod red_line_altitudes;
pub mod table;
pub(crate) mod table_2_1;

pub use emitter::{ColorMatching, EMITTERS, LINES, Line, LineSet, PerEmitter, SpectralEmitter};
pub use table::Emission;

/// Photon column emission rate of one kilorayleigh, m^-2 s^-1.
pub const PHOTONS_PER_KILORAYLEIGH: f64 = 1e13;
