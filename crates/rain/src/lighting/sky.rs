//! The sky that is seen through drops.

use std::sync::{Arc, Mutex, PoisonError};

use bansho_base::{camera::Camera, math::DVec3, phenomenon::strip::View, world::sky::Sky};

use super::{
    drop_phase_function::DropLens,
    tiles::{COARSE, FINE, Tiles},
};

/// What a camera sees of a sky in and through the rain.
#[derive(Debug)]
pub(crate) struct SeenSky {
    camera: Camera,
    size: [usize; 2],
    sky: Sky,
    /// Tiles for streaks, and what the sky shines through drops toward the camera from each of their corners.
    pub(crate) coarse: (Tiles, Vec<[f32; 3]>),
    /// The same for the veil, and what endless rain shows there.
    pub(crate) fine: (Tiles, [Vec<[f32; 3]>; 2]),
}

impl SeenSky {
    fn new(lens: &DropLens, view: &View, sky: Sky) -> Self {
        let (coarse, fine) = (Tiles::new(view, COARSE), Tiles::new(view, FINE));
        let drops = [&coarse, &fine].map(|tiles| through_drops(lens, tiles, &sky));
        let [streaks, veil] = drops;
        let endless = endless_rain(&fine, &sky);
        Self { camera: view.camera, size: view.size, sky, coarse: (coarse, streaks), fine: (fine, [veil, endless]) }
    }
}

/// Skies as they were seen last: while neither camera nor sky change, they need not be found again.
#[derive(Debug, Default)]
pub(crate) struct SeenSkies(Mutex<Vec<Arc<SeenSky>>>);

/// How many are kept: the scene's, and what a mirror shows of it.
const KEPT: usize = 2;

impl SeenSkies {
    /// What the camera of `view` sees.
    pub(crate) fn of(&self, lens: &DropLens, view: &View, sky: Sky) -> Arc<SeenSky> {
        // Only whole ones are ever kept.
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |seen: &&Arc<SeenSky>| (seen.camera, seen.size, seen.sky) == (view.camera, view.size, sky);
        if let Some(seen) = kept().iter().find(same) {
            return seen.clone();
        }
        let seen = Arc::new(SeenSky::new(lens, view, sky));
        let mut kept = kept();
        kept.insert(0, seen.clone());
        kept.truncate(KEPT);
        seen
    }
}

/// What the sky shines through drops toward the camera from each corner of the tiles.
fn through_drops(lens: &DropLens, tiles: &Tiles, sky: &Sky) -> Vec<[f32; 3]> {
    if sky.is_dark() {
        return vec![[0.0; 3]; tiles.lines.len()];
    }
    tiles.map(|_, line| lens.gather(line, |direction| sky.radiance(direction)))
}

/// What endless rain shows from each corner: the sky, below the horizon that at the horizon (Koschmieder 1924).
fn endless_rain(tiles: &Tiles, sky: &Sky) -> Vec<[f32; 3]> {
    tiles.map(|_, line| sky.radiance(DVec3::new(line.x, line.y.max(0.0), line.z).normalize_or_zero()))
}

#[cfg(test)]
mod tests {
    use bansho_base::world::sky::SkyParameters;

    use super::*;
    use crate::tests::view_at;

    #[test]
    fn a_sky_that_is_seen_again_is_found_once_and_any_other_anew() {
        let (lens, skies) = (DropLens::new(), SeenSkies::default());
        let view = view_at(1.0, 0.02, [64, 36]);
        let [dim, bright] = [1.0, 2.0]
            .map(|luminance: f64| SkyParameters { luminance: luminance.into(), ..SkyParameters::default() }.at(0.0));
        let first = skies.of(&lens, &view, dim);
        assert!(
            Arc::ptr_eq(&first, &skies.of(&lens, &view_at(7.0, 0.02, [64, 36]), dim)),
            "time alone changes nothing"
        );
        let other = skies.of(&lens, &view, bright);
        assert!(other.coarse.1[0][1] > 1.5 * first.coarse.1[0][1]);
        let mut turned = view_at(1.0, 0.02, [64, 36]);
        turned.camera.position.y += 1.0;
        for (again, kept) in
            [(skies.of(&lens, &turned, bright), &other), (skies.of(&lens, &view_at(1.0, 0.02, [32, 18]), dim), &first)]
        {
            assert!(!Arc::ptr_eq(&again, kept));
        }
        let anew = skies.of(&lens, &view, dim);
        assert!(!Arc::ptr_eq(&anew, &first) && anew.coarse.1 == first.coarse.1 && anew.fine.1 == first.fine.1);
    }
}
