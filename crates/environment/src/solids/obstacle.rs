//! The solid that is built from the parameters of an obstacle.

use std::sync::Arc;

use bansho_base::{
    geometry::{distance_field::DistanceField, mesh::Mesh, transform::Transform},
    host::{assets::Assets, constructions},
    math::DVec3,
    parameters::{BuildError, ProblemKind},
    world::occluder::Occluder,
};

use super::parameters::{ObstacleParameters, ObstacleShape};

/// An obstacle whose files are read: a solid at any time.
#[derive(Clone, Debug)]
pub struct Obstacle {
    parameters: ObstacleParameters,
    mesh: Option<Arc<ObstacleMesh>>,
}

/// The mesh of an obstacle.
#[derive(Debug)]
pub struct ObstacleMesh {
    /// Its triangles.
    pub mesh: Arc<Mesh>,
    /// Its distance field.
    pub distance: Arc<DistanceField>,
}

impl Obstacle {
    /// The obstacle that `parameters` describe.
    ///
    /// # Errors
    /// A mesh without a file, or a file that cannot be loaded.
    pub fn new(parameters: &ObstacleParameters, assets: &dyn Assets) -> Result<Self, BuildError> {
        constructions::count("obstacle");
        let mesh = match parameters.shape {
            ObstacleShape::Mesh => Some(Arc::new(ObstacleMesh::new(parameters, assets)?)),
            ObstacleShape::Sphere | ObstacleShape::Box | ObstacleShape::Cylinder | ObstacleShape::Plane => None,
        };
        Ok(Self { parameters: parameters.clone(), mesh })
    }

    /// Its parameters.
    pub fn parameters(&self) -> &ObstacleParameters {
        &self.parameters
    }

    /// Its mesh, if it is one.
    pub fn mesh(&self) -> Option<&Arc<ObstacleMesh>> {
        self.mesh.as_ref()
    }

    /// Its position, rotation and scale at time `t`. Only a mesh has a scale.
    pub fn placement(&self, t: f64) -> Transform {
        let parameters = &self.parameters;
        let scale = if self.mesh.is_some() { parameters.scale } else { 1.0 };
        Transform::new(parameters.position.at(t), parameters.rotation_deg.at(t), scale)
    }

    /// The solid at time `t`.
    pub fn at(&self, t: f64) -> Occluder {
        let (parameters, placement) = (&self.parameters, self.placement(t));
        let center = placement.position;
        match (parameters.shape, &self.mesh) {
            (_, Some(mesh)) => Occluder::Mesh { distance: mesh.distance.clone(), placement },
            (ObstacleShape::Box, None) => Occluder::Cuboid {
                center,
                half_extents: 0.5 * DVec3::from(parameters.size),
                rotation: placement.rotation,
            },
            (ObstacleShape::Cylinder, None) => Occluder::Cylinder {
                center,
                radius: parameters.radius,
                half_height: 0.5 * parameters.height,
                rotation: placement.rotation,
            },
            (ObstacleShape::Plane, None) => {
                Occluder::HalfSpace { point: center, normal: placement.direction_in_world(DVec3::Y) }
            }
            (ObstacleShape::Sphere | ObstacleShape::Mesh, None) => {
                Occluder::Sphere { center, radius: parameters.radius }
            }
        }
    }
}

impl ObstacleMesh {
    fn new(parameters: &ObstacleParameters, assets: &dyn Assets) -> Result<Self, BuildError> {
        let Some(file) = &parameters.file else {
            let reason = "an obstacle of shape \"mesh\" needs a `file`".into();
            return Err(BuildError { key: "file".into(), kind: ProblemKind::Conflict(reason) });
        };
        let mesh = assets.mesh(&file.0);
        let mesh = mesh.map_err(|error| BuildError { key: "file".into(), kind: ProblemKind::Asset(error) })?;
        constructions::count("distance_field");
        Ok(Self { distance: Arc::new(DistanceField::new(&mesh)), mesh })
    }
}
