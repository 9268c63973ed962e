//! What an exposure can see: the camera when the shutter opens, half way and when it closes.

use bansho_base::{
    camera::{Camera, Lens},
    image::Rect,
    math::{DVec2, DVec3, MulAdd, simd::LANES},
    phenomenon::strip::View,
};

use super::{
    bin::Extent,
    project_lanes::{NOTHING, Row, Vectors},
};

/// An exposure's cameras.
#[derive(Clone, Debug)]
pub(crate) struct Sight {
    /// When the shutter opens, half way, and when it closes.
    pub(crate) cameras: [Camera; 3],
    /// The same, for sixteen points at a time.
    pub(crate) eyes: [Eye; 3],
    /// Columns and rows of the part of the picture that is drawn, pixels.
    pub(crate) window: Extent,
    /// How long the shutter is open, s.
    pub(crate) exposure: f64,
    /// What the cameras see of the part of the picture that is drawn; none where they see all around.
    frusta: Vec<Frustum>,
}

/// A camera for sixteen points at a time.
#[derive(Clone, Debug)]
pub(crate) struct Eye {
    camera: Camera,
    /// Where points are counted from, m.
    origin: DVec3,
    /// Right, up and backward.
    axes: [[f32; 3]; 3],
    /// Place of the origin along these, m.
    offset: [f32; 3],
    centre: [f32; 2],
    focal: f32,
    near: f32,
}

/// Where sixteen points lie in the picture.
pub(crate) struct Places {
    /// Pixels; not a number where the lens does not see the point.
    pub(crate) x: Row,
    pub(crate) y: Row,
    /// As the lens measures it, m.
    pub(crate) depth: Row,
    /// Pixels that a metre across the line of sight covers there.
    pub(crate) scale: Row,
}

impl Eye {
    fn new(camera: Camera, origin: DVec3) -> Self {
        let axes = [0, 1, 2].map(|axis| camera.orientation.col(axis).as_vec3().to_array());
        Self {
            axes,
            offset: camera.to_camera(origin).as_vec3().to_array(),
            centre: camera.centre.as_vec2().to_array(),
            focal: camera.focal_pixels as f32,
            near: camera.near as f32,
            camera,
            origin,
        }
    }

    #[inline(always)]
    pub(crate) fn lens(&self) -> Lens {
        self.camera.lens
    }

    #[inline(always)]
    pub(crate) fn project(&self, points: &Vectors) -> Places {
        match self.camera.lens {
            Lens::Perspective => self.project_flat(points),
            Lens::Fisheye | Lens::Panorama => self.project_round(points),
        }
    }

    /// As [`Camera::project`] in single precision.
    #[inline(always)]
    fn project_flat(&self, [xs, ys, zs]: &Vectors) -> Places {
        let mut places = Places { x: NOTHING, y: NOTHING, depth: NOTHING, scale: NOTHING };
        let [right, up, back] = &self.axes;
        for i in 0..LANES {
            let (x, y, z) = (xs[i], ys[i], zs[i]);
            let across = right[2].fma(z, right[1].fma(y, right[0].fma(x, self.offset[0])));
            let above = up[2].fma(z, up[1].fma(y, up[0].fma(x, self.offset[1])));
            let depth = -back[2].fma(z, back[1].fma(y, back[0].fma(x, self.offset[2])));
            let scale = self.focal / depth;
            let scale = if depth >= self.near { scale } else { f32::NAN };
            places.x[i] = across.fma(scale, self.centre[0]);
            places.y[i] = self.centre[1] - above * scale;
            (places.depth[i], places.scale[i]) = (depth, scale);
        }
        places
    }

    fn project_round(&self, [xs, ys, zs]: &Vectors) -> Places {
        const NOWHERE: Row = [f32::NAN; LANES];
        let mut places = Places { x: NOWHERE, y: NOWHERE, depth: NOWHERE, scale: NOWHERE };
        for i in 0..LANES {
            let point = self.origin + DVec3::new(xs[i].into(), ys[i].into(), zs[i].into());
            if let Some(place) = self.camera.project(point) {
                let DVec2 { x, y } = place.pixel;
                (places.x[i], places.y[i]) = (x as f32, y as f32);
                (places.depth[i], places.scale[i]) = (place.depth as f32, place.pixels_per_metre as f32);
            }
        }
        places
    }
}

/// What a camera sees: all that no side has before it.
#[derive(Clone, Debug)]
struct Frustum {
    position: DVec3,
    /// Unit vectors outward: right, left, bottom, top and back; all x, all y and all z, and after them zeros.
    sides: [[f64; SIDES]; 3],
}

/// Sides of a frustum, and as many more as vectors are filled with.
const SIDES: usize = 8;

impl Frustum {
    /// `None` where a lens has no flat sides.
    fn new(camera: &Camera, window: &Rect) -> Option<Self> {
        let [across, up, back] = [0, 1, 2].map(|axis| camera.orientation.col(axis));
        let tangent = |pixels: usize, centre: f64| (pixels as f64 - centre) / camera.focal_pixels;
        let [left, right] = [window.x, window.right()].map(|side| across + back * tangent(side, camera.centre.x));
        let [top, bottom] = [window.y, window.bottom()].map(|side| -up + back * tangent(side, camera.centre.y));
        let mut sides = [[0.0; SIDES]; 3];
        for (side, outward) in [right, -left, bottom, -top, back].map(DVec3::normalize).into_iter().enumerate() {
            (0..3).for_each(|axis| sides[axis][side] = outward[axis]);
        }
        (camera.lens == Lens::Perspective).then_some(Self { position: camera.position, sides })
    }

    #[inline(always)]
    fn may_see(&self, point: DVec3, half: DVec3, radius: f64) -> bool {
        let offset = point - self.position;
        let [xs, ys, zs] = &self.sides;
        let mut before = false;
        // Not one after the other: a branch for each side would be guessed wrongly.
        for side in 0..SIDES {
            let place = xs[side] * offset.x + ys[side] * offset.y + zs[side] * offset.z;
            let reach = xs[side].abs() * half.x + ys[side].abs() * half.y + zs[side].abs() * half.z;
            before |= place - reach > radius;
        }
        !before
    }
}

impl Sight {
    pub(crate) fn new(view: &View) -> Self {
        let shutter = view.shutter;
        let cameras = [view.camera_at(shutter.open), view.camera, view.camera_at(shutter.close)];
        let mut distinct = cameras.to_vec();
        distinct.dedup();
        let frusta = distinct.iter().filter_map(|camera| Frustum::new(camera, &view.window)).collect();
        let eyes = cameras.map(|camera| Eye::new(camera, view.camera.position));
        let window = &view.window;
        let window =
            [[window.x, window.right()], [window.y, window.bottom()]].map(|sides| sides.map(|side| side as f32));
        Self { cameras, eyes, window, exposure: shutter.duration(), frusta }
    }

    /// The camera half way.
    pub(crate) fn middle(&self) -> &Camera {
        &self.cameras[1]
    }

    /// Columns and rows of the picture.
    pub(crate) fn size(&self) -> [usize; 2] {
        self.cameras[1].size.map(|side| side as usize)
    }

    /// Velocity of the camera's place while the shutter is open, m/s.
    pub(crate) fn velocity(&self) -> DVec3 {
        let way = self.cameras[2].position - self.cameras[0].position;
        if self.exposure > 0.0 { way / self.exposure } else { DVec3::ZERO }
    }

    /// Whether anything within `radius` (m) of a box may be seen at any time of the exposure; the box reaches as far as `half` to both
    /// sides of `point` along the world's axes.
    #[inline(always)]
    pub(crate) fn may_see(&self, point: DVec3, half: DVec3, radius: f64) -> bool {
        let mut seen = self.frusta.is_empty();
        for frustum in &self.frusta {
            seen |= frustum.may_see(point, half, radius);
        }
        seen
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
    fn whatever_projects_into_the_picture_may_be_seen() {
        let view = View::new(CameraParameters::default(), Shutter { open: 0.0, close: 0.02 }, 0.03, [320, 180], 4);
        let sight = Sight::new(&view);
        let (mut seen, mut hidden) = (0, 0);
        for i in 0..4000 {
            let u = Key::new(1, "sight").uniforms(i, 0, Purpose::named("point")).map(f64::from);
            let point = DVec3::new(20.0 * u[0] - 10.0, 20.0 * u[1] - 10.0, 20.0 * u[2] - 10.0);
            let inside = |pixel: DVec2| {
                (0.0..view.size[0] as f64).contains(&pixel.x) && (0.0..view.size[1] as f64).contains(&pixel.y)
            };
            let projects = view.camera.project(point).is_some_and(|place| inside(place.pixel));
            assert!(!projects || sight.may_see(point, DVec3::ZERO, 0.0));
            seen += usize::from(projects);
            hidden += usize::from(!sight.may_see(point, DVec3::splat(0.5), 0.0));
        }
        assert!(seen > 50 && hidden > 3000, "{seen} {hidden}");
    }
}
