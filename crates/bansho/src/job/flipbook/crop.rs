//! The crop of a flipbook: the part of the picture that is lit in any frame, so that a small flame in a wide picture fills its tiles.

use std::{
    ops::Range,
    sync::{Arc, Mutex, PoisonError},
};

use bansho_base::{
    color::AlphaConvention,
    frame::{DisplayImage, DisplayPixels},
    host::observer::Observer,
    image::Rect,
};
use bansho_render::{
    CompiledScene, Plan, Shot,
    display::{BitDepth, DisplayFrame, DisplayOptions},
};
use bansho_scene::picture::LARGEST_SIDE;

use crate::job::{
    error::JobError,
    observer::JobObserver,
    pipeline::{
        draw_frames::{FrameSink, draw_frames},
        snapshots::Snapshots,
    },
};

bansho_base::choice! {
    /// The part of the picture that the tiles of a flipbook show.
    pub enum FlipbookCrop {
        /// The rectangle around all pixels with light or alpha in any frame, and a margin of two pixels.
        Auto = "auto",
        /// The whole picture.
        None = "none",
    }
}

/// Margin around the lit region, pixels.
const MARGIN: usize = 2;
/// Maximum enlargement of the picture, relative to the scene's size, so that its lit region fills the tiles.
const MAX_ENLARGEMENT: f64 = 2.0;

/// A rectangle of a picture in fractions of its width and height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Region {
    /// Left and top.
    min: [f64; 2],
    /// Right and bottom.
    max: [f64; 2],
}

impl Region {
    /// The pixels `lit` of a picture of `size`, and one more on each side, which a larger picture may light.
    fn new(lit: &Rect, size: [usize; 2]) -> Self {
        let (first, end) = ([lit.x, lit.y], [lit.right(), lit.bottom()]);
        Self {
            min: [0, 1].map(|axis| ((first[axis] as f64 - 1.0) / size[axis] as f64).clamp(0.0, 1.0)),
            max: [0, 1].map(|axis| ((end[axis] as f64 + 1.0) / size[axis] as f64).clamp(0.0, 1.0)),
        }
    }

    /// The pixels of a picture of `size` that contain the region and its margin. Width and height are even where the picture is large enough.
    pub(crate) fn pixels(&self, size: [usize; 2]) -> Rect {
        let [columns, rows] = [0, 1].map(|axis| self.pixels_along(axis, size[axis]));
        Rect { x: columns.start, y: rows.start, width: columns.len(), height: rows.len() }
    }

    /// The columns (axis 0) or rows (axis 1) of a picture with `count` of them that contain the region and its margin.
    fn pixels_along(&self, axis: usize, count: usize) -> Range<usize> {
        let mut start = ((self.min[axis] * count as f64).floor() as usize).saturating_sub(MARGIN);
        let mut end = ((self.max[axis] * count as f64).ceil() as usize + MARGIN).min(count);
        if (end - start) % 2 == 1 {
            if end < count {
                end += 1;
            } else {
                start = start.saturating_sub(1);
            }
        }
        start..end
    }

    /// The size at which a picture of `size` has to be drawn so that the region fits into a tile of `max_tile` pixels; `None` if the tile is too
    /// small.
    pub(crate) fn picture_size(&self, size: [usize; 2], max_tile: [usize; 2]) -> Option<[usize; 2]> {
        // Rounding outward adds a pixel on each side, and an even length one more.
        const ADDED: usize = 2 * MARGIN + 3;
        let mut scale = MAX_ENLARGEMENT.min(LARGEST_SIDE / size[0].max(size[1]) as f64);
        for axis in 0..2 {
            let room = max_tile[axis].checked_sub(ADDED).filter(|&room| room > 0)?;
            let length = (self.max[axis] - self.min[axis]) * size[axis] as f64;
            scale = scale.min(room as f64 / length.max(1.0));
        }
        Some(size.map(|side| ((side as f64 * scale).round() as usize).max(1)))
    }
}

/// The region with light or alpha in any of the frames `numbers`, found in small pictures of them; `None` if all are empty. `exact` includes
/// light that is too dark for 8 bits.
///
/// # Errors
/// Drawing failed, or the observer canceled the job.
pub(crate) fn lit_region(
    compiled: &Arc<CompiledScene>,
    plan: &Plan,
    numbers: &[i64],
    exact: bool,
    observer: &dyn JobObserver,
) -> Result<Option<Region>, JobError> {
    let whole = plan.scene().picture.size.map(|side| side as usize);
    let reduction = reduction_factor(whole);
    let size = whole.map(|side| ((side as f64 / reduction).round() as usize).max(1));
    let mut small = plan.at_size(size);
    (small.layers, small.aovs) = (false, false);
    // Half an 8-bit code of a single pixel, averaged over the pixels of a small one, in 16-bit codes.
    let min_alpha = if exact { 1 } else { (128.0 / (reduction * reduction)).max(1.0) as u16 };
    let target = DisplayOptions {
        view: plan.display,
        depth: BitDepth::Sixteen,
        alpha: AlphaConvention::Linear,
        over_black: false,
    };
    let probe = LitRegionProbe { lit: Mutex::default(), target, min_alpha };
    let mut shot = Shot::open(compiled.clone(), Arc::new(small));
    // The pictures are small.
    let at_once = rayon::current_num_threads();
    draw_frames(&mut shot, numbers, &Snapshots::default(), at_once, &probe, observer)?;
    let lit = probe.lit.into_inner().unwrap_or_else(PoisonError::into_inner);
    Ok((!lit.is_empty()).then(|| Region::new(&lit, size)))
}

/// Reduction of the pictures in which the lit region is found: 4, unless the longer side would be outside 128 to 512 pixels.
fn reduction_factor(size: [usize; 2]) -> f64 {
    let longest = size[0].max(size[1]) as f64;
    longest / (0.25 * longest).clamp(128.0, 512.0).min(longest)
}

/// Collects the lit region of all frames.
struct LitRegionProbe {
    lit: Mutex<Rect>,
    target: DisplayOptions,
    /// Smallest alpha of a lit pixel, 16-bit code. Display pixels have alpha where they have light.
    min_alpha: u16,
}

impl FrameSink for LitRegionProbe {
    type Target = DisplayOptions;
    /// The lit region of the frame.
    type Encoded = Rect;

    fn target(&self) -> &DisplayOptions {
        &self.target
    }

    fn encode(&self, _index: usize, frame: &mut DisplayFrame, _observer: &dyn Observer) -> Result<Rect, JobError> {
        Ok(bounds(&frame.image, self.min_alpha))
    }

    fn commit(&self, _index: usize, frame_bounds: Rect, _observer: &dyn Observer) -> Result<(), JobError> {
        let mut lit = self.lit.lock().unwrap_or_else(PoisonError::into_inner);
        *lit = lit.union(&frame_bounds);
        Ok(())
    }

    fn max_in_flight(&self) -> usize {
        usize::MAX
    }
}

/// The smallest rectangle around all pixels of a picture whose alpha is at least `min_alpha`, a code of 16 bits.
fn bounds(picture: &DisplayImage, min_alpha: u16) -> Rect {
    let width = picture.width;
    let pixels = match &picture.pixels {
        DisplayPixels::Sixteen(pixels) if !picture.opaque => pixels,
        _ => return Rect::from_size(width, picture.height),
    };
    let mut lit = Rect::default();
    for (y, row) in pixels.chunks_exact(width.max(1)).enumerate() {
        let mut lit_columns = (0..row.len()).filter(|&x| row[x][3] >= min_alpha);
        if let Some(first) = lit_columns.next() {
            let last = lit_columns.next_back().unwrap_or(first);
            lit = lit.union(&Rect { x: first, y, width: last - first + 1, height: 1 });
        }
    }
    lit
}

#[cfg(test)]
mod tests {
    use bansho_base::{color::View, frame::Frame, image::Image};
    use bansho_render::display::display;

    use super::*;
    use crate::job::testing;

    #[test]
    fn pixels_with_light_or_alpha_are_found() {
        let mut frame = testing::blank(&testing::plan(), 0);
        frame.beauty = Image::filled(9, 7, [0.0; 4]);
        frame.content = Rect::from_size(9, 7);
        let found =
            |frame: &Frame| bounds(&display(frame, &View::DISPLAY, BitDepth::Sixteen, AlphaConvention::Linear), 1);
        assert!(found(&frame).is_empty());
        frame.beauty.pixels_mut()[2 * 9 + 3] = [0.5, 0.1, 0.0, 0.0];
        frame.beauty.pixels_mut()[4 * 9 + 6] = [0.0, 0.0, 0.0, 0.3];
        assert_eq!(found(&frame), Rect { x: 3, y: 2, width: 4, height: 3 });
        frame.opaque = true;
        assert_eq!(found(&frame), Rect::from_size(9, 7));
    }

    #[test]
    fn a_region_has_a_margin_and_even_sides_within_its_picture() {
        let region = Region::new(&Rect { x: 30, y: 10, width: 20, height: 40 }, [128, 72]);
        let pixels = region.pixels([512, 288]);
        // A small pixel is four pixels, and the margin is two: 29 * 4 - 2 = 114, 9 * 4 - 2 = 34.
        assert_eq!(pixels, Rect { x: 114, y: 34, width: 92, height: 172 });
        let region = Region::new(&Rect { x: 0, y: 0, width: 128, height: 72 }, [128, 72]);
        assert_eq!(region.pixels([511, 287]), Rect::from_size(511, 287));
        for size in [[511, 287], [77, 33], [3, 3], [1, 1]] {
            let pixels = Region::new(&Rect { x: 60, y: 0, width: 9, height: 30 }, [128, 72]).pixels(size);
            assert!(pixels.right() <= size[0] && pixels.bottom() <= size[1] && !pixels.is_empty(), "{pixels:?}");
        }
    }

    #[test]
    fn a_picture_is_enlarged_until_its_region_fills_a_tile() {
        let size = [512, 288];
        let region = Region::new(&Rect { x: 53, y: 8, width: 22, height: 54 }, [128, 72]);
        for tile in [[256, 256], [128, 128], [64, 300], [100, 40]] {
            let picture = region.picture_size(size, tile).unwrap();
            let pixels = region.pixels(picture);
            assert!(pixels.width <= tile[0] && pixels.height <= tile[1], "{tile:?}: {pixels:?}");
            let fills = pixels.width + 8 > tile[0] || pixels.height + 8 > tile[1];
            assert!(fills, "{tile:?}: {pixels:?} of {picture:?}");
        }
        // A single lit pixel is not enlarged without limit.
        let speck = Region::new(&Rect { x: 60, y: 30, width: 1, height: 1 }, [128, 72]);
        assert_eq!(speck.picture_size(size, [256, 256]), Some([1024, 576]));
        assert_eq!(speck.picture_size(size, [6, 256]), None);
    }

    #[test]
    fn reduced_pictures_have_128_to_512_pixels() {
        for (size, reduction) in
            [([512, 288], 4.0), ([1280, 720], 4.0), ([64, 48], 1.0), ([256, 144], 2.0), ([8192, 100], 16.0)]
        {
            assert_eq!(reduction_factor(size), reduction, "{size:?}");
        }
    }
}
