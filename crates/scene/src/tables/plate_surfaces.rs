//! Reads what the surfaces that a plate shows reflect, and where they face.

use std::sync::Arc;

use bansho_base::{
    color,
    host::assets::{Assets, Encoding, NormalMap, Picture, PictureAlpha},
    math,
    parameters::BuildError,
};

use super::{
    picture::PlateParameters,
    plate_checks::{PlateRemark, build_error, check_shape, conflict, file_remarks, size},
};

/// The surfaces that a plate shows in one frame.
pub struct PlateSurfaces {
    albedo: Arc<Picture>,
    /// Normals as the camera sees them: to the right, up, toward the viewer. Not of unit length; 0 or NaN where that of the depth is used.
    pub normals: Option<Arc<NormalMap>>,
}

/// By how much rounded values may exceed their bounds.
const TOLERANCE: f32 = 2e-3;

impl PlateSurfaces {
    /// Width and height of the albedo, pixels; the shape of the image, not always its size.
    pub fn albedo_size(&self) -> [usize; 2] {
        size(&self.albedo)
    }

    /// The albedo of a pixel, ACEScg; 0 where the file is transparent.
    pub fn albedo(&self, x: usize, y: usize) -> [f32; 3] {
        let [r, g, b, alpha] = self.albedo.color.at(x, y);
        // What is no number reflects nothing.
        let [rgb @ .., alpha] = [r, g, b, alpha].map(math::f32::saturate);
        let albedo = match self.albedo.encoding {
            Encoding::DisplaySrgb => color::acescg_from_srgb(rgb.map(decoded)),
            Encoding::LinearSrgb => color::acescg_from_srgb(rgb),
            Encoding::LinearAcescg => rgb,
        };
        match self.albedo.alpha {
            PictureAlpha::Straight(_) => albedo.map(|value| value * alpha),
            PictureAlpha::Opaque | PictureAlpha::Associated => albedo,
        }
    }
}

/// Light of an encoded value, by a table for the codes of 8 bits.
fn decoded(value: f32) -> f32 {
    let code = (value * 255.0 + 0.5) as u8;
    if f32::from(code) / 255.0 == value { color::decode_srgb8(code) } else { color::decode_srgb(value) }
}

impl PlateParameters {
    /// Reads albedo and normals of a plate whose image has `image` pixels; `None` where it states no albedo.
    pub(super) fn read_surfaces(
        &self,
        assets: &dyn Assets,
        frame: i64,
        image: [usize; 2],
        has_depth: bool,
        remarks: &mut Vec<PlateRemark>,
    ) -> Result<Option<PlateSurfaces>, BuildError> {
        for (key, path) in [("albedo", &self.albedo), ("normal", &self.normal)] {
            if path.is_some() && !has_depth {
                return Err(conflict(key, format!("`{key}` needs a depth, from which it is known where lights are")));
            }
        }
        let Some(path) = &self.albedo else {
            return match self.normal {
                Some(_) => Err(conflict("normal", "`normal` needs an `albedo`, without which no light is added")),
                None => Ok(None),
            };
        };
        let albedo = assets.picture(&path.0, frame).map_err(|error| build_error("albedo", error))?;
        check_shape("albedo", &path.0, size(&albedo), image)?;
        check_range("albedo", &path.0, albedo.color.iter(), size(&albedo)[0], [0.0, 1.0])?;
        remarks.extend(file_remarks("albedo", &albedo.remarks));
        remark_size("albedo", size(&albedo), image, remarks);
        let normals = match &self.normal {
            Some(path) => {
                let normals = assets.normals(&path.0, frame).map_err(|error| build_error("normal", error))?;
                let normals_size = [normals.values.width(), normals.values.height()];
                check_shape("normal", &path.0, normals_size, image)?;
                check_range("normal", &path.0, normals.values.pixels().iter().copied(), normals_size[0], [-1.0, 1.0])?;
                remarks.extend(file_remarks("normal", &normals.remarks));
                remark_size("normal", normals_size, image, remarks);
                Some(normals)
            }
            None => None,
        };
        Ok(Some(PlateSurfaces { albedo, normals }))
    }
}

/// Checks the first three components of all pixels. NaN is allowed: it means that nothing is known.
fn check_range<const N: usize>(
    key: &str,
    path: &str,
    pixels: impl Iterator<Item = [f32; N]>,
    width: usize,
    [min, max]: [f32; 2],
) -> Result<(), BuildError> {
    let is_outside = |value: f32| value < min - TOLERANCE || value > max + TOLERANCE;
    let found = pixels.enumerate().find_map(|(index, pixel)| {
        let value = pixel.into_iter().take(3).find(|value| is_outside(*value))?;
        Some((index, value))
    });
    let Some((index, value)) = found else { return Ok(()) };
    let (x, y) = (index % width, index / width);
    Err(conflict(key, format!("{path}: has the value {value} at pixel [{x}, {y}]; allowed: {min} to {max}")))
}

/// A map of half the size, or of another whole fraction of it, is made so on purpose: normals are large.
fn remark_size(key: &'static str, map: [usize; 2], image: [usize; 2], remarks: &mut Vec<PlateRemark>) {
    let is_whole_fraction = image[0].is_multiple_of(map[0]) && image[1].is_multiple_of(map[1]);
    if !is_whole_fraction {
        remarks.push(PlateRemark::MapSize { key, map, image });
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::image::Image;

    use super::*;

    #[test]
    fn albedo_of_a_photograph_is_decoded_and_that_of_an_exr_is_not() {
        let albedo = |value: f32, encoding| {
            let picture = Picture::opaque(Image::filled(2, 2, [value, value, value, 1.0]), encoding);
            PlateSurfaces { albedo: Arc::new(picture), normals: None }.albedo(1, 1)[1]
        };
        // The code 118 of sRGB is the gray of 18 %.
        assert!((albedo(118.0 / 255.0, Encoding::DisplaySrgb) - 0.1812).abs() < 1e-3);
        assert!((albedo(0.18, Encoding::LinearSrgb) - 0.18).abs() < 1e-6);
        assert_eq!(albedo(0.18, Encoding::LinearAcescg), 0.18);
        assert_eq!(albedo(f32::NAN, Encoding::LinearAcescg), 0.0);
    }

    #[test]
    fn a_value_out_of_range_is_told_with_its_place() {
        let pixels = [[0.0, 0.5, 1.0], [f32::NAN, 0.5, 1.0005], [0.2, -0.1, 0.5]];
        let told = |pixels: &[[f32; 3]]| {
            check_range("albedo", "a.exr", pixels.iter().copied(), 2, [0.0, 1.0]).map_err(|e| e.kind.to_string())
        };
        assert_eq!(told(&pixels[..2]), Ok(()));
        let error = told(&pixels).unwrap_err();
        assert!(error.contains("a.exr: has the value -0.1 at pixel [0, 1]; allowed: 0 to 1"), "{error}");
    }
}
