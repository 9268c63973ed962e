//! The aurora: drawn by an artist, moved by a field, lit by the atoms that precipitating electrons strike.
//!
//! K. Sekiguchi, "A study on artist-controllable aurora simulation". [`atmosphere`] is the air from 80 to 600 km, [`precipitation`]
//! says where electrons of an energy spend it, [`light`] what the struck atoms give back, for how long and in which colour.

pub mod atmosphere;
pub mod light;
pub mod precipitation;
