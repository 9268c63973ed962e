//! What of the picture the tiles of a flipbook need: what is ever lit, so that a small flame in a wide picture fills its tiles.

use std::sync::{Arc, Mutex, PoisonError};

use bansho_base::{
    color::{AlphaConvention, View},
    frame::{DisplayPixels, Frame},
    host::observer::Observer,
    image::Rect,
};
use bansho_render::{
    CompiledScene, Plan, Shot,
    display::{BitDepth, display},
};
use bansho_scene::picture::LARGEST_SIDE;

use crate::job::{
    error::JobError,
    observer::JobObserver,
    render::draw_frames::{FrameSink, draw_frames},
    snapshots::Snapshots,
};

bansho_base::choice! {
    /// What of the picture the tiles of a flipbook show.
    pub enum FlipbookCrop {
        /// The part that is lit or hides something in any frame, and two pixels around it.
        Auto = "auto",
        /// All of it.
        None = "none",
    }
}

/// Pixels around what is lit.
const MARGIN: usize = 2;
/// Most that a picture is drawn larger than the scene says, so that its lit part fills the tiles.
const MOST_ENLARGED: f64 = 2.0;

/// A part of a picture as shares of its width and height: left, top, right, bottom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Region {
    min: [f64; 2],
    max: [f64; 2],
}

impl Region {
    /// The pixels `lit` of a picture of `size`, and one around, since what is drawn larger may reach there.
    fn of(lit: &Rect, size: [usize; 2]) -> Self {
        let ([x, y], [right, bottom]) = ([lit.x, lit.y], [lit.right(), lit.bottom()]);
        let share = |pixel: f64, side: usize| (pixel / side as f64).clamp(0.0, 1.0);
        Self {
            min: [share(x as f64 - 1.0, size[0]), share(y as f64 - 1.0, size[1])],
            max: [share(right as f64 + 1.0, size[0]), share(bottom as f64 + 1.0, size[1])],
        }
    }

    /// The pixels of a picture of `size` that hold it and its margin; an even number of columns and rows where the picture has room.
    pub(crate) fn within(&self, size: [usize; 2]) -> Rect {
        let side = |axis: usize| {
            let length = size[axis];
            let mut start = ((self.min[axis] * length as f64).floor() as usize).saturating_sub(MARGIN);
            let mut end = ((self.max[axis] * length as f64).ceil() as usize + MARGIN).min(length);
            if (end - start) % 2 == 1 {
                if end < length {
                    end += 1;
                } else {
                    start = start.saturating_sub(1);
                }
            }
            (start, end - start)
        };
        let ((x, width), (y, height)) = (side(0), side(1));
        Rect { x, y, width, height }
    }

    /// The size at which a picture of `size` is drawn so that its part fits a tile of `most` pixels; `None` where nothing fits.
    pub(crate) fn picture(&self, size: [usize; 2], most: [usize; 2]) -> Option<[usize; 2]> {
        // Rounding outward takes a pixel on each side and evenness one more.
        let room = |axis: usize| most[axis].checked_sub(2 * MARGIN + 3).filter(|&room| room > 0);
        let scale = |axis: usize| {
            let length = (self.max[axis] - self.min[axis]) * size[axis] as f64;
            Some(room(axis)? as f64 / length.max(1.0))
        };
        let largest = LARGEST_SIDE / size[0].max(size[1]) as f64;
        let scale = scale(0)?.min(scale(1)?).min(MOST_ENLARGED).min(largest);
        Some(size.map(|side| ((side as f64 * scale).round() as usize).max(1)))
    }
}

/// The part of the picture that is lit or hides something in any of the frames `numbers`, as small pictures of them show; `None` where none has any.
/// `exact` counts what is too dark for 8 bits too.
///
/// # Errors
/// Those of drawing.
pub(crate) fn lit(
    compiled: &Arc<CompiledScene>,
    plan: &Plan,
    numbers: &[i64],
    exact: bool,
    observer: &dyn JobObserver,
) -> Result<Option<Region>, JobError> {
    let whole = plan.scene().picture.size.map(|side| side as usize);
    let shrunk = shrinking(whole);
    let size = whole.map(|side| ((side as f64 / shrunk).round() as usize).max(1));
    let mut small = plan.at_size(size);
    (small.layers, small.aovs) = (false, false);
    // Half a code of 8 bits, in codes of 16, of one pixel alone among those that a small one stands for.
    let least = if exact { 1 } else { (128.0 / (shrunk * shrunk)).max(1.0) as u16 };
    let probe = LitRegionProbe { lit: Mutex::default(), view: plan.display, least };
    draw_frames(&mut Shot::open(compiled.clone(), Arc::new(small)), numbers, &Snapshots::default(), &probe, observer)?;
    let lit = probe.lit.into_inner().unwrap_or_else(PoisonError::into_inner);
    Ok((!lit.is_empty()).then(|| Region::of(&lit, size)))
}

/// How many times smaller pictures are that show what is lit: four times, unless they would be tiny or large.
fn shrinking(size: [usize; 2]) -> f64 {
    let longest = size[0].max(size[1]) as f64;
    longest / (0.25 * longest).clamp(128.0, 512.0).min(longest)
}

/// Gathers what is lit in any frame.
struct LitRegionProbe {
    lit: Mutex<Rect>,
    view: View,
    /// Least alpha that counts, in codes of 16 bits; display pixels have alpha where they have light.
    least: u16,
}

impl FrameSink for LitRegionProbe {
    fn finish(&self, _index: usize, frame: &mut Frame, _observer: &dyn Observer) -> Result<(), JobError> {
        let own = bounds(frame, &self.view, self.least);
        let mut lit = self.lit.lock().unwrap_or_else(PoisonError::into_inner);
        *lit = lit.union(&own);
        Ok(())
    }

    fn window(&self) -> usize {
        usize::MAX
    }
}

/// The smallest rectangle around all pixels of a frame whose alpha is `least` or more.
fn bounds(frame: &Frame, view: &View, least: u16) -> Rect {
    let (width, height) = (frame.beauty.width(), frame.beauty.height());
    if frame.opaque {
        return Rect::from_size(width, height);
    }
    let DisplayPixels::Sixteen(pixels) = display(frame, view, BitDepth::Sixteen, AlphaConvention::Linear).pixels else {
        return Rect::default();
    };
    let mut lit = Rect::default();
    for (y, row) in pixels.chunks_exact(width.max(1)).enumerate() {
        let is_lit = |pixel: &[u16; 4]| pixel[3] >= least;
        if let (Some(first), Some(last)) = (row.iter().position(is_lit), row.iter().rposition(is_lit)) {
            lit = lit.union(&Rect { x: first, y, width: last - first + 1, height: 1 });
        }
    }
    lit
}

#[cfg(test)]
mod tests {
    use bansho_base::image::Image;

    use super::*;
    use crate::job::testing;

    #[test]
    fn what_is_lit_or_hides_something_is_found() {
        let mut frame = testing::blank(&testing::plan(), 0);
        frame.beauty = Image::filled(9, 7, [0.0; 4]);
        frame.content = Rect::from_size(9, 7);
        let found = |frame: &Frame| bounds(frame, &View::DISPLAY, 1);
        assert!(found(&frame).is_empty());
        frame.beauty.pixels_mut()[2 * 9 + 3] = [0.5, 0.1, 0.0, 0.0];
        frame.beauty.pixels_mut()[4 * 9 + 6] = [0.0, 0.0, 0.0, 0.3];
        assert_eq!(found(&frame), Rect { x: 3, y: 2, width: 4, height: 3 });
        frame.opaque = true;
        assert_eq!(found(&frame), Rect::from_size(9, 7));
    }

    #[test]
    fn a_part_keeps_a_margin_and_even_sides_and_stays_within_its_picture() {
        let region = Region::of(&Rect { x: 30, y: 10, width: 20, height: 40 }, [128, 72]);
        let part = region.within([512, 288]);
        // A small pixel is four, and two are left free: 29 * 4 - 2 = 114, 9 * 4 - 2 = 34.
        assert_eq!(part, Rect { x: 114, y: 34, width: 92, height: 172 });
        let region = Region::of(&Rect { x: 0, y: 0, width: 128, height: 72 }, [128, 72]);
        assert_eq!(region.within([511, 287]), Rect::from_size(511, 287));
        for size in [[511, 287], [77, 33], [3, 3], [1, 1]] {
            let part = Region::of(&Rect { x: 60, y: 0, width: 9, height: 30 }, [128, 72]).within(size);
            assert!(part.right() <= size[0] && part.bottom() <= size[1] && !part.is_empty(), "{part:?}");
        }
    }

    #[test]
    fn a_picture_is_drawn_so_large_that_its_part_fills_a_tile() {
        let size = [512, 288];
        let region = Region::of(&Rect { x: 53, y: 8, width: 22, height: 54 }, [128, 72]);
        for most in [[256, 256], [128, 128], [64, 300], [100, 40]] {
            let picture = region.picture(size, most).unwrap();
            let part = region.within(picture);
            assert!(part.width <= most[0] && part.height <= most[1], "{most:?}: {part:?}");
            let fills = part.width + 8 > most[0] || part.height + 8 > most[1];
            assert!(fills, "{most:?}: {part:?} of {picture:?}");
        }
        // Never so large that a speck becomes a tile.
        let speck = Region::of(&Rect { x: 60, y: 30, width: 1, height: 1 }, [128, 72]);
        assert_eq!(speck.picture(size, [256, 256]), Some([1024, 576]));
        assert_eq!(speck.picture(size, [6, 256]), None);
    }

    #[test]
    fn small_pictures_are_neither_tiny_nor_large() {
        for (size, shrunk) in
            [([512, 288], 4.0), ([1280, 720], 4.0), ([64, 48], 1.0), ([256, 144], 2.0), ([8192, 100], 16.0)]
        {
            assert_eq!(shrinking(size), shrunk, "{size:?}");
        }
    }
}
