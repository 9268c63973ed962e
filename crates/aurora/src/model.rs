//! An aurora: what is built from its parameters, and its state.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    color,
    host::{assets::Assets, constructions, once::get_or_compute},
    math::{DVec3, random::Key},
    parameters::Parameter,
};

use super::{
    AuroraParameters,
    parameters::check_energies,
    render::Sampling,
    shapes::{Sequence, ShapeError, ShapeErrorKind},
    simulate::AuroraSimulation,
};
use crate::{
    physics::{
        emission::Emission,
        precipitation::{energy_grid::HIGHEST_EV, lateral_spread::lateral_spread_km},
    },
    render::{
        bin::sources::{EmissionInputs, nearest_node},
        integrate::emission_profile::EmissionProfiles,
        project::field_lines::FieldLines,
        shade::attenuation::EmitterColors,
        single_collisions::collision_pass::CollisionRenderer,
    },
};

/// Sheets are thin: their bright parts seen aslant beside what looks straight up through one.
pub(super) const BRIGHT_PER_COLUMN: f64 = 0.75;

/// How far a spectrum reaches beyond its energy, and rays beyond that, in nodes of the grid of energies: sixfold.
pub(super) const SPECTRUM_NODES: usize = 25;

/// An aurora, ready to be stepped and drawn. The one that is built stands at its beginning; runs are copies of it, which share what is fixed.
#[derive(Clone, Debug)]
pub struct Aurora {
    pub(super) name: String,
    pub(super) seed: u64,
    pub(super) parameters: AuroraParameters,
    pub(super) sequence: Arc<Sequence>,
    /// Made when it is first stepped or drawn: there may be hundreds of auroras, each of which is made to be checked.
    pub(super) working: OnceLock<Working>,
    /// How every run begins: made by the first run that needs it, shared by all.
    pub(super) beginning: Arc<OnceLock<Working>>,
    /// Luminance of the brightest column of all shapes, cd/m^2.
    pub(super) brightest: f64,
    /// The shape, counted from 0, on whose way sheets first pass through each other.
    pub(super) crossing: Option<usize>,
    /// In a loop: for how long one run passes into the next, s.
    pub(super) dissolve: f64,
}

/// An aurora at work: its state, and what it is drawn with.
#[derive(Clone, Debug)]
pub(super) struct Working {
    pub(super) simulation: AuroraSimulation,
    pub(super) profiles: Arc<EmissionProfiles>,
    pub(super) red_profiles: Arc<EmissionProfiles>,
    pub(super) emitter_colors: Arc<EmitterColors>,
    pub(super) collisions: Option<Arc<CollisionRenderer>>,
}

/// Longest dissolve in a loop, s: by then particles have gone a long way along their sheets.
pub(super) const LONGEST_DISSOLVE_S: f64 = 10.0;

/// Makes what is keyed repeat after `turn` seconds, and room in the preroll for half the dissolve that it gives.
pub(super) fn close_loop(parameters: &mut AuroraParameters, turn: f64) -> Result<f64, ShapeError> {
    if let Some(key) = parameters.close_loop(turn) {
        return Err(ShapeError { key, kind: ShapeErrorKind::LoopJumps { seconds: turn } });
    }
    let dissolve = turn.min(LONGEST_DISSOLVE_S);
    parameters.preroll_s += 0.5 * dissolve;
    Ok(dissolve)
}

/// Luminance of the brightest column among control points with these factors of flux and energy, cd/m^2: the softest electrons at the
/// greatest flux.
pub(super) fn brightest(parameters: &AuroraParameters, emission: &Emission, factors: &[[f64; 2]]) -> f64 {
    let (flux, energy_ev) = (parameters.flux_mw_per_m2.bounds()[1], parameters.energy_ev.bounds()[0]);
    let luminance = |[flux_factor, energy_factor]: &[f64; 2]| {
        let column = emission.column_color(energy_ev * energy_factor).map(|value| value as f32);
        flux * flux_factor * f64::from(color::luminance(column))
    };
    factors.iter().map(luminance).fold(0.0, f64::max)
}

impl Aurora {
    /// The aurora `name` of a scene; drawings of its shapes come from `assets`.
    ///
    /// # Errors
    /// Shapes that are no aurora's, flux or energy that do not end a loop as they begin it.
    pub fn new(
        mut parameters: AuroraParameters,
        name: &str,
        seed: u64,
        loop_s: Option<f64>,
        assets: &dyn Assets,
    ) -> Result<Self, ShapeError> {
        constructions::count("aurora");
        let sequence = Sequence::new(&parameters.shapes, &parameters.morphing, parameters.extent_km, assets, loop_s)?;
        let dissolve = loop_s.map_or(Ok(0.0), |turn| close_loop(&mut parameters, turn))?;
        check_energies(&parameters)?;
        let crossing = sequence.crossing();
        let factors: Vec<[f64; 2]> = sequence.factors().collect();
        let emission = parameters.rendering.energy_deposition.shared_emission(parameters.spectrum);
        Ok(Self {
            name: name.to_owned(),
            seed,
            brightest: brightest(&parameters, emission, &factors),
            working: OnceLock::new(),
            beginning: Arc::default(),
            parameters,
            sequence: Arc::new(sequence),
            crossing,
            dissolve,
        })
    }

    pub(super) fn working(&self) -> &Working {
        get_or_compute(&self.working, || get_or_compute(&self.beginning, || self.set_to_work()).clone())
    }

    pub(super) fn set_to_work(&self) -> Working {
        let simulation = AuroraSimulation::new(self.parameters.clone(), self.sequence.clone(), &self.name, self.seed);
        let (parameters, emission) = (simulation.parameters(), simulation.emission());
        let by_collisions = parameters.rendering.sampling == Sampling::SingleCollisions;
        let hardest = self.sequence.factors().fold(1.0, |most: f64, [_, energy]| most.max(energy));
        let hardest = (hardest * parameters.energy_ev.bounds()[1]).min(HIGHEST_EV);
        let hardest = nearest_node(hardest) + SPECTRUM_NODES;
        let key = Key::new(self.seed, &self.name);
        let collisions = || CollisionRenderer::new(emission, &parameters.rendering, hardest, key);
        Working {
            collisions: by_collisions.then(|| Arc::new(collisions())),
            profiles: Arc::new(EmissionProfiles::new(emission)),
            red_profiles: Arc::new(EmissionProfiles::red_by_altitude(emission)),
            emitter_colors: Arc::new(EmitterColors::new(&parameters.rendering.extinction)),
            simulation,
        }
    }

    /// Its particles, field and afterglow.
    #[must_use]
    pub fn simulation(&self) -> &AuroraSimulation {
        &self.working().simulation
    }

    /// The same, to step it or to set its state.
    pub(super) fn simulation_mut(&mut self) -> Option<&mut AuroraSimulation> {
        self.working();
        self.working.get_mut().map(|working| &mut working.simulation)
    }

    pub(super) fn profiles(&self) -> &EmissionProfiles {
        &self.working().profiles
    }

    /// Red light alone, by its heights in position of the emitters.
    pub(super) fn red_profiles(&self) -> &EmissionProfiles {
        &self.working().red_profiles
    }

    pub(super) fn emitter_colors(&self) -> &EmitterColors {
        &self.working().emitter_colors
    }

    /// What single collisions are drawn from, where they are asked for.
    pub(super) fn collisions(&self) -> Option<&CollisionRenderer> {
        self.working().collisions.as_deref()
    }

    /// The magnetic field about an observer at a position in m.
    pub(super) fn field_lines(&self, place: DVec3) -> FieldLines {
        FieldLines::new(self.parameters.dip_deg, self.parameters.declination_deg, place)
    }

    /// What the light of a state of its simulation is made from at a time, s.
    pub(super) fn light<'a>(&self, simulation: &'a AuroraSimulation, t: f64) -> EmissionInputs<'a> {
        let parameters = simulation.parameters();
        let energy_ev = parameters.energy_ev.at(t);
        EmissionInputs {
            particles: simulation.particles(),
            afterglow: simulation.afterglow(),
            emission: simulation.emission(),
            parameters: &parameters.rendering,
            spacing_km: simulation.spacing_km(),
            energy_ev,
            lateral_spread_km: lateral_spread_km(
                parameters.rendering.energy_deposition,
                parameters.rendering.collision_deflection,
                energy_ev,
            ),
        }
    }
}
