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

#[cfg(target_arch = "x86_64")]
use fearless_simd::u16x8;
use fearless_simd::{Level, Simd, dispatch, i32x16, prelude::*, u16x16};
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m128i, __m256, _mm256_cvtps_ph};

pub use half::f16;
use half::slice::HalfFloatSliceExt;

use super::{
    space::{ACES2065_1_FROM_ACESCG, Matrix3, REC2020_FROM_ACESCG, SRGB_FROM_ACESCG},
    white_balance::WhiteBalance,
};
use crate::{
    color::display::row::is_empty,
    math::simd::{LANES, Lanes, Real},
};

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
/// Smallest half float that is not subnormal, 2^-14.
const MIN_NORMAL_HALF: f32 = 1.0 / 16_384.0;
/// Components are clamped to this before the matrix, so that infinite light in several components does not become NaN.
const MAX_COMPONENT: f32 = 1e8;
/// Pixels of a vector.
const VECTOR_PIXELS: usize = LANES / 4;
/// Pixels converted together.
const BLOCK: usize = 16;

/// The white balance of a camera followed by a conversion from ACEScg to another linear space, for rows of premultiplied pixels.
///
/// ```
/// use bansho_base::{color::{ColorSpace, LinearTransform, pixel_formats::f16}, math::simd};
///
/// let to_srgb = LinearTransform::new(ColorSpace::LinearSrgb, None);
/// let mut halves = [[f16::ZERO; 4]; 1];
/// to_srgb.rgba16f_row(simd::level(), &[[1.0, 1.0, 1.0, 0.5]], &mut halves);
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

/// The bits of the half floats nearest to numbers from 0 to [`MAX_HALF`]; ties go to the even one.
#[inline(always)]
fn half_bits<S: Simd>(simd: S, values: Lanes<S>) -> u16x16<S> {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx2) = simd.level().as_avx2() {
        let (low, high) = values.split();
        let (low, high) = (half_bits_avx2(avx2, low.into()), half_bits_avx2(avx2, high.into()));
        let [low, high]: [u16x8<S>; 2] = [low.simd_into(simd), high.simd_into(simd)];
        return low.combine(high);
    }
    let bits = values.to_bits();
    // The exponent's bias is 15 instead of 127. Half a unit of the last place less 1, plus the last bit kept, rounds ties to even; a carry
    // out of the mantissa increments the exponent, as it should.
    const REBIAS_AND_ROUND: u32 = 0x0fff_u32.wrapping_sub((127 - 15) << 23);
    let normal = (bits + ((bits >> 13) & 1) + REBIAS_AND_ROUND) >> 13;
    // Below 2^-14 halves are multiples of 2^-24, the last place of numbers between 0.5 and 1: adding 0.5 rounds.
    let subnormal = (values + 0.5).to_bits() - 0.5_f32.to_bits();
    let rounded = values.simd_lt(values.broadcast(MIN_NORMAL_HALF)).select(subnormal, normal);
    let (low, high) = rounded.bitcast::<i32x16<S>>().split();
    // All fit into 15 bits. Signed numbers are narrowed by one instruction everywhere.
    simd.relaxed_narrow_i32x8(low, high).bitcast()
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
    let count = pixels.len().min(out.len());
    let diagonals = diagonals(simd, matrix);
    let (blocks, rest) = pixels[..count].as_chunks::<BLOCK>();
    let (out_blocks, out_rest) = out[..count].as_chunks_mut::<BLOCK>();
    for (block, out) in blocks.iter().zip(out_blocks) {
        half_block(simd, &diagonals, block, out);
    }
    if !rest.is_empty() {
        let (mut block, mut halves) = ([[0.0; 4]; BLOCK], [[f16::ZERO; 4]; BLOCK]);
        block[..rest.len()].copy_from_slice(rest);
        half_block(simd, &diagonals, &block, &mut halves);
        out_rest.copy_from_slice(&halves[..rest.len()]);
    }
}

#[inline(always)]
fn half_block<S: Simd>(simd: S, diagonals: &[Lanes<S>; 4], block: &[[f32; 4]; BLOCK], out: &mut [[f16; 4]; BLOCK]) {
    if is_empty(block) {
        *out = [[f16::ZERO; 4]; BLOCK];
        return;
    }
    let (zero, largest) = (Lanes::splat(simd, 0.0), per_pixel(simd, [MAX_HALF, MAX_HALF, MAX_HALF, 1.0]));
    let halves = out.as_flattened_mut().reinterpret_cast_mut();
    for (floats, halves) in block.as_flattened().chunks_exact(LANES).zip(halves.chunks_exact_mut(LANES)) {
        let light = transformed(diagonals, sanitized(Lanes::from_slice(simd, floats)));
        let positive = zero.select_lt(light, light, zero);
        let clamped = positive.select_lt(largest, positive, largest);
        half_bits(simd, clamped).store_slice(halves);
    }
}

#[inline(always)]
fn single_row<S: Simd>(simd: S, matrix: &[[f32; 3]; 3], pixels: &[[f32; 4]], out: &mut [[f32; 4]]) {
    let count = pixels.len().min(out.len());
    let diagonals = diagonals(simd, matrix);
    let (blocks, rest) = pixels[..count].as_chunks::<VECTOR_PIXELS>();
    let (out_blocks, out_rest) = out[..count].as_chunks_mut::<VECTOR_PIXELS>();
    for (block, out) in blocks.iter().zip(out_blocks) {
        single_vector(simd, &diagonals, block, out);
    }
    if !rest.is_empty() {
        let (mut block, mut floats) = ([[0.0; 4]; VECTOR_PIXELS], [[0.0; 4]; VECTOR_PIXELS]);
        block[..rest.len()].copy_from_slice(rest);
        single_vector(simd, &diagonals, &block, &mut floats);
        out_rest.copy_from_slice(&floats[..rest.len()]);
    }
}

#[inline(always)]
fn single_vector<S: Simd>(
    simd: S,
    diagonals: &[Lanes<S>; 4],
    pixels: &[[f32; 4]; VECTOR_PIXELS],
    out: &mut [[f32; 4]; VECTOR_PIXELS],
) {
    let v = Lanes::from_slice(simd, pixels.as_flattened());
    let is_alpha = per_pixel(simd, [0.0, 0.0, 0.0, 1.0]).simd_gt(Lanes::splat(simd, 0.0));
    // An infinite alpha times 0 would be NaN in the color, and the reverse.
    let color = transformed(diagonals, is_alpha.select(v.broadcast(0.0), v));
    is_alpha.select(v, color).store_slice(out.as_flattened_mut());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        color::{View, acescg_from_srgb, acescg_from_xyz, decode_srgb, srgb_from_acescg, white_balance::chromaticity},
        math::simd,
    };

    fn halves(transform: &LinearTransform, level: Level, pixels: &[[f32; 4]]) -> Vec<[u16; 4]> {
        let mut out = vec![[f16::NAN; 4]; pixels.len()];
        transform.rgba16f_row(level, pixels, &mut out);
        out.into_iter().map(|pixel| pixel.map(f16::to_bits)).collect()
    }

    fn singles(transform: &LinearTransform, level: Level, pixels: &[[f32; 4]]) -> Vec<[f32; 4]> {
        let mut out = vec![[7.0; 4]; pixels.len()];
        transform.rgba32f_row(level, pixels, &mut out);
        out
    }

    /// Well spread 32-bit numbers.
    fn scattered(index: u32) -> u32 {
        let mixed = (index ^ (index >> 16)).wrapping_mul(0x7FEB_352D);
        let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x846C_A68B);
        mixed ^ (mixed >> 16)
    }

    /// Pixels of every kind: dark, bright, outside sRGB, empty, not finite.
    fn wild_pixels(count: u32) -> Vec<[f32; 4]> {
        let component = |seed: u32| match seed % 23 {
            0 => 0.0,
            1 => f32::NAN,
            2 => f32::INFINITY,
            3 => f32::NEG_INFINITY,
            4 => -0.0,
            5 => f32::MAX,
            6 => 1e-40,
            7 => 1e8,
            8 => -1e8,
            _ => ((seed >> 8) as f32 / 16_777_216.0 - 0.2) * libm::exp2f((seed % 31) as f32 - 14.0),
        };
        (0..count).map(|i| [0, 1, 2, 3].map(|c| component(scattered(4 * i + c)))).collect()
    }

    /// Dark and bright premultiplied light inside sRGB with every coverage, exposed ACEScg.
    fn visible_pixels() -> impl Iterator<Item = [f32; 4]> {
        (0..20_000).map(|i| {
            let unit = |c: u32| (scattered(4 * i + c) >> 8) as f32 / 16_777_216.0;
            let [r, g, b] = acescg_from_srgb([0, 1, 2].map(|c| unit(c) * unit(c) * 2.0));
            [r, g, b, unit(3)]
        })
    }

    /// Infinities and NaN gone, matrix by matrix element in the documented order, limits.
    fn reference(matrix: &[[f32; 3]; 3], pixel: [f32; 4]) -> [u16; 4] {
        let finite = |x: f32| if x.is_nan() || x < -MAX_COMPONENT { 0.0 } else { x.min(MAX_COMPONENT) };
        let [r, g, b, alpha] = pixel.map(finite);
        let [x, y, z] = matrix;
        let light =
            [x[0] * r + x[1] * g + x[2] * b, y[1] * g + y[2] * b + y[0] * r, z[2] * b + z[0] * r + z[1] * g, alpha];
        let limits = [MAX_HALF, MAX_HALF, MAX_HALF, 1.0];
        [0, 1, 2, 3].map(|c| f16::from_f32(light[c].clamp(0.0, limits[c])).to_bits() & 0x7fff)
    }

    /// Numbers around every boundary of rounding, and many others.
    fn numbers() -> impl Iterator<Item = f32> {
        let around = |x: f32| [x.next_down().next_down(), x.next_down(), x, x.next_up(), x.next_up().next_up()];
        let boundaries = (0..0x7c00_u16).flat_map(move |bits| {
            let (here, next) = (f16::from_bits(bits), f16::from_bits(bits + 1));
            let next = if next.is_infinite() { 65_536.0 } else { next.to_f32() };
            [around(here.to_f32()), around((here.to_f32() + next) / 2.0)].into_iter().flatten()
        });
        // Every exponent with every pattern of the bits that decide about rounding.
        let patterns = (0..=255_u32).flat_map(|exponent| {
            (0..1 << 14).map(move |low| f32::from_bits((exponent << 23) | ((low >> 3) << 12) | ((low & 7) * 0x249)))
        });
        boundaries.chain(patterns).chain((0..1_000_000).map(|i| f32::from_bits(scattered(i))))
    }

    #[test]
    fn rounding_to_half_is_that_of_the_standard_for_every_number() {
        let copy = LinearTransform::new(ColorSpace::AcesCg, None);
        let numbers: Vec<f32> = numbers().collect();
        let pixels: Vec<[f32; 4]> = numbers.chunks_exact(3).map(|n| [n[0], n[1], n[2], n[0]]).collect();
        for level in simd::available_levels() {
            for (pixel, half) in pixels.iter().zip(halves(&copy, level, &pixels)) {
                for c in 0..4 {
                    let limit = if c == 3 { 1.0 } else { MAX_HALF };
                    let clamped = if pixel[c] > 0.0 { pixel[c].min(limit) } else { 0.0 };
                    assert_eq!(half[c], f16::from_f32(clamped).to_bits(), "{} at {level:?}", pixel[c]);
                }
            }
        }
    }

    #[test]
    fn every_level_and_every_length_gives_the_same_bits() {
        let pixels = wild_pixels(4099);
        for space in [ColorSpace::LinearSrgb, ColorSpace::LinearRec2020, ColorSpace::AcesCg, ColorSpace::Aces2065_1] {
            for kelvin in [None, Some(3200.0)] {
                let transform = LinearTransform::new(space, kelvin);
                let expected: Vec<[u16; 4]> = pixels.iter().map(|pixel| reference(&transform.matrix, *pixel)).collect();
                let bits = |pixels: Vec<[f32; 4]>| -> Vec<[u32; 4]> {
                    // Which NaN it is differs between processors.
                    let bits = |v: f32| if v.is_nan() { u32::MAX } else { v.to_bits() };
                    pixels.into_iter().map(|pixel| pixel.map(bits)).collect()
                };
                let whole = bits(singles(&transform, Level::baseline(), &pixels));
                for level in simd::available_levels() {
                    assert_eq!(halves(&transform, level, &pixels), expected, "{space:?} {kelvin:?} {level:?}");
                    assert_eq!(bits(singles(&transform, level, &pixels)), whole, "{space:?} {kelvin:?} {level:?}");
                    for length in 0..40 {
                        assert_eq!(halves(&transform, level, &pixels[..length]), expected[..length]);
                        assert_eq!(bits(singles(&transform, level, &pixels[..length])), whole[..length]);
                    }
                }
            }
        }
    }

    #[test]
    fn known_colors() {
        let to_srgb = LinearTransform::new(ColorSpace::LinearSrgb, None);
        let convert = |srgb: [f32; 3], alpha: f32| {
            let [r, g, b] = acescg_from_srgb(srgb);
            halves(&to_srgb, simd::level(), &[[r, g, b, alpha]])[0].map(|bits| f16::from_bits(bits).to_f32())
        };
        assert_eq!(halves(&to_srgb, simd::level(), &[[1.0; 4]]), [[f16::ONE.to_bits(); 4]]);
        for (color, alpha) in
            [([1.0, 0.0, 0.0], 0.5), ([0.0, 1.0, 0.0], 0.0), ([0.0, 0.0, 1.0], 1.0), ([0.25; 3], 0.25)]
        {
            let [r, g, b, a] = convert(color, alpha);
            assert!([r, g, b].into_iter().zip(color).all(|(v, c)| (v - c).abs() < 1e-6), "{color:?}: {r} {g} {b}");
            assert_eq!(a, alpha);
        }
        // Green of AP1 lies outside sRGB: its red and blue would be negative.
        let [r, g, b, a] = halves(&to_srgb, simd::level(), &[[0.0, 1.0, 0.0, 0.0]])[0];
        assert_eq!([r, b, a], [0; 3]);
        assert!((f16::from_bits(g).to_f32() - srgb_from_acescg([0.0, 1.0, 0.0])[1]).abs() < 1e-3);
        for space in [ColorSpace::LinearSrgb, ColorSpace::LinearRec2020, ColorSpace::AcesCg, ColorSpace::Aces2065_1] {
            let [white] = singles(&LinearTransform::new(space, None), simd::level(), &[[1.0, 1.0, 1.0, 0.5]])[..]
            else {
                panic!("one pixel in, one pixel out")
            };
            assert!(white[..3].iter().all(|v| (v - 1.0).abs() < 1e-6) && white[3] == 0.5, "{space:?}: {white:?}");
        }
    }

    #[test]
    fn what_is_no_light_is_none_and_what_is_infinite_is_the_largest_half() {
        let nan = f32::NAN;
        let pixels = [
            [nan, nan, nan, nan],
            [-1.0, -2.0, -3.0, -1.0],
            [f32::INFINITY, f32::INFINITY, f32::INFINITY, f32::INFINITY],
            [f32::MAX, f32::MAX, f32::MAX, 2.0],
            [f32::NEG_INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY, f32::NEG_INFINITY],
            [-0.0; 4],
        ];
        let (largest, one) = (f16::MAX.to_bits(), f16::ONE.to_bits());
        let bright = [largest, largest, largest, one];
        for level in simd::available_levels() {
            let to_srgb = LinearTransform::new(ColorSpace::LinearSrgb, None);
            assert_eq!(halves(&to_srgb, level, &pixels), [[0; 4], [0; 4], bright, bright, [0; 4], [0; 4]]);
            for kelvin in [1500.0, 20_000.0] {
                let balanced = halves(&LinearTransform::new(ColorSpace::LinearSrgb, Some(kelvin)), level, &pixels);
                assert_eq!([balanced[0], balanced[4], balanced[5]], [[0; 4]; 3], "{kelvin}");
                assert!(balanced.as_flattened().iter().all(|bits| *bits <= largest), "{kelvin}: {balanced:?}");
            }
        }
        // A component that is no number is missing, and no more than that.
        let to_srgb = LinearTransform::new(ColorSpace::LinearSrgb, None);
        assert_eq!(
            halves(&to_srgb, simd::level(), &[[nan, 0.5, nan, 0.5]]),
            halves(&to_srgb, simd::level(), &[[0.0, 0.5, 0.0, 0.5]])
        );
    }

    #[test]
    fn single_floats_are_not_clamped_and_alpha_does_not_mix_with_color() {
        let pixels = [[0.0, 1.0, 0.0, f32::INFINITY], [f32::INFINITY, 0.0, 0.0, 0.25], [-2.0, 0.5, 1e6, f32::NAN]];
        for level in simd::available_levels() {
            let out = singles(&LinearTransform::new(ColorSpace::LinearSrgb, None), level, &pixels);
            assert!(out[0][0] < 0.0 && out[0][1] > 1.0 && out[0][3] == f32::INFINITY, "{:?}", out[0]);
            assert_eq!((out[1][0], out[1][3]), (f32::INFINITY, 0.25));
            assert!(out[2][3].is_nan() && out[2][..3].iter().all(|v| v.is_finite()), "{:?}", out[2]);
        }
        let copied = singles(&LinearTransform::new(ColorSpace::AcesCg, None), simd::level(), &pixels);
        assert!(copied.as_flattened().iter().zip(pixels.as_flattened()).all(|(a, b)| a.to_bits() == b.to_bits()));
    }

    #[test]
    fn colors_are_those_of_the_standard_view_before_encoding() {
        for kelvin in [None, Some(4000.0)] {
            let view = View::STANDARD.with_white_balance(kelvin);
            let transform = LinearTransform::new(ColorSpace::LinearSrgb, kelvin);
            let pixels: Vec<[f32; 4]> = visible_pixels().map(|pixel| pixel.map(|v| v * 0.5)).collect();
            for (pixel, single) in pixels.iter().zip(singles(&transform, simd::level(), &pixels)) {
                let [r, g, b, alpha] = *pixel;
                assert_eq!(alpha, single[3]);
                let inside = single[..3].iter().all(|v| (0.0..=1.0).contains(v));
                let shown = view.to_display([r, g, b]);
                assert!(!inside || shown.iter().zip(single).all(|(a, b)| (a - b).abs() < 2e-6), "{shown:?} {single:?}");
            }
        }
    }

    #[test]
    fn the_light_of_a_black_body_is_white_under_its_own_balance() {
        for kelvin in [1500.0, 3200.0, 6504.0] {
            let [x, y] = chromaticity(kelvin);
            let [r, g, b] = acescg_from_xyz([x / y, 1.0, (1.0 - x - y) / y]);
            for space in [ColorSpace::LinearSrgb, ColorSpace::LinearRec2020, ColorSpace::AcesCg] {
                let transform = LinearTransform::new(space, Some(kelvin));
                let [white] = singles(&transform, simd::level(), &[[r, g, b, 1.0]])[..] else { panic!("one pixel") };
                assert!(white.iter().all(|v| (v - 1.0).abs() < 1e-4), "{space:?} {kelvin}: {white:?}");
            }
        }
    }

    #[test]
    fn blending_after_the_conversion_is_compositing_before_it() {
        let to_srgb = LinearTransform::new(ColorSpace::LinearSrgb, None);
        let pixels: Vec<[f32; 4]> = visible_pixels().collect();
        let written = halves(&to_srgb, simd::level(), &pixels);
        for background in [0.0, 1.0, decode_srgb(0.5)] {
            for (pixel, half) in pixels.iter().zip(&written) {
                let [r, g, b, a] = half.map(|bits| f16::from_bits(bits).to_f32());
                let blended = [r, g, b].map(|v| v + (1.0 - a) * background);
                let through = (1.0 - pixel[3]) * background;
                let composited = srgb_from_acescg([pixel[0] + through, pixel[1] + through, pixel[2] + through]);
                for (blended, composited) in blended.into_iter().zip(composited) {
                    assert!(
                        (blended - composited).abs() < 0.3 / 255.0,
                        "{pixel:?} over {background}: {blended} {composited}"
                    );
                }
            }
        }
    }
}
