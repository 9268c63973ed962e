//! Angular distances from a direction to the pixels of a picture, through every lens: for what is drawn around the image of a point.
//!
//! A distance in the picture says little about the angle: away from the middle of a perspective picture, at high latitudes of a panorama and near the rim
//! of a fisheye a circle of directions is an ellipse or less regular, and at the seam of a panorama or around the antipode of a fisheye it is in two
//! places at once. Distances are therefore measured on the unit sphere, as chords 2 sin(angle / 2): their squares are precise however small the angle,
//! and the solid angle between two chords is pi times the difference of their squares.

use std::ops::Range;

use super::{Camera, Lens};
use crate::{
    image::Rect,
    math::{self, DVec2, DVec3, MulAdd, approximations, simd::LANES},
};

/// Length of the chord of an angle, radians.
pub fn chord(angle: f64) -> f64 {
    2.0 * math::sin(0.5 * angle)
}

/// Angular distances of pixels from one direction.
#[derive(Clone, Copy, Debug)]
pub struct AngularDistance {
    camera: Camera,
    /// Unit vector in camera space.
    direction: DVec3,
    /// Where the direction is in the picture, radians or tangents to the right and up from the principal point. The coordinates of a fisheye go on
    /// outside of its circle.
    offset: DVec2,
}

impl AngularDistance {
    /// Distances from the unit vector `direction` in world space; `None` if it points behind a perspective camera.
    pub fn new(camera: &Camera, direction: DVec3) -> Option<Self> {
        let direction = camera.world_from_camera.transpose() * direction;
        let offset = match camera.lens {
            Lens::Perspective if direction.z < 0.0 => DVec2::new(direction.x, direction.y) / -direction.z,
            Lens::Perspective => return None,
            Lens::Fisheye => {
                let across = math::hypot(direction.x, direction.y);
                let angle = math::atan2(across, -direction.z);
                // At the antipode, which is the whole rim of a circle of 360 degrees, any azimuth will do.
                let azimuth = if across > 0.0 { DVec2::new(direction.x, direction.y) / across } else { DVec2::X };
                azimuth * angle
            }
            Lens::Panorama => {
                DVec2::new(math::atan2(direction.x, -direction.z), math::asin(direction.y.clamp(-1.0, 1.0)))
            }
        };
        Some(Self { camera: *camera, direction, offset })
    }

    /// The camera of the picture.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The position in the picture, pixels; it may be outside of the picture or of a fisheye's circle.
    pub fn pixel(&self) -> DVec2 {
        self.camera.principal_point + DVec2::new(self.offset.x, -self.offset.y) * self.camera.focal_pixels
    }

    /// Pixels per radian at the direction where the picture resolves least: along the parallels of a perspective picture, the meridians of the others.
    pub fn min_pixels_per_radian(&self) -> f64 {
        match self.camera.lens {
            Lens::Perspective => self.camera.focal_pixels / -self.direction.z,
            Lens::Fisheye | Lens::Panorama => self.camera.focal_pixels,
        }
    }

    /// Columns and rows of all pixels whose centers are within `angle` radians, with a margin of two pixels. They may lie outside of the picture or of a
    /// fisheye's circle; those of a panorama are one repetition of at most one period. `None` if they are without end.
    pub fn pixels_within(&self, angle: f64) -> Option<[Range<i64>; 2]> {
        let [low, high] = self.corners_within(angle);
        if !(low.abs().max_element() < 1e9 && high.abs().max_element() < 1e9) {
            return None;
        }
        let (mut columns, mut rows) =
            (low.x.floor() as i64..high.x.ceil() as i64, low.y.floor() as i64..high.y.ceil() as i64);
        if let Some(period) = self.camera.horizontal_period() {
            // Each direction once: no more than a period of columns, and no rows beyond the poles.
            columns.end = columns.end.min(columns.start + (period.round() as i64).max(1));
            rows.start = rows.start.max((self.camera.principal_point.y - 0.25 * period).floor() as i64);
            rows.end = rows.end.min((self.camera.principal_point.y + 0.25 * period).ceil() as i64);
        }
        Some([columns, rows])
    }

    /// The parts of a picture of `size` pixels that contain all pixels within `angle` radians, with a margin of two pixels: several where a panorama
    /// repeats. They do not overlap.
    pub fn rects_within(&self, angle: f64, size: [usize; 2]) -> Vec<Rect> {
        let [low, high] = self.corners_within(angle);
        match self.camera.horizontal_period() {
            // Repetitions so wide that they touch are one rectangle of the whole width.
            Some(period) if high.x - low.x + 2.0 < period => {
                let (first, last) =
                    ((-high.x / period).floor() as i64, ((size[0] as f64 - low.x) / period).ceil() as i64);
                let shifts = (first..=last).map(|repetition| DVec2::new(repetition as f64 * period, 0.0));
                shifts.filter_map(|shift| whole_pixels(low + shift, high + shift, size)).collect()
            }
            Some(_) => {
                let width = size[0] as f64;
                whole_pixels(DVec2::new(0.0, low.y), DVec2::new(width, high.y), size).into_iter().collect()
            }
            None => whole_pixels(low, high, size).into_iter().collect(),
        }
    }

    /// Upper left and lower right corners of what is within `angle`, with a margin of two pixels.
    fn corners_within(&self, angle: f64) -> [DVec2; 2] {
        let [low, high] = self.offsets_within(angle);
        let (principal, focal) = (self.camera.principal_point, self.camera.focal_pixels);
        // Offsets are upward, rows of pixels downward.
        [principal + DVec2::new(low.x, -high.y) * focal - 2.0, principal + DVec2::new(high.x, -low.y) * focal + 2.0]
    }

    /// Smallest and largest offsets from the principal point, as those of `offset`, of all directions within `angle`.
    fn offsets_within(&self, angle: f64) -> [DVec2; 2] {
        use std::f64::consts::{FRAC_PI_2, PI};
        let middle = self.offset;
        let [x, y, z] = self.direction.to_array();
        match self.camera.lens {
            Lens::Perspective => {
                let [[left, right], [low, high]] = [x, y].map(|sideways| {
                    let half = half_angle_of_planes(angle, math::hypot(sideways, z));
                    let middle = math::atan2(sideways, -z);
                    tangents([middle - half, middle + half])
                });
                [DVec2::new(left, low), DVec2::new(right, high)]
            }
            Lens::Fisheye => {
                // Along a great circle of that angle the picture is stretched by at most t / sin t at its largest distance t from the axis.
                let farthest = middle.length() + angle;
                let rim = DVec2::splat(self.camera.half_angle);
                let stretch = farthest / math::sin(farthest.min(PI));
                let reach = if farthest < 3.0 { DVec2::splat(angle * stretch) } else { DVec2::INFINITY };
                [(middle - reach).max(-rim), (middle + reach).min(rim)]
            }
            Lens::Panorama => {
                // A cap around a pole has all longitudes.
                let has_pole = middle.y.abs() + angle >= FRAC_PI_2;
                let half = if has_pole { PI } else { half_angle_of_planes(angle, math::hypot(x, z)).min(PI) };
                [
                    DVec2::new(middle.x - half, (middle.y - angle).clamp(-FRAC_PI_2, FRAC_PI_2)),
                    DVec2::new(middle.x + half, (middle.y + angle).clamp(-FRAC_PI_2, FRAC_PI_2)),
                ]
            }
        }
    }

    /// How far the position `pixel` is inside of the circle of directions at the distance `chord`, pixels, to first order across the circle; negative
    /// outside.
    #[inline(always)]
    pub fn pixels_inside(&self, chord: f64, pixel: DVec2) -> f64 {
        let focal = self.camera.focal_pixels;
        let x = (pixel.x - self.camera.principal_point.x) / focal;
        let y = (self.camera.principal_point.y - pixel.y) / focal;
        let [seen, along_x, along_y] = direction_and_derivatives(self.camera.lens, x, y);
        let distance = (seen - self.direction).length();
        // The gradient of the distance |seen - direction|; the derivatives are perpendicular to `seen`.
        let gradient = if distance > 1e-12 {
            math::hypot(self.direction.dot(along_x), self.direction.dot(along_y)) / distance
        } else {
            along_y.length()
        };
        (chord - distance) * focal / gradient.max(1e-12)
    }

    /// Squares of the distances, as chords, of the centers of sixteen pixels of row `y` from column `x` on; infinite outside of a fisheye's circle. The
    /// relative error is below 2e-4 up to an angle of 0.2; farther pixels within 90 degrees are never taken for nearer ones than that.
    #[inline(always)]
    pub fn squares(&self, x: usize, y: usize) -> [f32; LANES] {
        let focal = self.camera.focal_pixels;
        let first = (x as f64 + 0.5 - self.camera.principal_point.x) / focal;
        let row = (self.camera.principal_point.y - y as f64 - 0.5) / focal;
        let step = (1.0 / focal) as f32;
        match self.camera.lens {
            Lens::Perspective => self.perspective_squares([first, row], step),
            Lens::Fisheye => self.fisheye_squares([first, row], step),
            Lens::Panorama => self.panorama_squares([first, row], step),
        }
    }

    /// sin^2 = |(seen - offset) x direction|^2 / |seen|^2, which has no difference of nearly equal numbers.
    #[inline(always)]
    fn perspective_squares(&self, [first, row]: [f64; 2], step: f32) -> [f32; LANES] {
        let [nx, ny, nz] = self.direction.as_vec3().to_array();
        let (from, up) = ((first - self.offset.x) as f32, (row - self.offset.y) as f32);
        let first = first as f32;
        let beside_x = (1.0 + row * row) as f32;
        let (up_x, up_z) = (up * nx, up * nz);
        let up_z = up_z * up_z;
        let mut squares = [0.0; LANES];
        for i in 0..LANES {
            let right = step.fma(i as f32, from);
            let seen = step.fma(i as f32, first);
            let (along, across) = (right * nz, right.fma(ny, -up_x));
            let product = along.fma(along, across.fma(across, up_z));
            let square = product / seen.fma(seen, beside_x);
            // From the square of the sine to that of the chord.
            squares[i] = square * square.fma(0.25, 1.0);
        }
        squares
    }

    /// The haversine formula in polar coordinates: 4 sin^2((t - t0) / 2) + 4 sin t sin t0 sin^2(azimuth / 2), where the last factor follows from the
    /// distance in the picture.
    #[inline(always)]
    fn fisheye_squares(&self, [first, row]: [f64; 2], step: f32) -> [f32; LANES] {
        const TURNS: f32 = (1.0 / std::f64::consts::TAU) as f32;
        let own_angle = self.offset.length();
        let own_sinc = if own_angle > 0.0 { math::sin(own_angle) / own_angle } else { 1.0 } as f32;
        let (from, up) = ((first - self.offset.x) as f32, (row - self.offset.y) as f32);
        // (p - p0) . (p + p0) = t^2 - t0^2.
        let (sum_x, sum_y) = ((first + self.offset.x) as f32, (row + self.offset.y) as f32);
        let (first, row, own_angle) = (first as f32, row as f32, own_angle as f32);
        let max_angle = self.camera.half_angle as f32;
        let mut squares = [0.0; LANES];
        for i in 0..LANES {
            let right = step.fma(i as f32, from);
            let x = step.fma(i as f32, first);
            let angle = x.fma(x, row * row).sqrt();
            let sinc = if angle > 1e-6 { approximations::sin_turns(angle * TURNS) / angle } else { 1.0 };
            let outward = right.fma(step.fma(i as f32, sum_x), up * sum_y);
            let radial = if angle + own_angle > 0.0 { outward / (angle + own_angle) } else { 0.0 };
            let radial = radial * radial;
            let sideways = right.fma(right, up * up) - radial;
            let sideways = if sideways > 0.0 { sideways } else { 0.0 };
            let square = (own_sinc * sinc).fma(sideways, radial * radial.fma(-1.0 / 12.0, 1.0));
            squares[i] = if angle <= max_angle { square } else { f32::INFINITY };
        }
        squares
    }

    /// The haversine formula in longitude and latitude.
    #[inline(always)]
    fn panorama_squares(&self, [first, row]: [f64; 2], step: f32) -> [f32; LANES] {
        const HALF_TURNS: f64 = 0.5 / std::f64::consts::TAU;
        let along_meridian = math::sin(0.5 * (row - self.offset.y));
        let along_meridian = (4.0 * along_meridian * along_meridian) as f32;
        let width = (4.0 * math::cos(row) * math::cos(self.offset.y)).max(0.0) as f32;
        // In half turns, so that repetitions are whole periods of the square.
        let from = ((first - self.offset.x) * HALF_TURNS) as f32;
        let step = step * HALF_TURNS as f32;
        let mut squares = [0.0; LANES];
        for i in 0..LANES {
            let sine = approximations::sin_turns(step.fma(i as f32, from));
            squares[i] = width.fma(sine * sine, along_meridian);
        }
        squares
    }
}

/// The unit direction in camera space at the offset (`x`, `y`) from the principal point, and its derivatives by them.
#[inline(always)]
fn direction_and_derivatives(lens: Lens, x: f64, y: f64) -> [DVec3; 3] {
    match lens {
        Lens::Perspective => {
            let per_length = 1.0 / math::sqrt(1.0 + x * x + y * y);
            let seen = DVec3::new(x, y, -1.0) * per_length;
            // The derivative of v / |v|: the part of the axis that is perpendicular to `seen`, over |v|.
            [seen, (DVec3::X - seen * seen.x) * per_length, (DVec3::Y - seen * seen.y) * per_length]
        }
        Lens::Fisheye => {
            let angle = math::hypot(x, y);
            let (sin, cos) = math::sin_cos(angle);
            let sinc = if angle > 0.0 { sin / angle } else { 1.0 };
            // d(sinc) / dx = x k.
            let k = if angle > 1e-4 { (cos - sinc) / (angle * angle) } else { -1.0 / 3.0 };
            [
                DVec3::new(x * sinc, y * sinc, -cos),
                DVec3::new(sinc + x * x * k, x * y * k, x * sinc),
                DVec3::new(x * y * k, sinc + y * y * k, y * sinc),
            ]
        }
        Lens::Panorama => {
            let ((sin_x, cos_x), (sin_y, cos_y)) = (math::sin_cos(x), math::sin_cos(y));
            [
                DVec3::new(sin_x * cos_y, sin_y, -cos_x * cos_y),
                DVec3::new(cos_x * cos_y, 0.0, sin_x * cos_y),
                DVec3::new(-sin_x * sin_y, cos_y, cos_x * sin_y),
            ]
        }
    }
}

/// The pixels of a picture of `size` that a rectangle touches; `None` where it touches none.
fn whole_pixels(low: DVec2, high: DVec2, size: [usize; 2]) -> Option<Rect> {
    let last = DVec2::new(size[0] as f64, size[1] as f64);
    let low = low.floor().clamp(DVec2::ZERO, last);
    let high = high.ceil().clamp(DVec2::ZERO, last);
    let ([x, y], [right, bottom]) = (low.to_array().map(|at| at as usize), high.to_array().map(|at| at as usize));
    (x < right && y < bottom).then(|| Rect { x, y, width: right - x, height: bottom - y })
}

/// Half of the angle between the two planes through an axis that touch a cone of this half angle; `across` is the sine of the angle between the axis and the
/// cone's direction. It is pi where the axis is inside of the cone.
fn half_angle_of_planes(angle: f64, across: f64) -> f64 {
    let sine = math::sin(angle.min(std::f64::consts::FRAC_PI_2));
    if sine < across { math::asin(sine / across) } else { std::f64::consts::PI }
}

/// Tangents of a range of angles from the optical axis, in a plane; infinite where the range reaches beyond what a perspective lens sees.
fn tangents([low, high]: [f64; 2]) -> [f64; 2] {
    let seen = -std::f64::consts::FRAC_PI_2..std::f64::consts::FRAC_PI_2;
    [
        if low <= seen.start {
            f64::NEG_INFINITY
        } else if low < seen.end {
            math::tan(low)
        } else {
            f64::INFINITY
        },
        if high > seen.start && high < seen.end { math::tan(high) } else { f64::INFINITY },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::CameraParameters;

    fn cameras() -> Vec<Camera> {
        let at = |lens, fov, size| {
            CameraParameters { lens, fisheye_fov_deg: fov, vertical_fov_deg: 100.0.into(), ..Default::default() }
                .at(0.0, size)
        };
        vec![
            at(Lens::Perspective, 180.0, [200, 120]),
            at(Lens::Fisheye, 180.0, [160, 160]),
            at(Lens::Fisheye, 360.0, [160, 160]),
            at(Lens::Panorama, 180.0, [256, 128]),
            at(Lens::Panorama, 180.0, [512, 128]),
        ]
    }

    /// Directions all over the sphere, with the poles, the seam and the antipode.
    fn directions() -> Vec<DVec3> {
        let mut directions = vec![DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::new(0.0, 0.99, 0.01).normalize()];
        directions.extend((0..40).map(|i| {
            let (sin, cos) = math::sin_cos(f64::from(i) * 2.4);
            let height = 1.0 - (f64::from(i) + 0.5) / 20.0;
            let across = math::sqrt(1.0 - height * height);
            DVec3::new(across * sin, height, across * cos)
        }));
        directions
    }

    #[test]
    fn distances_are_those_of_the_view_directions_through_every_lens() {
        for camera in cameras() {
            let [width, height] = camera.size.map(|side| side as usize);
            for direction in directions() {
                let Some(distance) = AngularDistance::new(&camera, direction) else { continue };
                for (x, y) in (0..height).step_by(7).flat_map(|y| (0..width).step_by(LANES).map(move |x| (x, y))) {
                    for (i, square) in distance.squares(x, y).into_iter().enumerate() {
                        let seen = camera.direction(DVec2::new((x + i) as f64 + 0.5, y as f64 + 0.5));
                        let Some(seen) = seen else {
                            assert_eq!(square, f32::INFINITY, "{:?} at {}, {y}", camera.lens, x + i);
                            continue;
                        };
                        let exact = (seen.normalize() - direction).length_squared();
                        let square = f64::from(square);
                        let is_near = exact < 0.04;
                        let is_right = if is_near { (square / exact - 1.0).abs() < 2e-4 } else { square > 0.0399 };
                        assert!(is_right, "{:?} {direction} at {}, {y}: {square}, not {exact}", camera.lens, x + i);
                    }
                }
            }
        }
    }

    #[test]
    fn every_pixel_within_an_angle_lies_in_exactly_one_of_its_rectangles() {
        for (camera, angle) in cameras().into_iter().flat_map(|camera| [0.01, 0.12, 0.6].map(|angle| (camera, angle))) {
            let size = camera.size.map(|side| side as usize);
            for direction in directions() {
                let Some(distance) = AngularDistance::new(&camera, direction) else { continue };
                let rects = distance.rects_within(angle, size);
                for (x, y) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
                    let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                    let Some(seen) = camera.direction(pixel) else { continue };
                    let contains =
                        |rect: &&Rect| (rect.x..rect.right()).contains(&x) && (rect.y..rect.bottom()).contains(&y);
                    let count = rects.iter().filter(contains).count();
                    let is_within = (seen.normalize() - direction).length() < chord(angle);
                    assert!(
                        count == 1 || count == 0 && !is_within,
                        "{:?} {direction} {angle}: pixel {pixel} is in {count} of {rects:?}",
                        camera.lens
                    );
                }
            }
        }
    }

    #[test]
    fn the_edge_of_a_circle_is_met_within_a_fiftieth_of_a_pixel() {
        for camera in cameras() {
            for direction in directions() {
                let Some(distance) = AngularDistance::new(&camera, direction) else { continue };
                let Some([columns, rows]) = distance.pixels_within(0.3) else { continue };
                for (x, y) in rows.flat_map(|y| columns.clone().map(move |x| (x, y))) {
                    let pixel = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                    let Some(seen) = camera.direction(pixel) else { continue };
                    // The gradient of the chord by central differences.
                    let at = |offset: DVec2| {
                        camera.direction(pixel + offset * 1e-4).map(|seen| (seen.normalize() - direction).length())
                    };
                    let far = (seen.normalize() - direction).length();
                    let (Some(right), Some(left), Some(down), Some(up)) =
                        (at(DVec2::X), at(-DVec2::X), at(DVec2::Y), at(-DVec2::Y))
                    else {
                        continue;
                    };
                    let gradient = math::hypot(right - left, down - up) / 2e-4;
                    let expected = (chord(0.3) - far) / gradient;
                    if far > 0.02 && expected.abs() < 3.0 {
                        let inside = distance.pixels_inside(chord(0.3), pixel);
                        assert!((inside - expected).abs() < 0.02, "{:?} {pixel}: {inside} {expected}", camera.lens);
                    }
                }
            }
        }
    }
}
