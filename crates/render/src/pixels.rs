//! Frames in buffers of the caller, for game engines, user interfaces and tools that upload or process pixels.
//!
//! | function | format of wgpu | per pixel | values |
//! | --- | --- | --- | --- |
//! | [`write_rgba16f`] | `Rgba16Float` | 4 x `f16` | premultiplied linear sRGB, without tone curve |
//! | [`write_rgba32f`] | `Rgba32Float` | 4 x `f32` | premultiplied, in a linear [`ColorSpace`], not clamped |
//! | [`write_rgba8`] | `Rgba8UnormSrgb`, `Rgba8Unorm` | 4 x `u8` | display codes, straight or premultiplied |
//! | [`write_depth32f`] | `R32Float` | `f32` | depth in meters |
//! | [`write_channel32f`] | `R32Float` | `f32` | a layer or AOV by name |
//!
//! Every buffer has rows from the top without gaps between them, pixels from the left, and channels in the order red, green, blue, alpha. Blend
//! premultiplied pixels with `out = color + (1 - alpha) background` (in wgpu `BlendState::PREMULTIPLIED_ALPHA_BLENDING`): fire and aurora mostly
//! add light, which straight alpha cannot express.
//!
//! Only the pixels of [`nonzero_rect`] are converted, the others are set to zero. Up to 256 x 256 of them (128 x 128 for display
//! codes) are converted on the calling thread without any heap allocation, more in the rayon pool of the caller. Both give the same bytes.

pub use bansho_base::color::pixel_formats::f16;
use bansho_base::host::parallel::prelude::*;
use bansho_base::{
    color::{AlphaMode, ColorSpace, DisplayCode, LinearTransform, View},
    frame::{Frame, FrameHeader},
    image::Rect,
};
use fearless_simd::Level;

/// Rows that one parallel task converts.
const TASK_ROWS: usize = 16;

/// Pixels up to which light is converted on the calling thread, and pixels up to which display codes are. Either takes about 0.05 ms; waking other threads
/// takes a fifth of that, and in a game they have work of their own.
const SERIAL_LIGHT: usize = 256 * 256;
const SERIAL_CODES: usize = 128 * 128;

/// Error: a buffer does not have the length that the frame needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the buffer has {found} values of type {element}, but a frame of {width} x {height} pixels with {channels} {} each needs {expected}: \
     rows from the top without gaps, width x height x channels",
    if *.channels == 1 { "channel" } else { "channels" }
)]
pub struct BufferLengthError {
    /// Width x height x channels.
    pub expected: usize,
    /// Length of the buffer.
    pub found: usize,
    /// Width of the frame in pixels.
    pub width: usize,
    /// Height of the frame in pixels.
    pub height: usize,
    /// Values per pixel.
    pub channels: usize,
    /// Type of the values.
    pub element: &'static str,
}

/// Why a channel cannot be written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ChannelError {
    /// The buffer has the wrong length.
    #[error(transparent)]
    BufferLength(#[from] BufferLengthError),
    /// The frame has no channel of that name.
    #[error("the frame has no channel `{name}` (it has: {})", available_names(.available))]
    UnknownChannel {
        /// The requested name.
        name: String,
        /// Names of all channels of the frame.
        available: Vec<String>,
    },
}

fn available_names(names: &[String]) -> String {
    if names.is_empty() {
        "none; layers and AOVs are drawn if the plan asks for them".to_owned()
    } else {
        names.join(", ")
    }
}

/// The rectangle outside of which all pixels written from `frame` are zero, in pixels of the frame; empty if all are.
///
/// A caller whose texture contains an earlier frame uploads the [`union`](Rect::union) of both rectangles, for which no copy is needed: with
/// `Queue::write_texture` of wgpu the offset is `(rect.y * width + rect.x) * bytes_per_pixel` and the bytes per row are those of the whole buffer.
#[must_use]
pub fn nonzero_rect(frame: &Frame) -> Rect {
    let all = Rect::from_size(frame.beauty.width(), frame.beauty.height());
    // An opaque pixel without light is not zero, since its alpha is 1.
    if frame.opaque { all } else { frame.content.intersection(&all) }
}

/// Writes premultiplied linear sRGB (Rec. 709 primaries, D65) as half floats, which engines blend (`Rgba16Float`): white balance of the camera as in
/// [`display`](crate::display::display), without tone curve, 1.0 is display white.
///
/// Components below 0 (colors outside sRGB) and NaN become 0; components above 65504 and infinity become 65504, since bloom would spread infinities.
/// Alpha is within 0 and 1. Values are rounded to nearest, ties to even. `pixels` has width x height x 4 values.
///
/// # Errors
/// The buffer does not have that length; nothing is written.
///
/// ```
/// use bansho_base::frame::Frame;
/// use bansho_render::pixels::{BufferLengthError, f16, write_rgba16f};
///
/// fn texture(frame: &Frame, pixels: &mut Vec<f16>) -> Result<(), BufferLengthError> {
///     // The buffer is reused for every frame.
///     pixels.resize(frame.beauty.width() * frame.beauty.height() * 4, f16::ZERO);
///     write_rgba16f(frame, pixels)
/// }
/// ```
pub fn write_rgba16f(frame: &Frame, pixels: &mut [f16]) -> Result<(), BufferLengthError> {
    check_length(frame, 4, pixels)?;
    let (level, transform) = (bansho_base::math::simd::level(), transform(frame, ColorSpace::LinearSrgb));
    convert(frame, SERIAL_LIGHT, Background::Fill([f16::ZERO; 4]), pixels.as_chunks_mut().0, |_, light, out| {
        transform.rgba16f_row(level, light, out);
    });
    Ok(())
}

/// Writes premultiplied pixels as single floats in the linear color space `space` (`Rgba32Float`): white balance of the camera as in
/// [`display`](crate::display::display), without tone curve, 1.0 is display white.
///
/// Nothing is clamped: components are negative where a color lies outside `space`. Without white balance, [`ColorSpace::AcesCg`] copies the frame.
/// `pixels` has width x height x 4 values.
///
/// # Errors
/// The buffer does not have that length; nothing is written.
pub fn write_rgba32f(frame: &Frame, space: ColorSpace, pixels: &mut [f32]) -> Result<(), BufferLengthError> {
    check_length(frame, 4, pixels)?;
    let (level, transform) = (bansho_base::math::simd::level(), transform(frame, space));
    convert(frame, SERIAL_LIGHT, Background::Fill([0.0; 4]), pixels.as_chunks_mut().0, |_, light, out| {
        transform.rgba32f_row(level, light, out);
    });
    Ok(())
}

/// Writes 8-bit display codes: white balance of the camera, view transform, alpha in the mode `alpha`, sRGB encoding, dither.
///
/// With [`AlphaMode::Straight`] these are the bytes of [`display`](crate::display::display) with 8 bits. [`AlphaMode::Premultiplied`] with
/// [`AlphaConvention::Linear`](bansho_base::color::AlphaConvention::Linear) is for `Rgba8UnormSrgb` textures, with [`AlphaConvention::Encoded`](bansho_base::color::AlphaConvention::Encoded) for programs that blend codes, such as egui
/// (`Color32`). The view `raw` encodes nothing, so its alpha is linear. `pixels` has width x height x 4 bytes.
///
/// # Errors
/// The buffer does not have that length; nothing is written.
pub fn write_rgba8(frame: &Frame, view: &View, alpha: AlphaMode, pixels: &mut [u8]) -> Result<(), BufferLengthError> {
    check_length(frame, 4, pixels)?;
    write_codes(frame, view, alpha, Background::Fill([0; 4]), pixels.as_chunks_mut().0);
    Ok(())
}

/// Writes the depth of the nearest object drawn, in meters; infinity where there is none, and everywhere if the frame has no depth. It is measured along
/// the camera's axis with a perspective lens, and from the camera with fisheye and panorama. `depth_m` has width x height values.
///
/// # Errors
/// The buffer does not have that length; nothing is written.
pub fn write_depth32f(frame: &Frame, depth_m: &mut [f32]) -> Result<(), BufferLengthError> {
    check_length(frame, 1, depth_m)?;
    match &frame.depth {
        Some(depth) => depth_m.copy_from_slice(depth),
        None => depth_m.fill(f32::INFINITY),
    }
    Ok(())
}

/// Writes the layer channel or AOV called `name`, such as `torch.temperature_k`, in its own unit. `values` has width x height values.
///
/// # Errors
/// The frame has no channel of that name, or the buffer does not have that length; nothing is written.
pub fn write_channel32f(frame: &Frame, name: &str, values: &mut [f32]) -> Result<(), ChannelError> {
    let Some(channel) = frame.channels.iter().find(|channel| channel.name == name) else {
        let available = frame.channels.iter().map(|channel| channel.name.clone()).collect();
        return Err(ChannelError::UnknownChannel { name: name.to_owned(), available });
    };
    check_length(frame, 1, values)?;
    values.copy_from_slice(&channel.values);
    Ok(())
}

/// Fails unless `buffer` has as many values as the frame has pixels times channels.
fn check_length<T>(frame: &Frame, channels: usize, buffer: &[T]) -> Result<(), BufferLengthError> {
    let (width, height) = (frame.beauty.width(), frame.beauty.height());
    let (expected, found) = (width * height * channels, buffer.len());
    let element = std::any::type_name::<T>().rsplit("::").next().unwrap_or_default();
    if found == expected {
        Ok(())
    } else {
        Err(BufferLengthError { expected, found, width, height, channels, element })
    }
}

fn transform(frame: &Frame, space: ColorSpace) -> LinearTransform {
    LinearTransform::new(space, frame.header.white_balance_k.map(f64::from))
}

/// Writes display codes.
pub(crate) fn write_codes<C: DisplayCode + Send + Sync>(
    frame: &Frame,
    view: &View,
    alpha: AlphaMode,
    background: Background<[C; 4]>,
    pixels: &mut [[C; 4]],
) {
    let conversion = CodeConversion::new(&frame.header, view, (!frame.opaque).then_some(alpha));
    let left = nonzero_rect(frame).x;
    convert(frame, SERIAL_CODES, background, pixels, |y, light, out| conversion.row(y, left, light, out));
}

/// The conversion of the light of a frame to display codes. Dither depends on the position in the whole picture, so that a crop has the same pixels.
pub(crate) struct CodeConversion {
    /// The view with the white balance of the camera.
    view: View,
    /// `None` if the picture is opaque.
    alpha: Option<AlphaMode>,
    /// Position of the pixels in the whole picture.
    data_origin: [i64; 2],
    level: Level,
}

impl CodeConversion {
    /// For a frame with this header; without `alpha` it is opaque.
    pub(crate) fn new(header: &FrameHeader, view: &View, alpha: Option<AlphaMode>) -> Self {
        let view = view.with_white_balance(header.white_balance_k.map(f64::from));
        Self { view, alpha, data_origin: header.data_origin, level: bansho_base::math::simd::level() }
    }

    /// Whether the picture is opaque.
    pub(crate) fn is_opaque(&self) -> bool {
        self.alpha.is_none()
    }

    /// Converts pixels of row `y` of the frame from column `x` on.
    pub(crate) fn row<C: DisplayCode>(&self, y: usize, x: usize, light: &[[f32; 4]], codes: &mut [[C; 4]]) {
        let [x0, y0] = self.data_origin;
        self.view.display_row_with_mode(self.level, light, y0 + y as i64, x0 + x as i64, self.alpha, codes);
    }
}

/// What becomes of pixels outside of [`nonzero_rect`].
#[derive(Clone, Copy)]
pub(crate) enum Background<T> {
    /// They are zero already.
    IsZero,
    /// They are set to this.
    Fill(T),
}

/// Calls `convert` with the number, the light and the output of each row of [`nonzero_rect`]; on the calling thread if that has at most `serial_pixels`
/// pixels.
fn convert<T: Copy + Send + Sync>(
    frame: &Frame,
    serial_pixels: usize,
    background: Background<T>,
    pixels: &mut [T],
    convert: impl Fn(usize, &[[f32; 4]], &mut [T]) + Sync,
) {
    let (width, rect) = (frame.beauty.width(), nonzero_rect(frame));
    if pixels.is_empty() {
        return;
    }
    if rect.width * rect.height <= serial_pixels {
        convert_rows(frame, rect, 0, background, pixels, &convert);
        return;
    }
    pixels.par_chunks_mut(width * TASK_ROWS).enumerate().for_each(|(task, rows)| {
        convert_rows(frame, rect, task * TASK_ROWS, background, rows, &convert);
    });
}

/// [`convert`] for the `rows` of a frame from row `first` on, of which all pixels outside of `rect` are background.
fn convert_rows<T: Copy>(
    frame: &Frame,
    rect: Rect,
    first: usize,
    background: Background<T>,
    rows: &mut [T],
    convert: impl Fn(usize, &[[f32; 4]], &mut [T]),
) {
    for (index, row) in rows.chunks_mut(frame.beauty.width()).enumerate() {
        let y = first + index;
        let is_background = !(rect.y..rect.bottom()).contains(&y);
        let columns = if is_background { 0..0 } else { rect.x..rect.right() };
        if let Background::Fill(value) = background {
            row[..columns.start].fill(value);
            row[columns.end..].fill(value);
        }
        if !is_background {
            convert(y, &frame.beauty.row(y)[columns.clone()], &mut row[columns]);
        }
    }
}
