//! The traced pixels of recent frames, for as long as neither the camera, the obstacles nor the light on them changes.

use std::sync::{Arc, Mutex, PoisonError};

use bansho_base::{
    camera::Camera,
    geometry::transform::Transform,
    image::Rect,
    phenomenon::{
        strip::View,
        surroundings::{Light, Surroundings},
    },
    world::sky::Sky,
};

use super::{pose::Pose, trace::TracedPixels};
use crate::ground::height_of_level_ground;

/// Largest window whose pixels are kept.
const MAX_CACHED_PIXELS: usize = 1 << 22;
/// Bytes that are kept of a pixel of the rectangle of all obstacles.
const PIXEL_BYTES: usize = 32;

/// Bytes that are kept of a rectangle of a view, if the camera stands still.
pub(super) fn estimated_bytes(view: &View, rect: Rect) -> f64 {
    if is_too_large(view) || !view.path_cameras().is_still() {
        return 0.0;
    }
    (PIXEL_BYTES * rect.width * rect.height) as f64
}

fn is_too_large(view: &View) -> bool {
    view.window.width * view.window.height > MAX_CACHED_PIXELS
}

/// What the pixels depend on, apart from shapes and materials.
#[derive(Clone, Debug, PartialEq)]
struct TraceInputs {
    camera: Camera,
    size: [usize; 2],
    window: Rect,
    mirror: Option<f64>,
    placements: Vec<Transform>,
    lights: Vec<Light>,
    sky: Sky,
    extinction: f64,
    ground: Option<f64>,
}

impl TraceInputs {
    fn new(pose: &Pose, view: &View, surroundings: &Surroundings) -> Self {
        let others = &surroundings.others;
        Self {
            camera: pose.camera,
            size: view.size,
            window: view.window,
            mirror: view.mirror,
            placements: pose.placements().collect(),
            lights: others.lights.clone(),
            sky: surroundings.sky,
            extinction: others.extinction,
            ground: height_of_level_ground(&others.occluders),
        }
    }
}

/// The pixels of recent frames in which nothing moved.
#[derive(Debug, Default)]
pub(super) struct TraceCache(Mutex<Vec<(TraceInputs, Arc<TracedPixels>)>>);

impl TraceCache {
    /// Views kept: the picture, what wet ground mirrors, and one of other quality in a studio.
    const CAPACITY: usize = 3;

    /// The pixels of a view in which nothing moves, traced by `trace` unless they are known.
    ///
    /// # Errors
    /// Those of `trace`.
    pub(super) fn pixels<E>(
        &self,
        pose: &Pose,
        view: &View,
        surroundings: &Surroundings,
        trace: impl FnOnce() -> Result<TracedPixels, E>,
    ) -> Result<Arc<TracedPixels>, E> {
        if is_too_large(view) {
            return trace().map(Arc::new);
        }
        let inputs = TraceInputs::new(pose, view, surroundings);
        if let Some(pixels) = self.find(&inputs) {
            return Ok(pixels);
        }
        // Without the lock: frames that are drawn at once may trace the same pixels, but do not wait for each other.
        let pixels = Arc::new(trace()?);
        // The list is always consistent, so a poisoned lock is usable.
        let mut recent = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        recent.retain(|(other, _)| {
            (other.size, other.mirror, other.window) != (inputs.size, inputs.mirror, inputs.window)
        });
        recent.insert(0, (inputs, pixels.clone()));
        recent.truncate(Self::CAPACITY);
        Ok(pixels)
    }

    fn find(&self, inputs: &TraceInputs) -> Option<Arc<TracedPixels>> {
        let recent = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        recent.iter().find(|(known, _)| known == inputs).map(|(_, pixels)| pixels.clone())
    }
}
