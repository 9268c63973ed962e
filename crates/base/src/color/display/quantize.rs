//! From display light to codes: alpha, encoding, dither and rounding, one pixel at a time, with the same bits at every vector width.

use super::transfer::{clamp_unit, encode_srgb};
use crate::math::{MulAdd, approximations};

crate::choice! {
    /// Bits of each channel of a display format.
    pub enum BitDepth {
        /// 8 bits, dithered.
        Eight = "8",
        /// 16 bits.
        Sixteen = "16",
    }
}

/// An integer type for the codes of display components.
pub trait DisplayCode: Copy + Default + sealed::Sealed {
    /// The code of full light, as a float.
    const MAX_CODE: f32;
    /// Amplitude of the dither from peak to peak, in codes.
    const DITHER_WIDTH: f32;
    /// A pixel of integers from 0 to [`MAX_CODE`](Self::MAX_CODE).
    fn from_integers(wholes: [u32; 4]) -> [Self; 4];
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for u8 {}
    impl Sealed for u16 {}
}

impl DisplayCode for u8 {
    const MAX_CODE: f32 = 255.0;
    /// Less than 1, so that a value within 1/32 of a code keeps that code: 8-bit input passes unchanged.
    const DITHER_WIDTH: f32 = 1.0 - 2.0 / 32.0;
    #[inline(always)]
    fn from_integers([r, g, b, a]: [u32; 4]) -> [Self; 4] {
        (r | g << 8 | b << 16 | a << 24).to_le_bytes()
    }
}

impl DisplayCode for u16 {
    const MAX_CODE: f32 = 65_535.0;
    /// No dither: a step of 1/65535 is not visible.
    const DITHER_WIDTH: f32 = 0.0;
    #[inline(always)]
    fn from_integers([r, g, b, a]: [u32; 4]) -> [Self; 4] {
        [r as Self, g as Self, b as Self, a as Self]
    }
}

/// Increments of the dither phase along x and y, as fractions of 2^32: the two-dimensional generalization of the golden ratio (Roberts 2018, R2
/// sequence), whose values are distributed as evenly as blue noise without a table.
const STEP_X: u32 = 0xC13F_A9A9;
const STEP_Y: u32 = 0x91E1_0DA5;
/// Phase offsets of the four channels, far apart so that their errors do not add up to gray.
const CHANNEL_OFFSETS: [u32; 4] = [0, 0x5555_5555, 0xAAAA_AAAA, 0x8000_0000];

/// The dither's phase at a pixel.
#[inline(always)]
pub(super) fn dither_phase(x: u32, y: u32) -> u32 {
    x.wrapping_mul(STEP_X).wrapping_add(y.wrapping_mul(STEP_Y))
}

/// Dither in codes, uniformly distributed within `C::DITHER_WIDTH / 2` of zero. A triangle wave of the phase, so that it has no discontinuity.
#[inline(always)]
fn dither<C: DisplayCode>(phase: u32, channel: usize) -> f32 {
    let saw = phase.wrapping_add(CHANNEL_OFFSETS[channel]);
    let triangle = (saw << 1) ^ (saw.cast_signed() >> 31).cast_unsigned();
    let unit = (triangle >> 8).cast_signed() as f32 * (1.0 / 16_777_216.0);
    (unit - 0.5) * C::DITHER_WIDTH
}

/// The code nearest to a number from -0.5 to 65535.5.
#[inline(always)]
fn round_to_code(x: f32) -> u32 {
    approximations::round_to_i32(x).cast_unsigned()
}

/// Encodes light (0..=1) unless `RAW`, and rounds it to a code.
#[inline(always)]
fn component_code<C: DisplayCode, const RAW: bool>(light: f32, phase: u32, channel: usize) -> u32 {
    let encoded = if RAW { clamp_unit(light) } else { encode_srgb(light) };
    round_to_code(encoded.fma(C::MAX_CODE, dither::<C>(phase, channel)))
}

/// Codes of an opaque pixel.
#[inline(always)]
pub(super) fn opaque_codes<C: DisplayCode, const RAW: bool>([r, g, b]: [f32; 3], phase: u32) -> [u32; 4] {
    [
        component_code::<C, RAW>(r, phase, 0),
        component_code::<C, RAW>(g, phase, 1),
        component_code::<C, RAW>(b, phase, 2),
        C::MAX_CODE as u32,
    ]
}

/// Codes of a pixel without a plate behind it, for programs that blend linear light: `A = max(alpha, r, g, b)` in linear light, and the color
/// `rgb / A`, encoded.
///
/// Alpha is rounded first and the color divided by the rounded alpha, so that color times alpha is exact over black even where alpha
/// has few codes. Where light is visible alpha is therefore rounded up; elsewhere it is dithered.
#[inline(always)]
pub(super) fn linear_alpha_codes<C: DisplayCode, const RAW: bool>(light: [f32; 3], alpha: f32, phase: u32) -> [u32; 4] {
    let [r, g, b] = light;
    let green_or_blue = if g > b { g } else { b };
    let brightest = if r > green_or_blue { r } else { green_or_blue };
    let alpha = clamp_unit(alpha);
    let coverage = if alpha > brightest { alpha } else { brightest };

    let needed = approximations::rounded(brightest.fma(C::MAX_CODE, 0.499));
    // With 16 bits, 65535 + 0.499 is 65535.5 in single precision, which would round to a code that does not exist.
    let needed = if needed < C::MAX_CODE { needed } else { C::MAX_CODE };
    // Light below half a code over black is not visible: 0.5 / 12.92 codes, in the linear part of sRGB.
    let needed = if brightest >= 0.5 / 12.92 / C::MAX_CODE { needed } else { 0.0 };
    let dithered = approximations::rounded(coverage.fma(C::MAX_CODE, dither::<C>(phase, 3)));
    let code = if dithered > needed { dithered } else { needed };

    let quotient = C::MAX_CODE / code;
    let scale = if code > 0.0 { quotient } else { 0.0 };
    let [r, g, b, _] = opaque_codes::<C, RAW>([r * scale, g * scale, b * scale], phase);
    [r, g, b, round_to_code(code)]
}

/// The background over which [`premultiplied_encoded_codes`] are closest to the exact result: mid-gray, half of the encoded range.
const MID_GRAY_ENCODED: f32 = 0.5;
/// Its linear light.
const MID_GRAY: f32 = 0.214_041_14;

/// Codes of a pixel without a plate behind it, for programs that blend sRGB-encoded values, `out = A color + (1 - A) background`: the
/// [`premultiplied_encoded_codes`], with the color divided by `A`.
#[inline(always)]
pub(super) fn encoded_alpha_codes<C: DisplayCode>(light: [f32; 3], alpha: f32, phase: u32) -> [u32; 4] {
    let [r, g, b, code] = premultiplied_encoded_codes::<C>(light, alpha, phase);
    let quotient = C::MAX_CODE / code as f32;
    let scale = if code > 0 { quotient } else { 0.0 };
    // At most the largest code, since `code` is at least as large as each component.
    [round_to_code(r as f32 * scale), round_to_code(g as f32 * scale), round_to_code(b as f32 * scale), code]
}

/// Codes of a pixel without a plate behind it, for programs that blend sRGB-encoded values, `out = color + (1 - A) background`.
///
/// The color is `E = encode(rgb)`, so that the blend over black is `E` for any `A`.
/// `A` is the least-squares solution over a mid-gray background `G`: the exact result there is `encode(rgb + (1 - alpha) G)`, hence
/// `1 - A = mean over r, g, b of (encode(rgb + (1 - alpha) G) - E) / encode(G)`; `A` is at least the largest `E`, so that no straight color
/// `E / A` exceeds 1.
#[inline(always)]
pub(super) fn premultiplied_encoded_codes<C: DisplayCode>(light: [f32; 3], alpha: f32, phase: u32) -> [u32; 4] {
    let over_black = opaque_codes::<C, false>(light, phase);
    let transmitted = (1.0 - clamp_unit(alpha)) * MID_GRAY;
    let mut gained = 0.0;
    for component in light {
        gained += encode_srgb(clamp_unit(component) + transmitted) - encode_srgb(component);
    }
    let coverage = clamp_unit(gained.fma(-1.0 / (3.0 * MID_GRAY_ENCODED), 1.0));

    let dithered = round_to_code(coverage.fma(C::MAX_CODE, dither::<C>(phase, 3)));
    let [r, g, b, _] = over_black;
    [r, g, b, dithered.max(r).max(g).max(b)]
}

/// Codes of a pixel without a plate behind it, for programs that blend linear light, `out = color + (1 - A) background`: the light over black,
/// encoded unless `RAW`, and alpha as it is.
#[inline(always)]
pub(super) fn premultiplied_linear_codes<C: DisplayCode, const RAW: bool>(
    light: [f32; 3],
    alpha: f32,
    phase: u32,
) -> [u32; 4] {
    let [r, g, b, _] = opaque_codes::<C, RAW>(light, phase);
    [r, g, b, component_code::<C, true>(alpha, phase, 3)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::decode_srgb8;

    fn phases() -> impl Iterator<Item = u32> {
        (0..64 * 64).map(|i| dither_phase(i % 64, i / 64))
    }

    #[test]
    fn exact_codes_survive_dither() {
        for phase in phases() {
            for code in [0_u8, 1, 2, 77, 128, 254, 255] {
                let light = decode_srgb8(code);
                assert_eq!(opaque_codes::<u8, false>([light; 3], phase), [code, code, code, 255].map(u32::from));
            }
        }
    }

    #[test]
    fn dither_keeps_the_mean() {
        for level in [10.3_f32, 100.5, 200.75] {
            let light = level / 255.0;
            let sum: u32 = phases().map(|phase| opaque_codes::<u8, true>([light; 3], phase)[1]).sum();
            let mean = sum as f32 / 4096.0;
            assert!((mean - level).abs() < 0.03, "{mean} is not {level}");
        }
    }

    #[test]
    fn color_times_alpha_is_exact_over_black() {
        for step in 0..2000 {
            let light = [1.0, 0.4, 0.1].map(|v| v * libm::powf(step as f32 / 2000.0, 3.0));
            for phase in phases().step_by(997) {
                let codes = linear_alpha_codes::<u8, false>(light, 0.0, phase);
                for (code, expected) in codes.iter().zip(light) {
                    let shown = decode_srgb8(*code as u8) * codes[3] as f32 / 255.0;
                    let error = (encode_srgb(shown) - encode_srgb(expected)) * 255.0;
                    assert!(error.abs() < 1.01, "{light:?}: {error} codes");
                }
            }
        }
    }

    /// Numbers at and beyond the ends of the range, and NaN.
    const EXTREMES: [f32; 12] =
        [0.0, -0.0, 1e-40, 1e-6, 0.003_130_8, 0.5, 0.999_999_94, 1.0, 1.000_000_1, 7.0, f32::INFINITY, f32::NAN];

    /// Every combination of extremes in two components of light and in alpha; the third component is one of them too.
    fn extreme_pixels() -> impl Iterator<Item = ([f32; 3], f32)> {
        let all = || EXTREMES.into_iter().chain([-1.0, f32::NEG_INFINITY]);
        all().flat_map(move |r| all().flat_map(move |g| all().map(move |alpha| ([r, g, 0.25], alpha))))
    }

    fn seen(light: f32) -> f32 {
        if light.is_nan() { 0.0 } else { light.clamp(0.0, 1.0) }
    }

    #[test]
    fn saturated_pixels_keep_their_alpha_in_every_depth() {
        fn hold<C: DisplayCode>() {
            let largest = C::MAX_CODE as u32;
            for (light, alpha) in extreme_pixels() {
                for phase in phases().step_by(211) {
                    let linear = linear_alpha_codes::<C, false>(light.map(seen), alpha, phase);
                    let raw = linear_alpha_codes::<C, true>(light.map(seen), alpha, phase);
                    let encoded = encoded_alpha_codes::<C>(light, alpha, phase);
                    let premultiplied = premultiplied_encoded_codes::<C>(light, alpha, phase);
                    let opaque = opaque_codes::<C, false>(light, phase);
                    let added = premultiplied_linear_codes::<C, false>(light, alpha, phase);
                    assert!(added.iter().all(|code| *code <= largest), "{light:?} {alpha}: {added:?}");
                    for codes in [linear, raw, encoded, premultiplied, opaque] {
                        assert!(codes.iter().all(|code| *code <= largest), "{light:?} {alpha}: {codes:?}");
                        let brightest = light.map(seen).into_iter().fold(seen(alpha), f32::max);
                        if brightest == 1.0 {
                            assert_eq!(codes[3], largest, "{light:?} {alpha}: {codes:?}");
                        }
                    }
                }
            }
        }
        hold::<u8>();
        hold::<u16>();
    }

    /// Light of many colors and brightnesses with much and little coverage.
    fn pixels() -> impl Iterator<Item = ([f32; 3], f32)> {
        let colors = [[1.0, 0.4, 0.1], [0.1, 1.0, 0.3], [1.0, 1.0, 1.0], [0.0, 0.0, 1.0]];
        let brightness = (0..60).map(|step| libm::powf(step as f32 / 59.0, 3.0));
        brightness.flat_map(move |v| {
            colors.into_iter().flat_map(move |color| [0.0, 0.1, 0.7, 1.0].map(|alpha| (color.map(|c| c * v), alpha)))
        })
    }

    #[test]
    fn an_encoded_blend_over_black_is_exact_to_a_code() {
        for (light, alpha) in pixels() {
            for phase in phases().step_by(61) {
                let [r, g, b, a] = encoded_alpha_codes::<u8>(light, alpha, phase);
                let expected = opaque_codes::<u8, false>(light, phase);
                for (color, expected) in [r, g, b].into_iter().zip(expected) {
                    assert_eq!((color * a + 127) / 255, expected, "{light:?} {alpha}");
                }
                let [r, g, b, a] = encoded_alpha_codes::<u16>(light, alpha, phase).map(u64::from);
                let expected = opaque_codes::<u16, false>(light, phase);
                for (color, expected) in [r, g, b].into_iter().zip(expected) {
                    let over_black = (color * a + 32_767) / 65_535;
                    assert!(over_black.abs_diff(u64::from(expected)) <= 1, "{light:?} {alpha}");
                }
            }
        }
    }

    #[test]
    fn premultiplied_encoded_codes_are_the_straight_ones_before_the_division() {
        for (light, alpha) in pixels() {
            for phase in phases().step_by(61) {
                let [r, g, b, a] = premultiplied_encoded_codes::<u8>(light, alpha, phase);
                assert_eq!([r, g, b], opaque_codes::<u8, false>(light, phase)[..3], "{light:?} {alpha}");
                assert!(r.max(g).max(b) <= a, "{light:?} {alpha}: no color exceeds alpha");
                let straight = encoded_alpha_codes::<u8>(light, alpha, phase);
                assert_eq!(straight[3], a);
                for (color, premultiplied) in straight.into_iter().zip([r, g, b]) {
                    assert_eq!((color * a + 127) / 255, premultiplied, "{light:?} {alpha}");
                }
            }
        }
    }

    #[test]
    fn a_premultiplied_linear_blend_is_exact_to_a_code_over_every_background() {
        for (light, alpha) in pixels() {
            for phase in phases().step_by(61) {
                let [r, g, b, a] = premultiplied_linear_codes::<u8, false>(light, alpha, phase);
                for background in [0.0, 0.2, 1.0] {
                    for (code, light) in [r, g, b].into_iter().zip(light) {
                        let blended = decode_srgb8(code as u8) + (1.0 - a as f32 / 255.0) * background;
                        let exact = light + (1.0 - alpha) * background;
                        // One code of the color, whose steps are the widest at full light, and one of alpha.
                        let step = 1.0 / 255.0 * background + 1.0 - decode_srgb8(254);
                        assert!(
                            (blended - exact).abs() <= step,
                            "{light} {alpha} over {background}: {blended} {exact}"
                        );
                    }
                }
            }
        }
        let quiet = dither_phase(0, 0);
        assert_eq!(premultiplied_linear_codes::<u8, false>([1.0, 0.0, 0.0], 0.0, quiet), [255, 0, 0, 0]);
        assert_eq!(premultiplied_linear_codes::<u8, false>([0.0; 3], 0.4, quiet), [0, 0, 0, 102]);
        assert_eq!(premultiplied_linear_codes::<u16, true>([0.5, 0.25, 0.0], 0.25, quiet), [32_768, 16_384, 0, 16_384]);
    }

    #[test]
    fn no_other_alpha_is_nearer_to_the_truth_over_mid_gray() {
        for (light, coverage) in pixels() {
            let truth = light.map(|v| encode_srgb(v + (1.0 - coverage) * MID_GRAY) * 65_535.0);
            let over_black = opaque_codes::<u16, false>(light, 0).map(|code| code as f32);
            let error = |alpha: f32| {
                let gray = (1.0 - alpha / 65_535.0) * MID_GRAY_ENCODED * 65_535.0;
                (0..3).map(|c| over_black[c] + gray - truth[c]).map(|difference| difference * difference).sum::<f32>()
            };
            let alpha = encoded_alpha_codes::<u16>(light, coverage, 0)[3] as f32;
            let min_alpha = over_black[0].max(over_black[1]).max(over_black[2]);
            for other in [alpha - 400.0, alpha + 400.0, min_alpha, 65_535.0] {
                if (min_alpha..=65_535.0).contains(&other) {
                    assert!(error(alpha) <= error(other) * 1.001 + 10.0, "{light:?} {coverage}: {alpha} {other}");
                }
            }
        }
        let quiet = dither_phase(0, 0);
        assert_eq!(encoded_alpha_codes::<u8>([0.0; 3], 0.0, quiet), [0; 4]);
        assert_eq!(encoded_alpha_codes::<u8>([0.0; 3], 1.0, quiet), [0, 0, 0, 255]);
        assert_eq!(encoded_alpha_codes::<u8>([1.0; 3], 0.0, quiet), [255; 4]);
        // Half of the light behind passes: code 128 times (1 - A) is to be encode(0.107) = 0.3608, hence A = 0.2785.
        assert_eq!(encoded_alpha_codes::<u16>([0.0; 3], 0.5, quiet)[3], 18_248);
    }

    #[test]
    fn alpha_is_the_larger_of_coverage_and_light() {
        let quiet = dither_phase(0, 0);
        assert_eq!(linear_alpha_codes::<u8, false>([0.0; 3], 0.0, quiet), [0; 4]);
        assert_eq!(linear_alpha_codes::<u8, false>([0.0; 3], 1.0, quiet), [0, 0, 0, 255]);
        assert_eq!(linear_alpha_codes::<u16, false>([0.0; 3], 0.25, quiet)[3], 16_384);
        assert_eq!(linear_alpha_codes::<u8, false>([1.0; 3], 0.0, quiet), [255; 4]);
        // Light 0.2 under alpha 0.4 = 102/255: straight 0.5 encodes to 0.7354 * 255 = 187.5.
        let codes = linear_alpha_codes::<u8, false>([0.2, 0.2, 0.0], 0.4, quiet);
        assert!((187..=188).contains(&codes[0]) && codes[2] == 0 && codes[3] == 102, "{codes:?}");
    }
}
