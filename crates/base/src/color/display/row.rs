//! Rows of pixels through the view. Every pixel takes the same scalar function; under `dispatch!` the compiler makes vectors of the
//! loops, and as no operation crosses lanes each vector width gives the same bits.

use super::{
    alpha::AlphaConvention,
    quantize::{DisplayCode, dither_phase, encoded_alpha_codes, linear_alpha_codes, opaque_codes},
    tone::ToneCurve,
    view::{clamped, shown, unshown},
};

/// Pixels that are handled together, a whole number of vectors at any width.
const BLOCK: usize = 32;

/// Picture coordinates of a row's first pixel.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) x: u32,
    pub(super) y: u32,
}

type Planes = [[f32; BLOCK]; 4];

/// Scene light to display light. A trait and no closure: closures cannot be forced inline, and what is not inlined is no vector code.
trait Show {
    fn show(&self, acescg: [f32; 3]) -> [f32; 3];
}

struct Toned<'a>(&'a ToneCurve);

impl Show for Toned<'_> {
    #[inline(always)]
    fn show(&self, acescg: [f32; 3]) -> [f32; 3] {
        shown(self.0, acescg)
    }
}

struct Clamped;

impl Show for Clamped {
    #[inline(always)]
    fn show(&self, acescg: [f32; 3]) -> [f32; 3] {
        clamped(acescg)
    }
}

/// How a pixel of display light becomes codes. A trait, as [`Show`] is.
trait Coding {
    /// What gives the same codes sooner where alpha is full.
    type Covered: Coding;
    /// Whether pixels without light are opaque black.
    const OPAQUE: bool;
    fn codes<C: DisplayCode>(light: [f32; 3], alpha: f32, phase: u32) -> [u32; 4];
}

struct Opaque<const RAW: bool>;

impl<const RAW: bool> Coding for Opaque<RAW> {
    type Covered = Self;
    const OPAQUE: bool = true;
    #[inline(always)]
    fn codes<C: DisplayCode>(light: [f32; 3], _alpha: f32, phase: u32) -> [u32; 4] {
        opaque_codes::<C, RAW>(light, phase)
    }
}

struct LinearAlpha<const RAW: bool>;

impl<const RAW: bool> Coding for LinearAlpha<RAW> {
    type Covered = Opaque<RAW>;
    const OPAQUE: bool = false;
    #[inline(always)]
    fn codes<C: DisplayCode>(light: [f32; 3], alpha: f32, phase: u32) -> [u32; 4] {
        linear_alpha_codes::<C, RAW>(light, alpha, phase)
    }
}

struct EncodedAlpha;

impl Coding for EncodedAlpha {
    type Covered = Opaque<false>;
    const OPAQUE: bool = false;
    #[inline(always)]
    fn codes<C: DisplayCode>(light: [f32; 3], alpha: f32, phase: u32) -> [u32; 4] {
        encoded_alpha_codes::<C>(light, alpha, phase)
    }
}

/// Rows through a tone curve, sRGB-encoded.
#[inline(always)]
pub(super) fn encoded<C: DisplayCode>(
    tone: &ToneCurve,
    pixels: &[[f32; 4]],
    place: Place,
    alpha: Option<AlphaConvention>,
    out: &mut [[C; 4]],
) {
    let view = Toned(tone);
    match alpha {
        None => convert::<C, Toned<'_>, Opaque<false>>(&view, pixels, place, out),
        Some(AlphaConvention::Linear) => convert::<C, Toned<'_>, LinearAlpha<false>>(&view, pixels, place, out),
        Some(AlphaConvention::Encoded) => convert::<C, Toned<'_>, EncodedAlpha>(&view, pixels, place, out),
    }
}

/// Rows of the numbers themselves, which have no encoding for alpha to be blended in.
#[inline(always)]
pub(super) fn raw<C: DisplayCode>(
    pixels: &[[f32; 4]],
    place: Place,
    alpha: Option<AlphaConvention>,
    out: &mut [[C; 4]],
) {
    match alpha {
        None => convert::<C, Clamped, Opaque<true>>(&Clamped, pixels, place, out),
        Some(_) => convert::<C, Clamped, LinearAlpha<true>>(&Clamped, pixels, place, out),
    }
}

#[inline(always)]
fn convert<C: DisplayCode, V: Show, K: Coding>(view: &V, pixels: &[[f32; 4]], mut place: Place, out: &mut [[C; 4]]) {
    let count = pixels.len().min(out.len());
    let mut padded = [[0.0; 4]; BLOCK];
    for (input, output) in pixels[..count].chunks(BLOCK).zip(out[..count].chunks_mut(BLOCK)) {
        let block = if let Ok(whole) = input.try_into() {
            whole
        } else {
            padded[..input.len()].copy_from_slice(input);
            &padded
        };
        let mut codes = [[C::default(); 4]; BLOCK];
        if is_empty(block) {
            if K::OPAQUE {
                codes = [C::from_wholes([0, 0, 0, C::LARGEST as u32]); BLOCK];
            }
        } else {
            convert_block::<C, V, K>(view, block, place, &mut codes);
        }
        output.copy_from_slice(&codes[..output.len()]);
        place.x = place.x.wrapping_add(BLOCK as u32);
    }
}

/// Whether every component is zero, of either sign.
#[inline(always)]
fn is_empty(block: &[[f32; 4]; BLOCK]) -> bool {
    let mut bits = 0;
    for value in block.as_flattened() {
        bits |= value.to_bits();
    }
    bits << 1 == 0
}

#[inline(always)]
fn convert_block<C: DisplayCode, V: Show, K: Coding>(
    view: &V,
    block: &[[f32; 4]; BLOCK],
    place: Place,
    out: &mut [[C; 4]; BLOCK],
) {
    let light = displayed(view, &planes(block));
    // Where alpha is full, as before a sky, both give the same codes, and the one sooner.
    let codes = if is_covered(block) { coded::<C, K::Covered>(&light, place) } else { coded::<C, K>(&light, place) };
    for (i, pixel) in out.iter_mut().enumerate() {
        *pixel = C::from_wholes([codes[0][i], codes[1][i], codes[2][i], codes[3][i]]);
    }
}

/// Whether every alpha is full.
#[inline(always)]
fn is_covered(block: &[[f32; 4]; BLOCK]) -> bool {
    let mut covered = true;
    for pixel in block {
        covered &= pixel[3] >= 1.0;
    }
    covered
}

#[inline(always)]
fn coded<C: DisplayCode, K: Coding>(light: &Planes, place: Place) -> [[u32; BLOCK]; 4] {
    let mut codes = [[0; BLOCK]; 4];
    for i in 0..BLOCK {
        let phase = dither_phase(place.x.wrapping_add(i as u32), place.y);
        let pixel = K::codes::<C>([light[0][i], light[1][i], light[2][i]], light[3][i], phase);
        (codes[0][i], codes[1][i], codes[2][i], codes[3][i]) = (pixel[0], pixel[1], pixel[2], pixel[3]);
    }
    codes
}

#[inline(always)]
fn planes(block: &[[f32; 4]; BLOCK]) -> Planes {
    let mut planes = [[0.0; BLOCK]; 4];
    for (i, pixel) in block.iter().enumerate() {
        (planes[0][i], planes[1][i], planes[2][i], planes[3][i]) = (pixel[0], pixel[1], pixel[2], pixel[3]);
    }
    planes
}

#[inline(always)]
fn displayed<V: Show>(view: &V, scene: &Planes) -> Planes {
    let mut light = [[0.0; BLOCK]; 4];
    for i in 0..BLOCK {
        let rgb = view.show([scene[0][i], scene[1][i], scene[2][i]]);
        (light[0][i], light[1][i], light[2][i], light[3][i]) = (rgb[0], rgb[1], rgb[2], scene[3][i]);
    }
    light
}

/// Linear display sRGB to the scene through a tone curve, in place; the fourth component stays.
#[inline(always)]
pub(super) fn to_scene(tone: &ToneCurve, pixels: &mut [[f32; 4]]) {
    for pixels in pixels.chunks_mut(BLOCK) {
        let mut block = [[0.0; 4]; BLOCK];
        block[..pixels.len()].copy_from_slice(pixels);
        let scene = undisplayed(tone, &planes(&block));
        for (i, pixel) in pixels.iter_mut().enumerate() {
            (pixel[0], pixel[1], pixel[2]) = (scene[0][i], scene[1][i], scene[2][i]);
        }
    }
}

#[inline(always)]
fn undisplayed(tone: &ToneCurve, light: &Planes) -> Planes {
    let mut scene = [[0.0; BLOCK]; 4];
    for i in 0..BLOCK {
        let rgb = unshown(tone, [light[0][i], light[1][i], light[2][i]]);
        (scene[0][i], scene[1][i], scene[2][i]) = (rgb[0], rgb[1], rgb[2]);
    }
    scene
}
