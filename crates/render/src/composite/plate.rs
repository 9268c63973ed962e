//! The plate of a frame, resampled to the picture: exposed colors, depth for occlusion, and surfaces for light.

use std::sync::Arc;

use bansho_base::{
    camera::Camera,
    color::{self, AlphaConvention},
    host::{
        assets::{Encoding, Picture, PictureAlpha},
        parallel::prelude::*,
        picture_pixels::PixelRow,
    },
    image::Image,
    math::simd,
    parameters::BuildError,
};

use super::{
    plate_depth::resample_depth,
    plate_mapping::{PlateMapping, filter_taps, image_in},
    plate_surface::{PlateSurface, SurfaceInputs},
};
use crate::{
    compiled::CompiledScene,
    plan::Plan,
    plate_boxes::{self, BoxRow, PlateBoxes, PlateBoxesKey},
};
use bansho_scene::{PlatePictures, PlateSky};

/// A plate, as large as the picture with its overscan.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlateFrame {
    /// Exposed scene-linear ACEScg over black, and coverage, which is 0 outside the plate (overscan).
    pub(crate) color: Option<Image<4>>,
    /// Whether its picture has pixels that are not opaque.
    pub(crate) is_transparent: bool,
    /// Depth in the convention of the camera's lens, m.
    pub(crate) depth: Option<Image<1>>,
    /// The surfaces that it shows, if lights light them.
    pub(crate) surface: Option<Arc<PlateSurface>>,
}

/// The plate of frame `number` for `camera`. Its picture has this digest. The memory of `recycled` is used again.
///
/// # Errors
/// The picture or its depth cannot be read.
pub(crate) fn load(
    plan: &Plan,
    compiled: &CompiledScene,
    number: i64,
    camera: &Camera,
    digest: Option<[u8; 32]>,
    recycled: PlateFrame,
) -> Result<PlateFrame, BuildError> {
    let read = plan.scene.plate.read_frame(compiled.assets().as_ref(), number, &plan.plate_view(number))?;
    let Some(PlatePictures { image, alpha, depth: plate_depth, surfaces, .. }) = read else {
        return Ok(PlateFrame::default());
    };
    let mapping = PlateMapping::new(plan, [image.color.width(), image.color.height()]);
    let view = plan.view_transform();
    let mut color = if mapping.is_identity() {
        let memory = image_in(recycled.color, mapping.plate, [0.0; 4]);
        let boxes = digest.map(|digest| PlateBoxesKey { digest, alpha, view }).zip(compiled.plate_boxes_cache(number));
        match boxes.filter(|(key, cache)| plate_boxes::is_drawn_light(&image, alpha) && cache.get(key).is_none()) {
            Some((key, cache)) => {
                let (color, boxes) = decode_with_boxes(&view, &image, alpha, memory);
                cache.insert(key, boxes);
                color
            }
            None => decode(&view, &image, alpha, memory),
        }
    } else {
        resample_color(&view, &image, alpha, &mapping)
    };
    let mut depth = plate_depth.as_ref().map(|depth| resample_depth(camera, depth, &mapping, recycled.depth));
    let has_no_sky = plan.scene.plate.sky == PlateSky::Scene;
    if let Some(depth) = depth.as_ref().filter(|_| has_no_sky) {
        remove_sky(&mut color, depth);
    }
    let is_transparent = alpha != PictureAlpha::Opaque || has_no_sky;
    if let Some(depth) = depth.as_mut().filter(|_| alpha != PictureAlpha::Opaque) {
        // What is not there hides nothing, whatever depth the file gives it.
        let both = depth.pixels_mut().iter_mut().zip(color.pixels());
        both.filter(|(_, [.., alpha])| *alpha <= 0.0).for_each(|(depth, _)| *depth = [f32::INFINITY]);
    }
    let surface = match (&surfaces, &depth, &plate_depth) {
        (Some(surfaces), Some(depth), Some(plate_depth)) => {
            let inputs = SurfaceInputs { color: &color, depth, plate_depth, surfaces };
            Some(Arc::new(PlateSurface::new(plan, camera, &inputs)))
        }
        _ => None,
    };
    Ok(PlateFrame { color: Some(color), is_transparent, depth, surface })
}

/// The colors of a plate whose pixels are those of the picture, in an image of its size.
fn decode(view: &color::View, picture: &Picture, alpha: PictureAlpha, mut image: Image<4>) -> Image<4> {
    let rows = image.pixels_mut().par_chunks_mut(picture.color.width()).enumerate();
    rows.for_each(|(y, row)| decode_row(view, picture, alpha, y, row));
    image
}

/// [`decode`], and the boxes of the plate, to which rows are added while they are in the cache.
fn decode_with_boxes(
    view: &color::View,
    picture: &Picture,
    alpha: PictureAlpha,
    mut image: Image<4>,
) -> (Image<4>, PlateBoxes) {
    let size = [picture.color.width(), picture.color.height()];
    let side = plate_boxes::box_side(size);
    let tasks = image.pixels_mut().par_chunks_mut(side * size[0]).enumerate();
    let decoded = tasks.map(|(index, rows)| {
        let mut boxes = BoxRow::of_photograph(size);
        for (y, row) in (index * side..).zip(rows.chunks_mut(size[0])) {
            decode_row(view, picture, alpha, y, row);
            boxes.add(row);
        }
        boxes
    });
    let box_rows: Vec<BoxRow> = decoded.collect();
    (image, PlateBoxes::of_rows(size, &box_rows))
}

/// Row `y` of a plate.
fn decode_row(view: &color::View, picture: &Picture, alpha: PictureAlpha, y: usize, row: &mut [[f32; 4]]) {
    let stored = picture.color.row(y);
    if let (PixelRow::Codes(codes), PictureAlpha::Opaque, Encoding::DisplaySrgb) = (stored, alpha, picture.encoding) {
        return view.codes_to_scene_row(simd::level(), codes, row);
    }
    stored.copy_to(row);
    if let PictureAlpha::Straight(_) = alpha {
        row.iter_mut().for_each(|pixel| *pixel = alpha.premultiplied(*pixel));
    }
    row_over_black(view, picture.encoding, alpha, row);
}

/// The colors of a plate in the pixels of the picture.
fn resample_color(view: &color::View, picture: &Picture, alpha: PictureAlpha, mapping: &PlateMapping) -> Image<4> {
    let columns: Vec<_> = (0..mapping.picture[0]).map(|x| filter_taps(mapping, 0, x)).collect();
    let mut image = Image::filled(mapping.picture[0], mapping.picture[1], [0.0; 4]);
    let covered = mapping.covered_columns();
    image.pixels_mut().par_chunks_mut(mapping.picture[0]).enumerate().for_each(|(y, row)| {
        if !mapping.covers(1, y) {
            return;
        }
        let row = &mut row[covered.clone()];
        let rows = filter_taps(mapping, 1, y);
        for (pixel, columns) in row.iter_mut().zip(&columns[covered.clone()]) {
            let mut sum = [0.0_f32; 4];
            for row in &rows {
                for column in columns {
                    let color = alpha.premultiplied(picture.color.at(column.pixel, row.pixel));
                    for c in 0..4 {
                        sum[c] += row.weight * column.weight * color[c];
                    }
                }
            }
            *pixel = sum;
        }
        row_over_black(view, picture.encoding, alpha, row);
    });
    image
}

/// Makes a plate transparent where its depth is infinite. A pixel is covered as far as it and its neighbors, with binomial weights, have a depth, so that
/// edges before the sky are as soft as those of a picture.
fn remove_sky(color: &mut Image<4>, depth: &Image<1>) {
    const WEIGHTS: [f32; 3] = [0.25, 0.5, 0.25];
    let (width, height) = (depth.width(), depth.height());
    color.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let mut coverage = 0.0;
            for (row_weight, down) in WEIGHTS.iter().zip(0..) {
                let y = (y + down).saturating_sub(1).min(height - 1);
                for (column_weight, right) in WEIGHTS.iter().zip(0..) {
                    let x = (x + right).saturating_sub(1).min(width - 1);
                    let [depth] = depth.at(x, y);
                    coverage += if depth.is_finite() && depth > 0.0 { row_weight * column_weight } else { 0.0 };
                }
            }
            *pixel = pixel.map(|value| value * coverage);
        }
    });
}

/// [`over_black`] for many pixels in place.
fn row_over_black(view: &color::View, encoding: Encoding, alpha: PictureAlpha, row: &mut [[f32; 4]]) {
    let is_straight_light = alpha == PictureAlpha::Straight(AlphaConvention::Linear);
    if encoding != Encoding::DisplaySrgb || is_straight_light {
        row.iter_mut().for_each(|pixel| *pixel = over_black(view, encoding, alpha, *pixel));
        return;
    }
    match alpha {
        PictureAlpha::Opaque => row.iter_mut().for_each(|pixel| pixel[3] = 1.0),
        PictureAlpha::Straight(_) => {
            for [r, g, b, coverage] in row.iter_mut() {
                *coverage = coverage_of_encoded_alpha([*r, *g, *b], coverage.clamp(0.0, 1.0));
            }
        }
        PictureAlpha::Associated => row.iter_mut().for_each(|pixel| pixel[3] = pixel[3].clamp(0.0, 1.0)),
    }
    // The inverse of the view takes longest, and is vectorized over the row.
    view.encoded_to_scene_row(simd::level(), row);
}

/// Exposed ACEScg of a pixel over black, and its coverage, from values multiplied by alpha.
fn over_black(view: &color::View, encoding: Encoding, alpha: PictureAlpha, [r, g, b, coverage]: [f32; 4]) -> [f32; 4] {
    let encoded = [r, g, b];
    let [r, g, b] = match alpha {
        // Blended in encoded values over black, or already multiplied in linear light.
        PictureAlpha::Opaque | PictureAlpha::Associated | PictureAlpha::Straight(AlphaConvention::Encoded) => {
            to_scene(view, encoding, encoded)
        }
        PictureAlpha::Straight(AlphaConvention::Linear) if coverage > 0.0 => {
            to_scene(view, encoding, encoded.map(|value| value / coverage)).map(|value| value * coverage)
        }
        PictureAlpha::Straight(AlphaConvention::Linear) => [0.0; 3],
    };
    match alpha {
        PictureAlpha::Opaque => [r, g, b, 1.0],
        PictureAlpha::Straight(AlphaConvention::Encoded) if encoding == Encoding::DisplaySrgb => {
            [r, g, b, coverage_of_encoded_alpha(encoded, coverage.clamp(0.0, 1.0))]
        }
        _ => [r, g, b, coverage.clamp(0.0, 1.0)],
    }
}

/// Steps of bisection: 1/4096, a fraction of a code.
const COVERAGE_STEPS: usize = 12;
/// Mid-gray, over which the alpha of encoded values is closest to that of light: encoded, and its light.
const MID_GRAY_ENCODED: f32 = 0.5;
const MID_GRAY: f32 = 0.214_041_14;

/// Coverage in linear light of a pixel that blends in encoded values: its blend over mid-gray has the same mean. The color is multiplied by alpha. It is the
/// inverse of what a picture with alpha in encoded values is written by (`color::display::quantize`).
fn coverage_of_encoded_alpha(values: [f32; 3], alpha: f32) -> f32 {
    if alpha <= 0.0 || alpha >= 1.0 {
        return alpha;
    }
    let light = values.map(color::decode_srgb);
    let wanted = values.iter().sum::<f32>() + 3.0 * (1.0 - alpha) * MID_GRAY_ENCODED;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..COVERAGE_STEPS {
        let transmitted = 0.5 * (low + high);
        let blended: f32 = light.iter().map(|light| color::encode_srgb(light + transmitted * MID_GRAY)).sum();
        if blended < wanted { low = transmitted } else { high = transmitted }
    }
    1.0 - 0.5 * (low + high)
}

/// Exposed ACEScg of the values of a plate. The view transform is inverted, so that a plate made for display is displayed unchanged.
fn to_scene(view: &color::View, encoding: Encoding, color: [f32; 3]) -> [f32; 3] {
    match encoding {
        Encoding::DisplaySrgb => view.to_scene(color.map(color::decode_srgb)),
        Encoding::LinearSrgb => color::acescg_from_srgb(color),
        Encoding::LinearAcescg => color,
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::host::picture_pixels::CodeImage;

    use super::*;

    #[test]
    fn an_overlay_covers_as_much_of_mid_gray_as_where_it_was_painted() {
        // A black overlay with alpha 0.5: encoded 0.5 becomes 0.25, light 0.2140 becomes 0.0509, so 76.2 % are covered.
        assert!((coverage_of_encoded_alpha([0.0; 3], 0.5) - 0.7622).abs() < 1e-3);
        // A mid-gray overlay changes nothing: its light 0.0509 and the rest of 0.2140.
        assert!((coverage_of_encoded_alpha([0.25; 3], 0.5) - 0.2378).abs() < 1e-3);
        // Half white is brighter there than its light alone could be: nothing is covered.
        assert!(coverage_of_encoded_alpha([0.5; 3], 0.5) < 1e-3);
        assert_eq!([0.0, 1.0].map(|alpha| coverage_of_encoded_alpha([0.0; 3], alpha)), [0.0, 1.0]);
    }

    #[test]
    fn a_plate_without_its_sky_has_soft_edges_before_it() {
        let mut color = Image::filled(6, 5, [0.4, 0.6, 0.8, 1.0]);
        let mut depth = Image::filled(6, 5, [30.0]);
        for y in 0..5 {
            depth.pixels_mut()[6 * y] = [f32::INFINITY];
            depth.pixels_mut()[6 * y + 1] = [0.0];
            depth.pixels_mut()[6 * y + 2] = [f32::INFINITY];
        }
        remove_sky(&mut color, &depth);
        for (x, coverage) in [0.0, 0.0, 0.25, 0.75, 1.0, 1.0].into_iter().enumerate() {
            for y in 0..5 {
                assert_eq!(color.at(x, y), [0.4, 0.6, 0.8, 1.0].map(|value: f32| value * coverage), "{x} {y}");
            }
        }
    }

    #[test]
    fn rows_have_the_bits_of_single_pixels() {
        let codes = (0..=255_u8).map(|code| f32::from(code) / 255.0);
        // Codes of 8 bits are decoded by a table, values between them are not.
        let pixels: Vec<[f32; 4]> =
            codes.flat_map(|value| [[value, 0.7, 1.0 - value, 0.6], [0.37 * value, value, 0.123, value]]).collect();
        for view in [color::View::DISPLAY, color::View::NEUTRAL, color::View::RAW] {
            let view = view.with_white_balance(Some(4000.0));
            for encoding in [Encoding::DisplaySrgb, Encoding::LinearSrgb, Encoding::LinearAcescg] {
                for alpha in [
                    PictureAlpha::Opaque,
                    PictureAlpha::Associated,
                    PictureAlpha::Straight(AlphaConvention::Encoded),
                    PictureAlpha::Straight(AlphaConvention::Linear),
                ] {
                    let mut row = pixels.clone();
                    row_over_black(&view, encoding, alpha, &mut row);
                    for (drawn, pixel) in row.iter().zip(&pixels) {
                        let expected = over_black(&view, encoding, alpha, *pixel);
                        assert_eq!(
                            drawn.map(f32::to_bits),
                            expected.map(f32::to_bits),
                            "{encoding:?} {alpha:?}: {pixel:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn codes_have_the_bits_of_the_floats_that_they_stand_for() {
        let (width, height) = (67, 8);
        let codes: Vec<[u8; 4]> =
            (0..width * height).map(|index| [0, 1, 2, 3].map(|c| ((index * 7 + c * 89) % 256) as u8)).collect();
        let floats = codes.iter().map(|pixel| pixel.map(|code| f32::from(code) / 255.0)).collect();
        let floats = Picture::opaque(Image::from_pixels(width, height, floats).unwrap(), Encoding::DisplaySrgb);
        let codes = Picture::opaque(CodeImage::from_pixels(width, height, codes).unwrap(), Encoding::DisplaySrgb);
        for view in [color::View::DISPLAY, color::View::NEUTRAL, color::View::AGX, color::View::RAW] {
            for view in [view, view.with_white_balance(Some(4000.0))] {
                for alpha in [PictureAlpha::Opaque, PictureAlpha::Straight(AlphaConvention::Encoded)] {
                    let [of_floats, of_codes] = [&floats, &codes].map(|picture| {
                        assert_eq!(
                            PlateBoxes::new(picture, alpha, &view),
                            PlateBoxes::new(&floats, alpha, &view),
                            "{alpha:?}"
                        );
                        decode(&view, picture, alpha, Image::filled(width, height, [0.0; 4]))
                    });
                    assert_eq!(of_codes, of_floats, "{alpha:?}");
                }
            }
        }
    }

    #[test]
    fn boxes_of_a_plate_that_is_decoded_for_the_picture_are_those_of_the_plate_alone() {
        // Boxes of 2 x 2 pixels, but for the last column and row.
        let (width, height) = (401, 37);
        let code = |index: usize, c: usize| ((index * 7 + c * 89) % 256) as f32 / 255.0;
        let pixels = (0..width * height).map(|index| [0, 1, 2, 3].map(|c| code(index, c))).collect();
        let picture = Picture::opaque(Image::from_pixels(width, height, pixels).unwrap(), Encoding::DisplaySrgb);
        let view = color::View::DISPLAY;
        for alpha in [
            PictureAlpha::Opaque,
            PictureAlpha::Associated,
            PictureAlpha::Straight(AlphaConvention::Encoded),
            PictureAlpha::Straight(AlphaConvention::Linear),
        ] {
            let empty = Image::filled(width, height, [0.0; 4]);
            let (color, boxes) = decode_with_boxes(&view, &picture, alpha, empty.clone());
            let is_same = boxes == PlateBoxes::new(&picture, alpha, &view);
            assert_eq!(is_same, plate_boxes::is_drawn_light(&picture, alpha), "{alpha:?}");
            assert_eq!(color, decode(&view, &picture, alpha, empty), "{alpha:?}");
        }
    }

    #[test]
    fn the_light_of_a_plate_is_what_is_drawn_of_it_whatever_its_alpha() {
        let view = color::View::DISPLAY;
        for encoding in [Encoding::DisplaySrgb, Encoding::LinearSrgb, Encoding::LinearAcescg] {
            for alpha in [
                PictureAlpha::Opaque,
                PictureAlpha::Associated,
                PictureAlpha::Straight(AlphaConvention::Encoded),
                PictureAlpha::Straight(AlphaConvention::Linear),
            ] {
                let pixel = [0.3, 0.25, 0.2, if alpha == PictureAlpha::Opaque { 1.0 } else { 0.4 }];
                let picture = Picture::opaque(Image::filled(3, 2, pixel), encoding);
                let boxes = PlateBoxes::new(&picture, alpha, &view);
                let drawn = over_black(&view, encoding, alpha, alpha.premultiplied(pixel));
                for (_, light) in boxes.iter() {
                    let near = light.iter().zip(drawn).all(|(own, drawn)| (own - drawn).abs() < 1e-4);
                    assert!(near, "{encoding:?} {alpha:?}: {:?} is drawn {drawn:?}", light);
                }
            }
        }
    }
}
