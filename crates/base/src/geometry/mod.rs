//! Geometry in the scene: meshes, distance fields, drawn strokes, transforms and point clouds.

pub mod distance_field;
pub mod mesh;
pub mod point_cloud;
pub mod strokes;
pub mod transform;
