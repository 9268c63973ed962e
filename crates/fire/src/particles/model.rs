//! A particle flame: constants, which are built once from its parameters, and its state.

use bansho_base::{
    host::{assets::Assets, constructions},
    math::{DVec2, DVec3, random::Key},
    parameters::{Auto, Parameter},
    phenomenon::strip::Shutter,
};

use super::{
    error::{ParticleError, ParticleErrorKind},
    parameters::FlameParticlesParameters,
    past_states::PastStates,
    render::{BufferPool, FadeOut, Gas, GasExposure, GasState},
};
use crate::particles::simulate::{Simulation, burner::Burner, derived::DerivedConstants, particles::GasParticles};

/// A particle flame at one time. As built it is at the beginning of the preroll. Runs are copies of it, which share the constants.
#[derive(Clone, Debug)]
pub struct FlameParticles {
    pub(super) name: String,
    pub(super) key: Key,
    pub(super) parameters: FlameParticlesParameters,
    pub(super) simulation: Simulation,
    /// Earlier states from which a long exposure is drawn.
    pub(super) past: PastStates,
    /// Time of the state, s.
    pub(super) time: f64,
    /// Temperature of the air at the last step, K.
    pub(super) air_temperature_k: f64,
    /// Scratch memory of the renderer.
    pub(super) buffers: BufferPool,
}

impl FlameParticles {
    /// The particle flame `name` of a scene, before its preroll. Meshes of burners come from `assets`.
    ///
    /// # Errors
    /// The parameters contradict each other, a mesh cannot be loaded, or a keyframed value differs at the start and the end of the loop.
    pub fn new(
        mut parameters: FlameParticlesParameters,
        name: &str,
        seed: u64,
        loop_s: Option<f64>,
        assets: &dyn Assets,
    ) -> Result<Self, ParticleError> {
        if let Some(seconds) = loop_s {
            close_loop(&mut parameters, seconds)?;
        }
        constructions::count("flame_particles");
        let key = Key::new(seed, name);
        let constants = DerivedConstants::new(&parameters, loop_s, assets)?;
        let steps = (constants.preroll / parameters.step_s).round();
        Ok(Self {
            name: name.to_owned(),
            key,
            time: -steps * parameters.step_s,
            past: PastStates::new(parameters.step_s, -steps * parameters.step_s),
            air_temperature_k: bansho_base::world::air::Air::default().temperature_k,
            simulation: Simulation::new(&parameters, constants, key),
            buffers: BufferPool::default(),
            parameters,
        })
    }

    /// The particles of the current state.
    pub fn particles(&self) -> &GasParticles {
        &self.simulation.particles
    }

    /// The gas of the current state as the renderer sees it.
    pub(super) fn gas(&self) -> Gas<'_> {
        self.gas_of(&self.simulation.particles, self.time)
    }

    /// The gas of the last state that is not after `t`, as far as states are kept: also that of a part of the exposure to whose end it was stepped.
    fn gas_at(&self, t: f64) -> Gas<'_> {
        let earlier = self.past.state_at(t).filter(|_| !self.past.is_reached(self.time, t));
        earlier.map_or_else(|| self.gas(), |state| self.gas_of(&state.particles, state.time))
    }

    /// The gas of a state as the renderer sees it.
    fn gas_of<'a>(&'a self, particles: &'a GasParticles, time: f64) -> Gas<'a> {
        let tallest = self.tallest_burner();
        let position = DVec3::from(self.parameters.position) + tallest.position(time);
        Gas {
            particles,
            time,
            air_temperature_k: self.air_temperature_k,
            detail_speed: match self.parameters.rendering.detail_speed {
                Auto::Set(speed) => speed,
                Auto::Auto => ISOTROPIC_DETAIL_SPEED * tallest.axis_speed(0.5 * tallest.height),
            },
            base: position,
            size: DVec2::new(tallest.diameter, tallest.height),
            key: self.key,
            fade_out: self.fade_out(),
            buffers: &self.buffers,
        }
    }

    /// The states from which an exposure is drawn, each with its part of the exposure.
    pub(super) fn states(&self, shutter: Shutter) -> Vec<GasState<'_>> {
        let past = self.past.of_exposure(shutter).map(|state| self.gas_of(&state.particles, state.time));
        let mut gases: Vec<Gas> = past.collect();
        if self.past.is_exposed(self.time, shutter) {
            gases.push(self.gas());
        }
        if gases.is_empty() {
            gases.push(self.gas_at(shutter.middle()));
        }
        let begin = |index: usize| match gases.get(index) {
            Some(gas) if index > 0 => gas.time.max(shutter.open),
            Some(_) => shutter.open,
            None => shutter.close,
        };
        let mut states = Vec::with_capacity(gases.len());
        for (index, gas) in gases.iter().enumerate() {
            let part = Shutter { open: begin(index), close: begin(index + 1) };
            if part.close > part.open || gases.len() == 1 {
                states.push(GasState { gas: *gas, shutter: part });
            }
        }
        states
    }

    /// What an exposure sees of the gas.
    pub(super) fn exposure(&self, shutter: Shutter) -> GasExposure<'_> {
        let states = self.states(shutter);
        let middle = states.iter().rev().find(|state| self.past.is_reached(state.gas.time, shutter.middle()));
        let middle = middle.or(states.first()).map_or_else(|| self.gas(), |state| state.gas);
        GasExposure { middle, states, is_short: self.past.is_short(shutter) }
    }

    pub(super) fn fade_out(&self) -> FadeOut {
        /// Duration of the fade-out as a fraction of the time for which burnt gas remains.
        const FADE_FRACTION: f64 = 0.2;
        let seconds =
            (FADE_FRACTION * self.parameters.combustion.burnt_gas_lifetime_s).max(self.parameters.step_s) as f32;
        FadeOut { seconds, domain: self.simulation.constants.domain.map(|corner| corner.as_vec3()) }
    }

    /// The burner with the tallest flame.
    pub(super) fn tallest_burner(&self) -> &Burner {
        let burners = &self.simulation.constants.burners;
        // There is at least one burner.
        let taller = |a: &&Burner, b: &&Burner| a.height.total_cmp(&b.height);
        burners.iter().max_by(taller).unwrap_or(&burners[0])
    }
}

/// Makes keyframed values periodic in the loop.
pub(super) fn close_loop(parameters: &mut FlameParticlesParameters, seconds: f64) -> Result<(), ParticleError> {
    match parameters.close_loop(seconds) {
        Some(key) => Err(ParticleError { key, kind: ParticleErrorKind::LoopJumps { seconds } }),
        None => Ok(()),
    }
}

/// Speed of gas with isotropic detail, relative to the gas on the axis at half the height of the flame.
pub(super) const ISOTROPIC_DETAIL_SPEED: f64 = 0.35;
