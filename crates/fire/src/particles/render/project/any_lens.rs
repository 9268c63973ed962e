//! Projection of one particle at a time, for every lens.

use super::{PIXEL_FOOTPRINT, ProjectedParticle};
use crate::particles::render::{
    gas::Gas,
    gas_view::GasView,
    splat::{
        Ellipse,
        cap::Cap,
        kernel::{LINE_PEAK, VARIANCE},
    },
};
use bansho_base::{
    camera::{Camera, Lens, Projection},
    math::{self, DMat2, DVec2, DVec3},
};

/// Projects particles into a view.
pub(super) struct AnyLensProjector<'a> {
    pub(super) view: &'a GasView,
}

impl AnyLensProjector<'_> {
    /// Projects a particle and passes it to `visit`. In a panorama its images whole turns away, which may be visible across the seam, are passed too.
    #[inline(always)]
    pub(super) fn project(&self, gas: &Gas, index: usize, mut visit: impl FnMut(ProjectedParticle)) {
        let view = self.view;
        let position = gas.position(index, view.shutter.middle());
        let camera = &view.camera;
        let Some(projection) = project(camera, position) else { return };
        let next = project(&view.next, gas.position(index, view.next_middle));
        let motion = motion(camera, Some(projection), next);
        let blur = match &view.ends {
            Some([open, close]) => {
                let opened = project(open, gas.position(index, view.shutter.open));
                let closed = project(close, gas.position(index, view.shutter.close));
                self::motion(camera, opened, closed)
            }
            None => motion * view.shutter_fraction(),
        };
        let sprite = match self.cap(gas, index, position, &projection, blur) {
            Some(cap) => cap,
            None => match self.ellipse(gas, index, position, &projection, blur) {
                Some(ellipse) => ellipse,
                None => return,
            },
        };
        let (depth, scale) = (projection.depth, projection.pixels_per_meter as f32);
        // Cells have directions, so that a cap is on both sides of the seam.
        let (left, right) =
            if sprite.cap.is_some() { (0, 0) } else { self.visible_turns(sprite.center[0], sprite.half_size[0]) };
        for turn in left..=right {
            let center = [sprite.center[0] + (f64::from(turn) * self.period()) as f32, sprite.center[1]];
            let ellipse = Ellipse { center, ..sprite };
            visit(ProjectedParticle { index, ellipse, depth, motion: motion.as_vec2().to_array(), scale });
        }
    }

    /// Width after which the picture repeats, pixels; 0 if it does not.
    fn period(&self) -> f64 {
        self.view.camera.horizontal_period().unwrap_or(0.0)
    }

    /// The first and last repetition of the picture in which a sprite is visible, in turns to the right.
    fn visible_turns(&self, center: f32, half_width: f32) -> (i32, i32) {
        /// Margin beyond the edges, pixels, and in half widths of a sprite.
        const MARGIN_PIXELS: f64 = 8.0;
        const MARGIN_SIZES: f64 = 4.0;
        /// More than this many repetitions are only covered by sprites that cover the whole picture.
        const MAX_TURNS: f64 = 2.0;
        let period = self.period();
        if period <= 0.0 {
            return (0, 0);
        }
        // Interpolation reads cells beyond the edges, which are as large as the sprites are smooth.
        let (center, half_width) = (f64::from(center), MARGIN_PIXELS + MARGIN_SIZES * f64::from(half_width));
        let first = ((-half_width - center) / period).ceil().clamp(-MAX_TURNS, MAX_TURNS);
        let last = ((self.view.camera.size[0] + half_width - center) / period).floor().clamp(-MAX_TURNS, MAX_TURNS);
        (first as i32, last as i32)
    }

    /// The ellipse of a ball at `projection` with a motion blur of `blur` pixels.
    ///
    /// The sprite is widened by the variance of a box of that length and of the pixel's footprint; its integral is unchanged.
    fn ellipse(
        &self,
        gas: &Gas,
        index: usize,
        position: DVec3,
        projection: &Projection,
        blur: DVec2,
    ) -> Option<Ellipse> {
        let camera = &self.view.camera;
        let radius = f64::from(gas.particles.support_radius[index]);
        let lens = lens_jacobian(camera, position, projection);
        let ball = lens * lens.transpose() * (radius * radius);
        let blur_and_footprint =
            outer(blur) * (1.0 / (12.0 * VARIANCE)) + DMat2::from_diagonal(DVec2::splat(PIXEL_FOOTPRINT / VARIANCE));
        let matrix = ball + blur_and_footprint;
        let (trace, determinant) = (matrix.x_axis.x + matrix.y_axis.y, matrix.determinant());
        if !(determinant > 0.0 && determinant.is_finite()) {
            return None;
        }
        let inverse = matrix.inverse();
        let larger_eigenvalue = 0.5 * trace + (0.25 * trace * trace - determinant).max(0.0).sqrt();
        let half_size = DVec2::new(matrix.x_axis.x.sqrt(), matrix.y_axis.y.sqrt());
        let size = DVec2::new(camera.size[0], camera.size[1]);
        let center = projection.pixel;
        let is_in_rows = center.y + half_size.y > 0.0 && center.y - half_size.y < size.y;
        let is_in_columns =
            camera.lens == Lens::Panorama || (center.x + half_size.x > 0.0 && center.x - half_size.x < size.x);
        let is_visible = is_in_rows && is_in_columns && self.reaches_the_picture(projection, radius);
        if !(is_visible && center.abs().max_element() < self.view.max_pixel_coordinate()) {
            return None;
        }
        let in_front = in_front(projection.depth, camera.near, radius);
        let peak = LINE_PEAK * in_front * lens.determinant().abs() / determinant.sqrt();
        (peak > 0.0).then_some(Ellipse {
            center: center.as_vec2().to_array(),
            shape: [inverse.x_axis.x, inverse.x_axis.y, inverse.y_axis.y].map(|value| value as f32),
            half_size: half_size.as_vec2().to_array(),
            radius: (determinant / larger_eigenvalue).max(0.0).sqrt() as f32,
            peak: peak as f32,
            cap: None,
        })
    }

    /// The sprite of a ball that no ellipse describes; `None` for other balls.
    fn cap(&self, gas: &Gas, index: usize, position: DVec3, projection: &Projection, blur: DVec2) -> Option<Ellipse> {
        let (camera, depth) = (&self.view.camera, projection.depth);
        let radius = f64::from(gas.particles.support_radius[index]);
        if !is_distorted(camera, projection, radius / depth) || !self.reaches_the_picture(projection, radius) {
            return None;
        }
        // A line of the length `blur` widens a ball in both directions by half of its variance.
        let angle = self.angle_across(projection, blur);
        let footprint = PIXEL_FOOTPRINT / (camera.focal_pixels * camera.focal_pixels);
        let widened = (radius * radius + depth * depth * (angle * angle / 24.0 + footprint) / VARIANCE).sqrt();
        let (center, half_size) = self.bounds_of_cap(projection, widened / depth);
        let in_front = in_front(depth, camera.near, radius);
        Some(Ellipse {
            center: center.as_vec2().to_array(),
            shape: [1.0, 0.0, 1.0],
            half_size: half_size.as_vec2().to_array(),
            radius: (widened * projection.pixels_per_meter) as f32,
            peak: (LINE_PEAK * in_front / (widened * widened)) as f32,
            cap: Some(Cap {
                direction: ((position - camera.position) / depth).as_vec3().to_array(),
                falloff: (depth * depth / (widened * widened)) as f32,
            }),
        })
    }

    /// Angle between the ends of a line in the picture whose middle is at a projection, as far as it can be told from the lens.
    fn angle_across(&self, projection: &Projection, line: DVec2) -> f64 {
        let camera = &self.view.camera;
        let ends = [-0.5, 0.5].map(|side| camera.direction(projection.pixel + line * side));
        let [Some(from), Some(to)] = ends else { return line.length() / camera.focal_pixels };
        math::acos(from.normalize().dot(to.normalize()).clamp(-1.0, 1.0))
    }

    /// Center and half size of the rectangle in which a ball with the sine `sine` of its angular radius is seen: rows of a panorama, or the circle of a
    /// fisheye.
    fn bounds_of_cap(&self, projection: &Projection, sine: f64) -> (DVec2, DVec2) {
        let camera = &self.view.camera;
        let size = DVec2::new(camera.size[0], camera.size[1]);
        let angle = if sine < 1.0 { math::asin(sine) } else { std::f64::consts::PI };
        if camera.lens == Lens::Panorama {
            let half_size = DVec2::new(0.5 * size.x + 1.0, angle * camera.focal_pixels);
            (DVec2::new(0.5 * size.x, projection.pixel.y), half_size)
        } else {
            (0.5 * size, 0.5 * size + 1.0)
        }
    }

    /// Whether a ball reaches into the circle of a fisheye; true for other lenses.
    fn reaches_the_picture(&self, projection: &Projection, radius: f64) -> bool {
        let camera = &self.view.camera;
        if camera.lens != Lens::Fisheye {
            return true;
        }
        let angle = (projection.pixel - camera.principal_point).length() / camera.focal_pixels;
        // A ball around the camera is seen in all directions.
        let angular_radius = math::asin((radius / projection.depth).min(1.0));
        angle - angular_radius < camera.half_angle() || radius >= projection.depth
    }
}

/// Whether the image of a ball of an angular radius differs much from the ellipse to which the lens, taken as linear, maps it.
fn is_distorted(camera: &Camera, projection: &Projection, angular_radius: f64) -> bool {
    /// Greatest radius of an ellipse, relative to the distance from the point at which the lens shows one direction as a line, and for itself.
    const MAX_RELATIVE_RADIUS: f64 = 0.15;
    const MAX_RADIUS: f64 = 0.4;
    let offset = (projection.pixel - camera.principal_point) / camera.focal_pixels;
    let distance = match camera.lens {
        Lens::Perspective => return false,
        Lens::Fisheye if offset.length() < std::f64::consts::FRAC_PI_2 => f64::INFINITY,
        Lens::Fisheye => math::sin(offset.length()),
        Lens::Panorama => math::cos(offset.y),
    };
    angular_radius > MAX_RELATIVE_RADIUS * distance.abs() || angular_radius > MAX_RADIUS
}

/// Projects `point` as [`Camera::project`] does, but also beyond the circle of a fisheye, since a ball there may reach into it.
fn project(camera: &Camera, point: DVec3) -> Option<Projection> {
    if camera.lens != Lens::Fisheye {
        return camera.project(point);
    }
    let (local, depth) = (camera.point_in_camera(point), camera.depth(point));
    if depth.is_nan() || depth < camera.near {
        return None;
    }
    let across = math::hypot(local.x, local.y);
    let angle = math::atan2(across, -local.z);
    let offset = if across > 0.0 { DVec2::new(local.x, local.y) * (angle / across) } else { DVec2::ZERO };
    Some(Projection {
        pixel: camera.principal_point + DVec2::new(offset.x, -offset.y) * camera.focal_pixels,
        depth,
        pixels_per_meter: camera.focal_pixels / depth,
    })
}

/// Motion in the picture from one projection to another, in a panorama the shorter way around it; 0 if there is only one.
fn motion(camera: &Camera, from: Option<Projection>, to: Option<Projection>) -> DVec2 {
    from.zip(to).map_or(DVec2::ZERO, |(from, to)| camera.nearest_repetition(to.pixel, from.pixel) - from.pixel)
}

/// Approximate fraction of a ball in front of the camera, below 1 if the camera is inside the ball.
fn in_front(depth: f64, near: f64, radius: f64) -> f64 {
    math::smoothstep(near, near + radius, depth)
}

/// Outer product of a vector with itself.
fn outer(v: DVec2) -> DMat2 {
    DMat2::from_cols(v * v.x, v * v.y)
}

/// Jacobian of the projection: pixels to the right and down per meter across the line of sight. In closed form for a perspective lens, by finite
/// differences for others.
fn lens_jacobian(camera: &Camera, position: DVec3, projection: &Projection) -> DMat2 {
    if camera.lens == Lens::Perspective {
        // Along the line to the optical axis the plane is oblique to the ray: 1 / cos a.
        let slope = (projection.pixel - camera.principal_point) / camera.focal_pixels;
        let direction = slope.normalize_or_zero();
        let stretch = (1.0 + slope.length_squared()).sqrt();
        return (DMat2::IDENTITY + outer(direction) * (stretch - 1.0)) * projection.pixels_per_meter;
    }
    let ray = (position - camera.position).normalize_or(DVec3::Z);
    let (one, two) = ray.any_orthonormal_pair();
    let step = 1e-4 * projection.depth;
    let moved = [one, two].map(|direction| project(camera, position + direction * step));
    let [Some(moved_one), Some(moved_two)] = moved else {
        return DMat2::from_diagonal(DVec2::splat(projection.pixels_per_meter));
    };
    let [one, two] = [moved_one, moved_two]
        .map(|moved| (camera.nearest_repetition(moved.pixel, projection.pixel) - projection.pixel) / step);
    DMat2::from_cols(one, two)
}
