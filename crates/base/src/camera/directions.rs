//! View directions of consecutive pixels of a row.

use super::{Camera, Lens};
use crate::math::{DVec2, MulAdd, approximations, simd::LANES};

/// Largest angle, in radians, over which the directions along a row of a panorama are interpolated linearly: the chord lies within an eighth of a
/// pixel of the arc.
const MAX_STRAIGHT_ANGLE: f64 = 0.1;

/// View directions of sixteen consecutive pixels of a row.
pub struct Directions {
    /// x, y and z, scaled as by [`Camera::direction`].
    pub components: [[f32; LANES]; 3],
    /// Whether the pixel lies within the field of view of the lens.
    pub visible: [bool; LANES],
}

impl Directions {
    /// The directions of the pixels from column `x` on in row `y`.
    #[inline(always)]
    pub fn new(camera: &Camera, x: usize, y: usize) -> Self {
        if camera.lens == Lens::Fisheye {
            return Self::fisheye(camera, x, y);
        }
        let direction_at = |x: usize| camera.direction(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
        let (mut components, mut visible) = ([[0.0; LANES], [1.0; LANES], [0.0; LANES]], [true; LANES]);
        let is_straight = camera.lens == Lens::Perspective || LANES as f64 / camera.focal_pixels < MAX_STRAIGHT_ANGLE;
        let endpoints = if is_straight { direction_at(x).zip(direction_at(x + LANES)) } else { None };
        if let Some((first, last)) = endpoints {
            // Exact for a perspective lens. For a panorama the error is at most an eighth of a pixel,
            // and at most a fiftieth in large pictures.
            let (first, step) = (first.as_vec3().to_array(), ((last - first) / LANES as f64).as_vec3().to_array());
            for axis in 0..3 {
                for i in 0..LANES {
                    components[axis][i] = step[axis].fma(i as f32, first[axis]);
                }
            }
            return Self { components, visible };
        }
        for i in 0..LANES {
            let direction = direction_at(x + i);
            visible[i] = direction.is_some();
            if let Some(direction) = direction {
                for (axis, component) in direction.as_vec3().to_array().into_iter().enumerate() {
                    components[axis][i] = component;
                }
            }
        }
        Self { components, visible }
    }

    /// The directions of a fisheye lens, each computed on its own in single precision: the error is a thousandth of a pixel.
    #[inline(always)]
    fn fisheye(camera: &Camera, x: usize, y: usize) -> Self {
        const TURNS: f32 = (1.0 / std::f64::consts::TAU) as f32;
        let per_pixel = 1.0 / camera.focal_pixels;
        let first_x = ((x as f64 + 0.5 - camera.principal_point.x) * per_pixel) as f32;
        let y_offset = ((camera.principal_point.y - y as f64 - 0.5) * per_pixel) as f32;
        let [right, upward, back] = [camera.orientation.x_axis, camera.orientation.y_axis, camera.orientation.z_axis]
            .map(|axis| axis.as_vec3().to_array());
        let (step, max_angle) = (per_pixel as f32, camera.half_angle() as f32);
        let (mut components, mut visible) = ([[0.0; LANES]; 3], [true; LANES]);
        let (mut sinc, mut cosines) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            let x_offset = step.fma(i as f32, first_x);
            let angle = x_offset.fma(x_offset, y_offset * y_offset).sqrt();
            let turns = angle * TURNS;
            sinc[i] = if angle > 1e-6 { approximations::sin_turns(turns) / angle } else { 1.0 };
            cosines[i] = approximations::cos_turns(turns);
            visible[i] = angle <= max_angle;
        }
        for axis in 0..3 {
            for i in 0..LANES {
                let x_offset = step.fma(i as f32, first_x);
                let sideways = x_offset.fma(right[axis], y_offset * upward[axis]);
                components[axis][i] = sinc[i].fma(sideways, -(cosines[i] * back[axis]));
            }
        }
        Self { components, visible }
    }

    /// Normalizes the directions and returns the lengths that they had before.
    #[inline(always)]
    pub fn normalize(&mut self) -> [f32; LANES] {
        let [x, y, z] = &mut self.components;
        let mut lengths = [0.0; LANES];
        for i in 0..LANES {
            lengths[i] = x[i].fma(x[i], y[i].fma(y[i], z[i] * z[i])).sqrt();
            let scale = 1.0 / lengths[i];
            x[i] *= scale;
            y[i] *= scale;
            z[i] *= scale;
        }
        lengths
    }
}

#[cfg(test)]
mod tests {
    use super::{super::CameraParameters, *};
    use crate::math::DVec3;

    #[test]
    fn every_lens_is_met_within_an_eighth_of_a_pixel() {
        for lens in [Lens::Perspective, Lens::Fisheye, Lens::Panorama] {
            for height in [32, 128, 509, 640, 2048] {
                let size = [if lens == Lens::Panorama { 2 * height } else { height }, height];
                let camera = CameraParameters { lens, target: [0.0, 60.0, 3.0].into(), ..CameraParameters::default() };
                let camera = camera.at(0.0, size);
                let mut worst = 0.0_f64;
                for (row, column) in (0..40).flat_map(|row| (0..16).map(move |column| (row, column))) {
                    let (x, y) = (column * size[0] / 16 / LANES * LANES, row * height / 40);
                    let mut directions = Directions::new(&camera, x, y);
                    directions.normalize();
                    let [xs, ys, zs] = directions.components;
                    for i in (0..LANES).filter(|i| directions.visible[*i]) {
                        let exact = camera.direction(DVec2::new((x + i) as f64 + 0.5, y as f64 + 0.5));
                        let found = DVec3::new(f64::from(xs[i]), f64::from(ys[i]), f64::from(zs[i]));
                        worst = worst.max(exact.map_or(f64::NAN, |exact| exact.normalize().distance(found)));
                    }
                }
                assert!(worst * camera.focal_pixels < 0.13, "{lens:?} {height}: {}", worst * camera.focal_pixels);
            }
        }
    }
}
