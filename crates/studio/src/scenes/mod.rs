//! The embedded assets of the example scenes, and the templates of new scenes.

pub mod examples;
pub mod new_scene;
