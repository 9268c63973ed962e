//! The aurora as the renderer knows it.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    color,
    geometry::point_cloud::PointCloud,
    host::{
        assets::Assets,
        constructions,
        observer::{Cancelled, Observer},
        once::get_or_compute,
    },
    math::{DVec3, random::Key},
    parameters::Parameter,
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Remark, Run, SnapshotError, Stepped, Stepping,
        kind::{BuildContext, BuildError, Describe},
        strip::{AovDescriptor, AovRule, DepthInterval, Shutter, View},
        surroundings::{OtherPhenomena, Publication, Surroundings},
    },
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
        emission::{Emission, Emitter, LINES, Line},
        precipitation::{energy_grid::HIGHEST_EV, lateral_spread::lateral_spread_km},
    },
    render::{
        bin::sources::{EmissionInputs, nearest_node},
        integrate::emission_profile::EmissionProfiles,
        maps::MAPS,
        prepared::{DEPTHS, PreparedAurora},
        project::field_lines::FieldLines,
        shade::attenuation::EmitterColors,
        shutter,
    },
    simulate::point_cloud::point_cloud,
    single_collisions::collision_pass::CollisionRenderer,
};

/// Sheets are thin: their bright parts seen aslant beside what looks straight up through one.
const BRIGHT_PER_COLUMN: f64 = 0.75;

/// How far a spectrum reaches beyond its energy, and rays beyond that, in nodes of the grid of energies: sixfold.
const SPECTRUM_NODES: usize = 25;

/// An aurora, ready to be stepped and drawn. The one that is built stands at its beginning; runs are copies of it, which share what is fixed.
#[derive(Clone, Debug)]
pub struct Aurora {
    name: String,
    seed: u64,
    parameters: AuroraParameters,
    sequence: Arc<Sequence>,
    /// Made when it is first stepped or drawn: there may be hundreds of auroras, each of which is made to be checked.
    working: OnceLock<Working>,
    /// How every run begins: made by the first run that needs it, shared by all.
    beginning: Arc<OnceLock<Working>>,
    /// Luminance of the brightest column of all shapes, cd/m^2.
    brightest: f64,
    /// The shape, counted from 0, on whose way sheets first pass through each other.
    crossing: Option<usize>,
    /// In a loop: for how long one run passes into the next, s.
    dissolve: f64,
}

/// An aurora at work: its state, and what it is drawn with.
#[derive(Clone, Debug)]
struct Working {
    simulation: AuroraSimulation,
    profiles: Arc<EmissionProfiles>,
    red_profiles: Arc<EmissionProfiles>,
    emitter_colors: Arc<EmitterColors>,
    collisions: Option<Arc<CollisionRenderer>>,
}

/// Longest dissolve in a loop, s: by then particles have gone a long way along their sheets.
const LONGEST_DISSOLVE_S: f64 = 10.0;

/// Makes what is keyed repeat after `turn` seconds, and room in the preroll for half the dissolve that it gives.
fn close_loop(parameters: &mut AuroraParameters, turn: f64) -> Result<f64, ShapeError> {
    if let Some(key) = parameters.close_loop(turn) {
        return Err(ShapeError { key, kind: ShapeErrorKind::LoopJumps { seconds: turn } });
    }
    let dissolve = turn.min(LONGEST_DISSOLVE_S);
    parameters.preroll_s += 0.5 * dissolve;
    Ok(dissolve)
}

/// Luminance of the brightest column among control points with these factors of flux and energy, cd/m^2: the softest electrons at the
/// greatest flux.
fn brightest(parameters: &AuroraParameters, emission: &Emission, factors: &[[f64; 2]]) -> f64 {
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
        let sequence = Sequence::new(&parameters.shapes, &parameters.motion, parameters.extent_km, assets, loop_s)?;
        let dissolve = loop_s.map_or(Ok(0.0), |turn| close_loop(&mut parameters, turn))?;
        check_energies(&parameters)?;
        let crossing = sequence.crossing();
        let factors: Vec<[f64; 2]> = sequence.factors().collect();
        let emission = parameters.drawing.fall.shared_emission(parameters.spectrum);
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

    fn working(&self) -> &Working {
        get_or_compute(&self.working, || get_or_compute(&self.beginning, || self.set_to_work()).clone())
    }

    fn set_to_work(&self) -> Working {
        let simulation = AuroraSimulation::new(self.parameters.clone(), self.sequence.clone(), &self.name, self.seed);
        let (parameters, emission) = (simulation.parameters(), simulation.emission());
        let by_collisions = parameters.drawing.sampling == Sampling::CollisionRenderer;
        let hardest = self.sequence.factors().fold(1.0, |most: f64, [_, energy]| most.max(energy));
        let hardest = (hardest * parameters.energy_ev.bounds()[1]).min(HIGHEST_EV);
        let hardest = nearest_node(hardest) + SPECTRUM_NODES;
        let key = Key::new(self.seed, &self.name);
        let collisions = || CollisionRenderer::new(emission, &parameters.drawing, hardest, key);
        Working {
            collisions: by_collisions.then(|| Arc::new(collisions())),
            profiles: Arc::new(EmissionProfiles::new(emission)),
            red_profiles: Arc::new(EmissionProfiles::red_by_altitude(emission)),
            emitter_colors: Arc::new(EmitterColors::new(&parameters.drawing.air)),
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
            parameters: &parameters.drawing,
            spacing_km: simulation.spacing_km(),
            energy_ev,
            lateral_spread_km: lateral_spread_km(parameters.drawing.fall, parameters.drawing.wobble, energy_ev),
        }
    }
}

const fn brightness(name: &'static str, doc: &'static str) -> AovDescriptor {
    AovDescriptor { name, unit: "kR", doc, rule: AovRule::Sum }
}

/// Wavelengths of the lines that the AOVs measure, nm.
pub(super) const MEASURED: [f64; 6] = [557.7, 630.0, 636.4, 427.8, 391.4, 670.5];
/// How many brightnesses the AOVs measure: those lines, and all the light of N2.
pub(super) const BRIGHTNESSES: usize = MEASURED.len() + 1;

/// The lines of [`MEASURED`].
pub(super) fn measured_lines() -> impl Iterator<Item = &'static Line> {
    MEASURED.iter().filter_map(|nm| LINES.iter().find(|line| (line.wavelength_nm - nm).abs() < 0.05))
}

/// What radiates each of the [`BRIGHTNESSES`], and how many of its photons for each that it is counted in.
pub(super) fn brightnesses() -> impl Iterator<Item = (Emitter, f64)> {
    let lines = measured_lines().map(|line| (line.emitter, line.photons));
    lines.chain([(Emitter::Nitrogen, 1.0)])
}

/// What an aurora can write beside its light, in the order of [`brightnesses`] and then of [`MAPS`].
const AOVS: &[AovDescriptor] = &[
    brightness(
        "kilorayleigh_557",
        "Brightness of the green line of oxygen, 557.7 nm, above the air; 0 where there is none.",
    ),
    brightness(
        "kilorayleigh_630",
        "Brightness of the red line of oxygen, 630.0 nm, above the air; 0 where there is none.",
    ),
    brightness(
        "kilorayleigh_636",
        "Brightness of the fainter red line of oxygen, 636.4 nm, above the air; 0 where there is none.",
    ),
    brightness("kilorayleigh_427", "Brightness of the band of N2+ at 427.8 nm, above the air; 0 where there is none."),
    brightness("kilorayleigh_391", "Brightness of the band of N2+ at 391.4 nm, above the air; 0 where there is none."),
    brightness("kilorayleigh_670", "Brightness of the band of N2 at 670.5 nm, above the air; 0 where there is none."),
    brightness(
        "kilorayleigh_first_positive",
        "Brightness of all first positive bands of N2, most of them infrared, above the air; 0 where there is none.",
    ),
    MAPS[0],
    MAPS[1],
    MAPS[2],
    MAPS[3],
];

impl Describe for AuroraParameters {
    const KEY: &'static str = "aurora";
    const PLACEMENT_KEYS: &'static [&'static str] = &["shapes", "extent_km"];
    const FIRST_KEYS: &'static [&'static str] = &[
        "flux_mw_per_m2",
        "energy_ev",
        "dip_deg",
        "time_lapse",
        "particles.count",
        "rays.contrast",
        "folds.amplitude_km",
    ];
    const IN_THE_SKY: bool = true;
    // From the ground toward the northern sky of a clear night. With the airglow of a quiet night the sky stays darker than the curtains.
    const SETTING: &'static str = "\
        picture = { exposure_ev100 = -6.9, white_balance_k = 4000.0 }\n\
        camera = { position = [0.0, 1.7, 0.0], target = [0.0, 32.0, -57.0], vertical_fov_deg = 62.0 }\n\
        sky = { kind = \"night\", hills_deg = 2.0, trees_deg = 1.1, night = { airglow = 0.3, stars = 0.6, milky_way = 0.5 } }\n";

    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError> {
        match Aurora::new(self.clone(), context.name, context.seed, context.loop_s, context.assets) {
            Ok(aurora) => Ok(Arc::new(aurora)),
            Err(fault) => Err(match fault.kind {
                ShapeErrorKind::Asset(error) => BuildError { key: fault.key, kind: error.into() },
                other => BuildError::new(fault.key, other),
            }),
        }
    }
}

impl Phenomenon for Aurora {
    fn info(&self) -> PhenomenonInfo<'_> {
        let preroll = self.parameters.preroll_s;
        let stepping = Stepping { step: AuroraSimulation::STEP_S, preroll, crossfade: self.dissolve };
        PhenomenonInfo { aovs: AOVS, stepping: Some(stepping), ..PhenomenonInfo::new(&self.name) }
    }

    fn luminance(&self) -> f64 {
        BRIGHT_PER_COLUMN * self.brightest
    }

    fn remark(&self, _neighbors: &OtherPhenomena) -> Option<Remark> {
        let shape = self.crossing?;
        let message = format!(
            "its sheets pass through each other on the way to shape {}; another shape between, `link`, or sheets in another order would keep \
             them apart",
            shape + 1
        );
        Some(Remark::at(format!("shapes.{shape}"), message))
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        // A run takes its state from the beginning that all share when it is first stepped or drawn: remarks start hundreds that never are.
        Box::new((*self).clone())
    }
}

impl Run for Aurora {
    fn publish(&self, _shutter: Shutter) -> Publication {
        Publication { lights: self.directional_light().into_iter().collect(), ..Publication::default() }
    }

    fn depth_intervals(&self, _view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        vec![DEPTHS]
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        _surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        Ok(Box::new(PreparedAurora::new(self, view, observer)?))
    }

    fn export(&self, t: f64) -> Option<PointCloud> {
        let step = AuroraSimulation::STEP_S;
        if t - self.simulation().time() <= step {
            return Some(point_cloud(self.simulation().particles(), t - self.simulation().time()));
        }
        // In the midst of a long exposure.
        let mut simulation = self.simulation().clone();
        shutter::step_until(&mut simulation, t);
        Some(point_cloud(simulation.particles(), t - simulation.time()))
    }

    fn as_stepped(&self) -> Option<&dyn Stepped> {
        Some(self)
    }

    fn as_stepped_mut(&mut self) -> Option<&mut dyn Stepped> {
        Some(self)
    }
}

impl Stepped for Aurora {
    fn step(&mut self, _time: f64, _surroundings: &Surroundings) {
        if let Some(simulation) = self.simulation_mut() {
            simulation.step();
        }
    }

    fn time_for(&self, shutter: Shutter) -> f64 {
        if shutter::is_long(shutter) { shutter.open } else { shutter.middle() }
    }

    fn snapshot(&self) -> Vec<u8> {
        self.simulation().snapshot()
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), SnapshotError> {
        self.simulation_mut().map_or(Err(SnapshotError::NoState), |simulation| simulation.restore(state))
    }
}
