//! The surroundings of the other phenomena: sky, ground and lamps.
//!
//! Each module is a phenomenon with a closed form: [`sky`] draws the background, [`ground`] a horizontal plane that is dry, wet or a lake, and
//! [`lamps`] the visible sources of the scene's lights.

pub mod ground;
pub mod lamps;
pub mod sky;
