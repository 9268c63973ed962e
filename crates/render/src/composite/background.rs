//! What lies behind the slices that are being drawn: the plate, or all that is farther, perhaps seen through air that bends light.

use bansho_base::{
    frame::{Channel, Frame},
    image::{Image, Rect},
    math::{MulAdd, approximations},
    phenomenon::{Deflection, strip::View},
};

use super::plate::PlateFrame;
use fearless_simd::{Level, dispatch};

/// The background of some slices, as large as the whole picture.
#[derive(Clone, Copy)]
pub(crate) struct Behind<'a> {
    /// Exposed radiance and alpha.
    pub(crate) color: Option<&'a Image<4>>,
    /// Depth, m, row after row.
    depth: Option<&'a [f32]>,
    /// Layers and AOVs of what has been drawn of it; empty for a plate.
    pub(crate) channels: &'a [Channel],
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
    pub(crate) fn plate(plate: &'a PlateFrame) -> Self {
        let depth = plate.depth.as_ref().map(|depth| depth.pixels().as_flattened());
        Self { color: plate.color.as_ref(), depth, channels: &[], bend: None }
    }

    /// A frame that has been drawn.
    pub(crate) fn drawn(frame: &'a Frame) -> Self {
        Self { color: Some(&frame.beauty), depth: frame.depth.as_deref(), channels: &frame.channels, bend: None }
    }

    /// The same through `air`.
    pub(crate) fn through(self, air: Deflection<'a>, view: &View) -> Self {
        Self { bend: Some(Bend { air, focal_pixels: view.camera.focal_pixels as f32 }), ..self }
    }

    /// Depths in a row of `rect`, m. Bending light changes none.
    pub(crate) fn depth_row(&self, rect: Rect, row: usize, width: usize) -> Option<&'a [f32]> {
        self.depth.map(|depth| &depth[(rect.y + row) * width + rect.x..][..rect.width])
    }

    /// Finds where the light of those pixels of `rect` comes from that the air bends.
    pub(crate) fn trace(&self, rect: Rect, sources: &mut Sources) {
        sources.span = Rect::default();
        let (Some(bend), Some(image)) = (&self.bend, self.color) else { return };
        let span = bend.air.rect.intersection(&rect);
        sources.span = span;
        sources.list.resize(span.width * span.height, Source::default());
        let size = [image.width(), image.height()];
        for (row, sources) in sources.list.chunks_mut(span.width.max(1)).enumerate() {
            dispatch!(Level::new(), _simd => bend.trace_row(span.x, span.y + row, size, self.depth, sources));
        }
    }

    /// Colors in a row of `rect`, traced to `sources`; `buffer` holds them if any is bent.
    pub(crate) fn color_row<'b>(
        &self,
        rect: Rect,
        row: usize,
        sources: &Sources,
        buffer: &'b mut Vec<[f32; 4]>,
    ) -> Option<&'b [[f32; 4]]>
    where
        'a: 'b,
    {
        let image = self.color?;
        let y = rect.y + row;
        if sources.row(y).is_empty() {
            return Some(&image.row(y)[rect.x..rect.right()]);
        }
        buffer.resize(rect.width, [0.0; 4]);
        sources.read_row(rect.x, y, image.width(), image.pixels(), buffer);
        Some(buffer)
    }

    /// Values of a plane of [`Behind::channels`] over `rect`, traced to `sources`.
    pub(crate) fn plane(&self, values: &[f32], rect: Rect, sources: &Sources, width: usize) -> Vec<f32> {
        let mut plane = vec![0.0; rect.width * rect.height];
        for (row, out) in plane.chunks_mut(rect.width.max(1)).enumerate() {
            sources.read_row(rect.x, rect.y + row, width, values, out);
        }
        plane
    }
}

/// Where the light of the bent pixels of a strip comes from.
#[derive(Default)]
pub(crate) struct Sources {
    /// The pixels that are bent.
    span: Rect,
    /// Their sources, row after row.
    list: Vec<Source>,
}

impl Sources {
    /// Those in row `y` of the picture.
    fn row(&self, y: usize) -> &[Source] {
        let rows = self.span.y..self.span.bottom();
        if rows.contains(&y) { &self.list[(y - self.span.y) * self.span.width..][..self.span.width] } else { &[] }
    }

    /// Values that are seen from column `x` of row `y` of the picture on, of a picture `width` pixels wide.
    fn read_row<T: Blend>(&self, x: usize, y: usize, width: usize, values: &[T], out: &mut [T]) {
        let here = y * width + x;
        let straight = &values[here..][..out.len()];
        let sources = self.row(y);
        if sources.is_empty() {
            out.copy_from_slice(straight);
            return;
        }
        let from = self.span.x - x;
        let to = from + sources.len();
        out[..from].copy_from_slice(&straight[..from]);
        out[to..].copy_from_slice(&straight[to..]);
        dispatch!(Level::new(), _simd => read(sources, values, here + from, width, &mut out[from..to]));
    }
}

/// Values at the sources of pixels from the one at the index `here` on.
#[inline(always)]
fn read<T: Blend>(sources: &[Source], values: &[T], here: usize, width: usize, out: &mut [T]) {
    for (index, (source, out)) in sources.iter().zip(out).enumerate() {
        *out = source.read(values, here + index, width);
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
        share.fma(other - self, self)
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
#[derive(Clone, Copy, Default)]
struct Source {
    /// Index of the upper left one.
    first: u32,
    /// Which of the four do not count, a bit each, row after row: in their stead does what is straight behind.
    hidden: u32,
    shares: [f32; 2],
}

/// All four pixels are hidden.
const ALL_HIDDEN: u32 = 0b1111;

impl Source {
    /// The value there, for the pixel at the index `here` of a picture `width` pixels wide.
    #[inline(always)]
    fn read<T: Blend>(&self, values: &[T], here: usize, width: usize) -> T {
        let first = self.first as usize;
        let [across, down] = self.shares;
        if self.hidden == 0 {
            let (upper, lower) = (&values[first..first + 2], &values[first + width..first + width + 2]);
            return upper[0].blend(upper[1], across).blend(lower[0].blend(lower[1], across), down);
        }
        let straight = values[here];
        if self.hidden == ALL_HIDDEN {
            return straight;
        }
        let at = |corner: u32, index: usize| if self.hidden >> corner & 1 == 0 { values[index] } else { straight };
        let upper = at(0, first).blend(at(1, first + 1), across);
        upper.blend(at(2, first + width).blend(at(3, first + width + 1), across), down)
    }
}

impl Bend<'_> {
    /// Where the light of the pixels of row `y` from column `first` on comes from, at most from the edge of the picture.
    #[inline(always)]
    fn trace_row(&self, first: usize, y: usize, size: [usize; 2], depth: Option<&[f32]>, sources: &mut [Source]) {
        let rect = self.air.rect;
        let angles = &self.air.angle.row(y - rect.y)[first - rect.x..][..sources.len()];
        let start = y * size[0] + first;
        match depth {
            None => {
                for (index, (source, angle)) in sources.iter_mut().zip(angles).enumerate() {
                    *source = self.source(first + index, y, *angle, self.focal_pixels, size);
                }
            }
            Some(depth) => {
                for (index, (source, angle)) in sources.iter_mut().zip(angles).enumerate() {
                    // 1 where nothing is known to be.
                    let lever = 1.0 - self.air.depth as f32 / depth[start + index];
                    *source = self.source(first + index, y, *angle, self.focal_pixels * lever, size);
                    source.hidden |= if lever > 0.0 { self.nearer(source, depth, size[0]) } else { ALL_HIDDEN };
                }
            }
        }
    }

    /// Where the light of a pixel comes from that is bent by `angle`, `reach` pixels before what is behind.
    #[inline(always)]
    fn source(&self, x: usize, y: usize, [right, up]: [f32; 2], reach: f32, [width, height]: [usize; 2]) -> Source {
        let (column, across) = split(reach.fma(right, x as f32), width);
        let (row, down) = split((-reach).fma(up, y as f32), height);
        // A picture of one column or row has nothing beside it.
        let beside = if width < 2 { 0b1010 } else { 0 } | if height < 2 { 0b1100 } else { 0 };
        let hidden = if right == 0.0 && up == 0.0 { ALL_HIDDEN } else { beside };
        Source { first: row * width as u32 + column, hidden, shares: [across, down] }
    }

    /// Which of the four pixels of a source are nearer than the air: no such light comes through it.
    #[inline(always)]
    fn nearer(&self, source: &Source, depth: &[f32], width: usize) -> u32 {
        let first = source.first as usize;
        let mut nearer = 0;
        for (corner, index) in [first, first + 1, first + width, first + width + 1].into_iter().enumerate() {
            let is_nearer = depth.get(index).is_some_and(|depth| *depth < self.air.depth as f32);
            nearer |= u32::from(is_nearer) << corner;
        }
        nearer
    }
}

/// Whole part and fraction of a place held within so many pixels: so that there is a pixel after the whole part, if there are two.
#[inline(always)]
fn split(place: f32, side: usize) -> (u32, f32) {
    let place = place.max(0.0).min((side - 1) as f32);
    let whole = place.floor().min(side.saturating_sub(2) as f32);
    (approximations::round_to_i32(whole).cast_unsigned(), place - whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture 3 pixels wide and 2 high, bent at a depth of 2 m by the same angle everywhere.
    fn read(angle: [f32; 2], depth: Option<&[f32]>, x: usize, y: usize) -> f32 {
        let values = [0.0, 1.0, 2.0, 10.0, 11.0, 12.0];
        let angles = Image::filled(3, 2, angle);
        let air = Deflection { depth: 2.0, rect: Rect::from_size(3, 2), angle: &angles };
        let mut row = [Source::default(); 3];
        Bend { air, focal_pixels: 1.0 }.trace_row(0, y, [3, 2], depth, &mut row);
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
    fn pictures_of_one_column_or_row_bend_along_it() {
        for (size, angle) in [([1, 3], [0.0, -0.5]), ([3, 1], [0.5, 0.0])] {
            let angles = Image::filled(size[0], size[1], angle);
            let air = Deflection { depth: 2.0, rect: Rect::from_size(size[0], size[1]), angle: &angles };
            let mut sources = Sources::default();
            let color = Image::from_pixels(size[0], size[1], [1.0, 2.0, 4.0].map(|v| [v; 4]).to_vec()).unwrap();
            let bend = Some(Bend { air, focal_pixels: 1.0 });
            let behind = Behind { color: Some(&color), depth: None, channels: &[], bend };
            behind.trace(Rect::from_size(size[0], size[1]), &mut sources);
            let seen = behind.plane(&[1.0, 2.0, 4.0], Rect::from_size(size[0], size[1]), &sources, size[0]);
            assert_eq!(seen, [1.5, 3.0, 4.0], "{size:?}");
        }
    }

    #[test]
    fn only_pixels_behind_the_air_are_looked_up_elsewhere() {
        let angles = Image::filled(1, 1, [1.0, 0.0]);
        let air = Deflection { depth: 2.0, rect: Rect { x: 1, y: 1, width: 1, height: 1 }, angle: &angles };
        let color = Image::from_pixels(3, 2, (0..6_u8).map(|v| [f32::from(v); 4]).collect()).unwrap();
        let behind =
            Behind { color: Some(&color), depth: None, channels: &[], bend: Some(Bend { air, focal_pixels: 1.0 }) };
        let (mut sources, mut buffer) = (Sources::default(), Vec::new());
        let rect = Rect { x: 0, y: 0, width: 3, height: 2 };
        behind.trace(rect, &mut sources);
        let mut row =
            |row| behind.color_row(rect, row, &sources, &mut buffer).unwrap().iter().map(|c| c[0]).collect::<Vec<_>>();
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
