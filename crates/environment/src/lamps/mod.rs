//! Lamps as visible objects: the luminous disc of a point or spot light, and the glare that a camera's lens adds.
//!
//! # Reference
//! J. J. Vos, "Disability glare - a state of the art report", CIE J. 3 (1984): glare falls with the cube of the angle
//! close to a source.
//!
//! # Equations
//!
//! | equation | function |
//! | --- | --- |
//! | luminance of a sphere of radius r, `I / (pi r^2)` | `project_lamp` |
//! | glare `L = E k / (theta^2 + a^2)^(3/2)`, with a fade to 0 | `Glare::at_sixteen`, normalized in `Glare::new` |
//!
//! # Data flow
//! [`Lamps`] holds a function of time that returns the visible lights. `project_lamp` turns each into a `Disc` in the
//! picture: center, radius, depth, radiance, and the illuminance at the camera. `PreparedLamps` draws the discs at
//! their depths, antialiased, and the glare of all of them in the nearest depth interval. The illumination of
//! other objects is that of the lights and not part of this module.

mod model;
mod phenomenon;
mod render;

pub use model::{Lamp, Lamps};

#[cfg(test)]
mod tests;
