//! A picture as the texture: its gray levels, resampled to the size of the table.

use bansho_base::host::assets::Picture;

use super::{COLUMNS, ROWS};

/// Weights of red, green and blue in a gray level (Rec. 709); a gray picture keeps its values.
const GRAY_WEIGHTS: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// The texels of a picture, from its lower left corner. The values are those of the file: codes as fractions of the largest one, or the numbers of an EXR file.
/// They are limited to [0, 1], since T must lie there; NaN is 0. Transparent pixels are 0.
pub(crate) fn picture_texels(picture: &Picture) -> Vec<f32> {
    let (width, height) = (picture.color.width(), picture.color.height());
    let gray_level = |[r, g, b, a]: [f32; 4]| {
        let level = r * GRAY_WEIGHTS[0] + g * GRAY_WEIGHTS[1] + b * GRAY_WEIGHTS[2];
        let level = picture.alpha.premultiplied([level, 0.0, 0.0, a])[0];
        // NaN is not above 0.
        if level > 0.0 { level.min(1.0) } else { 0.0 }
    };
    let levels: Vec<f32> = picture.color.iter().map(gray_level).collect();
    let columns = resampling_taps(width, COLUMNS);
    let mut narrow = vec![0.0; COLUMNS * height];
    for (row, resampled) in levels.chunks_exact(width).zip(narrow.chunks_exact_mut(COLUMNS)) {
        for (value, taps) in resampled.iter_mut().zip(&columns) {
            *value = taps.iter().map(|(pixel, weight)| row[*pixel] * weight).sum();
        }
    }
    let mut texels = vec![0.0; COLUMNS * ROWS];
    for (resampled, taps) in texels.chunks_exact_mut(COLUMNS).zip(resampling_taps(height, ROWS)) {
        for (pixel, weight) in taps {
            // Rows of a picture count from the top, those of the table from the bottom.
            let row = &narrow[(height - 1 - pixel) * COLUMNS..][..COLUMNS];
            resampled.iter_mut().zip(row).for_each(|(value, level)| *value += weight * level);
        }
    }
    texels
}

/// For each of `count` texels along an axis, the pixels of a cyclic row of `length` that it is the mean of, and their weights: a triangle filter whose radius
/// is the larger side of a texel and a pixel.
fn resampling_taps(length: usize, count: usize) -> Vec<Vec<(usize, f32)>> {
    let pixels_per_texel = length as f64 / count as f64;
    let radius = pixels_per_texel.max(1.0);
    let taps_of = |texel: usize| {
        // The table's lookups are exact at texels, and a texel is at its lower bound; a pixel is at its center.
        let center = texel as f64 * pixels_per_texel - 0.5;
        let first = (center - radius).ceil() as i64;
        let last = (center + radius).floor() as i64;
        let weights: Vec<f64> = (first..=last).map(|pixel| 1.0 - (pixel as f64 - center).abs() / radius).collect();
        let total: f64 = weights.iter().sum();
        let cyclic = (first..=last).map(|pixel| pixel.rem_euclid(length as i64) as usize);
        cyclic.zip(weights).map(|(pixel, weight)| (pixel, (weight / total) as f32)).collect()
    };
    (0..count).map(taps_of).collect()
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        host::assets::{Encoding, PictureAlpha},
        image::Image,
    };

    use super::*;

    fn gray(size: [usize; 2], level: impl Fn(usize, usize) -> f32) -> Picture {
        let pixels = (0..size[0] * size[1]).map(|index| {
            let level = level(index % size[0], index / size[0]);
            [level, level, level, 1.0]
        });
        Picture::opaque(Image::from_pixels(size[0], size[1], pixels.collect()).unwrap(), Encoding::DisplaySrgb)
    }

    #[test]
    fn a_picture_of_the_tables_size_is_the_mean_of_neighboring_pixels() {
        // Texels lie at corners of pixels, halfway between their centers.
        let level = |x: usize, y: usize| ((x * 7 + y * 13) % 31) as f32 / 31.0;
        let texels = picture_texels(&gray([COLUMNS, ROWS], level));
        for (column, row) in [(0, 0), (5, 9), (255, 511), (100, 0)] {
            let columns = [column, (column + COLUMNS - 1) % COLUMNS];
            let rows = [row, (row + ROWS - 1) % ROWS].map(|row| ROWS - 1 - row);
            let mean = columns.iter().flat_map(|x| rows.map(|y| 0.25 * level(*x, y))).sum::<f32>();
            assert!((texels[row * COLUMNS + column] - mean).abs() < 1e-6, "{column} {row}");
        }
    }

    #[test]
    fn pictures_of_any_size_keep_their_mean() {
        for size in [[1, 1], [3, 7], [100, 40], [1000, 1500]] {
            let picture = gray(size, |x, y| ((x * 5 + y * 3) % 11) as f32 / 11.0);
            let mean =
                |values: &mut dyn Iterator<Item = f32>, count: usize| values.map(f64::from).sum::<f64>() / count as f64;
            let before = mean(&mut picture.color.iter().map(|pixel| pixel[0]), size[0] * size[1]);
            let texels = picture_texels(&picture);
            let after = mean(&mut texels.iter().copied(), texels.len());
            assert!((before - after).abs() < 2e-3, "{size:?}: {before} {after}");
            assert!(texels.iter().all(|texel| (0.0..=1.0).contains(texel)), "{size:?}");
        }
    }

    #[test]
    fn values_outside_0_and_1_are_limited_and_transparent_pixels_are_0() {
        let mut picture = gray([2, 2], |x, _| [f32::NAN, 7.0][x]);
        let values = picture_texels(&picture);
        assert!(values.iter().all(|value| (0.0..=1.0).contains(value)) && values.contains(&0.5), "half of each");
        picture.alpha = PictureAlpha::Associated;
        picture.color = Image::filled(picture.color.width(), picture.color.height(), [0.0; 4]).into();
        assert!(picture_texels(&picture).iter().all(|value| *value == 0.0));
    }
}
