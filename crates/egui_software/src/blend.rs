//! Blending as in egui's fragment shader: premultiplied alpha, in gamma space, rounded once.

/// Premultiplied red, green, blue and alpha, 0 to 255.
pub(super) type Rgba = [u8; 4];

/// `sum` / 255 rounded to nearest, for sums up to 255 x 255.
fn div_255(sum: u32) -> u32 {
    let half = sum + 128;
    (half + (half >> 8)) >> 8
}

/// As `softbuffer` takes it: 0x00RRGGBB.
pub(super) fn pack_xrgb([red, green, blue, _]: Rgba) -> u32 {
    u32::from_be_bytes([0, red, green, blue])
}

/// The product of two colors.
pub(super) fn multiply(a: Rgba, b: Rgba) -> Rgba {
    let mut product = [0; 4];
    for c in 0..4 {
        product[c] = div_255(u32::from(a[c]) * u32::from(b[c])) as u8;
    }
    product
}

/// `color` over the pixel `below`.
pub(super) fn blend_over(below: u32, color: Rgba) -> u32 {
    let [_, red, green, blue] = below.to_be_bytes();
    let through = 255 - u32::from(color[3]);
    let mut blended = [0; 4];
    for (blended, (color, below)) in blended[1..].iter_mut().zip(color.into_iter().zip([red, green, blue])) {
        // Colors that are brighter than their alpha, which egui uses to add light, may exceed the range.
        *blended = (u32::from(color) + div_255(u32::from(below) * through)).min(255) as u8;
    }
    u32::from_be_bytes(blended)
}

/// `texel` x `tint` over the pixel `below`.
pub(super) fn blend_tinted_over(below: u32, texel: Rgba, tint: Rgba) -> u32 {
    /// 255 x 255: the product of two opaque alphas.
    const WHOLE: u32 = 65025;
    let [_, red, green, blue] = below.to_be_bytes();
    let through = WHOLE - u32::from(texel[3]) * u32::from(tint[3]);
    let mut blended = [0; 4];
    for (c, below) in [red, green, blue].into_iter().enumerate() {
        // Rounded once, at the end, as a shader does.
        let sum = u32::from(texel[c]) * u32::from(tint[c]) * 255 + u32::from(below) * through;
        blended[c + 1] = ((sum + WHOLE / 2) / WHOLE).min(255) as u8;
    }
    u32::from_be_bytes(blended)
}

/// The same for a floating-point color, each channel 0 to 255.
pub(super) fn blend_over_f32(below: u32, color: [f32; 4]) -> u32 {
    let [_, red, green, blue] = below.to_be_bytes();
    let through = 1.0 - color[3] / 255.0;
    let mut blended = [0; 4];
    for (c, below) in [red, green, blue].into_iter().enumerate() {
        // Casts saturate: values that rounding put outside of 0 to 255 are clamped.
        blended[c + 1] = (color[c] + f32::from(below) * through + 0.5) as u8;
    }
    u32::from_be_bytes(blended)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blending_rounds_once_as_a_shader_does() {
        for below in 0..=255_u32 {
            for alpha in [0_u8, 1, 100, 128, 254, 255] {
                let color = [alpha / 2, alpha / 3, alpha, alpha];
                let exact = |c: usize| {
                    let through = 1.0 - f64::from(alpha) / 255.0;
                    (f64::from(color[c]) + f64::from(below) * through).round() as u8
                };
                let expected = u32::from_be_bytes([0, exact(0), exact(1), exact(2)]);
                let under = below * 0x0001_0101;
                assert_eq!(blend_over(under, color), expected);
                assert_eq!(blend_tinted_over(under, color, [255; 4]), expected);
                assert_eq!(blend_over_f32(under, color.map(f32::from)), expected);
            }
        }
        assert_eq!(multiply([255, 128, 0, 64], [128, 255, 9, 64]), [128, 128, 0, 16]);
        assert_eq!(pack_xrgb([1, 2, 3, 255]), 0x0001_0203);
    }
}
