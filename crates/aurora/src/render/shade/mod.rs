//! From the chart to pixels: attenuation by the air below, and sampling through any lens.

pub(crate) mod attenuation;
pub(crate) mod chart_sampler;
pub(crate) mod composite;
