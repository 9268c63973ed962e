//! Compositing of display pictures over black, for formats without alpha.

use bansho_base::{
    color::{AlphaConvention, decode_srgb, decode_srgb8, encode_srgb},
    frame::{DisplayEncoding, DisplayImage, DisplayPixels},
};

/// `picture` over black, blended as its [`AlphaConvention`] says, so that it shows the light of the frame.
///
/// An opaque picture is returned unchanged. A view transform of a frame over black is a little more exact, since this function starts from
/// rounded codes.
pub fn over_black(picture: &DisplayImage) -> DisplayImage {
    // Codes that are not sRGB-encoded are multiplied as they are.
    let blended = if picture.encoding == DisplayEncoding::Srgb { picture.alpha } else { AlphaConvention::Encoded };
    let pixels = match (&picture.pixels, blended) {
        (same, _) if picture.opaque => same.clone(),
        (DisplayPixels::Eight(pixels), AlphaConvention::Linear) => {
            DisplayPixels::Eight(pixels.iter().map(linear_eight).collect())
        }
        (DisplayPixels::Sixteen(pixels), AlphaConvention::Linear) => {
            DisplayPixels::Sixteen(pixels.iter().map(linear_sixteen).collect())
        }
        (DisplayPixels::Eight(pixels), AlphaConvention::Encoded) => {
            DisplayPixels::Eight(pixels.iter().map(|&[rgb @ .., a]| encoded_eight(rgb, a)).collect())
        }
        (DisplayPixels::Sixteen(pixels), AlphaConvention::Encoded) => {
            DisplayPixels::Sixteen(pixels.iter().map(|&[rgb @ .., a]| encoded_sixteen(rgb, a)).collect())
        }
    };
    DisplayImage {
        width: picture.width,
        height: picture.height,
        opaque: true,
        alpha: picture.alpha,
        encoding: picture.encoding,
        pixels,
    }
}

/// Rounded product of codes and alpha.
fn encoded_eight(rgb: [u8; 3], alpha: u8) -> [u8; 4] {
    let [r, g, b] = rgb.map(|code| ((u32::from(code) * u32::from(alpha) + 127) / 255) as u8);
    [r, g, b, u8::MAX]
}

fn encoded_sixteen(rgb: [u16; 3], alpha: u16) -> [u16; 4] {
    let [r, g, b] = rgb.map(|code| ((u64::from(code) * u64::from(alpha) + 32_767) / 65_535) as u16);
    [r, g, b, u16::MAX]
}

/// Product of linear light and alpha.
fn linear_eight(&[r, g, b, alpha]: &[u8; 4]) -> [u8; 4] {
    let [r, g, b] = match alpha {
        // Most pixels, without a conversion there and back.
        0 => [0; 3],
        255 => [r, g, b],
        _ => [r, g, b].map(|code| {
            let light = decode_srgb8(code) * (f32::from(alpha) / 255.0);
            encode_srgb(light).mul_add(255.0, 0.5) as u8
        }),
    };
    [r, g, b, 255]
}

fn linear_sixteen(&[r, g, b, alpha]: &[u16; 4]) -> [u16; 4] {
    let [r, g, b] = match alpha {
        0 => [0; 3],
        u16::MAX => [r, g, b],
        _ => [r, g, b].map(|code| {
            let light = decode_srgb(f32::from(code) / 65535.0) * (f32::from(alpha) / 65535.0);
            encode_srgb(light).mul_add(65535.0, 0.5) as u16
        }),
    };
    [r, g, b, u16::MAX]
}

/// The pixels with 8 bits per channel.
pub(crate) fn to_eight_bits(pixels: &DisplayPixels) -> Vec<[u8; 4]> {
    match pixels {
        DisplayPixels::Eight(pixels) => pixels.clone(),
        // 257 codes of 16 bits map to one of 8.
        DisplayPixels::Sixteen(pixels) => {
            pixels.iter().map(|pixel| pixel.map(|code| ((u32::from(code) + 128) / 257) as u8)).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_multiplied_not_codes() {
        let pixels = DisplayPixels::Eight(vec![[255, 188, 0, 128], [9, 8, 7, 255], [9, 8, 7, 0]]);
        let flat = over_black(&DisplayImage {
            width: 3,
            height: 1,
            opaque: false,
            alpha: AlphaConvention::Linear,
            encoding: DisplayEncoding::Srgb,
            pixels,
        });
        // 128/255 of full light, 0.502, is code 188; code 188 is 0.503, of which 128/255 is 0.2524: code 137.6.
        assert_eq!(flat.pixels, DisplayPixels::Eight(vec![[188, 138, 0, 255], [9, 8, 7, 255], [0, 0, 0, 255]]));
        assert!(flat.opaque);
    }

    #[test]
    fn codes_are_multiplied_where_they_are_what_is_blended() {
        let alpha = AlphaConvention::Encoded;
        let pixels = DisplayPixels::Eight(vec![[255, 188, 0, 128], [9, 8, 7, 255], [9, 8, 7, 0]]);
        let flat = over_black(&DisplayImage {
            width: 3,
            height: 1,
            opaque: false,
            alpha,
            encoding: DisplayEncoding::Srgb,
            pixels,
        });
        assert_eq!(flat.pixels, DisplayPixels::Eight(vec![[128, 94, 0, 255], [9, 8, 7, 255], [0, 0, 0, 255]]));
        let pixels = DisplayPixels::Sixteen(vec![[65_535, 48_316, 0, 32_896]]);
        let flat = over_black(&DisplayImage {
            width: 1,
            height: 1,
            opaque: false,
            alpha,
            encoding: DisplayEncoding::Srgb,
            pixels,
        });
        assert_eq!(flat.pixels, DisplayPixels::Sixteen(vec![[32_896, 24_253, 0, 65_535]]));
    }

    #[test]
    fn linear_light_is_multiplied_as_it_is() {
        let pixels = DisplayPixels::Eight(vec![[255, 188, 0, 128]]);
        let (alpha, encoding) = (AlphaConvention::Linear, DisplayEncoding::LinearAcescg);
        let flat = over_black(&DisplayImage { width: 1, height: 1, opaque: false, alpha, encoding, pixels });
        assert_eq!(
            (flat.pixels, flat.encoding),
            (DisplayPixels::Eight(vec![[128, 94, 0, 255]]), DisplayEncoding::LinearAcescg)
        );
    }

    #[test]
    fn sixteen_bits_agree_with_eight() {
        let wide = DisplayPixels::Sixteen(vec![[65535, 48316, 0, 32896], [1, 2, 3, 65535], [1, 2, 3, 0]]);
        let flat = over_black(&DisplayImage {
            width: 3,
            height: 1,
            opaque: false,
            alpha: AlphaConvention::Linear,
            encoding: DisplayEncoding::Srgb,
            pixels: wide,
        });
        let DisplayPixels::Sixteen(pixels) = &flat.pixels else { unreachable!() };
        assert_eq!(pixels[1..], [[1, 2, 3, 65535], [0, 0, 0, 65535]]);
        assert_eq!(to_eight_bits(&flat.pixels)[0], [188, 138, 0, 255]);
    }
}
