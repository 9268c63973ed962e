//! What is known of the ground from earlier frames: its pattern while the camera stands still, and its light while the lights do not change either.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use bansho_base::{
    camera::Camera,
    image::{Image, Rect},
    math::simd::LANES,
    phenomenon::{
        strip::View,
        surroundings::{Light, Occluder},
    },
    world::sky::Sky,
};

use super::surface::SurfaceSamples;

/// Largest window whose rows are kept, pixels. A pixel takes 24 bytes of pattern or 16 bytes of light, so a view at most 100 MB.
const MAX_CACHED_PIXELS: usize = 1 << 22;

/// Bytes that are kept of `rows` rows of the window of a view: of a still camera the light, or the pattern where lights change.
pub(super) fn estimated_bytes(view: &View, rows: usize) -> f64 {
    /// The mean of pattern and light.
    const BYTES: f64 = 20.0;
    if view.window.width * view.window.height > MAX_CACHED_PIXELS || !view.path_cameras().is_still() {
        return 0.0;
    }
    BYTES * (view.window.width * rows) as f64
}

/// Light of the ground in sixteen pixels that does not depend on the picture in its mirror: red, green and blue, and the weight of that picture.
pub(super) type GroundLightBatch = [[f32; LANES]; 4];

/// A row of the window in batches of sixteen pixels, which the strip that first draws it computes.
type Rows<T> = Vec<OnceLock<Vec<T>>>;

/// What the pattern depends on, apart from the ground.
#[derive(Clone, Debug, PartialEq)]
struct ViewInputs {
    camera: Camera,
    size: [usize; 2],
    window: Rect,
    has_film: bool,
}

impl ViewInputs {
    /// Whether two views show the same part of a picture of the same size.
    fn has_window_of(&self, other: &Self) -> bool {
        self.size == other.size && self.window == other.window
    }
}

/// What the light depends on, apart from the ground and the view.
#[derive(Clone, Debug)]
pub(super) struct LightInputs {
    pub(super) wetness: f64,
    pub(super) lights: Vec<Light>,
    pub(super) shadow_casters: Vec<Occluder>,
    pub(super) plate_is_lit: bool,
    pub(super) sky: Sky,
    pub(super) backdrop: Option<Image<4>>,
}

impl PartialEq for LightInputs {
    fn eq(&self, other: &Self) -> bool {
        let Self { wetness, lights, shadow_casters, plate_is_lit, sky, backdrop } = self;
        *wetness == other.wetness
            && *plate_is_lit == other.plate_is_lit
            && *lights == other.lights
            && *sky == other.sky
            && Occluder::are_same(shadow_casters, &other.shadow_casters)
            && *backdrop == other.backdrop
    }
}

/// A view in recent frames.
#[derive(Debug)]
struct CachedView {
    view: ViewInputs,
    light: LightInputs,
    rows: CachedRows,
}

/// The rows that are kept of a view.
#[derive(Clone, Debug)]
pub(super) enum CachedRows {
    /// None: in the first frame with a camera that may be moving.
    None,
    /// The pattern, while lights change.
    Pattern(Arc<Rows<SurfaceSamples>>),
    /// The light, while nothing changes.
    Light(Arc<Rows<GroundLightBatch>>),
}

/// Recent views of a ground.
#[derive(Debug, Default)]
pub(super) struct GroundRowCache(Mutex<Vec<CachedView>>);

impl GroundRowCache {
    /// Views kept: a window, and the whole picture that is drawn instead where air refracts light.
    const CAPACITY: usize = 2;

    /// The rows of a view, at first empty. A camera that cannot move has them from its first frame on, so that frames drawn at once share them; one that a
    /// program may move (a live effect) has them from the second frame on, and so has one before a plate, which hides much of each row.
    pub(super) fn rows(&self, view: &View, has_film: bool, light: LightInputs) -> CachedRows {
        let inputs = ViewInputs { camera: view.camera, size: view.size, window: view.window, has_film };
        if view.window.width * view.window.height > MAX_CACHED_PIXELS {
            return CachedRows::None;
        }
        // The list is always consistent, so a poisoned lock is usable.
        let mut recent = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(index) = recent.iter().position(|cached_view| cached_view.view == inputs) else {
            let is_first = recent.iter().all(|cached_view| !cached_view.view.has_window_of(&inputs));
            let stays = is_first && !view.has_plate && view.camera_parameters.is_constant();
            let rows = if stays { CachedRows::Light(empty_rows(view.window.height)) } else { CachedRows::None };
            recent.insert(0, CachedView { view: inputs, light, rows: rows.clone() });
            recent.truncate(Self::CAPACITY);
            return rows;
        };
        recent[..=index].rotate_right(1);
        let cached_view = &mut recent[0];
        let is_lit_alike = cached_view.light == light;
        cached_view.light = light;
        let height = view.window.height;
        match &cached_view.rows {
            CachedRows::Light(_) if is_lit_alike => {}
            CachedRows::Pattern(_) if !is_lit_alike => {}
            _ if is_lit_alike => cached_view.rows = CachedRows::Light(empty_rows(height)),
            _ => cached_view.rows = CachedRows::Pattern(empty_rows(height)),
        }
        cached_view.rows.clone()
    }
}

fn empty_rows<T>(height: usize) -> Arc<Rows<T>> {
    Arc::new((0..height).map(|_| OnceLock::new()).collect())
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        camera::CameraParameters, math::curve::Interpolation, parameters::animated::Animated,
        phenomenon::strip::Shutter,
    };

    use super::*;

    fn view(position: impl Into<Animated<[f64; 3]>>, t: f64) -> View {
        let camera = CameraParameters { position: position.into(), ..CameraParameters::default() };
        View::new(camera, Shutter { open: t, close: t }, t + 0.04, [64, 36], 0)
    }

    fn light(wetness: f64) -> LightInputs {
        LightInputs {
            wetness,
            lights: Vec::new(),
            shadow_casters: Vec::new(),
            plate_is_lit: false,
            sky: Sky::DARK,
            backdrop: None,
        }
    }

    #[test]
    fn a_camera_that_cannot_move_keeps_light_from_its_first_frame_on() {
        let cache = GroundRowCache::default();
        let CachedRows::Light(first) = cache.rows(&view([0.0, 1.2, 4.0], 0.0), false, light(0.5)) else {
            panic!("no light is kept of the first frame");
        };
        let CachedRows::Light(second) = cache.rows(&view([0.0, 1.2, 4.0], 1.0), false, light(0.5)) else {
            panic!("no light is kept of the second frame");
        };
        assert!(Arc::ptr_eq(&first, &second));
        assert!(matches!(cache.rows(&view([0.0, 1.2, 4.0], 2.0), false, light(0.7)), CachedRows::Pattern(_)));
    }

    #[test]
    fn nothing_is_kept_of_the_first_frame_of_a_camera_that_may_move() {
        let cache = GroundRowCache::default();
        cache.rows(&view([0.0, 1.2, 4.0], 0.0), false, light(0.5));
        // A live effect gives each frame a camera of its own.
        assert!(matches!(cache.rows(&view([0.1, 1.2, 4.0], 0.0), false, light(0.5)), CachedRows::None));
        let plate = View { has_plate: true, ..view([0.0, 1.2, 4.0], 0.0) };
        assert!(matches!(GroundRowCache::default().rows(&plate, false, light(0.5)), CachedRows::None));
        let keys = vec![(0.0, [0.0, 1.2, 4.0]), (9.0, [1.0, 1.2, 4.0])];
        let keyed = Animated::keyed(keys, Interpolation::Linear).unwrap();
        assert!(matches!(GroundRowCache::default().rows(&view(keyed, 0.0), false, light(0.5)), CachedRows::None));
    }
}
