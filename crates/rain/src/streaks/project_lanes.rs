//! Motion of sixteen drops at a time during the exposure, and its projection into the picture.
//!
//! Positions are relative to the camera at the middle of the exposure, which keeps single precision sufficient.

use bansho_base::{
    camera::Lens,
    math::simd::{LANES, Real},
};

use super::rasterize::{ScreenPath, StreakSegment, tile::StreakShading};
use crate::{
    lanes::{LaneArray, Vec3Lanes, ZERO_LANES},
    shutter_cameras::{PUPIL_RADIUS, PixelBounds, ShutterCameras},
};

/// Largest factor by which a perspective lens stretches the area of a sphere: that of the widest field of view, at its corners.
const MAX_STRETCH: f32 = 100.0;

/// Paths of drops while the shutter is open.
pub(crate) struct DropPaths {
    /// Positions when the shutter opens, m.
    pub(crate) from: Vec3Lanes,
    /// Positions when it closes, m.
    pub(crate) to: Vec3Lanes,
    /// mm.
    pub(crate) diameter_mm: LaneArray,
    /// Opacity gain; 0 for no streak.
    pub(crate) gain: LaneArray,
}

impl DropPaths {
    /// Clips the paths at the ground and scales the gain by the fraction of the exposure that remains.
    #[inline(always)]
    pub(crate) fn clip_at_ground(&mut self, ground: f32) {
        for i in 0..LANES {
            let (fall, over) = (self.from[1][i] - self.to[1][i], self.from[1][i] - ground);
            // The quotient is meaningless for a drop that does not fall; the selection below discards it without a branch.
            let falling = (over / fall).simd_min(1.0);
            let fraction = (if fall > 0.0 { falling } else { over.signum() }).simd_max(0.0);
            for axis in 0..3 {
                self.to[axis][i] = (self.to[axis][i] - self.from[axis][i]) * fraction + self.from[axis][i];
            }
            self.gain[i] *= fraction;
        }
    }

    /// The streaks in the picture, without light.
    #[inline(always)]
    pub(crate) fn streaks(&self, cameras: &ShutterCameras) -> StreakBatch {
        let [open, _, close] = &cameras.projectors;
        if cameras.middle().lens != Lens::Perspective {
            return self.curvilinear_streaks(cameras);
        }
        // A clipped path ends before the shutter closes; the camera's motion within that time is neglected.
        let (from, to) = (open.project(&self.from), close.project(&self.to));
        let mut streaks = StreakBatch::NONE;
        for i in 0..LANES {
            let depth = 0.5 * (from.depth[i] + to.depth[i]);
            let scale = 0.5 * (from.scale[i] + to.scale[i]);
            let radius = 0.5e-3 * self.diameter_mm[i] * scale;
            let path_sum = [0, 1, 2].map(|axis| self.from[axis][i] + self.to[axis][i]);
            let distance =
                0.5 * (path_sum[0] * path_sum[0] + path_sum[1] * path_sum[1] + path_sum[2] * path_sum[2]).sqrt();
            // Perspective stretches spheres away from the optical axis into ellipses of a larger area.
            let stretch = (distance / depth).simd_max(1.0).simd_min(MAX_STRETCH);
            let ends = [[from.x[i], from.y[i]], [to.x[i], to.y[i]]];
            let blocked_area = std::f32::consts::PI * radius * radius * stretch * self.gain[i];
            let segment = StreakSegment::new(
                ScreenPath { ends, radius: radius + defocus_radius(depth) * scale, blocked_area },
                depth,
                0.0,
            );
            streaks.set_lane(i, &segment, self.gain[i], cameras);
        }
        streaks
    }
}

/// Radius of the defocus blur of a lens focused at one meter for nearer drops, m at their depth. The blocked area is
/// unchanged, the opacity lower.
#[inline(always)]
pub(super) fn defocus_radius(depth: f32) -> f32 {
    /// Focus distance, m.
    const FOCUS: f32 = 1.0;
    PUPIL_RADIUS * (1.0 - depth * (1.0 / FOCUS)).simd_max(0.0)
}

/// Streaks of sixteen drops, as a structure of arrays.
pub(crate) struct StreakBatch {
    center: [LaneArray; 2],
    steep: [u32; LANES],
    half_length: LaneArray,
    slope: LaneArray,
    half_width: LaneArray,
    line_coverage: LaneArray,
    depth: LaneArray,
    /// Bounding boxes: left, right, top and bottom.
    bounds: [LaneArray; 4],
    /// Maximum opacity.
    pub(crate) peak: LaneArray,
    /// 1 for visible streaks, 0 for others.
    pub(crate) visible: [u32; LANES],
    /// Number of [pieces](DropPaths::pieces) into which a path is cut; 0 for a path that is not. These are not drawn as streaks.
    pub(crate) pieces: [u32; LANES],
}

impl StreakBatch {
    pub(super) const NONE: Self = Self {
        center: [ZERO_LANES; 2],
        steep: [0; LANES],
        half_length: ZERO_LANES,
        slope: ZERO_LANES,
        half_width: ZERO_LANES,
        line_coverage: ZERO_LANES,
        depth: ZERO_LANES,
        bounds: [ZERO_LANES; 4],
        peak: ZERO_LANES,
        visible: [0; LANES],
        pieces: [0; LANES],
    };

    #[inline(always)]
    pub(super) fn set_lane(&mut self, i: usize, segment: &StreakSegment, gain: f32, cameras: &ShutterCameras) {
        let StreakSegment { center, steep, half_length, slope, half_width, line_coverage, shading, .. } = *segment;
        (self.center[0][i], self.center[1][i]) = (center[0], center[1]);
        (self.steep[i], self.half_length[i], self.slope[i]) = (u32::from(steep), half_length, slope);
        (self.half_width[i], self.line_coverage[i], self.depth[i]) = (half_width, line_coverage, shading.depth);
        self.peak[i] = segment.peak();
        let [[left, right], [top, bottom]] = segment.extent();
        (self.bounds[0][i], self.bounds[1][i], self.bounds[2][i], self.bounds[3][i]) = (left, right, top, bottom);
        let [columns, rows] = cameras.window;
        // Positions outside the picture are NaN, and every comparison with NaN is false.
        let mut meets = (right > columns[0]) & (left < columns[1]);
        if let Some(period) = cameras.period {
            for shift in [-period, period] {
                meets |= (right + shift > columns[0]) & (left + shift < columns[1]);
            }
        }
        meets &= (bottom > rows[0]) & (top < rows[1]);
        self.visible[i] = u32::from(meets & (gain > 0.0));
    }

    /// Whether any streak is visible.
    #[inline(always)]
    pub(crate) fn any_visible(&self) -> bool {
        let mut any = 0;
        for i in 0..LANES {
            any |= self.visible[i];
        }
        any != 0
    }

    /// Whether any path is cut into pieces.
    #[inline(always)]
    pub(crate) fn any_pieces(&self) -> bool {
        let mut any = 0;
        for i in 0..LANES {
            any |= self.pieces[i];
        }
        any != 0
    }

    /// Center of a streak, pixels.
    #[inline(always)]
    pub(crate) fn center(&self, i: usize) -> [f32; 2] {
        [self.center[0][i], self.center[1][i]]
    }

    /// Bounding box of a streak.
    #[inline(always)]
    pub(crate) fn extent(&self, i: usize) -> PixelBounds {
        [[self.bounds[0][i], self.bounds[1][i]], [self.bounds[2][i], self.bounds[3][i]]]
    }

    /// A streak with the light of its drop.
    #[inline(always)]
    pub(crate) fn segment(&self, i: usize, diameter_mm: f32, light: [f32; 3]) -> StreakSegment {
        StreakSegment {
            center: self.center(i),
            steep: self.steep[i] != 0,
            half_length: self.half_length[i],
            slope: self.slope[i],
            half_width: self.half_width[i],
            line_coverage: self.line_coverage[i],
            diameter_mm,
            shading: StreakShading { light, depth: self.depth[i] },
        }
    }
}
