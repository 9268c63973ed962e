//! The pixels of a strip behind which there is an opaque surface.

use std::ops::Range;

use bansho_base::{image::Rect, math::simd::LANES, phenomenon::strip::Strip};

use crate::lanes::LaneArray;

/// Index in a strip of the first pixel of a row of the picture.
pub(super) fn first_pixel(strip: &Strip, row: Rect) -> usize {
    (row.y - strip.rect.y) * strip.rect.width + row.x - strip.rect.x
}

/// The columns of a row of the picture from the first to the last that shows a surface; `0..0` if none does.
pub(super) fn surface_columns(strip: &Strip, row: Rect) -> Range<usize> {
    let first = first_pixel(strip, row);
    let depths = strip.plate_depths(first..first + row.width);
    let Some(begin) = depths.iter().position(|depth| depth.is_finite()) else { return 0..0 };
    let end = depths.iter().rposition(|depth| depth.is_finite()).unwrap_or(begin) + 1;
    row.x + begin..row.x + end
}

/// Depths of the surfaces in the pixels `within` a tile, of which the first is pixel `first` of a strip; `beyond` in the others.
#[inline(always)]
pub(super) fn surface_depths(strip: &Strip, first: usize, within: Range<usize>, beyond: f32) -> LaneArray {
    let mut depths = [beyond; LANES];
    let count = within.len();
    depths[within].copy_from_slice(strip.plate_depths(first..first + count));
    depths
}

/// Replaces the pixels of a layer behind which there is a surface.
#[inline(always)]
pub(super) fn select_before_surfaces(layer: &mut [LaneArray], bounded: &[LaneArray], surfaces: &LaneArray) {
    for (values, bounded) in layer.iter_mut().zip(bounded) {
        for i in 0..LANES {
            values[i] = if surfaces[i].is_finite() { bounded[i] } else { values[i] };
        }
    }
}
