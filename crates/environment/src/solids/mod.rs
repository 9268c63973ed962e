//! Visible obstacles: boxes, spheres, cylinders and meshes, lit by lamps, fires, the sky and the ground around them.
//!
//! They are objects on which rain and light fall, such as a car or a lamp post. They receive direct light with shadows of each other and one bounce from the
//! ground, and glossy surfaces reflect lamps and sky; there is no interreflection.
//!
//! # References
//! - T. Moller and B. Trumbore, "Fast, minimum storage ray/triangle intersection" (1997).
//! - B. Walter, S. Marschner, H. Li and K. Torrance, "Microfacet models for refraction through rough surfaces" (2007): GGX.
//! - E. Hammon, "PBR diffuse lighting for GGX+Smith microsurfaces" (2017): approximation of Smith's masking.
//! - C. Schlick, "An inexpensive BRDF model for physically-based rendering" (1994): Fresnel approximation.
//!
//! # Equations
//!
//! | equation | function |
//! | --- | --- |
//! | ray and triangle | `intersect::Triangle::intersect` |
//! | ray and sphere, box, cylinder | `intersect::sphere`, `intersect::cuboid`, `intersect::cylinder` |
//! | diffuse reflection `albedo E cos / pi` | `shade::Shading::lights` |
//! | GGX reflection `F D G / (4 cos cos)` | `shade::specular_brdf` |
//! | one bounce from the ground, `albedo E / pi` times its solid angle | `shade::Shading::ambient` |
//!
//! # Data flow
//! [`Solids`] holds the obstacles, with a bounding volume hierarchy for each mesh. For a frame, `trace` places them at several times while the shutter is
//! open (`pose`), and finds for each pixel what it shows: where the corners of a pixel show one smooth surface, one ray, else sixteen. `shade` computes
//! the radiance. While nothing changes, `trace_cache` keeps the pixels from frame to frame. They are copied to the strips. Their depth hides all phenomena behind them. Where a pixel is covered partly, the renderer mixes in
//! the scene without them ([`OpaqueSurfaces`](bansho_base::phenomenon::OpaqueSurfaces)). Where other things move over the same pixels, the
//! renderer draws them at many moments of the exposure (`trace::UntracedSolids`).

mod intersect;
mod obstacle;
mod phenomenon;
mod pose;
mod shade;
mod trace;
mod trace_cache;

#[cfg(test)]
mod tests;

use bansho_base::color::acescg_from_srgb;
use intersect::TriangleBvh;
pub use obstacle::{Obstacle, ObstacleMesh, ObstacleParameters, ObstacleShape};
use trace_cache::TraceCache;

/// The visible obstacles of a scene.
#[derive(Debug)]
pub struct Solids {
    solids: Vec<Solid>,
    cache: TraceCache,
}

/// A visible obstacle.
#[derive(Debug)]
struct Solid {
    obstacle: Obstacle,
    /// Its triangles, if it is a mesh.
    triangles: Option<TriangleBvh>,
    material: Material,
}

/// How a surface reflects light.
#[derive(Clone, Copy, Debug)]
struct Material {
    /// ACEScg.
    albedo: [f32; 3],
    /// GGX alpha.
    roughness: f64,
    /// Reflectance at normal incidence.
    reflectance: f64,
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
        Self { solids, cache: TraceCache::default() }
    }
}
