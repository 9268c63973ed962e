//! The aurora: drawn by an artist, moved by a field, lit by the atoms that precipitating electrons strike.
//!
//! K. Sekiguchi, "A study on artist-controllable aurora simulation". [`shapes`] are the foot of the aurora as it is drawn and as it
//! becomes.

pub mod shapes;
