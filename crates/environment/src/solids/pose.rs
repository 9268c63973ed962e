//! Camera and obstacles at one time while the shutter is open.

use bansho_base::{
    camera::Camera,
    geometry::transform::Transform,
    math::{DVec2, DVec3},
    phenomenon::strip::View,
    world::obstacle::ObstacleShape,
};

use super::{
    intersect::{self, Hit, Ray},
    model::{Solid, Solids},
};

/// Most time samples of an exposure.
const MAX_TIME_SAMPLES: usize = 16;
/// Motion in the picture from which on there is motion blur, pixels.
const MIN_MOTION_PIXELS: f64 = 0.3;

/// Camera and obstacles at one time.
pub(super) struct Pose<'a> {
    pub(super) camera: Camera,
    solids: Vec<PlacedSolid<'a>>,
    /// Height of the mirror in which the scene is seen, if there is one: what is below it is not seen.
    mirror: Option<f64>,
}

/// An obstacle at one time, with a sphere that contains it.
struct PlacedSolid<'a> {
    solid: &'a Solid,
    placement: Transform,
    center: DVec3,
    radius: f64,
}

/// A point of a surface that is seen.
#[derive(Clone, Copy)]
pub(super) struct SurfacePoint<'a> {
    pub(super) solid: &'a Solid,
    /// Index of the solid.
    pub(super) index: usize,
    /// In units of the ray.
    pub(super) t: f64,
    pub(super) point: DVec3,
    /// Unit normal on the side of the viewer.
    pub(super) normal: DVec3,
}

/// The poses of an exposure, evenly spaced in time: one if nothing moves in the picture. And which of the obstacles move.
pub(super) fn poses<'a>(solids: &'a Solids, view: &View) -> (Vec<Pose<'a>>, Vec<bool>) {
    let at = |t: f64| Pose::new(solids, view, t);
    let [open, close] = [view.shutter.open, view.shutter.close].map(at);
    let moves: Vec<bool> = open.motion_pixels(&close).into_iter().map(|pixels| pixels >= MIN_MOTION_PIXELS).collect();
    if !moves.contains(&true) {
        return (vec![at(view.shutter.middle())], moves);
    }
    ((0..MAX_TIME_SAMPLES).map(|index| at(view.shutter.instant(index, MAX_TIME_SAMPLES))).collect(), moves)
}

impl<'a> Pose<'a> {
    fn new(solids: &'a Solids, view: &View, t: f64) -> Self {
        let placed = |solid: &'a Solid| {
            let (placement, bounds) = (solid.obstacle.placement(t), solid.obstacle.at(t).bounding_sphere());
            let (center, radius) = bounds.unwrap_or((placement.position, f64::INFINITY));
            PlacedSolid { solid, placement, center, radius }
        };
        Self { camera: view.camera_at(t), solids: solids.solids.iter().map(placed).collect(), mirror: view.mirror }
    }

    /// Largest motion of each obstacle in the picture from this pose to another one, pixels.
    fn motion_pixels(&self, other: &Self) -> Vec<f64> {
        let pairs = self.solids.iter().zip(&other.solids);
        let motion = |(before, after): (&PlacedSolid, &PlacedSolid)| {
            let ends = before.corners().into_iter().zip(after.corners());
            let each = ends.map(|(before, after)| {
                let pair = self.camera.project(before).zip(other.camera.project(after));
                pair.map_or(MIN_MOTION_PIXELS, |(a, b)| (a.pixel - b.pixel).length())
            });
            each.fold(0.0, f64::max)
        };
        pairs.map(motion).collect()
    }

    /// Nearest and farthest depth of each obstacle in front of the camera, m.
    pub(super) fn depths(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let near = self.camera.near;
        let depths = self.solids.iter().map(move |placed| {
            let middle = self.camera.depth(placed.center);
            [(middle - placed.radius).max(near), middle + placed.radius]
        });
        depths.filter(move |[_, far]| *far > near)
    }

    /// Corners of the rectangle of the picture that each obstacle may cover, pixels; all of it if a part of the obstacle is beside or behind the camera.
    pub(super) fn bounds(&self) -> Vec<[DVec2; 2]> {
        const ALL: [DVec2; 2] = [DVec2::NEG_INFINITY, DVec2::INFINITY];
        const NONE: [DVec2; 2] = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        let bounds = |placed: &PlacedSolid| {
            if self.camera.depth(placed.center) < -placed.radius {
                return NONE;
            }
            let mut bounds = NONE;
            for corner in placed.corners() {
                let Some(projection) = self.camera.project(corner) else { return ALL };
                bounds = [bounds[0].min(projection.pixel - 1.0), bounds[1].max(projection.pixel + 1.0)];
            }
            bounds
        };
        self.solids.iter().map(bounds).collect()
    }

    /// The first surface that a ray meets between two distances.
    pub(super) fn first_hit(&self, ray: &Ray, [from, mut to]: [f64; 2]) -> Option<SurfacePoint<'a>> {
        let mut nearest = None;
        let square = ray.direction.length_squared();
        for (index, placed) in self.solids.iter().enumerate() {
            let offset = placed.center - ray.origin;
            let closest = offset - ray.direction * (offset.dot(ray.direction) / square);
            if closest.length_squared() > placed.radius * placed.radius {
                continue;
            }
            let Some(Hit { t, normal }) = placed.intersect(ray, [from, to]) else { continue };
            to = t;
            let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
            nearest = Some(SurfacePoint { solid: placed.solid, index, t, point: ray.at(t), normal });
        }
        nearest
    }

    /// The surface that the camera sees at a position in the picture; `t` is its depth.
    pub(super) fn seen(&self, pixel: DVec2) -> Option<SurfacePoint<'a>> {
        let ray = Ray { origin: self.camera.position, direction: self.camera.direction(pixel)? };
        let near = match self.mirror {
            None => self.camera.near,
            Some(height) if ray.direction.y > 0.0 => ((height - ray.origin.y) / ray.direction.y).max(self.camera.near),
            Some(_) => return None,
        };
        self.first_hit(&ray, [near, f64::INFINITY])
    }

    /// Whether anything is between a point and a light at a distance (m) in a direction.
    pub(super) fn is_shadowed(&self, point: DVec3, toward: DVec3, distance: f64) -> bool {
        /// Offset of a ray from the surface where it begins, m.
        const OFFSET: f64 = 2e-3;
        self.first_hit(&Ray { origin: point, direction: toward }, [OFFSET, distance - OFFSET]).is_some()
    }
}

impl PlacedSolid<'_> {
    /// Corners of its bounding box.
    fn corners(&self) -> [DVec3; 8] {
        let parameters = self.solid.obstacle.parameters();
        let [low, high] = match (&self.solid.triangles, parameters.shape) {
            (Some(triangles), _) => triangles.bounds(),
            (None, shape) => {
                let radius = parameters.radius;
                let half = match shape {
                    ObstacleShape::Box => 0.5 * DVec3::from(parameters.size),
                    ObstacleShape::Cylinder => DVec3::new(radius, 0.5 * parameters.height, radius),
                    _ => DVec3::splat(radius),
                };
                [-half, half]
            }
        };
        std::array::from_fn(|index| {
            let pick = |axis: usize| if index >> axis & 1 == 0 { low[axis] } else { high[axis] };
            self.placement.point_in_world(DVec3::new(pick(0), pick(1), pick(2)))
        })
    }

    fn intersect(&self, ray: &Ray, limits: [f64; 2]) -> Option<Hit> {
        let back = self.placement.rotation.inverse();
        let local = Ray {
            origin: self.placement.point_in_local(ray.origin),
            direction: back * ray.direction / self.placement.scale,
        };
        let parameters = self.solid.obstacle.parameters();
        let hit = match (&self.solid.triangles, parameters.shape) {
            (Some(triangles), _) => triangles.intersect(&local, limits),
            (None, ObstacleShape::Box) => intersect::cuboid(&local, 0.5 * DVec3::from(parameters.size), limits),
            (None, ObstacleShape::Cylinder) => {
                intersect::cylinder(&local, parameters.radius, 0.5 * parameters.height, limits)
            }
            (None, _) => intersect::sphere(&local, parameters.radius, limits),
        };
        hit.map(|hit| Hit { normal: self.placement.direction_in_world(hit.normal), ..hit })
    }
}
