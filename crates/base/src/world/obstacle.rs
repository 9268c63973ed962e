//! Parameters of an obstacle, and the solid that is built from them.

use std::sync::Arc;

use glam::DVec3;

use super::occluder::Occluder;
use crate::{
    geometry::{distance_field::DistanceField, transform::Transform},
    host::{assets::Assets, constructions},
    parameters::{AssetPath, BuildError, ProblemKind, Range},
};

crate::choice! {
    /// Shape of an obstacle.
    pub enum ObstacleShape {
        /// A sphere with its center at `position`.
        Sphere = "sphere",
        /// A box with its center at `position`.
        Box = "box",
        /// Everything below a plane through `position`; without rotation it is level ground.
        Plane = "plane",
        /// A closed triangle mesh from `file`.
        Mesh = "mesh",
    }
}

crate::parameters! {
    /// A solid that gas flows around and drops fall on. It is not drawn: it represents an object that the plate shows.
    pub struct ObstacleParameters {
        /// Shape.
        shape: ObstacleShape = ObstacleShape::Sphere;
        /// Position.
        position: [f64; 3] = [0.0, 0.0, 0.0], unit("m");
        /// Rotation about x, then y, then z.
        rotation_deg: [f64; 3] = [0.0, 0.0, 0.0], limits(Range::new(-3600.0, 3600.0)), unit("degrees");
        /// Radius of a sphere.
        radius: f64 = 0.5, limits(Range::new(1e-4, 1e5)), unit("m");
        /// Sides of a box.
        size: [f64; 3] = [1.0, 1.0, 1.0], limits(Range::new(1e-4, 1e5)), unit("m");
        /// glTF file of a mesh.
        file: Option<AssetPath> = None;
        /// Scale factor of a mesh.
        scale: f64 = 1.0, limits(Range::new(1e-4, 1e4));
    }
}

impl ObstacleParameters {
    /// The solid.
    ///
    /// # Errors
    /// A mesh without a file, or a file that cannot be loaded.
    pub fn build(&self, assets: &dyn Assets) -> Result<Occluder, BuildError> {
        constructions::count("obstacle");
        let placement = Transform::new(self.position, self.rotation_deg, self.scale);
        Ok(match self.shape {
            ObstacleShape::Sphere => Occluder::Sphere { center: placement.position, radius: self.radius },
            ObstacleShape::Box => Occluder::Cuboid {
                center: placement.position,
                half_extents: 0.5 * DVec3::from(self.size),
                rotation: placement.rotation,
            },
            ObstacleShape::Plane => {
                Occluder::HalfSpace { point: placement.position, normal: placement.direction_in_world(DVec3::Y) }
            }
            ObstacleShape::Mesh => {
                let error = |kind| BuildError { key: "file".into(), kind };
                let missing = || ProblemKind::Conflict("an obstacle of shape \"mesh\" needs a `file`".into());
                let file = self.file.as_ref().ok_or_else(|| error(missing()))?;
                let mesh = assets.mesh(&file.0).map_err(|asset_error| error(ProblemKind::Asset(asset_error)))?;
                constructions::count("distance_field");
                Occluder::Mesh { distance: Arc::new(DistanceField::new(&mesh)), placement }
            }
        })
    }
}
