//! Rain: the constants that are computed once from its parameters.

use std::{ops::RangeInclusive, sync::LazyLock};

use bansho_base::{
    host::constructions,
    math::random::Key,
    parameters::{ParameterError, ParameterErrorKind},
    phenomenon::surroundings::Surroundings,
};

use super::parameters::{Method, RainParameters};
use crate::{
    billboards::texture::{StreakQuantity, StreakTextureError},
    drops::{
        lattice::{Lattice, LatticeMotion},
        shutter_state::{DropClassState, ground_height},
        size_distribution::{DropSizeDistribution, SizeBin},
        terminal_velocity::{FallAir, TerminalVelocity},
    },
    lighting::{
        drop_lighting::ScatteringTable,
        drop_phase_function::DropPhaseFunction,
        extinction::{ExtinctionEfficiency, RainExtinction, extinction},
        in_scattering::LampScatteringCache,
        sky::SkyLightingCache,
    },
    textured_billboards::TextureSet,
};

/// Extent of the rain over ground that extends to the horizon, m.
pub(super) const HORIZON: f64 = 2e4;

/// Rain, ready to be drawn at any time.
#[derive(Debug)]
pub struct Rain {
    pub(super) name: String,
    pub(super) parameters: RainParameters,
    pub(super) key: Key,
    pub(super) optics: &'static Optics,
    pub(super) skies: SkyLightingCache,
    /// Scattered light of lamps that was computed already.
    pub(super) lamp_scattering: LampScatteringCache,
    pub(super) classes: Vec<DropClass>,
    /// With `method = "textures"`: those of all rates and diameters.
    pub(super) textures: Option<TextureSet>,
    pub(super) loop_s: Option<f64>,
}

/// Scattering of light by drops, the same for all rain.
#[derive(Debug)]
pub(super) struct Optics {
    pub(super) phase_function: DropPhaseFunction,
    pub(super) scattering: ScatteringTable,
}

pub(super) static OPTICS: LazyLock<Optics> = LazyLock::new(|| {
    let phase_function = DropPhaseFunction::new();
    Optics { scattering: ScatteringTable::new(&phase_function), phase_function }
});

/// The parameter for which the textures of `method = "textures"` cannot be drawn.
fn texture_error(error: &StreakTextureError) -> ParameterError {
    let is_of_rate = matches!(error, StreakTextureError::OutOfRange { quantity: StreakQuantity::MeanDropCount, .. });
    let (key, allowed) = match is_of_rate {
        true => ("texture_rates_mm_per_h", "rates that occur in rain, 0.1 to 300"),
        false => ("diameters_mm", "diameters that occur in rain, 0.1 to 8"),
    };
    ParameterError { key, kind: ParameterErrorKind::NotWith { allowed, other: "`method = \"textures\"`" } }
}

/// A bin of drop sizes, represented by one diameter.
#[derive(Clone, Copy, Debug)]
pub(super) struct DropClass {
    pub(super) bin: SizeBin,
    /// Maximum number of drops per cubic meter in the shot.
    pub(super) max_density: f64,
}

impl Rain {
    /// The rain `name` of a scene; in a seamless loop it repeats every `loop_s` seconds.
    ///
    /// # Errors
    /// Diameters or rates of textures that are not ascending, or a loop whose length is not a positive number.
    pub fn new(parameters: RainParameters, name: &str, seed: u64, loop_s: Option<f64>) -> Result<Self, ParameterError> {
        if let Some(seconds) = loop_s.filter(|seconds| !(*seconds > 0.0 && seconds.is_finite())) {
            return Err(ParameterError { key: "loop", kind: ParameterErrorKind::LoopLength { seconds } });
        }
        let lists = [
            ("diameters_mm", &parameters.diameters_mm),
            ("texture_rates_mm_per_h", &parameters.texture_rates_mm_per_h),
        ];
        for (key, values) in lists {
            if let Some(pair) = values.windows(2).find(|pair| pair[1] <= pair[0]) {
                let kind = ParameterErrorKind::NotAscending { value: pair[0], next: pair[1] };
                return Err(ParameterError { key, kind });
            }
        }
        constructions::count("rain");
        let textures = (parameters.method == Method::Textures).then(|| TextureSet::new(&parameters, seed));
        let textures = textures.transpose().map_err(|error| texture_error(&error))?;
        let [_, max_rate] = parameters.rate_mm_per_h.bounds();
        let sizes = DropSizeDistribution::marshall_palmer(max_rate);
        let class = |bin: SizeBin| DropClass { bin, max_density: bin.count(&sizes) };
        let classes = SizeBin::around(&parameters.diameters_mm).into_iter().map(class).collect();
        Ok(Self {
            name: name.to_owned(),
            key: Key::new(seed, name),
            optics: &OPTICS,
            skies: SkyLightingCache::default(),
            lamp_scattering: LampScatteringCache::default(),
            classes,
            textures,
            loop_s,
            parameters,
        })
    }

    /// Its parameters.
    pub fn parameters(&self) -> &RainParameters {
        &self.parameters
    }

    /// Rain rate R at time `t`, mm/h; periodic in a loop.
    pub(super) fn rate(&self, t: f64) -> f64 {
        self.parameters.rate_mm_per_h.at(self.loop_s.map_or(t, |seconds| t.rem_euclid(seconds)))
    }

    /// The drops of each diameter at time `t` between two `heights` (m) over the `ground`, as they fall in the wind and the air of the scene.
    pub(super) fn classes(
        &self,
        t: f64,
        surroundings: &Surroundings,
        ground: f64,
        heights: RangeInclusive<f64>,
    ) -> Vec<DropClassState> {
        let sizes = DropSizeDistribution::marshall_palmer(self.rate(t));
        let air = FallAir::at(surroundings.air.temperature_k, surroundings.air.pressure_pa);
        let velocity = TerminalVelocity { law: self.parameters.terminal_velocity, air };
        let (wind, response, loop_s) = (surroundings.wind, self.parameters.wind_response, self.loop_s);
        let state = |(index, class): (usize, &DropClass)| {
            let speed = velocity.speed(class.bin.diameter_mm);
            DropClassState {
                index,
                diameter_mm: class.bin.diameter_mm,
                speed,
                max_density: class.max_density,
                fraction: if class.max_density > 0.0 { class.bin.count(&sizes) / class.max_density } else { 0.0 },
                lattice: Lattice::new(&LatticeMotion { speed, wind, response, ground, loop_s }, heights.clone(), t),
            }
        };
        self.classes.iter().enumerate().map(state).collect()
    }

    /// Maximum distance of a streak from the camera, m.
    pub(super) fn streaks_end(&self) -> f64 {
        (1.2 * self.parameters.distance).max(self.parameters.splashes.distance + 1.0)
    }

    /// Maximum distance of rain from the camera in front of a plate, m.
    pub(super) fn near_reach(&self) -> f64 {
        1.2 * self.parameters.distance + self.parameters.airlight_distance
    }

    /// Maximum distance of rain from the camera, m: that of the horizon over ground that extends to it.
    pub(super) fn reach(&self, surroundings: &Surroundings) -> f64 {
        let is_endless =
            self.parameters.airlight_distance > 0.0 && ground_height(&surroundings.others.occluders).is_some();
        if is_endless { HORIZON.max(self.near_reach()) } else { self.near_reach() }
    }

    /// Extinction coefficients at time `t`, with Q = 1.
    pub(super) fn extinction(&self, t: f64) -> RainExtinction {
        let sizes = DropSizeDistribution::marshall_palmer(self.rate(t));
        let gain = self.parameters.opacity_gain;
        let disc = |class: &DropClass| 0.25e-6 * std::f64::consts::PI * class.bin.diameter_mm * class.bin.diameter_mm;
        let streaks: f64 = self.classes.iter().map(|class| class.bin.count(&sizes) * disc(class)).sum();
        let all = extinction(&sizes, ExtinctionEfficiency::Geometric, DropSizeDistribution::ALL);
        RainExtinction { all: gain * all.max(streaks), streaks: gain * streaks }
    }
}
