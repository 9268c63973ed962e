//! What a night shows through a camera, which pictures show again as long as neither camera nor sky change.

use std::sync::{Arc, OnceLock};

use bansho_base::{camera::Camera, math::MulAdd, phenomenon::strip::Strip, world::sky::Sky};

use super::{FAR, night::NightSky, stars::Spot};

/// Larger pictures are not kept: 16 bytes a pixel.
const MOST_KEPT: usize = 1 << 22;

/// A night through a camera.
#[derive(Clone)]
pub(super) struct Still {
    pub(super) cameras: Vec<Camera>,
    pub(super) size: [usize; 2],
    pub(super) sky: Sky,
    pub(super) night: Arc<NightSky>,
    /// Stars, from the top down.
    pub(super) spots: Arc<Vec<Spot>>,
    /// Its whole rows, as they are drawn; none before a second picture shows it.
    pub(super) rows: Option<Arc<Vec<OnceLock<SkyRow>>>>,
}

impl Still {
    /// Whether a picture through these cameras shows the same.
    pub(super) fn is_of(&self, cameras: &[Camera], size: [usize; 2], sky: &Sky) -> bool {
        self.cameras == cameras && self.size == size && self.sky == *sky
    }

    /// Keeps what is drawn from now on.
    pub(super) fn keep_rows(&mut self) {
        if self.rows.is_none() && self.size[0] * self.size[1] <= MOST_KEPT {
            self.rows = Some(Arc::new((0..self.size[1]).map(|_| OnceLock::new()).collect()));
        }
    }
}

/// A row of sky.
#[derive(Clone, Debug, Default)]
pub(super) struct SkyRow {
    pub(super) planes: [Vec<f32>; 3],
    pub(super) opacity: Vec<f32>,
}

impl SkyRow {
    /// Nothing, so wide.
    pub(super) fn clear(&mut self, width: usize) {
        for plane in self.planes.iter_mut().chain([&mut self.opacity]) {
            plane.clear();
            plane.resize(width, 0.0);
        }
    }

    /// Adds the sky of a part of the exposure.
    #[inline(always)]
    pub(super) fn add(&mut self, x: usize, [red, green, blue, _]: [f32; 4], share: f32) {
        let [reds, greens, blues] = &mut self.planes;
        reds[x] = red.fma(share, reds[x]);
        greens[x] = green.fma(share, greens[x]);
        blues[x] = blue.fma(share, blues[x]);
        self.opacity[x] = (self.opacity[x] + share).min(1.0);
    }

    /// Leaves out what is behind the plate of a strip, in which the row begins at pixel `first`.
    pub(super) fn hide_behind(&mut self, strip: &Strip, first: usize) {
        if !strip.has_plate() {
            return;
        }
        for x in 0..self.opacity.len() {
            if !strip.visible(first + x, FAR.near as f32) {
                self.planes.iter_mut().chain([&mut self.opacity]).for_each(|plane| plane[x] = 0.0);
            }
        }
    }
}
