//! Colours over one another as egui's shader lays them: premultiplied, as they are coded for the screen, rounded once.

/// Red, green, blue and alpha of 0 to 255, premultiplied.
pub(super) type Rgba = [u8; 4];

/// The nearest to `sum` / 255, for sums up to 255 x 255.
fn by_255(sum: u32) -> u32 {
    let half = sum + 128;
    (half + (half >> 8)) >> 8
}

/// As the screen takes it.
pub(super) fn packed([red, green, blue, _]: Rgba) -> u32 {
    u32::from_be_bytes([0, red, green, blue])
}

/// Two colours multiplied.
pub(super) fn times(a: Rgba, b: Rgba) -> Rgba {
    let mut product = [0; 4];
    for c in 0..4 {
        product[c] = by_255(u32::from(a[c]) * u32::from(b[c])) as u8;
    }
    product
}

/// `colour` over the pixel `below`.
pub(super) fn over(below: u32, colour: Rgba) -> u32 {
    let [_, red, green, blue] = below.to_be_bytes();
    let through = 255 - u32::from(colour[3]);
    let channel = |c: usize, below: u8| (u32::from(colour[c]) + by_255(u32::from(below) * through)).min(255) as u8;
    u32::from_be_bytes([0, channel(0, red), channel(1, green), channel(2, blue)])
}

/// `texel` x `tint` over the pixel `below`.
pub(super) fn tinted_over(below: u32, texel: Rgba, tint: Rgba) -> u32 {
    /// 255 x 255: the product of two whole ones.
    const WHOLE: u32 = 65025;
    let [_, red, green, blue] = below.to_be_bytes();
    let through = WHOLE - u32::from(texel[3]) * u32::from(tint[3]);
    let channel = |c: usize, below: u8| {
        let sum = u32::from(texel[c]) * u32::from(tint[c]) * 255 + u32::from(below) * through;
        ((sum + WHOLE / 2) / WHOLE).min(255) as u8
    };
    u32::from_be_bytes([0, channel(0, red), channel(1, green), channel(2, blue)])
}

/// The same of colours that are no whole numbers, each 0 to 255.
pub(super) fn exactly_over(below: u32, colour: [f32; 4]) -> u32 {
    let [_, red, green, blue] = below.to_be_bytes();
    let through = 1.0 - colour[3] / 255.0;
    // Casts saturate, so that what lies outside of 0 to 255 by rounding comes back.
    let channel = |c: usize, below: u8| (colour[c] + f32::from(below) * through + 0.5) as u8;
    u32::from_be_bytes([0, channel(0, red), channel(1, green), channel(2, blue)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blending_rounds_once_as_a_shader_does() {
        for below in 0..=255_u32 {
            for alpha in [0_u8, 1, 100, 128, 254, 255] {
                let colour = [alpha / 2, alpha / 3, alpha, alpha];
                let exact = |c: usize| {
                    let through = 1.0 - f64::from(alpha) / 255.0;
                    (f64::from(colour[c]) + f64::from(below) * through).round() as u8
                };
                let expected = u32::from_be_bytes([0, exact(0), exact(1), exact(2)]);
                let under = below * 0x0001_0101;
                assert_eq!(over(under, colour), expected);
                assert_eq!(tinted_over(under, colour, [255; 4]), expected);
                assert_eq!(exactly_over(under, colour.map(f32::from)), expected);
            }
        }
        assert_eq!(times([255, 128, 0, 64], [128, 255, 9, 64]), [128, 128, 0, 16]);
        assert_eq!(packed([1, 2, 3, 255]), 0x0001_0203);
    }
}
