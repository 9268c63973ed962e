//! Sources of light, sorted by where their field lines are on the chart.

pub(crate) mod source_bins;
pub(crate) mod sources;
