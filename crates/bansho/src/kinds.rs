//! The kinds of phenomena that scenes may hold: the one list of them.

use bansho_aurora::AuroraParameters;
use bansho_base::phenomenon::kind::{Describe, PhenomenonKind};
use bansho_fire::{particles::FlameParticlesParameters, sheet::FlameSheetParameters};
use bansho_rain::RainParameters;

/// Every kind, in the order in which schema and book list them.
pub const KINDS: &[PhenomenonKind] =
    &[FlameSheetParameters::KIND, FlameParticlesParameters::KIND, RainParameters::KIND, AuroraParameters::KIND];
