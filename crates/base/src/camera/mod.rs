//! Cameras: pose, lens, and projection between world and picture.

pub mod angular_distance;
pub mod directions;
pub mod turns;
pub mod upright_quad;

use glam::{DMat3, DVec2, DVec3};

use crate::{
    math,
    parameters::{
        Range,
        animated::{Animated, longest_cut_s},
    },
};

crate::choice! {
    /// How directions are projected into the picture.
    pub enum Lens {
        /// Straight lines stay straight.
        Perspective = "perspective",
        /// Equidistant fisheye: the distance from the center of the inscribed circle is proportional to the angle (domes).
        Fisheye = "fisheye",
        /// Equirectangular panorama: 360 degrees across, 180 degrees down.
        Panorama = "panorama",
    }
}

/// Height of an observer's eye, m.
const EYE_HEIGHT: f64 = 1.7;

crate::parameters! {
    /// The camera. In a dome, `target` is at the center of the circle. Without `position` and `target` a scene has a camera that shows its phenomena well, if
    /// they are all of one kind with default positions and sizes and there are no obstacles and no plate. A flame is then seen from nearby, and rain along its
    /// lamps. Auroras are seen from the ground, looking up to the north, or toward the zenith in a dome.
    pub struct CameraParameters {
        /// Position of the camera.
        position: Animated<[f64; 3]> = Animated::from([0.0, 1.2, 4.0]), unit("m");
        /// Point that the camera looks at.
        target: Animated<[f64; 3]> = Animated::from([0.0, 0.9, 0.0]), unit("m");
        /// Direction that is at the top of the picture, as far as the line of sight allows. A camera that tilts through the zenith, or flies over its target,
        /// would turn the picture by 180 degrees where it looks along this direction. Choose or animate a direction that the line of sight never meets, such as
        /// [0, 0, 1] for a dome that tilts from the zenith to the north.
        up: Animated<[f64; 3]> = Animated::from([0.0, 1.0, 0.0]);
        /// Rotation about the line of sight; positive tilts the camera to its left.
        roll_deg: Animated<f64> = Animated::from(0.0), limits(Range::new(-3600.0, 3600.0)), unit("degrees");
        /// Projection of the lens: perspective, dome or panorama.
        lens: Lens = Lens::Perspective;
        /// Vertical field of view of a perspective lens, unless `focal_length_mm` is given.
        vertical_fov_deg: Animated<f64> = Animated::from(32.0), limits(VERTICAL_FOV_DEG), unit("degrees");
        /// Focal length; together with `sensor_height_mm` it determines the field of view.
        focal_length_mm: Option<Animated<f64>> = None, limits(Range::new(0.1, 10_000.0)), unit("mm");
        /// Sensor height for `focal_length_mm`.
        sensor_height_mm: f64 = 24.0, limits(Range::new(0.1, 1000.0)), unit("mm");
        /// Full angle of a fisheye's circle.
        fisheye_fov_deg: f64 = 180.0, limits(Range::new(1.0, 360.0)), unit("degrees");
        /// Near clipping distance: nothing nearer is drawn.
        near: f64 = 0.05, limits(Range::new(1e-4, 1e4)), unit("m");
        /// Lens shift: displacement of the view to the right and up, in picture heights, without rotating the camera. The principal point moves the other way.
        shift: [f64; 2] = [0.0, 0.0], limits(Range::new(-10.0, 10.0)), unit("picture heights");
        /// Fraction of all light that lens and air scatter over the picture, most of it within 2 degrees. The default is 0.03 for pictures and films for display, and 0 for
        /// flipbooks, live effects and `--view raw`; EXR files have glare only on request. 0.01 is a clean prime lens at night, 0.1 a dirty window.
        glare: Option<f64> = None, limits(Range::new(0.0, 0.5));
        /// Exposure time; half a frame if omitted.
        shutter_s: Option<f64> = None, limits(Range::new(0.0, 10.0)), unit("s");
        /// Time at which the shutter opens, relative to the time of the frame.
        shutter_offset_s: f64 = 0.0, limits(Range::new(-10.0, 10.0)), unit("s");
    }
}

/// Smallest and largest vertical field of view of a perspective lens, degrees, whether it is stated or follows from the focal length and the sensor.
pub const VERTICAL_FOV_DEG: Range = Range::new(0.1, 170.0);

/// Vertical field of view of a 14 mm lens, as used to photograph auroras, degrees.
pub const SKY_FOV_DEG: f64 = 81.0;

impl CameraParameters {
    /// Moves the camera to the origin, at eye height, looking up at the sky: toward the north with a perspective lens or a panorama, toward the zenith with a dome.
    pub fn look_up(&mut self) {
        let target = match self.lens {
            // The picture covers the sky from the horizon nearly to the zenith.
            Lens::Perspective => [0.0, 60.0, -60.0],
            Lens::Fisheye => [0.0, 100.0, 0.0],
            Lens::Panorama => [0.0, EYE_HEIGHT, -60.0],
        };
        (self.position, self.target) = (Animated::from([0.0, EYE_HEIGHT, 0.0]), Animated::from(target));
    }

    /// Smallest and largest vertical field of view over all time, degrees; `None` unless a focal length is given.
    #[must_use]
    pub fn fov_of_focal_length(&self) -> Option<[f64; 2]> {
        // Interpolation never overshoots the keys, so the extremes lie at keys.
        let [shortest, longest] = self.focal_length_mm.as_ref()?.bounds();
        Some([longest, shortest].map(|focal| (2.0 * half_fov(self.sensor_height_mm, focal)).to_degrees()))
    }

    /// Whether the camera is the same at all times.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        let field_of_view = self.focal_length_mm.as_ref().unwrap_or(&self.vertical_fov_deg);
        [&self.position, &self.target, &self.up].iter().all(|vector| vector.constant().is_some())
            && [&self.roll_deg, field_of_view].iter().all(|number| number.constant().is_some())
    }

    /// The camera as an exposure with its middle at `middle` (s) sees it, in frames of `frame_s` seconds: on one side of every cut, which is no motion. See
    /// [`Animated::of_exposure`].
    #[must_use]
    pub fn of_exposure(&self, middle: f64, frame_s: f64) -> Self {
        let longest = longest_cut_s(frame_s);
        Self {
            position: self.position.of_exposure(middle, longest),
            target: self.target.of_exposure(middle, longest),
            up: self.up.of_exposure(middle, longest),
            roll_deg: self.roll_deg.of_exposure(middle, longest),
            vertical_fov_deg: self.vertical_fov_deg.of_exposure(middle, longest),
            focal_length_mm: self.focal_length_mm.as_ref().map(|focal| focal.of_exposure(middle, longest)),
            ..*self
        }
    }

    /// The camera at time `t` for a picture of `size` pixels.
    pub fn at(&self, t: f64, size: [usize; 2]) -> Camera {
        let half_fov = match &self.focal_length_mm {
            Some(focal) => half_fov(self.sensor_height_mm, focal.at(t)),
            None => 0.5 * self.vertical_fov_deg.at(t).to_radians(),
        };
        let [position, target, up] = [&self.position, &self.target, &self.up].map(|vector| DVec3::from(vector.at(t)));
        let orientation = look_at(position, target, up, self.roll_deg.at(t).to_radians());
        let height = size[1] as f64;
        Camera {
            lens: self.lens,
            position,
            world_from_camera: orientation,
            near: self.near,
            principal_point: DVec2::new(
                0.5 * size[0] as f64 - self.shift[0] * height,
                0.5 * height + self.shift[1] * height,
            ),
            size: [size[0] as f64, height],
            focal_pixels: match self.lens {
                Lens::Perspective => 0.5 * height / math::tan(half_fov),
                Lens::Fisheye => 0.5 * height.min(size[0] as f64) / (0.5 * self.fisheye_fov_deg.to_radians()),
                Lens::Panorama => height / std::f64::consts::PI,
            },
            half_angle: 0.5 * self.fisheye_fov_deg.to_radians(),
            half_fov,
        }
    }
}

/// Half the field of view for a sensor size and a focal length, radians.
fn half_fov(sensor_mm: f64, focal_mm: f64) -> f64 {
    math::atan(0.5 * sensor_mm / focal_mm)
}

/// Cosine of the angle between the line of sight and `up` from which on the line of sight counts as parallel to it.
const PARALLEL: f64 = 0.999_999;

/// Orientation of a camera, columns: right, up, backward. With the default `up`, north (-z) is at the top when the camera looks straight up, so that
/// east is on the left, as on star charts, and south when it looks straight down.
fn look_at(position: DVec3, target: DVec3, up: DVec3, roll: f64) -> DMat3 {
    let back = (position - target).try_normalize().unwrap_or(DVec3::Z);
    let up = up.try_normalize().unwrap_or(DVec3::Y);
    let along = back.dot(up);
    let reference = if along.abs() <= PARALLEL {
        up
    } else {
        // Nothing is up: south, or the vertical where the line of sight is about north and south.
        let sign = along.signum();
        if back.z.abs() < 0.9 { DVec3::new(0.0, 0.0, sign) } else { DVec3::new(0.0, sign, 0.0) }
    };
    let right = reference.cross(back).normalize();
    let up = back.cross(right);
    let (sin, cos) = math::sin_cos(roll);
    DMat3::from_cols(right * cos + up * sin, up * cos - right * sin, back)
}

/// A camera at one instant, for a picture of one size. Pixel (0, 0) is at the top left; its center is at (0.5, 0.5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Lens.
    pub lens: Lens,
    /// Position, m.
    pub position: DVec3,
    /// World-from-camera rotation; its columns are right, up and backward.
    pub world_from_camera: DMat3,
    /// Near clipping distance, m.
    pub near: f64,
    /// Principal point, pixels.
    pub principal_point: DVec2,
    /// Picture size, pixels.
    pub size: [f64; 2],
    /// Focal length in pixels: pixels per unit of tangent (perspective) or per radian (fisheye, panorama).
    pub focal_pixels: f64,
    half_angle: f64,
    half_fov: f64,
}

/// A point of the world projected into the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Pixels from the picture's left and top edges.
    pub pixel: DVec2,
    /// Depth, m: along the optical axis for perspective, Euclidean distance for fisheye and panorama.
    pub depth: f64,
    /// Pixels covered by one meter perpendicular to the line of sight at that depth.
    pub pixels_per_meter: f64,
}

/// Camera metadata for file headers, for compositing programs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraHeader {
    /// World to camera (row vectors, as OpenEXR's `worldToCamera`), meters. In single precision its translation would be off by centimeters far from the
    /// origin.
    pub world_to_camera: [[f64; 4]; 4],
    /// World to the screen window from -1 to 1, as OpenEXR's `worldToNDC`; `None` for domes and panoramas, for which there is no such matrix.
    pub world_to_ndc: Option<[[f64; 4]; 4]>,
    /// Vertical field of view of a perspective lens, degrees.
    pub vertical_fov_deg: Option<f32>,
    /// Projection of the lens; `None` for pictures that were not taken through a lens.
    pub lens: Option<Lens>,
    /// Full angle of a fisheye's circle, degrees.
    pub fisheye_fov_deg: Option<f32>,
}

impl Camera {
    /// The same camera with a picture extended by `pixels` on every side.
    pub fn with_overscan(mut self, pixels: usize) -> Self {
        self.principal_point += DVec2::splat(pixels as f64);
        self.size = self.size.map(|side| side + 2.0 * pixels as f64);
        self
    }

    /// The same camera with a picture of larger pixels, each `side` times as wide and as high.
    pub fn with_pixel_size(mut self, side: usize) -> Self {
        let side = side as f64;
        self.principal_point /= side;
        self.focal_pixels /= side;
        self.size = self.size.map(|pixels| pixels / side);
        self
    }

    /// The camera reflected at a horizontal mirror at `height`: each of its pixels shows what this camera sees at that pixel in the mirror.
    /// Its frame is left-handed.
    pub fn mirrored(mut self, height: f64) -> Self {
        self.position.y = 2.0 * height - self.position.y;
        self.world_from_camera = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0)) * self.world_from_camera;
        self
    }

    /// The same camera, whose fisheye has no circle at which its picture ends.
    pub fn with_unlimited_angle(mut self) -> Self {
        self.half_angle = std::f64::consts::PI;
        self
    }

    /// `point` in camera space: right, up, backward, m.
    #[inline(always)]
    pub fn point_in_camera(&self, point: DVec3) -> DVec3 {
        self.world_from_camera.transpose() * (point - self.position)
    }

    /// Depth of `point` in the convention of this lens (see [`Projection::depth`]), m; negative behind a perspective camera.
    #[inline(always)]
    pub fn depth(&self, point: DVec3) -> f64 {
        match self.lens {
            Lens::Perspective => -self.point_in_camera(point).z,
            Lens::Fisheye | Lens::Panorama => (point - self.position).length(),
        }
    }

    /// Projects `point` into the picture; `None` if it lies outside the field of view or nearer than `near`.
    #[inline(always)]
    pub fn project(&self, point: DVec3) -> Option<Projection> {
        self.project_within(point, self.half_angle)
    }

    /// Like [`project`](Self::project), also outside the circle of a fisheye, for what only partly lies within it.
    #[inline(always)]
    pub fn project_beyond_circle(&self, point: DVec3) -> Option<Projection> {
        self.project_within(point, std::f64::consts::PI)
    }

    #[inline(always)]
    fn project_within(&self, point: DVec3, max_fisheye_angle: f64) -> Option<Projection> {
        let local = self.point_in_camera(point);
        let depth = self.depth(point);
        if depth.is_nan() || depth < self.near {
            return None;
        }
        let offset = match self.lens {
            Lens::Perspective => DVec2::new(local.x, local.y) / depth,
            Lens::Fisheye => {
                let across = math::hypot(local.x, local.y);
                let angle = math::atan2(across, -local.z);
                if angle > max_fisheye_angle {
                    return None;
                }
                if across > 0.0 { DVec2::new(local.x, local.y) * (angle / across) } else { DVec2::ZERO }
            }
            Lens::Panorama => {
                DVec2::new(math::atan2(local.x, -local.z), math::asin((local.y / depth).clamp(-1.0, 1.0)))
            }
        };
        Some(Projection {
            pixel: self.principal_point + DVec2::new(offset.x, -offset.y) * self.focal_pixels,
            depth,
            pixels_per_meter: self.focal_pixels / depth,
        })
    }

    /// The view direction at a position in the picture, in world space; `None` outside the circle of a fisheye.
    ///
    /// Its length is 1 for fisheye and panorama. For perspective its component along the optical axis is 1, so that
    /// `position + depth * direction` is the point at that depth for every lens.
    pub fn direction(&self, pixel: DVec2) -> Option<DVec3> {
        let x = (pixel.x - self.principal_point.x) / self.focal_pixels;
        let y = (self.principal_point.y - pixel.y) / self.focal_pixels;
        let local = match self.lens {
            Lens::Perspective => DVec3::new(x, y, -1.0),
            Lens::Fisheye => {
                let angle = math::hypot(x, y);
                if angle > self.half_angle {
                    return None;
                }
                let (sin, cos) = math::sin_cos(angle);
                let across = if angle > 0.0 { sin / angle } else { 1.0 };
                DVec3::new(x * across, y * across, -cos)
            }
            Lens::Panorama => {
                let (sin_longitude, cos_longitude) = math::sin_cos(x);
                let (sin_latitude, cos_latitude) = math::sin_cos(y);
                DVec3::new(sin_longitude * cos_latitude, sin_latitude, -cos_longitude * cos_latitude)
            }
        };
        Some(self.world_from_camera * local)
    }

    /// Solid angle of one pixel at a position in the picture, steradian: what turns an illuminance at the camera (lux) into the luminance of the pixels
    /// that show it. With f the focal length in pixels it is cos^3 a / f^2 for a perspective lens at the angle a from its axis, sin t / t / f^2 for an
    /// equidistant fisheye at the angle t, and cos of the latitude / f^2 for a panorama; 0 where the picture shows no direction.
    #[must_use]
    pub fn pixel_solid_angle(&self, pixel: DVec2) -> f64 {
        let offset = (pixel - self.principal_point) / self.focal_pixels;
        let relative = match self.lens {
            Lens::Perspective => {
                let cosine = 1.0 / (1.0 + offset.length_squared()).sqrt();
                cosine * cosine * cosine
            }
            Lens::Fisheye => {
                let angle = offset.length();
                if angle > 0.0 { math::sin(angle) / angle } else { 1.0 }
            }
            Lens::Panorama => math::cos(offset.y),
        };
        relative.max(0.0) / (self.focal_pixels * self.focal_pixels)
    }

    /// Width in pixels after which a panorama repeats, 360 degrees; `None` for lenses whose pictures do not repeat.
    #[must_use]
    pub fn horizontal_period(&self) -> Option<f64> {
        (self.lens == Lens::Panorama).then_some(std::f64::consts::TAU * self.focal_pixels)
    }

    /// The position nearest to `reference` at which the direction of `pixel` appears, so that both can be joined by a line: `pixel` moved by whole
    /// periods of a panorama; for a fisheye possibly its image beyond the antipode, where the radius grows on past 180 degrees on the opposite side. It
    /// may lie outside of the picture. Unchanged for a perspective lens.
    #[must_use]
    #[inline(always)]
    pub fn nearest_repetition(&self, pixel: DVec2, reference: DVec2) -> DVec2 {
        match self.lens {
            Lens::Perspective => pixel,
            Lens::Fisheye => {
                let beyond = self.beyond_antipode(pixel);
                let is_nearer = (beyond - reference).length_squared() < (pixel - reference).length_squared();
                if is_nearer { beyond } else { pixel }
            }
            Lens::Panorama => {
                let period = std::f64::consts::TAU * self.focal_pixels;
                DVec2::new(pixel.x - period * ((pixel.x - reference.x) / period).round(), pixel.y)
            }
        }
    }

    /// Where a fisheye shows the direction of `pixel` if its radius grows on beyond the antipode, at 180 degrees: at 360 degrees less the angle, on the
    /// opposite side.
    fn beyond_antipode(&self, pixel: DVec2) -> DVec2 {
        let offset = pixel - self.principal_point;
        let radius = offset.length();
        let direction = if radius > 0.0 { offset / radius } else { DVec2::X };
        self.principal_point - direction * (std::f64::consts::TAU * self.focal_pixels - radius)
    }

    /// The line from `from` to the nearest repetition of `to` in all places where it may reach into the picture, with `margin` pixels around it: several
    /// where it crosses the seam of a panorama, or the antipode of a fisheye. The second line of a fisheye is the first beyond the antipode, so that each
    /// point is inside of 180 degrees in one of them.
    #[must_use]
    pub fn line_images(&self, from: DVec2, to: DVec2, margin: f64) -> Vec<[DVec2; 2]> {
        let near_to = self.nearest_repetition(to, from);
        match self.lens {
            Lens::Perspective => vec![[from, to]],
            Lens::Fisheye if near_to == to => vec![[from, to]],
            Lens::Fisheye => vec![[from, near_to], [self.beyond_antipode(from), to]],
            Lens::Panorama => {
                let period = std::f64::consts::TAU * self.focal_pixels;
                let (left, right) = (from.x.min(near_to.x) - margin, from.x.max(near_to.x) + margin);
                let (first, last) = ((-right / period).ceil(), ((self.size[0] - left) / period).floor());
                // Not where a coordinate is absurd or NaN.
                let is_bounded = last - first < 1e6;
                if !is_bounded {
                    return Vec::new();
                }
                let shifts = (first as i64..=last as i64).map(|turn| DVec2::new(turn as f64 * period, 0.0));
                shifts.map(|shift| [from + shift, near_to + shift]).collect()
            }
        }
    }

    /// Whether a position in the picture is within the circle of a fisheye; true for other lenses.
    #[must_use]
    #[inline(always)]
    pub fn is_in_circle(&self, pixel: DVec2) -> bool {
        let radius = self.half_angle * self.focal_pixels;
        self.lens != Lens::Fisheye || (pixel - self.principal_point).length_squared() <= radius * radius
    }

    /// Half of the field of view of a fisheye lens, radians.
    #[must_use]
    pub fn half_angle(&self) -> f64 {
        self.half_angle
    }

    /// The camera metadata written to EXR headers.
    pub fn header(&self) -> CameraHeader {
        let rotation = self.world_from_camera.transpose();
        let translation = -(rotation * self.position);
        let mut world_to_camera = [[0.0_f64; 4]; 4];
        for row in 0..3 {
            for column in 0..3 {
                world_to_camera[row][column] = rotation.col(row)[column];
            }
            world_to_camera[3][row] = translation[row];
        }
        world_to_camera[3][3] = 1.0;
        let (is_perspective, is_fisheye) = (self.lens == Lens::Perspective, self.lens == Lens::Fisheye);
        CameraHeader {
            world_to_camera,
            world_to_ndc: is_perspective.then(|| self.world_to_ndc(&world_to_camera)),
            vertical_fov_deg: is_perspective.then_some((2.0 * self.half_fov).to_degrees() as f32),
            lens: Some(self.lens),
            fisheye_fov_deg: is_fisheye.then_some((2.0 * self.half_angle).to_degrees() as f32),
        }
    }

    /// Row-vector matrix from world space to the screen window [-1, 1] of a perspective lens.
    fn world_to_ndc(&self, world_to_camera: &[[f64; 4]; 4]) -> [[f64; 4]; 4] {
        let [width, height] = self.size;
        let (shift_x, shift_y) =
            (2.0 * self.principal_point.x / width - 1.0, 1.0 - 2.0 * self.principal_point.y / height);
        let projection = [
            [2.0 * self.focal_pixels / width, 0.0, 0.0, 0.0],
            [0.0, 2.0 * self.focal_pixels / height, 0.0, 0.0],
            [-shift_x, -shift_y, -1.0, -1.0],
            [0.0, 0.0, -2.0 * self.near, 0.0],
        ];
        let mut product = [[0.0; 4]; 4];
        for (row, result) in product.iter_mut().enumerate() {
            for (column, cell) in result.iter_mut().enumerate() {
                *cell = (0..4).map(|k| world_to_camera[row][k] * projection[k][column]).sum();
            }
        }
        product
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(lens: Lens) -> Camera {
        let parameters = CameraParameters {
            lens,
            position: Animated::from([1.0, 2.0, 3.0]),
            target: Animated::from([-2.0, 2.5, -4.0]),
            roll_deg: Animated::from(11.0),
            shift: [0.03, -0.02],
            ..CameraParameters::default()
        };
        parameters.at(0.0, [320, 240])
    }

    #[test]
    fn projection_and_direction_are_each_others_inverse_for_every_lens() {
        for lens in [Lens::Perspective, Lens::Fisheye, Lens::Panorama] {
            let camera = camera(lens);
            for pixel in [DVec2::new(160.0, 120.0), DVec2::new(100.5, 60.5), DVec2::new(201.0, 170.0)] {
                let direction = camera.direction(pixel).unwrap();
                let point = camera.position + direction * 7.5;
                let projection = camera.project(point).unwrap();
                assert!((projection.pixel - pixel).length() < 1e-9, "{lens:?} {pixel} {projection:?}");
                assert!((projection.depth - 7.5).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_mirrored_camera_sees_the_reflected_ray() {
        let (camera, height) = (camera(Lens::Perspective), 0.5);
        let pixel = DVec2::new(40.0, 200.0);
        let direction = camera.direction(pixel).unwrap();
        assert!(direction.y < 0.0);
        let ground = camera.position + direction * ((height - camera.position.y) / direction.y);
        let seen = ground + DVec3::new(direction.x, -direction.y, direction.z) * 3.0;
        let mirrored = camera.mirrored(height);
        assert!((mirrored.project(seen).unwrap().pixel - pixel).length() < 1e-9);
        assert_eq!(mirrored.mirrored(height), camera);
    }

    #[test]
    fn lines_join_neighboring_directions_across_the_seam_and_the_antipode() {
        let straight_ahead = |lens, fov| CameraParameters {
            lens,
            fisheye_fov_deg: fov,
            target: [0.0, 1.2, 3.0].into(),
            ..Default::default()
        };
        for (lens, fov) in [(Lens::Fisheye, 360.0), (Lens::Fisheye, 340.0), (Lens::Panorama, 180.0)] {
            let camera = straight_ahead(lens, fov).at(0.0, [400, 200]);
            // On both sides of the direction backward, 2 degrees apart, and both elsewhere.
            for (angle, count) in [(180.0_f64, 2), (90.0, 1)] {
                let [from, to] = [-1.0, 1.0].map(|side: f64| {
                    let (sin, cos) = math::sin_cos((angle + side).to_radians());
                    camera
                        .project_beyond_circle(camera.position + DVec3::new(5.0 * sin, 0.0, -5.0 * cos))
                        .unwrap()
                        .pixel
                });
                let lines = camera.line_images(from, to, 1.0);
                assert_eq!(lines.len(), count, "{lens:?} {fov} at {angle}");
                let length = 2.0_f64.to_radians() * camera.focal_pixels;
                for [a, b] in &lines {
                    assert!(((*a - *b).length() - length).abs() < 1e-6, "{lens:?} {fov} at {angle}: {a} {b}");
                }
                assert!(lines[0][0] == from || lines.iter().any(|line| line[0] == from));
                assert!(lines.iter().any(|line| (line[1] - to).length() < 1e-9));
            }
        }
    }

    #[test]
    fn the_solid_angles_of_all_pixels_sum_to_what_the_lens_sees() {
        use std::f64::consts::PI;
        let at = |lens, size| CameraParameters { lens, ..CameraParameters::default() }.at(0.0, size);
        let seen = |camera: Camera| -> f64 {
            let [width, height] = camera.size.map(|side| side as usize);
            let centers = (0..height).flat_map(|y| (0..width).map(move |x| DVec2::new(x as f64 + 0.5, y as f64 + 0.5)));
            centers
                .filter(|pixel| camera.direction(*pixel).is_some())
                .map(|pixel| camera.pixel_solid_angle(pixel))
                .sum()
        };
        let panorama = seen(at(Lens::Panorama, [512, 256]));
        assert!((panorama / (4.0 * PI) - 1.0).abs() < 1e-4, "{panorama}");
        let dome = seen(at(Lens::Fisheye, [512, 512]));
        assert!((dome / (2.0 * PI) - 1.0).abs() < 2e-3, "{dome}");
        // A pyramid with the half angles a and b fills 4 asin(sin a sin b).
        let perspective = seen(at(Lens::Perspective, [400, 400]));
        let half = math::sin(16_f64.to_radians());
        assert!((perspective / (4.0 * math::asin(half * half)) - 1.0).abs() < 1e-5, "{perspective}");
    }

    #[test]
    fn a_panorama_repeats_and_other_lenses_do_not() {
        let around = CameraParameters { lens: Lens::Panorama, ..CameraParameters::default() }.at(0.0, [1024, 512]);
        let [left, right] = [DVec2::new(2.0, 300.0), DVec2::new(1020.0, 310.0)];
        assert!((around.horizontal_period().unwrap() - 1024.0).abs() < 1e-9);
        assert!((around.nearest_repetition(right, left) - DVec2::new(-4.0, 310.0)).length() < 1e-9);
        assert!((around.nearest_repetition(left, right) - DVec2::new(1026.0, 300.0)).length() < 1e-9);
        let straight = CameraParameters::default().at(0.0, [1024, 512]);
        assert_eq!(straight.nearest_repetition(right, left), right);
    }

    #[test]
    fn larger_pixels_show_the_same_directions() {
        for lens in [Lens::Perspective, Lens::Fisheye, Lens::Panorama] {
            let fine = camera(lens);
            let coarse = fine.with_pixel_size(4);
            let pixel = DVec2::new(121.0, 93.0);
            let [near, far] = [fine.direction(pixel), coarse.direction(pixel / 4.0)].map(Option::unwrap);
            assert!((near - far).length() < 1e-12 && coarse.size == [80.0, 60.0], "{lens:?}");
        }
    }

    #[test]
    fn the_target_lies_in_the_middle_and_up_is_up() {
        let parameters = CameraParameters::default();
        let camera = parameters.at(0.0, [640, 480]);
        let middle = camera.project(DVec3::new(0.0, 0.9, 0.0)).unwrap();
        assert!((middle.pixel - DVec2::new(320.0, 240.0)).length() < 1e-9);
        let above = camera.project(DVec3::new(0.0, 1.4, 0.0)).unwrap();
        assert!(above.pixel.y < 240.0 && (above.pixel.x - 320.0).abs() < 1e-9);
    }

    #[test]
    fn vertical_field_of_view_reaches_from_edge_to_edge() {
        let parameters = CameraParameters {
            position: Animated::from([0.0, 0.0, 0.0]),
            target: Animated::from([0.0, 0.0, -1.0]),
            vertical_fov_deg: Animated::from(90.0),
            ..CameraParameters::default()
        };
        let top = parameters.at(0.0, [200, 100]).project(DVec3::new(0.0, 2.0, -2.0)).unwrap();
        assert!(top.pixel.y.abs() < 1e-9);
    }

    #[test]
    fn a_dome_shows_its_horizon_on_the_circle_and_nothing_beyond() {
        let parameters = CameraParameters {
            lens: Lens::Fisheye,
            position: Animated::from([0.0, 0.0, 0.0]),
            target: Animated::from([0.0, 1.0, 0.0]),
            ..CameraParameters::default()
        };
        let camera = parameters.at(0.0, [512, 512]);
        let horizon = camera.project(DVec3::new(10.0, 0.001, 0.0)).unwrap();
        assert!(((horizon.pixel - camera.principal_point).length() - 256.0).abs() < 0.1);
        assert!(camera.project(DVec3::new(10.0, -0.1, 0.0)).is_none());
        assert!(camera.direction(DVec2::new(1.0, 1.0)).is_none());
    }

    #[test]
    fn header_matrices_put_the_target_in_the_middle_of_the_screen_window() {
        let camera = CameraParameters { shift: [0.1, 0.2], ..CameraParameters::default() }.at(0.0, [400, 300]);
        let header = camera.header();
        let point = [0.3, 1.1, -0.5, 1.0];
        let clip: Vec<f64> =
            (0..4).map(|column| (0..4).map(|k| point[k] * header.world_to_ndc.unwrap()[k][column]).sum()).collect();
        let seen = camera.project(DVec3::new(0.3, 1.1, -0.5)).unwrap().pixel;
        let expected = DVec2::new(2.0 * seen.x / 400.0 - 1.0, 1.0 - 2.0 * seen.y / 300.0);
        assert!((clip[0] / clip[3] - expected.x).abs() < 1e-12);
        assert!((clip[1] / clip[3] - expected.y).abs() < 1e-12);
    }

    #[test]
    fn header_matrices_hold_far_from_the_origin() {
        let target = [500_000.0, 1.5, 400_000.0];
        let parameters = CameraParameters {
            position: [500_003.0, 1.6, 400_002.6].into(),
            target: target.into(),
            vertical_fov_deg: Animated::from(30.0),
            ..CameraParameters::default()
        };
        let matrix = parameters.at(0.0, [1920, 1080]).header().world_to_ndc.unwrap();
        let point = [target[0], target[1], target[2], 1.0];
        let [x, y, w] = [0, 1, 3].map(|column| (0..4).map(|row| point[row] * matrix[row][column]).sum::<f64>());
        let off = [960.0 * x / w, 540.0 * y / w];
        assert!(off.iter().all(|pixels| pixels.abs() < 1e-4), "{off:?} pixels off");
    }

    #[test]
    fn up_is_what_is_at_the_top() {
        let toward = |up: [f64; 3], target: [f64; 3]| {
            let parameters = CameraParameters {
                position: [0.0; 3].into(),
                target: target.into(),
                up: up.into(),
                ..CameraParameters::default()
            };
            parameters.at(0.0, [64, 64]).world_from_camera
        };
        for (up, target) in [([0.0, 0.0, 2.0], [0.0, 9.0, 0.0]), ([1.0, 0.0, 0.0], [0.0, 0.0, -4.0])] {
            let axes = toward(up, target);
            assert!((axes.y_axis - DVec3::from(up).normalize()).length() < 1e-12, "{up:?}: {axes:?}");
            assert!((axes.determinant() - 1.0).abs() < 1e-12);
        }
        // Along the line of sight nothing is up.
        for target in [[0.0, 3.0, 0.0], [0.0, 0.0, -3.0], [5.0, 0.0, 0.0]] {
            let axes = toward(target, target);
            assert!(axes.is_finite() && (axes.determinant() - 1.0).abs() < 1e-12, "{axes:?}");
        }
        assert_eq!(toward([0.0, 7.0, 0.0], [1.0, 2.0, 3.0]), toward([0.0, 1.0, 0.0], [1.0, 2.0, 3.0]));
    }

    #[test]
    fn headers_say_of_each_lens_what_is_true_of_it() {
        let header =
            |lens| CameraParameters { lens, fisheye_fov_deg: 200.0, ..Default::default() }.at(0.0, [8, 8]).header();
        let straight = header(Lens::Perspective);
        assert_eq!((straight.lens, straight.fisheye_fov_deg), (Some(Lens::Perspective), None));
        assert!((straight.vertical_fov_deg.unwrap() - 32.0).abs() < 1e-4 && straight.world_to_ndc.is_some());
        let dome = header(Lens::Fisheye);
        assert_eq!((dome.lens, dome.vertical_fov_deg, dome.world_to_ndc), (Some(Lens::Fisheye), None, None));
        assert!((dome.fisheye_fov_deg.unwrap() - 200.0).abs() < 1e-4);
        let around = header(Lens::Panorama);
        assert_eq!((around.vertical_fov_deg, around.world_to_ndc, around.fisheye_fov_deg), (None, None, None));
    }
}
