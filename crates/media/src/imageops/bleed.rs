//! Colors under transparent pixels of straight alpha. A sampler that interpolates color and alpha apart mixes them into the pixels beside them: black would
//! be a dark fringe.

use bansho_base::{
    color::{AlphaConvention, decode_srgb, decode_srgb8, encode_srgb},
    frame::{DisplayEncoding, DisplayImage, DisplayPixels},
};

/// Pixels beside visible ones that get a color: more than one, so that smaller copies of the picture (mipmaps) have no fringe either.
const RINGS: usize = 8;
/// Weight of a diagonal neighbor.
const DIAGONAL: f32 = 0.5;

/// Gives pixels of alpha 0 near visible ones the mean color of their neighbors, weighted by alpha. It is the mean of what the picture's
/// [`AlphaConvention`] blends. Visible pixels and all alphas are unchanged, and so is an opaque picture.
pub fn bleed_colors(picture: &mut DisplayImage) {
    if picture.opaque {
        return;
    }
    let size = [picture.width, picture.height];
    let is_encoded = picture.encoding == DisplayEncoding::Srgb && picture.alpha == AlphaConvention::Linear;
    match (&mut picture.pixels, is_encoded) {
        (DisplayPixels::Eight(pixels), true) => {
            bleed(pixels, size, decode_srgb8, |light| encode_srgb(light).mul_add(255.0, 0.5) as u8);
        }
        (DisplayPixels::Eight(pixels), false) => bleed(pixels, size, f32::from, |value| (value + 0.5) as u8),
        (DisplayPixels::Sixteen(pixels), true) => bleed(
            pixels,
            size,
            |code| decode_srgb(f32::from(code) / 65_535.0),
            |light| encode_srgb(light).mul_add(65_535.0, 0.5) as u16,
        ),
        (DisplayPixels::Sixteen(pixels), false) => bleed(pixels, size, f32::from, |value| (value + 0.5) as u16),
    }
}

/// A sum of colors and of their weights.
#[derive(Clone, Copy, Default)]
struct ColorSum {
    sum: [f32; 3],
    weight: f32,
}

/// `value` converts a code to what is averaged, `code` back.
fn bleed<T: Copy + PartialEq + Default>(
    pixels: &mut [[T; 4]],
    size: [usize; 2],
    value: impl Fn(T) -> f32,
    code: impl Fn(f32) -> T,
) where
    f32: From<T>,
{
    let mut is_colored: Vec<bool> = pixels.iter().map(|[.., alpha]| *alpha != T::default()).collect();
    let mut ring: Vec<usize> = (0..pixels.len())
        .filter(|index| !is_colored[*index] && neighbors(*index, size).any(|(near, _)| is_colored[near]))
        .collect();
    for _ in 0..RINGS {
        // All colors of a ring are computed from those inside it before any is set, so that the order of pixels does not matter.
        let mut colors = Vec::with_capacity(ring.len());
        for &index in &ring {
            let mut total = ColorSum::default();
            for (near, weight) in neighbors(index, size).filter(|(near, _)| is_colored[*near]) {
                let [color @ .., alpha] = pixels[near];
                // Those that were colored before have no alpha: each counts as one.
                let weight = if alpha == T::default() { weight } else { weight * f32::from(alpha) };
                (0..3).for_each(|c| total.sum[c] += weight * value(color[c]));
                total.weight += weight;
            }
            colors.push(total.sum.map(|sum| code(sum / total.weight)));
        }
        for (&index, [r, g, b]) in ring.iter().zip(colors) {
            pixels[index] = [r, g, b, T::default()];
            is_colored[index] = true;
        }
        let mut next: Vec<usize> = ring
            .iter()
            .flat_map(|&index| neighbors(index, size))
            .filter_map(|(near, _)| (!is_colored[near]).then_some(near))
            .collect();
        next.sort_unstable();
        next.dedup();
        ring = next;
    }
}

/// The pixels around a pixel, with their weights.
fn neighbors(index: usize, [width, height]: [usize; 2]) -> impl Iterator<Item = (usize, f32)> {
    let (x, y) = (index % width, index / width);
    let columns = x.saturating_sub(1)..(x + 2).min(width);
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    let around = rows.flat_map(move |row| columns.clone().map(move |column| (column, row)));
    around.filter(move |position| *position != (x, y)).map(move |(column, row)| {
        let weight = if column == x || row == y { 1.0 } else { DIAGONAL };
        (row * width + column, weight)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 40;

    /// A soft disk of one hue, whose edge ends in pixels of alpha 0, as it is written: black where alpha is 0.
    fn disk(alpha: AlphaConvention) -> DisplayImage {
        let pixel = |index: usize| {
            let [x, y] = [index % WIDTH, index / WIDTH].map(|side| side as f32 - 19.3);
            let coverage = (12.0 - (x * x + y * y).sqrt()).clamp(0.0, 2.0) / 2.0;
            let alpha = (coverage * 255.0).round() as u8;
            if alpha == 0 { [0; 4] } else { [250, 160, 40, alpha] }
        };
        let pixels = DisplayPixels::Eight((0..WIDTH * WIDTH).map(pixel).collect());
        DisplayImage { width: WIDTH, height: WIDTH, opaque: false, alpha, encoding: DisplayEncoding::Srgb, pixels }
    }

    fn codes(picture: &DisplayImage) -> &[[u8; 4]] {
        let DisplayPixels::Eight(pixels) = &picture.pixels else { panic!("8 bits") };
        pixels
    }

    /// The largest difference, in codes, of a picture enlarged four times by bilinear sampling of straight values from that of premultiplied ones.
    fn fringe(picture: &DisplayImage) -> f32 {
        let decode = |code: u8| match picture.alpha {
            AlphaConvention::Linear => decode_srgb8(code),
            AlphaConvention::Encoded => f32::from(code) / 255.0,
        };
        let values: Vec<[f32; 4]> = codes(picture)
            .iter()
            .map(|&[r, g, b, a]| [decode(r), decode(g), decode(b), f32::from(a) / 255.0])
            .collect();
        let mut worst = 0.0_f32;
        for step in 0..(4 * (WIDTH - 1)) * (4 * (WIDTH - 1)) {
            let [x, y] = [step % (4 * (WIDTH - 1)), step / (4 * (WIDTH - 1))];
            let fractions = [x, y].map(|side| (side % 4) as f32 / 4.0);
            let mut straight = [0.0; 4];
            let mut premultiplied = [0.0; 3];
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let weight = [(dx, fractions[0]), (dy, fractions[1])]
                    .map(|(near, fraction)| if near == 1 { fraction } else { 1.0 - fraction });
                let weight = weight[0] * weight[1];
                let value = values[(y / 4 + dy) * WIDTH + x / 4 + dx];
                (0..4).for_each(|c| straight[c] += weight * value[c]);
                (0..3).for_each(|c| premultiplied[c] += weight * value[c] * value[3]);
            }
            for c in 0..3 {
                worst = worst.max((straight[c] * straight[3] - premultiplied[c]).abs() * 255.0);
            }
        }
        worst
    }

    #[test]
    fn an_enlarged_edge_has_no_dark_fringe() {
        for alpha in [AlphaConvention::Linear, AlphaConvention::Encoded] {
            let mut picture = disk(alpha);
            let before = fringe(&picture);
            bleed_colors(&mut picture);
            let after = fringe(&picture);
            assert!(before > 20.0 && after < 1.0, "{alpha:?}: {before} becomes {after}");
        }
    }

    #[test]
    fn visible_pixels_and_alpha_are_unchanged_and_what_is_far_stays_empty() {
        let plain = disk(AlphaConvention::Linear);
        let mut bled = plain.clone();
        bleed_colors(&mut bled);
        for (before, after) in codes(&plain).iter().zip(codes(&bled)) {
            assert!(before == after || before[3] == 0 && after[3] == 0, "{before:?} {after:?}");
        }
        assert_eq!(codes(&bled)[0], [0; 4], "a corner is more than eight pixels away");
        assert_eq!(codes(&bled)[19 * WIDTH + 3][3], 0);
        assert_ne!(codes(&bled)[19 * WIDTH + 3], [0; 4], "four pixels beside the disk");
    }

    #[test]
    fn a_color_is_the_mean_of_what_is_blended() {
        let picture = |alpha, bits: u16| {
            let pixels = vec![[255, 0, 0, 100], [0, 0, 0, 0], [0, 255, 0, 100], [0, 0, 0, 0], [0, 0, 0, 0]];
            let wide = pixels.iter().map(|pixel: &[u8; 4]| pixel.map(|code| u16::from(code) * 257)).collect();
            let pixels = if bits == 8 { DisplayPixels::Eight(pixels) } else { DisplayPixels::Sixteen(wide) };
            let mut picture =
                DisplayImage { width: 5, height: 1, opaque: false, alpha, encoding: DisplayEncoding::Srgb, pixels };
            bleed_colors(&mut picture);
            picture
        };
        // Half of full light is code 188; half of the codes, 128.
        let linear = picture(AlphaConvention::Linear, 8);
        assert_eq!(codes(&linear)[1..], [[188, 188, 0, 0], [0, 255, 0, 100], [0, 255, 0, 0], [0, 255, 0, 0]]);
        assert_eq!(codes(&picture(AlphaConvention::Encoded, 8))[1], [128, 128, 0, 0]);
        let DisplayPixels::Sixteen(wide) = picture(AlphaConvention::Linear, 16).pixels else { panic!("16 bits") };
        assert!(wide[1][0].abs_diff(188 * 257) < 257 && wide[1][3] == 0 && wide[3] == [0, 65_535, 0, 0]);
        let empty = DisplayImage { pixels: DisplayPixels::Eight(vec![[0; 4]; 5]), ..linear };
        let mut bled = empty.clone();
        bleed_colors(&mut bled);
        assert_eq!(bled, empty);
    }
}
