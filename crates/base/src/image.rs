//! Pictures of floats in memory, and rectangles of pixels.

use glam::DVec2;

/// A picture with `N` floats per pixel, rows from the top, pixels from the left.
///
/// The meaning of the floats is up to the owner; in a [`Frame`](crate::frame::Frame) they are scene-linear ACEScg.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<const N: usize> {
    width: usize,
    height: usize,
    pixels: Vec<[f32; N]>,
}

impl<const N: usize> Image<N> {
    /// A picture with every pixel set to `value`.
    pub fn filled(width: usize, height: usize, value: [f32; N]) -> Self {
        Self { width, height, pixels: vec![value; width * height] }
    }

    /// A picture of existing pixels; `None` unless there are `width * height` of them.
    pub fn from_pixels(width: usize, height: usize, pixels: Vec<[f32; N]>) -> Option<Self> {
        (pixels.len() == width * height).then_some(Self { width, height, pixels })
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row after row.
    pub fn pixels(&self) -> &[[f32; N]] {
        &self.pixels
    }

    /// All pixels, row after row.
    pub fn pixels_mut(&mut self) -> &mut [[f32; N]] {
        &mut self.pixels
    }

    /// All pixels, row after row, for whoever keeps them without the picture.
    #[must_use]
    pub fn into_pixels(self) -> Vec<[f32; N]> {
        self.pixels
    }

    /// One row, counted from the top.
    pub fn row(&self, y: usize) -> &[[f32; N]] {
        &self.pixels[y * self.width..][..self.width]
    }

    /// One row, counted from the top.
    pub fn row_mut(&mut self, y: usize) -> &mut [[f32; N]] {
        &mut self.pixels[y * self.width..][..self.width]
    }

    /// The pixel at column `x`, row `y`.
    pub fn at(&self, x: usize, y: usize) -> [f32; N] {
        self.row(y)[x]
    }

    /// The value at a position in pixels from the left and top edges, by bilinear interpolation between pixel centers. Positions beyond the outermost
    /// centers are clamped to them.
    pub fn sample_bilinear(&self, position: DVec2) -> [f32; N] {
        if self.pixels.is_empty() {
            return [0.0; N];
        }
        let last = DVec2::new(self.width as f64 - 1.0, self.height as f64 - 1.0);
        let position = (position - 0.5).clamp(DVec2::ZERO, last);
        let (x, y) = (position.x as usize, position.y as usize);
        let (right, below) = ((x + 1).min(self.width - 1), (y + 1).min(self.height - 1));
        let (u, v) = (position.x.fract() as f32, position.y.fract() as f32);
        let [a, b, c, d] = [self.at(x, y), self.at(right, y), self.at(x, below), self.at(right, below)];
        std::array::from_fn(|i| (1.0 - v) * ((1.0 - u) * a[i] + u * b[i]) + v * ((1.0 - u) * c[i] + u * d[i]))
    }

    /// The region `rect` of this picture; `None` if it extends outside.
    pub fn crop(&self, rect: Rect) -> Option<Self> {
        if rect.right() > self.width || rect.bottom() > self.height {
            return None;
        }
        let pixels = (rect.y..rect.bottom()).flat_map(|y| self.row(y)[rect.x..rect.right()].to_vec()).collect();
        Self::from_pixels(rect.width, rect.height, pixels)
    }
}

/// A rectangle of whole pixels; `y` grows downward.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Rect {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Rect {
    /// The rectangle of a whole picture.
    pub fn from_size(width: usize, height: usize) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// One past the last column.
    pub fn right(&self) -> usize {
        self.x + self.width
    }

    /// One past the last row.
    pub fn bottom(&self) -> usize {
        self.y + self.height
    }

    /// Whether it contains no pixel.
    pub fn is_empty(&self) -> bool {
        self.width == 0 || self.height == 0
    }

    /// The smallest rectangle that contains both; empty rectangles are ignored.
    pub fn union(&self, other: &Self) -> Self {
        if self.is_empty() {
            return *other;
        }
        if other.is_empty() {
            return *self;
        }
        let (x, y) = (self.x.min(other.x), self.y.min(other.y));
        Self { x, y, width: self.right().max(other.right()) - x, height: self.bottom().max(other.bottom()) - y }
    }

    /// The smallest rectangle that contains all; without any, an empty one.
    pub fn hull<'a>(rects: impl IntoIterator<Item = &'a Self>) -> Self {
        rects.into_iter().fold(Self::default(), |all, rect| all.union(rect))
    }

    /// The intersection of both rectangles.
    pub fn intersection(&self, other: &Self) -> Self {
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        let width = self.right().min(other.right()).saturating_sub(x);
        let height = self.bottom().min(other.bottom()).saturating_sub(y);
        if width == 0 || height == 0 { Self::default() } else { Self { x, y, width, height } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crop_takes_the_named_pixels_and_refuses_to_reach_outside() {
        let pixels = (0..12).map(|i| [i as f32]).collect();
        let image = Image::<1>::from_pixels(4, 3, pixels).unwrap();
        let part = image.crop(Rect { x: 1, y: 1, width: 2, height: 2 }).unwrap();
        assert_eq!(part.pixels(), &[[5.0], [6.0], [9.0], [10.0]]);
        assert!(image.crop(Rect { x: 3, y: 0, width: 2, height: 1 }).is_none());
    }

    #[test]
    fn the_pixels_outlive_their_picture_in_its_order() {
        let pixels: Vec<[f32; 1]> = (0..6).map(|i| [i as f32]).collect();
        let image = Image::from_pixels(3, 2, pixels.clone()).unwrap();
        assert_eq!(image.at(0, 1), [3.0]);
        assert_eq!(image.into_pixels(), pixels);
    }

    #[test]
    fn rectangles_meet_only_where_both_cover() {
        let a = Rect { x: 0, y: 0, width: 4, height: 4 };
        let b = Rect { x: 2, y: 3, width: 9, height: 9 };
        assert_eq!(a.intersection(&b), Rect { x: 2, y: 3, width: 2, height: 1 });
        assert!(a.intersection(&Rect { x: 4, y: 0, width: 1, height: 1 }).is_empty());
        assert_eq!(Rect::hull([&a, &Rect::default(), &b]), Rect { x: 0, y: 0, width: 11, height: 12 });
        assert!(Rect::hull([]).is_empty());
    }
}
