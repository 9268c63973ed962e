//! The kinds of phenomena that scenes may hold: the one place where models meet the renderer.

use std::{error::Error, sync::Arc};

use bansho_base::{parameters::ModelFault, phenomenon::Phenomenon, world::sky::SkyParameters};

use crate::{
    dissolving::Dissolving,
    plan::{Plan, PlanError, opening_error},
    scene::{
        Instance, LightParameters, Scene,
        source::{Describe, Memo, Opening, OpeningFault, PhenomenonKind},
    },
};
use bansho_aurora::{
    Aurora, AuroraParameters,
    shapes::{Sequence, ShapeErrorKind},
};
use bansho_environment::{
    ground::{Ground, GroundParameters},
    lamps::{Lamp, Lamps},
    sky::SkyBackdrop,
};
use bansho_fire::{
    particles::{FlameParticles, FlameParticlesParameters, ParticleFaultKind, check_count},
    sheet::{FlameSheet, FlameSheetParameters},
};
use bansho_rain::{Rain, RainParameters};

/// Every kind, in the order in which schema and book list them.
pub const KINDS: &[PhenomenonKind] =
    &[FlameSheetParameters::KIND, FlameParticlesParameters::KIND, RainParameters::KIND, AuroraParameters::KIND];

/// A model's own fault, placed at the parameter that it names.
fn opening_fault(key: impl Into<String>, fault: impl Error + Send + Sync + 'static) -> OpeningFault {
    OpeningFault { key: key.into(), kind: ModelFault::new(fault).into() }
}

impl Describe for FlameSheetParameters {
    const KEY: &'static str = "flame_sheet";
    const PLACEMENT_KEYS: &'static [&'static str] = &["position", "width", "height"];
    // From where the flame nearly fills the height of the picture.
    const SETTING: &'static str = "camera = { position = [0.0, 0.76, 2.75], target = [0.0, 0.76, 0.0] }\n";
    const FIRST_KEYS: &'static [&'static str] = &[
        "position",
        "width",
        "height",
        "speed",
        "variation",
        "texture.contrast",
        "colour.luminance",
        "colour.core_temperature_k",
        "sparks.rate",
        "smoke.optical_depth",
    ];

    fn open(&self, opening: &Opening) -> Result<Box<dyn Phenomenon>, OpeningFault> {
        match FlameSheet::new(self.clone(), opening.name, opening.seed, opening.loop_s) {
            Ok(sheet) => Ok(Box::new(sheet)),
            Err(fault) => Err(opening_fault(fault.key, fault.kind)),
        }
    }
}

impl Describe for FlameParticlesParameters {
    const KEY: &'static str = "flame_particles";
    const PLACEMENT_KEYS: &'static [&'static str] = &["position", "burners", "domain_min", "domain_max"];
    const FIRST_KEYS: &'static [&'static str] = &[
        "position",
        "particles",
        "motion.turbulence",
        "life.soot_ppm",
        "life.smoke",
        "burners.diameter",
        "burners.heat_release_kw",
    ];
    const SETTING: &'static str = "\
        camera = { position = [0.0, 0.9, 3.8], target = [0.0, 0.9, 0.0] }\n\
        wind = { velocity = [0.25, 0.0, 0.0], gust = 0.8 }\n";

    fn crowd(&self, others: i64) -> Result<i64, OpeningFault> {
        check_count(self.particles, others).map_err(|fault| opening_fault(fault.key, fault.kind))?;
        Ok(self.particles + others)
    }

    fn open(&self, opening: &Opening) -> Result<Box<dyn Phenomenon>, OpeningFault> {
        match FlameParticles::new(self.clone(), opening.name, opening.seed, opening.loop_s, opening.assets) {
            Ok(flame) => Ok(Box::new(flame)),
            Err(fault) => Err(match fault.kind {
                ParticleFaultKind::Asset(error) => OpeningFault { key: fault.key, kind: error.into() },
                other => opening_fault(fault.key, other),
            }),
        }
    }
}

impl Describe for RainParameters {
    const KEY: &'static str = "rain";
    const FIRST_KEYS: &'static [&'static str] = &["rate_mm_per_h", "distance", "veil_distance", "splashes.amount"];
    // Lamps at dusk along a wet street: drops only show the light of others.
    const SETTING: &'static str = "\
        camera = { position = [0.4, 1.3, 4.2], target = [0.0, 1.25, 0.0], vertical_fov_deg = 34.0 }\n\
        sky = { luminance = 0.12, temperature_k = 10000.0 }\n\
        ground = { wetness = 0.9, puddles = 0.4 }\n\
        light = [\
        { visible = true, position = [-1.3, 2.3, -1.5], intensity = 120.0, colour = [1.0, 0.68, 0.36] }, \
        { visible = true, position = [2.4, 2.3, -9.0], intensity = 120.0, colour = [1.0, 0.68, 0.36] }, \
        { visible = true, position = [-4.6, 2.3, -17.0], intensity = 120.0, colour = [1.0, 0.68, 0.36] }]\n";

    fn open(&self, opening: &Opening) -> Result<Box<dyn Phenomenon>, OpeningFault> {
        match Rain::new(self.clone(), opening.name, opening.seed, opening.loop_s) {
            Ok(rain) => Ok(Box::new(rain)),
            Err(fault) => Err(opening_fault(fault.key, fault.kind)),
        }
    }
}

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

    fn open(&self, opening: &Opening) -> Result<Box<dyn Phenomenon>, OpeningFault> {
        self.open_again(opening, &Memo::default())
    }

    fn open_again(&self, opening: &Opening, memo: &Memo) -> Result<Box<dyn Phenomenon>, OpeningFault> {
        // Drawings may have changed since.
        let is_stated = self.shapes.iter().flat_map(|shape| &shape.sheets).all(|sheet| sheet.path.is_none());
        let known = memo.get::<Sequence>(opening.loop_s).filter(|_| is_stated);
        let make = || Sequence::new(&self.shapes, &self.motion, self.extent_km, opening.assets, opening.loop_s);
        let aurora = known.map_or_else(|| make().map(Arc::new), Ok).and_then(|sequence| {
            memo.keep(opening.loop_s, sequence.clone());
            let sequence = Sequence::clone(&sequence);
            Aurora::moving(self.clone(), sequence, opening.name, opening.seed, opening.loop_s)
        });
        match aurora {
            Ok(aurora) => Ok(Box::new(aurora)),
            Err(fault) => Err(match fault.kind {
                ShapeErrorKind::Asset(error) => OpeningFault { key: fault.key, kind: error.into() },
                other => opening_fault(fault.key, other),
            }),
        }
    }
}

/// One of the phenomena that a plan draws.
pub(crate) enum Part<'a> {
    /// A phenomenon of the scene.
    Instance(&'a Instance),
    /// The lamps that are seen.
    Lamps(Vec<LightParameters>),
    /// The ground.
    Ground(&'a GroundParameters),
    /// The sky, where there is no plate.
    Sky(&'a SkyParameters),
}

/// Everything that `scene` shows: its phenomena, then its own lamps, ground and sky.
pub(crate) fn parts(scene: &Scene) -> Vec<Part<'_>> {
    let enabled = scene.instances.iter().filter(|instance| instance.enabled);
    let mut parts: Vec<Part> = enabled.map(Part::Instance).collect();
    let visible: Vec<_> = scene.lights.iter().filter(|light| light.visible).cloned().collect();
    if !visible.is_empty() {
        parts.push(Part::Lamps(visible));
    }
    parts.extend(scene.ground.as_ref().map(Part::Ground));
    parts.extend(scene.sky.as_ref().filter(|sky| sky.visible && !scene.has_plate()).map(Part::Sky));
    parts
}

impl Part<'_> {
    /// Luminance of its bright parts, cd/m^2, where that is known without making it.
    pub(crate) fn luminance(&self) -> Option<f64> {
        match self {
            Self::Instance(instance) => instance.luminance,
            _ => None,
        }
    }

    /// Makes it, at its beginning.
    pub(crate) fn open(&self, plan: &Plan) -> Result<Box<dyn Phenomenon>, PlanError> {
        Ok(match self {
            Self::Instance(instance) => return open(instance, plan),
            Self::Lamps(lights) => {
                let lights = lights.clone();
                let at =
                    move |t| lights.iter().map(|light| Lamp { light: light.at(t), radius: light.radius }).collect();
                Box::new(Lamps::new(at))
            }
            Self::Ground(ground) => Box::new(Ground::new((*ground).clone(), plan.seed, plan.loop_s)),
            Self::Sky(sky) => Box::new(SkyBackdrop::new((*sky).clone(), plan.seed)),
        })
    }
}

/// Makes a phenomenon of the scene; in a loop one run of it passes into the next.
fn open(instance: &Instance, plan: &Plan) -> Result<Box<dyn Phenomenon>, PlanError> {
    let opening = Opening { name: &instance.name, seed: plan.seed, loop_s: plan.loop_s, assets: plan.assets.as_ref() };
    let make = || instance.source.open(&opening).map_err(|fault| opening_error(instance.name.clone(), fault));
    let phenomenon = make()?;
    Ok(match (plan.loop_s, phenomenon.stepping()) {
        (Some(turn), Some(stepping)) => Box::new(Dissolving::new(turn, stepping, [phenomenon, make()?])),
        _ => phenomenon,
    })
}
