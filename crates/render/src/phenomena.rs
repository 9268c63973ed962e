//! The kinds of phenomena that scenes may hold: the one place where models meet the renderer.

use bansho_base::{parameters::ProblemKind, phenomenon::Phenomenon};
use bansho_models::{
    aurora::{Aurora, AuroraParameters, shapes::ShapeFaultKind},
    flame_particles::{FlameParticles, FlameParticlesParameters, ParticleFaultKind},
    flame_sheet::{FlameSheet, FlameSheetParameters},
    ground::Ground,
    lamps::{Lamp, Lamps},
    rain::{Rain, RainParameters},
    sky::SkyBackdrop,
};

use crate::{
    plan::Plan,
    scene::source::{Describe, Opening, OpeningFault, PhenomenonKind},
};

/// Every kind, in the order in which schema and book list them.
pub const KINDS: &[PhenomenonKind] =
    &[FlameSheetParameters::KIND, FlameParticlesParameters::KIND, RainParameters::KIND, AuroraParameters::KIND];

/// A model's own fault, placed at the parameter that it names.
fn opening_fault(fault: &bansho_models::ParameterFault) -> OpeningFault {
    OpeningFault { key: fault.key.to_owned(), kind: ProblemKind::Conflict(fault.kind.to_string()) }
}

impl Describe for FlameSheetParameters {
    const KEY: &'static str = "flame_sheet";

    fn open(&self, opening: &Opening) -> Result<Box<dyn Phenomenon>, OpeningFault> {
        match FlameSheet::new(self.clone(), opening.name, opening.seed, opening.loop_s) {
            Ok(sheet) => Ok(Box::new(sheet)),
            Err(fault) => Err(opening_fault(&fault)),
        }
    }
}

impl Describe for FlameParticlesParameters {
    const KEY: &'static str = "flame_particles";

    fn open(&self, opening: &Opening) -> Result<Box<dyn Phenomenon>, OpeningFault> {
        match FlameParticles::new(self.clone(), opening.name, opening.seed, opening.loop_s, opening.assets) {
            Ok(flame) => Ok(Box::new(flame)),
            Err(fault) => {
                let kind = match fault.kind {
                    ParticleFaultKind::Asset(error) => ProblemKind::Asset(error),
                    other => ProblemKind::Conflict(other.to_string()),
                };
                Err(OpeningFault { key: fault.key, kind })
            }
        }
    }
}

impl Describe for RainParameters {
    const KEY: &'static str = "rain";

    fn open(&self, opening: &Opening) -> Result<Box<dyn Phenomenon>, OpeningFault> {
        match Rain::new(self.clone(), opening.name, opening.seed, opening.loop_s) {
            Ok(rain) => Ok(Box::new(rain)),
            Err(fault) => Err(opening_fault(&fault)),
        }
    }
}

impl Describe for AuroraParameters {
    const KEY: &'static str = "aurora";

    fn open(&self, opening: &Opening) -> Result<Box<dyn Phenomenon>, OpeningFault> {
        match Aurora::new(self.clone(), opening.name, opening.seed, opening.loop_s, opening.assets) {
            Ok(aurora) => Ok(Box::new(aurora)),
            Err(fault) => {
                let kind = match fault.kind {
                    ShapeFaultKind::Asset(error) => ProblemKind::Asset(error),
                    other => ProblemKind::Conflict(other.to_string()),
                };
                Err(OpeningFault { key: fault.key, kind })
            }
        }
    }
}

/// What the scene shows beside its phenomena: lamps, ground, and a sky where there is no plate.
pub(crate) fn of_scene(plan: &Plan) -> Vec<Box<dyn Phenomenon>> {
    let scene = &plan.scene;
    let mut own: Vec<Box<dyn Phenomenon>> = Vec::new();
    let visible: Vec<_> = scene.lights.iter().filter(|light| light.visible).cloned().collect();
    if !visible.is_empty() {
        let at = move |t| visible.iter().map(|light| Lamp { light: light.at(t), radius: light.radius }).collect();
        own.push(Box::new(Lamps::new(at)));
    }
    if let Some(ground) = &scene.ground {
        own.push(Box::new(Ground::new(ground.clone(), plan.seed, plan.loop_s)));
    }
    if let Some(sky) = scene.sky.as_ref().filter(|sky| sky.visible && !scene.has_plate()) {
        own.push(Box::new(SkyBackdrop::new(sky.clone(), plan.seed)));
    }
    own
}
