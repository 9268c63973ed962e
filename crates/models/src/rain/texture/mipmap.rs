//! Streak textures for drawing: small numbers in 16 bits, and smaller pictures for distant billboards.

use bansho_base::image::Image;

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
        let mut values: Vec<f32> = image.pixels().as_flattened().to_vec();
        let mut size = image.width();
        let mut levels = vec![MipLevel::new(size, &values)];
        while size > 1 && size.is_multiple_of(2) {
            values = halved(size, &values);
            size /= 2;
            levels.push(MipLevel::new(size, &values));
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
    fn new(size: usize, values: &[f32]) -> Self {
        let largest = values.iter().fold(0.0_f32, |largest, &value| largest.max(value));
        let units = if largest > 0.0 { f32::from(u16::MAX) / largest } else { 0.0 };
        let texels = values.iter().map(|&value| value.mul_add(units, 0.5) as u16).collect();
        Self { size, scale: largest / f32::from(u16::MAX), texels }
    }

    /// Opacity of the pixel at column `x`, row `y`, both taken around the edges.
    pub fn at(&self, x: i64, y: i64) -> f32 {
        let [x, y] = [x, y].map(|place| place.rem_euclid(self.size as i64) as usize);
        self.scale * f32::from(self.texels[y * self.size + x])
    }
}

/// The means of each two by two.
fn halved(size: usize, values: &[f32]) -> Vec<f32> {
    let rows = values.chunks_exact(2 * size).map(|pair| pair.split_at(size));
    let row = |(upper, lower): (&[f32], &[f32])| -> Vec<f32> {
        let pairs = upper.chunks_exact(2).zip(lower.chunks_exact(2));
        pairs.map(|(upper, lower)| 0.25 * ((upper[0] + upper[1]) + (lower[0] + lower[1]))).collect()
    };
    rows.flat_map(row).collect()
}
