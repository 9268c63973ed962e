//! What struck atoms and molecules give back: how much light, for how long, how far from where they were struck, and in which colour.
//!
//! [`emitter`] lists the excited states and their lines; [`quenching`] says how many of them radiate, [`excitation`] how many are made.
//! [`emission`] is the table of photons by energy and altitude, [`persistence`] how light lingers and spreads, [`heights`]
//! how red light does by height. [`collisions`] turns single
//! collisions into photons, with the rules of the thesis beside. [`extinction`] is what the air below takes away. [`calibration`] holds the
//! whole against what is observed.

pub mod calibration;
pub mod collisions;
pub mod emission;
pub mod emitter;
pub mod excitation;
pub mod extinction;
pub mod heights;
pub mod persistence;
pub mod quenching;

pub use emission::Emission;
pub use emitter::{EMITTERS, Emitter, LINES, Line, PerEmitter};

/// Photons m^-2 s^-1 of a column that make one kilorayleigh.
pub const PHOTONS_PER_KILORAYLEIGH: f64 = 1e13;
