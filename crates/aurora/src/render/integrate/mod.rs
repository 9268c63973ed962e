//! Integration of the emission along lines of sight into chart columns.

pub(crate) mod chart_memory;
pub(crate) mod columns;
pub(crate) mod emission_profile;
