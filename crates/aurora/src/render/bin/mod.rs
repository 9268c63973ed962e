//! Binning: light sources by longitude and distance of their field lines on the chart.

pub(crate) mod source_bins;
pub(crate) mod sources;
