//! What lies behind the slices that are being drawn: the plate, or all that is farther, perhaps seen through air that bends light.

use bansho_base::{
    canvas::View,
    image::{Channel, Frame, Image, Rect},
    math::Fused,
    phenomenon::Deflection,
};
use fearless_simd::{Level, dispatch};

use super::plate::PlateFrame;

/// The background of some slices, as large as the whole picture.
#[derive(Clone, Copy)]
pub(super) struct Behind<'a> {
    /// Exposed radiance and alpha.
    pub(super) colour: Option<&'a Image<4>>,
    /// Depth, m, row after row.
    depth: Option<&'a [f32]>,
    /// Layers and AOVs of what has been drawn of it; empty for a plate.
    pub(super) channels: &'a [Channel],
    bend: Option<Bend<'a>>,
}

/// Air that bends light, and what turns its angles into pixels.
#[derive(Clone, Copy)]
struct Bend<'a> {
    air: Deflection<'a>,
    focal_pixels: f32,
}

impl<'a> Behind<'a> {
    /// The plate.
    pub(super) fn plate(plate: &'a PlateFrame) -> Self {
        let depth = plate.depth.as_ref().map(|depth| depth.pixels().as_flattened());
        Self { colour: plate.colour.as_ref(), depth, channels: &[], bend: None }
    }

    /// A frame that has been drawn.
    pub(super) fn drawn(frame: &'a Frame) -> Self {
        Self { colour: Some(&frame.beauty), depth: frame.depth.as_deref(), channels: &frame.channels, bend: None }
    }

    /// The same through `air`.
    pub(super) fn through(self, air: Deflection<'a>, view: &View) -> Self {
        Self { bend: Some(Bend { air, focal_pixels: view.camera.focal_pixels as f32 }), ..self }
    }

    /// Depths in a row of `rect`, m. Bending light changes none.
    pub(super) fn depth_row(&self, rect: Rect, row: usize, width: usize) -> Option<&'a [f32]> {
        self.depth.map(|depth| &depth[(rect.y + row) * width + rect.x..][..rect.width])
    }

    /// Finds where the light of each pixel of `rect` comes from; an empty list where none is bent.
    pub(super) fn trace(&self, rect: Rect, sources: &mut Vec<Source>) {
        sources.clear();
        let (Some(bend), Some(image)) = (&self.bend, self.colour) else { return };
        if bend.air.rect.intersection(&rect).is_empty() {
            return;
        }
        sources.resize(rect.width * rect.height, Source::straight(0));
        dispatch!(Level::new(), _simd => trace(bend, [image.width(), image.height()], self.depth, rect, sources));
    }

    /// Colours in a row of `rect`, traced to `sources`; `buffer` holds them if any is bent.
    pub(super) fn colour_row<'b>(
        &self,
        rect: Rect,
        row: usize,
        sources: &[Source],
        buffer: &'b mut Vec<[f32; 4]>,
    ) -> Option<&'b [[f32; 4]]>
    where
        'a: 'b,
    {
        let image = self.colour?;
        if sources.is_empty() {
            return Some(&image.row(rect.y + row)[rect.x..rect.right()]);
        }
        buffer.resize(rect.width, [0.0; 4]);
        let sources = &sources[row * rect.width..][..rect.width];
        dispatch!(Level::new(), _simd => read(sources, image.pixels(), buffer));
        Some(buffer)
    }

    /// Values of a plane of [`Behind::channels`] over `rect`, traced to `sources`.
    pub(super) fn plane(&self, values: &[f32], rect: Rect, sources: &[Source], width: usize) -> Vec<f32> {
        let mut plane = vec![0.0; rect.width * rect.height];
        for (row, out) in plane.chunks_mut(rect.width.max(1)).enumerate() {
            match sources.get(row * rect.width..(row + 1) * rect.width) {
                None => out.copy_from_slice(&values[(rect.y + row) * width + rect.x..][..rect.width]),
                Some(sources) => dispatch!(Level::new(), _simd => read(sources, values, out)),
            }
        }
        plane
    }
}

/// Sources of all pixels of `rect`.
#[inline(always)]
fn trace(bend: &Bend, size: [usize; 2], depth: Option<&[f32]>, rect: Rect, sources: &mut [Source]) {
    for (row, sources) in sources.chunks_mut(rect.width.max(1)).enumerate() {
        for (x, source) in sources.iter_mut().enumerate() {
            *source = bend.source(rect.x + x, rect.y + row, size, depth);
        }
    }
}

/// Values at sources.
#[inline(always)]
fn read<T: Blend>(sources: &[Source], values: &[T], out: &mut [T]) {
    for (source, out) in sources.iter().zip(out) {
        *out = source.read(values);
    }
}

/// What can be between two values.
trait Blend: Copy {
    /// The value at a share of the way from this to another.
    fn blend(self, other: Self, share: f32) -> Self;
}

impl Blend for f32 {
    #[inline(always)]
    fn blend(self, other: Self, share: f32) -> Self {
        share.fused(other - self, self)
    }
}

impl Blend for [f32; 4] {
    #[inline(always)]
    fn blend(self, other: Self, share: f32) -> Self {
        let mut blended = self;
        for c in 0..4 {
            blended[c] = self[c].blend(other[c], share);
        }
        blended
    }
}

/// Where the light of a pixel comes from: between four pixels.
#[derive(Clone, Copy)]
pub(super) struct Source {
    /// Indices of the four, rows one after the other.
    corners: [u32; 4],
    shares: [f32; 2],
}

impl Source {
    /// Straight behind the pixel at the index `here`.
    #[inline(always)]
    fn straight(here: usize) -> Self {
        Self { corners: [here as u32; 4], shares: [0.0; 2] }
    }

    /// Value there.
    #[inline(always)]
    fn read<T: Blend>(&self, values: &[T]) -> T {
        let [one, two, three, four] = self.corners;
        let at = |corner: u32| values[corner as usize];
        let [across, down] = self.shares;
        at(one).blend(at(two), across).blend(at(three).blend(at(four), across), down)
    }
}

impl Bend<'_> {
    /// Where the light of a pixel comes from, at most from the edge of the picture.
    #[inline(always)]
    fn source(&self, x: usize, y: usize, [width, height]: [usize; 2], depth: Option<&[f32]>) -> Source {
        let rect = self.air.rect;
        let here = y * width + x;
        if x < rect.x || y < rect.y || x >= rect.right() || y >= rect.bottom() {
            return Source::straight(here);
        }
        let [right, up] = self.air.angle.at(x - rect.x, y - rect.y);
        let bent_at = self.air.depth as f32;
        let behind = depth.map_or(f32::INFINITY, |depth| depth[here]);
        if (right == 0.0 && up == 0.0) || behind <= bent_at {
            return Source::straight(here);
        }
        // 1 where nothing is known to be.
        let reach = self.focal_pixels * (1.0 - bent_at / behind);
        let (column, across) = split(reach.fused(right, x as f32), width);
        let (row, down) = split((-reach).fused(up, y as f32), height);
        let (next_column, next_row) = ((column + 1).min(width - 1), (row + 1).min(height - 1));
        let mut corners = [
            row * width + column,
            row * width + next_column,
            next_row * width + column,
            next_row * width + next_column,
        ];
        // What is nearer than the air does not shine through it: that part of the light is taken from straight behind.
        if let Some(depth) = depth {
            for corner in &mut corners {
                *corner = if depth[*corner] < bent_at { here } else { *corner };
            }
        }
        Source { corners: corners.map(|corner| corner as u32), shares: [across, down] }
    }
}

/// Whole part and fraction of a place held within so many pixels.
#[inline(always)]
fn split(place: f32, side: usize) -> (usize, f32) {
    let place = place.max(0.0).min((side - 1) as f32);
    let cell = (place as usize).min(side.saturating_sub(2));
    (cell, place - cell as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture 3 pixels wide and 2 high, bent at a depth of 2 m by the same angle everywhere.
    fn read(angle: [f32; 2], depth: Option<&[f32]>, x: usize, y: usize) -> f32 {
        let values = [0.0, 1.0, 2.0, 10.0, 11.0, 12.0];
        let angles = Image::filled(3, 2, angle);
        let air = Deflection { depth: 2.0, rect: Rect::of_size(3, 2), angle: &angles };
        let source = Bend { air, focal_pixels: 1.0 }.source(x, y, [3, 2], depth);
        source.read(&values)
    }

    #[test]
    fn light_comes_from_where_it_was_bent_and_is_linear_between_pixels() {
        assert_eq!(read([0.0, 0.0], None, 1, 1), 11.0);
        assert_eq!(read([2.0, -1.0], None, 0, 0), 12.0);
        assert_eq!(read([0.5, -0.5], None, 0, 0), 5.5);
        assert_eq!(read([-4.0, -9.0], None, 1, 0), 10.0, "held at the edge");
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
