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
        let ([left, top], [right, bottom]) = (low.map(first_pixel), high.map(first_pixel));
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
        [packed(self.left as u32, self.top as u32), packed(self.right as u32, self.bottom as u32)]
    }
}

/// The first pixel whose center is not before `subpixels`.
fn first_pixel(subpixels: i32) -> i32 {
    (subpixels - SUBPIXELS / 2 + SUBPIXELS - 1).div_euclid(SUBPIXELS)
}

/// Two words as one, for a hash.
pub(super) fn packed(high: u32, low: u32) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}
