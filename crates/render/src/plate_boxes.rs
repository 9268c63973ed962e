//! The light of a plate in boxes: means over all of its pixels, so that neither the place of a lamp nor a pattern of stripes decides what drops refract.

use std::ops::Range;

use bansho_base::{
    camera::Camera,
    color,
    host::{
        assets::{Encoding, Picture, PictureAlpha},
        parallel::prelude::*,
    },
    math::simd,
};
use fearless_simd::dispatch;

/// Boxes along a plate's longer side.
const BOXES: usize = 256;
/// Largest luminance that is taken from a photograph, relative to display white. How much brighter a clipped pixel was is unknown.
const CLIPPED_LUMINANCE: f32 = 2.0;
/// Largest luminance that is taken from linear light, relative to display white or to the plate's log-average luminance, whichever is higher. A pixel of the
/// sun, of a lamp's filament or of infinity would else outshine all others, and how bright it really was is seldom known.
pub(crate) const BRIGHTEST_LUMINANCE: f32 = 64.0;
/// Beyond this, and at infinity, a component is taken as this: larger than any camera records, and small enough that sums stay finite.
const LARGEST_COMPONENT: f32 = 1e6;

/// The mean light of the boxes of a plate, exposed ACEScg over black.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PlateBoxes {
    /// Width and height of the plate, pixels.
    size: [usize; 2],
    /// Side of a box, pixels; those at the right and the bottom may be smaller.
    side: usize,
    /// Rows of boxes from the top.
    light: Vec<[f32; 3]>,
    /// Number of pixels of linear light that were brighter than is taken.
    pub(crate) limited: usize,
}

/// A box of a plate.
pub(crate) struct PlateBox {
    /// The plate's pixel at its center.
    pub(crate) center: [usize; 2],
    /// Number of its pixels.
    pub(crate) pixels: usize,
}

impl PlateBoxes {
    /// The boxes of `picture`, whose alpha blends as `alpha` says, with `view` inverted where it is made for display.
    pub(crate) fn new(picture: &Picture, alpha: PictureAlpha, view: &color::View) -> Self {
        let size = [picture.color.width(), picture.color.height()];
        let side = box_side(size);
        let source = PlateRows { picture, alpha, view };
        let brightest = match picture.encoding {
            Encoding::DisplaySrgb => CLIPPED_LUMINANCE,
            Encoding::LinearSrgb | Encoding::LinearAcescg => BRIGHTEST_LUMINANCE * source.typical_luminance(),
        };
        let rows: Vec<BoxRow> = (0..size[1].div_ceil(side))
            .into_par_iter()
            .map(|row| source.box_row(row * side..((row + 1) * side).min(size[1]), side, brightest))
            .collect();
        let boxes = Self::of_rows(size, &rows);
        if picture.encoding == Encoding::DisplaySrgb { boxes } else { Self { limited: limited(&rows), ..boxes } }
    }

    /// The boxes of a photograph of `size`, from all rows of boxes.
    pub(crate) fn of_rows(size: [usize; 2], rows: &[BoxRow]) -> Self {
        Self { size, side: box_side(size), light: rows.iter().flat_map(BoxRow::means).collect(), limited: 0 }
    }

    /// Width and height of the plate, pixels.
    pub(crate) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Number of pixels of a whole box.
    pub(crate) fn pixels_in_box(&self) -> f64 {
        (self.side * self.side) as f64
    }

    /// Number of boxes.
    pub(crate) fn len(&self) -> usize {
        self.light.len()
    }

    /// The box with this index, in rows from the top.
    pub(crate) fn at(&self, index: usize) -> PlateBox {
        let columns = self.size[0].div_ceil(self.side);
        let from = [index % columns, index / columns].map(|step| step * self.side);
        let sides = [0, 1].map(|axis| self.side.min(self.size[axis] - from[axis]));
        PlateBox { center: [0, 1].map(|axis| from[axis] + sides[axis] / 2), pixels: sides[0] * sides[1] }
    }

    /// The mean light of the box with this index.
    pub(crate) fn light_at(&self, index: usize) -> [f32; 3] {
        self.light[index]
    }

    /// The boxes in rows from the top, with their light.
    #[cfg(test)]
    pub(crate) fn iter(&self) -> impl Iterator<Item = (PlateBox, [f32; 3])> {
        (0..self.len()).map(|index| (self.at(index), self.light_at(index)))
    }
}

/// Side of a box of a plate of `size`, pixels.
pub(crate) fn box_side(size: [usize; 2]) -> usize {
    size[0].max(size[1]).div_ceil(BOXES).max(1)
}

/// Whether the light of the boxes is that of the pixels of the plate as they are drawn, so that both are decoded at once.
pub(crate) fn is_drawn_light(picture: &Picture, alpha: PictureAlpha) -> bool {
    picture.encoding == Encoding::DisplaySrgb && alpha != PictureAlpha::Straight(color::AlphaConvention::Linear)
}

/// Number of pixels in rows of boxes that were brighter than is taken.
fn limited(rows: &[BoxRow]) -> usize {
    rows.iter().map(|row| row.limited).sum()
}

/// A row of boxes, whose rows of pixels are added one after the other.
pub(crate) struct BoxRow {
    /// Side of a box, pixels.
    side: usize,
    /// Largest luminance that is taken.
    brightest: f32,
    /// The sum over each box: red, green and blue, and a number without meaning, so that a pixel is added by a single instruction.
    sums: Vec<[f64; 4]>,
    width: usize,
    /// Number of rows of pixels.
    rows: usize,
    /// Number of pixels that were brighter than is taken.
    limited: usize,
}

impl BoxRow {
    /// A row of boxes of a photograph of `size`, without any pixels.
    pub(crate) fn of_photograph(size: [usize; 2]) -> Self {
        Self::new(size[0], box_side(size), CLIPPED_LUMINANCE)
    }

    fn new(width: usize, side: usize, brightest: f32) -> Self {
        Self { side, brightest, sums: vec![[0.0; 4]; width.div_ceil(side)], width, rows: 0, limited: 0 }
    }

    /// Adds a row of pixels.
    pub(crate) fn add(&mut self, light: &[[f32; 4]]) {
        let Self { side, brightest, sums, .. } = self;
        self.limited += dispatch!(simd::level(), _simd => add_to_boxes(light, *side, *brightest, sums));
        self.rows += 1;
    }

    /// The mean light of each box.
    fn means(&self) -> impl Iterator<Item = [f32; 3]> {
        self.sums.iter().enumerate().map(|(column, [red, green, blue, _])| {
            let count = (self.side.min(self.width - column * self.side) * self.rows) as f64;
            [red, green, blue].map(|sum| (sum / count) as f32)
        })
    }
}

/// Adds a row of pixels to the sums over its boxes. Returns how many are more luminous than `brightest`.
#[inline(always)]
fn add_to_boxes(light: &[[f32; 4]], side: usize, brightest: f32, sums: &mut [[f64; 4]]) -> usize {
    let mut limited = 0;
    for (sum, pixels) in sums.iter_mut().zip(light.chunks(side)) {
        for &[r, g, b, _] in pixels {
            let ([red, green, blue], is_limited) = limit([r, g, b], brightest);
            limited += usize::from(is_limited);
            let taken = [red, green, blue, 0.0];
            for c in 0..4 {
                sum[c] += f64::from(taken[c]);
            }
        }
    }
    limited
}

/// Rows of a plate as light.
struct PlateRows<'a> {
    picture: &'a Picture,
    alpha: PictureAlpha,
    view: &'a color::View,
}

impl PlateRows<'_> {
    /// Exposed ACEScg over black of row `y`.
    fn light(&self, y: usize, light: &mut Vec<[f32; 4]>) {
        // Straight alpha of linear light multiplies the light; elsewhere values are multiplied before they are converted, as in `plate::over_black`.
        let multiplies_light = self.alpha == PictureAlpha::Straight(color::AlphaConvention::Linear);
        light.resize(self.picture.color.width(), [0.0; 4]);
        self.picture.color.row(y).copy_to(light);
        if !multiplies_light {
            light.iter_mut().for_each(|pixel| *pixel = self.alpha.premultiplied(*pixel));
        }
        match self.picture.encoding {
            Encoding::DisplaySrgb => self.view.encoded_to_scene_row(simd::level(), light),
            Encoding::LinearSrgb => {
                light.iter_mut().for_each(|[r, g, b, _]| [*r, *g, *b] = color::acescg_from_srgb([*r, *g, *b]));
            }
            Encoding::LinearAcescg => {}
        }
        if multiplies_light {
            light.iter_mut().for_each(|[r, g, b, a]| [*r, *g, *b] = [*r * *a, *g * *a, *b * *a]);
        }
    }

    /// The log-average luminance of all pixels that shine, to a power of two, and at least display white: a few pixels of any brightness do not change
    /// it.
    fn typical_luminance(&self) -> f32 {
        let rows: Vec<[i64; 2]> =
            (0..self.picture.color.height()).into_par_iter().map(|y| self.sum_of_exponents(y)).collect();
        let [sum, count] = rows.iter().fold([0; 2], |[sum, count], row| [sum + row[0], count + row[1]]);
        let exponent = sum.div_euclid(count.max(1)).clamp(0, 20);
        (1_u32 << exponent) as f32
    }

    /// Sum of the binary exponents of the luminances of those pixels of row `y` that shine, and the number of these.
    fn sum_of_exponents(&self, y: usize) -> [i64; 2] {
        let mut light = Vec::new();
        self.light(y, &mut light);
        let (mut sum, mut count) = (0, 0);
        for &[r, g, b, _] in &light {
            let luminance = luminance([r, g, b]);
            if luminance > 0.0 {
                // The biased exponent of a positive number follows its 23 bits of fraction.
                sum += i64::from(luminance.to_bits() >> 23) - 127;
                count += 1;
            }
        }
        [sum, count]
    }

    /// The row of boxes that are these `rows` of pixels. No pixel counts as more luminous than `brightest`.
    fn box_row(&self, rows: Range<usize>, side: usize, brightest: f32) -> BoxRow {
        let width = self.picture.color.width();
        let mut boxes = BoxRow::new(width, side, brightest);
        let mut light = Vec::with_capacity(width);
        for y in rows {
            self.light(y, &mut light);
            boxes.add(&light);
        }
        boxes
    }
}

/// Luminance of light, without negative values and what is not finite.
fn luminance(light: [f32; 3]) -> f32 {
    color::luminance(light.map(known))
}

/// A component without negative values; NaN is 0.
#[inline(always)]
fn known(value: f32) -> f32 {
    let bounded = if value < LARGEST_COMPONENT { value } else { LARGEST_COMPONENT };
    if value > 0.0 { bounded } else { 0.0 }
}

/// Light without negative values and at most as luminous as `brightest`, and whether it was brighter.
#[inline(always)]
fn limit([r, g, b]: [f32; 3], brightest: f32) -> ([f32; 3], bool) {
    let [r, g, b] = [known(r), known(g), known(b)];
    let luminance = color::luminance([r, g, b]);
    if luminance <= brightest {
        return ([r, g, b], false);
    }
    let factor = brightest / luminance;
    ([r * factor, g * factor, b * factor], true)
}

/// Where a camera sees a pixel or a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PixelView {
    /// Sine of its elevation.
    pub(crate) sine: f64,
    /// Its solid angle, relative to that of the pixel at the principal point.
    pub(crate) weight: f64,
}

/// What the views of boxes depend on: the camera, and the sizes of picture and plate, pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BoxViewsKey {
    pub(crate) camera: Camera,
    pub(crate) picture: [usize; 2],
    pub(crate) plate: [usize; 2],
}

/// Views of the boxes of a plate, `None` where the lens shows no direction.
pub(crate) type BoxViews = Vec<Option<PixelView>>;

/// What the boxes of a plate depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlateBoxesKey {
    /// Of the picture's file.
    pub(crate) digest: [u8; 32],
    pub(crate) alpha: PictureAlpha,
    pub(crate) view: color::View,
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bansho_base::{host::once::LastValue, image::Image};

    use super::*;

    fn picture(size: [usize; 2], encoding: Encoding, at: impl Fn(usize, usize) -> f32) -> Picture {
        let pixels = (0..size[0] * size[1]).map(|index| {
            let value = at(index % size[0], index / size[0]);
            [value, value, value, 1.0]
        });
        Picture::opaque(Image::from_pixels(size[0], size[1], pixels.collect()).unwrap(), encoding)
    }

    fn boxes(picture: &Picture) -> PlateBoxes {
        PlateBoxes::new(picture, picture.alpha, &color::View::NEUTRAL)
    }

    /// The mean over the plate, and the number of pixels that it is of.
    fn mean(boxes: &PlateBoxes) -> (f64, usize) {
        let sum: f64 = boxes.iter().map(|(each, light)| f64::from(light[1]) * each.pixels as f64).sum();
        let pixels: usize = boxes.iter().map(|(each, _)| each.pixels).sum();
        (sum / pixels as f64, pixels)
    }

    #[test]
    fn every_pixel_counts_wherever_it_is() {
        const SIZE: [usize; 2] = [1283, 717];
        for encoding in [Encoding::LinearAcescg, Encoding::DisplaySrgb] {
            // Bright columns, one in five, each time with the same mean.
            for phase in 0..5 {
                let striped = picture([1280, 720], encoding, |x, _| if x % 5 == phase { 0.5 } else { 0.0 });
                let (found, pixels) = mean(&boxes(&striped));
                let bright = if encoding == Encoding::DisplaySrgb { color::decode_srgb(0.5) } else { 0.5 };
                assert!((found / (0.2 * f64::from(bright)) - 1.0).abs() < 1e-5, "{encoding:?} {phase}: {found}");
                assert_eq!(pixels, 1280 * 720);
            }
            for lamp in [[0, 0], [642, 302], [640, 300], [641, 303], [1282, 716]] {
                let plate = picture(SIZE, encoding, |x, y| if [x, y] == lamp { 1.0 } else { 0.0 });
                let (found, pixels) = mean(&boxes(&plate));
                let bright = if encoding == Encoding::DisplaySrgb { f64::from(CLIPPED_LUMINANCE) } else { 1.0 };
                assert!((found * pixels as f64 / bright - 1.0).abs() < 1e-3, "{encoding:?} {lamp:?}: {found}");
            }
        }
    }

    #[test]
    fn a_pixel_without_bounds_does_not_outshine_the_plate_and_is_counted() {
        let with = |value: f32| {
            boxes(&picture([320, 200], Encoding::LinearSrgb, |x, y| if [x, y] == [9, 9] { value } else { 0.2 }))
        };
        let (plain, _) = mean(&with(0.2));
        for value in [f32::INFINITY, f32::MAX, 65_504.0, 1e4, 65.0] {
            let boxes = with(value);
            let (found, pixels) = mean(&boxes);
            assert!(found - plain <= f64::from(BRIGHTEST_LUMINANCE) / pixels as f64 * 1.001, "{value}: {found}");
            assert_eq!(boxes.limited, 1, "{value}");
        }
        for value in [f32::NAN, -1.0, f32::NEG_INFINITY, 0.0] {
            let boxes = with(value);
            assert!((mean(&boxes).0 - plain * (1.0 - 1.0 / 64_000.0)).abs() < 1e-7 && boxes.limited == 0, "{value}");
        }
        // A plate in other units is bright everywhere, and keeps its light.
        let bright = boxes(&picture([64, 64], Encoding::LinearAcescg, |x, _| if x < 32 { 3000.0 } else { 500.0 }));
        assert!((mean(&bright).0 - 1750.0).abs() < 0.1 && bright.limited == 0);
    }

    #[test]
    fn white_of_a_photograph_is_at_most_one_stop_brighter_than_white() {
        let white = boxes(&picture([8, 8], Encoding::DisplaySrgb, |_, _| 1.0));
        assert!((color::luminance(white.light[0]) - CLIPPED_LUMINANCE).abs() < 1e-5 && white.limited == 0);
        let white = boxes(&picture([8, 8], Encoding::LinearAcescg, |_, _| 16.0));
        assert!((white.light[0][0] - 16.0).abs() < 1e-5);
    }

    #[test]
    fn a_small_plate_is_taken_pixel_by_pixel_and_a_known_one_is_not_read_again() {
        let small = picture([7, 5], Encoding::LinearAcescg, |x, y| (x * 10 + y) as f32 / 100.0);
        let found = boxes(&small);
        for (each, light) in found.iter() {
            assert_eq!((light[0], each.pixels), ((each.center[0] * 10 + each.center[1]) as f32 / 100.0, 1));
        }
        let key = PlateBoxesKey { digest: [1; 32], alpha: PictureAlpha::Opaque, view: color::View::DISPLAY };
        let cache = LastValue::default();
        let first = cache.get_or_compute(key, || found.clone());
        assert!(Arc::ptr_eq(&first, &cache.get_or_compute(key, || unreachable!("it is known"))));
        let other = cache.get_or_compute(PlateBoxesKey { digest: [2; 32], ..key }, || found);
        assert!(!Arc::ptr_eq(&first, &other));
    }
}
