//! Pictures sampled at sixteen positions.

use bansho_base::{
    image::Image,
    math::{
        approximations,
        simd::{FourLanes, LANES, Real},
    },
};
use fearless_simd::prelude::*;

/// A picture of which some rows are missing, in pixels of another size than those in which positions are given.
#[derive(Clone, Copy, Debug)]
pub(super) struct SampledImage<'a> {
    pub(super) image: &'a Image<4>,
    /// Side of one of its pixels in the unit of positions.
    pub(super) pixel_size: usize,
    /// Rows of such pixels above the first one of `image`.
    pub(super) first_row: usize,
}

impl SampledImage<'_> {
    /// Red, green and blue at positions from the left and top edges, by bilinear interpolation between pixel centers. Positions beyond the outermost
    /// centers are clamped to them; NaN becomes 0. See [`Image::sample_bilinear`].
    #[inline(always)]
    pub(super) fn at<S: Simd>(&self, simd: S, xs: &[f32; LANES], ys: &[f32; LANES]) -> [[f32; LANES]; 3] {
        let mut planes = [[0.0; LANES]; 3];
        let (width, height) = (self.image.width(), self.image.height());
        if width == 0 || height == 0 {
            return planes;
        }
        let scale = 1.0 / self.pixel_size as f32;
        let above = -0.5 - self.first_row as f32;
        for i in 0..LANES {
            let (column, across) = split(xs[i].fma(scale, -0.5), width);
            let (row, down) = split(ys[i].fma(scale, above), height);
            let right = (column + 1).min(width - 1);
            let (upper, lower) = (self.image.row(row), self.image.row((row + 1).min(height - 1)));
            let (across, down) = (FourLanes::splat(simd, across), FourLanes::splat(simd, down));
            let upper_left = FourLanes::from_slice(simd, &upper[column]);
            let upper_right = FourLanes::from_slice(simd, &upper[right]);
            let lower_left = FourLanes::from_slice(simd, &lower[column]);
            let lower_right = FourLanes::from_slice(simd, &lower[right]);
            let upper = across.fma(upper_right - upper_left, upper_left);
            let lower = across.fma(lower_right - lower_left, lower_left);
            let color: [f32; 4] = down.fma(lower - upper, upper).into();
            for c in 0..3 {
                planes[c][i] = color[c];
            }
        }
        planes
    }
}

/// The pixel below a coordinate, clamped to `count` pixels, and the fraction of the way to the next one.
#[inline(always)]
fn split(coordinate: f32, count: usize) -> (usize, f32) {
    let last = (count - 1) as f32;
    let coordinate = coordinate.simd_max(0.0).simd_min(last);
    let whole = coordinate.floor();
    (approximations::round_to_i32(whole) as usize, coordinate - whole)
}

#[cfg(test)]
mod tests {
    use bansho_base::math::DVec2;

    use super::*;

    #[test]
    fn sixteen_positions_are_sampled_as_each() {
        let pixels = (0..20 * 12_u16).map(|i| [f32::from(i * i % 97), f32::from(i), f32::from(i % 7), 1.0]).collect();
        let whole = Image::from_pixels(20, 12, pixels).unwrap();
        let rows = whole.crop(bansho_base::image::Rect { x: 0, y: 4, width: 20, height: 8 }).unwrap();
        let mut xs: [f32; LANES] = std::array::from_fn(|i| 2.9 * i as f32 - 1.0);
        let ys: [f32; LANES] = std::array::from_fn(|i| 10.0 + 0.8 * i as f32);
        xs[15] = 1e30;
        let sampled = SampledImage { image: &rows, pixel_size: 2, first_row: 4 };
        let planes = bansho_base::dispatch_baseline!(simd => sampled.at(simd, &xs, &ys));
        for i in 0..LANES {
            let exact = whole.sample_bilinear(DVec2::new(f64::from(xs[i]), f64::from(ys[i])) / 2.0);
            for c in 0..3 {
                assert!(
                    (planes[c][i] - exact[c]).abs() < 1e-3 * exact[c].max(1.0),
                    "{i} {c}: {} {exact:?}",
                    planes[c][i]
                );
            }
        }
    }
}
