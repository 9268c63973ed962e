//! Sprite sheets: flipbooks for game engines, and contact sheets.

use bansho_base::{
    frame::{DisplayImage, DisplayPixels},
    image::{Image, Rect},
};

/// Why pictures cannot be laid out on a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SheetError {
    /// There is no picture.
    #[error("a sheet needs at least one picture")]
    NoPictures,
    /// The number of columns is 0.
    #[error("a sheet needs at least one column")]
    NoColumns,
    /// The pictures have different sizes.
    #[error("picture {} is {width} x {height}; all pictures of a sheet must have the size of the first", index + 1)]
    SizesDiffer {
        /// The first picture that differs, from 0.
        index: usize,
        /// Its width, pixels.
        width: usize,
        /// Its height, pixels.
        height: usize,
    },
    /// Pictures of 8 bits and of 16 bits.
    #[error("picture {} has another bit depth than the first", index + 1)]
    BitDepthsDiffer {
        /// The first picture that differs, from 0.
        index: usize,
    },
}

/// Layout of a sheet: cells in rows from the top left, with `gutter` pixels between them and none around them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SheetLayout {
    /// Number of pictures.
    pub count: usize,
    /// Number of columns.
    pub columns: usize,
    /// Width and height of each, pixels.
    pub cell: [usize; 2],
    /// Pixels between two cells.
    pub gutter: usize,
}

impl SheetLayout {
    /// Number of rows; the last may not be full.
    pub fn rows(&self) -> usize {
        self.count.div_ceil(self.columns.max(1))
    }

    /// Width and height of the sheet, pixels.
    pub fn size(&self) -> [usize; 2] {
        let counts = [self.columns, self.rows()];
        [0, 1].map(|axis| counts[axis] * self.cell[axis] + counts[axis].saturating_sub(1) * self.gutter)
    }

    /// The rectangle of the picture at position `index`.
    pub fn cell_rect(&self, index: usize) -> Rect {
        let columns = self.columns.max(1);
        let [width, height] = self.cell;
        let (x, y) = ((index % columns) * (width + self.gutter), (index / columns) * (height + self.gutter));
        Rect { x, y, width, height }
    }

    /// Copies `images`, each the pixels of a cell in rows, onto a sheet filled with `fill`.
    fn copy_cells<T: Copy>(&self, images: &[&[T]], fill: T) -> Vec<T> {
        let [sheet_width, sheet_height] = self.size();
        let mut sheet = vec![fill; sheet_width * sheet_height];
        for (index, pixels) in images.iter().enumerate() {
            let rect = self.cell_rect(index);
            for (row, line) in pixels.chunks_exact(rect.width.max(1)).enumerate() {
                sheet[(rect.y + row) * sheet_width + rect.x..][..rect.width].copy_from_slice(line);
            }
        }
        sheet
    }
}

/// The layout of pictures of these sizes, which must be equal.
fn layout(sizes: impl Iterator<Item = [usize; 2]>, columns: usize, gutter: usize) -> Result<SheetLayout, SheetError> {
    if columns == 0 {
        return Err(SheetError::NoColumns);
    }
    let (mut cell, mut count) = (None, 0);
    for (index, [width, height]) in sizes.enumerate() {
        if *cell.get_or_insert([width, height]) != [width, height] {
            return Err(SheetError::SizesDiffer { index, width, height });
        }
        count += 1;
    }
    let cell = cell.ok_or(SheetError::NoPictures)?;
    Ok(SheetLayout { count, columns: columns.min(count), cell, gutter })
}

/// One picture of all `images` in `columns` columns. `fill` is the color of gutters and of empty cells.
///
/// # Errors
/// No picture, no column, or different sizes.
pub fn tile<const N: usize>(
    images: &[Image<N>],
    columns: usize,
    gutter: usize,
    fill: [f32; N],
) -> Result<Image<N>, SheetError> {
    let layout = layout(images.iter().map(|image| [image.width(), image.height()]), columns, gutter)?;
    let pixels: Vec<_> = images.iter().map(Image::pixels).collect();
    let [width, height] = layout.size();
    Image::from_pixels(width, height, layout.copy_cells(&pixels, fill)).ok_or(SheetError::NoPictures)
}

/// As [`tile`], for display pixels; `fill` in 8 bits. The sheet is opaque if all pictures and the fill are.
///
/// # Errors
/// No picture, no column, different sizes or bit depths.
pub fn tile_display(
    images: &[DisplayImage],
    columns: usize,
    gutter: usize,
    fill: [u8; 4],
) -> Result<DisplayImage, SheetError> {
    let layout = layout(images.iter().map(|image| [image.width, image.height]), columns, gutter)?;
    let (mut eight, mut sixteen) = (Vec::new(), Vec::new());
    for (index, image) in images.iter().enumerate() {
        match &image.pixels {
            DisplayPixels::Eight(pixels) => eight.push(&pixels[..]),
            DisplayPixels::Sixteen(pixels) => sixteen.push(&pixels[..]),
        }
        if !eight.is_empty() && !sixteen.is_empty() {
            return Err(SheetError::BitDepthsDiffer { index });
        }
    }
    let [width, height] = layout.size();
    let pixels = if sixteen.is_empty() {
        DisplayPixels::Eight(layout.copy_cells(&eight, fill))
    } else {
        DisplayPixels::Sixteen(layout.copy_cells(&sixteen, fill.map(|code| u16::from(code) * 257)))
    };
    // Without gutters and empty cells the fill does not show.
    let is_full = gutter == 0 && layout.count == layout.columns * layout.rows();
    let opaque = images.iter().all(|image| image.opaque) && (is_full || fill[3] == u8::MAX);
    Ok(DisplayImage { width, height, opaque, alpha: images[0].alpha, encoding: images[0].encoding, pixels })
}

#[cfg(test)]
mod tests {
    use bansho_base::{color::AlphaConvention, frame::DisplayEncoding};

    use super::*;

    #[test]
    fn pictures_stand_in_rows_with_gutters_between() {
        let images: Vec<Image<1>> = (1..=3).map(|i| Image::filled(2, 1, [i as f32])).collect();
        let sheet = tile(&images, 2, 1, [0.0]).unwrap();
        assert_eq!((sheet.width(), sheet.height()), (5, 3));
        let values: Vec<f32> = sheet.pixels().iter().map(|pixel| pixel[0]).collect();
        #[rustfmt::skip]
        assert_eq!(values, [
            1.0, 1.0, 0.0, 2.0, 2.0,
            0.0, 0.0, 0.0, 0.0, 0.0,
            3.0, 3.0, 0.0, 0.0, 0.0,
        ]);
    }

    #[test]
    fn fewer_pictures_than_columns_make_one_row() {
        let images = [Image::<2>::filled(3, 2, [1.0; 2])];
        let sheet = tile(&images, 8, 4, [0.0; 2]).unwrap();
        assert_eq!((sheet.width(), sheet.height()), (3, 2));
    }

    #[test]
    fn a_sheet_is_opaque_only_if_all_of_it_is() {
        let image = |code: u8| {
            let pixels = DisplayPixels::Eight(vec![[code, 0, 0, 255]; 2]);
            DisplayImage {
                width: 1,
                height: 2,
                opaque: true,
                alpha: AlphaConvention::Linear,
                encoding: DisplayEncoding::Srgb,
                pixels,
            }
        };
        let images = [image(1), image(2), image(3)];
        let opaque = |columns, gutter, alpha| tile_display(&images, columns, gutter, [0, 0, 0, alpha]).unwrap().opaque;
        assert!(opaque(3, 0, 0) && opaque(2, 1, 255));
        assert!(!opaque(2, 0, 0) && !opaque(3, 1, 0));
    }

    #[test]
    fn what_does_not_fit_together_is_refused() {
        let image = |width| Image::<1>::filled(width, 1, [0.0]);
        assert_eq!(tile(&[image(1)], 0, 0, [0.0]), Err(SheetError::NoColumns));
        assert_eq!(tile::<1>(&[], 1, 0, [0.0]), Err(SheetError::NoPictures));
        assert_eq!(
            tile(&[image(1), image(2)], 1, 0, [0.0]),
            Err(SheetError::SizesDiffer { index: 1, width: 2, height: 1 })
        );
        let pixels = DisplayPixels::Eight(vec![[0; 4]]);
        let eight = DisplayImage {
            width: 1,
            height: 1,
            opaque: true,
            alpha: AlphaConvention::Linear,
            encoding: DisplayEncoding::Srgb,
            pixels,
        };
        let sixteen = DisplayImage { pixels: DisplayPixels::Sixteen(vec![[0; 4]]), ..eight };
        assert_eq!(tile_display(&[eight, sixteen], 1, 0, [0; 4]), Err(SheetError::BitDepthsDiffer { index: 1 }));
    }
}
