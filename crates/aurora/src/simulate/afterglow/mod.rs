//! Afterglow of the green and the red line, on maps of the plane at 100 km altitude.
//!
//! Blue and violet light is prompt. O(1S) has a lifetime of 0.8 s and O(1D) of up to two minutes, shorter at low
//! altitudes because of quenching. So green light lags slightly behind a moving sheet, and red light stays behind.

mod map;

use bansho_base::host::parallel;
use map::DecayFactors;
pub use map::{AfterglowCell, AfterglowMap};

use super::AuroraParticles;
use crate::physics::emission::{Emission, SpectralEmitter, red_line_altitudes::RED_ALTITUDES};

/// Green cells per cell of the field.
const GREEN_FINENESS: f64 = 8.0;

/// Decay factors of both maps.
#[derive(Clone, Debug)]
pub(crate) struct AfterglowDecay {
    green: DecayFactors<1>,
    red: DecayFactors<RED_ALTITUDES>,
}

impl AfterglowDecay {
    /// For a step in s of the aurora's time; lifetimes are from `emission`.
    pub(crate) fn new(emission: &Emission, seconds: f64) -> Self {
        let green = SpectralEmitter::OxygenGreen.index();
        Self {
            green: DecayFactors::new(seconds, |energy_ev| [emission.column(energy_ev).lifetime[green]]),
            red: DecayFactors::new(seconds, |energy_ev| emission.red_lifetimes(energy_ev)),
        }
    }
}

/// The maps of both slow emitters.
#[derive(Clone, Debug, PartialEq)]
pub struct Afterglow {
    /// O(1S), 557.7 nm: cells an eighth as wide as the field's.
    pub green: AfterglowMap<1>,
    /// O(1D), 630.0 and 636.4 nm, by altitude: cells as wide as the field's.
    pub red: AfterglowMap<RED_ALTITUDES>,
}

impl Afterglow {
    /// Empty maps of a square of side `extent_km` whose field has cells of `cell_km`.
    #[must_use]
    pub fn new(extent_km: f64, cell_km: f64) -> Self {
        Self {
            green: AfterglowMap::new(extent_km, cell_km / GREEN_FINENESS),
            red: AfterglowMap::new(extent_km, cell_km),
        }
    }

    /// Advances both maps by one step.
    pub(crate) fn step(&mut self, particles: &AuroraParticles, decay: &AfterglowDecay) {
        parallel::join(|| self.green.step(particles, &decay.green), || self.red.step(particles, &decay.red));
    }

    /// Sets the maps to the steady state of `particles`.
    pub(crate) fn fill_steady_state(&mut self, particles: &AuroraParticles) {
        self.green.step(particles, &DecayFactors::instantaneous());
        self.red.step(particles, &DecayFactors::instantaneous());
    }
}
