//! Camera and obstacles at one time while the shutter is open.

use bansho_base::{
    camera::{Camera, Lens, angular_distance::AngularDistance},
    geometry::transform::Transform,
    math::{self, DVec2, DVec3},
    phenomenon::strip::{Shutter, View, parts_of_motion},
};

use super::{
    ObstacleShape, Solid, Solids,
    intersect::{self, Hit, Ray},
};

/// Most time samples of an exposure.
const MAX_TIME_SAMPLES: usize = 32;
/// Motion in the picture from which on there is motion blur, pixels.
const MIN_MOTION_PIXELS: f64 = 0.3;

/// Camera and obstacles at one time.
pub(super) struct Pose<'a> {
    pub(super) camera: Camera,
    /// Fraction of the exposure that is over, if it is one of several poses.
    pub(super) fraction: Option<f64>,
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

/// The path of each obstacle in the picture during an exposure, pixels, and the pose in the middle.
fn motions<'a>(solids: &'a Solids, view: &View) -> (Vec<f64>, Pose<'a>) {
    let times = [view.shutter.open, view.shutter.middle(), view.shutter.close];
    let [open, middle, close] = times.map(|t| Pose::new(solids, view, t));
    let mut motions = open.motion_pixels(&close);
    // An obstacle that turns around or shakes may end where it began.
    let halves = open.motion_pixels(&middle).into_iter().zip(middle.motion_pixels(&close));
    for (motion, (first, second)) in motions.iter_mut().zip(halves) {
        *motion = motion.max(first + second);
    }
    (motions, middle)
}

/// The poses of an exposure, evenly spaced in time: one if nothing moves in the picture. And which of the obstacles move.
pub(super) fn poses<'a>(solids: &'a Solids, view: &View) -> (Vec<Pose<'a>>, Vec<bool>) {
    let (motions, middle) = motions(solids, view);
    let moves: Vec<bool> = motions.iter().map(|motion| *motion >= MIN_MOTION_PIXELS).collect();
    if !moves.contains(&true) {
        return (vec![middle], moves);
    }
    let mut poses = Vec::with_capacity(MAX_TIME_SAMPLES);
    for index in 0..MAX_TIME_SAMPLES {
        let mut pose = Pose::new(solids, view, view.shutter.instant(index, MAX_TIME_SAMPLES));
        pose.fraction = Some((index as f64 + 0.5) / MAX_TIME_SAMPLES as f64);
        poses.push(pose);
    }
    (poses, moves)
}

/// The parts of an exposure in which no obstacle moves by much more than a pixel of the picture.
pub(super) fn parts_of_exposure(solids: &Solids, view: &View) -> usize {
    let (motions, _) = motions(solids, view);
    let motion = motions.into_iter().fold(0.0, f64::max);
    if motion < MIN_MOTION_PIXELS { 1 } else { parts_of_motion(motion, 1.0, view.shutter.max_parts()).max(2) }
}

impl Solids {
    /// Length of the longest path of a corner of an obstacle while the shutter is open, m.
    pub(super) fn longest_path(&self, shutter: Shutter) -> f64 {
        if shutter.duration() <= 0.0 {
            return 0.0;
        }
        self.solids.iter().map(|solid| solid.longest_path(shutter)).fold(0.0, f64::max)
    }
}

impl<'a> Pose<'a> {
    pub(super) fn new(solids: &'a Solids, view: &View, t: f64) -> Self {
        let solids = solids.solids.iter().map(|solid| PlacedSolid::new(solid, t)).collect();
        Self { camera: view.camera_at(t), fraction: None, solids, mirror: view.mirror }
    }

    /// Where the obstacles are.
    pub(super) fn placements(&self) -> impl Iterator<Item = Transform> + '_ {
        self.solids.iter().map(|placed| placed.placement)
    }

    /// Largest motion of each obstacle in the picture from this pose to another one, pixels.
    fn motion_pixels(&self, other: &Self) -> Vec<f64> {
        let mut motions = Vec::with_capacity(self.solids.len());
        for (before, after) in self.solids.iter().zip(&other.solids) {
            let mut largest = 0.0_f64;
            for (before, after) in before.corners().into_iter().zip(after.corners()) {
                let pair = self.camera.project_beyond_circle(before).zip(other.camera.project_beyond_circle(after));
                // A corner that a camera cannot project is taken to move.
                largest = largest.max(pair.map_or(MIN_MOTION_PIXELS, |(a, b)| {
                    (a.pixel - other.camera.nearest_repetition(b.pixel, a.pixel)).length()
                }));
            }
            motions.push(largest);
        }
        motions
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

    /// Corners of the rectangle of the picture that each obstacle may cover, pixels; all of it if a part of the obstacle is beside or behind a perspective
    /// camera. Through other lenses, where edges are curved, that of the sphere that contains it.
    pub(super) fn bounds(&self) -> Vec<[DVec2; 2]> {
        self.solids.iter().map(|placed| placed.bounds(&self.camera)).collect()
    }

    /// The first surface that a ray meets between two distances.
    pub(super) fn first_hit(&self, ray: &Ray, [from, mut to]: [f64; 2]) -> Option<SurfacePoint<'a>> {
        let mut nearest = None;
        let square = ray.direction.length_squared();
        for (index, placed) in self.solids.iter().enumerate() {
            let offset = placed.center - ray.origin;
            // The bounding sphere first: it needs no change of frame.
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

impl Solid {
    /// Length of the longest path of a corner while the shutter is open, m.
    fn longest_path(&self, shutter: Shutter) -> f64 {
        let placements = shutter.path_times().map(|t| self.obstacle.placement(t));
        if placements.iter().all(|placement| *placement == placements[0]) {
            return 0.0;
        }
        let corners = placements.map(|placement| self.corners(&placement));
        let mut longest = 0.0_f64;
        for index in 0..8 {
            let steps = corners.windows(2).map(|pair| (pair[1][index] - pair[0][index]).length());
            longest = longest.max(steps.sum::<f64>());
        }
        longest
    }

    /// Corners of its bounding box at a placement.
    fn corners(&self, placement: &Transform) -> [DVec3; 8] {
        let parameters = self.obstacle.parameters();
        let [low, high] = match (&self.triangles, parameters.shape) {
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
            // One bit of the index for each axis.
            let corner = [0, 1, 2].map(|axis| if index >> axis & 1 == 0 { low[axis] } else { high[axis] });
            placement.point_in_world(DVec3::from(corner))
        })
    }
}

impl<'a> PlacedSolid<'a> {
    /// An obstacle at time `t`.
    fn new(solid: &'a Solid, t: f64) -> Self {
        let (placement, bounds) = (solid.obstacle.placement(t), solid.obstacle.at(t).bounding_sphere());
        let (center, radius) = bounds.unwrap_or((placement.position, f64::INFINITY));
        Self { solid, placement, center, radius }
    }

    /// See [`Pose::bounds`].
    fn bounds(&self, camera: &Camera) -> [DVec2; 2] {
        const ALL: [DVec2; 2] = [DVec2::NEG_INFINITY, DVec2::INFINITY];
        const NONE: [DVec2; 2] = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        if camera.depth(self.center) < -self.radius {
            return NONE;
        }
        let mut bounds = NONE;
        if camera.lens != Lens::Perspective {
            let to_center = self.center - camera.position;
            let sine = self.radius / to_center.length();
            let direction = AngularDistance::new(camera, to_center.normalize_or_zero());
            // Around the camera, it may cover everything.
            let (Some(direction), true) = (direction, sine < 1.0) else { return ALL };
            for rect in direction.rects_within(math::asin(sine), camera.size.map(|side| side.ceil() as usize)) {
                let corners = [[rect.x, rect.y], [rect.right(), rect.bottom()]];
                let [low, high] = corners.map(|corner| DVec2::from(corner.map(|side| side as f64)));
                bounds = [bounds[0].min(low), bounds[1].max(high)];
            }
            return bounds;
        }
        for corner in self.corners() {
            let Some(projection) = camera.project(corner) else { return ALL };
            bounds = [bounds[0].min(projection.pixel - 1.0), bounds[1].max(projection.pixel + 1.0)];
        }
        bounds
    }

    /// Corners of its bounding box.
    fn corners(&self) -> [DVec3; 8] {
        self.solid.corners(&self.placement)
    }

    fn intersect(&self, ray: &Ray, limits: [f64; 2]) -> Option<Hit> {
        let back = self.placement.rotation.inverse();
        let local = Ray {
            origin: self.placement.point_in_local(ray.origin),
            // Scaled like the solid, so that distances along the ray are the same in both frames.
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
