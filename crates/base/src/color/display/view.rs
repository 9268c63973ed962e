//! The view transform: exposed scene-linear ACEScg to display pixels, and back.

use fearless_simd::{Level, dispatch};

use super::{
    agx::Agx,
    alpha::{AlphaConvention, AlphaMode},
    camera_response::CameraResponse,
    gamut::sanitized,
    quantize::DisplayCode,
    row::{self, Clamped, DisplayTransform},
    tone::ToneCurve,
    transfer::VALUES_OF_CODES,
};
use crate::color::white_balance::WhiteBalance;

/// Scene brightness up to which the view `neutral` is the identity.
const KNEE: f32 = 0.6;
/// Scene brightness that the view `neutral` shows as full display light.
const WHITE: f32 = 16.0;
/// Pixels that are white-balanced at a time.
const BALANCE_CHUNK: usize = 256;

crate::choice! {
    /// A transform of exposed scene light for display.
    pub enum ViewName {
        /// As a camera shows the scene: on each channel a response with a toe and a shoulder that ends at 8 times display white, and 8 % of crosstalk
        /// between the channels.
        Display = "display",
        /// For colors that must stay as they are: the identity for colors inside sRGB below 0.6, a shoulder up to 16. Highlights desaturate toward white, and
        /// hue is preserved except in warm highlights, which shift toward yellow.
        Neutral = "neutral",
        /// AgX as in Blender 4 and three.js: a film-like sigmoid on each channel, in which bright colors become pale.
        Agx = "agx",
        /// The identity inside sRGB up to 1.0. Only values beyond are changed, by the desaturation of `neutral`.
        Standard = "standard",
        /// ACEScg values clamped to 0 to 1, without encoding.
        Raw = "raw",
    }
}

/// A transform of exposed scene light for display, with the white balance of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    transform: Transform,
    /// White balance, applied first; `None` for `raw`.
    balance: Option<WhiteBalance>,
    name: ViewName,
}

/// The transform of a view, after its white balance.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Transform {
    CameraResponse,
    ToneMapped(ToneCurve),
    Agx,
    Raw,
}

impl Default for View {
    fn default() -> Self {
        Self::DISPLAY
    }
}

impl From<ViewName> for View {
    fn from(name: ViewName) -> Self {
        match name {
            ViewName::Display => Self::DISPLAY,
            ViewName::Neutral => Self::NEUTRAL,
            ViewName::Agx => Self::AGX,
            ViewName::Standard => Self::STANDARD,
            ViewName::Raw => Self::RAW,
        }
    }
}

impl View {
    /// The default: the response of a camera (`camera_response`), sRGB encoding.
    pub const DISPLAY: Self = Self { transform: Transform::CameraResponse, balance: None, name: ViewName::Display };
    /// Tone curve, desaturated highlights, gamut mapping ([`gamut`](super::gamut)), sRGB encoding.
    pub const NEUTRAL: Self = Self {
        transform: Transform::ToneMapped(ToneCurve::with_shoulder(KNEE, WHITE)),
        balance: None,
        name: ViewName::Neutral,
    };
    /// AgX, as Blender 4 and three.js show light by default.
    pub const AGX: Self = Self { transform: Transform::Agx, balance: None, name: ViewName::Agx };
    /// No tone curve: gamut mapping and sRGB encoding.
    pub const STANDARD: Self =
        Self { transform: Transform::ToneMapped(ToneCurve::clip()), balance: None, name: ViewName::Standard };
    /// Linear ACEScg, clamped.
    pub const RAW: Self = Self { transform: Transform::Raw, balance: None, name: ViewName::Raw };

    /// The same view with the camera's white balance set to the light of a black body of that temperature, K; `None` is D65. `raw` ignores white
    /// balance.
    #[must_use]
    pub fn with_white_balance(mut self, temperature_k: Option<f64>) -> Self {
        self.balance = temperature_k.filter(|_| self.transform != Transform::Raw).map(WhiteBalance::from_black_body);
        self
    }

    /// The convention of alpha in this view where `requested` is asked for: `raw` encodes nothing, so its alpha is always linear.
    #[must_use]
    pub fn alpha_convention(&self, requested: AlphaConvention) -> AlphaConvention {
        if self.transform == Transform::Raw { AlphaConvention::Linear } else { requested }
    }

    /// The view's name.
    #[must_use]
    pub fn name(&self) -> ViewName {
        self.name
    }

    /// Exposed ACEScg to linear display light within 0..=1: linear sRGB, or clamped ACEScg for `raw`. Never NaN.
    #[inline(always)]
    #[must_use]
    pub fn to_display(&self, acescg: [f32; 3]) -> [f32; 3] {
        let balanced = match &self.balance {
            Some(balance) => apply_balance(balance, acescg),
            None => acescg,
        };
        match &self.transform {
            Transform::CameraResponse => CameraResponse.display_from_acescg(balanced),
            Transform::ToneMapped(tone) => tone.display_from_acescg(balanced),
            Transform::Agx => Agx.display_from_acescg(balanced),
            Transform::Raw => Clamped.display_from_acescg(balanced),
        }
    }

    /// The exposed ACEScg that this view displays as the linear sRGB `display` (clamped to 0..=1): the inverse of
    /// [`to_display`](Self::to_display) to within 1e-5. Bright saturated colors come from outside sRGB. `raw` has no sRGB encoding to
    /// invert; for it the color is only converted to ACEScg.
    #[inline(always)]
    #[must_use]
    pub fn to_scene(&self, display: [f32; 3]) -> [f32; 3] {
        let balanced = match &self.transform {
            Transform::CameraResponse => CameraResponse.acescg_from_display(display),
            Transform::ToneMapped(tone) => tone.acescg_from_display(display),
            Transform::Agx => Agx.acescg_from_display(display),
            Transform::Raw => Clamped.acescg_from_display(display),
        };
        match &self.balance {
            Some(balance) => balance.invert(balanced),
            None => balanced,
        }
    }

    /// [`to_scene`](Self::to_scene) for many pixels in place: linear sRGB in, exposed ACEScg out; the fourth component is unchanged.
    pub fn to_scene_row(&self, level: Level, pixels: &mut [[f32; 4]]) {
        match &self.transform {
            Transform::CameraResponse => dispatch!(level, _simd => row::to_scene(&CameraResponse, pixels)),
            Transform::ToneMapped(tone) => dispatch!(level, _simd => row::to_scene(tone, pixels)),
            Transform::Agx => dispatch!(level, _simd => row::to_scene(&Agx, pixels)),
            Transform::Raw => dispatch!(level, _simd => row::to_scene(&Clamped, pixels)),
        }
        self.invert_balance(pixels);
    }

    /// [`to_scene`](Self::to_scene) for many sRGB-encoded values in place, exposed ACEScg out; the fourth component is unchanged. Values of 8-bit codes are
    /// converted by tables.
    pub fn encoded_to_scene_row(&self, level: Level, pixels: &mut [[f32; 4]]) {
        if self.transform != Transform::CameraResponse {
            row::decode(pixels);
            self.to_scene_row(level, pixels);
            return;
        }
        dispatch!(level, _simd => row::encoded_to_scene(&CameraResponse, pixels));
        self.invert_balance(pixels);
    }

    /// [`to_scene`](Self::to_scene) for many opaque pixels of sRGB codes: exposed ACEScg and 1. The codes' alpha is not read. The shorter of both slices
    /// determines how many are written.
    pub fn codes_to_scene_row(&self, level: Level, codes: &[[u8; 4]], scene: &mut [[f32; 4]]) {
        if self.transform == Transform::CameraResponse {
            dispatch!(level, _simd => row::codes_to_scene(&CameraResponse, codes, scene));
            self.invert_balance(scene);
            return;
        }
        for (pixel, [r, g, b, _]) in scene.iter_mut().zip(codes) {
            let [r, g, b] = [usize::from(*r), usize::from(*g), usize::from(*b)];
            *pixel = [VALUES_OF_CODES[r], VALUES_OF_CODES[g], VALUES_OF_CODES[b], 1.0];
        }
        self.encoded_to_scene_row(level, scene);
    }

    /// Removes the white balance from many pixels.
    fn invert_balance(&self, pixels: &mut [[f32; 4]]) {
        let Some(balance) = &self.balance else { return };
        for pixel in pixels {
            [pixel[0], pixel[1], pixel[2]] = balance.invert([pixel[0], pixel[1], pixel[2]]);
        }
    }

    /// Converts one row of premultiplied, exposed ACEScg to display codes.
    ///
    /// `y` and `x0` are the picture coordinates of the row and its first pixel, so that a crop is dithered like the whole picture. Without an
    /// `alpha` convention (when there is a plate) pixels are opaque. With [`AlphaConvention::Linear`] `A = max(alpha, r, g, b)` in linear
    /// display light and the color is `rgb / A`, encoded; with [`AlphaConvention::Encoded`] blending encoded values over black gives
    /// the opaque codes, and over mid-gray the closest approximation. `raw` has no encoding and is always linear.
    /// Black is code 0 and display white the largest code; 8-bit output is dithered, except that values which are 8-bit codes are preserved.
    /// Values below 0 and NaN count as 0, also in alpha; infinite values count as the brightest light.
    /// The shorter of `pixels` and `out` determines how many pixels are written. The bytes are the same at every `level`.
    pub fn display_row<C: DisplayCode>(
        &self,
        level: Level,
        pixels: &[[f32; 4]],
        y: i64,
        x0: i64,
        alpha: Option<AlphaConvention>,
        out: &mut [[C; 4]],
    ) {
        self.display_row_with_mode(level, pixels, y, x0, alpha.map(AlphaMode::Straight), out);
    }

    /// [`display_row`](Self::display_row) with straight or premultiplied alpha.
    pub fn display_row_with_mode<C: DisplayCode>(
        &self,
        level: Level,
        pixels: &[[f32; 4]],
        y: i64,
        x0: i64,
        alpha: Option<AlphaMode>,
        out: &mut [[C; 4]],
    ) {
        let Some(balance) = &self.balance else { return self.row(level, pixels, [x0, y], alpha, out) };
        let mut buffer = [[0.0; 4]; BALANCE_CHUNK];
        for ((input, out), first) in
            pixels.chunks(BALANCE_CHUNK).zip(out.chunks_mut(BALANCE_CHUNK)).zip((0..).step_by(BALANCE_CHUNK))
        {
            let balanced = &mut buffer[..input.len()];
            for (balanced, [r, g, b, alpha]) in balanced.iter_mut().zip(input) {
                let [r, g, b] = apply_balance(balance, [*r, *g, *b]);
                *balanced = [r, g, b, *alpha];
            }
            self.row(level, balanced, [x0.wrapping_add(first), y], alpha, out);
        }
    }

    /// Converts one row of light that is already white-balanced.
    fn row<C: DisplayCode>(
        &self,
        level: Level,
        pixels: &[[f32; 4]],
        [x0, y]: [i64; 2],
        alpha: Option<AlphaMode>,
        out: &mut [[C; 4]],
    ) {
        // Coordinates are only used by the dither, which repeats after 2^32 pixels.
        let position = row::PixelPosition { x: x0 as u32, y: y as u32 };
        match &self.transform {
            Transform::CameraResponse => {
                dispatch!(level, _simd => row::encode_row::<C, _>(&CameraResponse, pixels, position, alpha, out));
            }
            Transform::ToneMapped(tone) => {
                dispatch!(level, _simd => row::encode_row::<C, _>(tone, pixels, position, alpha, out));
            }
            Transform::Agx => dispatch!(level, _simd => row::encode_row::<C, _>(&Agx, pixels, position, alpha, out)),
            Transform::Raw => dispatch!(level, _simd => row::encode_raw_row::<C>(pixels, position, alpha, out)),
        }
    }
}

/// Applies a white balance. Components are clamped first: the matrix would turn infinite light in all three components into NaN.
#[inline(always)]
fn apply_balance(balance: &WhiteBalance, [r, g, b]: [f32; 3]) -> [f32; 3] {
    balance.apply([sanitized(r), sanitized(g), sanitized(b)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{color::decode_srgb8, math::simd};

    /// Every mode of alpha; opaque without.
    const ALPHA_MODES: [Option<AlphaMode>; 5] = [
        None,
        Some(AlphaMode::Straight(AlphaConvention::Linear)),
        Some(AlphaMode::Straight(AlphaConvention::Encoded)),
        Some(AlphaMode::Premultiplied(AlphaConvention::Linear)),
        Some(AlphaMode::Premultiplied(AlphaConvention::Encoded)),
    ];

    fn all_views() -> impl Iterator<Item = View> {
        let names = ViewName::CHOICES.iter().filter_map(|choice| ViewName::from_name(choice.name));
        names.map(View::from)
    }

    /// Well spread 32-bit numbers, for pictures without structure.
    fn scattered(index: u32) -> u32 {
        let mixed = (index ^ (index >> 16)).wrapping_mul(0x7FEB_352D);
        (mixed ^ (mixed >> 15)).wrapping_mul(0x846C_A68B)
    }

    /// Pixels of every kind: dark, bright, outside sRGB, empty, not finite.
    fn wild_pixels(count: u32) -> Vec<[f32; 4]> {
        let component = |seed: u32| match seed % 19 {
            0 => 0.0,
            1 => f32::NAN,
            2 => f32::INFINITY,
            3 => f32::NEG_INFINITY,
            4 => -0.0,
            5 => f32::MAX,
            6 => 1e-40,
            _ => ((seed >> 8) as f32 / 16_777_216.0 - 0.2) * libm::exp2f((seed % 31) as f32 - 12.0),
        };
        (0..count).map(|i| [0, 1, 2, 3].map(|c| component(scattered(4 * i + c)))).collect()
    }

    #[test]
    fn encoded_rows_have_the_bits_of_decoded_pixels_at_every_vector_level() {
        // Codes of 8 bits, which are read from tables, then values between them, beyond them, and not finite.
        let codes = (0..300_u32).map(|i| [0, 1, 2, 3].map(|c| (scattered(4 * i + c) % 256) as f32 / 255.0));
        let between = (0..100_u32).map(|i| [0, 1, 2, 3].map(|c| scattered(4 * i + c) as f32 / u32::MAX as f32));
        let pixels: Vec<[f32; 4]> = codes.chain(between).chain(wild_pixels(100)).collect();
        for view in all_views().chain([View::DISPLAY.with_white_balance(Some(3200.0))]) {
            for level in simd::available_levels() {
                let mut row = pixels.clone();
                view.encoded_to_scene_row(level, &mut row);
                for (converted, [r, g, b, alpha]) in row.iter().zip(&pixels) {
                    let [red, green, blue] = view.to_scene([*r, *g, *b].map(crate::color::decode_srgb));
                    let expected = [red, green, blue, *alpha];
                    assert_eq!(converted.map(f32::to_bits), expected.map(f32::to_bits), "{view:?} {level:?}");
                }
            }
        }
    }

    #[test]
    fn cube_survives_the_way_to_the_scene_and_back() {
        for view in
            [View::DISPLAY, View::NEUTRAL, View::AGX, View::STANDARD, View::DISPLAY.with_white_balance(Some(4000.0))]
        {
            for index in 0..17 * 17 * 17 {
                let c = [index % 17, index / 17 % 17, index / 289].map(|i| i as f32 / 16.0);
                let back = view.to_display(view.to_scene(c));
                let worst = c.iter().zip(back).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(worst < 1e-5, "{}: {c:?} came back as {back:?}", view.name().name());
            }
        }
    }

    #[test]
    fn an_8_bit_plate_comes_back_byte_for_byte() {
        let level = simd::level();
        // All combinations of steep and flat codes, and a scatter of others.
        let steep = [0, 1, 2, 3, 5, 10, 11, 40, 127, 128, 200, 239, 250, 253, 254, 255];
        let combined = (0..4096).map(|i| [steep[i % 16], steep[i / 16 % 16], steep[i / 256]]);
        let other = (0..40_000).map(|i| [0, 8, 16].map(|shift| (scattered(i) >> shift) as u8));
        let plate: Vec<[u8; 3]> = combined.chain(other).collect();
        for view in [View::DISPLAY, View::NEUTRAL, View::AGX, View::STANDARD] {
            let mut scene: Vec<[f32; 4]> =
                plate.iter().map(|c| [decode_srgb8(c[0]), decode_srgb8(c[1]), decode_srgb8(c[2]), 1.0]).collect();
            view.to_scene_row(level, &mut scene);
            let mut eight = vec![[0_u8; 4]; scene.len()];
            let mut sixteen = vec![[0_u16; 4]; scene.len()];
            view.display_row(level, &scene, 7, -3, None, &mut eight);
            view.display_row(level, &scene, 7, -3, None, &mut sixteen);
            for ((plate, eight), sixteen) in plate.iter().zip(&eight).zip(&sixteen) {
                let [r, g, b] = *plate;
                assert_eq!(*eight, [r, g, b, 255], "{}", view.name().name());
                // In 16 bits the roundings of the way through the scene may show as one step of 65535; two more by the powers of AgX.
                let exact = [r, g, b, 255].map(|code| u16::from(code) * 257);
                let steps = if view == View::AGX { 3 } else { 1 };
                assert!(sixteen.iter().zip(exact).all(|(a, b)| a.abs_diff(b) <= steps), "{sixteen:?} is not {exact:?}");
            }
        }
    }

    #[test]
    fn every_level_gives_the_same_bytes() {
        let pixels = wild_pixels(4099);
        for view in all_views().chain([View::DISPLAY.with_white_balance(Some(4000.0))]) {
            for alpha in ALPHA_MODES {
                let (mut wide, mut narrow) = (vec![[0_u8; 4]; 4099], vec![[9_u8; 4]; 4099]);
                view.display_row_with_mode(simd::level(), &pixels, 5, 11, alpha, &mut wide);
                view.display_row_with_mode(Level::baseline(), &pixels, 5, 11, alpha, &mut narrow);
                assert_eq!(wide, narrow);
                let (mut wide, mut narrow) = (vec![[0_u16; 4]; 4099], vec![[9_u16; 4]; 4099]);
                view.display_row_with_mode(simd::level(), &pixels, 5, 11, alpha, &mut wide);
                view.display_row_with_mode(Level::baseline(), &pixels, 5, 11, alpha, &mut narrow);
                assert_eq!(wide, narrow);
            }
            let (mut wide, mut narrow) = (pixels.clone(), pixels.clone());
            view.to_scene_row(simd::level(), &mut wide);
            view.to_scene_row(Level::baseline(), &mut narrow);
            let bits = |row: &[[f32; 4]]| row.as_flattened().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&wide), bits(&narrow));
        }
    }

    #[test]
    fn rows_agree_with_the_scalar_view() {
        let pixels = wild_pixels(1000);
        for view in [View::DISPLAY, View::NEUTRAL, View::AGX, View::DISPLAY.with_white_balance(Some(4000.0))] {
            let mut out = vec![[0_u16; 4]; pixels.len()];
            view.display_row(simd::level(), &pixels, 0, 0, None, &mut out);
            for (pixel, codes) in pixels.iter().zip(&out) {
                let shown = view.to_display([pixel[0], pixel[1], pixel[2]]);
                assert!(shown.iter().all(|v| (0.0..=1.0).contains(v)), "{pixel:?} {shown:?}");
                for (light, code) in shown.iter().zip(codes) {
                    let expected = crate::color::encode_srgb(*light) * 65_535.0;
                    assert!((expected - f32::from(*code)).abs() <= 0.51, "{pixel:?}");
                }
            }
        }
    }

    #[test]
    fn a_crop_is_part_of_the_whole() {
        let pixels = wild_pixels(300);
        for alpha in ALPHA_MODES {
            let mut whole = vec![[0_u8; 4]; 300];
            View::DISPLAY.display_row_with_mode(simd::level(), &pixels, 40, -20, alpha, &mut whole);
            for (start, end) in [(0, 1), (7, 100), (33, 290), (299, 300)] {
                let mut part = vec![[0_u8; 4]; end - start];
                let first = start as i64 - 20;
                View::DISPLAY.display_row_with_mode(simd::level(), &pixels[start..end], 40, first, alpha, &mut part);
                assert_eq!(part, whole[start..end]);
            }
        }
    }

    #[test]
    fn blocks_of_opaque_pixels_are_the_same_in_every_mode() {
        let pixels: Vec<[f32; 4]> = wild_pixels(320).into_iter().map(|[r, g, b, _]| [r, g, b, 1.0]).collect();
        let mixed: Vec<[f32; 4]> = pixels.iter().flat_map(|pixel| [*pixel, [0.0; 4]]).collect();
        for view in [View::DISPLAY, View::RAW] {
            for alpha in ALPHA_MODES {
                let (mut opaque, mut one_by_one) = (vec![[0_u16; 4]; 320], vec![[0_u16; 4]; 640]);
                view.display_row_with_mode(simd::level(), &pixels, 0, 0, alpha, &mut opaque);
                view.display_row_with_mode(simd::level(), &mixed, 0, 0, alpha, &mut one_by_one);
                let every_other: Vec<[u16; 4]> = one_by_one.iter().step_by(2).copied().collect();
                assert_eq!(opaque, every_other, "{alpha:?}");
            }
        }
    }

    #[test]
    fn black_and_white_are_exact() {
        let row = [[0.0; 4], [0.0, 0.0, 0.0, 1.0], [20.0, 20.0, 20.0, 1.0], [1e6, 1e6, 1e6, 0.0]];
        for view in [View::DISPLAY, View::NEUTRAL, View::STANDARD, View::RAW] {
            for y in 0..50 {
                let mut out = [[7_u8; 4]; 4];
                for alpha in [AlphaConvention::Linear, AlphaConvention::Encoded] {
                    view.display_row(simd::level(), &row, y, 13 * y, Some(alpha), &mut out);
                    assert_eq!(out, [[0; 4], [0, 0, 0, 255], [255; 4], [255; 4]]);
                    let mut wide = [[7_u16; 4]; 4];
                    view.display_row(simd::level(), &row, y, 13 * y, Some(alpha), &mut wide);
                    assert_eq!(wide, [[0; 4], [0, 0, 0, 65_535], [65_535; 4], [65_535; 4]]);
                }
                view.display_row(simd::level(), &row, y, 13 * y, None, &mut out);
                assert_eq!(out[0], [0, 0, 0, 255]);
                view.display_row(simd::level(), &row[..1], y, 13 * y, None, &mut out[3..]);
                assert_eq!(out[3], [0, 0, 0, 255]);
            }
        }
    }

    #[test]
    fn raw_and_standard_show_what_they_say() {
        assert_eq!(View::RAW.to_display([0.25, -0.5, 3.0]), [0.25, 0.0, 1.0]);
        let shown = View::STANDARD.to_display(crate::color::acescg_from_srgb([0.9, 0.7, 0.1]));
        assert!(shown.iter().zip([0.9, 0.7, 0.1]).all(|(a, b)| (a - b).abs() < 1e-6), "{shown:?}");
        let mut out = [[0_u16; 4]];
        View::RAW.display_row(simd::level(), &[[0.5, 0.25, 0.0, 1.0]], 0, 0, None, &mut out);
        assert_eq!(out, [[32_768, 16_384, 0, 65_535]]);
    }

    #[test]
    fn infinite_light_is_white_and_what_is_no_number_is_nothing_under_any_white_balance() {
        let huge = [f32::INFINITY, f32::MAX, 1e38, 1e9];
        let row: Vec<[f32; 4]> = huge.iter().map(|&light| [light, light, light, 1.0]).collect();
        for kelvin in [None, Some(1500.0), Some(4000.0), Some(6504.0), Some(20_000.0)] {
            for view in [View::DISPLAY, View::NEUTRAL, View::STANDARD].map(|view| view.with_white_balance(kelvin)) {
                let name = view.name().name();
                for light in huge {
                    let shown = view.to_display([light; 3]);
                    assert!(shown.iter().all(|value| *value > 0.999_99), "{name} {kelvin:?} {light}: {shown:?}");
                }
                let mut codes = vec![[0_u16; 4]; row.len()];
                view.display_row(simd::level(), &row, 0, 0, Some(AlphaConvention::Linear), &mut codes);
                assert_eq!(codes, vec![[u16::MAX; 4]; row.len()], "{name} {kelvin:?}");
                assert_eq!(view.to_display([f32::NAN; 3]), [0.0; 3], "{name} {kelvin:?}");
                // A component that is no number is missing, and no more than that.
                let green = view.to_display([f32::NAN, 0.5, f32::NAN]);
                assert_eq!(green, view.to_display([0.0, 0.5, 0.0]), "{name} {kelvin:?}");
            }
        }
    }

    #[test]
    fn every_name_gives_the_view_of_that_name() {
        assert_eq!(View::from(ViewName::default()), View::DISPLAY);
        assert_eq!(all_views().count(), 5);
        for (view, choice) in all_views().zip(ViewName::CHOICES) {
            assert_eq!(view.name().name(), choice.name);
        }
    }
}
