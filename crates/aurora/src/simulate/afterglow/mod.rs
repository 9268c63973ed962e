//! Light that lingers where electrons have been: the green and the red line, on maps of the plane at 100 km altitude.
//!
//! Blue and purple light leaves at once, where the electrons are. Oxygen keeps its green for 0.8 s and its red for up to two
//! minutes, less where the air quenches it, so that red light fades by height. So the green
//! follows a moving sheet softly and the red stays behind.

mod map;

use super::AuroraParticles;
use crate::physics::emission::{Emission, Emitter, red_line_levels::RED_HEIGHTS};
use map::Keeping;
pub use map::{GlowCell, GlowMap};

/// Cells of the green map along a cell of the field; the green is sharp.
const GREEN_FINENESS: f64 = 8.0;

/// What the maps of both slow emitters keep in a step.
#[derive(Clone, Debug)]
pub(crate) struct Fading {
    green: Keeping<1>,
    red: Keeping<RED_HEIGHTS>,
}

impl Fading {
    /// In steps of so many seconds of the aurora. `emission` says how long light of electrons of an energy lives.
    pub(crate) fn new(emission: &Emission, seconds: f64) -> Self {
        let green = |energy_ev| [emission.column(energy_ev).lifetime[Emitter::OxygenGreen.index()]];
        let red = |energy_ev| emission.red_lifetimes(energy_ev);
        Self { green: Keeping::new(seconds, green), red: Keeping::new(seconds, red) }
    }
}

/// The maps of both slow emitters.
#[derive(Clone, Debug, PartialEq)]
pub struct Afterglow {
    /// O(1S), 557.7 nm: cells an eighth as wide as the field's.
    pub green: GlowMap<1>,
    /// O(1D), 630.0 and 636.4 nm, by its heights: cells as wide as the field's.
    pub red: GlowMap<RED_HEIGHTS>,
}

impl Afterglow {
    /// Dark maps of a square of side `extent_km` whose field has cells of `cell_km`.
    #[must_use]
    pub fn new(extent_km: f64, cell_km: f64) -> Self {
        Self { green: GlowMap::new(extent_km, cell_km / GREEN_FINENESS), red: GlowMap::new(extent_km, cell_km) }
    }

    /// Lets a step pass while `particles` feed both maps.
    pub(crate) fn step(&mut self, particles: &AuroraParticles, fading: &Fading) {
        rayon::join(|| self.green.step(particles, &fading.green), || self.red.step(particles, &fading.red));
    }

    /// Fills the maps as if `particles` had been as they are for long.
    pub(crate) fn settle(&mut self, particles: &AuroraParticles) {
        self.green.step(particles, &Keeping::at_once());
        self.red.step(particles, &Keeping::at_once());
    }
}
