//! Rain: the constants that are computed once from its parameters.

use std::sync::LazyLock;

use bansho_base::{
    host::constructions,
    math::random::Key,
    parameters::{ParameterError, ParameterErrorKind},
    phenomenon::{strip::View, surroundings::Surroundings},
};

use super::parameters::{Method, RainParameters};
use crate::{
    billboards::texture::{StreakQuantity, StreakTextureError},
    drops::{
        classes::DropClasses,
        shutter_state::{ShutterState, ground_height},
        size_distribution::DropSizeDistribution,
    },
    lighting::{
        drop_lighting::ScatteringTable,
        drop_phase_function::DropPhaseFunction,
        extinction::{ExtinctionEfficiency, RainExtinction, extinction},
    },
    textured_billboards::TextureSet,
};

/// Extent of the rain over ground that extends to the horizon, m.
pub(super) const HORIZON: f64 = 2e4;

/// Rain of a scene: its parameters and what follows from them, for any time. It does not change; a run of it is a [`RainRun`](crate::RainRun).
#[derive(Debug)]
pub struct Rain {
    pub(super) name: String,
    pub(super) parameters: RainParameters,
    pub(super) key: Key,
    pub(super) optics: &'static Optics,
    pub(super) classes: DropClasses,
    /// With `method = "textures"`: those of all rates and diameters.
    pub(super) textures: Option<TextureSet>,
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
        Ok(Self {
            name: name.to_owned(),
            key: Key::new(seed, name),
            optics: &OPTICS,
            classes: DropClasses::new(&parameters, loop_s),
            textures,
            parameters,
        })
    }

    /// Its parameters.
    pub fn parameters(&self) -> &RainParameters {
        &self.parameters
    }

    /// Rain rate R at time `t`, mm/h; periodic in a loop.
    pub(super) fn rate(&self, t: f64) -> f64 {
        self.classes.rate(&self.parameters, t)
    }

    /// The drops during the exposure of a view, as they fall in the wind and the air of the scene.
    pub(super) fn shutter_state(&self, view: &View, surroundings: &Surroundings) -> ShutterState {
        ShutterState::new(&self.parameters, self.key, &self.classes, view, surroundings)
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
        let streaks = self.classes.blocked_area(&sizes);
        let all = extinction(&sizes, ExtinctionEfficiency::Geometric, DropSizeDistribution::ALL);
        RainExtinction { all: gain * all.max(streaks), streaks: gain * streaks }
    }
}
