//! Rain: what is built once from its parameters.

use std::{ops::RangeInclusive, sync::LazyLock};

use bansho_base::{
    host::constructions,
    math::random::Key,
    parameters::{ParameterError, ParameterErrorKind},
    phenomenon::surroundings::Surroundings,
    world::wind::Wind,
};

use super::parameters::RainParameters;
use crate::{
    drops::{
        exposure::{DropClassState, ground_height},
        lattice::{Lattice, LatticeMotion},
        size_distribution::{DropSizeDistribution, SizeBin},
        terminal_velocity::{Air, TerminalVelocity},
    },
    lighting::{
        drop_lighting::ScatteringTable,
        drop_phase_function::DropPhaseFunction,
        extinction::{ExtinctionEfficiency, extinction},
        sky::SkyLightingCache,
    },
};

/// How far it rains over ground that leads to the horizon, m.
pub(super) const HORIZON: f64 = 2e4;

/// Rain, ready to be drawn at any time.
#[derive(Debug)]
pub struct Rain {
    pub(super) name: String,
    pub(super) parameters: RainParameters,
    pub(super) key: Key,
    pub(super) optics: &'static Optics,
    pub(super) skies: SkyLightingCache,
    pub(super) classes: Vec<Class>,
    pub(super) loop_s: Option<f64>,
}

/// How a drop sends light on: the same for all rain.
#[derive(Debug)]
pub(super) struct Optics {
    pub(super) lens: DropPhaseFunction,
    pub(super) scattering: ScatteringTable,
}

pub(super) static OPTICS: LazyLock<Optics> = LazyLock::new(|| {
    let lens = DropPhaseFunction::new();
    Optics { scattering: ScatteringTable::new(&lens), lens }
});

/// The drops that one diameter stands for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Class {
    pub(super) bin: SizeBin,
    /// Terminal velocity, m/s.
    pub(super) speed: f64,
    /// Most drops a cubic meter in the shot.
    pub(super) most: f64,
}

impl Rain {
    /// The rain `name` of a scene; in a seamless loop it repeats every `loop_s` seconds.
    ///
    /// # Errors
    /// Diameters that do not ascend, or a loop that is no length of time.
    pub fn new(parameters: RainParameters, name: &str, seed: u64, loop_s: Option<f64>) -> Result<Self, ParameterError> {
        if let Some(seconds) = loop_s.filter(|seconds| !(*seconds > 0.0 && seconds.is_finite())) {
            return Err(ParameterError { key: "loop", kind: ParameterErrorKind::LoopLength { seconds } });
        }
        if let Some(pair) = parameters.diameters_mm.windows(2).find(|pair| pair[1] <= pair[0]) {
            let kind = ParameterErrorKind::NotAscending { value: pair[0], next: pair[1] };
            return Err(ParameterError { key: "diameters_mm", kind });
        }
        constructions::count("rain");
        let velocity = TerminalVelocity { law: parameters.terminal_velocity, air: Air::default() };
        let [_, heaviest] = parameters.rate_mm_per_h.bounds();
        let sizes = DropSizeDistribution::marshall_palmer(heaviest);
        let class = |bin: SizeBin| Class { bin, speed: velocity.speed(bin.diameter_mm), most: bin.count(&sizes) };
        let classes = SizeBin::around(&parameters.diameters_mm).into_iter().map(class).collect();
        Ok(Self {
            name: name.to_owned(),
            key: Key::new(seed, name),
            optics: &OPTICS,
            skies: SkyLightingCache::default(),
            classes,
            loop_s,
            parameters,
        })
    }

    /// Its parameters.
    pub fn parameters(&self) -> &RainParameters {
        &self.parameters
    }

    /// Rain rate R at time `t`, mm/h. A loop ends with the rate that it begins with.
    pub(super) fn rate(&self, t: f64) -> f64 {
        self.parameters.rate_mm_per_h.at(self.loop_s.map_or(t, |seconds| t.rem_euclid(seconds)))
    }

    /// The drops of each diameter at time `t` between two `heights` (m) over the `ground`.
    pub(super) fn classes(
        &self,
        t: f64,
        wind: &Wind,
        ground: f64,
        heights: RangeInclusive<f64>,
    ) -> Vec<DropClassState> {
        let sizes = DropSizeDistribution::marshall_palmer(self.rate(t));
        let (response, loop_s) = (self.parameters.wind_response, self.loop_s);
        let now = |(index, class): (usize, &Class)| DropClassState {
            index,
            diameter_mm: class.bin.diameter_mm,
            speed: class.speed,
            max_density: class.most,
            fraction: if class.most > 0.0 { class.bin.count(&sizes) / class.most } else { 0.0 },
            lattice: Lattice::new(
                &LatticeMotion { speed: class.speed, wind, response, ground, loop_s },
                heights.clone(),
                t,
            ),
        };
        self.classes.iter().enumerate().map(now).collect()
    }

    /// No streak is further from the camera, m.
    pub(super) fn streaks_end(&self) -> f64 {
        (1.2 * self.parameters.distance).max(self.parameters.splashes.distance + 1.0)
    }

    /// How far from the camera there is any rain before a plate, m.
    pub(super) fn near_reach(&self) -> f64 {
        1.2 * self.parameters.distance + self.parameters.airlight_distance
    }

    /// How far from the camera there is any rain, m: over ground that leads to the horizon as far as it.
    pub(super) fn reach(&self, surroundings: &Surroundings) -> f64 {
        let horizon =
            self.parameters.airlight_distance > 0.0 && ground_height(&surroundings.others.occluders).is_some();
        if horizon { HORIZON.max(self.near_reach()) } else { self.near_reach() }
    }

    /// Extinction of all drops, and of those alone that are drawn as streaks, at time `t`, Q = 1, 1/m.
    pub(super) fn extinctions(&self, t: f64) -> [f64; 2] {
        let sizes = DropSizeDistribution::marshall_palmer(self.rate(t));
        let gain = self.parameters.opacity_gain;
        let disc = |class: &Class| 0.25e-6 * std::f64::consts::PI * class.bin.diameter_mm * class.bin.diameter_mm;
        let drawn: f64 = self.classes.iter().map(|class| class.bin.count(&sizes) * disc(class)).sum();
        let all = extinction(&sizes, ExtinctionEfficiency::Geometric, DropSizeDistribution::ALL);
        [gain * all.max(drawn), gain * drawn]
    }
}
