//! The view transform of whole frames, for display formats.

use bansho_base::{
    color::{AlphaConvention, AlphaMode, DisplayCode, View},
    frame::{DisplayImage, DisplayPixels, Frame},
};

use crate::pixels::{Background, write_codes};

bansho_base::choice! {
    /// Bits of each channel of a display format.
    pub enum BitDepth {
        /// 8 bits, dithered.
        Eight = "8",
        /// 16 bits.
        Sixteen = "16",
    }
}

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

/// Display codes of the pixels, in rows.
pub(crate) fn codes<C: DisplayCode + Send + Sync>(frame: &Frame, view: &View, alpha: AlphaConvention) -> Vec<[C; 4]> {
    let mut pixels = vec![[C::default(); 4]; frame.beauty.pixels().len()];
    write_codes(frame, view, AlphaMode::Straight(alpha), Background::IsZero, &mut pixels);
    pixels
}
