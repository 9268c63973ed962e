//! Minima of a plate's depth over square tiles, by which reflected rays pass whole tiles that lie behind them (hierarchical depth: Uludag 2014).

use bansho_base::{host::parallel::prelude::*, image::Image};

use super::screen_ray::ScreenRay;

/// Side of a tile, in tiles of the level before; of the first level, in pixels.
const TILES_PER_SIDE: usize = 4;
const LEVELS: usize = 3;

/// The smallest depth in each tile, from small tiles to large ones.
pub(super) struct DepthPyramid([Image<1>; LEVELS]);

impl DepthPyramid {
    /// The pyramid of a plate's depth. NaN is nowhere in front of a ray, and is left out.
    pub(super) fn new(depth: &Image<1>) -> Self {
        let small = minima(depth);
        let medium = minima(&small);
        let large = minima(&medium);
        Self([small, medium, large])
    }

    /// Side of the tiles of a level, pixels.
    fn side(level: usize) -> usize {
        TILES_PER_SIDE.pow(level as u32 + 1)
    }

    /// The smallest depth in a tile, m; `None` beyond the picture.
    fn nearest(&self, level: usize, [column, row]: [usize; 2]) -> Option<f64> {
        let minima = &self.0[level];
        (column < minima.width() && row < minima.height()).then(|| f64::from(minima.at(column, row)[0]))
    }
}

/// The tiles along a ray.
pub(super) struct TileWalk<'a> {
    pyramid: &'a DepthPyramid,
    ray: &'a ScreenRay,
    /// Number of samples of the ray.
    count: usize,
    /// The level of the next tile.
    level: usize,
    /// The last sample of the small tile that the ray may be behind something in.
    unknown_until: usize,
}

impl<'a> TileWalk<'a> {
    /// The tiles along a ray of `count` samples.
    pub(super) fn new(pyramid: &'a DepthPyramid, ray: &'a ScreenRay, count: usize) -> Self {
        Self { pyramid, ray, count, level: 0, unknown_until: 0 }
    }

    /// The last sample up to which, from `first` on, all are in one tile and in front of everything in it. `None` if that is not known of any tile.
    pub(super) fn last_in_front(&mut self, first: usize) -> Option<usize> {
        let Self { pyramid, ray, count, .. } = *self;
        let depth_increases = ray.depth > 0.0;
        if first <= self.unknown_until || !depth_increases {
            return None;
        }
        let pixel = ray.pixel(first as f64 / count as f64);
        loop {
            let side = DepthPyramid::side(self.level);
            let tile = [pixel.x, pixel.y].map(|value| value as usize / side);
            let nearest = pyramid.nearest(self.level, tile)?;
            let last = ray.last_in_tile(side, tile, first, count);
            if ray.depth(last as f64 / count as f64) <= nearest {
                self.level = (self.level + 1).min(LEVELS - 1);
                return Some(last);
            }
            if self.level == 0 {
                self.unknown_until = last;
                return None;
            }
            self.level -= 1;
        }
    }
}

/// The minima of square tiles of a picture.
fn minima(fine: &Image<1>) -> Image<1> {
    let [width, height] = [fine.width(), fine.height()].map(|side| side.div_ceil(TILES_PER_SIDE));
    let mut coarse = Image::filled(width, height, [f32::INFINITY]);
    coarse.pixels_mut().par_chunks_mut(width.max(1)).enumerate().for_each(|(row, tiles)| {
        for y in row * TILES_PER_SIDE..((row + 1) * TILES_PER_SIDE).min(fine.height()) {
            for (tile, pixels) in tiles.iter_mut().zip(fine.row(y).chunks(TILES_PER_SIDE)) {
                tile[0] = pixels.iter().fold(tile[0], |nearest, pixel| nearest.min(pixel[0]));
            }
        }
    });
    coarse
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_has_the_smallest_depth_in_it() {
        let (width, height) = (70, 19);
        let mut depth = Image::filled(width, height, [f32::NAN]);
        for (index, pixel) in depth.pixels_mut().iter_mut().enumerate().skip(3) {
            pixel[0] = ((index * 7919) % 1009) as f32;
        }
        let pyramid = DepthPyramid::new(&depth);
        for level in 0..LEVELS {
            let side = DepthPyramid::side(level);
            for tile in
                (0..height.div_ceil(side)).flat_map(|row| (0..width.div_ceil(side)).map(move |column| [column, row]))
            {
                let [xs, ys] =
                    [(tile[0], width), (tile[1], height)].map(|(tile, end)| tile * side..((tile + 1) * side).min(end));
                let pixels = ys.flat_map(|y| xs.clone().map(move |x| (x, y)));
                let nearest = pixels.map(|(x, y)| depth.at(x, y)[0]).fold(f32::INFINITY, f32::min);
                assert_eq!(pyramid.nearest(level, tile), Some(f64::from(nearest)), "{level} {tile:?}");
            }
        }
    }
}
