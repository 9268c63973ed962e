//! The kinds of phenomena that scenes may hold: the one place where models meet the renderer.

use bansho_base::{parameters::ProblemKind, phenomenon::Phenomenon};
use bansho_models::{
    flame_particles::{FlameParticles, FlameParticlesParameters, ParticleFaultKind},
    flame_sheet::{FlameSheet, FlameSheetParameters},
};

use crate::scene::source::{Describe, Opening, OpeningFault, PhenomenonKind};

/// Every kind, in the order in which schema and book list them.
pub const KINDS: &[PhenomenonKind] = &[FlameSheetParameters::KIND, FlameParticlesParameters::KIND];

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
