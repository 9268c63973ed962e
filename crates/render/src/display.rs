//! The view transform of whole frames, for display formats.

use bansho_base::{
    color::{AlphaConvention, AlphaMode, DisplayCode, View},
    frame::{DisplayEncoding, DisplayImage, DisplayPixels, Frame, FrameHeader, PhenomenonMetadata},
    host::observer::Cancelled,
    image::Rect,
};

pub use bansho_base::color::BitDepth;

use crate::{
    composite::{
        composition::{Composition, STRIP_ROWS},
        strips::{StripLight, StripPixels, draw_strips},
    },
    pixels::{Background, CodeConversion, write_codes},
    target::{Drawing, Target, sealed::Sealed},
};

/// The target for display codes, and how light becomes display pixels. The default is that of `bansho render` for PNG files. A frame is converted strip by strip
/// while it is drawn, so that its light is not in memory as a whole, unless hot air refracts it or the plan requests depth, layers or AOVs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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

impl Sealed for DisplayOptions {}

impl Target for DisplayOptions {
    type Frame = DisplayFrame;

    fn of_light(&self, mut light: Frame, spare: &mut Option<Frame>) -> DisplayFrame {
        // Over black, premultiplied light is unchanged.
        light.opaque |= self.over_black;
        let image = display(&light, &self.view, self.depth, self.alpha);
        let (header, metadata) = (light.header.clone(), std::mem::take(&mut light.metadata));
        *spare = Some(light);
        DisplayFrame { header, image, metadata }
    }

    fn draw(&self, drawing: Drawing, recycled: &mut Option<Frame>) -> Result<DisplayFrame, Cancelled> {
        if drawing.needs_light() {
            let light = drawing.light(recycled.take())?;
            return Ok(self.of_light(light, recycled));
        }
        let Drawing { composition, header, metadata, .. } = drawing;
        let image = self.draw_image(composition, &header)?;
        Ok(DisplayFrame { header, image, metadata })
    }
}

impl DisplayOptions {
    /// Draws the composition of a frame with this header, and converts it strip by strip.
    fn draw_image(&self, composition: &Composition, header: &FrameHeader) -> Result<DisplayImage, Cancelled> {
        let alpha = self.view.alpha_convention(self.alpha);
        let opaque = composition.is_opaque() || self.over_black;
        let conversion = CodeConversion::new(header, &self.view, (!opaque).then_some(AlphaMode::Straight(alpha)));
        let pixels = match self.depth {
            BitDepth::Eight => DisplayPixels::Eight(draw_codes(composition, &conversion)?),
            BitDepth::Sixteen => DisplayPixels::Sixteen(draw_codes(composition, &conversion)?),
        };
        let Rect { width, height, .. } = composition.view.window;
        Ok(DisplayImage { width, height, opaque, alpha, encoding: encoding_in(&self.view), pixels })
    }
}

/// Draws the codes of the whole window.
fn draw_codes<C: DisplayCode + Send + Sync>(
    composition: &Composition,
    conversion: &CodeConversion,
) -> Result<Vec<[C; 4]>, Cancelled> {
    let window = composition.view.window;
    let mut codes = vec![[C::default(); 4]; window.width * window.height];
    let strips = codes.chunks_mut(STRIP_ROWS * window.width.max(1));
    draw_strips(composition, strips.map(|codes| CodeStrip { codes, conversion, window }).collect())?;
    Ok(codes)
}

/// The display codes of a strip, row by row. They are zero where nothing is drawn, unless the picture is opaque.
struct CodeStrip<'a, C> {
    codes: &'a mut [[C; 4]],
    conversion: &'a CodeConversion,
    window: Rect,
}

impl<C> CodeStrip<'_, C> {
    /// The pixels of which there is light: where anything is drawn, or all, since an opaque pixel without light has a code too.
    fn converted_rect(&self, strip: Rect, drawn: Rect) -> Rect {
        if self.conversion.is_opaque() { strip } else { drawn }
    }
}

impl<C: DisplayCode + Send> StripPixels for CodeStrip<'_, C> {
    fn light<'a>(&'a mut self, strip: Rect, drawn: Rect, buffer: &'a mut Vec<[f32; 4]>) -> StripLight<'a> {
        let rect = self.converted_rect(strip, drawn);
        buffer.resize(rect.width * rect.height, [0.0; 4]);
        if rect != drawn {
            buffer.fill([0.0; 4]);
        }
        StripLight { rect, beauty: buffer, depth: &mut [], drawn: &mut [] }
    }

    fn convert(&mut self, strip: Rect, drawn: Rect, buffer: &[[f32; 4]]) {
        let rect = self.converted_rect(strip, drawn);
        for (row, light) in buffer.chunks_exact(rect.width.max(1)).enumerate() {
            let y = rect.y + row;
            let first = (y - strip.y) * strip.width + rect.x - strip.x;
            let codes = &mut self.codes[first..][..rect.width];
            self.conversion.row(y - self.window.y, rect.x - self.window.x, light, codes);
        }
    }
}

/// The frame's beauty as display pixels: white balance of the camera, view transform, straight alpha in the convention `alpha`, sRGB
/// encoding, dither. The view `raw` encodes nothing, so its alpha is linear. Values below 0 and NaN become 0, in alpha too; infinity becomes
/// the brightest value.
pub fn display(frame: &Frame, view: &View, depth: BitDepth, alpha: AlphaConvention) -> DisplayImage {
    let alpha = view.alpha_convention(alpha);
    let pixels = match depth {
        BitDepth::Eight => DisplayPixels::Eight(codes(frame, view, alpha)),
        BitDepth::Sixteen => DisplayPixels::Sixteen(codes(frame, view, alpha)),
    };
    let (width, height) = (frame.beauty.width(), frame.beauty.height());
    DisplayImage { width, height, opaque: frame.opaque, alpha, encoding: encoding_in(view), pixels }
}

/// What the codes of this view stand for.
fn encoding_in(view: &View) -> DisplayEncoding {
    if *view == View::RAW { DisplayEncoding::LinearAcescg } else { DisplayEncoding::Srgb }
}

/// Display codes of the pixels, in rows.
fn codes<C: DisplayCode + Send + Sync>(frame: &Frame, view: &View, alpha: AlphaConvention) -> Vec<[C; 4]> {
    let mut pixels = vec![[C::default(); 4]; frame.beauty.pixels().len()];
    write_codes(frame, view, AlphaMode::Straight(alpha), Background::IsZero, &mut pixels);
    pixels
}
