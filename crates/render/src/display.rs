//! The view transform of whole frames, for display formats.

use bansho_base::{
    color::{AlphaConvention, DisplayCode, View},
    frame::{DisplayImage, DisplayPixels, Frame},
    host::parallel::prelude::*,
    image::Rect,
};
use fearless_simd::Level;

bansho_base::choice! {
    /// Bits of each channel of a display format.
    pub enum BitDepth {
        /// 8 bits, dithered.
        Eight = "8",
        /// 16 bits.
        Sixteen = "16",
    }
}

/// Rows that one parallel task converts.
const TASK_ROWS: usize = 16;

/// The frame's beauty as display pixels: white balance of the camera, view transform, straight alpha in the convention `alpha`, sRGB
/// encoding, dither. The view `raw` encodes nothing, so its alpha is linear. Values below 0 and NaN become 0, in alpha too; infinity becomes
/// the brightest value.
pub fn display(frame: &Frame, view: &View, depth: BitDepth, alpha: AlphaConvention) -> DisplayImage {
    let alpha = if *view == View::RAW { AlphaConvention::Linear } else { alpha };
    let pixels = match depth {
        BitDepth::Eight => DisplayPixels::Eight(codes(frame, view, alpha)),
        BitDepth::Sixteen => DisplayPixels::Sixteen(codes(frame, view, alpha)),
    };
    DisplayImage { width: frame.beauty.width(), height: frame.beauty.height(), opaque: frame.opaque, alpha, pixels }
}

/// Display codes of the pixels, in rows. Dither depends on the position in the whole picture, so that a crop has the same pixels.
pub(crate) fn codes<C: DisplayCode + Send + Sync>(frame: &Frame, view: &View, alpha: AlphaConvention) -> Vec<[C; 4]> {
    let alpha = (!frame.opaque).then_some(alpha);
    let (level, view) = (Level::new(), view.with_white_balance(frame.header.white_balance_k.map(f64::from)));
    let (width, height) = (frame.beauty.width(), frame.beauty.height());
    let [x0, y0] = frame.header.data_origin;
    // An empty pixel is code 0, unless it is opaque black.
    let shown = if frame.opaque { Rect::from_size(width, height) } else { frame.content };
    let mut pixels = vec![[C::default(); 4]; width * height];
    pixels.par_chunks_mut(width * TASK_ROWS).enumerate().for_each(|(task, chunk)| {
        for (row, out) in chunk.chunks_mut(width).enumerate() {
            let y = task * TASK_ROWS + row;
            if (shown.y..shown.bottom()).contains(&y) {
                let columns = shown.x..shown.right();
                let (light, out) = (&frame.beauty.row(y)[columns.clone()], &mut out[columns]);
                view.display_row(level, light, y0 + y as i64, x0 + shown.x as i64, alpha, out);
            }
        }
    });
    pixels
}
