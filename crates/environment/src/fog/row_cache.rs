//! The fog of recent frames, while neither the camera nor the light changes: what lamps add along lines of sight takes more time than all else of fog.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use bansho_base::{
    camera::Camera,
    image::Rect,
    math::simd::{LANES, LaneArray},
    phenomenon::{
        strip::{DepthInterval, View},
        surroundings::Light,
    },
    world::sky::Sky,
};

/// Most pixels that are kept of a view, counted once for each slice.
const MAX_CACHED_PIXELS: usize = 1 << 23;
/// Bytes of a pixel in a slice with fog: three components and opacity.
const PIXEL_BYTES: usize = 16;
/// Slices in which a pixel has fog, in most scenes, for the estimate of memory.
const USUAL_SLICES: usize = 5;

/// Bytes that are kept of a view, if the camera stands still.
pub(super) fn estimated_bytes(view: &View) -> f64 {
    let pixels = view.window.width * view.window.height;
    if !view.path_cameras().is_still() {
        return 0.0;
    }
    (PIXEL_BYTES * pixels * USUAL_SLICES.min(MAX_CACHED_PIXELS / pixels.max(1))) as f64
}

/// Fog along sixteen lines of sight, within a slice.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FogBatch {
    pub(super) light: [LaneArray; 3],
    pub(super) opacity: LaneArray,
}

/// What is kept of the fog of sixteen pixels in a slice.
#[derive(Clone, Debug)]
pub(super) enum CachedBatch {
    /// There is none, wherever plate or solids end the lines of sight.
    Empty,
    /// Nothing, since it is found as fast again.
    Unknown,
    /// Fog where nothing ends the lines of sight.
    Endless(Box<FogBatch>),
    /// Fog up to depths, m.
    UpTo(Box<(LaneArray, FogBatch)>),
}

impl CachedBatch {
    /// Keeps fog up to depths `plate`.
    pub(super) fn new(batch: FogBatch, plate: &LaneArray) -> Self {
        let is_seen = batch.opacity.iter().any(|opacity| *opacity > 0.0);
        match (is_seen, *plate == ENDLESS) {
            (true, true) => Self::Endless(Box::new(batch)),
            (true, false) => Self::UpTo(Box::new((*plate, batch))),
            // What ends the lines of sight nearer leaves no more of it.
            (false, true) => Self::Empty,
            (false, false) => Self::Unknown,
        }
    }

    /// The fog, if it ends at the depths `plate`.
    pub(super) fn up_to(&self, plate: &LaneArray) -> Option<&FogBatch> {
        match self {
            Self::Endless(batch) => (*plate == ENDLESS).then_some(&**batch),
            Self::UpTo(kept) => (kept.0 == *plate).then_some(&kept.1),
            Self::Empty | Self::Unknown => None,
        }
    }

    /// Whether there is no fog, whatever ends the lines of sight.
    pub(super) fn is_empty(&self) -> bool {
        matches!(self, Self::Empty)
    }
}

/// The depths of lines of sight that nothing ends, and that of fog itself.
pub(super) const ENDLESS: LaneArray = [f32::INFINITY; LANES];

/// A row in batches of sixteen pixels.
pub(super) type Row = Vec<CachedBatch>;

/// The rows of a slice, each computed by the first strip that draws the whole of it.
#[derive(Debug)]
pub(super) struct SliceRows {
    slice: DepthInterval,
    rows: Vec<OnceLock<Row>>,
}

impl SliceRows {
    /// The row `index` of the window.
    pub(super) fn row(&self, index: usize) -> &OnceLock<Row> {
        &self.rows[index]
    }
}

/// The rows of all slices of a view.
#[derive(Debug)]
pub(super) struct FogRows {
    slices: Mutex<Vec<Arc<SliceRows>>>,
    max_slices: usize,
    height: usize,
}

impl FogRows {
    fn new(window: Rect) -> Self {
        let max_slices = MAX_CACHED_PIXELS / (window.width * window.height).max(1);
        Self { slices: Mutex::default(), max_slices, height: window.height }
    }

    /// The rows of a slice; `None` if too many others are kept.
    pub(super) fn of_slice(&self, slice: &DepthInterval) -> Option<Arc<SliceRows>> {
        let mut slices = locked(&self.slices);
        if let Some(known) = slices.iter().find(|known| known.slice == *slice) {
            return Some(known.clone());
        }
        if slices.len() >= self.max_slices {
            return None;
        }
        let rows = (0..self.height).map(|_| OnceLock::new()).collect();
        let new = Arc::new(SliceRows { slice: *slice, rows });
        slices.push(new.clone());
        Some(new)
    }
}

/// What fog depends on, apart from the depths at which it ends.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FogInputs {
    pub(super) camera: Camera,
    pub(super) size: [usize; 2],
    pub(super) window: Rect,
    pub(super) mirror: Option<f64>,
    pub(super) extinction: f32,
    pub(super) sky: Sky,
    pub(super) lights: Vec<Light>,
    /// Height of the camera above the ground, m.
    pub(super) height: f32,
}

impl FogInputs {
    /// Whether both are of the same part of a picture of the same size.
    fn is_same_view(&self, other: &Self) -> bool {
        (self.size, self.window, self.mirror) == (other.size, other.window, other.mirror)
    }
}

/// Fog in a recent frame; without rows where it differed from that of the frame before.
#[derive(Debug)]
struct CachedFog {
    inputs: FogInputs,
    rows: Option<Arc<FogRows>>,
}

/// Recent views of a fog.
#[derive(Debug, Default)]
pub(super) struct FogCache(Mutex<Vec<CachedFog>>);

impl FogCache {
    /// Views kept: the picture, what wet ground mirrors, and one of other quality in a studio.
    const CAPACITY: usize = 3;

    /// The rows of a view, at first empty; `None` while light or camera change from frame to frame. A camera that cannot move has them from its first frame on.
    pub(super) fn rows(&self, inputs: FogInputs, has_constant_camera: bool) -> Option<Arc<FogRows>> {
        let mut recent = locked(&self.0);
        let index = recent.iter().position(|known| known.inputs.is_same_view(&inputs));
        let (is_first, known) = (index.is_none(), index.map(|index| recent.remove(index)));
        let rows = match known {
            Some(CachedFog { inputs: known, rows }) if known == inputs => {
                Some(rows.unwrap_or_else(|| Arc::new(FogRows::new(inputs.window))))
            }
            _ => (is_first && has_constant_camera).then(|| Arc::new(FogRows::new(inputs.window))),
        };
        recent.insert(0, CachedFog { inputs, rows: rows.clone() });
        recent.truncate(Self::CAPACITY);
        rows
    }
}

/// The value of a mutex. What is within is consistent at all times, so a poisoned one is usable.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use bansho_base::{camera::CameraParameters, math::DVec3, phenomenon::surroundings::Emitter};

    use super::*;

    fn inputs(intensity: f32) -> FogInputs {
        let size = [64, 36];
        let emitter = Emitter::Point { position: DVec3::ZERO, radius: 0.1 };
        FogInputs {
            camera: CameraParameters::default().at(0.0, size),
            size,
            window: Rect::from_size(size[0], size[1]),
            mirror: None,
            extinction: 0.01,
            sky: Sky::DARK,
            lights: vec![Light { emitter, intensity: [intensity; 3] }],
            height: 1.5,
        }
    }

    #[test]
    fn rows_are_kept_while_nothing_changes() {
        let cache = FogCache::default();
        let first = cache.rows(inputs(1.0), true).unwrap();
        assert!(Arc::ptr_eq(&first, &cache.rows(inputs(1.0), true).unwrap()));
        // A fire that flickers is not worth storing rows for; a lamp that was switched is, from the second frame on.
        assert!(cache.rows(inputs(2.0), true).is_none() && cache.rows(inputs(1.0), true).is_none());
        assert!(cache.rows(inputs(1.0), true).is_some());
        assert!(FogCache::default().rows(inputs(1.0), false).is_none(), "a camera that may move");
    }

    #[test]
    fn a_batch_is_used_only_where_the_lines_of_sight_end_as_before() {
        let batch = FogBatch { light: [[0.5; LANES]; 3], opacity: [0.25; LANES] };
        let mut plate = ENDLESS;
        let endless = CachedBatch::new(batch.clone(), &plate);
        assert_eq!(endless.up_to(&plate), Some(&batch));
        plate[3] = 8.0;
        assert_eq!(endless.up_to(&plate), None);
        let ended = CachedBatch::new(batch.clone(), &plate);
        assert_eq!((ended.up_to(&plate), ended.up_to(&ENDLESS)), (Some(&batch), None));
        let none = FogBatch { opacity: [0.0; LANES], ..batch };
        assert!(!CachedBatch::new(none.clone(), &plate).is_empty(), "what ended it may move away");
        assert!(CachedBatch::new(none, &ENDLESS).is_empty());
    }

    #[test]
    fn slices_have_rows_of_their_own_up_to_the_limit_of_pixels() {
        let rows = FogRows::new(Rect::from_size(2048, 2048));
        let slice = |near, far| DepthInterval { near, far };
        let first = rows.of_slice(&slice(0.0, 5.0)).unwrap();
        assert!(!Arc::ptr_eq(&first, &rows.of_slice(&slice(5.0, 9.0)).unwrap()));
        assert!(Arc::ptr_eq(&first, &rows.of_slice(&slice(0.0, 5.0)).unwrap()));
        assert!(rows.of_slice(&slice(9.0, f64::INFINITY)).is_none());
    }
}
