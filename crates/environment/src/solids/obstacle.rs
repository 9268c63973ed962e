//! An obstacle: its parameters, and the solid that is built from them.

use std::sync::Arc;

use bansho_base::{
    geometry::{distance_field::DistanceField, mesh::Mesh, transform::Transform},
    host::{assets::Assets, constructions},
    math::DVec3,
    parameters::{AssetPath, BuildError, ProblemKind, Range, animated::Animated},
    world::occluder::Occluder,
};

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

bansho_base::choice! {
    /// Shape of an obstacle.
    pub enum ObstacleShape {
        /// A sphere with its center at `position`.
        Sphere = "sphere",
        /// A box with its center at `position`.
        Box = "box",
        /// A cylinder with its center at `position`; without rotation its axis is vertical.
        Cylinder = "cylinder",
        /// Everything below a plane through `position`; without rotation it is level ground. It is never drawn: see `[ground]`.
        Plane = "plane",
        /// A closed triangle mesh from `file`.
        Mesh = "mesh",
    }
}

bansho_base::parameters! {
    /// A solid that gas flows around and drops fall on. Unless it is `visible`, it is not drawn: it represents an object that the plate shows.
    pub struct ObstacleParameters {
        /// Shape.
        shape: ObstacleShape = ObstacleShape::Sphere;
        /// Position. Gas notices only where a moving obstacle is, not how fast it is.
        position: Animated<[f64; 3]> = Animated::from([0.0, 0.0, 0.0]), unit("m");
        /// Rotation about x, then y, then z.
        rotation_deg: Animated<[f64; 3]> = Animated::from([0.0, 0.0, 0.0]), limits(Range::new(-3600.0, 3600.0)), unit("degrees");
        /// Radius of a sphere or a cylinder.
        radius: f64 = 0.5, limits(Range::new(1e-4, 1e5)), unit("m");
        /// Height of a cylinder.
        height: f64 = 1.0, limits(Range::new(1e-4, 1e5)), unit("m");
        /// Sides of a box.
        size: [f64; 3] = [1.0, 1.0, 1.0], limits(Range::new(1e-4, 1e5)), unit("m");
        /// glTF file of a mesh.
        file: Option<AssetPath> = None;
        /// Scale factor of a mesh.
        scale: f64 = 1.0, limits(Range::new(1e-4, 1e4));
        /// Whether it is drawn, lit by lamps, fires and the sky, and hides what is behind it.
        visible: bool = false;
        /// Albedo of a visible obstacle, linear sRGB.
        color: [f64; 3] = [0.2, 0.2, 0.2], limits(Range::new(0.0, 1.0));
        /// Roughness of a visible obstacle (GGX alpha): 0.02 is polished, 0.1 wet paint, 1 matt.
        roughness: f64 = 0.4, limits(Range::new(0.02, 1.0));
        /// Reflectance of its surface at normal incidence: 0.04 for paint, plastic and glass, 0.6 for chrome.
        reflectance: f64 = 0.04, limits(Range::new(0.0, 1.0));
    }
}
