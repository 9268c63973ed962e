//! A particle flame: constants, which are built once from its parameters, and its state.

use bansho_base::{
    host::{assets::Assets, constructions},
    math::{DVec2, DVec3, random::Key},
    parameters::{Auto, Parameter},
};

use super::{
    error::{ParticleError, ParticleErrorKind},
    parameters::FlameParticlesParameters,
    render::{BufferPool, FadeOut, Gas},
};
use crate::particles::simulate::{Simulation, burner::Burner, derived::DerivedConstants, particles::Particles};

/// A particle flame at one time. As built it is at the beginning of the preroll. Runs are copies of it, which share the constants.
#[derive(Clone, Debug)]
pub struct FlameParticles {
    pub(super) name: String,
    pub(super) key: Key,
    pub(super) parameters: FlameParticlesParameters,
    pub(super) simulation: Simulation,
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
            air_temperature_k: bansho_base::world::air::Air::default().temperature_k,
            simulation: Simulation::new(&parameters, constants, key),
            buffers: BufferPool::default(),
            parameters,
        })
    }

    /// The particles of the current state.
    pub fn particles(&self) -> &Particles {
        &self.simulation.particles
    }

    /// The gas as the renderer sees it.
    pub(super) fn gas(&self) -> Gas<'_> {
        let tallest = self.tallest_burner();
        let position = DVec3::from(self.parameters.position) + tallest.position(self.time);
        Gas {
            particles: &self.simulation.particles,
            time: self.time,
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
