//! Frame numbers drawn into pictures for viewing, such as the cells of a contact sheet.

use bansho_base::frame::{DisplayImage, DisplayPixels};

/// Columns and rows of a glyph.
const GLYPH: [usize; 2] = [5, 7];

/// Bitmaps of the digits and the minus sign: rows from the top, the leftmost column in the highest of five bits.
const GLYPHS: [[u8; 7]; 11] = [
    [0b01110, 0b10001, 0b10011, 0b10101, 0b11001, 0b10001, 0b01110],
    [0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110],
    [0b01110, 0b10001, 0b00001, 0b00010, 0b00100, 0b01000, 0b11111],
    [0b11111, 0b00010, 0b00100, 0b00010, 0b00001, 0b10001, 0b01110],
    [0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010],
    [0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110],
    [0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110],
    [0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b01000, 0b01000],
    [0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110],
    [0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100],
    [0b00000, 0b00000, 0b00000, 0b11111, 0b00000, 0b00000, 0b00000],
];

/// Black border around the glyphs, dots.
const MARGIN: usize = 1;

/// Draws `number` into the top left corner of `picture`, white on black. Its height is about a sixteenth of the picture's, at most an eighth. It
/// is left out where it would be illegible or does not fit.
pub fn draw_number(picture: &mut DisplayImage, number: i64) {
    let glyphs: Vec<usize> =
        number.to_string().bytes().map(|byte| usize::from(byte.wrapping_sub(b'0')).min(10)).collect();
    let dots = dots(&glyphs);
    let Some(scale) = scale(dots, [picture.width, picture.height]) else { return };
    let width = picture.width;
    let size = dots.map(|dots| dots * scale);
    match &mut picture.pixels {
        DisplayPixels::Eight(pixels) => {
            fill(pixels, width, size, [u8::MAX; 4], |x, y| is_lit(&glyphs, x / scale, y / scale));
        }
        DisplayPixels::Sixteen(pixels) => {
            fill(pixels, width, size, [u16::MAX; 4], |x, y| is_lit(&glyphs, x / scale, y / scale));
        }
    }
}

/// Columns and rows of dots of a label.
fn dots(glyphs: &[usize]) -> [usize; 2] {
    [glyphs.len() * (GLYPH[0] + 1) - 1 + 2 * MARGIN, GLYPH[1] + 2 * MARGIN]
}

/// Pixels for each dot.
fn scale([columns, rows]: [usize; 2], [width, height]: [usize; 2]) -> Option<usize> {
    let max = (height / (8 * rows)).min(width / columns);
    // A sixteenth of the height, rounded.
    let default = (height + 8 * rows) / (16 * rows);
    (max > 0).then(|| default.clamp(1, max))
}

/// Whether a dot belongs to a glyph.
fn is_lit(glyphs: &[usize], column: usize, row: usize) -> bool {
    let (Some(column), Some(row)) = (column.checked_sub(MARGIN), row.checked_sub(MARGIN)) else { return false };
    let (index, column) = (column / (GLYPH[0] + 1), column % (GLYPH[0] + 1));
    match glyphs.get(index) {
        Some(&glyph) if row < GLYPH[1] && column < GLYPH[0] => GLYPHS[glyph][row] >> (GLYPH[0] - 1 - column) & 1 == 1,
        _ => false,
    }
}

/// Draws the label: white where it is lit, else black.
fn fill<T: Copy + Default>(
    pixels: &mut [[T; 4]],
    width: usize,
    size: [usize; 2],
    white: [T; 4],
    lit: impl Fn(usize, usize) -> bool,
) {
    let black = [T::default(), T::default(), T::default(), white[3]];
    for (y, row) in pixels.chunks_exact_mut(width.max(1)).take(size[1]).enumerate() {
        for (x, pixel) in row.iter_mut().take(size[0]).enumerate() {
            *pixel = if lit(x, y) { white } else { black };
        }
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{color::AlphaConvention, frame::DisplayEncoding};

    use super::*;

    fn labeled(size: [usize; 2], shown: i64) -> DisplayImage {
        let pixels = DisplayPixels::Eight(vec![[9, 9, 9, 255]; size[0] * size[1]]);
        let mut picture = DisplayImage {
            width: size[0],
            height: size[1],
            opaque: true,
            alpha: AlphaConvention::Linear,
            encoding: DisplayEncoding::Srgb,
            pixels,
        };
        draw_number(&mut picture, shown);
        picture
    }

    fn codes(picture: &DisplayImage) -> Vec<u8> {
        let DisplayPixels::Eight(pixels) = &picture.pixels else { panic!("8 bits") };
        pixels.iter().map(|pixel| pixel[0]).collect()
    }

    #[test]
    fn a_number_stands_in_the_corner_in_white_on_black() {
        let codes = codes(&labeled([40, 72], -7));
        let rows: Vec<String> = codes
            .chunks(40)
            .take(9)
            .map(|row| {
                row[..14]
                    .iter()
                    .map(|code| match code {
                        255 => '#',
                        0 => '.',
                        _ => ' ',
                    })
                    .collect()
            })
            .collect();
        #[rustfmt::skip]
        assert_eq!(rows, [
            "............. ",
            ".......#####. ",
            "...........#. ",
            "..........#.. ",
            ".#####...#... ",
            "........#.... ",
            "........#.... ",
            "........#.... ",
            "............. ",
        ]);
        assert!(codes[9 * 40..].iter().all(|&code| code == 9), "nothing below it is touched");
    }

    #[test]
    fn it_grows_with_the_picture_and_never_takes_more_than_an_eighth_of_its_height() {
        for (height, rows) in [(71, 0), (72, 9), (288, 18), (720, 45), (2160, 135)] {
            let picture = labeled([2 * height, height], 120);
            let touched = codes(&picture).chunks(2 * height).filter(|row| row[0] != 9).count();
            assert_eq!(touched, rows, "{height}");
            assert!(8 * touched <= height);
        }
    }

    #[test]
    fn a_number_that_does_not_fit_is_left_out() {
        assert!(codes(&labeled([12, 400], 123)).iter().all(|&code| code == 9));
    }
}
