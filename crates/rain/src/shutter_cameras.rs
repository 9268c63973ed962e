//! The cameras of one exposure: when the shutter opens, at its middle and when it closes. Visibility tests against
//! their frusta.

use bansho_base::{
    camera::{Camera, Lens},
    image::Rect,
    math::{DVec3, MulAdd, simd::LANES},
    phenomenon::strip::View,
};

use crate::lanes::{LaneArray, Vec3Lanes, ZERO_LANES};

/// Bounding box in the picture: columns and rows `[low, high]`, pixels. It may extend beyond the picture.
pub(crate) type PixelBounds = [[f32; 2]; 2];

/// Radius of the lens's entrance pupil, m: that of a 24 mm lens at f/3.
pub(crate) const PUPIL_RADIUS: f32 = 4e-3;

/// Largest radius at which a drop is visible around its center, m: that of the largest drop and its defocus blur.
pub(crate) const MAX_DROP_RADIUS: f64 = 4e-3 + PUPIL_RADIUS as f64;

/// Steps of the exposure at whose ends the cameras of lenses are known that bend straight lines.
pub(crate) const PATH_STEPS: usize = 16;

/// The cameras of one exposure.
#[derive(Clone, Debug)]
pub(crate) struct ShutterCameras {
    /// When the shutter opens, at the middle of the exposure, and when it closes.
    pub(crate) cameras: [Camera; 3],
    /// Those at the beginnings and ends of [`PATH_STEPS`] equal parts of the exposure, of a fisheye or a panorama that moves.
    during_exposure: Vec<Camera>,
    /// The same cameras, for sixteen points at a time.
    pub(crate) projectors: [Projector; 3],
    /// Columns and rows of the picture: whole pixels, of which a camera with larger pixels may see a part of the last.
    size: [usize; 2],
    /// Columns and rows of the crop window, pixels.
    pub(crate) window: PixelBounds,
    /// Pixels after which a panorama repeats.
    pub(crate) period: Option<f32>,
    /// Duration of the exposure, s.
    pub(crate) exposure_time: f64,
    /// View frusta of the crop window; empty for lenses that see all around.
    frusta: Vec<Frustum>,
}

/// Projects sixteen points at a time.
#[derive(Clone, Debug)]
pub(crate) struct Projector {
    /// The camera's axes: right, up and backward.
    axes: [[f32; 3]; 3],
    /// The origin in camera coordinates, m.
    offset: [f32; 3],
    center: [f32; 2],
    focal: f32,
    near: f32,
}

/// Sixteen points projected into the picture.
pub(crate) struct ProjectedPoints {
    /// Pixels; NaN where the lens does not see the point.
    pub(crate) x: LaneArray,
    pub(crate) y: LaneArray,
    /// Depth by the lens's definition, m.
    pub(crate) depth: LaneArray,
    /// Pixels for one meter perpendicular to the line of sight.
    pub(crate) scale: LaneArray,
}

impl Projector {
    fn new(camera: Camera, origin: DVec3) -> Self {
        let axes = [0, 1, 2].map(|axis| camera.world_from_camera.col(axis).as_vec3().to_array());
        Self {
            axes,
            offset: camera.point_in_camera(origin).as_vec3().to_array(),
            center: camera.principal_point.as_vec2().to_array(),
            focal: camera.focal_pixels as f32,
            near: camera.near as f32,
        }
    }

    /// [`Camera::project`] of a perspective lens in single precision.
    #[inline(always)]
    pub(crate) fn project(&self, [xs, ys, zs]: &Vec3Lanes) -> ProjectedPoints {
        let mut points = ProjectedPoints { x: ZERO_LANES, y: ZERO_LANES, depth: ZERO_LANES, scale: ZERO_LANES };
        let [right, up, back] = &self.axes;
        for i in 0..LANES {
            let (x, y, z) = (xs[i], ys[i], zs[i]);
            let across = right[2].fma(z, right[1].fma(y, right[0].fma(x, self.offset[0])));
            let above = up[2].fma(z, up[1].fma(y, up[0].fma(x, self.offset[1])));
            let depth = -back[2].fma(z, back[1].fma(y, back[0].fma(x, self.offset[2])));
            let scale = self.focal / depth;
            let scale = if depth >= self.near { scale } else { f32::NAN };
            points.x[i] = across.fma(scale, self.center[0]);
            points.y[i] = self.center[1] - above * scale;
            (points.depth[i], points.scale[i]) = (depth, scale);
        }
        points
    }
}

/// View frustum: a point is inside if it is inside all planes.
#[derive(Clone, Debug)]
struct Frustum {
    position: DVec3,
    /// Outward unit normals: right, left, bottom, top and back; all x, all y and all z, padded with zeros.
    planes: [[f64; PLANE_COUNT]; 3],
}

/// Planes of a frustum, padded to a whole SIMD vector.
const PLANE_COUNT: usize = 8;

impl Frustum {
    /// `None` for a lens without planar sides.
    fn new(camera: &Camera, window: &Rect) -> Option<Self> {
        let [across, up, back] = [0, 1, 2].map(|axis| camera.world_from_camera.col(axis));
        let (center, focal) = (camera.principal_point, camera.focal_pixels);
        let [left, right] = [window.x, window.right()].map(|side| across + back * ((side as f64 - center.x) / focal));
        let [top, bottom] = [window.y, window.bottom()].map(|side| -up + back * ((side as f64 - center.y) / focal));
        let mut planes = [[0.0; PLANE_COUNT]; 3];
        for (side, outward) in [right, -left, bottom, -top, back].map(DVec3::normalize).into_iter().enumerate() {
            (0..3).for_each(|axis| planes[axis][side] = outward[axis]);
        }
        (camera.lens == Lens::Perspective).then_some(Self { position: camera.position, planes })
    }

    #[inline(always)]
    fn may_be_visible(&self, point: DVec3, half: DVec3, radius: f64) -> bool {
        let offset = point - self.position;
        let [xs, ys, zs] = &self.planes;
        let mut outside = false;
        // Without early exit: a branch for each plane would be mispredicted.
        for side in 0..PLANE_COUNT {
            let projection = xs[side] * offset.x + ys[side] * offset.y + zs[side] * offset.z;
            let extent = xs[side].abs() * half.x + ys[side].abs() * half.y + zs[side].abs() * half.z;
            outside |= projection - extent > radius;
        }
        !outside
    }

    /// The part of a line `start + t step` in which [`may_be_visible`](Self::may_be_visible) can be true: the range of t, empty if its ends are reversed.
    fn visible_part(&self, [start, step]: [DVec3; 2], half: DVec3, radius: f64) -> [f64; 2] {
        let [mut from, mut to] = [f64::NEG_INFINITY, f64::INFINITY];
        for side in 0..PLANE_COUNT {
            let normal = DVec3::from(self.planes.map(|plane| plane[side]));
            let (rise, excess) =
                (normal.dot(step), normal.dot(start - self.position) - normal.abs().dot(half) - radius);
            let crossing = -excess / rise;
            if rise > 0.0 {
                to = to.min(crossing);
            } else if rise < 0.0 {
                from = from.max(crossing);
            } else if excess > 0.0 {
                return [f64::INFINITY, f64::NEG_INFINITY];
            }
        }
        [from, to]
    }
}

impl ShutterCameras {
    pub(crate) fn new(view: &View) -> Self {
        let shutter = view.shutter;
        let cameras = [view.camera_at(shutter.open), view.camera, view.camera_at(shutter.close)];
        let mut distinct = cameras.to_vec();
        distinct.dedup();
        let frusta = distinct.iter().filter_map(|camera| Frustum::new(camera, &view.window)).collect();
        let projectors = cameras.map(|camera| Projector::new(camera, view.camera.position));
        let window = &view.window;
        let window =
            [[window.x, window.right()], [window.y, window.bottom()]].map(|sides| sides.map(|side| side as f32));
        let is_moving = view.camera.lens != Lens::Perspective && distinct.len() > 1;
        let mut during_exposure = Vec::new();
        if is_moving {
            for step in 0..=PATH_STEPS {
                let t = shutter.open + shutter.duration() * (step as f64 / PATH_STEPS as f64);
                during_exposure.push(view.camera_at(t));
            }
        }
        Self {
            cameras,
            during_exposure,
            projectors,
            size: view.size,
            window,
            period: view.camera.horizontal_period().map(|period| period as f32),
            exposure_time: shutter.duration(),
            frusta,
        }
    }

    /// The camera at the middle of the exposure.
    pub(crate) fn middle(&self) -> &Camera {
        &self.cameras[1]
    }

    /// The camera after a number of [`PATH_STEPS`] of the exposure, of a fisheye or a panorama.
    pub(crate) fn during_exposure(&self, step: usize) -> &Camera {
        self.during_exposure.get(step).unwrap_or(&self.cameras[1])
    }

    /// Columns and rows of the picture.
    pub(crate) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Velocity of the camera's position during the exposure, m/s.
    pub(crate) fn velocity(&self) -> DVec3 {
        let displacement = self.cameras[2].position - self.cameras[0].position;
        if self.exposure_time > 0.0 { displacement / self.exposure_time } else { DVec3::ZERO }
    }

    /// Whether anything within `radius` (m) of an axis-aligned box may be visible at any time of the exposure. The box
    /// has the center `point` and the half extents `half`.
    #[inline(always)]
    pub(crate) fn may_be_visible(&self, point: DVec3, half: DVec3, radius: f64) -> bool {
        let mut is_visible = self.frusta.is_empty();
        for frustum in &self.frusta {
            is_visible |= frustum.may_be_visible(point, half, radius);
        }
        is_visible
    }

    /// A range of t outside of which no point `start + t step` passes [`may_be_visible`](Self::may_be_visible); empty if its ends are reversed.
    pub(crate) fn visible_part(&self, line: [DVec3; 2], half: DVec3, radius: f64) -> [f64; 2] {
        let parts = self.frusta.iter().map(|frustum| frustum.visible_part(line, half, radius));
        parts.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).unwrap_or([f64::NEG_INFINITY, f64::INFINITY])
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::CameraParameters,
        math::{
            DVec2,
            random::{Key, Purpose},
        },
        phenomenon::strip::Shutter,
    };

    use super::*;

    #[test]
    fn the_picture_of_a_mirrored_view_has_all_of_its_pixels() {
        let shutter = Shutter { open: 0.0, close: 0.02 };
        for (size, halved) in [([64, 1], [32, 1]), ([1, 1], [1, 1]), ([17, 11], [9, 6]), ([16, 17], [8, 9])] {
            let view = View::new(CameraParameters::default(), shutter, 0.03, size, 0).with_pixel_size(2);
            assert_eq!((view.size, ShutterCameras::new(&view).size()), (halved, halved), "half of {size:?}");
        }
    }

    #[test]
    fn whatever_projects_into_the_picture_may_be_seen() {
        let view = View::new(CameraParameters::default(), Shutter { open: 0.0, close: 0.02 }, 0.03, [320, 180], 4);
        let cameras = ShutterCameras::new(&view);
        let (mut seen, mut hidden, mut in_part) = (0, 0, 0);
        for i in 0..4000 {
            let u = Key::new(1, "sight").uniforms(i, 0, Purpose::named("point")).map(f64::from);
            let point = DVec3::new(20.0 * u[0] - 10.0, 20.0 * u[1] - 10.0, 20.0 * u[2] - 10.0);
            let inside = |pixel: DVec2| {
                (0.0..view.size[0] as f64).contains(&pixel.x) && (0.0..view.size[1] as f64).contains(&pixel.y)
            };
            let projects = view.camera.project(point).is_some_and(|projection| inside(projection.pixel));
            assert!(!projects || cameras.may_be_visible(point, DVec3::ZERO, 0.0));
            let (half, radius) = (DVec3::new(0.5, 0.2, 0.5), 0.1);
            let step = DVec3::new(0.3, 1.0 - 2.0 * u[3], 0.2);
            let [from, to] = cameras.visible_part([point, step], half, radius);
            for t in [-20.0, -7.0, -1.0, 0.0, 0.5, 3.0, 11.0] {
                let may_be_visible = cameras.may_be_visible(point + t * step, half, radius);
                // There is one camera, so the range is exact but for rounding at its ends.
                assert!(may_be_visible == (t > from && t < to), "{t} {from} {to}");
                in_part += usize::from(may_be_visible);
            }
            seen += usize::from(projects);
            hidden += usize::from(!cameras.may_be_visible(point, DVec3::splat(0.5), 0.0));
        }
        assert!(seen > 50 && hidden > 3000 && in_part > 500, "{seen} {hidden} {in_part}");
    }
}
