//! Projection of drops by lenses that bend straight lines: fisheye and panorama.
//!
//! A short path is a streak as in any other picture. A long one, which is bent, or passes over the pole of a panorama, the point opposite a fisheye or the rim
//! of its circle, is cut into pieces. A panorama repeats after 360 degrees: both ends of a path are taken from the same repetition, and streaks are drawn
//! wherever they are repeated in the picture.

use bansho_base::{
    camera::{Camera, Lens, Projection},
    math::{self, DVec2, DVec3, simd::LANES},
};

use super::{
    project_lanes::{DropPaths, StreakBatch, defocus_radius},
    rasterize::StreakSegment,
};
use crate::{
    lanes::{Vec3Lanes, ZERO_LANES},
    shutter_cameras::{PATH_STEPS, ShutterCameras},
};

/// Longest path that is drawn in one piece, radians of the picture. The fisheye and the panorama stretch what they show by little within it.
const MAX_PIECE_ANGLE: f64 = 0.1;
/// Length of a path that is not cut, however wide its pixels are.
const WHOLE_PIXELS: f64 = 2.0;
/// Longest piece of a path, radians of the picture: what is longer jumps over a pole, and is drawn where it begins.
const MAX_JUMP_ANGLE: f64 = 1.0;
/// Largest deviation of the middle of a path from a straight line, pixels.
const MAX_SAGITTA: f64 = 0.25;

/// Steps of a pixel to which the centers of streaks are rounded.
const CENTER_STEPS: f64 = 4096.0;

/// The pieces of a drop's path.
pub(crate) struct PathPieces {
    pub(crate) streaks: StreakBatch,
    /// Middles of the pieces relative to the camera, m.
    pub(crate) positions: Vec3Lanes,
    pub(crate) count: usize,
}

impl DropPaths {
    /// The streaks in the picture of a fisheye or a panorama, without light. Of paths that are cut, only the number of pieces is set.
    pub(crate) fn curvilinear_streaks(&self, cameras: &ShutterCameras) -> StreakBatch {
        let [open, middle, close] = &cameras.cameras;
        let mut streaks = StreakBatch::NONE;
        // A circle of this radius in radians, the sharpest bend of a straight line off the poles, deviates from its chord of length l by l^2 / (8 r).
        let longest = (MAX_PIECE_ANGLE * middle.focal_pixels)
            .max(WHOLE_PIXELS)
            .min(math::sqrt(8.0 * MAX_SAGITTA * middle.focal_pixels));
        for i in 0..LANES {
            if self.gain[i] <= 0.0 {
                continue;
            }
            let [from, to] = [&self.from, &self.to].map(|points| cameras.point_in_world(points, i));
            match [open.project(from), close.project(to)] {
                [Some(from), Some(to)] => {
                    let to = Projection { pixel: middle.nearest_repetition(to.pixel, from.pixel), ..to };
                    let length = (to.pixel - from.pixel).length();
                    if length > longest {
                        streaks.pieces[i] = piece_count(length / longest);
                    } else {
                        let segment = segment(middle, [from, to], self.diameter_mm[i], self.gain[i]);
                        streaks.set_lane(i, &segment, self.gain[i], cameras);
                    }
                }
                [None, None] if middle.project(0.5 * (from + to)).is_none() => {}
                _ => streaks.pieces[i] = PATH_STEPS as u32,
            }
        }
        streaks
    }

    /// The pieces into which the path of a lane is cut.
    pub(crate) fn pieces(&self, i: usize, count: usize, cameras: &ShutterCameras) -> PathPieces {
        let mut pieces = PathPieces { streaks: StreakBatch::NONE, positions: [ZERO_LANES; 3], count };
        let gain = self.gain[i] / count as f32;
        let [from, to] = [&self.from, &self.to].map(|points| cameras.point_in_world(points, i));
        let mut begin = project_at_step(cameras, [from, to], 0, count);
        for piece in 0..count {
            let end = project_at_step(cameras, [from, to], piece + 1, count);
            let middle = from.lerp(to, (piece as f64 + 0.5) / count as f64) - cameras.middle().position;
            (0..3).for_each(|axis| pieces.positions[axis][piece] = middle[axis] as f32);
            if let (Some(begin), Some(end)) = (begin, end) {
                let camera = cameras.middle();
                let pixel = camera.nearest_repetition(end.pixel, begin.pixel);
                let is_jump = (pixel - begin.pixel).length() > MAX_JUMP_ANGLE * camera.focal_pixels;
                let end = Projection { pixel: if is_jump { begin.pixel } else { pixel }, ..end };
                let segment = segment(camera, [begin, end], self.diameter_mm[i], gain);
                pieces.streaks.set_lane(piece, &segment, gain, cameras);
            }
            begin = end;
        }
        pieces
    }
}

/// Where a drop on the path between two points, m, is seen after one of `count` steps of the exposure, by the camera of that moment.
fn project_at_step(cameras: &ShutterCameras, [from, to]: [DVec3; 2], step: usize, count: usize) -> Option<Projection> {
    cameras.during_exposure(step * PATH_STEPS / count).project(from.lerp(to, step as f64 / count as f64))
}

/// The power of two, at most the number of steps of an exposure, that is at least `ratio`.
fn piece_count(ratio: f64) -> u32 {
    let mut count = 2;
    while f64::from(count) < ratio && count < PATH_STEPS as u32 {
        count *= 2;
    }
    count
}

/// The streak of a drop between two points, which are near each other.
fn segment(camera: &Camera, [from, to]: [Projection; 2], diameter_mm: f32, gain: f32) -> StreakSegment {
    let depth = 0.5 * (from.depth + to.depth);
    let scale = 0.5 * (from.pixels_per_meter + to.pixels_per_meter);
    let drop_radius = 0.5e-3 * f64::from(diameter_mm) * scale;
    let radius = drop_radius + f64::from(defocus_radius(depth as f32)) * scale;
    let center = 0.5 * (from.pixel + to.pixel);
    let stretch = Stretch::at(camera, center, radius);
    let blocked_area = std::f64::consts::PI * drop_radius * drop_radius * stretch.ratio * f64::from(gain);
    StreakSegment::stretched(
        // On a fixed grid, so that a picture that is shifted by whole pixels, as by a turned panorama, has the same bits.
        ((center * CENTER_STEPS).round() / CENTER_STEPS).as_vec2().to_array(),
        (to.pixel - from.pixel).as_vec2().to_array(),
        stretch.widening(radius).as_vec2().to_array(),
        radius as f32,
        blocked_area as f32,
        depth as f32,
    )
}

/// How a lens stretches a small disc: along the rows of a panorama, along the circles around the center of a fisheye.
struct Stretch {
    /// Longer by shorter diameter: the solid angle of a pixel in the middle of the picture over that of one there.
    ratio: f64,
    /// Unit vector along the longer diameter.
    direction: DVec2,
}

impl Stretch {
    /// At a position in the picture, for a disc of some radius, pixels.
    fn at(camera: &Camera, pixel: DVec2, radius: f64) -> Self {
        let relative = camera.pixel_solid_angle(pixel) * camera.focal_pixels * camera.focal_pixels;
        // At a pole the stretch is that of a disc around it, which fills rows of 2 pi f pixels.
        let largest = (2.0 * camera.focal_pixels / radius).max(1.0);
        let offset = pixel - camera.principal_point;
        let direction = match camera.lens {
            Lens::Fisheye => DVec2::new(-offset.y, offset.x).normalize_or_zero(),
            Lens::Perspective | Lens::Panorama => DVec2::X,
        };
        Self { ratio: (1.0 / relative).clamp(1.0, largest), direction }
    }

    /// A line whose points, each the center of a disc of some radius, have the variances of the stretched disc, pixels.
    fn widening(&self, radius: f64) -> DVec2 {
        // Variances along a line of length l are l^2 / 12, across a disc of radius r they are r^2 / 4.
        self.direction * (radius * math::sqrt(3.0 * (self.ratio * self.ratio - 1.0).max(0.0)))
    }
}

impl ShutterCameras {
    /// World position of a lane, m.
    fn point_in_world(&self, points: &Vec3Lanes, i: usize) -> DVec3 {
        self.middle().position + super::project::vector(points, i)
    }
}
