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
//! | luminance of a sphere of radius r, `I / (pi r^2)`, over the solid angle `2 pi (1 - cos a)`, `sin a = r / d` | `project_lamp` |
//! | glare `L = E k / (theta^2 + a^2)^(3/2)`, with a fade to 0 | `Glare::at_sixteen`, normalized in `Glare::new` |
//!
//! # Data flow
//! [`Lamps`] holds a function of time that returns the visible lights. `project_lamp` turns each into a `Disc` in the
//! picture: direction, angular radius, depth, radiance, and the illuminance at the camera. Disc and glare are functions of the angle between
//! a pixel and the lamp, so that they are right for every lens, across the seam of a panorama and around the antipode of a fisheye. `PreparedLamps` draws the discs at
//! their depths, antialiased, and the glare of all of them in the nearest depth interval. The illumination of
//! other objects is that of the lights and not part of this module.

mod model;
mod parameters;
mod phenomenon;
mod render;
mod table;

pub use model::{Lamp, Lamps};
pub use parameters::{LightKind, LightParameters};

#[cfg(test)]
mod tests;
