//! Classes of drops: bins of sizes, each of which one diameter represents, and the drops of each at a time.

use std::{f64::consts::PI, ops::RangeInclusive};

use bansho_base::{math::random::Purpose, phenomenon::surroundings::Surroundings};

use super::{
    lattice::{Lattice, LatticeMotion},
    size_distribution::{DropSizeDistribution, SizeBin},
    terminal_velocity::{FallAir, TerminalVelocity},
};
use crate::parameters::RainParameters;

/// A bin of drop sizes, represented by one diameter.
#[derive(Clone, Copy, Debug)]
struct DropClass {
    bin: SizeBin,
    /// Maximum number of drops per cubic meter in the shot.
    max_density: f64,
}

/// The classes of a rain.
#[derive(Clone, Debug)]
pub(crate) struct DropClasses {
    /// From the smallest drops to the largest.
    classes: Vec<DropClass>,
    /// In a loop, after how many seconds the rain repeats.
    pub(crate) loop_s: Option<f64>,
}

impl DropClasses {
    /// A class for each of the diameters.
    pub(crate) fn new(parameters: &RainParameters, loop_s: Option<f64>) -> Self {
        let [_, max_rate] = parameters.rate_mm_per_h.bounds();
        let sizes = DropSizeDistribution::marshall_palmer(max_rate);
        let bins = SizeBin::around(&parameters.diameters_mm).into_iter();
        Self { classes: bins.map(|bin| DropClass { bin, max_density: bin.count(&sizes) }).collect(), loop_s }
    }

    /// Rain rate R at time `t`, mm/h; periodic in a loop.
    pub(crate) fn rate(&self, parameters: &RainParameters, t: f64) -> f64 {
        parameters.rate_mm_per_h.at(self.loop_s.map_or(t, |seconds| t.rem_euclid(seconds)))
    }

    /// Area of the discs of all drops of these sizes in a cubic meter, m^2: `pi D^2 / 4` each.
    pub(crate) fn blocked_area(&self, sizes: &DropSizeDistribution) -> f64 {
        let areas = self.classes.iter().map(|DropClass { bin, .. }| {
            let disc_m2 = 0.25e-6 * PI * bin.diameter_mm * bin.diameter_mm;
            bin.count(sizes) * disc_m2
        });
        areas.sum()
    }

    /// The drops of each class at time `t` between two `heights` (m) over the `ground`, as they fall in the wind and the air of the scene.
    pub(crate) fn states(
        &self,
        parameters: &RainParameters,
        t: f64,
        surroundings: &Surroundings,
        ground: f64,
        heights: RangeInclusive<f64>,
    ) -> Vec<DropClassState> {
        let sizes = DropSizeDistribution::marshall_palmer(self.rate(parameters, t));
        let air = FallAir::at(surroundings.air.temperature_k, surroundings.air.pressure_pa);
        let velocity = TerminalVelocity { law: parameters.terminal_velocity, air };
        let (wind, response, loop_s) = (surroundings.wind, parameters.wind_response, self.loop_s);
        let mut states = Vec::with_capacity(self.classes.len());
        for (index, DropClass { bin, max_density }) in self.classes.iter().enumerate() {
            let speed = velocity.speed(bin.diameter_mm);
            states.push(DropClassState {
                index,
                diameter_mm: bin.diameter_mm,
                speed,
                max_density: *max_density,
                fraction: if *max_density > 0.0 { bin.count(&sizes) / max_density } else { 0.0 },
                lattice: Lattice::new(&LatticeMotion { speed, wind, response, ground, loop_s }, heights.clone(), t),
            });
        }
        states
    }
}

/// The drops of one diameter during an exposure.
#[derive(Clone, Debug)]
pub(crate) struct DropClassState {
    /// Index of the diameter, from the smallest.
    pub(crate) index: usize,
    /// Diameter D, mm.
    pub(crate) diameter_mm: f64,
    /// Terminal velocity v, m/s.
    pub(crate) speed: f64,
    /// Largest number of drops per cubic meter in the whole shot.
    pub(crate) max_density: f64,
    /// Fraction of these that exist now, 0 to 1.
    pub(crate) fraction: f64,
    /// The lattice of its cells.
    pub(crate) lattice: Lattice,
}

impl DropClassState {
    /// Expected number of drops in a cell now.
    pub(crate) fn count(&self) -> f64 {
        self.max_density * self.fraction * self.lattice.volume()
    }

    /// A random stream for `purpose` that no other diameter uses.
    pub(crate) fn purpose(&self, purpose: Purpose) -> Purpose {
        Purpose(purpose.0.wrapping_add(self.index as u32))
    }
}
