//! The aurora: drawn by an artist, lit by the atoms that precipitating electrons strike. So far what its pictures will rest on.
//!
//! K. Sekiguchi, "A study on artist-controllable aurora simulation". [`shapes`] are the foot of the aurora as it is drawn and as it
//! becomes, [`atmosphere`] is the air from 80 to 600 km, [`precipitation`] says where electrons of an energy spend it, [`light`] what
//! the struck atoms give back, for how long and in which colour.

pub mod atmosphere;
pub mod light;
pub mod precipitation;
pub mod shapes;
