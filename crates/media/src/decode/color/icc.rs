//! ICC profiles of gray, RGB and CMYK pictures.

use moxcms::{ColorProfile, DataColorSpace, Layout, TransformF32Executor, TransformOptions};
use rayon::prelude::*;

use super::CHUNK;

/// Largest profile, bytes. Those of printing presses have up to 3 MB.
const MAX_BYTES: usize = 10 << 20;

/// Why a profile cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum ProfileError {
    #[error("it has {0} bytes; allowed: up to {MAX_BYTES}")]
    TooLarge(usize),
    #[error("it is damaged: {0}")]
    Damaged(String),
    #[error("it is for {found} values; allowed: {allowed}")]
    OtherSpace { found: String, allowed: &'static str },
}

fn damaged(error: impl ToString) -> ProfileError {
    ProfileError::Damaged(error.to_string())
}

fn parse(profile: &[u8]) -> Result<ColorProfile, ProfileError> {
    if profile.len() > MAX_BYTES {
        return Err(ProfileError::TooLarge(profile.len()));
    }
    ColorProfile::new_from_slice(profile).map_err(damaged)
}

fn to_srgb(profile: &ColorProfile, layout: Layout) -> Result<std::sync::Arc<TransformF32Executor>, ProfileError> {
    // Fixed point is for speed, and loses half a code.
    let options = TransformOptions { prefer_fixed_point: false, ..TransformOptions::default() };
    profile.create_transform_f32(layout, &ColorProfile::new_srgb(), Layout::Rgb, options).map_err(damaged)
}

/// Converts gray or RGB pixels to encoded sRGB. On failure they are unchanged.
pub(super) fn convert(pixels: &mut [[f32; 4]], profile: &[u8]) -> Result<(), ProfileError> {
    let profile = parse(profile)?;
    let (layout, values) = match profile.color_space {
        DataColorSpace::Rgb => (Layout::Rgb, 3),
        DataColorSpace::Gray => (Layout::Gray, 1),
        other => return Err(ProfileError::OtherSpace { found: format!("{other:?}"), allowed: "gray or RGB" }),
    };
    transform(pixels, &*to_srgb(&profile, layout)?, values)
}

/// Converts pixels of cyan, magenta, yellow and black to encoded, opaque sRGB. On failure they are unchanged.
pub(super) fn convert_cmyk(pixels: &mut [[f32; 4]], profile: &[u8]) -> Result<(), ProfileError> {
    let profile = parse(profile)?;
    if profile.color_space != DataColorSpace::Cmyk {
        return Err(ProfileError::OtherSpace { found: format!("{:?}", profile.color_space), allowed: "CMYK" });
    }
    transform(pixels, &*to_srgb(&profile, Layout::Rgba)?, 4)?;
    pixels.iter_mut().for_each(|pixel| pixel[3] = 1.0);
    Ok(())
}

/// Transforms the first `values` of each pixel to its first three.
fn transform(pixels: &mut [[f32; 4]], executor: &TransformF32Executor, values: usize) -> Result<(), ProfileError> {
    // What fails does so for the lengths, before anything is changed.
    pixels.par_chunks_mut(CHUNK).try_for_each(|chunk| {
        let input: Vec<f32> = chunk.iter().flat_map(|pixel| &pixel[..values]).copied().collect();
        let mut output = vec![0.0; 3 * chunk.len()];
        executor.transform(&input, &mut output).map_err(damaged)?;
        for (pixel, color) in chunk.iter_mut().zip(output.as_chunks::<3>().0) {
            for c in 0..3 {
                pixel[c] = color[c].clamp(0.0, 1.0);
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_of_known_spaces_agree_with_their_definitions() {
        // Computed in double precision from the definitions, as in `color/mod.rs`.
        let p3 = ColorProfile::new_display_p3().encode().unwrap();
        let adobe = ColorProfile::new_adobe_rgb().encode().unwrap();
        let codes = |profile: &[u8], codes: [f32; 3]| {
            let [r, g, b] = codes.map(|code| code / 255.0);
            let mut pixels = [[r, g, b, 0.25]];
            convert(&mut pixels, profile).unwrap();
            assert_eq!(pixels[0][3], 0.25);
            [0, 1, 2].map(|c| (255.0 * pixels[0][c]).round())
        };
        let is_near = |found: [f32; 3], expected: [f32; 3]| {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1.0), "{found:?} is not {expected:?}");
        };
        is_near(codes(&p3, [128.0, 128.0, 64.0]), [128.0, 128.0, 53.0]);
        is_near(codes(&adobe, [100.0, 150.0, 50.0]), [66.0, 151.0, 34.0]);
        let gray = ColorProfile::new_gray_with_gamma(2.2).encode().unwrap();
        let [r, g, b] = codes(&gray, [128.0; 3]);
        assert!(r == g && g == b && (r - 129.0).abs() <= 1.0, "{r}");
    }

    #[test]
    fn profiles_that_cannot_be_used_leave_the_picture() {
        let p3 = ColorProfile::new_display_p3().encode().unwrap();
        let before = [[0.1, 0.5, 0.7, 1.0]; 5];
        let mut pixels = before;
        assert!(matches!(convert_cmyk(&mut pixels, &p3), Err(ProfileError::OtherSpace { .. })));
        assert_eq!(convert(&mut pixels, &vec![0; MAX_BYTES + 1]), Err(ProfileError::TooLarge(MAX_BYTES + 1)));
        let mut survived = 0;
        for index in 0..p3.len() {
            for value in [0, 1, 0x7f, 0xff] {
                let mut bad = p3.clone();
                bad[index] = value;
                // Any result will do, as long as it returns.
                survived += usize::from(convert(&mut pixels, &bad).is_ok());
            }
            assert!(convert(&mut before.clone(), &p3[..index]).is_err() || index > p3.len() - 4, "{index}");
        }
        assert!(survived > 0);
    }
}
