//! A particle flame: what is computed from its parameters, once for all of its runs.

use std::sync::Arc;

use bansho_base::{
    host::{assets::Assets, constructions},
    math::random::Key,
    parameters::Parameter,
};

use super::{
    error::{ParticleError, ParticleErrorKind},
    parameters::FlameParticlesParameters,
};
use crate::particles::simulate::{SimulationConstants, burner::Burner, derived::DerivedConstants};

/// A particle flame of a scene: its parameters, and the constants of its simulation. It does not change; a run of it is a
/// [`FlameParticlesRun`](super::FlameParticlesRun).
#[derive(Debug)]
pub struct FlameParticles {
    pub(super) name: String,
    pub(super) constants: Arc<SimulationConstants>,
}

impl FlameParticles {
    /// The particle flame `name` of a scene. Meshes of burners come from `assets`.
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
        let derived = DerivedConstants::new(&parameters, loop_s, assets)?;
        let constants = SimulationConstants::new(parameters, derived, Key::new(seed, name));
        Ok(Self { name: name.to_owned(), constants: Arc::new(constants) })
    }

    /// Its parameters.
    pub(super) fn parameters(&self) -> &FlameParticlesParameters {
        &self.constants.parameters
    }

    /// The burner with the tallest flame.
    pub(super) fn tallest_burner(&self) -> &Burner {
        let burners = &self.constants.derived.burners;
        // There is at least one burner.
        burners.iter().max_by(|a, b| a.height.total_cmp(&b.height)).unwrap_or(&burners[0])
    }
}

/// Makes keyframed values periodic in the loop.
pub(super) fn close_loop(parameters: &mut FlameParticlesParameters, seconds: f64) -> Result<(), ParticleError> {
    match parameters.close_loop(seconds) {
        Some(key) => Err(ParticleError { key, kind: ParticleErrorKind::LoopJumps { seconds } }),
        None => Ok(()),
    }
}
