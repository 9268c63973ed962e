//! The smallest depths of a plate in square tiles, and the traversal of these tiles by a reflected ray: Hi-Z ray marching (Uludag 2014, "Hi-Z
//! Screen-Space Cone-Traced Reflections"). Where a ray is nearer than the smallest depth in a tile, no sample of it within the tile can be a hit.

use bansho_base::{host::parallel::prelude::*, image::Image, math::DVec2};

/// Side of a tile, in tiles of the level before; on the first level, in pixels.
const TILES_PER_SIDE: usize = 4;
/// Levels of the pyramid: tiles of 4, 16 and 64 pixels.
const LEVELS: usize = 3;

/// The smallest depth in each tile, m, by level.
pub(super) struct DepthPyramid([Image<1>; LEVELS]);

impl DepthPyramid {
    /// The pyramid of a plate's depth. Pixels of unknown depth (NaN) are left out, since they are never a hit.
    pub(super) fn new(depth: &Image<1>) -> Self {
        let small = smallest_in_tiles(depth);
        let medium = smallest_in_tiles(&small);
        let large = smallest_in_tiles(&medium);
        Self([small, medium, large])
    }

    /// Side of the tiles of a level, pixels.
    fn side(level: usize) -> usize {
        TILES_PER_SIDE.pow(level as u32 + 1)
    }

    /// The smallest depth in a tile, m; `None` outside the picture.
    fn smallest(&self, level: usize, [column, row]: [usize; 2]) -> Option<f64> {
        let tiles = &self.0[level];
        (column < tiles.width() && row < tiles.height()).then(|| f64::from(tiles.at(column, row)[0]))
    }
}

/// The traversal of tiles by a ray.
pub(super) struct TileTraversal<'a> {
    pyramid: &'a DepthPyramid,
    ray: &'a ScreenRay,
    /// Number of samples of the ray.
    samples: usize,
    /// The level of the next tile.
    level: usize,
    /// The last sample in a tile of the first level in which there may be a hit.
    last_possible_hit: usize,
}

impl<'a> TileTraversal<'a> {
    /// The traversal of tiles by a ray with this number of samples.
    pub(super) fn new(pyramid: &'a DepthPyramid, ray: &'a ScreenRay, samples: usize) -> Self {
        Self { pyramid, ray, samples, level: 0, last_possible_hit: 0 }
    }

    /// The last sample that is in the same tile as sample `first`, if no sample from `first` to that one can be a hit. `None` if one can be, and for
    /// the other samples in that tile.
    pub(super) fn skip(&mut self, first: usize) -> Option<usize> {
        let Self { pyramid, ray, samples, .. } = *self;
        let depth_increases = ray.depth > 0.0;
        if first <= self.last_possible_hit || !depth_increases {
            return None;
        }
        let pixel = ray.pixel(parameter(first, samples));
        loop {
            let side = DepthPyramid::side(self.level);
            let tile = [pixel.x, pixel.y].map(|value| value as usize / side);
            let smallest = pyramid.smallest(self.level, tile)?;
            let last = ray.last_in_tile(side, tile, first, samples);
            if ray.depth(parameter(last, samples)) <= smallest {
                self.level = (self.level + 1).min(LEVELS - 1);
                return Some(last);
            }
            if self.level == 0 {
                self.last_possible_hit = last;
                return None;
            }
            self.level -= 1;
        }
    }
}

/// The smallest value in each tile of a picture.
fn smallest_in_tiles(fine: &Image<1>) -> Image<1> {
    let [width, height] = [fine.width(), fine.height()].map(|side| side.div_ceil(TILES_PER_SIDE));
    let mut coarse = Image::filled(width, height, [f32::INFINITY]);
    coarse.pixels_mut().par_chunks_mut(width.max(1)).enumerate().for_each(|(row, tiles)| {
        for y in row * TILES_PER_SIDE..((row + 1) * TILES_PER_SIDE).min(fine.height()) {
            for (tile, pixels) in tiles.iter_mut().zip(fine.row(y).chunks(TILES_PER_SIDE)) {
                tile[0] = pixels.iter().fold(tile[0], |smallest, pixel| smallest.min(pixel[0]));
            }
        }
    });
    coarse
}

/// A ray in the picture of a perspective camera, where it is straight: its pixel at parameter t is `origin + t * step`, and its depth `depth / (1 - t)`. The
/// parameter goes from 0 at the mirror to 1 at infinity.
pub(super) struct ScreenRay {
    pub(super) origin: DVec2,
    pub(super) step: DVec2,
    /// Depth at the origin, m.
    pub(super) depth: f64,
}

/// The parameter t of a sample of a ray.
pub(super) fn parameter(sample: usize, samples: usize) -> f64 {
    sample as f64 / samples as f64
}

impl ScreenRay {
    pub(super) fn pixel(&self, t: f64) -> DVec2 {
        self.origin + self.step * t
    }

    pub(super) fn depth(&self, t: f64) -> f64 {
        self.depth / (1.0 - t)
    }

    /// The last sample that is in the same tile, of this side in pixels, as sample `first`. Coordinates are monotonic from sample to sample, even
    /// rounded, so all samples between the two are in the tile.
    pub(super) fn last_in_tile(&self, side: usize, tile: [usize; 2], first: usize, samples: usize) -> usize {
        let [columns, rows] = tile.map(|index| [index * side, (index + 1) * side].map(|edge| edge as f64));
        let exit =
            exit_parameter(columns, self.origin.x, self.step.x).min(exit_parameter(rows, self.origin.y, self.step.y));
        let mut last = ((exit * samples as f64) as usize).min(samples - 1);
        // The exit is rounded too, and the edge itself may be outside.
        while last > first {
            let pixel = self.pixel(parameter(last, samples));
            if (columns[0]..columns[1]).contains(&pixel.x) && (rows[0]..rows[1]).contains(&pixel.y) {
                break;
            }
            last -= 1;
        }
        last.max(first)
    }
}

/// The parameter at which a coordinate leaves an interval; 1 if it never does.
fn exit_parameter([lower, upper]: [f64; 2], origin: f64, step: f64) -> f64 {
    if step == 0.0 {
        return 1.0;
    }
    let edge = if step > 0.0 { upper } else { lower };
    (edge - origin) / step
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
            let [columns, rows] = [width, height].map(|pixels| pixels.div_ceil(side));
            let mut expected = vec![f32::INFINITY; columns * rows];
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let tile = &mut expected[y / side * columns + x / side];
                *tile = tile.min(depth.at(x, y)[0]);
            }
            for (index, expected) in expected.iter().enumerate() {
                let tile = [index % columns, index / columns];
                assert_eq!(pyramid.smallest(level, tile), Some(f64::from(*expected)), "{level} {tile:?}");
            }
            assert_eq!(pyramid.smallest(level, [columns, 0]), None);
        }
    }

    /// A ray before a distant wall is sampled once in each large tile, and pixel by pixel only in the small tile of a near post.
    #[test]
    fn a_ray_is_sampled_only_where_it_may_hit() {
        const SAMPLES: usize = 4000;
        let mut depth = Image::filled(1024, 1024, [100.0]);
        depth.row_mut(700)[(501.0 - 0.05 * 700.0) as usize] = [2.0];
        let pyramid = DepthPyramid::new(&depth);
        let ray = ScreenRay { origin: DVec2::new(450.5, 1010.5), step: DVec2::new(50.0, -1000.0), depth: 4.0 };
        let mut traversal = TileTraversal::new(&pyramid, &ray, SAMPLES);
        let (mut sample, mut taken, mut one_by_one) = (0, 0, 0);
        // Up to 80 m.
        while sample < SAMPLES * 19 / 20 {
            sample += 1;
            let last = traversal.skip(sample);
            one_by_one += usize::from(last.is_none());
            sample = last.unwrap_or(sample);
            taken += 1;
        }
        // 15 rows of large tiles, with a step to the next column, and smaller ones at the beginning and around the post.
        assert!(taken < 80, "{taken}");
        assert!((10..40).contains(&one_by_one), "{one_by_one}");
    }
}
