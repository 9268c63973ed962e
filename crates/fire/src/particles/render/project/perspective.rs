//! Sixteen particles at a time through a perspective lens: the projection of a ball is close to an ellipse that has a closed form, a circle on the
//! optical axis, stretched by 1 / cos a along the line to the axis at the angle a from it.

use bansho_base::{
    camera::{Camera, Lens},
    math::simd::{LANES, LaneArray},
};

use super::{PIXEL_FOOTPRINT, ProjectedParticle, SpriteKind};
use crate::particles::render::{
    gas::Gas,
    gas_view::GasView,
    splat::{
        Ellipse,
        kernel::{LINE_PEAK, VARIANCE},
    },
};

/// A perspective camera at this frame and the next.
pub(super) struct PerspectiveProjector {
    now: PinholeCamera,
    next: PinholeCamera,
    /// At the beginning and end of the exposure; `None` if the camera stands still.
    ends: Option<[PinholeCamera; 2]>,
    /// Exposure time as a fraction of the frame interval.
    shutter_fraction: f32,
    size: [f32; 2],
    max_pixel_coordinate: f32,
}

/// Projected particles.
struct ProjectedBatch {
    pixel: [LaneArray; 2],
    /// Tangents of the angles from the optical axis, to the right and down.
    slope: [LaneArray; 2],
    depth: LaneArray,
    /// Pixels per meter.
    scale: LaneArray,
}

impl PerspectiveProjector {
    /// The projector of a view; `None` unless the lens is a perspective lens.
    pub(super) fn new(gas: &Gas, view: &GasView) -> Option<Self> {
        if view.camera.lens != Lens::Perspective {
            return None;
        }
        let ends = view.ends.as_ref().map(|[open, close]| {
            [PinholeCamera::new(open, gas, view.shutter.open), PinholeCamera::new(close, gas, view.shutter.close)]
        });
        Some(Self {
            now: PinholeCamera::new(&view.camera, gas, view.shutter.middle()),
            next: PinholeCamera::new(&view.next, gas, view.next_middle),
            ends,
            shutter_fraction: view.shutter_fraction() as f32,
            size: view.camera.size.map(|side| side as f32),
            max_pixel_coordinate: view.max_pixel_coordinate() as f32,
        })
    }

    /// Records the particles of `range` that are included and visible.
    #[inline(always)]
    pub(super) fn project<K: SpriteKind>(
        &self,
        gas: &Gas,
        range: std::ops::Range<usize>,
        kind: &K,
        records: &mut Vec<K::Record>,
    ) {
        let (mut indices, mut count) = ([range.start; LANES], 0);
        for index in range {
            if !kind.includes(index) {
                continue;
            }
            indices[count] = index;
            count += 1;
            if count == LANES {
                self.project_batch(gas, &indices, kind, records);
                count = 0;
            }
        }
        if count > 0 {
            self.project_batch(gas, &indices[..count], kind, records);
        }
    }

    #[inline(always)]
    fn project_batch<K: SpriteKind>(&self, gas: &Gas, indices: &[usize], kind: &K, records: &mut Vec<K::Record>) {
        let (now, next) = (self.now.project(gas, indices), self.next.project(gas, indices));
        let motion = next.motion_since(&now, self.next.near);
        let mut blur = motion;
        if let Some([open, close]) = &self.ends {
            blur = close.project(gas, indices).motion_since(&open.project(gas, indices), close.near);
        } else {
            for axis in 0..2 {
                for lane in 0..LANES {
                    blur[axis][lane] *= self.shutter_fraction;
                }
            }
        }
        let ellipses = self.ellipses(gas, indices, &now, &blur);
        for (lane, &index) in indices.iter().enumerate() {
            let center = [now.pixel[0][lane], now.pixel[1][lane]];
            let half_size = [ellipses.half_size[0][lane], ellipses.half_size[1][lane]];
            let mut is_visible = now.depth[lane] >= self.now.near && ellipses.peak[lane] > 0.0;
            for axis in 0..2 {
                is_visible &= center[axis] + half_size[axis] > 0.0 && center[axis] - half_size[axis] < self.size[axis];
                is_visible &= center[axis].abs() < self.max_pixel_coordinate;
            }
            if is_visible {
                let shape = [ellipses.shape[0][lane], ellipses.shape[1][lane], ellipses.shape[2][lane]];
                let (radius, peak) = (ellipses.radius[lane], ellipses.peak[lane]);
                records.push(kind.record(&ProjectedParticle {
                    index,
                    ellipse: Ellipse { center, shape, half_size, radius, peak, cap: None },
                    depth: f64::from(now.depth[lane]),
                    motion: [motion[0][lane], motion[1][lane]],
                    scale: now.scale[lane],
                }));
            }
        }
    }

    /// Ellipses blurred along their motion: the matrix `a + u u^T + v v^T`, where a is the squared radius of the ball and of the pixel, u the
    /// radius times the slope of the ray from the optical axis, which is how a picture on a plane stretches a ball, and v the motion blur.
    #[inline(always)]
    fn ellipses(&self, gas: &Gas, indices: &[usize], now: &ProjectedBatch, blur: &[LaneArray; 2]) -> EllipseBatch {
        /// Squared radius per squared length of motion: the variance of a box over that of a sprite.
        const BLUR_SCALE: f32 = (1.0 / (12.0 * VARIANCE)) as f32;
        let blur_scale = BLUR_SCALE.sqrt();
        let zero = [0.0; LANES];
        let mut radii = zero;
        for (radius, &index) in radii.iter_mut().zip(indices) {
            *radius = gas.particles.support_radius[index];
        }
        let mut ellipses = EllipseBatch { shape: [zero; 3], half_size: [zero; 2], radius: zero, peak: zero };
        for lane in 0..LANES {
            let ball = now.scale[lane] * radii[lane];
            let across = ball.mul_add(ball, (PIXEL_FOOTPRINT / VARIANCE) as f32);
            let slope = [now.slope[0][lane], now.slope[1][lane]];
            let (u, v) = ([ball * slope[0], ball * slope[1]], [blur_scale * blur[0][lane], blur_scale * blur[1][lane]]);
            let (xx, yy) =
                (u[0].mul_add(u[0], v[0].mul_add(v[0], across)), u[1].mul_add(u[1], v[1].mul_add(v[1], across)));
            let xy = u[0].mul_add(u[1], v[0] * v[1]);
            // Without the cancellation of xx yy - xy^2.
            let cross = u[0] * v[1] - u[1] * v[0];
            let stretch = u[0].mul_add(u[0], u[1] * u[1]) + v[0].mul_add(v[0], v[1] * v[1]);
            let determinant = across.mul_add(across + stretch, cross * cross);
            let inverse = 1.0 / determinant;
            let larger_eigenvalue = across + 0.5 * stretch + (0.25 * stretch * stretch - cross * cross).max(0.0).sqrt();
            ellipses.shape[0][lane] = yy * inverse;
            ellipses.shape[1][lane] = -xy * inverse;
            ellipses.shape[2][lane] = xx * inverse;
            ellipses.half_size[0][lane] = xx.sqrt();
            ellipses.half_size[1][lane] = yy.sqrt();
            ellipses.radius[lane] = (determinant / larger_eigenvalue).sqrt();
            // A ball around the camera is only visible in front of it.
            let in_front = ((now.depth[lane] - self.now.near) / radii[lane]).clamp(0.0, 1.0);
            let in_front = in_front * in_front * (3.0 - 2.0 * in_front);
            // Area of the ball's ellipse over that of the disc that the ball shows along its ray.
            let area =
                now.scale[lane] * now.scale[lane] * slope[0].mul_add(slope[0], slope[1].mul_add(slope[1], 1.0)).sqrt();
            let peak = LINE_PEAK as f32 * in_front * area / determinant.sqrt();
            ellipses.peak[lane] = if determinant < f32::MAX { peak } else { 0.0 };
        }
        ellipses
    }
}

impl ProjectedBatch {
    /// Motion in the picture since an earlier time, pixels; 0 for what is nearer than `near` at either time.
    #[inline(always)]
    fn motion_since(&self, earlier: &Self, near: f32) -> [LaneArray; 2] {
        let mut motion = [[0.0; LANES]; 2];
        for axis in 0..2 {
            for lane in 0..LANES {
                let moved = self.pixel[axis][lane] - earlier.pixel[axis][lane];
                let is_seen = self.depth[lane] >= near && earlier.depth[lane] >= near;
                motion[axis][lane] = if is_seen { moved } else { 0.0 };
            }
        }
        motion
    }
}

struct EllipseBatch {
    shape: [LaneArray; 3],
    half_size: [LaneArray; 2],
    radius: LaneArray,
    peak: LaneArray,
}

/// A perspective camera relative to the particles' origin.
struct PinholeCamera {
    /// Right, up and backward in world axes.
    axes: [[f32; 3]; 3],
    /// The particles' origin in camera space, m.
    origin: [f32; 3],
    focal_pixels: f32,
    center: [f32; 2],
    near: f32,
    /// Time since the particles' state, s.
    seconds_since_state: f32,
}

impl PinholeCamera {
    /// A camera that shows the gas as it is at `t`.
    fn new(camera: &Camera, gas: &Gas, t: f64) -> Self {
        Self {
            axes: [0, 1, 2].map(|axis| camera.world_from_camera.col(axis).as_vec3().to_array()),
            origin: camera.point_in_camera(gas.particles.origin).as_vec3().to_array(),
            focal_pixels: camera.focal_pixels as f32,
            center: camera.principal_point.as_vec2().to_array(),
            near: camera.near as f32,
            seconds_since_state: (t - gas.time) as f32,
        }
    }

    #[inline(always)]
    fn project(&self, gas: &Gas, indices: &[usize]) -> ProjectedBatch {
        let mut positions = [[0.0; LANES]; 3];
        for axis in 0..3 {
            let (position, velocity) = (&gas.particles.position[axis], &gas.particles.velocity[axis]);
            for (moved, &index) in positions[axis].iter_mut().zip(indices) {
                *moved = self.seconds_since_state.mul_add(velocity[index], position[index]);
            }
        }
        let mut local = [[0.0; LANES]; 3];
        for i in 0..3 {
            let [x, y, z] = self.axes[i];
            for lane in 0..LANES {
                let across = x.mul_add(positions[0][lane], self.origin[i]);
                local[i][lane] = z.mul_add(positions[2][lane], y.mul_add(positions[1][lane], across));
            }
        }
        let zero = [0.0; LANES];
        let mut projected = ProjectedBatch { pixel: [zero; 2], slope: [zero; 2], depth: zero, scale: zero };
        for lane in 0..LANES {
            let depth = -local[2][lane];
            let scale = self.focal_pixels / depth;
            projected.depth[lane] = depth;
            projected.scale[lane] = scale;
            projected.slope[0][lane] = local[0][lane] / depth;
            projected.slope[1][lane] = -local[1][lane] / depth;
            projected.pixel[0][lane] = scale.mul_add(local[0][lane], self.center[0]);
            projected.pixel[1][lane] = scale.mul_add(-local[1][lane], self.center[1]);
        }
        projected
    }
}
