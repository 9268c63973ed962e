//! The sky of a scene: stars and skyline, which are built once from its parameters.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use bansho_base::{
    camera::Camera,
    host::once::get_or_compute,
    phenomenon::strip::{DepthInterval, View},
    world::sky::{Sky, SkyKind, SkyObserver},
};

use super::{SkyParameters, night::NightSky, row_cache::SkyCache, skyline::Skyline, stars::Stars};

/// The sky of a scene, infinitely far and opaque, with hills in front of it; at night with stars.
pub struct SkyBackdrop {
    pub(super) parameters: SkyParameters,
    seed: u64,
    /// Created when first drawn, as is the skyline: a scene may be built only to be checked.
    stars: OnceLock<Option<Stars>>,
    skyline: OnceLock<Option<Skyline>>,
    /// The night sky of the previous frame, reused while neither camera nor sky change.
    pub(super) cache: Mutex<Option<SkyCache>>,
}

impl SkyBackdrop {
    /// The name of its layer.
    pub const NAME: &str = "sky";

    /// A sky with these parameters.
    pub fn new(parameters: SkyParameters, seed: u64) -> Self {
        Self { seed, stars: OnceLock::new(), skyline: OnceLock::new(), parameters, cache: Mutex::default() }
    }

    /// Its stars; `None` by day.
    fn stars(&self) -> Option<&Stars> {
        let has_stars = self.parameters.kind == SkyKind::Night && self.parameters.night.stars > 0.0;
        get_or_compute(&self.stars, || has_stars.then(|| Stars::new(self.seed))).as_ref()
    }

    /// Its hills and trees, if they have any height.
    pub(super) fn skyline(&self) -> Option<&Skyline> {
        get_or_compute(&self.skyline, || Skyline::new(&self.parameters, self.seed)).as_ref()
    }

    /// The cached night sky of a view; `None` by day.
    pub(super) fn cache(&self, sky: &Sky, view: &View, cameras: &[Camera]) -> Option<SkyCache> {
        sky.night()?;
        if let Some(cache) = self.lock_cache().as_mut().filter(|cache| cache.matches(cameras, view.size, sky)) {
            cache.enable_row_cache();
            return Some(cache.clone());
        }
        // Not while the lock is held: this works in parallel.
        let cache = self.night_sky(sky, view, cameras)?;
        *self.lock_cache() = Some(cache.clone());
        Some(cache)
    }

    fn lock_cache(&self) -> MutexGuard<'_, Option<SkyCache>> {
        self.cache.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The night sky of a view; `None` by day.
    pub(super) fn night_sky(&self, sky: &Sky, view: &View, cameras: &[Camera]) -> Option<SkyCache> {
        let observer = SkyObserver::at(view.camera.position);
        let night = &sky.night()?.above(observer);
        let star_images =
            self.stars().map(|stars| stars.star_images(view, night, observer, self.parameters.night.stars));
        Some(SkyCache {
            cameras: cameras.to_vec(),
            size: view.size,
            sky: *sky,
            night: Arc::new(NightSky::new(sky, night, self.parameters.night.milky_way, observer)),
            star_images: Arc::new(star_images.unwrap_or_default()),
            rows: None,
        })
    }

    /// Depth interval of the hills.
    pub(super) fn hills(&self) -> DepthInterval {
        let near = self.parameters.hills_distance;
        DepthInterval { near, far: near * (1.0 + 1e-4) }
    }
}
