//! Frames of light at and beyond the ends of its range.

use bansho::{
    base::{
        camera::{CameraHeader, Lens},
        color::{AlphaConvention, View},
        frame::{Channel, DisplayImage, DisplayPixels, Frame, FrameHeader, Precision},
        image::{Image, Rect},
    },
    render::display::{BitDepth, display},
};

/// Components of light.
pub(crate) const LIGHTS: [f32; 18] = [
    0.0,
    -0.0,
    1e-40,
    1e-6,
    0.25,
    0.999_999_94,
    1.0,
    1.000_000_1,
    7.0,
    65_504.0,
    65_519.0,
    65_520.0,
    1e9,
    f32::MAX,
    f32::INFINITY,
    f32::NEG_INFINITY,
    -1.0,
    f32::NAN,
];

/// Coverages.
pub(crate) const ALPHAS: [f32; 9] = [0.0, 1e-6, 0.25, 0.999_999_94, 1.0, 1.000_000_1, f32::INFINITY, f32::NAN, -1.0];

/// Every light with every coverage.
pub(crate) const COUNT: usize = LIGHTS.len() * ALPHAS.len();

/// Widths of pictures: every way in which a row ends within a vector of 4, 8 or 16 pixels, or a block of 32.
pub(crate) const WIDTHS: std::ops::RangeInclusive<usize> = 1..=35;

/// How pictures bear alpha; opaque without.
pub(crate) const ALPHA_KINDS: [Option<AlphaConvention>; 3] =
    [None, Some(AlphaConvention::Linear), Some(AlphaConvention::Encoded)];

/// Gray of the light and coverage of that number.
pub(crate) fn pixel(number: usize) -> [f32; 4] {
    let light = LIGHTS[number % LIGHTS.len()];
    [light, light, light, ALPHAS[number / LIGHTS.len() % ALPHAS.len()]]
}

/// A frame in which every column has every pixel once.
pub(crate) fn frame(width: usize, opaque: bool) -> Frame {
    of_pixels(width, COUNT, opaque, |x, y| pixel((x + y) % COUNT))
}

/// A frame of `pixels`, with a layer and AOVs of the same numbers.
pub(crate) fn of_pixels(width: usize, height: usize, opaque: bool, pixel: impl Fn(usize, usize) -> [f32; 4]) -> Frame {
    let pixels: Vec<[f32; 4]> = (0..width * height).map(|i| pixel(i % width, i / width)).collect();
    let red: Vec<f32> = pixels.iter().map(|pixel| pixel[0]).collect();
    let channel = |name: &str, precision| Channel { name: name.to_owned(), precision, values: red.clone() };
    let channels = vec![
        channel("torch.R", Precision::Half),
        channel("torch.motion.X", Precision::Single),
        channel("torch.temperature_k", Precision::Single),
    ];
    Frame {
        header: header(width, height),
        beauty: Image::from_pixels(width, height, pixels).unwrap(),
        depth: Some(red),
        channels,
        opaque,
        metadata: Vec::new(),
        content: Rect::from_size(width, height),
    }
}

fn header(width: usize, height: usize) -> FrameHeader {
    FrameHeader {
        number: 1,
        exposure_ev100: 0.0,
        white_balance_k: None,
        fps: [24, 1],
        exposure_time_s: 0.02,
        camera: CameraHeader {
            world_to_camera: [[0.0; 4]; 4],
            world_to_ndc: None,
            vertical_fov_deg: None,
            lens: Some(Lens::Perspective),
            fisheye_fov_deg: None,
        },
        fingerprint: [7; 32],
        display_size: [width, height],
        data_origin: [0, 0],
    }
}

/// The frame as a job shows it.
pub(crate) fn shown(frame: &Frame, view: &View, bits: BitDepth, alpha: Option<AlphaConvention>) -> DisplayImage {
    display(frame, view, bits, alpha.unwrap_or_default())
}

/// The codes of a picture, alpha too, as 16-bit numbers.
pub(crate) fn codes(picture: &DisplayImage) -> Vec<[u16; 4]> {
    match &picture.pixels {
        DisplayPixels::Eight(pixels) => pixels.iter().map(|pixel| pixel.map(u16::from)).collect(),
        DisplayPixels::Sixteen(pixels) => pixels.clone(),
    }
}

/// The largest code.
pub(crate) fn largest(bits: BitDepth) -> u16 {
    match bits {
        BitDepth::Eight => u16::from(u8::MAX),
        BitDepth::Sixteen => u16::MAX,
    }
}
