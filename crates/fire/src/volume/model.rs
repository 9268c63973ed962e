//! A volume flame: what is computed from its parameters, once for all of its runs.

use std::sync::Arc;

use bansho_base::{
    host::{assets::Assets, constructions},
    math::random::Key,
    parameters::{Auto, Parameter},
};

use super::{
    error::{VolumeError, VolumeErrorKind},
    fuel::FuelProperties,
    parameters::FlameVolumeParameters,
    simulate::{SimulationConstants, burners::VolumeBurner, domain},
};

/// A volume flame of a scene. It does not change; a run of it is a [`FlameVolumeRun`](super::FlameVolumeRun).
#[derive(Debug)]
pub struct FlameVolume {
    pub(super) name: String,
    pub(super) constants: Arc<SimulationConstants>,
    /// Duration of the simulation before time 0, s.
    pub(super) preroll: f64,
    pub(super) crossfade: f64,
}

impl FlameVolume {
    /// The volume flame `name` of a scene. Meshes of burners come from `assets`.
    ///
    /// # Errors
    /// The parameters contradict each other, the grid does not fit in memory, or a mesh cannot be loaded.
    pub fn new(
        mut parameters: FlameVolumeParameters,
        name: &str,
        seed: u64,
        loop_s: Option<f64>,
        assets: &dyn Assets,
    ) -> Result<Self, VolumeError> {
        if let Some(seconds) = loop_s
            && let Some(key) = parameters.close_loop(seconds)
        {
            return Err(VolumeError { key, kind: VolumeErrorKind::LoopJumps { seconds } });
        }
        constructions::count("flame_volume");
        let key = Key::new(seed, name);
        let burners = VolumeBurner::list(&parameters, key, assets)?;
        let size = domain::FireSize::new(&burners);
        let coarse_grid = domain::coarse_grid(&parameters, &burners, &size)?;
        let fuel = fuel_of(&parameters);
        // Gas crosses the domain a few times in these times, at the speed of free fall over its height.
        let height = coarse_grid.size[1] as f64 * coarse_grid.spacing;
        let crossing = 2.0 * bansho_base::math::sqrt(height / bansho_base::world::gravity::STANDARD_GRAVITY);
        let crossfade = loop_s.map_or(0.0, |seconds| (0.8 * crossing).min(seconds));
        let preroll = match parameters.preroll_s {
            Auto::Set(seconds) => seconds,
            Auto::Auto => (2.5 * crossing).min(20.0),
        } + 0.5 * crossfade;
        // The time of the last eddies is computed on the flame's own grid.
        let refined_from = -(0.7 * crossing + 0.5 * crossfade);
        let constants = SimulationConstants { parameters, fuel, burners, size, coarse_grid, refined_from, key };
        Ok(Self { name: name.to_owned(), constants: Arc::new(constants), preroll, crossfade })
    }

    /// Its parameters.
    pub(super) fn parameters(&self) -> &FlameVolumeParameters {
        &self.constants.parameters
    }
}

/// The properties of the fuel of a flame, with those that its table states.
pub(super) fn fuel_of(parameters: &FlameVolumeParameters) -> FuelProperties {
    let own = parameters.fuel.properties();
    let gas = &parameters.gas;
    let stated = |value: Auto<f64>, of_fuel: f64| match value {
        Auto::Set(value) => value,
        Auto::Auto => of_fuel,
    };
    FuelProperties {
        radiant_fraction: stated(gas.radiant_fraction, own.radiant_fraction),
        soot_ppm: stated(gas.soot_ppm, own.soot_ppm),
        smoke_yield: stated(gas.smoke_yield, own.smoke_yield),
        flame_temperature_k: stated(gas.flame_temperature_k, own.flame_temperature_k),
        burner_temperature_k: if own.stoichiometric >= 1.0 {
            stated(gas.flame_temperature_k, own.burner_temperature_k)
        } else {
            own.burner_temperature_k
        },
        ..own
    }
}
