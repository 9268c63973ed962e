//! The way of the thesis, where a scene selects it: electrons drawn collision by collision (2.28).

pub(crate) mod blur;
pub(crate) mod collision_pass;
pub mod quantile_matched;
pub(crate) mod rasterize;
pub(crate) mod track_table;
