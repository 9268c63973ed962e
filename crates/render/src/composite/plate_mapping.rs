//! Where the pixels of a plate are in the picture, and how they are resampled.

use std::ops::Range;

use bansho_base::{
    camera::{Camera, Lens},
    image::Image,
    math::DVec2,
};
use bansho_scene::DepthKind;

use crate::plan::Plan;

/// The mapping between pixels of the picture and of the plate. The plate covers the picture, centered; what exceeds it is cropped.
pub(crate) struct PlateMapping {
    pub(super) picture: [usize; 2],
    pub(super) plate: [usize; 2],
    overscan: usize,
    /// Side of a picture pixel, plate pixels.
    scale: f64,
    offset: [f64; 2],
}

impl PlateMapping {
    pub(crate) fn new(plan: &Plan, plate: [usize; 2]) -> Self {
        let overscan = plan.overscan;
        let [across, down] = [0, 1].map(|axis| plate[axis] as f64 / plan.size[axis] as f64);
        let scale = across.min(down);
        let offset = [0, 1].map(|axis| 0.5 * (plate[axis] as f64 - scale * plan.size[axis] as f64));
        Self { picture: plan.size.map(|side| side + 2 * overscan), plate, overscan, scale, offset }
    }

    /// Position on the plate, in its pixels, of the center of a picture pixel.
    pub(super) fn plate_position(&self, axis: usize, pixel: usize) -> f64 {
        (pixel as f64 + 0.5 - self.overscan as f64) * self.scale + self.offset[axis]
    }

    /// Position in the picture without overscan, in its pixels, of the center of a plate pixel.
    pub(crate) fn picture_position(&self, axis: usize, pixel: usize) -> f64 {
        (pixel as f64 + 0.5 - self.offset[axis]) / self.scale
    }

    /// Width and height of the picture with its overscan.
    pub(super) fn picture_size(&self) -> [usize; 2] {
        self.picture
    }

    pub(super) fn covers(&self, axis: usize, pixel: usize) -> bool {
        (0.0..=self.plate[axis] as f64).contains(&self.plate_position(axis, pixel))
    }

    /// Whether the pixels of the plate are those of the picture.
    pub(super) fn is_identity(&self) -> bool {
        self.picture == self.plate && self.overscan == 0 && self.scale == 1.0 && self.offset == [0.0; 2]
    }

    /// The columns of the picture that the plate covers.
    pub(super) fn covered_columns(&self) -> Range<usize> {
        let covers = |x: &usize| self.covers(0, *x);
        let first = (0..self.picture[0]).find(covers).unwrap_or(0);
        first..(first..self.picture[0]).rfind(covers).map_or(first, |last| last + 1)
    }
}

/// A plate pixel along an axis, and its weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FilterTap {
    pub(super) pixel: usize,
    pub(super) weight: f32,
}

/// The taps of one picture pixel along an axis: a triangle filter whose radius is the larger side of a pixel of both.
pub(super) fn filter_taps(mapping: &PlateMapping, axis: usize, pixel: usize) -> Vec<FilterTap> {
    let radius = mapping.scale.max(1.0);
    let center = mapping.plate_position(axis, pixel) - 0.5;
    let mut taps: Vec<FilterTap> = Vec::new();
    for sample in (center - radius).floor() as i64..=(center + radius).ceil() as i64 {
        let weight = 1.0 - (sample as f64 - center).abs() / radius;
        if weight > 1e-9 {
            let pixel = sample.clamp(0, mapping.plate[axis] as i64 - 1) as usize;
            taps.push(FilterTap { pixel, weight: weight as f32 });
        }
    }
    let total: f32 = taps.iter().map(|tap| tap.weight).sum();
    taps.iter_mut().for_each(|tap| tap.weight /= total);
    taps
}

/// An image of this size, in the memory of an earlier one if that is as large, which then keeps its values; else with every pixel set to `value`.
pub(super) fn image_in<const N: usize>(memory: Option<Image<N>>, size: [usize; 2], value: [f32; N]) -> Image<N> {
    let equal = memory.filter(|image| [image.width(), image.height()] == size);
    equal.unwrap_or_else(|| Image::filled(size[0], size[1], value))
}

/// Depth in the convention of the camera's lens: along the axis for perspective, else the distance.
pub(super) fn depth_of_lens(camera: &Camera, kind: DepthKind, meters: f64, pixel: DVec2) -> f64 {
    if camera.lens != Lens::Perspective || kind != DepthKind::Distance {
        return meters;
    }
    // Its length is the distance of the point at depth 1.
    let direction = camera.direction(pixel);
    meters / direction.map_or(1.0, |direction| direction.length())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plate_of_the_pictures_size_is_taken_pixel_by_pixel() {
        let mapping = PlateMapping { picture: [4, 3], plate: [4, 3], overscan: 0, scale: 1.0, offset: [0.0, 0.0] };
        for pixel in 0..4 {
            assert_eq!(filter_taps(&mapping, 0, pixel), [FilterTap { pixel, weight: 1.0 }]);
        }
        assert!(mapping.is_identity());
        assert!(!PlateMapping { overscan: 1, ..mapping }.is_identity());
    }

    #[test]
    fn a_smaller_picture_averages_and_never_reaches_outside() {
        let mapping = PlateMapping { picture: [2, 2], plate: [8, 8], overscan: 0, scale: 4.0, offset: [0.0, 0.0] };
        let taps = filter_taps(&mapping, 0, 0);
        assert!((taps.iter().map(|tap| tap.weight).sum::<f32>() - 1.0).abs() < 1e-6);
        assert!(taps.len() > 5 && taps.iter().all(|tap| tap.pixel < 8));
    }
}
