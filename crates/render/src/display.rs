//! The view transform of whole frames, for display formats.

use bansho_base::{
    color::{AlphaConvention, AlphaMode, DisplayCode, View},
    frame::{DisplayEncoding, DisplayImage, DisplayPixels, Frame, FrameHeader, PhenomenonMetadata},
    host::observer::Cancelled,
};

pub use bansho_base::color::BitDepth;

use crate::{
    composite::{composition::Composition, strips},
    pixels::{Background, CodeConversion, write_codes},
};

/// How the light of a frame becomes display pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplayOptions {
    /// The view transform.
    pub view: View,
    /// Bits of each channel.
    pub depth: BitDepth,
    /// Convention of straight alpha; that of the view `raw` is always linear.
    pub alpha: AlphaConvention,
    /// Whether every picture is laid over black, so that it is opaque.
    pub over_black: bool,
}

/// A frame of which only the display pixels are kept.
#[derive(Clone, Debug, PartialEq)]
pub struct DisplayFrame {
    /// Metadata.
    pub header: FrameHeader,
    /// The display pixels.
    pub image: DisplayImage,
    /// Metadata of the phenomena that have any, if requested.
    pub metadata: Vec<PhenomenonMetadata>,
}

impl DisplayFrame {
    /// The display pixels of a frame, which is laid over black where the options say so.
    pub fn of_frame(frame: &mut Frame, options: &DisplayOptions) -> Self {
        // Over black, premultiplied light is unchanged.
        frame.opaque |= options.over_black;
        let image = display(frame, &options.view, options.depth, options.alpha);
        Self { header: frame.header.clone(), image, metadata: std::mem::take(&mut frame.metadata) }
    }

    /// Draws the composition of a frame with this header, and converts it strip by strip.
    pub(crate) fn draw(
        composition: &Composition,
        header: FrameHeader,
        options: &DisplayOptions,
    ) -> Result<Self, Cancelled> {
        let alpha = alpha_in(&options.view, options.alpha);
        let opaque = composition.is_opaque() || options.over_black;
        let conversion = CodeConversion::new(&header, &options.view, (!opaque).then_some(AlphaMode::Straight(alpha)));
        let window = composition.view.window;
        let (width, height) = (window.width, window.height);
        let pixels = match options.depth {
            BitDepth::Eight => DisplayPixels::Eight(drawn_codes(composition, &conversion)?),
            BitDepth::Sixteen => DisplayPixels::Sixteen(drawn_codes(composition, &conversion)?),
        };
        let encoding = encoding_in(&options.view);
        let image = DisplayImage { width, height, opaque, alpha, encoding, pixels };
        Ok(Self { header, image, metadata: Vec::new() })
    }
}

fn drawn_codes<C: DisplayCode + Send + Sync>(
    composition: &Composition,
    conversion: &CodeConversion,
) -> Result<Vec<[C; 4]>, Cancelled> {
    let window = composition.view.window;
    let mut codes = vec![[C::default(); 4]; window.width * window.height];
    strips::draw_codes(composition, conversion, &mut codes)?;
    Ok(codes)
}

/// The frame's beauty as display pixels: white balance of the camera, view transform, straight alpha in the convention `alpha`, sRGB
/// encoding, dither. The view `raw` encodes nothing, so its alpha is linear. Values below 0 and NaN become 0, in alpha too; infinity becomes
/// the brightest value.
pub fn display(frame: &Frame, view: &View, depth: BitDepth, alpha: AlphaConvention) -> DisplayImage {
    let alpha = alpha_in(view, alpha);
    let pixels = match depth {
        BitDepth::Eight => DisplayPixels::Eight(codes(frame, view, alpha)),
        BitDepth::Sixteen => DisplayPixels::Sixteen(codes(frame, view, alpha)),
    };
    let (width, height) = (frame.beauty.width(), frame.beauty.height());
    DisplayImage { width, height, opaque: frame.opaque, alpha, encoding: encoding_in(view), pixels }
}

/// The convention of alpha in this view: `raw` encodes nothing, so its alpha is linear.
fn alpha_in(view: &View, alpha: AlphaConvention) -> AlphaConvention {
    if *view == View::RAW { AlphaConvention::Linear } else { alpha }
}

/// What the codes of this view stand for.
fn encoding_in(view: &View) -> DisplayEncoding {
    if *view == View::RAW { DisplayEncoding::LinearAcescg } else { DisplayEncoding::Srgb }
}

/// Display codes of the pixels, in rows.
pub(crate) fn codes<C: DisplayCode + Send + Sync>(frame: &Frame, view: &View, alpha: AlphaConvention) -> Vec<[C; 4]> {
    let mut pixels = vec![[C::default(); 4]; frame.beauty.pixels().len()];
    write_codes(frame, view, AlphaMode::Straight(alpha), Background::IsZero, &mut pixels);
    pixels
}
