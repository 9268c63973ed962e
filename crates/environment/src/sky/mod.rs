//! The sky as a background, where there is no plate or one with alpha: by day, at twilight or at night, with a skyline of hills and
//! trees.
//!
//! The radiance model itself is [`Sky`], since it also lights other things; this module draws it. By night it adds
//! stars and the Milky Way.
//!
//! # References
//! - Allen's Astrophysical Quantities, 4th edition (2000): numbers of stars by magnitude.
//! - M. F. Walker (1977), R. H. Garstang (1986): glow of a town; see [`TownGlow`](bansho_base::world::sky::TownGlow).
//! - A. F. J. Moffat, Astron. Astrophys. 3 (1969): point spread function of a star's image.
//!
//! # Equations
//!
//! | equation | function |
//! | --- | --- |
//! | radiance by day, by elevation | [`Sky::radiance_at_elevations`](bansho_base::world::sky::Sky::radiance_at_elevations) |
//! | radiance by night: the azimuth-independent radiance of an almucantar, twilight glow and Milky Way | `night::NightSky::radiance` |
//! | glow of a town by population, distance, elevation and azimuth | [`TownGlow::luminance`](bansho_base::world::sky::TownGlow::luminance) |
//! | number of stars brighter than a magnitude | `stars::log_count`, `stars::magnitude_of_rank` |
//! | illuminance of a star, `2.54e-6 lux * 10^(-0.4 m)` | `stars::star` |
//! | Moffat's point spread function, `(1 + (r / core)^2)^-5/2` | `stars::StarImage::psf_row` |
//!
//! # Data flow
//! [`SkyBackdrop`] generates stars and skyline once. For a frame, `night::NightSky` tabulates the night by elevation, and
//! `stars` projects the visible stars into images; both are kept in a `render::SkyCache` for following frames with
//! the same camera and sky. `PreparedSky` draws rows of sixteen pixels at a time, averaged over the cameras of the
//! exposure: first the hills of `skyline` at their distance, then the sky behind everything else, with the stars added
//! where nothing hides it.

pub(crate) mod night;
mod parameters;
mod phenomenon;
mod render;
mod skyline;
mod stars;

#[cfg(test)]
mod tests;

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use bansho_base::{
    camera::Camera,
    host::once::get_or_compute,
    phenomenon::strip::{DepthInterval, View},
    world::sky::{Sky, SkyKind, SkyObserver},
};
use night::NightSky;
pub use parameters::{HillForm, NightParameters, SkyParameters, TownParameters};
use render::SkyCache;
use skyline::Skyline;
use stars::Stars;

/// The sky of a scene, infinitely far and opaque, with hills in front of it; at night with stars.
pub struct SkyBackdrop {
    parameters: SkyParameters,
    seed: u64,
    /// Created when first drawn, as is the skyline: a scene may be built only to be checked.
    stars: OnceLock<Option<Stars>>,
    skyline: OnceLock<Option<Skyline>>,
    /// The night sky of the previous frame, reused while neither camera nor sky change.
    cache: Mutex<Option<SkyCache>>,
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
    fn skyline(&self) -> Option<&Skyline> {
        get_or_compute(&self.skyline, || Skyline::new(&self.parameters, self.seed)).as_ref()
    }

    /// The cached night sky of a view; `None` by day.
    fn cache(&self, sky: &Sky, view: &View, cameras: &[Camera]) -> Option<SkyCache> {
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
    fn night_sky(&self, sky: &Sky, view: &View, cameras: &[Camera]) -> Option<SkyCache> {
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
    fn hills(&self) -> DepthInterval {
        let near = self.parameters.hills_distance;
        DepthInterval { near, far: near * (self.parameters.hills_form.farthest_range() + 1e-4) }
    }
}
