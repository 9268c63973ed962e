//! Where the lines of sight of sixteen pixels meet the ground.

use bansho_base::{
    camera::{Camera, Lens, directions::Directions},
    math::{
        DVec2,
        simd::{LANES, Lanes, Real},
    },
    phenomenon::strip::{DepthInterval, View},
};
use fearless_simd::prelude::*;

/// Depth at which the ground ends, m: in front of the sky, behind all other phenomena.
pub(super) const HORIZON: f64 = 1e6;

/// Rows whose range of depth is determined together.
const BLOCK_ROWS: usize = 8;

/// Intersections of the lines of sight of consecutive pixels of a row with the ground.
pub(super) struct Hits<S: Simd> {
    /// The points relative to the camera, m.
    pub(super) offset: [Lanes<S>; 3],
    /// Unit vectors toward the camera.
    pub(super) viewer: [Lanes<S>; 3],
    /// Depth, m.
    pub(super) depth: Lanes<S>,
    /// Cosine of the angle between the line of sight and the normal.
    pub(super) cos: Lanes<S>,
    /// Length of ground that a pixel covers, m: the geometric mean of along and across the line of sight.
    pub(super) footprint: Lanes<S>,
    /// Fraction of a pixel below the horizon.
    pub(super) coverage: Lanes<S>,
}

impl<S: Simd> Hits<S> {
    /// The hits of the pixels from column `x` on in row `y`, with ground `camera_height` (m, above 0) below the camera.
    #[inline(always)]
    pub(super) fn new(simd: S, camera: &Camera, camera_height: f64, x: usize, y: usize) -> Self {
        let directions = Directions::new(camera, x, y);
        let focal = camera.focal_pixels as f32;
        let focal_lanes = Lanes::splat(simd, focal);
        let direction = [
            Lanes::from_slice(simd, &directions.components[0]),
            Lanes::from_slice(simd, &directions.components[1]),
            Lanes::from_slice(simd, &directions.components[2]),
        ];
        let mut in_view = [0.0; LANES];
        for i in 0..LANES {
            in_view[i] = if directions.visible[i] { 1.0 } else { 0.0 };
        }
        let [dx, dy, dz] = direction;
        let per_length = Lanes::splat(simd, 1.0) / dx.fma(dx, dy.fma(dy, dz * dz)).simd_sqrt();
        let toward = Lanes::splat(simd, 0.0) - per_length;
        let viewer = [dx * toward, dy * toward, dz * toward];
        // A pixel subtends about 1 / focal radians.
        let below_horizon = viewer[1].fma(focal_lanes, Lanes::splat(simd, 0.5)).simd_clamp01();
        let coverage = below_horizon * Lanes::from_slice(simd, &in_view);
        // At least that of half a pixel below the horizon, so that neither the distance nor the footprint of a pixel that the horizon cuts is
        // infinite.
        let cos = viewer[1].simd_max(Lanes::splat(simd, 0.5 / focal));
        let height = Lanes::splat(simd, camera_height as f32);
        let distance = (height / cos).simd_min(Lanes::splat(simd, (HORIZON * 0.5) as f32));
        let depth = distance * per_length;
        // Across the line of sight a pixel covers distance / focal, along it that divided by the cosine.
        let footprint = distance / (focal_lanes * cos.simd_max(Lanes::splat(simd, 1e-6)).simd_sqrt());
        Self { offset: [dx * depth, dy * depth, dz * depth], viewer, depth, cos, footprint, coverage }
    }

    /// Whether any pixel shows ground.
    #[inline(always)]
    pub(super) fn any(&self) -> bool {
        self.coverage.simd_gt(self.coverage.broadcast(0.0)).any_true()
    }
}

/// The ranges of depth of the ground in blocks of [`BLOCK_ROWS`] rows of a picture, `None` where there is no ground.
#[derive(Clone, Debug)]
pub(super) struct RowDepths(Vec<Option<DepthInterval>>);

impl RowDepths {
    pub(super) fn new(view: &View, camera_height: f64) -> Self {
        let blocks = 0..view.size[1].div_ceil(BLOCK_ROWS);
        Self(blocks.map(|block| block_depths(view, camera_height, block * BLOCK_ROWS)).collect())
    }

    /// Whether the ground of the block that contains row `y` may be in a depth interval.
    pub(super) fn overlaps(&self, y: usize, slice: &DepthInterval) -> bool {
        self.0[y / BLOCK_ROWS].is_some_and(|depths| depths.overlaps(slice))
    }

    /// The first row, and the one past the last, of ground in a depth interval.
    pub(super) fn rows(&self, slice: &DepthInterval) -> (usize, usize) {
        let mut blocks = (0..self.0.len()).filter(|&block| self.overlaps(block * BLOCK_ROWS, slice));
        let Some(first) = blocks.next() else { return (0, 0) };
        let last = blocks.next_back().unwrap_or(first);
        (first * BLOCK_ROWS, (last + 1) * BLOCK_ROWS)
    }
}

/// The range of depth of the ground in the block of rows from `first` on.
fn block_depths(view: &View, camera_height: f64, first: usize) -> Option<DepthInterval> {
    /// Bound of the relative error of depth in single precision at each pixel below the horizon.
    const TOLERANCE: f64 = 0.01;
    let camera = &view.camera;
    if camera_height <= 0.0 {
        return None;
    }
    if camera.lens != Lens::Perspective {
        return Some(DepthInterval { near: 0.0, far: HORIZON });
    }
    let last = (first + BLOCK_ROWS).min(view.size[1]);
    // How far a direction points down is linear in a perspective picture, so its extremes lie in the corners.
    let [mut steepest, mut shallowest, mut longest] = [f64::NEG_INFINITY, f64::INFINITY, 1.0];
    for (x, y) in [(0, first), (view.size[0] + LANES, first), (0, last), (view.size[0] + LANES, last)] {
        let direction = camera.direction(DVec2::new(x as f64, y as f64))?;
        (steepest, shallowest) = (steepest.max(-direction.y), shallowest.min(-direction.y));
        longest = direction.length().max(longest);
    }
    // Four pixels from the horizon nothing is clamped any more.
    let horizon = 4.0 / camera.focal_pixels * longest;
    if steepest < -horizon {
        return None;
    }
    let near = if steepest > horizon { camera_height / steepest * (1.0 - TOLERANCE) } else { 0.0 };
    let far = if shallowest > horizon { camera_height / shallowest * (1.0 + TOLERANCE) } else { HORIZON };
    Some(DepthInterval { near: near.min(0.25 * HORIZON), far: far.min(HORIZON) })
}
