//! Mapping from pixels to sheet coordinates, for every lens.

use bansho_base::{
    camera::{Camera, Lens, angular_distance::AngularDistance, upright_quad::UprightQuad},
    image::Rect,
    math::{
        self, DVec2, DVec3,
        simd::{LANES, Lanes, Real, ramp},
    },
};
use fearless_simd::{Simd, prelude::*};

/// Sheet coordinates of sixteen pixels of a row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SheetCoordinates<S: Simd> {
    /// Across the sheet.
    pub(crate) x: Lanes<S>,
    /// Up the sheet; far outside if the pixel's ray misses the sheet's plane.
    pub(crate) y: Lanes<S>,
    /// Depth, m.
    pub(crate) depth: Lanes<S>,
}

impl<S: Simd> SheetCoordinates<S> {
    /// The same pixels with offset sheet coordinates.
    #[inline(always)]
    pub(crate) fn offset_by(&self, across: f32, up: f32) -> Self {
        Self { x: self.x + self.x.broadcast(across), y: self.y + self.y.broadcast(up), depth: self.depth }
    }
}

/// Depth of pixels whose rays miss the plane; finite, so that it can be interpolated.
const MISS_DEPTH: f32 = 1e30;
/// The y of these pixels, outside every flame.
const MISS_Y: f32 = -1e6;

/// Mapping from pixels to the sheet.
#[derive(Clone, Debug)]
pub(crate) enum PixelToSheet {
    /// Perspective: x/depth, y/depth and 1/depth are linear in pixel coordinates (a homography).
    Linear {
        /// Of x/depth, y/depth and 1/depth: the constant term, the term per column and the term per row.
        forms: [[f64; 3]; 3],
        /// Near clipping depth.
        near: f64,
    },
    /// Other lenses: three or all rays of each batch are traced.
    Rays {
        /// The camera.
        camera: Camera,
        /// The sheet.
        quad: UprightQuad,
    },
}

impl PixelToSheet {
    /// The mapping to `quad` seen by `camera`; `None` if it is seen exactly edge on.
    pub(crate) fn new(camera: &Camera, quad: &UprightQuad) -> Option<Self> {
        let normal = quad.right.cross(quad.up);
        let offset = normal.dot(quad.base - camera.position);
        if offset.abs() < 1e-9 * quad.size.y {
            return None;
        }
        if camera.lens != Lens::Perspective {
            return Some(Self::Rays { camera: *camera, quad: *quad });
        }
        // direction = constant + column px + row py, with a component of 1 along the optical axis.
        let scale = 1.0 / camera.focal_pixels;
        let column = camera.world_from_camera.col(0) * scale;
        let row = -camera.world_from_camera.col(1) * scale;
        let constant =
            -camera.world_from_camera.col(2) - column * camera.principal_point.x - row * camera.principal_point.y;
        let directions = [constant, column, row];
        let inverse_depth = directions.map(|direction| (normal / offset).dot(direction));
        // The point at a depth is `position + direction depth`; its sheet coordinate, divided by the depth, is start / depth + slope.
        let mut forms = [[0.0; 3], [0.0; 3], inverse_depth];
        for (form, (axis, size, shift)) in
            forms.iter_mut().zip([(quad.right, quad.size.x, 0.5), (quad.up, quad.size.y, 0.0)])
        {
            let start = axis.dot(camera.position - quad.base) / size + shift;
            for i in 0..3 {
                let slope = (axis / size).dot(directions[i]);
                form[i] = start.mul_add(inverse_depth[i], slope);
            }
        }
        Some(Self::Linear { forms, near: camera.near })
    }

    /// Sheet coordinates of the pixels `column .. column + 16` of `row`.
    #[inline(always)]
    pub(crate) fn batch<S: Simd>(&self, simd: S, column: usize, row: usize) -> SheetCoordinates<S> {
        match self {
            Self::Linear { forms, near } => linear_batch(simd, forms, *near, column, row),
            Self::Rays { camera, quad } => ray_batch(camera, quad, column, row).load(simd),
        }
    }
}

impl PixelToSheet {
    /// Sheet coordinates and depth at a pixel position; `None` if the ray misses the sheet's plane.
    #[inline(always)]
    pub(crate) fn at(&self, px: f64, py: f64) -> Option<[f64; 3]> {
        match self {
            Self::Rays { camera, quad } => intersect_sheet(camera, quad, px, py),
            Self::Linear { forms, near } => {
                let [x, y, inverse] = forms.map(|[constant, column, row]| column * px + row * py + constant);
                let is_visible = inverse > 0.0 && inverse * near <= 1.0;
                is_visible.then(|| [x / inverse, y / inverse, 1.0 / inverse])
            }
        }
    }

    /// Sheet coordinates at a pixel center, for a perspective lens.
    #[inline(always)]
    pub(crate) fn pixel_center(&self, column: usize, row: usize) -> Option<[f32; 2]> {
        let Self::Linear { .. } = self else { return None };
        self.at(column as f64 + 0.5, row as f64 + 0.5).map(|[x, y, _]| [x as f32, y as f32])
    }
}

/// A linear form at sixteen pixels of a row.
#[inline(always)]
fn linear<S: Simd>(simd: S, [constant, column, row]: [f64; 3], px: f64, py: f64) -> Lanes<S> {
    ramp(simd, (column * px + row * py + constant) as f32, column as f32)
}

#[inline(always)]
fn linear_batch<S: Simd>(simd: S, forms: &[[f64; 3]; 3], near: f64, column: usize, row: usize) -> SheetCoordinates<S> {
    let (px, py) = (column as f64 + 0.5, row as f64 + 0.5);
    let inverse = linear(simd, forms[2], px, py);
    let depth = inverse.broadcast(1.0) / inverse;
    // A depth beyond `near` is an inverse depth in (0, 1/near].
    let is_visible = inverse.simd_gt(inverse.broadcast(0.0)) & inverse.simd_le(inverse.broadcast((1.0 / near) as f32));
    SheetCoordinates {
        x: is_visible.select(linear(simd, forms[0], px, py) * depth, depth.broadcast(0.0)),
        y: is_visible.select(linear(simd, forms[1], px, py) * depth, depth.broadcast(MISS_Y)),
        depth: is_visible.select(depth, depth.broadcast(MISS_DEPTH)),
    }
}

/// Sheet coordinates as arrays.
#[derive(Debug)]
struct SheetCoordinateArrays {
    x: [f32; LANES],
    y: [f32; LANES],
    depth: [f32; LANES],
}

impl SheetCoordinateArrays {
    #[inline(always)]
    fn load<S: Simd>(&self, simd: S) -> SheetCoordinates<S> {
        let [x, y, depth] = [&self.x, &self.y, &self.depth].map(|values| Lanes::from_slice(simd, values));
        SheetCoordinates { x, y, depth }
    }
}

/// Intersection of a pixel's ray with the sheet's plane: x, y, depth.
fn intersect_sheet(camera: &Camera, quad: &UprightQuad, px: f64, py: f64) -> Option<[f64; 3]> {
    let direction = camera.direction(DVec2::new(px, py))?;
    let normal = quad.right.cross(quad.up);
    let depth = normal.dot(quad.base - camera.position) / normal.dot(direction);
    if !(depth >= camera.near && depth.is_finite()) {
        return None;
    }
    let offset = camera.position + direction * depth - quad.base;
    Some([offset.dot(quad.right) / quad.size.x + 0.5, offset.dot(quad.up) / quad.size.y, depth])
}

/// Traces the rays of three pixels of a batch and interpolates with a parabola: the error is less than a thousandth of a pixel if the sheet is small in the
/// field of view. If one of the three misses the plane, or if the curvature is large, all rays are traced.
fn ray_batch(camera: &Camera, quad: &UprightQuad, column: usize, row: usize) -> SheetCoordinateArrays {
    let (px, py) = (column as f64 + 0.5, row as f64 + 0.5);
    let mut batch = SheetCoordinateArrays { x: [0.0; LANES], y: [MISS_Y; LANES], depth: [MISS_DEPTH; LANES] };
    let knots = [0.0, 7.5, 15.0].map(|step| intersect_sheet(camera, quad, px + step, py));
    if let [Some(a), Some(b), Some(c)] = knots
        // The depth is nearly linear, and changes little.
        && (a[2] - 2.0 * b[2] + c[2]).abs() < 0.002 * b[2]
        && (a[2] - c[2]).abs() < 0.1 * b[2]
    {
        for i in 0..LANES {
            let s = i as f64 / 7.5 - 1.0;
            let [x, y, depth] = std::array::from_fn(|k| {
                let (slope, curvature) = (0.5 * (c[k] - a[k]), 0.5 * (c[k] + a[k]) - b[k]);
                (curvature.mul_add(s, slope).mul_add(s, b[k])) as f32
            });
            (batch.x[i], batch.y[i], batch.depth[i]) = (x, y, depth);
        }
        return batch;
    }
    for i in 0..LANES {
        if let Some([x, y, depth]) = intersect_sheet(camera, quad, px + i as f64, py) {
            (batch.x[i], batch.y[i], batch.depth[i]) = (x as f32, y as f32, depth as f32);
        }
    }
    batch
}

/// Bounding rectangle of the pixels in which the sheet between `left` and `right` (x) and up to `top` (y) may appear.
pub(crate) fn bounds(
    camera: &Camera,
    quad: &UprightQuad,
    left: f64,
    right: f64,
    top: f64,
    picture: [usize; 2],
) -> Rect {
    const STEPS: usize = 12;
    let whole = Rect::from_size(picture[0], picture[1]);
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    if let Some(rect) = bounds_around_pole(camera, quad, [left, right, top], picture) {
        return rect;
    }
    for i in 0..=STEPS {
        for j in 0..=STEPS {
            let x = left + (right - left) * i as f64 / STEPS as f64;
            let Some(projection) = camera.project(quad.point(x, top * j as f64 / STEPS as f64)) else {
                return whole;
            };
            low = low.min(projection.pixel);
            high = high.max(projection.pixel);
        }
    }
    // With a fisheye or panorama edges may curve beyond the sampled points.
    let margin = DVec2::splat(2.0) + (high - low) * if camera.lens == Lens::Perspective { 0.0 } else { 0.05 };
    let (low, high) = ((low - margin).max(DVec2::ZERO), high + margin);
    let end = [high.x, high.y].map(|side| side.ceil().max(0.0) as usize);
    let start = [low.x as usize, low.y as usize];
    let size = [0, 1].map(|k| end[k].min(picture[k]).saturating_sub(start[k]));
    if size[0] == 0 || size[1] == 0 {
        return Rect::default();
    }
    Rect { x: start[0], y: start[1], width: size[0], height: size[1] }
}

/// Pixels of a sheet that may contain a pole of a panorama or the antipode of a fisheye, around which its outline does not contain what is within it: those
/// of a sphere around it. `None` for all others.
fn bounds_around_pole(
    camera: &Camera,
    quad: &UprightQuad,
    [left, right, top]: [f64; 3],
    picture: [usize; 2],
) -> Option<Rect> {
    let pole = match camera.lens {
        Lens::Perspective => return None,
        Lens::Fisheye => camera.world_from_camera.z_axis,
        Lens::Panorama => camera.world_from_camera.y_axis,
    };
    let center = quad.point(0.5 * (left + right), 0.5 * top);
    let (radius, to_center) = (center.distance(quad.point(right, top)), center - camera.position);
    let sine = radius / to_center.length();
    let angle = if sine < 1.0 { math::asin(sine) } else { std::f64::consts::PI };
    let direction = to_center.normalize_or(DVec3::Z);
    let along = direction.dot(pole);
    let along = if camera.lens == Lens::Panorama { along.abs() } else { along };
    if math::acos(along.clamp(-1.0, 1.0)) > angle {
        return None;
    }
    let rects = AngularDistance::new(camera, direction)?.rects_within(angle, picture);
    Some(rects.into_iter().fold(Rect::default(), |all, rect| all.union(&rect)))
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::{CameraParameters, upright_quad::right_facing},
        parameters::animated::Animated,
    };

    use super::*;

    fn camera(lens: Lens) -> Camera {
        let parameters = CameraParameters {
            lens,
            position: Animated::from([0.7, 1.5, 4.0]),
            target: Animated::from([0.1, 0.6, 0.0]),
            roll_deg: Animated::from(5.0),
            vertical_fov_deg: Animated::from(60.0),
            ..CameraParameters::default()
        };
        parameters.at(0.0, [640, 480])
    }

    fn seen_batch(pixel_to_sheet: &PixelToSheet, column: usize, row: usize) -> SheetCoordinateArrays {
        bansho_base::dispatch_baseline!(simd => {
            let batch = pixel_to_sheet.batch(simd, column, row);
            let mut traced = SheetCoordinateArrays { x: [0.0; LANES], y: [0.0; LANES], depth: [0.0; LANES] };
            batch.x.store_slice(&mut traced.x);
            batch.y.store_slice(&mut traced.y);
            batch.depth.store_slice(&mut traced.depth);
            traced
        })
    }

    fn quad(camera: &Camera) -> UprightQuad {
        let base = DVec3::new(0.2, 0.1, -0.3);
        UprightQuad::new(base, right_facing(camera, base), DVec2::new(1.0, 2.0), 0.2)
    }

    #[test]
    fn a_facing_sheet_is_level_and_square_to_the_line_of_sight() {
        let camera = camera(Lens::Perspective);
        let quad = quad(&camera);
        assert!(quad.right.y.abs() < 1e-12 && (quad.right.length() - 1.0).abs() < 1e-12);
        let toward = camera.position - quad.base;
        assert!(quad.right.dot(DVec3::new(toward.x, 0.0, toward.z)).abs() < 1e-12);
        assert!(quad.right.dot(camera.world_from_camera.col(0)) > 0.9);
    }

    #[test]
    fn pixels_find_the_point_of_the_sheet_that_they_show_through_every_lens() {
        let mut largest = 0.0_f64;
        for lens in [Lens::Perspective, Lens::Fisheye, Lens::Panorama] {
            let camera = camera(lens);
            let quad = quad(&camera);
            let pixel_to_sheet = PixelToSheet::new(&camera, &quad).unwrap();
            for (x, y) in [(0.5, 0.0), (0.1, 0.3), (0.9, 0.95), (0.5, 0.5)] {
                let seen = camera.project(quad.point(x, y)).unwrap();
                let column = (seen.pixel.x - 0.5).floor() as usize;
                let batch = seen_batch(&pixel_to_sheet, column & !15, (seen.pixel.y - 0.5).round() as usize);
                let lane = column & 15;
                let pixel = 1.0 / (seen.pixels_per_meter * 1.0);
                for offset in [f64::from(batch.x[lane]) - x, f64::from(batch.y[lane]) - y] {
                    assert!(offset.abs() < 1.2 * pixel, "{lens:?} {x} {y} {batch:?}");
                    largest = largest.max(offset.abs() / pixel);
                }
                assert!((f64::from(batch.depth[lane]) - seen.depth).abs() < 0.01);
            }
        }
        bansho_base::assert_measured!("figure 5: distance of points, pixels", largest, 0.0, 1.2);
    }

    #[test]
    fn parabolas_through_three_rays_are_as_good_as_rays() {
        let camera = camera(Lens::Panorama);
        let quad = quad(&camera);
        let pixel_to_sheet = PixelToSheet::new(&camera, &quad).unwrap();
        let middle = camera.project(quad.point(0.5, 0.5)).unwrap().pixel;
        let (column, row) = (middle.x as usize & !15, middle.y as usize);
        let batch = seen_batch(&pixel_to_sheet, column, row);
        for i in 0..LANES {
            let [x, y, _] = intersect_sheet(&camera, &quad, (column + i) as f64 + 0.5, row as f64 + 0.5).unwrap();
            assert!((f64::from(batch.x[i]) - x).abs() < 2e-4 && (f64::from(batch.y[i]) - y).abs() < 2e-4);
        }
    }

    #[test]
    fn what_lies_behind_the_camera_or_nearer_than_near_is_nowhere() {
        let camera = camera(Lens::Perspective);
        let base = camera.position + camera.world_from_camera.col(2) * 2.0 - DVec3::Y;
        let behind = UprightQuad::new(base, right_facing(&camera, base), DVec2::ONE, 0.0);
        let batch = seen_batch(&PixelToSheet::new(&camera, &behind).unwrap(), 320, 240);
        assert!(batch.y.iter().all(|y| *y == MISS_Y));
    }

    #[test]
    fn bounds_hold_every_corner() {
        let camera = camera(Lens::Perspective);
        let quad = quad(&camera);
        let rect = bounds(&camera, &quad, 0.0, 1.0, 1.0, [640, 480]);
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let pixel = camera.project(quad.point(x, y)).unwrap().pixel;
            assert!(rect.x as f64 <= pixel.x && pixel.x <= rect.right() as f64);
            assert!(rect.y as f64 <= pixel.y.max(0.0) && pixel.y.min(480.0) <= rect.bottom() as f64);
        }
    }
}
