//! Directions of pixels that follow each other in a row.

use bansho_base::{
    camera::Camera,
    math::{DVec2, Fused},
};

use crate::lanes::LANES;

/// What a row of sixteen pixels looks at.
pub(crate) struct Directions {
    /// x, y and z, of the length that [`Camera::direction`] gives.
    pub(crate) axes: [[f32; LANES]; 3],
    /// Whether the lens sees anything there.
    pub(crate) seen: [bool; LANES],
}

impl Directions {
    /// Pixels from `x` on in row `y`.
    #[inline(always)]
    pub(crate) fn new(camera: &Camera, x: usize, y: usize) -> Self {
        let at = |x: usize| camera.direction(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
        let (mut axes, mut seen) = ([[0.0; LANES], [1.0; LANES], [0.0; LANES]], [true; LANES]);
        if let (Some(first), Some(last)) = (at(x), at(x + LANES)) {
            // Exact for a perspective lens; elsewhere within a few hundredths of a pixel.
            let (first, step) = (first.as_vec3().to_array(), ((last - first) / LANES as f64).as_vec3().to_array());
            for axis in 0..3 {
                for i in 0..LANES {
                    axes[axis][i] = step[axis].fused(i as f32, first[axis]);
                }
            }
            return Self { axes, seen };
        }
        for i in 0..LANES {
            let direction = at(x + i);
            seen[i] = direction.is_some();
            if let Some(direction) = direction {
                for (axis, part) in direction.as_vec3().to_array().into_iter().enumerate() {
                    axes[axis][i] = part;
                }
            }
        }
        Self { axes, seen }
    }

    /// Scales them to length 1 where they are seen, and gives the lengths that they had.
    #[inline(always)]
    pub(crate) fn normalize(&mut self) -> [f32; LANES] {
        let [x, y, z] = &mut self.axes;
        let mut lengths = [0.0; LANES];
        for i in 0..LANES {
            lengths[i] = x[i].fused(x[i], y[i].fused(y[i], z[i] * z[i])).sqrt();
            let scale = 1.0 / lengths[i];
            x[i] *= scale;
            y[i] *= scale;
            z[i] *= scale;
        }
        lengths
    }
}
