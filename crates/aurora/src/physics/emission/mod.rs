//! What struck atoms and molecules give back: how much light, for how long, how far from where they were struck, and in which color.
//!
//! [`emitter`] lists the excited states and their lines; [`quenching`] says how many of them radiate, [`excitation`] how many are made.
//! [`table`] is the table of photons by energy and altitude, [`lifetime`] how light lingers and spreads, [`red_line_altitudes`]
//! how red light does by height. [`collisions`] turns single
//! collisions into photons, with the rules of the thesis beside. [`extinction`](crate::physics::extinction) is what the air below takes away. [`calibration`](super::calibration) holds the
//! whole against what is observed.

pub mod collisions;
pub mod emitter;
pub mod excitation;
pub mod lifetime;
pub mod quenching;
pub mod red_line_altitudes;
pub mod table;

pub use emitter::{EMITTERS, Emitter, LINES, Line, PerEmitter};
pub use table::Emission;

/// Photons m^-2 s^-1 of a column that make one kilorayleigh.
pub const PHOTONS_PER_KILORAYLEIGH: f64 = 1e13;
