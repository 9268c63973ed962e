//! The surroundings of the other phenomena: sky, ground, lights, obstacles and fog.
//!
//! Each module is a kind of table that all phenomena share ([`SharedTable`](bansho_base::tables::SharedTable)): its parameters, what it is to the scene, and the
//! phenomenon with a closed form that draws what is visible of it: [`sky`] draws the background, [`ground`] a horizontal plane that is dry, wet or a lake, [`lamps`]
//! the visible sources of the scene's lights, [`solids`] the visible obstacles, and [`fog`] a medium that is everywhere.

pub mod fog;
pub mod ground;
pub mod lamps;
pub mod sky;
pub mod solids;
