//! The response of a camera: channels saturate one by one, and a part of each channel's light reaches the others.
//!
//! With the light `x` of the linear sRGB channels, 1 being display white at the camera's exposure,
//!
//! 1. crosstalk `v = (1 - k) x + k (0.5 r + 0.35 g + 0.15 b)`: the filters of a sensor overlap, so strong light of one color also fills the
//!    other channels, and a flame becomes yellow, then white;
//! 2. on each channel the response `y = (1 - e^-u) / (1 - e^-U)` with `u = (s v)^p`, where `U` is `u` at the white point: the fraction of grains or of
//!    wells that Poisson-distributed light fills (Mees and James 1966, the characteristic curve of an emulsion), with a contrast `p` at its toe.
//!
//! Both steps have an inverse, so that every display color is the response to some light. That of saturated colors has negative components, which are kept.

use std::sync::LazyLock;

use super::{
    gamut::sanitized,
    row::{ChannelInverse, DisplayTransform},
    transfer::{clamp_components, clamp_unit, decode_srgb8},
};
use crate::{
    color::space::{Matrix3, SRGB_FROM_ACESCG, apply_single},
    math::{MulAdd, approximations},
};

/// Fraction `k` of each channel that is mixed light. At 0.06 overexposed flames are flat yellow, at 0.10 they turn pink.
const CROSSTALK: f64 = 0.08;
/// Weights of red, green and blue in the mixed light.
const MIXED_LIGHT: [f64; 3] = [0.5, 0.35, 0.15];
/// Sensitivity `s`: mid-gray, 0.18, is shown as 0.165, and 1.0 as 0.726.
const SENSITIVITY: f32 = 1.25;
/// Exponent `p` of the toe. Above 1 it deepens shadows and the red of dim flames, as photographs show them.
const CONTRAST: f32 = 1.15;
/// Light of all channels that is shown as white.
const WHITE: f32 = 8.0;
/// `1 - e^-U` with `U = (SENSITIVITY WHITE)^CONTRAST = 14.125`.
const RESPONSE_TO_WHITE: f32 = 0.999_999_3;

const LOG2_E: f32 = std::f32::consts::LOG2_E;

/// The channels after crosstalk, of linear sRGB.
const MIXED_FROM_SRGB: Matrix3 = {
    let [r, g, b] = [CROSSTALK * MIXED_LIGHT[0], CROSSTALK * MIXED_LIGHT[1], CROSSTALK * MIXED_LIGHT[2]];
    let own = 1.0 - CROSSTALK;
    Matrix3([[own + r, g, b], [r, own + g, b], [r, g, own + b]])
};

/// The transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CameraResponse;

/// Display light of a channel.
#[inline(always)]
fn response(light: f32) -> f32 {
    // The lower bound keeps the logarithm finite: its response is 0 in single precision.
    let bounded = if light > 1e-12 { light } else { 1e-12 };
    let bounded = if bounded < WHITE { bounded } else { WHITE };
    // Between 1e-14 and 15: both powers of 2 are far from the ends of the range of floats.
    let u = approximations::exp2_in_range(CONTRAST * approximations::log2_of_normal(SENSITIVITY * bounded));
    (1.0 - approximations::exp2_in_range(-LOG2_E * u)) * (1.0 / RESPONSE_TO_WHITE)
}

/// The light of a channel that is shown as `display`, 0 to 1.
#[inline(always)]
fn inverse_response(display: f32) -> f32 {
    let u = approximations::log2(display.fma(-RESPONSE_TO_WHITE, 1.0)) * (-1.0 / LOG2_E);
    let light = approximations::exp2(approximations::log2(u) * (1.0 / CONTRAST)) * (1.0 / SENSITIVITY);
    if u > 0.0 { light } else { 0.0 }
}

impl DisplayTransform for CameraResponse {
    #[inline(always)]
    fn display_from_acescg(&self, [r, g, b]: [f32; 3]) -> [f32; 3] {
        let [r, g, b] = apply_single(
            &const { MIXED_FROM_SRGB.times(&SRGB_FROM_ACESCG).single() },
            [sanitized(r), sanitized(g), sanitized(b)],
        );
        clamp_components([response(r), response(g), response(b)])
    }

    #[inline(always)]
    fn acescg_from_display(&self, display: [f32; 3]) -> [f32; 3] {
        let [r, g, b] = clamp_components(display);
        self.acescg_from_channels([inverse_response(r), inverse_response(g), inverse_response(b)])
    }
}

impl ChannelInverse for CameraResponse {
    fn channels_of_codes(&self) -> &'static [f32; 256] {
        static CHANNELS: LazyLock<[f32; 256]> = LazyLock::new(|| {
            let mut channels = [0.0; 256];
            for (code, channel) in (0..=255).zip(&mut channels) {
                *channel = inverse_response(clamp_unit(decode_srgb8(code)));
            }
            channels
        });
        &CHANNELS
    }

    #[inline(always)]
    fn acescg_from_channels(&self, channels: [f32; 3]) -> [f32; 3] {
        apply_single(&const { MIXED_FROM_SRGB.times(&SRGB_FROM_ACESCG).inverse().single() }, channels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{acescg_from_srgb, luminance};

    /// Linear display light of linear sRGB.
    fn shown(srgb: [f32; 3]) -> [f32; 3] {
        CameraResponse.display_from_acescg(acescg_from_srgb(srgb))
    }

    #[test]
    fn grays_are_shown_as_the_formula_says() {
        for (light, expected) in [
            (0.0, 0.0),
            // (1.25 x 0.18)^1.15 = 0.179885.
            (0.18, 0.164_63),
            // 1.25^1.15 = 1.29255.
            (1.0, 0.725_43),
            (8.0, 1.0),
            (1e9, 1.0),
            (f32::INFINITY, 1.0),
        ] {
            for value in shown([light; 3]) {
                assert!((value - expected).abs() < 2e-5, "{light}: {value} is not {expected}");
            }
        }
        let end = 1.0 - libm::exp(-libm::pow(10.0, 1.15));
        assert!((end - f64::from(RESPONSE_TO_WHITE)).abs() < 6e-8, "{end}");
    }

    #[test]
    fn crosstalk_leaves_gray_as_it_is_and_mixes_a_twelfth_of_red_into_the_other_channels() {
        let gray = MIXED_FROM_SRGB.apply([0.7; 3]);
        assert!(gray.iter().all(|value| (value - 0.7).abs() < 1e-12), "{gray:?}");
        let red = MIXED_FROM_SRGB.apply([1.0, 0.0, 0.0]);
        assert!((red[0] - 0.96).abs() < 1e-12 && (red[1] - 0.04).abs() < 1e-12 && red[1] == red[2], "{red:?}");
    }

    #[test]
    fn the_response_rises_everywhere_and_its_inverse_returns_the_light() {
        let mut before = 0.0;
        for i in 1..4000 {
            let light = 8.0 * libm::powf(i as f32 / 4000.0, 3.0);
            let value = response(light);
            assert!(value >= before, "{light}");
            before = value;
            // Near white a step of single precision is much light.
            if value < 0.98 && value > 1e-4 {
                let back = inverse_response(value);
                assert!((back - light).abs() < 2e-3 * light, "{light} came back as {back}");
            }
        }
        assert_eq!([inverse_response(0.0), response(0.0)], [0.0; 2]);
    }

    #[test]
    fn a_flame_runs_red_orange_yellow_white() {
        let light = crate::color::black_body().radiance(1900.0);
        let unit = light.map(|value| value / luminance(light));
        let at = |exposure: f32| CameraResponse.display_from_acescg(unit.map(|value| value * exposure));
        let [dim, middle, bright, brightest] = [0.1, 0.5, 1.5, 6.0].map(at);
        assert!(dim[1] < 0.25 * dim[0] && dim[2] < 0.5 * dim[1], "red: {dim:?}");
        assert!(middle[1] > 0.25 * middle[0] && middle[1] < 0.55 * middle[0], "orange: {middle:?}");
        assert!(bright[0] > 0.97 && bright[1] > 0.5 && bright[2] < 0.5, "yellow: {bright:?}");
        assert!(brightest.iter().all(|value| *value > 0.55) && brightest[1] > 0.98, "nearly white: {brightest:?}");
    }

    #[test]
    fn more_exposure_never_darkens_any_component() {
        for color in [[1.0, 0.3, 0.0], [1.0, 0.03, -0.02], [0.2, 1.0, -0.1], [0.15, -0.05, 1.0], [1.0, 0.9, 0.8]] {
            let mut before = [0.0; 3];
            for step in -400..=600 {
                let display = shown(color.map(|value| value * libm::exp2f(step as f32 / 50.0)));
                assert!(display.iter().zip(before).all(|(now, then)| *now >= then - 1e-6), "{color:?} at {step}");
                before = display;
            }
        }
    }
}
