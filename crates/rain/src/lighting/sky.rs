//! Sky light on drops, for the directions of a camera.

use std::sync::{Arc, Mutex, PoisonError};

use bansho_base::{camera::Camera, math::DVec3, phenomenon::strip::View, world::sky::Sky};

use super::{
    drop_phase_function::DropPhaseFunction,
    tiles::{COARSE_TILE, FINE_TILE, TileGrid},
};

/// The sky as a camera sees it in and through the rain.
#[derive(Debug)]
pub(crate) struct SkyLighting {
    camera: Camera,
    size: [usize; 2],
    sky: Sky,
    /// Grid for streaks, and the radiance of drops under the sky at each of its corners.
    pub(crate) coarse: (TileGrid, Vec<[f32; 3]>),
    /// Grid for single scattering, with the radiance of drops and that of infinitely deep rain.
    pub(crate) fine: (TileGrid, [Vec<[f32; 3]>; 2]),
}

impl SkyLighting {
    fn new(phase_function: &DropPhaseFunction, view: &View, sky: Sky) -> Self {
        let (coarse, fine) = (TileGrid::new(view, COARSE_TILE), TileGrid::new(view, FINE_TILE));
        let drops = [&coarse, &fine].map(|tiles| sky_through_drops(phase_function, tiles, &sky));
        let [coarse_drops, fine_drops] = drops;
        let endless = endless_rain(&fine, &sky);
        Self {
            camera: view.camera,
            size: view.size,
            sky,
            coarse: (coarse, coarse_drops),
            fine: (fine, [fine_drops, endless]),
        }
    }
}

/// Cache of recent skies, keyed by camera, picture size and sky.
#[derive(Debug, Default)]
pub(crate) struct SkyLightingCache(Mutex<Vec<Arc<SkyLighting>>>);

/// The scene's own view and one mirrored view.
const CACHE_CAPACITY: usize = 2;

impl SkyLightingCache {
    /// What the camera of `view` sees.
    pub(crate) fn of(&self, phase_function: &DropPhaseFunction, view: &View, sky: Sky) -> Arc<SkyLighting> {
        // The list is always consistent, so a poisoned lock is usable.
        let cached = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |seen: &&Arc<SkyLighting>| (seen.camera, seen.size, seen.sky) == (view.camera, view.size, sky);
        if let Some(seen) = cached().iter().find(same) {
            return seen.clone();
        }
        let seen = Arc::new(SkyLighting::new(phase_function, view, sky));
        let mut cached = cached();
        cached.insert(0, seen.clone());
        cached.truncate(CACHE_CAPACITY);
        seen
    }
}

/// Radiance of drops under the sky, toward the camera, at each corner of the grid.
fn sky_through_drops(phase_function: &DropPhaseFunction, tiles: &TileGrid, sky: &Sky) -> Vec<[f32; 3]> {
    if sky.is_dark() {
        return vec![[0.0; 3]; tiles.directions.len()];
    }
    tiles.map(|_, line| phase_function.mean_radiance(line, |direction| sky.radiance(direction)))
}

/// Radiance of infinitely deep rain at each corner: the sky, below the horizon that at the horizon (Koschmieder 1924).
fn endless_rain(tiles: &TileGrid, sky: &Sky) -> Vec<[f32; 3]> {
    tiles.map(|_, line| sky.radiance(DVec3::new(line.x, line.y.max(0.0), line.z).normalize_or_zero()))
}

#[cfg(test)]
mod tests {
    use bansho_base::world::sky::SkyParameters;

    use super::*;
    use crate::tests::view_at;

    #[test]
    fn a_sky_that_is_seen_again_is_found_once_and_any_other_anew() {
        let (phase_function, skies) = (DropPhaseFunction::new(), SkyLightingCache::default());
        let view = view_at(1.0, 0.02, [64, 36]);
        let [dim, bright] = [1.0, 2.0]
            .map(|luminance: f64| SkyParameters { luminance: luminance.into(), ..SkyParameters::default() }.at(0.0));
        let first = skies.of(&phase_function, &view, dim);
        assert!(
            Arc::ptr_eq(&first, &skies.of(&phase_function, &view_at(7.0, 0.02, [64, 36]), dim)),
            "time alone changes nothing"
        );
        let other = skies.of(&phase_function, &view, bright);
        assert!(other.coarse.1[0][1] > 1.5 * first.coarse.1[0][1]);
        let mut turned = view_at(1.0, 0.02, [64, 36]);
        turned.camera.position.y += 1.0;
        for (again, cached) in [
            (skies.of(&phase_function, &turned, bright), &other),
            (skies.of(&phase_function, &view_at(1.0, 0.02, [32, 18]), dim), &first),
        ] {
            assert!(!Arc::ptr_eq(&again, cached));
        }
        let anew = skies.of(&phase_function, &view, dim);
        assert!(!Arc::ptr_eq(&anew, &first) && anew.coarse.1 == first.coarse.1 && anew.fine.1 == first.fine.1);
    }
}
