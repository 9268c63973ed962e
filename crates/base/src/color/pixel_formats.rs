//! Rows of scene-linear pixels as half and single floats in a color space of the caller, without tone curve.
//!
//! A vector holds four pixels as they lie in memory. The matrix is applied by rotating the four components of each pixel, so that nothing is
//! transposed:
//!
//! ```text
//! out = d0 * (r, g, b, a) + d1 * (g, b, a, r) + d2 * (b, a, r, g) + d3 * (a, r, g, b)
//! ```
//!
//! where `d0` to `d3` hold the diagonals of the 4 x 4 matrix. Products and sums are rounded one by one, in this order, so that every vector
//! width and WebAssembly give the same bits.

use fearless_simd::{Level, Simd, dispatch, prelude::*, u16x16};
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m128i, __m256, _mm256_cvtps_ph};

pub use half::f16;
use half::slice::HalfFloatSliceExt;

use super::{
    space::{ACES2065_1_FROM_ACESCG, Matrix3, REC2020_FROM_ACESCG, SRGB_FROM_ACESCG},
    white_balance::WhiteBalance,
};
use crate::math::simd::{LANES, Lanes, Real};

/// A color space whose components are proportional to light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// Primaries of sRGB and Rec. 709, white D65: what game engines blend and shade in. Colors outside have negative components.
    #[default]
    LinearSrgb,
    /// Primaries of Rec. 2020 (ITU-R BT.2020), white D65: for HDR and wide-gamut displays.
    LinearRec2020,
    /// Primaries AP1, white D60 (Academy S-2014-004): the working space of frames.
    AcesCg,
    /// Primaries AP0, white D60 (SMPTE ST 2065-1): for exchange between programs.
    Aces2065_1,
}

impl ColorSpace {
    /// The matrix from ACEScg to this space, with Bradford adaptation where the whites differ, so that (1, 1, 1) stays white.
    #[must_use]
    pub const fn from_acescg(self) -> Matrix3 {
        match self {
            Self::LinearSrgb => SRGB_FROM_ACESCG,
            Self::LinearRec2020 => REC2020_FROM_ACESCG,
            Self::AcesCg => Matrix3([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
            Self::Aces2065_1 => ACES2065_1_FROM_ACESCG,
        }
    }
}

/// Largest finite half float.
const MAX_HALF: f32 = 65_504.0;
/// Components are clamped to this before the matrix, so that infinite light in several components does not become NaN.
const MAX_COMPONENT: f32 = 1e8;
/// Pixels of a vector.
const VECTOR_PIXELS: usize = LANES / 4;
/// Pixels converted together.
const BLOCK: usize = 16;

/// The white balance of a camera followed by a conversion from ACEScg to another linear space, for rows of premultiplied pixels.
///
/// ```
/// use bansho_base::color::{ColorSpace, LinearTransform, pixel_formats::f16};
/// use fearless_simd::Level;
///
/// let to_srgb = LinearTransform::new(ColorSpace::LinearSrgb, None);
/// let mut halves = [[f16::ZERO; 4]; 1];
/// to_srgb.rgba16f_row(Level::new(), &[[1.0, 1.0, 1.0, 0.5]], &mut halves);
/// assert_eq!(halves[0].map(f16::to_f32), [1.0, 1.0, 1.0, 0.5]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearTransform {
    /// Row by row.
    matrix: [[f32; 3]; 3],
    /// Whether pixels stay as they are.
    identity: bool,
}

impl LinearTransform {
    /// From exposed ACEScg to `space`. `white_balance_k` is the temperature of the black body whose light is shown as white, K; `None` is D65.
    #[must_use]
    pub fn new(space: ColorSpace, white_balance_k: Option<f64>) -> Self {
        let matrix = match white_balance_k {
            Some(temperature_k) => space.from_acescg().times(&WhiteBalance::matrix(temperature_k)),
            None => space.from_acescg(),
        };
        Self { matrix: matrix.single(), identity: space == ColorSpace::AcesCg && white_balance_k.is_none() }
    }

    /// Converts premultiplied pixels to half floats within 0 and 65504, alpha within 0 and 1. Components below 0 and NaN become 0, larger ones and
    /// infinity the largest value: infinities and NaN would spread in every filter, such as bloom. Rounds to nearest, ties to even.
    /// The shorter of `pixels` and `out` determines how many pixels are written. The bytes are the same at every `level`.
    pub fn rgba16f_row(&self, level: Level, pixels: &[[f32; 4]], out: &mut [[f16; 4]]) {
        dispatch!(level, simd => half_row(simd, &self.matrix, pixels, out));
    }

    /// Converts premultiplied pixels to single floats without clamping; alpha is unchanged. Infinite components may become NaN.
    /// The shorter of `pixels` and `out` determines how many pixels are written. The bytes are the same at every `level`.
    pub fn rgba32f_row(&self, level: Level, pixels: &[[f32; 4]], out: &mut [[f32; 4]]) {
        if self.identity {
            let count = pixels.len().min(out.len());
            out[..count].copy_from_slice(&pixels[..count]);
            return;
        }
        dispatch!(level, simd => single_row(simd, &self.matrix, pixels, out));
    }
}

/// The diagonals `d0` to `d3` of a matrix, repeated for each pixel of a vector.
#[inline(always)]
fn diagonals<S: Simd>(simd: S, m: &[[f32; 3]; 3]) -> [Lanes<S>; 4] {
    [
        [m[0][0], m[1][1], m[2][2], 1.0],
        [m[0][1], m[1][2], 0.0, 0.0],
        [m[0][2], 0.0, m[2][0], 0.0],
        [0.0, m[1][0], m[2][1], 0.0],
    ]
    .map(|diagonal| per_pixel(simd, diagonal))
}

/// Four components, repeated for each pixel of a vector.
#[inline(always)]
fn per_pixel<S: Simd>(simd: S, components: [f32; 4]) -> Lanes<S> {
    let pixels = [components; VECTOR_PIXELS];
    Lanes::from_slice(simd, pixels.as_flattened())
}

/// Applies the matrix to the four pixels of a vector.
#[inline(always)]
fn transformed<S: Simd>(diagonals: &[Lanes<S>; 4], v: Lanes<S>) -> Lanes<S> {
    let rotated = [v.slide_within_blocks::<1>(v), v.slide_within_blocks::<2>(v), v.slide_within_blocks::<3>(v)];
    diagonals[0] * v + diagonals[1] * rotated[0] + diagonals[2] * rotated[1] + diagonals[3] * rotated[2]
}

/// Components above [`MAX_COMPONENT`] become that; NaN and components below its negative become 0.
#[inline(always)]
fn sanitized<S: Simd>(v: Lanes<S>) -> Lanes<S> {
    let (zero, limit) = (v.broadcast(0.0), v.broadcast(MAX_COMPONENT));
    let finite = v.simd_abs().simd_le(limit).select(v, zero);
    v.simd_gt(limit).select(limit, finite)
}

/// The bits of the half floats nearest to finite numbers; ties go to the even one, and numbers from 65520 on become infinity.
#[inline(always)]
fn half_bits<S: Simd>(simd: S, values: Lanes<S>) -> u16x16<S> {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx2) = simd.level().as_avx2() {
        let (low, high) = values.split();
        let [low, high] = [half_bits_avx2(avx2, low.into()), half_bits_avx2(avx2, high.into())];
        let (low, high): (fearless_simd::u16x8<S>, fearless_simd::u16x8<S>) =
            (low.simd_into(simd), high.simd_into(simd));
        return low.combine(high);
    }
    let bits = values.to_bits();
    let (sign, magnitude) = ((bits >> 16) & 0x8000, bits & 0x7fff_ffff);
    let absolute = values.simd_abs();
    // The exponent's bias is 15 instead of 127. Half a unit of the last place less 1, plus the last bit kept, rounds ties to even; a carry
    // out of the mantissa increments the exponent, as it should.
    let normal = (magnitude + ((magnitude >> 13) & 1) + (0x0fff_u32.wrapping_sub((127 - 15) << 23))) >> 13;
    // Below 2^-14 halves are multiples of 2^-24, the last place of numbers between 0.5 and 1: adding 0.5 rounds.
    let subnormal = (absolute + 0.5).to_bits() - 0.5_f32.to_bits();
    let small = absolute.simd_lt(values.broadcast(f16::MIN_POSITIVE.to_f32_const()));
    let large = absolute.simd_ge(values.broadcast(65_536.0));
    let infinity = normal.simd.splat_u32x16(0x7c00);
    let rounded = large.select(infinity, small.select(subnormal, normal));
    let (low, high) = (rounded | sign).split();
    simd.narrow_u32x8(low, high)
}

#[cfg(target_arch = "x86_64")]
fearless_simd::kernel!(
    /// [`half_bits`] by the instruction for it, which every processor with AVX2 has.
    #[inline(always)]
    fn half_bits_avx2(avx2: Avx2, values: __m256) -> __m128i {
        _mm256_cvtps_ph::<0>(values)
    }
);

#[inline(always)]
fn half_row<S: Simd>(simd: S, matrix: &[[f32; 3]; 3], pixels: &[[f32; 4]], out: &mut [[f16; 4]]) {
    let (zero, largest) = (Lanes::splat(simd, 0.0), per_pixel(simd, [MAX_HALF, MAX_HALF, MAX_HALF, 1.0]));
    let diagonals = diagonals(simd, matrix);
    let count = pixels.len().min(out.len());
    let mut padded = [[0.0; 4]; BLOCK];
    for (input, output) in pixels[..count].chunks(BLOCK).zip(out[..count].chunks_mut(BLOCK)) {
        let block = full_block(input, &mut padded);
        let mut halves = [0; 4 * BLOCK];
        for (floats, halves) in block.as_flattened().chunks_exact(LANES).zip(halves.chunks_exact_mut(LANES)) {
            let light = transformed(&diagonals, sanitized(Lanes::from_slice(simd, floats)));
            let positive = zero.select_lt(light, light, zero);
            let clamped = positive.select_lt(largest, positive, largest);
            half_bits(simd, clamped).store_slice(halves);
        }
        let output = output.as_flattened_mut().reinterpret_cast_mut();
        output.copy_from_slice(&halves[..output.len()]);
    }
}

#[inline(always)]
fn single_row<S: Simd>(simd: S, matrix: &[[f32; 3]; 3], pixels: &[[f32; 4]], out: &mut [[f32; 4]]) {
    let diagonals = diagonals(simd, matrix);
    let is_alpha = per_pixel(simd, [0.0, 0.0, 0.0, 1.0]).simd_gt(Lanes::splat(simd, 0.0));
    let count = pixels.len().min(out.len());
    let mut padded = [[0.0; 4]; BLOCK];
    for (input, output) in pixels[..count].chunks(BLOCK).zip(out[..count].chunks_mut(BLOCK)) {
        let block = full_block(input, &mut padded);
        let mut floats = [0.0; 4 * BLOCK];
        for (input, output) in block.as_flattened().chunks_exact(LANES).zip(floats.chunks_exact_mut(LANES)) {
            let v = Lanes::from_slice(simd, input);
            // An infinite alpha times 0 would be NaN in the color, and the reverse.
            let color = transformed(&diagonals, is_alpha.select(v.broadcast(0.0), v));
            is_alpha.select(v, color).store_slice(output);
        }
        let output = output.as_flattened_mut();
        output.copy_from_slice(&floats[..output.len()]);
    }
}

/// `input` if it fills a block, else a copy of it in `padded`.
#[inline(always)]
fn full_block<'a>(input: &'a [[f32; 4]], padded: &'a mut [[f32; 4]; BLOCK]) -> &'a [[f32; 4]; BLOCK] {
    if let Ok(block) = input.try_into() {
        return block;
    }
    padded[..input.len()].copy_from_slice(input);
    padded
}
