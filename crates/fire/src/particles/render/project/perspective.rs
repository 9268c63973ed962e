//! Sixteen particles at a time through a perspective lens: the projection of a ball is close to a circle, so that its ellipse has a
//! closed form.

use bansho_base::{
    camera::{Camera, Lens},
    math::{DVec3, simd::LANES},
    phenomenon::strip::View,
};

use super::{MAX_PIXEL_COORDINATE, PIXEL_FOOTPRINT, ProjectedParticle, SpriteKind};
use crate::particles::render::{
    gas::Gas,
    splat::{
        Ellipse,
        kernel::{LINE_PEAK, VARIANCE},
    },
};

type Batch = [f32; LANES];

/// A perspective camera at this frame and the next.
pub(super) struct PerspectiveProjector {
    now: PinholeCamera,
    next: PinholeCamera,
    /// Exposure time as a fraction of the frame interval.
    shutter_fraction: f32,
    size: [f32; 2],
}

/// Projected particles.
struct ProjectedBatch {
    pixel: [Batch; 2],
    depth: Batch,
    /// Pixels per meter.
    scale: Batch,
}

impl PerspectiveProjector {
    /// The projector of a view; `None` unless the lens is a perspective lens.
    pub(super) fn new(gas: &Gas, view: &View, next: &Camera, shutter_fraction: f64) -> Option<Self> {
        let pinhole = |camera, t| PinholeCamera::new(camera, gas.particles.origin, t - gas.time);
        (view.camera.lens == Lens::Perspective).then(|| Self {
            now: pinhole(&view.camera, view.shutter.middle()),
            next: pinhole(next, view.next_middle),
            shutter_fraction: shutter_fraction as f32,
            size: view.camera.size.map(|side| side as f32),
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
        let mut motion = [[0.0; LANES]; 2];
        for axis in 0..2 {
            for lane in 0..LANES {
                let moved = next.pixel[axis][lane] - now.pixel[axis][lane];
                motion[axis][lane] = if next.depth[lane] >= self.next.near { moved } else { 0.0 };
            }
        }
        let ellipses = self.ellipses(gas, indices, &now, &motion);
        for (lane, &index) in indices.iter().enumerate() {
            let center = [now.pixel[0][lane], now.pixel[1][lane]];
            let half_size = [ellipses.half_size[0][lane], ellipses.half_size[1][lane]];
            let mut is_visible = now.depth[lane] >= self.now.near && ellipses.peak[lane] > 0.0;
            for axis in 0..2 {
                is_visible &= center[axis] + half_size[axis] > 0.0 && center[axis] - half_size[axis] < self.size[axis];
                is_visible &= center[axis].abs() < MAX_PIXEL_COORDINATE as f32;
            }
            if is_visible {
                let shape = [ellipses.shape[0][lane], ellipses.shape[1][lane], ellipses.shape[2][lane]];
                let (radius, peak) = (ellipses.radius[lane], ellipses.peak[lane]);
                records.push(kind.record(&ProjectedParticle {
                    index,
                    ellipse: Ellipse { center, shape, half_size, radius, peak },
                    depth: f64::from(now.depth[lane]),
                    motion: [motion[0][lane], motion[1][lane]],
                    scale: now.scale[lane],
                }));
            }
        }
    }

    /// Circles blurred along their motion: the matrix `q + k b b^T` with the motion blur b has the eigenvalue q across it.
    #[inline(always)]
    fn ellipses(&self, gas: &Gas, indices: &[usize], now: &ProjectedBatch, motion: &[Batch; 2]) -> EllipseBatch {
        /// Squared radius per squared length of motion: the variance of a box over that of a sprite.
        const BLUR_SCALE: f32 = (1.0 / (12.0 * VARIANCE)) as f32;
        let zero = [0.0; LANES];
        let mut radii = zero;
        for (radius, &index) in radii.iter_mut().zip(indices) {
            *radius = gas.particles.support_radius[index];
        }
        let mut ellipses = EllipseBatch { shape: [zero; 3], half_size: [zero; 2], radius: zero, peak: zero };
        for lane in 0..LANES {
            let ball = now.scale[lane] * radii[lane];
            let across = ball.mul_add(ball, (PIXEL_FOOTPRINT / VARIANCE) as f32);
            let (x, y) = (motion[0][lane] * self.shutter_fraction, motion[1][lane] * self.shutter_fraction);
            let (xx, yy) = ((BLUR_SCALE * x).mul_add(x, across), (BLUR_SCALE * y).mul_add(y, across));
            let determinant = across * (across + BLUR_SCALE * x.mul_add(x, y * y));
            let inverse = 1.0 / determinant;
            ellipses.shape[0][lane] = yy * inverse;
            ellipses.shape[1][lane] = -BLUR_SCALE * x * y * inverse;
            ellipses.shape[2][lane] = xx * inverse;
            ellipses.half_size[0][lane] = xx.sqrt();
            ellipses.half_size[1][lane] = yy.sqrt();
            ellipses.radius[lane] = across.sqrt();
            // A ball around the camera is only visible in front of it.
            let in_front = ((now.depth[lane] - self.now.near) / radii[lane]).clamp(0.0, 1.0);
            let in_front = in_front * in_front * (3.0 - 2.0 * in_front);
            let peak = LINE_PEAK as f32 * in_front * now.scale[lane] * now.scale[lane] / determinant.sqrt();
            ellipses.peak[lane] = if determinant < f32::MAX { peak } else { 0.0 };
        }
        ellipses
    }
}

struct EllipseBatch {
    shape: [Batch; 3],
    half_size: [Batch; 2],
    radius: Batch,
    peak: Batch,
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
    fn new(camera: &Camera, origin: DVec3, seconds_since_state: f64) -> Self {
        let axis = |i: usize| camera.world_from_camera.col(i).as_vec3().to_array();
        Self {
            axes: [axis(0), axis(1), axis(2)],
            origin: camera.point_in_camera(origin).as_vec3().to_array(),
            focal_pixels: camera.focal_pixels as f32,
            center: camera.principal_point.as_vec2().to_array(),
            near: camera.near as f32,
            seconds_since_state: seconds_since_state as f32,
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
        let mut projected = ProjectedBatch { pixel: [zero; 2], depth: zero, scale: zero };
        for lane in 0..LANES {
            let depth = -local[2][lane];
            let scale = self.focal_pixels / depth;
            projected.depth[lane] = depth;
            projected.scale[lane] = scale;
            projected.pixel[0][lane] = scale.mul_add(local[0][lane], self.center[0]);
            projected.pixel[1][lane] = scale.mul_add(-local[1][lane], self.center[1]);
        }
        projected
    }
}
