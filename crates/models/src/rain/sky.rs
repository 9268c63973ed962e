//! The sky that is seen through drops.

use bansho_base::{math::DVec3, sky::Sky};

use super::{lens::DropLens, tiles::Tiles};

/// What the sky shines through drops toward the camera from each corner of the tiles.
pub(crate) fn sky_through_drops(lens: &DropLens, tiles: &Tiles, sky: &Sky) -> Vec<[f32; 3]> {
    if *sky == Sky::DARK {
        return vec![[0.0; 3]; tiles.lines.len()];
    }
    tiles.map(|_, line| lens.gather(line, |direction| sky.radiance(direction)))
}

/// What endless rain shows from each corner: the sky, below the horizon that at the horizon (Koschmieder 1924).
pub(crate) fn endless_rain(tiles: &Tiles, sky: &Sky) -> Vec<[f32; 3]> {
    tiles.map(|_, line| sky.radiance(DVec3::new(line.x, line.y.max(0.0), line.z).normalize_or_zero()))
}
