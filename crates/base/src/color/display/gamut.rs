//! From linear sRGB without limits into the displayable cube: tone, the path of highlights to white, and the gamut map.
//!
//! A color is taken apart as in HSV, which holds for negative components too: brightness `m = max`, saturation
//! `s = (max - min) / max` (above 1 outside sRGB) and the place `t = (mid - min) / (max - min)` in its sector of hue. Then
//!
//! 1. brightness takes the tone curve, which also tells the compression `c`;
//! 2. saturation shrinks, `v = s (1 - w)` with `w = c^2 / (c^2 + c0^2)`: bright colors run to white. Inside sRGB `s' = v`; from outside
//!    `s' = 1 - (1 - v)^2 / w` up to `v = 1`, a soft onset, and 1 beyond: mixed with just enough white. Mixing with white keeps `t`,
//!    that is the dominant wavelength;
//! 3. colors from red to yellow, and no others, are bent toward yellow as they are compressed: `t' = t (1 + a) / (1 + a t)`, the
//!    change of ratio a Reinhard curve on each channel would make. Without it over-exposed flames turn salmon, with channels that are
//!    simply clipped they turn flat yellow. `a <= BEND_LIMIT` keeps the shift of hue below 34 degrees of HSV.
//!
//! Each step is a bijection onto its range and depends only on what is undone before it, so the whole has an exact inverse on the cube.

use super::tone::ToneCurve;
use crate::math::MulAdd;

/// Compression at which a color is half way to white (`c0`): chosen by eye on ramps of black bodies from 1000 to 3000 K.
const HALF_WHITE_COMPRESSION: f32 = 17.0;
const HALF_WHITE_SQUARED: f32 = HALF_WHITE_COMPRESSION * HALF_WHITE_COMPRESSION;
/// Growth of the bend `a` with compression: `a = BEND c / (1 + BEND c / BEND_LIMIT) min(s, 1)`.
const BEND: f32 = 1.8;
/// Largest bend.
const BEND_LIMIT: f32 = 11.0;

/// Below this a color is black, so that no quotient underflows. It is taken off again at the end: a test there for black would share its
/// condition with the maximum at the start, for which the compiler splits the loop and gives up vectors.
const BLACK: f32 = 1e-12;
/// Larger components count as this, so that no product overflows.
const LARGEST: f32 = 1e8;

#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// A component within what the formulas bear: NaN and minus infinity become 0.
#[inline(always)]
pub(super) fn sanitised(x: f32) -> f32 {
    let finite = if x.abs() <= LARGEST { x } else { 0.0 };
    if x > LARGEST { LARGEST } else { finite }
}

/// Largest, middle and smallest component.
#[inline(always)]
fn sorted([r, g, b]: [f32; 3]) -> [f32; 3] {
    let (high, low) = (max(r, g), min(r, g));
    [max(high, b), max(low, min(high, b)), min(low, b)]
}

/// `value` replaced by the new largest, middle or smallest component, whichever it was.
#[inline(always)]
fn replaced(value: f32, [most, _, least]: [f32; 3], values: [f32; 3]) -> f32 {
    let lower = if value <= least { values[2] } else { values[1] };
    if value >= most { values[0] } else { lower }
}

/// Puts new values for the largest, middle and smallest component where `rgb` has them.
#[inline(always)]
fn placed([r, g, b]: [f32; 3], parts: [f32; 3], values: [f32; 3]) -> [f32; 3] {
    [replaced(r, parts, values), replaced(g, parts, values), replaced(b, parts, values)]
}

/// Whether the hue lies from red to yellow: red is largest and blue smallest.
#[inline(always)]
fn is_warm(rgb: [f32; 3], [most, _, least]: [f32; 3]) -> bool {
    (rgb[0] >= most) & (rgb[2] <= least)
}

/// Saturation `s` on its path to white at compression `c`.
#[inline(always)]
fn whitened(s: f32, c: f32) -> f32 {
    // 1 - w = c0^2 / sum and 1 / w = sum / c^2 from one division. Without compression 1 - v is 0 wherever 1 / w is used.
    let squared = max(c * c, 1e-20);
    let sum = squared + HALF_WHITE_SQUARED;
    let reciprocal = 1.0 / (squared * sum);
    let v = min(s * (HALF_WHITE_SQUARED * (squared * reciprocal)), 1.0);
    let outside = 1.0 - (1.0 - v) * (1.0 - v) * (sum * (sum * reciprocal));
    let bounded = max(outside, 0.0);
    if s > 1.0 { bounded } else { v }
}

/// The saturation that [`whitened`] takes to `s`, 0 to 1.
#[inline(always)]
fn unwhitened(s: f32, c: f32) -> f32 {
    let sum = c.fma(c, HALF_WHITE_SQUARED);
    let w = c * c / sum;
    let outside = 1.0 - ((1.0 - s) * w).sqrt();
    let v = if 1.0 - s < w { outside } else { s };
    v * (sum / HALF_WHITE_SQUARED)
}

/// Linear sRGB of any size and sign to linear display sRGB within 0..=1. Components must be [`sanitised`].
#[inline(always)]
pub(super) fn to_cube(tone: &ToneCurve, rgb: [f32; 3]) -> [f32; 3] {
    let parts = sorted(rgb);
    let most = max(parts[0], BLACK);
    let (range, rise) = (parts[0] - parts[2], parts[1] - parts[2]);
    let (brightness, c) = tone.apply(most);
    let brightness = brightness - BLACK;

    let saturation = whitened(range / most, c);

    // t' with t = rise / range and a = bend / scale, brought to one division.
    let warm_bend = BEND * c * min(range, most);
    let bend = if is_warm(rgb, parts) { warm_bend } else { 0.0 };
    let scale = most * c.fma(BEND / BEND_LIMIT, 1.0);
    let t = rise * (scale + bend) / max(range.fma(scale, bend * rise), 1e-35);

    let chroma = brightness * saturation;
    placed(rgb, parts, [brightness, chroma.fma(min(t, 1.0) - 1.0, brightness), brightness - chroma])
}

/// The linear sRGB that [`to_cube`] takes to `display`, whose components lie within 0..=1; reaches outside sRGB for the brightest colors.
#[inline(always)]
pub(super) fn from_cube(tone: &ToneCurve, display: [f32; 3]) -> [f32; 3] {
    let parts = sorted(display);
    let brightness = max(parts[0], BLACK);
    let (range, rise) = (parts[0] - parts[2], parts[1] - parts[2]);
    let (most, c) = tone.invert(brightness);

    let saturation = unwhitened(range / brightness, c);
    let warm_bend = BEND * c / c.fma(BEND / BEND_LIMIT, 1.0) * min(saturation, 1.0);
    let bend = if is_warm(display, parts) { warm_bend } else { 0.0 };
    let bent = rise / max(range, 1e-35);
    let t = bent / bend.fma(1.0 - bent, 1.0);

    let most = most - BLACK;
    let chroma = most * saturation;
    placed(display, parts, [most, chroma.fma(t - 1.0, most), most - chroma])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{line_xyz, luminance, space};

    const CURVE: ToneCurve = ToneCurve::with_shoulder(0.6, 16.0);

    fn place_in_sector(rgb: [f32; 3]) -> f32 {
        let [most, mid, least] = sorted(rgb);
        (mid - least) / (most - least)
    }

    #[test]
    fn identity_where_nothing_needs_to_change() {
        for rgb in [[0.5, 0.2, 0.1], [0.0, 0.6, 0.3], [0.0; 3], [0.25; 3], [1e-6, 0.0, 0.5]] {
            for (a, b) in to_cube(&CURVE, rgb).iter().zip(rgb) {
                assert!((a - b).abs() < 1e-7, "{rgb:?}");
            }
        }
        // One part of white in a color outside: (0.5, -0.1, 0.2) has s = 1.2, t = 0.5; s' = 1 gives (0.5, 0, 0.25).
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
        let colours = [[1.0, 0.3, 0.0], [1.0, 0.03, -0.02], [0.2, 1.0, -0.13], [0.15, -0.13, 1.0], [1.0, 0.9, 0.8]];
        for colour in colours {
            let mut before = [0.0; 3];
            for step in -400..=1200 {
                let scale = libm::exp2f(step as f32 / 50.0);
                let display = to_cube(&CURVE, colour.map(|v| v * scale));
                for (now, then) in display.iter().zip(before) {
                    assert!((0.0..=1.0).contains(now) && *now >= then - 2e-6, "{colour:?} at {scale}");
                    assert!(now - then < 0.05, "step at {scale}");
                }
                before = display;
            }
            assert!(before.iter().all(|v| *v > 0.99), "{colour:?} ends at {before:?}, not at white");
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
                let after = place_in_sector(to_cube(&CURVE, rgb));
                let shift = after - t;
                let limit = if index / 20 == 0 { 34.0 / 60.0 } else { 2e-5 };
                assert!((-2e-5..=limit).contains(&shift), "{rgb:?}: {t} to {after}");
            }
        }
    }

    #[test]
    fn neighbours_stay_neighbours() {
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
        let place = |exposure: f32| place_in_sector(shown(exposure));
        assert!(place(0.2) < 0.35 && place(0.8) < 0.55, "orange while dim: {} {}", place(0.2), place(0.8));
        assert!(place(4.0) > 0.7, "toward yellow: {}", place(4.0));
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
