//! Reflected rays marched through a plate's own picture until they meet a surface there: screen-space reflections (McGuire & Mara 2014).
//!
//! Tiles of the picture in which a ray cannot hit anything are skipped, which changes no result ([`depth_pyramid`](super::depth_pyramid)).

use bansho_base::{
    camera::{Camera, Lens},
    image::Image,
    math::{DVec2, DVec3},
    phenomenon::LevelMirror,
};

use super::depth_pyramid::{DepthPyramid, ScreenRay, TileTraversal, parameter};

/// Distance between samples of a ray, pixels.
const STRIDE: f64 = 1.0;
/// Smallest and largest number of samples of a ray.
const SAMPLE_COUNTS: [f64; 2] = [16.0, 4096.0];
/// Largest relative decrease of the plate's depth between two samples that still belongs to one surface. After a larger one the plate shows an
/// object in front of the ray, which continues behind it.
const DEPTH_JUMP: f64 = 0.03;
/// Distance that stands for infinity, m.
const FAR_M: f64 = 1e6;

/// A plate through which reflected rays are marched.
pub(super) struct RayMarch<'a> {
    /// Width and height of the plate, pixels.
    pub(super) size: [usize; 2],
    pub(super) depth: Option<&'a Image<1>>,
    /// The pyramid of the depth; without it no tiles are skipped.
    pub(super) pyramid: Option<&'a DepthPyramid>,
    pub(super) camera: &'a Camera,
    pub(super) mirror: LevelMirror,
}

/// A reflected ray. Its parameter t goes from 0 at the mirror to 1 at infinity, and is linear in the picture of a perspective camera.
struct ReflectedRay {
    origin: DVec3,
    direction: DVec3,
    scale: f64,
    /// Only for perspective cameras.
    on_screen: Option<ScreenRay>,
}

/// The point where a ray meets a surface of the plate.
struct Hit {
    pixel: DVec2,
    /// Distance from the mirror, in lengths of the ray's direction.
    distance: f64,
}

/// What is reflected at one pixel.
#[derive(Debug)]
pub(super) struct Reflected {
    /// The position on the plate that is seen.
    pub(super) source: DVec2,
    /// Depth as the mirrored camera measures it, m.
    pub(super) depth: f32,
}

impl ReflectedRay {
    /// Distance along `direction` at parameter `t`.
    fn distance(&self, t: f64) -> f64 {
        self.scale * t / (1.0 - t)
    }

    fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * self.distance(t)
    }
}

/// A sample of a ray, and the plate's depth there.
#[derive(Clone, Copy)]
struct RaySample {
    t: f64,
    pixel: DVec2,
    /// Depth of the ray, m.
    depth: f64,
    /// Depth of the plate, m.
    plate_depth: f64,
}

impl RayMarch<'_> {
    /// The reflection at a pixel.
    pub(super) fn reflected(&self, pixel: DVec2) -> Option<Reflected> {
        let down = self.camera.direction(pixel)?;
        let height = self.camera.position.y - self.mirror.height;
        if down.y >= 0.0 || height <= 0.0 {
            return None;
        }
        let to_mirror = height / -down.y;
        let plate_depth = self.plate_depth(pixel);
        if to_mirror > FAR_M || (plate_depth < to_mirror && self.is_above_mirror(pixel, plate_depth)) {
            // An object in front hides the mirror here. Its own color is the best guess for blurred reflections beside it.
            return Some(Reflected { source: pixel, depth: plate_depth as f32 });
        }
        let up = DVec3::new(down.x, -down.y, down.z);
        let ray = self.reflected_ray(self.camera.position + down * to_mirror, to_mirror, up);
        match self.first_hit(pixel, &ray) {
            Some(hit) => Some(Reflected { source: hit.pixel, depth: (to_mirror + hit.distance) as f32 }),
            None => self.source_at_infinity(&ray).map(|source| Reflected { source, depth: f32::INFINITY }),
        }
    }

    /// The ray that leaves the mirror at `origin`, whose depth is `depth`.
    fn reflected_ray(&self, origin: DVec3, depth: f64, direction: DVec3) -> ReflectedRay {
        let along_axis = -(self.camera.world_from_camera.transpose() * direction).z;
        if self.camera.lens != Lens::Perspective || along_axis <= 1e-3 {
            return ReflectedRay { origin, direction, scale: depth, on_screen: None };
        }
        let mut ray = ReflectedRay { origin, direction, scale: depth / along_axis, on_screen: None };
        let points = [0.0, 0.5].map(|t| self.camera.project(ray.at(t)));
        if let [Some(start), Some(middle)] = points {
            ray.on_screen =
                Some(ScreenRay { origin: start.pixel, step: 2.0 * (middle.pixel - start.pixel), depth: start.depth });
        }
        ray
    }

    /// The first surface of the plate that a ray from the mirror at pixel `start` meets.
    fn first_hit(&self, start: DVec2, ray: &ReflectedRay) -> Option<Hit> {
        self.depth?;
        let length = match &ray.on_screen {
            Some(screen) => screen.step.length(),
            None => {
                let end = self.camera.project(ray.origin + ray.direction * FAR_M);
                end.map_or(SAMPLE_COUNTS[1] * 0.25, |end| (end.pixel - start).length())
            }
        };
        let count = (length / STRIDE).ceil().clamp(SAMPLE_COUNTS[0], SAMPLE_COUNTS[1]) as usize;
        let mut before = self.sample(ray, 0.0)?;
        // The last sample before the ray passed behind a nearer object; `None` while it is in front of the plate.
        let mut hidden_since: Option<RaySample> = None;
        let mut tiles =
            self.pyramid.zip(ray.on_screen.as_ref()).map(|(pyramid, ray)| TileTraversal::new(pyramid, ray, count));
        let mut step = 0;
        while step + 1 < count {
            step += 1;
            if let Some(tiles) = tiles.as_mut().filter(|_| hidden_since.is_none()) {
                step = tiles.skip(step).unwrap_or(step);
            }
            let Some(sample) = self.sample(ray, parameter(step, count)) else { break };
            if sample.depth > sample.plate_depth && self.is_above_mirror(sample.pixel, sample.plate_depth) {
                // The tolerance is for the mirror itself, whose depth in the plate may differ a little from its true one.
                if hidden_since.is_none()
                    && sample.plate_depth > before.depth.min(before.plate_depth) * (1.0 - DEPTH_JUMP)
                {
                    return Some(self.crossing(ray, &before, &sample));
                }
                // While it was behind the nearer object, it met a farther surface.
                if hidden_since.is_some() && sample.plate_depth > before.plate_depth * (1.0 + DEPTH_JUMP) {
                    return Some(Hit { pixel: sample.pixel, distance: ray.distance(sample.t) });
                }
                hidden_since = hidden_since.or(Some(before));
            } else {
                hidden_since = None;
            }
            before = sample;
        }
        // The object hides what the ray meets behind it. The color seen beside the object is the best guess.
        hidden_since.map(|sample| Hit { pixel: sample.pixel, distance: ray.distance(sample.t) })
    }

    /// The sample of a ray at `t`; `None` outside the picture.
    fn sample(&self, ray: &ReflectedRay, t: f64) -> Option<RaySample> {
        let (pixel, depth) = match &ray.on_screen {
            Some(screen) => (screen.pixel(t), screen.depth(t)),
            None => {
                let projected = self.camera.project(ray.at(t))?;
                (projected.pixel, projected.depth)
            }
        };
        self.is_inside(pixel).then(|| RaySample { t, pixel, depth, plate_depth: self.plate_depth(pixel) })
    }

    fn is_inside(&self, pixel: DVec2) -> bool {
        let [width, height] = self.size;
        pixel.x >= 0.0 && pixel.y >= 0.0 && pixel.x < width as f64 && pixel.y < height as f64
    }

    /// The point between two samples where ray and plate have the same depth.
    fn crossing(&self, ray: &ReflectedRay, before: &RaySample, after: &RaySample) -> Hit {
        let [ahead, past] = [before, after].map(|sample| sample.plate_depth - sample.depth);
        let is_linear = ahead.is_finite() && ahead > 0.0 && ahead - past > 0.0;
        // At t = 0 the plate shows the mirror itself, and the difference of depths is only rounding.
        let fraction = if is_linear && before.t > 0.0 { ahead / (ahead - past) } else { 1.0 };
        let t = before.t + fraction * (after.t - before.t);
        Hit { pixel: before.pixel + (after.pixel - before.pixel) * fraction, distance: ray.distance(t) }
    }

    /// The end of a ray that met no surface, where the plate is infinitely far.
    fn source_at_infinity(&self, ray: &ReflectedRay) -> Option<DVec2> {
        let end = self.camera.project(ray.origin + ray.direction * FAR_M)?.pixel;
        (self.is_inside(end) && !self.plate_depth(end).is_finite()).then_some(end)
    }

    /// Whether what the plate shows at a pixel, at this depth, is above the mirror.
    fn is_above_mirror(&self, pixel: DVec2, depth: f64) -> bool {
        let Some(direction) = self.camera.direction(pixel).filter(|_| depth.is_finite()) else { return false };
        let above = self.camera.position.y + direction.y * depth - self.mirror.height;
        above > self.mirror.tolerance_at(depth, self.camera.focal_pixels)
    }

    /// The plate's depth at a pixel, m; not interpolated.
    fn plate_depth(&self, pixel: DVec2) -> f64 {
        let Some(depth) = self.depth else { return f64::INFINITY };
        let (x, y) = (pixel.x as usize, pixel.y as usize);
        f64::from(depth.at(x.min(depth.width() - 1), y.min(depth.height() - 1))[0])
    }
}
