//! Light along field lines, summed up into the columns of the chart.

pub(crate) mod column_block;
pub(crate) mod columns;
pub(crate) mod emission_profile;
