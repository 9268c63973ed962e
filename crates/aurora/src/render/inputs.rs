//! What a frame is drawn from: a state of the simulation, tables that depend on the parameters only, and memory that frames reuse.

use std::sync::Arc;

use bansho_base::math::{DVec3, random::Key};

use crate::{
    parameters::{AuroraParameters, RenderingParameters, Sampling},
    physics::{emission::Emission, extinction::AttenuationByDistance, precipitation::energy_grid::HIGHEST_EV},
    render::{
        bin::{EmissionInputs, nearest_node},
        diffuse::DiffuseAurora,
        integrate::{column_buffer::ChartMemory, emission_profile::EmissionProfiles},
        project::field_lines::FieldLines,
        shade::EmitterColors,
        single_collisions::collision_pass::CollisionRenderer,
    },
    simulate::AuroraSimulation,
};

/// Energy nodes above the nominal energy for which tables are computed: a factor of six, for the width of the spectrum and
/// the energy variation of rays.
const SPECTRUM_NODES: usize = 25;

/// Tables of an aurora from which its frames are drawn; all of its runs share them.
#[derive(Debug)]
pub(crate) struct RenderTables {
    pub(crate) profiles: EmissionProfiles,
    /// Profiles of the red light only, by its altitudes instead of emitters.
    pub(crate) red_profiles: EmissionProfiles,
    /// Colors of the emitters for an observer on the ground.
    pub(crate) emitter_colors: Arc<EmitterColors>,
    /// The generator of the diffuse aurora.
    pub(crate) diffuse: DiffuseAurora,
    /// The renderer of single collisions, if the scene selects them.
    pub(crate) collisions: Option<CollisionRenderer>,
}

impl RenderTables {
    /// The tables of an aurora, whose sheets have at most `max_energy_factor` times its energy; `key` is that of its tracks.
    pub(crate) fn new(parameters: &AuroraParameters, emission: &Emission, max_energy_factor: f64, key: Key) -> Self {
        let rendering = &parameters.rendering;
        let attenuation = AttenuationByDistance::new(rendering.attenuation_per_km, parameters.dip_deg);
        let collisions = (rendering.sampling != Sampling::MeanProfile).then(|| {
            let max_energy_ev = (max_energy_factor * parameters.energy_ev.bounds()[1]).min(HIGHEST_EV);
            let highest_node = nearest_node(max_energy_ev) + SPECTRUM_NODES;
            CollisionRenderer::new(emission, rendering, &attenuation, highest_node, key)
        });
        Self {
            collisions,
            diffuse: DiffuseAurora::new(&parameters.diffuse, parameters.extent_km, key),
            profiles: EmissionProfiles::new(emission, &attenuation),
            red_profiles: EmissionProfiles::red_by_altitude(emission, &attenuation),
            emitter_colors: Arc::new(EmitterColors::new(rendering, emission.lines())),
        }
    }
}

/// What a frame is drawn from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RenderInputs<'a> {
    pub(crate) simulation: &'a AuroraSimulation,
    pub(crate) tables: &'a RenderTables,
    /// Memory of charts of earlier frames.
    pub(crate) chart_memory: &'a ChartMemory,
}

impl RenderInputs<'_> {
    /// The magnetic field about an observer at a position in m.
    pub(crate) fn field_lines(&self, position: DVec3) -> FieldLines {
        let parameters = self.simulation.parameters();
        FieldLines::new(parameters.dip_deg, parameters.declination_deg, position)
    }

    /// The colors through the air that is left above an observer at an altitude.
    pub(crate) fn emitter_colors_above(&self, altitude_km: f64) -> Arc<EmitterColors> {
        let rendering = &self.simulation.parameters().rendering;
        let extinction = rendering.extinction.above(altitude_km);
        if extinction == rendering.extinction {
            return self.tables.emitter_colors.clone();
        }
        let rendering = RenderingParameters { extinction, ..rendering.clone() };
        Arc::new(EmitterColors::new(&rendering, self.simulation.emission().lines()))
    }
}

/// Inputs of the light sources of a state at time `t`, s.
pub(crate) fn emission_inputs<'a>(
    simulation: &'a AuroraSimulation,
    diffuse: &'a DiffuseAurora,
    t: f64,
) -> EmissionInputs<'a> {
    let (parameters, emission) = (simulation.parameters(), simulation.emission());
    let energy_ev = parameters.energy_ev.at(t);
    EmissionInputs {
        particles: simulation.particles(),
        afterglow: parameters.afterglow.then(|| simulation.afterglow()),
        diffuse,
        time: t,
        emission,
        parameters: &parameters.rendering,
        spacing_km: simulation.spacing_km(),
        energy_ev,
        lateral_spread_km: emission.lateral_spread_km(parameters.rendering.collision_deflection, energy_ev),
        attenuation: AttenuationByDistance::new(parameters.rendering.attenuation_per_km, parameters.dip_deg),
    }
}
