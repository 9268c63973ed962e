//! From charts to pixels: extinction, color and sampling.

pub(crate) mod attenuation;
pub(crate) mod chart_sampler;
pub(crate) mod composite;
