//! An aurora: the constants that are computed from its parameters, and the state of a run.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    color,
    host::{assets::Assets, constructions, once::get_or_compute},
    math::{DVec3, random::Key},
    parameters::Parameter,
};

use super::{
    AuroraParameters,
    parameters::{check_color_matching, check_energies},
    render::{RenderingParameters, Sampling},
    shapes::{Sequence, ShapeError, ShapeErrorKind},
    simulate::{AuroraSimulation, check_neighbors},
};
use crate::{
    physics::{
        attenuation_by_distance::AttenuationByDistance, emission::Emission, precipitation::energy_grid::HIGHEST_EV,
    },
    render::{
        bin::sources::{EmissionInputs, nearest_node},
        integrate::{chart_memory::ChartMemory, emission_profile::EmissionProfiles},
        project::field_lines::FieldLines,
        shade::attenuation::EmitterColors,
        single_collisions::collision_pass::CollisionRenderer,
    },
};

/// Luminance of the bright parts of a picture relative to that of the brightest vertical column. Sheets are thin, and most
/// lines of sight pass them obliquely.
pub(super) const OBLIQUE_LUMINANCE_FACTOR: f64 = 0.75;

/// Energy nodes above the nominal energy for which tables are computed: a factor of six, for the width of the spectrum and
/// the energy variation of rays.
pub(super) const SPECTRUM_NODES: usize = 25;

/// An aurora, ready to be stepped and drawn. The prototype that is built is at its initial state; runs are copies of it, which share
/// all constants.
#[derive(Clone, Debug)]
pub struct Aurora {
    pub(super) name: String,
    pub(super) seed: u64,
    pub(super) parameters: AuroraParameters,
    pub(super) sequence: Arc<Sequence>,
    emission: Arc<Emission>,
    /// Created when the run is first stepped or drawn: a scene may have hundreds of auroras, and checking it constructs them all.
    pub(super) run_state: OnceLock<RunState>,
    /// Initial state of every run: created by the first run that needs it, shared by all.
    pub(super) initial_state: Arc<OnceLock<RunState>>,
    /// Memory of the charts of all runs.
    pub(super) chart_memory: Arc<ChartMemory>,
    /// Luminance of the brightest column of all shapes, cd/m^2.
    pub(super) max_column_luminance: f64,
    /// The first shape, counted from 0, whose transition has sheets that cross.
    pub(super) crossing: Option<usize>,
    /// In a loop, duration of the crossfade from one run to the next, s.
    pub(super) crossfade_s: f64,
}

/// State of a run, and the tables with which it is drawn.
#[derive(Clone, Debug)]
pub(super) struct RunState {
    pub(super) simulation: AuroraSimulation,
    pub(super) profiles: Arc<EmissionProfiles>,
    pub(super) red_profiles: Arc<EmissionProfiles>,
    pub(super) emitter_colors: Arc<EmitterColors>,
    pub(super) collisions: Option<Arc<CollisionRenderer>>,
}

/// Maximum duration of the crossfade of a loop, s: in this time particles move far along their sheets.
pub(super) const MAX_CROSSFADE_S: f64 = 10.0;

/// Makes animated parameters periodic in `loop_s` seconds and extends the preroll by half the duration of the crossfade,
/// which is returned.
pub(super) fn close_loop(parameters: &mut AuroraParameters, loop_s: f64) -> Result<f64, ShapeError> {
    if let Some(key) = parameters.close_loop(loop_s) {
        return Err(ShapeError { key, kind: ShapeErrorKind::LoopJumps { seconds: loop_s } });
    }
    let crossfade_s = loop_s.min(MAX_CROSSFADE_S);
    parameters.preroll_s += 0.5 * crossfade_s;
    Ok(crossfade_s)
}

/// Maximum luminance of a vertical column at control points with these factors of flux and energy, cd/m^2: that at the lowest
/// energy and the highest flux.
pub(super) fn max_column_luminance(parameters: &AuroraParameters, emission: &Emission, factors: &[[f64; 2]]) -> f64 {
    let (flux, energy_ev) = (parameters.flux_mw_per_m2.bounds()[1], parameters.energy_ev.bounds()[0]);
    let luminance = |[flux_factor, energy_factor]: &[f64; 2]| {
        let column = emission.column_color(energy_ev * energy_factor).map(|value| value as f32);
        flux * flux_factor * f64::from(color::luminance(column))
    };
    factors.iter().map(luminance).fold(0.0, f64::max)
}

impl Aurora {
    /// The aurora `name` of a scene; SVG files of its shapes are loaded from `assets`.
    ///
    /// # Errors
    /// Invalid shapes; energies outside the tables; flux or energy that differ between the start and the end of a loop.
    pub fn new(
        mut parameters: AuroraParameters,
        name: &str,
        seed: u64,
        loop_s: Option<f64>,
        assets: &dyn Assets,
    ) -> Result<Self, ShapeError> {
        constructions::count("aurora");
        let sequence = Sequence::new(&parameters.shapes, &parameters.morphing, parameters.extent_km, assets, loop_s)?;
        let crossfade_s = loop_s.map_or(Ok(0.0), |loop_s| close_loop(&mut parameters, loop_s))?;
        check_energies(&parameters)?;
        check_color_matching(&parameters)?;
        let lengths = sequence.arrivals().iter().map(|time| sequence.at(*time).length());
        check_neighbors(&parameters, lengths.fold(f64::INFINITY, f64::min))?;
        let crossing = sequence.crossing();
        let factors: Vec<[f64; 2]> = sequence.factors().collect();
        let emission = parameters.rendering.emission(parameters.spectrum);
        Ok(Self {
            name: name.to_owned(),
            seed,
            max_column_luminance: max_column_luminance(&parameters, &emission, &factors),
            emission,
            run_state: OnceLock::new(),
            initial_state: Arc::default(),
            chart_memory: Arc::default(),
            parameters,
            sequence: Arc::new(sequence),
            crossing,
            crossfade_s,
        })
    }

    pub(super) fn run_state(&self) -> &RunState {
        get_or_compute(&self.run_state, || get_or_compute(&self.initial_state, || self.new_run_state()).clone())
    }

    pub(super) fn new_run_state(&self) -> RunState {
        let (sequence, emission) = (self.sequence.clone(), self.emission.clone());
        let simulation =
            AuroraSimulation::with_emission(self.parameters.clone(), sequence, emission, &self.name, self.seed);
        let (parameters, emission) = (simulation.parameters(), simulation.emission());
        let by_collisions = parameters.rendering.sampling == Sampling::SingleCollisions;
        let max_factor = self.sequence.factors().fold(1.0, |max: f64, [_, energy]| max.max(energy));
        let max_energy_ev = (max_factor * parameters.energy_ev.bounds()[1]).min(HIGHEST_EV);
        let highest_node = nearest_node(max_energy_ev) + SPECTRUM_NODES;
        let key = Key::new(self.seed, &self.name);
        let attenuation = AttenuationByDistance::new(parameters.rendering.attenuation_per_km, parameters.dip_deg);
        let collisions = || CollisionRenderer::new(emission, &parameters.rendering, &attenuation, highest_node, key);
        RunState {
            collisions: by_collisions.then(|| Arc::new(collisions())),
            profiles: Arc::new(EmissionProfiles::new(emission, &attenuation)),
            red_profiles: Arc::new(EmissionProfiles::red_by_altitude(emission, &attenuation)),
            emitter_colors: Arc::new(EmitterColors::new(&parameters.rendering, emission.lines())),
            simulation,
        }
    }

    /// Its shapes in time.
    pub(crate) fn sequence(&self) -> &Sequence {
        &self.sequence
    }

    /// Its particles, field and afterglow.
    #[must_use]
    pub fn simulation(&self) -> &AuroraSimulation {
        &self.run_state().simulation
    }

    /// Mutable [`Self::simulation`].
    pub(super) fn simulation_mut(&mut self) -> Option<&mut AuroraSimulation> {
        self.run_state();
        self.run_state.get_mut().map(|state| &mut state.simulation)
    }

    pub(super) fn profiles(&self) -> &EmissionProfiles {
        &self.run_state().profiles
    }

    /// Profiles of the red light only, by its altitudes instead of emitters.
    pub(super) fn red_profiles(&self) -> &EmissionProfiles {
        &self.run_state().red_profiles
    }

    pub(super) fn emitter_colors(&self) -> &Arc<EmitterColors> {
        &self.run_state().emitter_colors
    }

    /// The colors through the air that is left above an observer at an altitude.
    pub(super) fn emitter_colors_above(&self, altitude_km: f64) -> Arc<EmitterColors> {
        let rendering = &self.parameters.rendering;
        let extinction = rendering.extinction.above(altitude_km);
        if extinction == rendering.extinction {
            return self.emitter_colors().clone();
        }
        let rendering = RenderingParameters { extinction, ..rendering.clone() };
        Arc::new(EmitterColors::new(&rendering, self.simulation().emission().lines()))
    }

    /// The renderer of single collisions, if the scene selects them.
    pub(super) fn collisions(&self) -> Option<&CollisionRenderer> {
        self.run_state().collisions.as_deref()
    }

    /// The magnetic field about an observer at a position in m.
    pub(super) fn field_lines(&self, position: DVec3) -> FieldLines {
        FieldLines::new(self.parameters.dip_deg, self.parameters.declination_deg, position)
    }

    /// Inputs of the light sources of a simulation state at time `t`, s.
    pub(super) fn emission_inputs<'a>(&self, simulation: &'a AuroraSimulation, t: f64) -> EmissionInputs<'a> {
        let parameters = simulation.parameters();
        let energy_ev = parameters.energy_ev.at(t);
        EmissionInputs {
            particles: simulation.particles(),
            afterglow: parameters.afterglow.then(|| simulation.afterglow()),
            emission: simulation.emission(),
            parameters: &parameters.rendering,
            spacing_km: simulation.spacing_km(),
            energy_ev,
            lateral_spread_km: simulation
                .emission()
                .lateral_spread_km(parameters.rendering.collision_deflection, energy_ev),
            attenuation: AttenuationByDistance::new(parameters.rendering.attenuation_per_km, parameters.dip_deg),
        }
    }
}
