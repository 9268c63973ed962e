//! The codes of display pictures, compared with the definitions in double precision.

use bansho::{
    base::{
        color::{AlphaConvention, View},
        math,
    },
    render::display::BitDepth,
};

use crate::light::{self, ALPHA_KINDS, COUNT, WIDTHS};

/// What is below 0 or not a number counts as 0, what is beyond 1 as 1.
fn held(value: f32) -> f64 {
    if value.is_nan() { 0.0 } else { f64::from(value).clamp(0.0, 1.0) }
}

/// sRGB's definition (IEC 61966-2-1), or the number itself.
fn encoded(light: f64, is_raw: bool) -> f64 {
    match light {
        _ if is_raw => light,
        light if light <= 0.003_130_8 => 12.92 * light,
        light => 1.055 * math::pow(light, 1.0 / 2.4) - 0.055,
    }
}

/// The coverage follows from the encoded light over a mid-gray background (`AlphaConvention::Encoded`).
fn encoded_coverage(light: f64, alpha: f64) -> f64 {
    let gray = math::pow((0.5 + 0.055) / 1.055, 2.4);
    let behind = encoded((light + (1.0 - alpha) * gray).min(1.0), false) - encoded(light, false);
    (1.0 - behind / 0.5).clamp(0.0, 1.0)
}

struct Case {
    bits: BitDepth,
    alpha: Option<AlphaConvention>,
    is_raw: bool,
}

impl Case {
    /// How far a code may be from the exact number: rounding, the dither of 8 bits, and single precision.
    fn tolerance(&self) -> f64 {
        if self.bits == BitDepth::Eight { 0.97 } else { 0.6 }
    }

    /// Whether `codes` are those of gray light and coverage.
    fn check(&self, pixel: [f32; 4], codes: [u16; 4]) {
        let [light, _, _, alpha] = pixel.map(held);
        let full = light::largest(self.bits);
        if light == 1.0 {
            assert_eq!(codes, [full; 4], "{}", self.told(pixel, codes));
        }
        let [red, green, blue, own_alpha] = codes.map(|code| f64::from(code) / f64::from(full));
        let color = self.color(light, [red, green, blue], own_alpha);
        assert!(color, "{}", self.told(pixel, codes));
        let coverage = match self.alpha {
            None => 1.0,
            Some(AlphaConvention::Linear) => alpha.max(light),
            Some(AlphaConvention::Encoded) => encoded_coverage(light, alpha).max(encoded(light, false)),
        };
        let off = (own_alpha - coverage).abs() * f64::from(full);
        // Where light is seen, alpha is rounded up.
        let most = if [0.0, 1.0].contains(&coverage) { 0.0 } else { self.tolerance() + 0.5 };
        assert!(off <= most, "{}, alpha should be {coverage}", self.told(pixel, codes));
    }

    /// Whether a color, and alpha after rounding, are those of gray `light`.
    fn color(&self, light: f64, color: [f64; 3], own_alpha: f64) -> bool {
        let (shown, wanted) = match self.alpha {
            None => (color, encoded(light, self.is_raw)),
            Some(AlphaConvention::Encoded) => (color.map(|part| part * own_alpha), encoded(light, false)),
            Some(AlphaConvention::Linear) if own_alpha == 0.0 => (color, 0.0),
            Some(AlphaConvention::Linear) => (color, encoded((light / own_alpha).min(1.0), self.is_raw)),
        };
        // The color of encoded alpha is rounded twice.
        let most = self.tolerance() + if self.alpha == Some(AlphaConvention::Encoded) { 0.5 } else { 0.0 };
        shown.iter().all(|part| (part - wanted).abs() * f64::from(light::largest(self.bits)) <= most)
    }

    fn told(&self, pixel: [f32; 4], codes: [u16; 4]) -> String {
        format!("{pixel:?} is {codes:?} in {:?}, {:?}, raw {}", self.bits, self.alpha, self.is_raw)
    }
}

#[test]
fn light_at_the_ends_of_its_range_has_the_codes_of_the_definitions_in_every_depth_and_width() {
    for (bits, alpha) in
        [BitDepth::Eight, BitDepth::Sixteen].into_iter().flat_map(|bits| ALPHA_KINDS.map(|a| (bits, a)))
    {
        for view in [View::STANDARD, View::RAW] {
            let is_raw = view == View::RAW;
            let case =
                Case { bits, alpha: alpha.map(|alpha| if is_raw { AlphaConvention::Linear } else { alpha }), is_raw };
            for width in WIDTHS {
                let frame = light::frame(width, alpha.is_none());
                let codes = light::codes(&light::shown(&frame, &view, bits, alpha));
                assert_eq!(codes.len(), width * COUNT);
                frame.beauty.pixels().iter().zip(codes).for_each(|(pixel, codes)| case.check(*pixel, codes));
            }
        }
    }
}

/// The default view has its own curve, but the same ends.
#[test]
fn the_default_view_shows_black_and_white_in_every_depth_under_any_white_balance() {
    for (bits, alpha) in
        [BitDepth::Eight, BitDepth::Sixteen].into_iter().flat_map(|bits| ALPHA_KINDS.map(|a| (bits, a)))
    {
        for kelvin in [None, Some(2500.0), Some(4000.0), Some(10_000.0)] {
            let mut frame = light::frame(35, alpha.is_none());
            frame.header.white_balance_k = kelvin;
            let codes = light::codes(&light::shown(&frame, &View::DISPLAY, bits, alpha));
            for ([light, _, _, own_alpha], codes) in frame.beauty.pixels().iter().zip(codes) {
                if *light >= 65_504.0 {
                    assert_eq!(codes, [light::largest(bits); 4], "{light} {own_alpha} {alpha:?} {kelvin:?}");
                } else if *light == 0.0 || light.is_nan() {
                    assert_eq!(codes[..3], [0; 3], "{light} {own_alpha} {alpha:?} {kelvin:?}");
                }
            }
        }
    }
}
