//! The orientation of a photograph: how its rows and columns are turned for display (Exif tag 0x0112, TIFF 6.0 tag 274).

use bansho_base::image::Image;

/// A value of the tag, by what has to be done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Orientation {
    /// 1: nothing.
    #[default]
    Upright,
    /// 2: mirrored left to right.
    Mirrored,
    /// 3: turned by half a turn.
    Turned180,
    /// 4: mirrored top to bottom.
    Flipped,
    /// 5: rows become columns.
    Transposed,
    /// 6: turned clockwise by a quarter turn.
    Turned90,
    /// 7: rows become columns, mirrored in both directions.
    Transverse,
    /// 8: turned counterclockwise by a quarter turn.
    Turned270,
}

impl Orientation {
    /// The orientation of a value of the tag; `None` for a value without meaning.
    pub(crate) fn from_tag(value: u32) -> Option<Self> {
        Some(match value {
            1 => Self::Upright,
            2 => Self::Mirrored,
            3 => Self::Turned180,
            4 => Self::Flipped,
            5 => Self::Transposed,
            6 => Self::Turned90,
            7 => Self::Transverse,
            8 => Self::Turned270,
            _ => return None,
        })
    }

    fn swaps_sides(self) -> bool {
        matches!(self, Self::Transposed | Self::Turned90 | Self::Transverse | Self::Turned270)
    }

    /// The stored pixel that is shown at (x, y), in a stored picture of `width` x `height` pixels.
    fn source(self, [x, y]: [usize; 2], [width, height]: [usize; 2]) -> [usize; 2] {
        let (right, bottom) = (width - 1, height - 1);
        match self {
            Self::Upright => [x, y],
            Self::Mirrored => [right - x, y],
            Self::Turned180 => [right - x, bottom - y],
            Self::Flipped => [x, bottom - y],
            Self::Transposed => [y, x],
            Self::Turned90 => [y, bottom - x],
            Self::Transverse => [right - y, bottom - x],
            Self::Turned270 => [right - y, x],
        }
    }

    /// The picture as it is shown.
    pub(crate) fn apply<const N: usize>(self, image: Image<N>) -> Image<N> {
        let size = [image.width(), image.height()];
        if self == Self::Upright || size.contains(&0) {
            return image;
        }
        let [width, height] = if self.swaps_sides() { [size[1], size[0]] } else { size };
        let mut turned = Image::filled(width, height, [0.0; N]);
        for y in 0..height {
            for (x, pixel) in turned.row_mut(y).iter_mut().enumerate() {
                let [column, row] = self.source([x, y], size);
                *pixel = image.at(column, row);
            }
        }
        turned
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_value_of_the_tag_shows_the_rows_and_columns_that_the_standard_says() {
        // Exif 2.32, 4.6.4: what the stored row 0 and column 0 are on the display. Stored: 0 1 2 / 3 4 5.
        let shown = [
            (1, [3, 2], [0, 1, 2, 3, 4, 5]),
            (2, [3, 2], [2, 1, 0, 5, 4, 3]),
            (3, [3, 2], [5, 4, 3, 2, 1, 0]),
            (4, [3, 2], [3, 4, 5, 0, 1, 2]),
            (5, [2, 3], [0, 3, 1, 4, 2, 5]),
            (6, [2, 3], [3, 0, 4, 1, 5, 2]),
            (7, [2, 3], [5, 2, 4, 1, 3, 0]),
            (8, [2, 3], [2, 5, 1, 4, 0, 3]),
        ];
        for (tag, size, values) in shown {
            let stored = Image::from_pixels(3, 2, (0..6_u8).map(|v| [f32::from(v)]).collect()).unwrap();
            let turned = Orientation::from_tag(tag).unwrap().apply(stored);
            assert_eq!([turned.width(), turned.height()], size, "{tag}");
            let found: Vec<i32> = turned.pixels().iter().map(|[v]| *v as i32).collect();
            assert_eq!(found, values, "{tag}");
        }
        assert_eq!([0, 9, u32::MAX].map(Orientation::from_tag), [None; 3]);
    }
}
