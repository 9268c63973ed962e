//! Projection of one particle at a time, for every lens.

use super::{MAX_PIXEL_COORDINATE, PIXEL_FOOTPRINT, ProjectedParticle};
use crate::particles::render::{
    gas::Gas,
    splat::{
        Ellipse,
        kernel::{LINE_PEAK, VARIANCE},
    },
};
use bansho_base::{
    camera::{Camera, Lens, Projection},
    math::{DMat2, DVec2, DVec3},
    phenomenon::strip::View,
};

/// The camera at this frame and the next.
pub(super) struct AnyLensProjector<'a> {
    view: &'a View,
    pub(super) next: Camera,
    /// Exposure time as a fraction of the frame interval.
    pub(super) shutter_fraction: f64,
}

impl<'a> AnyLensProjector<'a> {
    pub(super) fn new(view: &'a View) -> Self {
        let frame = (view.next_middle - view.shutter.middle()).max(1e-9);
        Self { view, next: view.camera_at(view.next_middle), shutter_fraction: view.shutter.duration() / frame }
    }

    /// Projects a particle and passes it to `visit`. In a panorama its image one turn away, which may be visible across the seam, is passed too.
    #[inline(always)]
    pub(super) fn project(&self, gas: &Gas, index: usize, mut visit: impl FnMut(ProjectedParticle)) {
        let position = gas.position(index, self.view.shutter.middle());
        let camera = &self.view.camera;
        let Some(first) = camera.project(position) else { return };
        let after = self.next.project(gas.position(index, self.view.next_middle));
        let motion = after.map_or(DVec2::ZERO, |after| shortest_step(camera, after.pixel - first.pixel));
        let mut visit_at = |projection: Projection| {
            if let Some(ellipse) = self.ellipse(gas, index, position, &projection, motion * self.shutter_fraction) {
                let (depth, scale) = (projection.depth, projection.pixels_per_meter as f32);
                visit(ProjectedParticle { index, ellipse, depth, motion: motion.as_vec2().to_array(), scale });
            }
        };
        visit_at(first);
        if camera.lens == Lens::Panorama {
            let turn_pixels = std::f64::consts::TAU * camera.focal_pixels;
            let side = if first.pixel.x > camera.principal_point.x { -turn_pixels } else { turn_pixels };
            visit_at(Projection { pixel: first.pixel + DVec2::new(side, 0.0), ..first });
        }
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
        let smaller_eigenvalue = 0.5 * trace - (0.25 * trace * trace - determinant).max(0.0).sqrt();
        let half_size = DVec2::new(matrix.x_axis.x.sqrt(), matrix.y_axis.y.sqrt());
        let size = DVec2::new(camera.size[0], camera.size[1]);
        let center = projection.pixel;
        let is_visible = (center + half_size).cmpgt(DVec2::ZERO).all() && (center - half_size).cmplt(size).all();
        if !(is_visible && center.abs().max_element() < MAX_PIXEL_COORDINATE) {
            return None;
        }
        let in_front = in_front(projection.depth, camera.near, radius);
        let peak = LINE_PEAK * in_front * lens.determinant().abs() / determinant.sqrt();
        (peak > 0.0).then_some(Ellipse {
            center: center.as_vec2().to_array(),
            shape: [inverse.x_axis.x, inverse.x_axis.y, inverse.y_axis.y].map(|value| value as f32),
            half_size: half_size.as_vec2().to_array(),
            radius: smaller_eigenvalue.max(0.0).sqrt() as f32,
            peak: peak as f32,
        })
    }
}

/// Approximate fraction of a ball in front of the camera, below 1 if the camera is inside the ball.
fn in_front(depth: f64, near: f64, radius: f64) -> f64 {
    bansho_base::math::smoothstep(near, near + radius, depth)
}

/// A step in the picture; in a panorama the shorter one of both directions around it.
fn shortest_step(camera: &Camera, step: DVec2) -> DVec2 {
    if camera.lens != Lens::Panorama {
        return step;
    }
    let turn_pixels = std::f64::consts::TAU * camera.focal_pixels;
    DVec2::new(step.x - (step.x / turn_pixels).round() * turn_pixels, step.y)
}

/// Outer product of a vector with itself.
fn outer(v: DVec2) -> DMat2 {
    DMat2::from_cols(v * v.x, v * v.y)
}

/// Jacobian of the projection: pixels to the right and down per meter across the line of sight. A multiple of the identity for a
/// perspective lens, by finite differences for others.
fn lens_jacobian(camera: &Camera, position: DVec3, projection: &Projection) -> DMat2 {
    let isotropic = DMat2::from_diagonal(DVec2::new(projection.pixels_per_meter, -projection.pixels_per_meter));
    if camera.lens == Lens::Perspective {
        return isotropic;
    }
    let ray = (position - camera.position).normalize_or(DVec3::Z);
    let (one, two) = ray.any_orthonormal_pair();
    let step = 1e-4 * projection.depth;
    let derivative = |direction: DVec3| {
        let moved = camera.project(position + direction * step)?;
        Some(shortest_step(camera, moved.pixel - projection.pixel) / step)
    };
    match (derivative(one), derivative(two)) {
        (Some(one), Some(two)) => limit_anisotropy(DMat2::from_cols(one, two), projection.pixels_per_meter),
        _ => isotropic,
    }
}

/// Limits the anisotropy of sprites near the poles of a panorama.
fn limit_anisotropy(matrix: DMat2, scale: f64) -> DMat2 {
    const MAX_STRETCH: f64 = 40.0;
    let longest = matrix.x_axis.length().max(matrix.y_axis.length());
    if longest > MAX_STRETCH * scale { matrix * (MAX_STRETCH * scale / longest) } else { matrix }
}
