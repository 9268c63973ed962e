//! The visible obstacles of a scene.

use bansho_base::color::acescg_from_srgb;

use super::{Obstacle, ObstacleParameters, bvh::TriangleBvh};

/// The visible obstacles of a scene.
#[derive(Debug)]
pub struct Solids {
    pub(super) solids: Vec<Solid>,
}

/// A visible obstacle.
#[derive(Debug)]
pub(super) struct Solid {
    pub(super) obstacle: Obstacle,
    /// Its triangles, if it is a mesh.
    pub(super) triangles: Option<TriangleBvh>,
    pub(super) material: Material,
}

/// How a surface reflects light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Material {
    /// ACEScg.
    pub(super) albedo: [f32; 3],
    /// GGX alpha.
    pub(super) roughness: f64,
    /// Reflectance at normal incidence.
    pub(super) reflectance: f64,
}

impl Material {
    fn new(parameters: &ObstacleParameters) -> Self {
        Self {
            albedo: acescg_from_srgb(parameters.color.map(|value| value as f32)),
            roughness: parameters.roughness,
            reflectance: parameters.reflectance,
        }
    }
}

impl Solids {
    /// The name of their layer.
    pub const NAME: &str = "obstacles";

    /// Obstacles that are visible.
    pub fn new(obstacles: Vec<Obstacle>) -> Self {
        let mut solids = Vec::with_capacity(obstacles.len());
        for obstacle in obstacles {
            let triangles = obstacle.mesh().map(|mesh| TriangleBvh::new(&mesh.mesh));
            solids.push(Solid { triangles, material: Material::new(obstacle.parameters()), obstacle });
        }
        Self { solids }
    }
}
