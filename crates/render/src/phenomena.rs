//! The kinds of phenomena that scenes may hold: the one place where models meet the renderer.

use bansho_base::{parameters::ProblemKind, phenomenon::Phenomenon};
use bansho_models::{
    flame_sheet::{FlameSheet, FlameSheetParameters},
    rain::{Rain, RainParameters},
};

use crate::scene::source::{Describe, Opening, OpeningFault, PhenomenonKind};

/// Every kind, in the order in which schema and book list them.
pub const KINDS: &[PhenomenonKind] = &[FlameSheetParameters::KIND, RainParameters::KIND];

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

impl Describe for RainParameters {
    const KEY: &'static str = "rain";

    fn open(&self, opening: &Opening) -> Result<Box<dyn Phenomenon>, OpeningFault> {
        match Rain::new(self.clone(), opening.name, opening.seed, opening.loop_s) {
            Ok(rain) => Ok(Box::new(rain)),
            Err(fault) => Err(opening_fault(&fault)),
        }
    }
}
