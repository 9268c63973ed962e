//! Pixel rectangles, and the subpixel grid that vertices are snapped to.

/// Subpixels per pixel: 8 subpixel bits, as GPUs have.
pub(super) const SUBPIXELS: i32 = 256;

/// A half-open rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelRect {
    /// The first column.
    pub left: i32,
    /// The first row.
    pub top: i32,
    /// One past the last column.
    pub right: i32,
    /// One past the last row.
    pub bottom: i32,
}

impl PixelRect {
    /// Whether it contains no pixel.
    pub fn is_empty(self) -> bool {
        self.left >= self.right || self.top >= self.bottom
    }

    /// The pixels whose centers lie in the half-open box from `low` to `high`, subpixels.
    pub(super) fn covering(low: [i32; 2], high: [i32; 2]) -> Self {
        let first = |at: i32| (at - SUBPIXELS / 2 + SUBPIXELS - 1).div_euclid(SUBPIXELS);
        let ([left, top], [right, bottom]) = (low.map(first), high.map(first));
        Self { left, top, right, bottom }
    }

    /// The intersection.
    pub(super) fn within(self, other: Self) -> Self {
        Self {
            left: self.left.max(other.left),
            top: self.top.max(other.top),
            right: self.right.min(other.right),
            bottom: self.bottom.min(other.bottom),
        }
    }

    /// The rectangle as words for a hash.
    pub(super) fn hash_words(self) -> [u64; 2] {
        let pair = |a: i32, b: i32| u64::from(a as u32) << 32 | u64::from(b as u32);
        [pair(self.left, self.top), pair(self.right, self.bottom)]
    }
}
