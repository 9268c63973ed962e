//! From unbounded linear sRGB into the display cube, for the views `neutral` and `standard`: tone curve, desaturation of highlights toward white, and gamut
//! mapping.
//!
//! A color is decomposed as in HSV, which also works for negative components: brightness `m = max`, saturation
//! `s = (max - min) / max` (above 1 outside sRGB) and the position `t = (mid - min) / (max - min)` within its hue sector. Then
//!
//! 1. brightness is mapped by the tone curve, which also gives the compression `c`;
//! 2. saturation decreases, `v = s (1 - w)` with `w = c^2 / (c^2 + c0^2)`: bright colors approach white. Inside sRGB `s' = v`; from outside
//!    `s' = 1 - (1 - v)^2 / w` up to `v = 1`, which gives a smooth onset, and 1 beyond: mixed with just enough white. Mixing with white preserves
//!    `t`, and so the dominant wavelength;
//! 3. colors from red to yellow, and no others, are shifted toward yellow as they are compressed: `t' = t (1 + a) / (1 + a t)`, the
//!    change of ratio that a Reinhard curve on each channel would make. Without this shift overexposed flames turn salmon; with simply clipped
//!    channels they turn flat yellow. `a <= BEND_LIMIT` keeps the hue shift below 34 degrees of HSV.
//!
//! Each step is a bijection onto its range and depends only on quantities that the inverse has already recovered, so the whole transform has an
//! exact inverse on the cube.

use super::{tone::ToneCurve, transfer::clamp_components};
use crate::{
    color::space::{acescg_from_srgb, srgb_from_acescg},
    math::MulAdd,
};

/// Compression at which a color is halfway to white (`c0`): chosen by eye on ramps of black bodies from 1000 to 3000 K.
const HALF_WHITE_COMPRESSION: f32 = 17.0;
const HALF_WHITE_SQUARED: f32 = HALF_WHITE_COMPRESSION * HALF_WHITE_COMPRESSION;
/// Rate at which the hue shift `a` grows with compression: `a = BEND c / (1 + BEND c / BEND_LIMIT) min(s, 1)`.
const BEND: f32 = 1.8;
/// Largest hue shift `a`.
const BEND_LIMIT: f32 = 11.0;

/// Lower bound of brightness, so that no quotient underflows. It is subtracted again at the end: a test for black there would share its condition
/// with the maximum at the start, and the compiler would then split the loop and not vectorize it.
const BLACK: f32 = 1e-12;
/// Components are clamped to this, so that no product overflows.
const MAX_COMPONENT: f32 = 1e8;

#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// A component clamped to [`MAX_COMPONENT`]; NaN and components below `-MAX_COMPONENT` become 0.
#[inline(always)]
pub(super) fn sanitized(x: f32) -> f32 {
    let finite = if x.abs() <= MAX_COMPONENT { x } else { 0.0 };
    if x > MAX_COMPONENT { MAX_COMPONENT } else { finite }
}

/// Largest, middle and smallest component.
#[inline(always)]
fn sort_components([r, g, b]: [f32; 3]) -> [f32; 3] {
    let (high, low) = (max(r, g), min(r, g));
    [max(high, b), max(low, min(high, b)), min(low, b)]
}

/// The new value of the component that is now `value`: `values` holds those of the largest, middle and smallest component.
#[inline(always)]
fn replace_component(value: f32, [largest, _, smallest]: [f32; 3], values: [f32; 3]) -> f32 {
    let lower = if value <= smallest { values[2] } else { values[1] };
    if value >= largest { values[0] } else { lower }
}

/// `rgb` with its largest, middle and smallest component replaced by `values`.
#[inline(always)]
fn with_sorted_components([r, g, b]: [f32; 3], sorted: [f32; 3], values: [f32; 3]) -> [f32; 3] {
    [replace_component(r, sorted, values), replace_component(g, sorted, values), replace_component(b, sorted, values)]
}

/// Whether the hue lies between red and yellow: red is the largest component and blue the smallest.
#[inline(always)]
fn is_warm(rgb: [f32; 3], [largest, _, smallest]: [f32; 3]) -> bool {
    (rgb[0] >= largest) & (rgb[2] <= smallest)
}

/// Saturation `s` reduced toward white at compression `c`.
#[inline(always)]
fn compress_saturation(s: f32, c: f32) -> f32 {
    // 1 - w = c0^2 / sum and 1 / w = sum / c^2 from one division. Without compression 1 - v is 0 wherever 1 / w is used.
    let squared = max(c * c, 1e-20);
    let sum = squared + HALF_WHITE_SQUARED;
    let reciprocal = 1.0 / (squared * sum);
    let v = min(s * (HALF_WHITE_SQUARED * (squared * reciprocal)), 1.0);
    let outside = 1.0 - (1.0 - v) * (1.0 - v) * (sum * (sum * reciprocal));
    let bounded = max(outside, 0.0);
    if s > 1.0 { bounded } else { v }
}

/// Inverse of [`compress_saturation`] for `s` from 0 to 1.
#[inline(always)]
fn expand_saturation(s: f32, c: f32) -> f32 {
    let sum = c.fma(c, HALF_WHITE_SQUARED);
    let w = c * c / sum;
    let outside = 1.0 - ((1.0 - s) * w).sqrt();
    let v = if 1.0 - s < w { outside } else { s };
    v * (sum / HALF_WHITE_SQUARED)
}

/// Linear sRGB of any size and sign to linear display sRGB within 0..=1. Components must be [`sanitized`].
#[inline(always)]
fn to_cube(tone: &ToneCurve, rgb: [f32; 3]) -> [f32; 3] {
    let sorted = sort_components(rgb);
    let largest = max(sorted[0], BLACK);
    let (range, rise) = (sorted[0] - sorted[2], sorted[1] - sorted[2]);
    let (brightness, c) = tone.apply(largest);
    let brightness = brightness - BLACK;

    let saturation = compress_saturation(range / largest, c);

    // t' with t = rise / range and a = bend / scale, brought to one division.
    let warm_bend = BEND * c * min(range, largest);
    let bend = if is_warm(rgb, sorted) { warm_bend } else { 0.0 };
    let scale = largest * c.fma(BEND / BEND_LIMIT, 1.0);
    let t = rise * (scale + bend) / max(range.fma(scale, bend * rise), 1e-35);

    let chroma = brightness * saturation;
    with_sorted_components(rgb, sorted, [brightness, chroma.fma(min(t, 1.0) - 1.0, brightness), brightness - chroma])
}

/// Inverse of [`to_cube`] for `display` with components within 0..=1; the brightest colors map to linear sRGB outside the gamut.
#[inline(always)]
fn from_cube(tone: &ToneCurve, display: [f32; 3]) -> [f32; 3] {
    let sorted = sort_components(display);
    let brightness = max(sorted[0], BLACK);
    let (range, rise) = (sorted[0] - sorted[2], sorted[1] - sorted[2]);
    let (largest, c) = tone.invert(brightness);

    let saturation = expand_saturation(range / brightness, c);
    let warm_bend = BEND * c / c.fma(BEND / BEND_LIMIT, 1.0) * min(saturation, 1.0);
    let bend = if is_warm(display, sorted) { warm_bend } else { 0.0 };
    let bent = rise / max(range, 1e-35);
    let t = bent / bend.fma(1.0 - bent, 1.0);

    let largest = largest - BLACK;
    let chroma = largest * saturation;
    with_sorted_components(display, sorted, [largest, chroma.fma(t - 1.0, largest), largest - chroma])
}

/// Exposed ACEScg to linear display sRGB under a tone curve.
#[inline(always)]
pub(super) fn display_from_acescg(tone: &ToneCurve, [r, g, b]: [f32; 3]) -> [f32; 3] {
    let finite = [sanitized(r), sanitized(g), sanitized(b)];
    to_cube(tone, srgb_from_acescg(finite))
}

/// Inverse of [`display_from_acescg`].
#[inline(always)]
pub(super) fn acescg_from_display(tone: &ToneCurve, display: [f32; 3]) -> [f32; 3] {
    acescg_from_srgb(from_cube(tone, clamp_components(display)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{line_xyz, luminance, space};

    const CURVE: ToneCurve = ToneCurve::with_shoulder(0.6, 16.0);

    fn hue_position(rgb: [f32; 3]) -> f32 {
        let [largest, middle, smallest] = sort_components(rgb);
        (middle - smallest) / (largest - smallest)
    }

    #[test]
    fn identity_where_nothing_needs_to_change() {
        for rgb in [[0.5, 0.2, 0.1], [0.0, 0.6, 0.3], [0.0; 3], [0.25; 3], [1e-6, 0.0, 0.5]] {
            for (a, b) in to_cube(&CURVE, rgb).iter().zip(rgb) {
                assert!((a - b).abs() < 1e-7, "{rgb:?}");
            }
        }
        // A color outside sRGB mixed with white: (0.5, -0.1, 0.2) has s = 1.2, t = 0.5; s' = 1 gives (0.5, 0, 0.25).
        let mapped = to_cube(&CURVE, [0.5, -0.1, 0.2]);
        assert!((mapped[2] - 0.25).abs() < 1e-6 && mapped[1] == 0.0 && mapped[0] == 0.5, "{mapped:?}");
    }

    #[test]
    fn inverse_over_the_cube() {
        for curve in [CURVE, ToneCurve::clip()] {
            for index in 0..17 * 17 * 17 {
                let c = [index % 17, index / 17 % 17, index / 289].map(|i| i as f32 / 16.0);
                let back = to_cube(&curve, from_cube(&curve, c));
                let worst = c.iter().zip(back).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(worst < 2e-6, "{c:?} came back as {back:?}");
            }
        }
    }

    #[test]
    fn more_exposure_never_darkens_any_component() {
        let colors = [[1.0, 0.3, 0.0], [1.0, 0.03, -0.02], [0.2, 1.0, -0.13], [0.15, -0.13, 1.0], [1.0, 0.9, 0.8]];
        for color in colors {
            let mut before = [0.0; 3];
            for step in -400..=1200 {
                let scale = libm::exp2f(step as f32 / 50.0);
                let display = to_cube(&CURVE, color.map(|v| v * scale));
                for (now, then) in display.iter().zip(before) {
                    assert!((0.0..=1.0).contains(now) && *now >= then - 2e-6, "{color:?} at {scale}");
                    assert!(now - then < 0.05, "step at {scale}");
                }
                before = display;
            }
            assert!(before.iter().all(|v| *v > 0.99), "{color:?} ends at {before:?}, not at white");
        }
    }

    #[test]
    fn hue_is_kept_but_for_a_bounded_bend_to_yellow() {
        for index in 0..6 * 20 {
            let t = (index % 20) as f32 / 20.0 + 0.02;
            let order = [[0, 1, 2], [1, 0, 2], [1, 2, 0], [2, 1, 0], [2, 0, 1], [0, 2, 1]][index / 20];
            for scale in [0.1, 0.8, 2.0, 7.0, 15.0, 60.0] {
                let mut rgb = [0.0; 3];
                (rgb[order[0]], rgb[order[1]], rgb[order[2]]) = (scale, scale * (0.1 + 0.9 * t), scale * 0.1);
                let after = hue_position(to_cube(&CURVE, rgb));
                let shift = after - t;
                let limit = if index / 20 == 0 { 34.0 / 60.0 } else { 2e-5 };
                assert!((-2e-5..=limit).contains(&shift), "{rgb:?}: {t} to {after}");
            }
        }
    }

    #[test]
    fn neighbors_stay_neighbors() {
        // Across every border of sectors and the gray axis, at brightness below, in and beyond the shoulder.
        let seeds =
            [[1.0, 1.0, 0.2], [1.0, 0.2, 0.2], [0.5, 0.5, 0.5], [0.2, 1.0, 1.0], [1.0, 0.2, 1.0], [1.0, 0.3, 0.0]];
        for (seed, scale) in seeds.iter().flat_map(|seed| [0.4, 0.6, 1.0, 4.0, 16.0].map(|scale| (seed, scale))) {
            for nudge in [[1e-4, 0.0, 0.0], [0.0, -1e-4, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4], [0.0, 0.0, -1e-4]] {
                let base = seed.map(|v| v * scale);
                let near = [0, 1, 2].map(|i| base[i] + nudge[i] * scale);
                let (a, b) = (to_cube(&CURVE, base), to_cube(&CURVE, near));
                assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-3), "{base:?} {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn a_flame_runs_red_orange_yellow_white() {
        let light = crate::color::black_body().radiance(1900.0);
        let unit = light.map(|v| v / luminance(light));
        let shown = |exposure: f32| to_cube(&CURVE, space::srgb_from_acescg(unit.map(|v| v * exposure)));
        let hue_at = |exposure: f32| hue_position(shown(exposure));
        assert!(hue_at(0.2) < 0.35 && hue_at(0.8) < 0.55, "orange while dim: {} {}", hue_at(0.2), hue_at(0.8));
        assert!(hue_at(4.0) > 0.7, "toward yellow: {}", hue_at(4.0));
        let bright = shown(6.0);
        assert!(bright[2] > 0.2 && bright[1] > 0.75, "yellow-white, neither flat yellow nor salmon: {bright:?}");
        let deep = crate::color::black_body().radiance(1000.0);
        let red = to_cube(&CURVE, space::srgb_from_acescg(deep.map(|v| v * 0.1 / luminance(deep))));
        assert!(red[1] < 0.05 * red[0], "deep red: {red:?}");
    }

    #[test]
    fn auroral_lines_are_shown_in_their_hue() {
        for wavelength in [391.44, 427.81, 557.734, 630.03, 670.48] {
            let xyz = line_xyz(wavelength);
            let rgb = space::SRGB_FROM_XYZ.apply(xyz.map(|v| v / (xyz[0] + xyz[1] + xyz[2]))).map(|v| v as f32);
            let shown = to_cube(&CURVE, rgb);
            assert!(shown.iter().all(|v| (0.0..=1.0).contains(v)) && shown.contains(&0.0), "{shown:?}");
        }
    }
}
