//! Directions of pixels that follow each other in a row.

use super::{Camera, Lens};
use crate::math::{DVec2, MulAdd, approximations, simd::LANES};

/// Angle, in radians, over which a row of a panorama is taken for straight: its chord lies within an eighth of a pixel of it.
const MOST_STRAIGHT: f64 = 0.1;

/// What a row of sixteen pixels looks at.
pub struct Directions {
    /// x, y and z, of the length that [`Camera::direction`] gives.
    pub axes: [[f32; LANES]; 3],
    /// Whether the lens sees anything there.
    pub seen: [bool; LANES],
}

impl Directions {
    /// Pixels from `x` on in row `y`.
    #[inline(always)]
    pub fn new(camera: &Camera, x: usize, y: usize) -> Self {
        if camera.lens == Lens::Fisheye {
            return Self::of_dome(camera, x, y);
        }
        let at = |x: usize| camera.direction(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
        let (mut axes, mut seen) = ([[0.0; LANES], [1.0; LANES], [0.0; LANES]], [true; LANES]);
        let is_straight = camera.lens == Lens::Perspective || LANES as f64 / camera.focal_pixels < MOST_STRAIGHT;
        let ends = if is_straight { at(x).zip(at(x + LANES)) } else { None };
        if let Some((first, last)) = ends {
            // Exact for a perspective lens; elsewhere within an eighth of a pixel, and within a fiftieth where pictures are large.
            let (first, step) = (first.as_vec3().to_array(), ((last - first) / LANES as f64).as_vec3().to_array());
            for axis in 0..3 {
                for i in 0..LANES {
                    axes[axis][i] = step[axis].fma(i as f32, first[axis]);
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

    /// Those of a fisheye lens, each by itself: in single precision that is a thousandth of a pixel.
    #[inline(always)]
    fn of_dome(camera: &Camera, x: usize, y: usize) -> Self {
        const TURNS: f32 = (1.0 / std::f64::consts::TAU) as f32;
        let per_pixel = 1.0 / camera.focal_pixels;
        let first = ((x as f64 + 0.5 - camera.centre.x) * per_pixel) as f32;
        let up = ((camera.centre.y - y as f64 - 0.5) * per_pixel) as f32;
        let [right, upward, back] = [camera.orientation.x_axis, camera.orientation.y_axis, camera.orientation.z_axis]
            .map(|axis| axis.as_vec3().to_array());
        let (step, most) = (per_pixel as f32, camera.half_angle() as f32);
        let (mut axes, mut seen) = ([[0.0; LANES]; 3], [true; LANES]);
        let (mut across, mut cosines) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            let side = step.fma(i as f32, first);
            let angle = side.fma(side, up * up).sqrt();
            let turns = angle * TURNS;
            across[i] = if angle > 1e-6 { approximations::sin_turns(turns) / angle } else { 1.0 };
            cosines[i] = approximations::cos_turns(turns);
            seen[i] = angle <= most;
        }
        for axis in 0..3 {
            for i in 0..LANES {
                let side = step.fma(i as f32, first);
                let level = side.fma(right[axis], up * upward[axis]);
                axes[axis][i] = across[i].fma(level, -(cosines[i] * back[axis]));
            }
        }
        Self { axes, seen }
    }

    /// Scales them to length 1 where they are seen, and gives the lengths that they had.
    #[inline(always)]
    pub fn normalize(&mut self) -> [f32; LANES] {
        let [x, y, z] = &mut self.axes;
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
                    let [xs, ys, zs] = directions.axes;
                    for i in (0..LANES).filter(|i| directions.seen[*i]) {
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
