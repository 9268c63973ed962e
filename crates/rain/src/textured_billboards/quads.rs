//! The billboards of a frame: where they are, how they are lit, and their pixels.

use std::{
    f64::consts::{FRAC_PI_2, PI, TAU},
    ops::RangeInclusive,
};

use bansho_base::{
    camera::{Camera, Lens},
    image::Rect,
    math::{self, DVec2, DVec3},
    phenomenon::{
        strip::{DepthInterval, GrayPlanes, Strip, View},
        surroundings::Light,
    },
};

use super::{StreakTexture, TextureSet};
use crate::{aovs::write_aovs, drops::shutter_state::ShutterState};

/// Edge of a voxel and of a billboard, m.
const VOXEL: f64 = 1.0;

/// The billboards of a frame, nearest first.
pub(crate) struct TexturedBillboards<'a> {
    view: &'a View,
    quads: Vec<Quad<'a>>,
    /// Opacity of a code.
    opacity_of_code: f32,
    /// Height of the ground, m.
    ground: f64,
}

/// A billboard.
pub(super) struct Quad<'a> {
    pub(super) center: DVec3,
    /// Horizontal unit vector across it.
    pub(super) right: DVec3,
    texture: &'a StreakTexture,
    /// Mipmap.
    level: usize,
    diameter_mm: f32,
    /// Depth of its center, m.
    depth: f64,
    /// Radiance at full opacity at its corners: lower left, lower right, upper left, upper right.
    pub(super) radiance: [[f32; 3]; 4],
    /// The pixels that it may cover.
    bounds: Rect,
}

/// Height of the centers of billboards that fall with `speed` (m/s) in `rows` voxels above the ground, at time `t`, m: those within a range. Each falls until it
/// is in the ground, and then returns to the top.
pub(super) fn heights(rows: i64, speed: f64, t: f64, range: RangeInclusive<f64>) -> impl Iterator<Item = f64> {
    let fallen = speed * t / VOXEL;
    // The camera may be a thousand kilometers above the ground: only rows that come into the range are looked at. One more on each side, for rounding.
    let [lowest, highest] = [*range.start(), *range.end()].map(|height| height / VOXEL - 0.5 + fallen);
    let first = (lowest.floor() as i64).saturating_sub(1);
    let last = (highest.ceil() as i64).saturating_add(1);
    let mut candidates: Vec<i64> =
        (first..=last.min(first.saturating_add(rows - 1))).map(|row| row.rem_euclid(rows)).collect();
    candidates.sort_unstable();
    let heights =
        candidates.into_iter().map(move |row| ((row as f64 + 1.0 - fallen).rem_euclid(rows as f64) - 0.5) * VOXEL);
    heights.filter(move |height| range.contains(height))
}

impl<'a> Quad<'a> {
    /// A billboard at `center`, turned about the vertical so that it is perpendicular to the horizontal part of the line from the camera, and lit at its
    /// corners: the illuminance of each light falls with the square of the distance.
    pub(super) fn new(
        center: DVec3,
        diameter_mm: f32,
        texture: &'a StreakTexture,
        lights: &[Light],
        view: &View,
    ) -> Self {
        let toward = center - view.camera.position;
        let right = DVec3::new(-toward.z, 0.0, toward.x).normalize_or(DVec3::X);
        let corners: [DVec3; 4] = std::array::from_fn(|index| {
            let [across, up] = [(index & 1) as f64 - 0.5, (index >> 1) as f64 - 0.5];
            center + right * (across * VOXEL) + DVec3::Y * (up * VOXEL)
        });
        let radiance = corners.map(|corner| {
            lights.iter().fold([0.0; 3], |sum: [f32; 3], light| {
                let (illuminance, _) = light.illuminance(corner);
                [0, 1, 2].map(|c| sum[c] + illuminance[c] * (0.25 / PI) as f32)
            })
        });
        let depth = view.camera.depth(center);
        let texels = depth.max(view.camera.near) / view.camera.focal_pixels * 512.0 / VOXEL;
        Self {
            center,
            right,
            texture,
            level: texture.level(texels),
            diameter_mm,
            depth,
            radiance,
            bounds: pixel_bounds(center, &corners, view),
        }
    }

    fn max_radiance(&self) -> f32 {
        self.radiance.iter().flatten().copied().fold(0.0, f32::max)
    }
}

/// The pixels that a billboard may cover.
fn pixel_bounds(center: DVec3, corners: &[DVec3; 4], view: &View) -> Rect {
    let camera = &view.camera;
    let bounds = match camera.lens {
        Lens::Perspective => bounds_of_corners(corners, camera),
        Lens::Fisheye => bounds_in_fisheye(center, camera),
        Lens::Panorama => bounds_in_panorama(center, camera),
    };
    let Some([low, high]) = bounds else { return Rect::from_size(view.size[0], view.size[1]) };
    let size = DVec2::new(view.size[0] as f64, view.size[1] as f64);
    let [x, y] = low.floor().clamp(DVec2::ZERO, size).to_array().map(|side| side as usize);
    let [right, bottom] = high.ceil().clamp(DVec2::ZERO, size).to_array().map(|side| side as usize);
    Rect { x, y, width: right - x, height: bottom - y }
}

/// Of the pixels between the corners, the first and the last column and row; `None` if a corner is beside or behind the camera.
fn bounds_of_corners(corners: &[DVec3; 4], camera: &Camera) -> Option<[DVec2; 2]> {
    let mut bounds = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    for corner in corners {
        let pixel = camera.project(*corner)?.pixel;
        bounds = [bounds[0].min(pixel), bounds[1].max(pixel)];
    }
    Some(bounds)
}

/// Angle of the cone around the line of sight to the center of a billboard in which it is, radians; `None` around the camera.
fn cone_angle(center: DVec3, camera: &Camera) -> Option<f64> {
    let sine = std::f64::consts::FRAC_1_SQRT_2 * VOXEL / (center - camera.position).length();
    (sine < 0.99).then(|| math::asin(sine))
}

/// In a fisheye the edges of a billboard bend outward.
fn bounds_in_fisheye(center: DVec3, camera: &Camera) -> Option<[DVec2; 2]> {
    /// Angle from the axis from which on circles around the center are too wide to be bounded by a box.
    const MAX_ANGLE: f64 = 2.0;
    let (cone, local) = (cone_angle(center, camera)?, camera.point_in_camera(center));
    let across = math::hypot(local.x, local.y);
    let angle = math::atan2(across, -local.z);
    let farthest = angle + cone;
    if farthest > MAX_ANGLE {
        return None;
    }
    let direction = if across > 0.0 { DVec2::new(local.x, -local.y) / across } else { DVec2::ZERO };
    let pixel = camera.principal_point + direction * (angle * camera.focal_pixels);
    // Within the cone the lens stretches lengths by no more than this.
    let reach = cone * camera.focal_pixels * farthest / math::sin(farthest);
    Some([pixel - reach, pixel + reach])
}

/// In a panorama a billboard above or below the camera is all around, and one across its seam at both sides.
fn bounds_in_panorama(center: DVec3, camera: &Camera) -> Option<[DVec2; 2]> {
    let (cone, local) = (cone_angle(center, camera)?, camera.point_in_camera(center));
    let latitude = math::asin((local.y / local.length()).clamp(-1.0, 1.0));
    let longitude = math::atan2(local.x, -local.z);
    let [left, right] = [camera.principal_point.x, camera.size[0] - camera.principal_point.x];
    let ratio = math::sin(cone) / math::cos(latitude);
    let is_around =
        latitude.abs() + cone >= FRAC_PI_2 - 1e-6 || ratio >= 1.0 || left.max(right) > 1.01 * PI * camera.focal_pixels;
    let half_width = if is_around { TAU } else { math::asin(ratio) };
    let crosses_seam = longitude.abs() + half_width > PI;
    let [mut low, mut high] = [-1.0, 1.0].map(|side| {
        let angles = DVec2::new(longitude + side * half_width, side * cone - latitude);
        camera.principal_point + angles * camera.focal_pixels
    });
    if crosses_seam {
        (low.x, high.x) = (0.0, camera.size[0].ceil());
    }
    Some([low, high])
}

impl<'a> TexturedBillboards<'a> {
    /// The billboards that may be seen; those whose light is below `culling_radiance` (cd/m^2) everywhere are left out. The
    /// textures of `set` are those of the rain rate (mm/h), with a factor `gain` of their opacity.
    pub(crate) fn new(
        set: &'a TextureSet,
        rate: f64,
        gain: f64,
        shutter_state: &ShutterState,
        lights: &[Light],
        view: &'a View,
        culling_radiance: f32,
    ) -> Self {
        let t = view.shutter.middle();
        let opacity_of_code = set.opacity_of_code() * gain as f32;
        let eye = view.camera.position;
        let (distance, ground) = (shutter_state.distance, shutter_state.ground);
        let rows = ((eye.y - ground).abs() + distance).ceil().max(1.0) as i64;
        let near = eye.y - ground - distance..=eye.y - ground + distance;
        let [columns, layers] =
            [eye.x, eye.z].map(|center| (center - distance).floor() as i64..=(center + distance).floor() as i64);
        let mut quads = Vec::new();
        for (class, texture) in shutter_state.classes.iter().zip(set.of_rate(rate)) {
            let heights: Vec<f64> = heights(rows, class.speed, t, near.clone()).collect();
            for (x, z) in columns.clone().flat_map(|x| layers.clone().map(move |z| (x, z))) {
                for height in &heights {
                    let center = DVec3::new((x as f64 + 0.5) * VOXEL, ground + height, (z as f64 + 0.5) * VOXEL);
                    let is_near = (center - eye).length() <= distance;
                    if !is_near || view.camera.depth(center) < -VOXEL {
                        continue;
                    }
                    let quad = Quad::new(center, class.diameter_mm as f32, texture, lights, view);
                    let brightest = quad.max_radiance() * f32::from(texture.largest()) * opacity_of_code;
                    if brightest.min(quad.max_radiance()) >= culling_radiance && !quad.bounds.is_empty() {
                        quads.push(quad);
                    }
                }
            }
        }
        quads.sort_by(|a, b| (a.center - eye).length_squared().total_cmp(&(b.center - eye).length_squared()));
        Self { view, quads, opacity_of_code, ground }
    }

    /// Number of billboards.
    pub(crate) fn count(&self) -> usize {
        self.quads.len()
    }

    /// Drops that they show.
    pub(crate) fn drop_count(&self) -> usize {
        self.quads.iter().map(|quad| quad.texture.drop_count()).sum()
    }

    /// Draws the billboards whose centers are in a slice.
    pub(crate) fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let rect = strip.rect;
        let near = self.view.camera.near;
        let mut quads = self
            .quads
            .iter()
            .filter(|quad| slice.contains(quad.depth.max(near)) && !quad.bounds.intersection(&rect).is_empty())
            .peekable();
        if quads.peek().is_none() {
            return;
        }
        let mut directions: Vec<[f32; 3]> = Vec::with_capacity(strip.len());
        for index in 0..strip.len() {
            let [x, y] = [rect.x + index % rect.width, rect.y + index / rect.width];
            let direction = self.view.camera.direction(DVec2::new(x as f64, y as f64) + 0.5);
            directions.push(direction.unwrap_or(DVec3::ZERO).as_vec3().to_array());
        }
        let mut aovs = std::mem::take(&mut strip.aovs);
        // Only rain draws into its strip, and its transmittance is the same for all colors.
        if let Some(mut planes) = strip.gray_planes_mut() {
            for quad in quads {
                let touched = quad.bounds.intersection(&rect);
                let plane = self.plane(quad);
                for y in touched.y..touched.bottom() {
                    let first = (y - rect.y) * rect.width + touched.x - rect.x;
                    for (index, direction) in (first..).zip(&directions[first..first + touched.width]) {
                        let Some((position, depth)) = plane.hit(*direction) else { continue };
                        let code = quad.texture.sample(quad.level, position);
                        if code > 0.0 && planes.plate_depth.get(index).is_none_or(|plate| depth < *plate) {
                            let opacity = (code * self.opacity_of_code).min(1.0);
                            composite_under(&mut planes, index, interpolated(&quad.radiance, position), opacity, depth);
                            write_aovs(&mut aovs, index, opacity, depth, quad.diameter_mm);
                        }
                    }
                }
            }
        }
        strip.aovs = aovs;
    }

    fn plane(&self, quad: &Quad) -> QuadPlane {
        let eye = self.view.camera.position;
        let (right, offset) = (quad.right, quad.center - eye);
        let normal = right.cross(DVec3::Y);
        QuadPlane {
            normal: [normal.x as f32, normal.z as f32],
            right: [(right.x / VOXEL) as f32, (right.z / VOXEL) as f32],
            distance: offset.dot(normal) as f32,
            across: (0.5 - offset.dot(right) / VOXEL) as f32,
            up: (0.5 - offset.y / VOXEL) as f32,
            lowest: ((self.ground - (quad.center.y - 0.5 * VOXEL)) / VOXEL).max(0.0) as f32,
            near: self.view.camera.near as f32,
        }
    }
}

/// `L += T a l; T -= T a`.
fn composite_under(planes: &mut GrayPlanes, index: usize, light: [f32; 3], opacity: f32, depth: f32) {
    let blocked = planes.transmittance[index] * opacity;
    for (plane, light) in planes.radiance.iter_mut().zip(light) {
        plane[index] += blocked * light;
    }
    planes.transmittance[index] -= blocked;
    planes.depth[index] = planes.depth[index].min(depth);
}

/// The plane of a billboard, relative to the camera. It is vertical, so directions have two components, x and z.
struct QuadPlane {
    normal: [f32; 2],
    /// Unit vector across it, over its width.
    right: [f32; 2],
    /// Of the camera along the normal, m.
    distance: f32,
    /// Position of the camera's own perpendicular on the billboard, 0 to 1.
    across: f32,
    up: f32,
    /// Position of the ground on the billboard.
    lowest: f32,
    near: f32,
}

impl QuadPlane {
    /// Where a line of sight meets the billboard, from its lower left corner (0 to 1), and the depth there, m.
    #[inline(always)]
    fn hit(&self, [x, y, z]: [f32; 3]) -> Option<([f32; 2], f32)> {
        let t = self.distance / (x * self.normal[0] + z * self.normal[1]);
        let u = self.across + t * (x * self.right[0] + z * self.right[1]);
        let v = self.up + t * y * (1.0 / VOXEL as f32);
        // Comparisons with NaN are false.
        let is_inside = t >= self.near && (0.0..1.0).contains(&u) && (self.lowest..1.0).contains(&v);
        is_inside.then_some(([u, v], t))
    }
}

/// Bilinear interpolation of the colors of the corners.
#[inline(always)]
pub(super) fn interpolated(corners: &[[f32; 3]; 4], [u, v]: [f32; 2]) -> [f32; 3] {
    let weights = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
    let mut color = [0.0; 3];
    for (corner, weight) in corners.iter().zip(weights) {
        (0..3).for_each(|c| color[c] += corner[c] * weight);
    }
    color
}
