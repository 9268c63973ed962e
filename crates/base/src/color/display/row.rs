//! The view applied to rows of pixels. Every pixel is computed by the same scalar function. Under `dispatch!` the compiler vectorizes the
//! loops; since no operation crosses lanes, every vector width gives the same bits.

use super::{
    alpha::{AlphaConvention, AlphaMode},
    gamut::{acescg_from_display, display_from_acescg},
    quantize::{
        DisplayCode, dither_phase, encoded_alpha_codes, linear_alpha_codes, opaque_codes, premultiplied_encoded_codes,
        premultiplied_linear_codes,
    },
    tone::ToneCurve,
    transfer::{clamp_components, clamp_unit, decode_srgb_code_or_value},
};
use crate::{color::space::acescg_from_srgb, math::approximations};

/// Pixels processed together: a whole number of vectors at any width.
const BLOCK: usize = 32;

/// Picture coordinates of a row's first pixel.
#[derive(Clone, Copy)]
pub(super) struct PixelPosition {
    pub(super) x: u32,
    pub(super) y: u32,
}

type Planes = [[f32; BLOCK]; 4];

/// Scene light to display light, and back. A trait instead of a closure: closures cannot be forced inline, and code that is not inlined is not vectorized.
pub(super) trait DisplayTransform {
    /// Exposed ACEScg to linear display light within 0..=1. Never NaN.
    fn display_from_acescg(&self, acescg: [f32; 3]) -> [f32; 3];

    /// The exposed ACEScg that is shown as linear sRGB, which is clamped to 0..=1.
    fn acescg_from_display(&self, display: [f32; 3]) -> [f32; 3];
}

/// A transform whose inverse is a function of each channel, and then a mixture of the channels. The channels of 8-bit codes are in a table.
pub(super) trait ChannelInverse: DisplayTransform {
    /// The channels of the light of all sRGB codes.
    fn channels_of_codes(&self) -> &'static [f32; 256];

    /// The exposed ACEScg of channels.
    fn acescg_from_channels(&self, channels: [f32; 3]) -> [f32; 3];
}

/// The largest component by a tone curve, with saturation and hue of the view `neutral`.
impl DisplayTransform for ToneCurve {
    #[inline(always)]
    fn display_from_acescg(&self, acescg: [f32; 3]) -> [f32; 3] {
        display_from_acescg(self, acescg)
    }

    #[inline(always)]
    fn acescg_from_display(&self, display: [f32; 3]) -> [f32; 3] {
        acescg_from_display(self, display)
    }
}

/// ACEScg within 0..=1, which is not converted to sRGB.
pub(super) struct Clamped;

impl DisplayTransform for Clamped {
    #[inline(always)]
    fn display_from_acescg(&self, acescg: [f32; 3]) -> [f32; 3] {
        clamp_components(acescg)
    }

    #[inline(always)]
    fn acescg_from_display(&self, display: [f32; 3]) -> [f32; 3] {
        acescg_from_srgb(clamp_components(display))
    }
}

/// How a pixel of display light is quantized to codes. A trait for the same reason as [`DisplayTransform`].
trait PixelEncoding {
    /// A faster encoding that gives the same codes where alpha is 1.
    type OpaqueEncoding: PixelEncoding;
    /// Whether empty pixels are opaque black.
    const OPAQUE: bool;
    fn codes<C: DisplayCode>(light: [f32; 3], alpha: f32, phase: u32) -> [u32; 4];
}

struct Opaque<const RAW: bool>;

impl<const RAW: bool> PixelEncoding for Opaque<RAW> {
    type OpaqueEncoding = Self;
    const OPAQUE: bool = true;
    #[inline(always)]
    fn codes<C: DisplayCode>(light: [f32; 3], _alpha: f32, phase: u32) -> [u32; 4] {
        opaque_codes::<C, RAW>(light, phase)
    }
}

struct LinearAlpha<const RAW: bool>;

impl<const RAW: bool> PixelEncoding for LinearAlpha<RAW> {
    type OpaqueEncoding = Opaque<RAW>;
    const OPAQUE: bool = false;
    #[inline(always)]
    fn codes<C: DisplayCode>(light: [f32; 3], alpha: f32, phase: u32) -> [u32; 4] {
        linear_alpha_codes::<C, RAW>(light, alpha, phase)
    }
}

struct EncodedAlpha;

impl PixelEncoding for EncodedAlpha {
    type OpaqueEncoding = Opaque<false>;
    const OPAQUE: bool = false;
    #[inline(always)]
    fn codes<C: DisplayCode>(light: [f32; 3], alpha: f32, phase: u32) -> [u32; 4] {
        encoded_alpha_codes::<C>(light, alpha, phase)
    }
}

struct PremultipliedLinear<const RAW: bool>;

impl<const RAW: bool> PixelEncoding for PremultipliedLinear<RAW> {
    type OpaqueEncoding = Opaque<RAW>;
    const OPAQUE: bool = false;
    #[inline(always)]
    fn codes<C: DisplayCode>(light: [f32; 3], alpha: f32, phase: u32) -> [u32; 4] {
        premultiplied_linear_codes::<C, RAW>(light, alpha, phase)
    }
}

struct PremultipliedEncoded;

impl PixelEncoding for PremultipliedEncoded {
    type OpaqueEncoding = Opaque<false>;
    const OPAQUE: bool = false;
    #[inline(always)]
    fn codes<C: DisplayCode>(light: [f32; 3], alpha: f32, phase: u32) -> [u32; 4] {
        premultiplied_encoded_codes::<C>(light, alpha, phase)
    }
}

/// Converts a row by a transform to sRGB-encoded codes.
#[inline(always)]
pub(super) fn encode_row<C: DisplayCode, V: DisplayTransform>(
    view: &V,
    pixels: &[[f32; 4]],
    position: PixelPosition,
    alpha: Option<AlphaMode>,
    out: &mut [[C; 4]],
) {
    use AlphaConvention::{Encoded, Linear};
    use AlphaMode::{Premultiplied, Straight};
    match alpha {
        None => convert::<C, V, Opaque<false>>(view, pixels, position, out),
        Some(Straight(Linear)) => convert::<C, V, LinearAlpha<false>>(view, pixels, position, out),
        Some(Straight(Encoded)) => convert::<C, V, EncodedAlpha>(view, pixels, position, out),
        Some(Premultiplied(Linear)) => {
            convert::<C, V, PremultipliedLinear<false>>(view, pixels, position, out);
        }
        Some(Premultiplied(Encoded)) => {
            convert::<C, V, PremultipliedEncoded>(view, pixels, position, out);
        }
    }
}

/// Converts a row without tone curve or encoding. Alpha is then always for linear blending.
#[inline(always)]
pub(super) fn encode_raw_row<C: DisplayCode>(
    pixels: &[[f32; 4]],
    position: PixelPosition,
    alpha: Option<AlphaMode>,
    out: &mut [[C; 4]],
) {
    match alpha {
        None => convert::<C, Clamped, Opaque<true>>(&Clamped, pixels, position, out),
        Some(AlphaMode::Straight(_)) => convert::<C, Clamped, LinearAlpha<true>>(&Clamped, pixels, position, out),
        Some(AlphaMode::Premultiplied(_)) => {
            convert::<C, Clamped, PremultipliedLinear<true>>(&Clamped, pixels, position, out);
        }
    }
}

#[inline(always)]
fn convert<C: DisplayCode, V: DisplayTransform, K: PixelEncoding>(
    view: &V,
    pixels: &[[f32; 4]],
    mut position: PixelPosition,
    out: &mut [[C; 4]],
) {
    let count = pixels.len().min(out.len());
    let mut padded = [[0.0; 4]; BLOCK];
    for (input, output) in pixels[..count].chunks(BLOCK).zip(out[..count].chunks_mut(BLOCK)) {
        let block = if let Ok(full_block) = input.try_into() {
            full_block
        } else {
            padded[..input.len()].copy_from_slice(input);
            &padded
        };
        let mut codes = [[C::default(); 4]; BLOCK];
        if is_empty(block) {
            if K::OPAQUE {
                codes = [C::from_integers([0, 0, 0, C::MAX_CODE as u32]); BLOCK];
            }
        } else {
            convert_block::<C, V, K>(view, block, position, &mut codes);
        }
        output.copy_from_slice(&codes[..output.len()]);
        position.x = position.x.wrapping_add(BLOCK as u32);
    }
}

/// Whether every component is zero, of either sign.
#[inline(always)]
pub(in crate::color) fn is_empty<const N: usize>(block: &[[f32; 4]; N]) -> bool {
    let mut bits = 0;
    for value in block.as_flattened() {
        bits |= value.to_bits();
    }
    bits << 1 == 0
}

#[inline(always)]
fn convert_block<C: DisplayCode, V: DisplayTransform, K: PixelEncoding>(
    view: &V,
    block: &[[f32; 4]; BLOCK],
    position: PixelPosition,
    out: &mut [[C; 4]; BLOCK],
) {
    let light = block_to_display(view, &to_planes(block));
    // Where alpha is 1, as in front of a sky, both encodings give the same codes, and the opaque one is faster.
    let codes = if is_opaque(block) {
        encode_block::<C, K::OpaqueEncoding>(&light, position)
    } else {
        encode_block::<C, K>(&light, position)
    };
    for (i, pixel) in out.iter_mut().enumerate() {
        *pixel = C::from_integers([codes[0][i], codes[1][i], codes[2][i], codes[3][i]]);
    }
}

/// Whether every alpha is 1.
#[inline(always)]
fn is_opaque(block: &[[f32; 4]; BLOCK]) -> bool {
    let mut opaque = true;
    for pixel in block {
        opaque &= pixel[3] >= 1.0;
    }
    opaque
}

#[inline(always)]
fn encode_block<C: DisplayCode, K: PixelEncoding>(light: &Planes, position: PixelPosition) -> [[u32; BLOCK]; 4] {
    let mut codes = [[0; BLOCK]; 4];
    for i in 0..BLOCK {
        let phase = dither_phase(position.x.wrapping_add(i as u32), position.y);
        let pixel = K::codes::<C>([light[0][i], light[1][i], light[2][i]], light[3][i], phase);
        (codes[0][i], codes[1][i], codes[2][i], codes[3][i]) = (pixel[0], pixel[1], pixel[2], pixel[3]);
    }
    codes
}

#[inline(always)]
fn to_planes(block: &[[f32; 4]; BLOCK]) -> Planes {
    let mut planes = [[0.0; BLOCK]; 4];
    for (i, pixel) in block.iter().enumerate() {
        (planes[0][i], planes[1][i], planes[2][i], planes[3][i]) = (pixel[0], pixel[1], pixel[2], pixel[3]);
    }
    planes
}

#[inline(always)]
fn block_to_display<V: DisplayTransform>(view: &V, scene: &Planes) -> Planes {
    let mut light = [[0.0; BLOCK]; 4];
    for i in 0..BLOCK {
        let rgb = view.display_from_acescg([scene[0][i], scene[1][i], scene[2][i]]);
        (light[0][i], light[1][i], light[2][i], light[3][i]) = (rgb[0], rgb[1], rgb[2], scene[3][i]);
    }
    light
}

/// Linear display sRGB to exposed ACEScg by the inverse of a transform, in place; the fourth component is unchanged.
#[inline(always)]
pub(super) fn to_scene<V: DisplayTransform>(view: &V, pixels: &mut [[f32; 4]]) {
    for pixels in pixels.chunks_mut(BLOCK) {
        let mut block = [[0.0; 4]; BLOCK];
        block[..pixels.len()].copy_from_slice(pixels);
        let scene = block_to_scene(view, &to_planes(&block));
        for (i, pixel) in pixels.iter_mut().enumerate() {
            (pixel[0], pixel[1], pixel[2]) = (scene[0][i], scene[1][i], scene[2][i]);
        }
    }
}

/// sRGB-encoded values to exposed ACEScg by the inverse of a transform, in place; the fourth component is unchanged.
#[inline(always)]
pub(super) fn encoded_to_scene<V: ChannelInverse>(view: &V, pixels: &mut [[f32; 4]]) {
    let channels_of_codes = view.channels_of_codes();
    for pixels in pixels.chunks_mut(BLOCK) {
        let mut block = [[0.0; 4]; BLOCK];
        block[..pixels.len()].copy_from_slice(pixels);
        let (channels, are_codes) = channels_of_block(channels_of_codes, &to_planes(&block));
        let mut scene = [[0.0; BLOCK]; 4];
        if are_codes {
            for i in 0..BLOCK {
                let rgb = view.acescg_from_channels([channels[0][i], channels[1][i], channels[2][i]]);
                (scene[0][i], scene[1][i], scene[2][i]) = (rgb[0], rgb[1], rgb[2]);
            }
        } else {
            decode(&mut block);
            scene = block_to_scene(view, &to_planes(&block));
        }
        for (i, pixel) in pixels.iter_mut().enumerate() {
            (pixel[0], pixel[1], pixel[2]) = (scene[0][i], scene[1][i], scene[2][i]);
        }
    }
}

/// sRGB codes to exposed ACEScg by the inverse of a transform, with 1 as the fourth component.
#[inline(always)]
pub(super) fn codes_to_scene<V: ChannelInverse>(view: &V, codes: &[[u8; 4]], scene: &mut [[f32; 4]]) {
    let channels_of_codes = view.channels_of_codes();
    let count = codes.len().min(scene.len());
    for (codes, scene) in codes[..count].chunks(BLOCK).zip(scene[..count].chunks_mut(BLOCK)) {
        let (mut channels, mut light) = ([[0.0; BLOCK]; 3], [[0.0; BLOCK]; 3]);
        for (i, pixel) in codes.iter().enumerate() {
            for c in 0..3 {
                channels[c][i] = channels_of_codes[usize::from(pixel[c])];
            }
        }
        for i in 0..BLOCK {
            let rgb = view.acescg_from_channels([channels[0][i], channels[1][i], channels[2][i]]);
            (light[0][i], light[1][i], light[2][i]) = (rgb[0], rgb[1], rgb[2]);
        }
        for (i, pixel) in scene.iter_mut().enumerate() {
            *pixel = [light[0][i], light[1][i], light[2][i], 1.0];
        }
    }
}

/// The channels of the codes that are nearest to values, and whether all values are those of codes.
#[inline(always)]
fn channels_of_block(channels_of_codes: &[f32; 256], values: &Planes) -> (Planes, bool) {
    let (mut channels, mut are_codes) = ([[0.0; BLOCK]; 4], true);
    for c in 0..3 {
        let mut codes = [0_i32; BLOCK];
        for i in 0..BLOCK {
            codes[i] = approximations::round_to_i32(clamp_unit(values[c][i]) * 255.0);
            are_codes &= codes[i] as f32 / 255.0 == values[c][i];
        }
        for i in 0..BLOCK {
            // Within the table, so that no bounds are checked.
            channels[c][i] = channels_of_codes[(codes[i] & 0xff) as usize];
        }
    }
    (channels, are_codes)
}

/// sRGB-encoded values to linear sRGB, in place; the fourth component is unchanged. Not inlined: it calls scalar functions.
#[inline(never)]
pub(super) fn decode(pixels: &mut [[f32; 4]]) {
    for [r, g, b, _] in pixels {
        (*r, *g, *b) = (decode_srgb_code_or_value(*r), decode_srgb_code_or_value(*g), decode_srgb_code_or_value(*b));
    }
}

#[inline(always)]
fn block_to_scene<V: DisplayTransform>(view: &V, light: &Planes) -> Planes {
    let mut scene = [[0.0; BLOCK]; 4];
    for i in 0..BLOCK {
        let rgb = view.acescg_from_display([light[0][i], light[1][i], light[2][i]]);
        (scene[0][i], scene[1][i], scene[2][i]) = (rgb[0], rgb[1], rgb[2]);
    }
    scene
}
