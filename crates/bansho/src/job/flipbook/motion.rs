//! One frame of a flipbook, and how its pixels move to the next.

use bansho_base::{
    color,
    frame::{DisplayImage, Frame, FrameHeader},
    host::observer::Observer,
    image::Image,
};

use super::files::Files;

/// What a sheet needs of a frame.
pub(crate) struct Tile {
    pub(crate) header: FrameHeader,
    pub(crate) color: Color,
    /// Pixels to the right and down until the next frame.
    pub(crate) motion: Image<2>,
    pub(crate) has_motion: bool,
}

/// A frame's colors as its format keeps them.
pub(crate) enum Color {
    Shown(DisplayImage),
    Linear(Image<4>),
}

impl Tile {
    pub(crate) fn of(frame: &Frame, files: &Files, observer: &dyn Observer) -> Self {
        let fields = fields(frame);
        let (width, height) = (frame.beauty.width(), frame.beauty.height());
        let motion = (0..width * height).map(|index| mean(&fields, index)).collect();
        Self {
            has_motion: !fields.is_empty(),
            motion: Image::from_pixels(width, height, motion).unwrap_or_else(|| Image::filled(width, height, [0.0; 2])),
            header: frame.header.clone(),
            color: files.color(frame, observer),
        }
    }
}

/// The motion of one phenomenon, and its layer.
struct Field<'a> {
    motion: [&'a [f32]; 2],
    layer: [&'a [f32]; 4],
}

fn fields(frame: &Frame) -> Vec<Field<'_>> {
    let plane = |name: String| {
        frame.channels.iter().find(|channel| channel.name == name).map(|channel| channel.values.as_slice())
    };
    let of_phenomenon = |name: &str| {
        let [x, y] = ["motion.X", "motion.Y"].map(|axis| plane(format!("{name}.{axis}")));
        let [r, g, b, a] = ["R", "G", "B", "A"].map(|channel| plane(format!("{name}.{channel}")));
        Some(Field { motion: [x?, y?], layer: [r?, g?, b?, a?] })
    };
    let names = frame.channels.iter().filter_map(|channel| channel.name.strip_suffix(".motion.X"));
    names.filter_map(of_phenomenon).collect()
}

/// The mean motion at a pixel, each phenomenon weighted by what is seen of it: its light and its alpha.
fn mean(fields: &[Field], index: usize) -> [f32; 2] {
    let mut sum = [0.0; 2];
    let mut weights = 0.0;
    for Field { motion, layer: [r, g, b, a] } in fields {
        let weight = color::luminance([r[index], g[index], b[index]]).max(0.0) + a[index].max(0.0);
        weights += weight;
        (0..2).for_each(|axis| sum[axis] += weight * motion[axis][index]);
    }
    if weights > 0.0 { sum.map(|sum| sum / weights) } else { [0.0; 2] }
}

/// The largest motion along either axis in any frame, pixels; 1 where nothing moves.
pub(crate) fn scale(tiles: &[Tile]) -> f32 {
    let largest = tiles.iter().flat_map(|tile| tile.motion.pixels().as_flattened());
    let largest = largest.fold(0.0_f32, |largest, value| largest.max(value.abs()));
    if largest > 0.0 { largest } else { 1.0 }
}

/// Code of no motion.
pub(crate) const MIDDLE: u16 = 1 << 15;
/// Codes from no motion to the largest.
pub(crate) const REACH: u16 = MIDDLE - 1;

/// Motion in 16 bits: red to the right, green down, [`MIDDLE`] for none.
pub(crate) fn coded(motion: [f32; 2], scale: f32) -> [u16; 4] {
    let code = |value: f32| {
        let steps = (value / scale).clamp(-1.0, 1.0) * f32::from(REACH);
        (i32::from(MIDDLE) + steps.round() as i32) as u16
    };
    [code(motion[0]), code(motion[1]), 0, u16::MAX]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_motion_is_the_middle_and_the_largest_reaches_the_ends() {
        assert_eq!(coded([0.0, 0.0], 3.0), [32_768, 32_768, 0, 65_535]);
        assert_eq!(coded([3.0, -3.0], 3.0), [65_535, 1, 0, 65_535]);
        assert_eq!(coded([1.5, -9.0], 3.0), [49_152, 1, 0, 65_535]);
    }

    #[test]
    fn motion_is_weighted_by_what_is_seen() {
        let (still, moving, none, one) = ([0.0], [4.0], [0.0], [1.0]);
        let smoke = Field { motion: [&moving, &still], layer: [&none, &none, &none, &one] };
        let dark = Field { motion: [&still, &moving], layer: [&none, &none, &none, &none] };
        assert_eq!(mean(&[smoke, dark], 0), [4.0, 0.0]);
        let flame = || Field { motion: [&still, &moving], layer: [&one, &one, &one, &none] };
        let smoke = Field { motion: [&moving, &still], layer: [&none, &none, &none, &one] };
        let mixed = mean(&[smoke, flame()], 0);
        assert!((mixed[0] - 2.0).abs() < 1e-5 && (mixed[1] - 2.0).abs() < 1e-5, "{mixed:?}");
        assert_eq!(mean(&[], 0), [0.0; 2]);
    }
}
