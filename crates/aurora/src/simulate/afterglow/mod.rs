//! Light that lingers where electrons have been: the green and the red line, on maps of the plane at 100 km altitude.
//!
//! Blue and purple light leaves at once, where the electrons are. Oxygen keeps its green for 0.8 s and its red for up to two
//! minutes, less where the air quenches it, so that red light fades by height. So the green
//! follows a moving sheet softly and the red stays behind.

mod map;

use super::AuroraParticles;
use crate::physics::emission::{Emission, Emitter, red_line_altitudes::RED_ALTITUDES};
use map::DecayFactors;
pub use map::{AfterglowCell, AfterglowMap};

/// Cells of the green map along a cell of the field; the green is sharp.
const GREEN_FINENESS: f64 = 8.0;

/// What the maps of both slow emitters keep in a step.
#[derive(Clone, Debug)]
pub(crate) struct AfterglowDecay {
    green: DecayFactors<1>,
    red: DecayFactors<RED_ALTITUDES>,
}

impl AfterglowDecay {
    /// In steps of so many seconds of the aurora. `emission` says how long light of electrons of an energy lives.
    pub(crate) fn new(emission: &Emission, seconds: f64) -> Self {
        let green = |energy_ev| [emission.column(energy_ev).lifetime[Emitter::OxygenGreen.index()]];
        let red = |energy_ev| emission.red_lifetimes(energy_ev);
        Self { green: DecayFactors::new(seconds, green), red: DecayFactors::new(seconds, red) }
    }
}

/// The maps of both slow emitters.
#[derive(Clone, Debug, PartialEq)]
pub struct Afterglow {
    /// O(1S), 557.7 nm: cells an eighth as wide as the field's.
    pub green: AfterglowMap<1>,
    /// O(1D), 630.0 and 636.4 nm, by its heights: cells as wide as the field's.
    pub red: AfterglowMap<RED_ALTITUDES>,
}

impl Afterglow {
    /// Dark maps of a square of side `extent_km` whose field has cells of `cell_km`.
    #[must_use]
    pub fn new(extent_km: f64, cell_km: f64) -> Self {
        Self {
            green: AfterglowMap::new(extent_km, cell_km / GREEN_FINENESS),
            red: AfterglowMap::new(extent_km, cell_km),
        }
    }

    /// Lets a step pass while `particles` feed both maps.
    pub(crate) fn step(&mut self, particles: &AuroraParticles, decay: &AfterglowDecay) {
        rayon::join(|| self.green.step(particles, &decay.green), || self.red.step(particles, &decay.red));
    }

    /// Fills the maps as if `particles` had been as they are for long.
    pub(crate) fn fill_steady_state(&mut self, particles: &AuroraParticles) {
        self.green.step(particles, &DecayFactors::instantaneous());
        self.red.step(particles, &DecayFactors::instantaneous());
    }
}
