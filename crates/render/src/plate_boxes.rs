//! The light of a plate in boxes: means over all of its pixels, so that neither the place of a lamp nor a pattern of stripes decides what drops refract.

use std::{
    ops::Range,
    sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError},
};

use bansho_base::{
    color,
    host::{
        assets::{Encoding, Picture, PictureAlpha},
        parallel::prelude::*,
    },
    math::simd,
};

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
    /// Their mean light.
    pub(crate) light: [f32; 3],
}

impl PlateBoxes {
    /// The boxes of `picture`, whose alpha blends as `alpha` says, with `view` inverted where it is made for display.
    pub(crate) fn new(picture: &Picture, alpha: PictureAlpha, view: &color::View) -> Self {
        let size = [picture.color.width(), picture.color.height()];
        let side = size[0].max(size[1]).div_ceil(BOXES).max(1);
        let source = PlateRows { picture, alpha, view };
        let brightest = match picture.encoding {
            Encoding::DisplaySrgb => CLIPPED_LUMINANCE,
            Encoding::LinearSrgb | Encoding::LinearAcescg => BRIGHTEST_LUMINANCE * source.typical_luminance(),
        };
        let rows: Vec<(Vec<[f32; 3]>, usize)> = (0..size[1].div_ceil(side))
            .into_par_iter()
            .map(|row| source.box_row(row * side..((row + 1) * side).min(size[1]), side, brightest))
            .collect();
        let is_linear = picture.encoding != Encoding::DisplaySrgb;
        let limited = rows.iter().filter(|_| is_linear).map(|(_, limited)| limited).sum();
        Self { size, side, light: rows.into_iter().flat_map(|(light, _)| light).collect(), limited }
    }

    /// Width and height of the plate, pixels.
    pub(crate) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Number of pixels of a whole box.
    pub(crate) fn pixels_in_box(&self) -> f64 {
        (self.side * self.side) as f64
    }

    /// The boxes in rows from the top.
    pub(crate) fn iter(&self) -> impl Iterator<Item = PlateBox> {
        let columns = self.size[0].div_ceil(self.side);
        self.light.iter().enumerate().map(move |(index, &light)| {
            let from = [index % columns, index / columns].map(|step| step * self.side);
            let sides = [0, 1].map(|axis| self.side.min(self.size[axis] - from[axis]));
            PlateBox { center: [0, 1].map(|axis| from[axis] + sides[axis] / 2), pixels: sides[0] * sides[1], light }
        })
    }
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
        let width = self.picture.color.width();
        let row = &self.picture.color.pixels()[y * width..(y + 1) * width];
        // Straight alpha of linear light multiplies the light; elsewhere values are multiplied before they are converted, as in `plate::over_black`.
        let multiplies_light = self.alpha == PictureAlpha::Straight(color::AlphaConvention::Linear);
        light.clear();
        let values = row.iter().map(|pixel| if multiplies_light { *pixel } else { self.alpha.premultiplied(*pixel) });
        match self.picture.encoding {
            Encoding::DisplaySrgb => {
                light.extend(values.map(|[r, g, b, alpha]| [decoded(r), decoded(g), decoded(b), alpha]));
                self.view.to_scene_row(simd::level(), light);
            }
            Encoding::LinearSrgb => {
                light.extend(values.map(|[r, g, b, alpha]| {
                    let [r, g, b] = color::acescg_from_srgb([r, g, b]);
                    [r, g, b, alpha]
                }));
            }
            Encoding::LinearAcescg => light.extend(values),
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

    /// The mean light of a row of boxes, which are these `rows` of pixels, and the number of pixels that are brighter than `brightest`.
    fn box_row(&self, rows: Range<usize>, side: usize, brightest: f32) -> (Vec<[f32; 3]>, usize) {
        let width = self.picture.color.width();
        let (mut sums, mut limited) = (vec![[0.0_f64; 3]; width.div_ceil(side)], 0);
        let mut light = Vec::with_capacity(width);
        for y in rows.clone() {
            self.light(y, &mut light);
            for (sum, pixels) in sums.iter_mut().zip(light.chunks(side)) {
                for &[r, g, b, _] in pixels {
                    let (taken, is_limited) = limit([r, g, b], brightest);
                    limited += usize::from(is_limited);
                    (0..3).for_each(|c| sum[c] += f64::from(taken[c]));
                }
            }
        }
        let mut means = Vec::with_capacity(sums.len());
        for (column, sum) in sums.iter().enumerate() {
            let count = (side.min(width - column * side) * rows.len()) as f64;
            means.push(sum.map(|sum| (sum / count) as f32));
        }
        (means, limited)
    }
}

/// Light of an encoded value, by a table for the codes of 8 bits.
#[inline]
pub(crate) fn decoded(value: f32) -> f32 {
    /// The value of each code, and its light: a comparison instead of a division, which is most of the time of a plate.
    static CODES: LazyLock<[[f32; 2]; 256]> = LazyLock::new(|| {
        std::array::from_fn(|code| {
            let value = code as f32 / 255.0;
            [value, color::decode_srgb(value)]
        })
    });
    let [code_value, light] = CODES[usize::from((value * 255.0 + 0.5) as u8)];
    if code_value == value { light } else { color::decode_srgb(value) }
}

/// Luminance of light, without negative values and what is not finite.
fn luminance(light: [f32; 3]) -> f32 {
    color::luminance(light.map(known))
}

/// A component without negative values; NaN is 0.
fn known(value: f32) -> f32 {
    if value > 0.0 { value.min(LARGEST_COMPONENT) } else { 0.0 }
}

/// Light without negative values and at most as luminous as `brightest`, and whether it was brighter.
fn limit(light: [f32; 3], brightest: f32) -> ([f32; 3], bool) {
    let light = light.map(known);
    let luminance = color::luminance(light);
    if luminance <= brightest {
        return (light, false);
    }
    (light.map(|value| value * (brightest / luminance)), true)
}

/// The boxes of the plate of a scene, which are computed once for each plate and view.
#[derive(Debug, Default)]
pub(crate) struct PlateBoxesCache(Mutex<Option<(PlateBoxesKey, Arc<PlateBoxes>)>>);

/// What the boxes of a plate depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlateBoxesKey {
    /// Of the picture's file.
    pub(crate) digest: [u8; 32],
    pub(crate) alpha: PictureAlpha,
    pub(crate) view: color::View,
}

impl PlateBoxesCache {
    fn lock(&self) -> MutexGuard<'_, Option<(PlateBoxesKey, Arc<PlateBoxes>)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The boxes of this key, computed by `compute` if they are not known.
    pub(crate) fn get_or_compute(&self, key: PlateBoxesKey, compute: impl FnOnce() -> PlateBoxes) -> Arc<PlateBoxes> {
        if let Some((_, boxes)) = self.lock().as_ref().filter(|(known, _)| *known == key) {
            return boxes.clone();
        }
        // Not while the lock is held: `compute` works in parallel.
        let boxes = Arc::new(compute());
        *self.lock() = Some((key, boxes.clone()));
        boxes
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::image::Image;

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
        let sum: f64 = boxes.iter().map(|each| f64::from(each.light[1]) * each.pixels as f64).sum();
        let pixels: usize = boxes.iter().map(|each| each.pixels).sum();
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
        for each in found.iter() {
            assert_eq!((each.light[0], each.pixels), ((each.center[0] * 10 + each.center[1]) as f32 / 100.0, 1));
        }
        let key = PlateBoxesKey { digest: [1; 32], alpha: PictureAlpha::Opaque, view: color::View::DISPLAY };
        let cache = PlateBoxesCache::default();
        let first = cache.get_or_compute(key, || found.clone());
        assert!(Arc::ptr_eq(&first, &cache.get_or_compute(key, || unreachable!("it is known"))));
        let other = cache.get_or_compute(PlateBoxesKey { digest: [2; 32], ..key }, || found);
        assert!(!Arc::ptr_eq(&first, &other));
    }
}
