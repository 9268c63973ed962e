//! Electrons drawn as single collisions, as in the thesis (2.4): selected by `rendering.sampling = "single_collisions"` or `"single_photons"`; the
//! blur (2.28) by `rendering.blur_space = "screen"`.

pub(crate) mod blur;
pub(crate) mod collision_block;
pub(crate) mod collision_pass;
mod drawn_electrons;
pub(crate) mod rasterize;
pub(crate) mod track_table;
