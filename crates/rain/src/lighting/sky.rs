//! Sky light on drops, for the directions of a camera.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bansho_base::{
    camera::Camera,
    math::{DVec3, simd},
    phenomenon::strip::View,
    world::sky::Sky,
};
use fearless_simd::dispatch;

use super::{
    drop_phase_function::DropPhaseFunction,
    tiles::{COARSE_TILE, FINE_TILE, TileGrid},
};

/// Sky light that rain scatters toward a camera.
#[derive(Debug)]
pub(crate) struct SkyLighting {
    camera: Camera,
    size: [usize; 2],
    sky: Sky,
    /// On the grid for streaks.
    pub(crate) coarse: SkyOnDrops,
    /// On the grid for single scattering.
    pub(crate) fine: SkyOnDrops,
    /// Radiance of infinitely deep rain at the corners of the fine grid.
    pub(crate) endless: Vec<[f32; 3]>,
}

/// Radiance of drops under the sky at the corners of a grid.
#[derive(Debug)]
pub(crate) struct SkyOnDrops {
    pub(crate) tiles: TileGrid,
    /// Toward the camera, ACEScg, cd/m^2.
    pub(crate) radiance: Vec<[f32; 3]>,
}

impl SkyOnDrops {
    fn new(phase_function: &DropPhaseFunction, tiles: TileGrid, sky: &Sky) -> Self {
        Self { radiance: sky_through_drops(phase_function, &tiles, sky), tiles }
    }
}

impl SkyLighting {
    fn new(phase_function: &DropPhaseFunction, view: &View, sky: Sky) -> Self {
        let [coarse, fine] =
            [COARSE_TILE, FINE_TILE].map(|side| SkyOnDrops::new(phase_function, TileGrid::new(view, side), &sky));
        let endless = endless_rain(&fine.tiles, &sky);
        Self { camera: view.camera, size: view.size, sky, coarse, fine, endless }
    }

    /// Whether it is that of a view and a sky.
    fn is_for(&self, view: &View, sky: &Sky) -> bool {
        self.camera == view.camera && self.size == view.size && self.sky == *sky
    }
}

/// Cache of recent sky light, keyed by camera, picture size and sky.
#[derive(Debug, Default)]
pub(crate) struct SkyLightingCache(Mutex<Vec<Arc<SkyLighting>>>);

/// The scene's own view and one mirrored view.
const CACHE_CAPACITY: usize = 2;

impl SkyLightingCache {
    /// The sky light for the camera of a view.
    pub(crate) fn for_view(&self, phase_function: &DropPhaseFunction, view: &View, sky: Sky) -> Arc<SkyLighting> {
        if let Some(lighting) = self.lock().iter().find(|lighting| lighting.is_for(view, &sky)) {
            return lighting.clone();
        }
        // Computed without the lock, so that no thread waits.
        let lighting = Arc::new(SkyLighting::new(phase_function, view, sky));
        let mut recent = self.lock();
        recent.insert(0, lighting.clone());
        recent.truncate(CACHE_CAPACITY);
        lighting
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Arc<SkyLighting>>> {
        // The list is always consistent, so a poisoned lock is usable.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Radiance of drops under the sky, toward the camera, at each corner of the grid.
fn sky_through_drops(phase_function: &DropPhaseFunction, tiles: &TileGrid, sky: &Sky) -> Vec<[f32; 3]> {
    if sky.is_dark() {
        return vec![[0.0; 3]; tiles.directions.len()];
    }
    let level = simd::level();
    tiles.map(|_, line| dispatch!(level, _simd => phase_function.mean_sky_radiance(line, sky)))
}

/// Radiance of infinitely deep rain at each corner: the sky, below the horizon that at the horizon (Koschmieder 1924).
fn endless_rain(tiles: &TileGrid, sky: &Sky) -> Vec<[f32; 3]> {
    tiles.map(|_, line| sky.radiance(DVec3::new(line.x, line.y.max(0.0), line.z).normalize_or_zero()))
}

#[cfg(test)]
mod tests {
    use bansho_base::world::sky::SkyKind;

    use super::*;
    use crate::tests::view_at;

    #[test]
    fn a_sky_that_is_seen_again_is_found_once_and_any_other_anew() {
        let (phase_function, skies) = (DropPhaseFunction::new(), SkyLightingCache::default());
        let view = view_at(1.0, 0.02, [64, 36]);
        let [dim, bright] = [1.0, 2.0].map(|luminance| Sky::new(SkyKind::Overcast, luminance, 7000.0));
        let first = skies.for_view(&phase_function, &view, dim);
        assert!(
            Arc::ptr_eq(&first, &skies.for_view(&phase_function, &view_at(7.0, 0.02, [64, 36]), dim)),
            "time alone changes nothing"
        );
        let other = skies.for_view(&phase_function, &view, bright);
        assert!(other.coarse.radiance[0][1] > 1.5 * first.coarse.radiance[0][1]);
        let mut turned = view_at(1.0, 0.02, [64, 36]);
        turned.camera.position.y += 1.0;
        for (again, cached) in [
            (skies.for_view(&phase_function, &turned, bright), &other),
            (skies.for_view(&phase_function, &view_at(1.0, 0.02, [32, 18]), dim), &first),
        ] {
            assert!(!Arc::ptr_eq(&again, cached));
        }
        let anew = skies.for_view(&phase_function, &view, dim);
        assert!(
            !Arc::ptr_eq(&anew, &first)
                && anew.coarse.radiance == first.coarse.radiance
                && anew.fine.radiance == first.fine.radiance
                && anew.endless == first.endless
        );
    }
}
