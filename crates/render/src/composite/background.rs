//! The background of the slices that are being drawn: the plate, or everything farther that has been drawn already. It may be seen through
//! air that refracts light.

use bansho_base::{
    frame::{Channel, Frame},
    image::{Image, Rect},
    math::{MulAdd, approximations},
    phenomenon::{Deflection, strip::View},
};

use super::plate::PlateFrame;
use fearless_simd::dispatch;

/// A frame of scene-linear light.
pub(crate) struct LightFrame {
    pub(crate) frame: Frame,
    /// The beauty without the light of the plate, where it is kept apart for the [glare](super::glare).
    pub(crate) drawn: Option<Image<4>>,
}

/// The background of some slices, as large as the whole picture.
#[derive(Clone, Copy)]
pub(crate) struct Background<'a> {
    /// Exposed radiance and alpha.
    pub(crate) color: Option<&'a Image<4>>,
    /// Exposed radiance of what has been drawn, without that of the plate; `None` if it is not kept apart.
    pub(crate) drawn: Option<&'a Image<4>>,
    /// Depth, m, in rows.
    depth: Option<&'a [f32]>,
    /// Layers and AOVs of what has been drawn; empty for a plate.
    pub(crate) channels: &'a [Channel],
    air: Option<RefractingAir<'a>>,
}

/// Air that refracts light, and the focal length that converts its angles into pixels.
#[derive(Clone, Copy)]
struct RefractingAir<'a> {
    deflection: Deflection<'a>,
    focal_pixels: f32,
    /// Whether the picture goes on at its other side: a whole panorama.
    is_periodic: bool,
}

impl<'a> Background<'a> {
    /// The plate.
    pub(crate) fn plate(plate: &'a PlateFrame) -> Self {
        let depth = plate.depth.as_ref().map(|depth| depth.pixels().as_flattened());
        Self { color: plate.color.as_ref(), drawn: None, depth, channels: &[], air: None }
    }

    /// A frame that has been drawn.
    pub(crate) fn drawn(LightFrame { frame, drawn }: &'a LightFrame) -> Self {
        let depth = frame.depth.as_deref();
        Self { color: Some(&frame.beauty), drawn: drawn.as_ref(), depth, channels: &frame.channels, air: None }
    }

    /// The same background seen through air with this deflection.
    pub(crate) fn through(self, deflection: Deflection<'a>, view: &View) -> Self {
        let width = view.size[0] as f64;
        let is_periodic =
            width >= 2.0 && view.camera.horizontal_period().is_some_and(|period| (period - width).abs() < 0.5);
        Self {
            air: Some(RefractingAir { deflection, focal_pixels: view.camera.focal_pixels as f32, is_periodic }),
            ..self
        }
    }

    /// Depths in a row of `rect`, m. Refraction does not change them.
    pub(crate) fn depth_row(&self, rect: Rect, row: usize, width: usize) -> Option<&'a [f32]> {
        self.depth.map(|depth| &depth[(rect.y + row) * width + rect.x..][..rect.width])
    }

    /// Finds the origins of the refracted light in `rect`.
    pub(crate) fn trace(&self, rect: Rect, bent: &mut BentPixels) {
        bent.rect = Rect::default();
        let (Some(air), Some(image)) = (&self.air, self.color) else { return };
        let traced = air.deflection.rect.intersection(&rect);
        bent.rect = traced;
        bent.pixels.resize(traced.width * traced.height, BentPixel::default());
        let size = [image.width(), image.height()];
        for (row, pixels) in bent.pixels.chunks_mut(traced.width.max(1)).enumerate() {
            dispatch!(bansho_base::math::simd::level(), _simd => air.trace_row(traced.x, traced.y + row, size, self.depth, pixels));
        }
    }

    /// Colors of `image`, one of those of a background, in a row of `rect`. `buffer` holds them if any pixel of the row is in `bent`.
    pub(crate) fn row<'b>(
        image: &'b Image<4>,
        rect: Rect,
        row: usize,
        bent: &BentPixels,
        buffer: &'b mut Vec<[f32; 4]>,
    ) -> &'b [[f32; 4]] {
        let y = rect.y + row;
        if bent.row(y).is_empty() {
            return &image.row(y)[rect.x..rect.right()];
        }
        buffer.resize(rect.width, [0.0; 4]);
        bent.read_row(rect.x, y, image.width(), image.pixels(), buffer);
        buffer
    }

    /// Values of a plane of [`Background::channels`] in `rect`, as refracted by `bent`.
    pub(crate) fn plane(&self, values: &[f32], rect: Rect, bent: &BentPixels, width: usize) -> Vec<f32> {
        let mut plane = vec![0.0; rect.width * rect.height];
        for (row, out) in plane.chunks_mut(rect.width.max(1)).enumerate() {
            bent.read_row(rect.x, rect.y + row, width, values, out);
        }
        plane
    }
}

/// The pixels of a strip whose light is refracted.
#[derive(Default)]
pub(crate) struct BentPixels {
    rect: Rect,
    /// The pixels of `rect`, in rows.
    pixels: Vec<BentPixel>,
}

impl BentPixels {
    /// Those in row `y` of the picture.
    fn row(&self, y: usize) -> &[BentPixel] {
        let rows = self.rect.y..self.rect.bottom();
        if rows.contains(&y) { &self.pixels[(y - self.rect.y) * self.rect.width..][..self.rect.width] } else { &[] }
    }

    /// Refracted values of the pixels of row `y` from column `x` on, in a picture that is `width` pixels wide.
    fn read_row<T: Blend>(&self, x: usize, y: usize, width: usize, values: &[T], out: &mut [T]) {
        let start = y * width + x;
        let straight = &values[start..][..out.len()];
        let pixels = self.row(y);
        if pixels.is_empty() {
            out.copy_from_slice(straight);
            return;
        }
        let from = self.rect.x - x;
        let to = from + pixels.len();
        out[..from].copy_from_slice(&straight[..from]);
        out[to..].copy_from_slice(&straight[to..]);
        dispatch!(bansho_base::math::simd::level(), _simd => read(pixels, values, start + from, width, &mut out[from..to]));
    }
}

/// Refracted values of consecutive pixels, the first of which has the index `start`.
#[inline(always)]
fn read<T: Blend>(pixels: &[BentPixel], values: &[T], start: usize, width: usize, out: &mut [T]) {
    for (index, (pixel, out)) in pixels.iter().zip(out).enumerate() {
        *out = pixel.read(values, start + index, width);
    }
}

/// Linear interpolation.
trait Blend: Copy {
    /// `self` at `t` = 0, `other` at `t` = 1.
    fn blend(self, other: Self, t: f32) -> Self;
}

impl Blend for f32 {
    #[inline(always)]
    fn blend(self, other: Self, t: f32) -> Self {
        t.fma(other - self, self)
    }
}

impl Blend for [f32; 4] {
    #[inline(always)]
    fn blend(self, other: Self, t: f32) -> Self {
        let mut blended = self;
        for c in 0..4 {
            blended[c] = self[c].blend(other[c], t);
        }
        blended
    }
}

/// The origin of the light of a pixel: a point between four pixels.
#[derive(Clone, Copy, Default)]
struct BentPixel {
    /// Index of the upper left pixel.
    first: u32,
    /// One bit for each of the four, in rows: set where the value straight behind is used instead. And [`AROUND_SEAM`].
    hidden: u32,
    /// Position between the four, 0 to 1: to the right, down.
    fractions: [f32; 2],
}

/// All four pixels are hidden.
const ALL_HIDDEN: u32 = 0b1111;
/// The right two of the four pixels are in the first column of a panorama, the left two in the last.
const AROUND_SEAM: u32 = 0b1_0000;

impl BentPixel {
    /// The value at the origin, for the pixel with the index `own_index` of a picture that is `width` pixels wide.
    #[inline(always)]
    fn read<T: Blend>(&self, values: &[T], own_index: usize, width: usize) -> T {
        let first = self.first as usize;
        let [across, down] = self.fractions;
        if self.hidden == 0 {
            let (upper, lower) = (&values[first..first + 2], &values[first + width..first + width + 2]);
            return upper[0].blend(upper[1], across).blend(lower[0].blend(lower[1], across), down);
        }
        let straight = values[own_index];
        if self.hidden & ALL_HIDDEN == ALL_HIDDEN {
            return straight;
        }
        let corners = self.corners(width);
        let mut around = [straight; 4];
        for corner in 0..4 {
            if self.hidden >> corner & 1 == 0 {
                around[corner] = values[corners[corner]];
            }
        }
        let upper = around[0].blend(around[1], across);
        upper.blend(around[2].blend(around[3], across), down)
    }

    /// Indices of the four pixels.
    #[inline(always)]
    fn corners(&self, width: usize) -> [usize; 4] {
        let first = self.first as usize;
        let right = if self.hidden & AROUND_SEAM == 0 { first + 1 } else { first + 1 - width };
        [first, right, first + width, right + width]
    }
}

impl RefractingAir<'_> {
    /// The origins of the light of the pixels of row `y` from column `first` on, clamped to the picture.
    #[inline(always)]
    fn trace_row(&self, first: usize, y: usize, size: [usize; 2], depth: Option<&[f32]>, pixels: &mut [BentPixel]) {
        let rect = self.deflection.rect;
        let angles = &self.deflection.angle.row(y - rect.y)[first - rect.x..][..pixels.len()];
        let start = y * size[0] + first;
        match depth {
            None => {
                for (index, (pixel, angle)) in pixels.iter_mut().zip(angles).enumerate() {
                    *pixel = self.origin(first + index, y, *angle, self.focal_pixels, size);
                }
            }
            Some(depth) => {
                for (index, (pixel, angle)) in pixels.iter_mut().zip(angles).enumerate() {
                    // 1 where the depth is infinite.
                    let lever = 1.0 - self.deflection.depth as f32 / depth[start + index];
                    *pixel = self.origin(first + index, y, *angle, self.focal_pixels * lever, size);
                    pixel.hidden |= if lever > 0.0 { self.nearer_than_air(pixel, depth, size[0]) } else { ALL_HIDDEN };
                }
            }
        }
    }

    /// The origin of the light of a pixel that is deflected by the angles `[right, up]`; `reach` converts radians into pixels at the background.
    #[inline(always)]
    fn origin(&self, x: usize, y: usize, [right, up]: [f32; 2], reach: f32, [width, height]: [usize; 2]) -> BentPixel {
        let across = reach.fma(right, x as f32);
        let (column, across) = if self.is_periodic { split_around(across, width) } else { split(across, width) };
        let (row, down) = split((-reach).fma(up, y as f32), height);
        // A picture of one column or row has no neighbors in that direction.
        let beside = if width < 2 { 0b1010 } else { 0 } | if height < 2 { 0b1100 } else { 0 };
        let seam = if self.is_periodic && column as usize + 1 == width { AROUND_SEAM } else { 0 };
        let hidden = if right == 0.0 && up == 0.0 { ALL_HIDDEN } else { beside | seam };
        BentPixel { first: row * width as u32 + column, hidden, fractions: [across, down] }
    }

    /// Bits of those of the four pixels that are nearer than the air, through which their light cannot come.
    #[inline(always)]
    fn nearer_than_air(&self, pixel: &BentPixel, depth: &[f32], width: usize) -> u32 {
        let mut nearer = 0;
        for (corner, index) in pixel.corners(width).into_iter().enumerate() {
            let is_nearer = depth.get(index).is_some_and(|depth| *depth < self.deflection.depth as f32);
            nearer |= u32::from(is_nearer) << corner;
        }
        nearer
    }
}

/// Integer part and fraction of a coordinate clamped to `side` pixels. The integer part is at most `side` - 2, so that a pixel follows it.
#[inline(always)]
fn split(coordinate: f32, side: usize) -> (u32, f32) {
    let coordinate = coordinate.max(0.0).min((side - 1) as f32);
    let whole = coordinate.floor().min(side.saturating_sub(2) as f32);
    (approximations::round_to_i32(whole).cast_unsigned(), coordinate - whole)
}

/// The same for a coordinate that is periodic: the integer part may be that of the last pixel, which the first follows.
#[inline(always)]
fn split_around(coordinate: f32, side: usize) -> (u32, f32) {
    let side = side as f32;
    let coordinate = coordinate - (coordinate / side).floor() * side;
    let whole = coordinate.floor().max(0.0).min(side - 1.0);
    (approximations::round_to_i32(whole).cast_unsigned(), (coordinate - whole).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture 3 pixels wide and 2 high, bent at a depth of 2 m by the same angle everywhere.
    fn read(angle: [f32; 2], depth: Option<&[f32]>, x: usize, y: usize) -> f32 {
        let values = [0.0, 1.0, 2.0, 10.0, 11.0, 12.0];
        let angles = Image::filled(3, 2, angle);
        let deflection = Deflection { depth: 2.0, rect: Rect::from_size(3, 2), angle: &angles };
        let mut row = [BentPixel::default(); 3];
        RefractingAir { deflection, focal_pixels: 1.0, is_periodic: false }.trace_row(0, y, [3, 2], depth, &mut row);
        row[x].read(&values, 3 * y + x, 3)
    }

    #[test]
    fn light_comes_from_where_it_was_bent_and_is_linear_between_pixels() {
        assert_eq!(read([0.0, 0.0], None, 1, 1), 11.0);
        assert_eq!(read([2.0, -1.0], None, 0, 0), 12.0);
        assert_eq!(read([0.5, -0.5], None, 0, 0), 5.5);
        assert_eq!(read([-4.0, -9.0], None, 1, 0), 10.0, "held at the edge");
    }

    #[test]
    fn light_of_a_whole_panorama_is_bent_across_its_seam() {
        let values = [0.0, 1.0, 2.0, 10.0, 11.0, 12.0];
        for (angle, x, expected) in [(1.0, 2, 10.0), (0.5, 2, 11.0), (-0.75, 0, 11.5), (-1.0, 0, 12.0), (4.0, 1, 12.0)]
        {
            let angles = Image::filled(3, 2, [angle, 0.0]);
            let deflection = Deflection { depth: 2.0, rect: Rect::from_size(3, 2), angle: &angles };
            let mut row = [BentPixel::default(); 3];
            RefractingAir { deflection, focal_pixels: 1.0, is_periodic: true }.trace_row(0, 1, [3, 2], None, &mut row);
            assert_eq!(row[x].read(&values, 3 + x, 3), expected, "{angle} at {x}");
        }
    }

    #[test]
    fn pictures_of_one_column_or_row_bend_along_it() {
        for (size, angle) in [([1, 3], [0.0, -0.5]), ([3, 1], [0.5, 0.0])] {
            let angles = Image::filled(size[0], size[1], angle);
            let deflection = Deflection { depth: 2.0, rect: Rect::from_size(size[0], size[1]), angle: &angles };
            let mut bent = BentPixels::default();
            let color = Image::from_pixels(size[0], size[1], [1.0, 2.0, 4.0].map(|v| [v; 4]).to_vec()).unwrap();
            let air = Some(RefractingAir { deflection, focal_pixels: 1.0, is_periodic: false });
            let background = Background { color: Some(&color), drawn: None, depth: None, channels: &[], air };
            background.trace(Rect::from_size(size[0], size[1]), &mut bent);
            let seen = background.plane(&[1.0, 2.0, 4.0], Rect::from_size(size[0], size[1]), &bent, size[0]);
            assert_eq!(seen, [1.5, 3.0, 4.0], "{size:?}");
        }
    }

    #[test]
    fn only_pixels_behind_the_air_are_looked_up_elsewhere() {
        let angles = Image::filled(1, 1, [1.0, 0.0]);
        let deflection = Deflection { depth: 2.0, rect: Rect { x: 1, y: 1, width: 1, height: 1 }, angle: &angles };
        let color = Image::from_pixels(3, 2, (0..6_u8).map(|v| [f32::from(v); 4]).collect()).unwrap();
        let air = Some(RefractingAir { deflection, focal_pixels: 1.0, is_periodic: false });
        let background = Background { color: Some(&color), drawn: None, depth: None, channels: &[], air };
        let (mut bent, mut buffer) = (BentPixels::default(), Vec::new());
        let rect = Rect { x: 0, y: 0, width: 3, height: 2 };
        background.trace(rect, &mut bent);
        let mut row =
            |row| Background::row(&color, rect, row, &bent, &mut buffer).iter().map(|c| c[0]).collect::<Vec<_>>();
        assert_eq!((row(0), row(1)), (vec![0.0, 1.0, 2.0], vec![3.0, 5.0, 5.0]));
    }

    #[test]
    fn the_lever_grows_with_the_distance_behind_the_air() {
        // Half of the way at twice the depth; none at the air's own, and none before it.
        assert_eq!(read([1.0, 0.0], Some(&[4.0; 6]), 0, 0), 0.5);
        assert_eq!(read([1.0, 0.0], Some(&[2.0; 6]), 0, 0), 0.0);
        assert_eq!(read([1.0, 0.0], Some(&[1.0; 6]), 0, 0), 0.0);
    }

    #[test]
    fn what_is_nearer_than_the_air_does_not_shine_through_it() {
        let far = f32::INFINITY;
        assert_eq!(read([1.0, 0.0], Some(&[far, 1.0, far, far, far, far]), 0, 0), 0.0);
        assert_eq!(
            read([1.5, 0.0], Some(&[far, 1.0, far, far, far, far]), 0, 0),
            1.0,
            "half of it from straight behind"
        );
    }
}
