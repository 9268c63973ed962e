//! Cache of a night sky: reused by following frames while neither camera nor sky change.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    camera::Camera,
    math::MulAdd,
    phenomenon::strip::{DepthInterval, Strip},
    world::sky::Sky,
};

use super::{night::NightSky, stars::StarImage};

/// Depth of the sky: behind everything.
pub(super) const FAR: DepthInterval = DepthInterval { near: 1e12, far: f64::INFINITY };

/// Largest picture whose rows are cached, pixels: 16 bytes each.
const MAX_CACHED_PIXELS: usize = 1 << 22;

/// A night sky through a camera.
#[derive(Clone)]
pub(super) struct SkyCache {
    pub(super) cameras: Vec<Camera>,
    pub(super) size: [usize; 2],
    pub(super) sky: Sky,
    pub(super) night: Arc<NightSky>,
    /// Stars, from the top down.
    pub(super) star_images: Arc<Vec<StarImage>>,
    /// Finished rows; `None` until a second frame shows the same sky.
    pub(super) rows: Option<Arc<Vec<OnceLock<SkyRow>>>>,
}

impl SkyCache {
    /// Whether the cache is valid for a frame with these cameras.
    pub(super) fn matches(&self, cameras: &[Camera], size: [usize; 2], sky: &Sky) -> bool {
        self.cameras == cameras && self.size == size && self.sky == *sky
    }

    /// Starts to cache rows.
    pub(super) fn enable_row_cache(&mut self) {
        if self.rows.is_none() && self.size[0] * self.size[1] <= MAX_CACHED_PIXELS {
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
    /// Clears it to a width.
    pub(super) fn clear(&mut self, width: usize) {
        for plane in self.planes.iter_mut().chain([&mut self.opacity]) {
            plane.clear();
            plane.resize(width, 0.0);
        }
    }

    /// Adds the sky of one camera of the exposure.
    #[inline(always)]
    pub(super) fn add(&mut self, x: usize, [red, green, blue, _]: [f32; 4], weight: f32) {
        let [reds, greens, blues] = &mut self.planes;
        reds[x] = red.fma(weight, reds[x]);
        greens[x] = green.fma(weight, greens[x]);
        blues[x] = blue.fma(weight, blues[x]);
        self.opacity[x] = (self.opacity[x] + weight).min(1.0);
    }

    /// Clears the pixels in which the plate of a strip hides the sky; the row begins at pixel `first` of the strip.
    pub(super) fn mask_by_plate(&mut self, strip: &Strip, first: usize) {
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
