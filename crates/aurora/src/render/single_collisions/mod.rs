//! Electrons drawn as single collisions, as in the thesis (2.4): selected by `rendering.sampling = "single_collisions"`; the
//! blur (2.28) by `rendering.blur_space = "screen"`.

pub(crate) mod blur;
pub(crate) mod collision_block;
pub(crate) mod collision_pass;
pub(crate) mod rasterize;
pub(crate) mod track_table;
