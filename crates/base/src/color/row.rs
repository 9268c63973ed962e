//! Rows of pixels through the view. Every pixel takes the same scalar function; under `dispatch!` the compiler makes vectors of the
//! loops, and as no operation crosses lanes each vector width gives the same bits.

use super::{
    quantise::{DisplayCode, dither_phase, opaque_codes, straight_codes},
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

#[inline(always)]
pub(super) fn encoded<C: DisplayCode, const OPAQUE: bool>(
    tone: &ToneCurve,
    pixels: &[[f32; 4]],
    place: Place,
    out: &mut [[C; 4]],
) {
    convert::<C, Toned<'_>, OPAQUE, false>(&Toned(tone), pixels, place, out);
}

#[inline(always)]
pub(super) fn raw<C: DisplayCode, const OPAQUE: bool>(pixels: &[[f32; 4]], place: Place, out: &mut [[C; 4]]) {
    convert::<C, Clamped, OPAQUE, true>(&Clamped, pixels, place, out);
}

#[inline(always)]
fn convert<C: DisplayCode, V: Show, const OPAQUE: bool, const RAW: bool>(
    view: &V,
    pixels: &[[f32; 4]],
    mut place: Place,
    out: &mut [[C; 4]],
) {
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
            if OPAQUE {
                codes = [C::from_wholes([0, 0, 0, C::LARGEST as u32]); BLOCK];
            }
        } else {
            convert_block::<C, V, OPAQUE, RAW>(view, block, place, &mut codes);
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
fn convert_block<C: DisplayCode, V: Show, const OPAQUE: bool, const RAW: bool>(
    view: &V,
    block: &[[f32; 4]; BLOCK],
    place: Place,
    out: &mut [[C; 4]; BLOCK],
) {
    let light = displayed(view, &planes(block));
    // Where alpha is full, as before a sky, both give the same codes, and the one sooner.
    let codes = if OPAQUE || is_covered(block) {
        coded::<C, true, RAW>(&light, place)
    } else {
        coded::<C, false, RAW>(&light, place)
    };
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
fn coded<C: DisplayCode, const OPAQUE: bool, const RAW: bool>(light: &Planes, place: Place) -> [[u32; BLOCK]; 4] {
    let mut codes = [[0; BLOCK]; 4];
    for i in 0..BLOCK {
        let phase = dither_phase(place.x.wrapping_add(i as u32), place.y);
        let rgb = [light[0][i], light[1][i], light[2][i]];
        let pixel =
            if OPAQUE { opaque_codes::<C, RAW>(rgb, phase) } else { straight_codes::<C, RAW>(rgb, light[3][i], phase) };
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
