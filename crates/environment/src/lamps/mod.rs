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
//! other objects is computed from the lights, not in this module.

mod parameters;
mod phenomenon;
mod render;

#[cfg(test)]
mod tests;

use bansho_base::{
    color,
    math::DVec3,
    phenomenon::{
        strip::{View, parts_of_motion},
        surroundings::{Emitter, Light},
    },
};
pub use parameters::{LightKind, LightParameters};

/// Motion between the parts of an exposure, pixels: about the radius of the smallest disc.
const PIXELS_PER_PART: f64 = 1.0;
/// Most parts of a usual exposure.
const MAX_PARTS: usize = 64;
/// Parts of an exposure in which a lamp flashes.
const FLASH_PARTS: usize = 16;

/// The visible lights of a scene at any time.
pub struct Lamps {
    at: Box<dyn Fn(f64) -> Vec<Lamp> + Send + Sync>,
}

/// A light, and the luminous sphere as which it is visible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// The light.
    pub light: Light,
    /// Radius of the sphere, m.
    pub radius: f64,
}

impl Lamps {
    /// The name of their layer.
    pub const NAME: &str = "lamps";

    /// The lamps that `at` returns for a time in seconds.
    pub fn new(at: impl Fn(f64) -> Vec<Lamp> + Send + Sync + 'static) -> Self {
        Self { at: Box::new(at) }
    }

    /// The parts of an exposure in which no lamp is displaced by more than about a pixel.
    fn parts_of_exposure(&self, view: &View) -> usize {
        let cameras = view.path_cameras();
        let times = view.shutter.path_times();
        let path = times.map(|t| (self.at)(t));
        let is_still = path.iter().all(|lamps| *lamps == path[0]);
        if is_still && cameras.is_still() {
            return 1;
        }
        let count = path[0].len();
        let mut motion = 0.0_f64;
        for lamp in 0..count {
            motion = motion.max(cameras.path_pixels(|t| {
                let at = times.iter().position(|time| *time == t).unwrap_or(0);
                path[at].get(lamp).and_then(|lamp| lamp.light.emitter.position()).unwrap_or(view.camera.position)
            }));
        }
        let moved = parts_of_motion(motion, PIXELS_PER_PART, MAX_PARTS.max(view.shutter.max_parts()));
        if (0..count).any(|lamp| flashes(path.each_ref().map(|lamps| lamps.get(lamp)))) {
            moved.max(FLASH_PARTS)
        } else {
            moved
        }
    }
}

/// Whether the light of a lamp during the exposure is another one than that in its middle: it flashes, or its cone passes.
fn flashes(path: [Option<&Lamp>; 5]) -> bool {
    /// Difference of the luminance that is not seen, relative to the highest.
    const TOLERANCE: f32 = 0.01;
    let lamps: Vec<&Lamp> = path.into_iter().flatten().collect();
    let luminances = lamps.iter().map(|lamp| color::luminance(lamp.light.intensity));
    let (mean, highest) = (luminances.clone().sum::<f32>() / lamps.len().max(1) as f32, luminances.fold(0.0, f32::max));
    let middle = lamps.get(lamps.len() / 2).map_or(0.0, |lamp| color::luminance(lamp.light.intensity));
    (mean - middle).abs() > TOLERANCE * highest || lamps.iter().any(|lamp| spot_axis(lamp) != spot_axis(lamps[0]))
}

/// The axis of a spot; `None` for other lights.
fn spot_axis(lamp: &Lamp) -> Option<DVec3> {
    match lamp.light.emitter {
        Emitter::Spot { axis, .. } => Some(axis),
        Emitter::Point { .. } | Emitter::Directional { .. } => None,
    }
}
