//! Streak textures for drawing: small numbers in 16 bits, and smaller pictures for distant billboards.

use bansho_base::image::Image;
use fearless_simd::{Level, dispatch};

/// One size of a texture.
#[derive(Clone, Debug, PartialEq)]
pub struct MipLevel {
    /// Pixels on a side.
    pub size: usize,
    /// Opacity of one unit of [`texels`](Self::texels).
    pub scale: f32,
    /// Opacities in units of `scale`, rows from the top.
    pub texels: Vec<u16>,
}

/// A streak texture and its halvings. Streaks hide a hundredth of a pixel and less: each level has a scale of its own, so that all
/// of 16 bits count; the error is at most 2^-17 of the level's largest opacity.
///
/// A pixel of a smaller level is the mean of four of the larger. What a pixel hides is the mean of what its parts hide,
/// overlaps included, so the mean opacity is the same at every level.
#[derive(Clone, Debug, PartialEq)]
pub struct StreakTexture {
    /// From the full size on, each half the size of the one before, as long as sizes are even.
    pub levels: Vec<MipLevel>,
}

impl StreakTexture {
    /// A texture of opacities, as wide as high.
    pub fn new(image: &Image<1>) -> Self {
        let (level, mut size) = (Level::new(), image.width());
        let quantised = |size: usize, values: &[f32]| dispatch!(level, _simd => MipLevel::new(size, values));
        let mut levels = vec![quantised(size, image.pixels().as_flattened())];
        let mut larger = Vec::new();
        while size > 1 && size.is_multiple_of(2) {
            let values = if larger.is_empty() { image.pixels().as_flattened() } else { &larger };
            let smaller = dispatch!(level, _simd => halved(size, values));
            size /= 2;
            levels.push(quantised(size, &smaller));
            larger = smaller;
        }
        Self { levels }
    }

    /// Mean opacity.
    pub fn mean(&self) -> f64 {
        let MipLevel { scale, texels, .. } = &self.levels[0];
        f64::from(*scale) * texels.iter().map(|&texel| f64::from(texel)).sum::<f64>() / texels.len().max(1) as f64
    }
}

impl MipLevel {
    #[inline(always)]
    fn new(size: usize, values: &[f32]) -> Self {
        let largest = largest(values);
        let units = if largest > 0.0 { f32::from(u16::MAX) / largest } else { 0.0 };
        let mut texels = vec![0; values.len()];
        texels.iter_mut().zip(values).for_each(|(texel, &value)| *texel = (value * units + 0.5) as u16);
        Self { size, scale: largest / f32::from(u16::MAX), texels }
    }

    /// Opacity of the pixel at column `x`, row `y`, both taken around the edges.
    pub fn at(&self, x: i64, y: i64) -> f32 {
        let [x, y] = [x, y].map(|place| place.rem_euclid(self.size as i64) as usize);
        self.scale * f32::from(self.texels[y * self.size + x])
    }
}

/// The largest of values, none of which is below 0.
#[inline(always)]
fn largest(values: &[f32]) -> f32 {
    let (chunks, rest) = values.as_chunks::<16>();
    let greater = |a: f32, b: f32| if a > b { a } else { b };
    let lanes = chunks.iter().fold([0.0_f32; 16], |mut lanes, chunk| {
        (0..16).for_each(|i| lanes[i] = greater(lanes[i], chunk[i]));
        lanes
    });
    lanes.into_iter().chain(rest.iter().copied()).fold(0.0, greater)
}

/// The means of each two by two.
#[inline(always)]
fn halved(size: usize, values: &[f32]) -> Vec<f32> {
    let mut means = vec![0.0; values.len() / 4];
    for (row, pair) in means.chunks_exact_mut(size / 2).zip(values.chunks_exact(2 * size)) {
        let (upper, lower) = pair.split_at(size);
        let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
        for (mean, (upper, lower)) in row.iter_mut().zip(pairs) {
            *mean = 0.25 * ((upper[0] + upper[1]) + (lower[0] + lower[1]));
        }
    }
    means
}
