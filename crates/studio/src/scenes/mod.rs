//! The example scenes within the program, and what new scenes begin with.

pub mod examples;
pub mod new_scene;
