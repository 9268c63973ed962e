//! The colors of an EXR: known primaries, luminance and chroma, no NaN.

use bansho_base::{
    host::assets::{AssetProblem, Picture, PictureAlpha},
    image::Image,
};
use rayon::prelude::*;

use super::{
    PlaneWriter, exposure,
    layers::{ChannelSelection, ColorModel},
    pixel_aspect,
};
use crate::{
    decode::{
        color::primaries::{self, Conversion, REC709},
        damaged,
    },
    exr::header::FileHeader,
};

/// Largest finite half: infinities are clamped to it.
const HALF_MAX: f32 = 65504.0;

fn finite(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(-HALF_MAX, HALF_MAX) }
}

/// The picture of the planes.
pub(super) fn finish(
    header: &FileHeader,
    selection: &ChannelSelection,
    planes: PlaneWriter,
) -> Result<Picture, AssetProblem> {
    let part = &header.parts[selection.part];
    let (width, height) = (planes.width, planes.height);
    let chromaticities = part.chromaticities;
    let conversion =
        primaries::conversion(chromaticities).ok_or_else(|| damaged("its chromaticities describe no colors"))?;
    let weights = primaries::luminance_weights(chromaticities.unwrap_or(REC709)).unwrap_or_default();
    let model = selection.color.map_or(ColorModel::Rgb, |color| color.model);
    let mut color = planes.values.color.unwrap_or_else(|| {
        // A file with depth only: shown in gray, opaque.
        planes.values.depth.iter().flatten().map(|&z| [z, z, z, 1.0]).collect()
    });
    color.par_iter_mut().for_each(|pixel| *pixel = known_color(pixel.map(finite), model, weights, &conversion));
    let is_opaque = color.par_iter().all(|[.., alpha]| *alpha >= 1.0);
    let depth = planes.values.depth.map(|mut depth| {
        // NaN means infinitely far.
        depth.iter_mut().filter(|z| z.is_nan()).for_each(|z| *z = f32::INFINITY);
        depth
    });
    Ok(Picture {
        color: Image::from_pixels(width, height, color).ok_or_else(|| damaged("its pixels do not fill it"))?.into(),
        alpha: if is_opaque { PictureAlpha::Opaque } else { PictureAlpha::Associated },
        depth,
        encoding: conversion.encoding,
        exposure_ev100: exposure(part),
        remarks: pixel_aspect(part).into_iter().collect(),
    })
}

fn known_color([r, g, b, alpha]: [f32; 4], model: ColorModel, weights: [f32; 3], conversion: &Conversion) -> [f32; 4] {
    let rgb = match model {
        ColorModel::Rgb => [r, g, b],
        ColorModel::LuminanceChroma => from_luminance_chroma([r, g, b], weights),
    };
    let [r, g, b] = primaries::apply(conversion, rgb);
    [r, g, b, alpha.clamp(0.0, 1.0)]
}

/// RGB of luminance Y and the chroma RY = (R - Y) / Y, BY = (B - Y) / Y ("Technical Introduction to OpenEXR", luminance/chroma images).
fn from_luminance_chroma([y, ry, by]: [f32; 3], [red, green, blue]: [f32; 3]) -> [f32; 3] {
    let (r, b) = ((ry + 1.0) * y, (by + 1.0) * y);
    [r, (y - r * red - b * blue) / green, b]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luminance_and_chroma_return_to_the_color_that_they_were_made_of() {
        let weights = primaries::luminance_weights(REC709).unwrap();
        let [r, g, b] = [0.8_f32, 0.2, 0.4];
        let y = r * weights[0] + g * weights[1] + b * weights[2];
        let back = from_luminance_chroma([y, (r - y) / y, (b - y) / y], weights);
        assert!(back.iter().zip([r, g, b]).all(|(back, own)| (back - own).abs() < 1e-6), "{back:?}");
    }
}
