//! Pictures without axes, for shaders: rows of texels from the top.

use bansho::{
    AlphaConvention, DisplayImage,
    base::frame::{DisplayEncoding, DisplayPixels},
};

use super::figure::Rgb;

/// A texture.
pub(crate) struct FigureTexture {
    pub(crate) picture: DisplayImage,
    /// Whether its codes are linear; otherwise they are sRGB-encoded.
    pub(crate) is_linear: bool,
}

impl FigureTexture {
    /// Codes of sRGB.
    pub(super) fn srgb(width: usize, texels: impl IntoIterator<Item = Rgb>) -> Self {
        Self { is_linear: false, ..Self::linear_8(width, texels) }
    }

    /// Linear codes of 8 bits.
    pub(super) fn linear_8(width: usize, texels: impl IntoIterator<Item = Rgb>) -> Self {
        let opaque = |[red, green, blue]: Rgb| [red, green, blue, u8::MAX];
        Self::new(width, DisplayPixels::Eight(texels.into_iter().map(opaque).collect()))
    }

    /// Values from 0 to 1 as linear codes of 16 bits.
    pub(super) fn linear_16(width: usize, texels: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let code = |value: f64| (value * f64::from(u16::MAX)).round().clamp(0.0, f64::from(u16::MAX)) as u16;
        let opaque = |[red, green, blue]: [f64; 3]| [code(red), code(green), code(blue), u16::MAX];
        Self::new(width, DisplayPixels::Sixteen(texels.into_iter().map(opaque).collect()))
    }

    fn new(width: usize, pixels: DisplayPixels) -> Self {
        let texels = match &pixels {
            DisplayPixels::Eight(texels) => texels.len(),
            DisplayPixels::Sixteen(texels) => texels.len(),
        };
        let height = texels / width.max(1);
        let picture = DisplayImage {
            width,
            height,
            opaque: true,
            alpha: AlphaConvention::default(),
            encoding: DisplayEncoding::Srgb,
            pixels,
        };
        Self { picture, is_linear: true }
    }
}

/// The code of a value from 0 to 1.
pub(super) fn unsigned_code(value: f64) -> u8 {
    (value * 255.0).round().clamp(0.0, 255.0) as u8
}

/// The code of a value from -1 to 1, of which 0 is 128.
pub(super) fn signed_code(value: f64) -> u8 {
    value.mul_add(127.5, 127.5).round().clamp(0.0, 255.0) as u8
}
