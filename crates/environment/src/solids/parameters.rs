//! Parameters of an obstacle.

use bansho_base::parameters::{AssetPath, Range, animated::Animated};

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
