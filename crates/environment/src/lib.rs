//! The surroundings of the other phenomena: sky, ground, lamps and visible obstacles.
//!
//! Each module is a phenomenon with a closed form: [`sky`] draws the background, [`ground`] a horizontal plane that is dry, wet or a lake, [`lamps`]
//! the visible sources of the scene's lights, and [`solids`] the visible obstacles.

pub mod ground;
pub mod lamps;
mod shadow;
pub mod sky;
pub mod solids;
