//! What the library draws: crops, cuts, exposures, plates, lenses, light and auroras as whole frames, in small pictures.

#[path = "../support/mod.rs"]
mod support;

mod aurora_shapes;
mod backdrop;
mod crops;
mod cuts;
#[cfg(all(feature = "fire", feature = "rain", feature = "aurora"))]
mod display_frames;
mod exposure;
mod fog;
mod glare;
mod lens_light;
mod lit_plates;
#[cfg(all(feature = "fire", feature = "rain", feature = "aurora"))]
mod long_exposure;
mod loops;
mod obstacles;
mod plates;
mod shot_data;
#[cfg(all(feature = "files", feature = "fire", feature = "rain", feature = "aurora"))]
mod smallest_pictures;
mod table_order;
mod view_remarks;
mod writers;
