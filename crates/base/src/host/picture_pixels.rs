//! The pixels of a picture, as floats or as codes of 8 bits.

use crate::{color::VALUES_OF_CODES, image::Image};

/// Red, green, blue and alpha of the pixels of a picture.
#[derive(Clone, Debug, PartialEq)]
pub enum PicturePixels {
    /// Floats.
    Floats(Image<4>),
    /// Codes of 8 bits, which stand for 0 to 1: a quarter of the memory, and converted by tables.
    Codes(CodeImage),
}

/// A picture of codes of 8 bits, rows from the top, pixels from the left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CodeImage {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 4]>,
}

/// A row of the pixels of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PixelRow<'a> {
    /// Floats.
    Floats(&'a [[f32; 4]]),
    /// Codes, which stand for 0 to 1.
    Codes(&'a [[u8; 4]]),
}

impl CodeImage {
    /// A picture of existing pixels; `None` unless there are `width * height` of them.
    pub fn from_pixels(width: usize, height: usize, pixels: Vec<[u8; 4]>) -> Option<Self> {
        (pixels.len() == width * height).then_some(Self { width, height, pixels })
    }

    /// All pixels, row after row, for whoever keeps them without the picture.
    #[must_use]
    pub fn into_pixels(self) -> Vec<[u8; 4]> {
        self.pixels
    }

    fn row(&self, y: usize) -> &[[u8; 4]] {
        &self.pixels[y * self.width..][..self.width]
    }
}

impl PicturePixels {
    /// Width in pixels.
    pub fn width(&self) -> usize {
        match self {
            Self::Floats(image) => image.width(),
            Self::Codes(image) => image.width,
        }
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        match self {
            Self::Floats(image) => image.height(),
            Self::Codes(image) => image.height,
        }
    }

    /// Number of pixels.
    pub fn count(&self) -> usize {
        self.width() * self.height()
    }

    /// Memory of the pixels, bytes.
    pub fn memory_bytes(&self) -> usize {
        match self {
            Self::Floats(image) => size_of_val(image.pixels()),
            Self::Codes(image) => size_of_val(&image.pixels[..]),
        }
    }

    /// The pixel at column `x`, row `y`; codes are divided by 255.
    #[inline(always)]
    pub fn at(&self, x: usize, y: usize) -> [f32; 4] {
        match self {
            Self::Floats(image) => image.at(x, y),
            Self::Codes(image) => values_of_codes(image.row(y)[x]),
        }
    }

    /// One row, counted from the top.
    pub fn row(&self, y: usize) -> PixelRow<'_> {
        match self {
            Self::Floats(image) => PixelRow::Floats(image.row(y)),
            Self::Codes(image) => PixelRow::Codes(image.row(y)),
        }
    }

    /// All pixels, row after row; codes are divided by 255.
    pub fn iter(&self) -> impl Iterator<Item = [f32; 4]> {
        (0..self.count()).map(|index| self.at(index % self.width(), index / self.width()))
    }
}

impl PixelRow<'_> {
    /// Writes the pixels; codes are divided by 255. The shorter of both determines how many are written.
    #[inline(always)]
    pub fn copy_to(self, floats: &mut [[f32; 4]]) {
        match self {
            Self::Floats(row) => {
                let count = row.len().min(floats.len());
                floats[..count].copy_from_slice(&row[..count]);
            }
            Self::Codes(row) => floats.iter_mut().zip(row).for_each(|(float, codes)| *float = values_of_codes(*codes)),
        }
    }
}

impl From<Image<4>> for PicturePixels {
    fn from(image: Image<4>) -> Self {
        Self::Floats(image)
    }
}

impl From<CodeImage> for PicturePixels {
    fn from(image: CodeImage) -> Self {
        Self::Codes(image)
    }
}

/// Codes divided by 255.
#[inline(always)]
fn values_of_codes([r, g, b, alpha]: [u8; 4]) -> [f32; 4] {
    let [r, g, b, alpha] = [usize::from(r), usize::from(g), usize::from(b), usize::from(alpha)];
    // Not by a closure, which would not be compiled for the features of the processor.
    [VALUES_OF_CODES[r], VALUES_OF_CODES[g], VALUES_OF_CODES[b], VALUES_OF_CODES[alpha]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_the_floats_that_they_stand_for() {
        let codes: Vec<[u8; 4]> = (0..6).map(|index| [40 * index, 255 - index, index, 255]).collect();
        let floats = codes.iter().map(|pixel| pixel.map(|code| f32::from(code) / 255.0)).collect();
        let floats = PicturePixels::from(Image::from_pixels(3, 2, floats).unwrap());
        let codes = PicturePixels::from(CodeImage::from_pixels(3, 2, codes).unwrap());
        assert_eq!(([codes.width(), codes.height()], codes.count()), ([3, 2], 6));
        assert_eq!((codes.memory_bytes(), floats.memory_bytes()), (24, 96));
        assert!(codes.iter().eq(floats.iter()) && codes.at(2, 1) == floats.at(2, 1));
        let rows = [&codes, &floats].map(|pixels| {
            let mut row = [[0.0; 4]; 3];
            pixels.row(1).copy_to(&mut row);
            row
        });
        assert_eq!(rows[0], rows[1]);
        assert_eq!(CodeImage::from_pixels(2, 2, vec![[0; 4]; 3]), None);
    }
}
