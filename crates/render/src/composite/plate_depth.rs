//! The depth of a plate, resampled to the picture.
//!
//! Between near and far there is nothing, so depths of different surfaces are never mixed. On a plane the inverse of the depth is linear in the picture: the depth of a pixel is that of the nearest
//! value, continued along its surface to the middle of the pixel. Without that, water and ground that are seen at a grazing angle would be hidden in stripes, since a third of a row is meters there.

use bansho_base::{
    camera::{Camera, Lens},
    host::parallel::prelude::*,
    image::Image,
    math::DVec2,
};
use bansho_scene::{DepthKind, DepthScale, PlateDepth};

use super::plate_mapping::{PlateMapping, depth_of_lens, image_in};

/// The value that is nearest to the middle of a pixel, along one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct NearestValue {
    index: usize,
    /// From the middle of that value to that of the pixel, in values: -0.5 to 0.5.
    offset: f64,
}

impl NearestValue {
    /// `position` is in values; the first covers 0 to 1.
    fn new(position: f64, count: usize) -> Self {
        let index = (position as usize).min(count - 1);
        Self { index, offset: (position - (index as f64 + 0.5)).clamp(-0.5, 0.5) }
    }
}

/// Values of a depth in rows.
struct DepthRows<'a> {
    values: &'a [f32],
    /// Width and height.
    size: [usize; 2],
    scale: DepthScale,
}

impl DepthRows<'_> {
    /// One over the depth in meters; 0 where nothing is.
    fn inverse(&self, column: usize, row: usize) -> f64 {
        1.0 / self.scale.meters_of(self.values[row * self.size[0] + column])
    }

    /// The depth in meters at an offset from its nearest value, on the same surface.
    fn meters(&self, column: NearestValue, row: NearestValue) -> f64 {
        let [width, height] = self.size;
        let (x, y) = (column.index, row.index);
        let nearest = self.scale.meters_of(self.values[y * width + x]);
        if (column.offset == 0.0 && row.offset == 0.0) || nearest.is_infinite() {
            return nearest;
        }
        let here = 1.0 / nearest;
        let across = slope([x.saturating_sub(1), (x + 1).min(width - 1)].map(|x| self.inverse(x, y)), here);
        let down = slope([y.saturating_sub(1), (y + 1).min(height - 1)].map(|y| self.inverse(x, y)), here);
        let inverse = here + across * column.offset + down * row.offset;
        // A surface ends where it would be infinitely far.
        if inverse > 0.0 { 1.0 / inverse } else { nearest }
    }
}

/// Change of a value from one to the next: the smaller of the changes from the value before and to that after, or 0 where one rises and the other falls (the minmod limiter of finite volumes).
/// On a plane both are the same; at an edge the smaller is that of the surface.
fn slope([before, after]: [f64; 2], here: f64) -> f64 {
    let changes = [here - before, after - here];
    if changes[0] * changes[1] <= 0.0 {
        0.0
    } else if changes[0].abs() < changes[1].abs() {
        changes[0]
    } else {
        changes[1]
    }
}

/// Values of a depth in meters.
fn meters_of_row(scale: &DepthScale, values: &[f32], meters: &mut [f32]) {
    if scale.meters == 1.0 && scale.kind != DepthKind::Inverse {
        // They are in meters already: what is left of `meters_of` is vectorized.
        for (meters, value) in meters.iter_mut().zip(values) {
            *meters = if *value > 0.0 { *value } else { f32::INFINITY };
        }
        return;
    }
    for (meters, value) in meters.iter_mut().zip(values) {
        *meters = scale.meters_of(*value) as f32;
    }
}

/// The depth of a plate in the pixels of the picture; infinite outside the plate. The memory of `recycled` may be used again.
pub(super) fn resample_depth(
    camera: &Camera,
    depth: &PlateDepth,
    mapping: &PlateMapping,
    recycled: Option<Image<1>>,
) -> Image<1> {
    let rows = DepthRows { values: depth.values(), size: depth.size, scale: depth.scale };
    let nearest = |axis: usize, pixel: usize| {
        let per_plate_pixel = depth.size[axis] as f64 / mapping.plate[axis] as f64;
        NearestValue::new(mapping.plate_position(axis, pixel) * per_plate_pixel, depth.size[axis])
    };
    let covered = mapping.covered_columns();
    let columns: Vec<NearestValue> = covered.clone().map(|x| nearest(0, x)).collect();
    // The depth of a pixel is then that of its value, whatever the direction of the pixel.
    let is_axis = camera.lens != Lens::Perspective || depth.scale.kind != DepthKind::Distance;
    if is_axis && mapping.is_identity() && depth.size == mapping.plate {
        let mut image = image_in(recycled, depth.size, [0.0]);
        let both = image.pixels_mut().par_chunks_mut(depth.size[0]).zip(rows.values.par_chunks(depth.size[0]));
        both.for_each(|(pixels, values)| meters_of_row(&depth.scale, values, pixels.as_flattened_mut()));
        return image;
    }
    let mut image = Image::filled(mapping.picture[0], mapping.picture[1], [f32::INFINITY]);
    image.pixels_mut().par_chunks_mut(mapping.picture[0]).enumerate().for_each(|(y, pixels)| {
        if !mapping.covers(1, y) {
            return;
        }
        let row = nearest(1, y);
        for ((pixel, column), x) in pixels[covered.clone()].iter_mut().zip(&columns).zip(covered.clone()) {
            let middle = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            pixel[0] = depth_of_lens(camera, depth.scale.kind, rows.meters(*column, row), middle) as f32;
        }
    });
    image
}

#[cfg(test)]
mod tests {
    use bansho_scene::DepthKind;

    use super::*;

    /// Water seen from 3 m above it, down to 6 rows below the horizon, with a post 4 m away before it.
    #[test]
    fn a_plane_has_its_own_depth_at_every_position_and_a_post_keeps_its_edge() {
        const SIZE: [usize; 2] = [20, 60];
        let water = |position: f64| 3.0 * 600.0 / (position + 6.0);
        let mut values = Vec::new();
        for row in 0..SIZE[1] {
            for column in 0..SIZE[0] {
                values.push(if column == 8 || column == 9 { 4.0 } else { water(row as f64 + 0.5) as f32 });
            }
        }
        let scale = DepthScale { kind: DepthKind::Axis, meters: 1.0, shift: 0.0 };
        let rows = DepthRows { values: &values, size: SIZE, scale };
        let mut farthest_off: f64 = 0.0;
        for y in 0..40 {
            let position = (f64::from(y) + 0.5) * 4.0 / 3.0;
            let row = NearestValue::new(position, SIZE[1]);
            for x in 0..15 {
                let column = NearestValue::new((f64::from(x) + 0.5) * 4.0 / 3.0, SIZE[0]);
                let meters = rows.meters(column, row);
                if column.index == 8 || column.index == 9 {
                    assert_eq!(meters, 4.0, "{x} {y}");
                } else if y > 0 {
                    assert!((meters / water(position) - 1.0).abs() < 1e-5, "{x} {y}: {meters} {}", water(position));
                }
            }
            let nearest = NearestValue { offset: 0.0, ..row };
            farthest_off = farthest_off.max((rows.meters(nearest, nearest) / water(position) - 1.0).abs());
        }
        assert!(farthest_off > 0.03, "the nearest value alone is off by {farthest_off}");
    }

    #[test]
    fn values_in_meters_are_converted_as_any_others() {
        let values = [3.5, 0.0, -0.0, -2.0, 1e-40, f32::MAX, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
        for (kind, meters) in
            [(DepthKind::Axis, 1.0), (DepthKind::Distance, 1.0), (DepthKind::Axis, 0.5), (DepthKind::Inverse, 1.0)]
        {
            let scale = DepthScale { kind, meters, shift: 0.0 };
            let mut converted = [0.0; 9];
            meters_of_row(&scale, &values, &mut converted);
            assert_eq!(converted, values.map(|value| scale.meters_of(value) as f32), "{kind:?} {meters}");
        }
    }

    #[test]
    fn the_nearest_value_is_the_one_that_covers_the_middle_of_the_pixel() {
        assert_eq!(NearestValue::new(2.5, 4), NearestValue { index: 2, offset: 0.0 });
        assert_eq!(NearestValue::new(2.75, 4), NearestValue { index: 2, offset: 0.25 });
        // Beyond the last value nothing is continued by more than half a value.
        assert_eq!(NearestValue::new(5.0, 4), NearestValue { index: 3, offset: 0.5 });
    }

    #[test]
    fn a_slope_is_that_of_the_surface_on_which_the_value_lies() {
        assert_eq!(slope([0.25, 0.75], 0.5), 0.25);
        // The next value is a post that is near, and the last one was.
        assert_eq!(slope([0.25, 4.0], 0.5), 0.25);
        assert_eq!(slope([0.125, 0.625], 0.5), 0.125);
        // A wire, and a gap.
        assert_eq!(slope([0.25, 0.25], 4.0), 0.0);
        assert_eq!(slope([4.0, 4.0], 0.25), 0.0);
    }
}
