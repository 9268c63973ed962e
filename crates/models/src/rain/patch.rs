//! The part of a picture that streaks are laid into at a time.

use bansho_base::{canvas::GrayPlanes, image::Rect};

use super::bands::BAND;

/// Columns of a patch: its pixels and their depths fit into a core's first cache.
pub(crate) const STRETCH: usize = 128;

/// Eight rows of so many columns. Light and what is let through stand side by side, so that one instruction lays a streak over all four.
pub(crate) struct Patch {
    /// Its first column and row in the picture.
    origin: [usize; 2],
    /// Red, green and blue of L, and T.
    pixels: [[[f32; 4]; STRETCH]; BAND],
    /// Depth of the nearest sample, m.
    depth: [[f32; STRETCH]; BAND],
    /// Depth of the plate, m; where there is none, it is not asked for.
    plate_depth: [[f32; STRETCH]; BAND],
    has_plate: bool,
}

/// What is laid over the pixels of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layer {
    /// Radiance where it hides all, ACEScg, cd/m^2; and -1, as much as T changes by there.
    light: [f32; 4],
    /// m.
    pub(crate) depth: f32,
}

impl Layer {
    /// A dark one.
    pub(crate) fn new(depth: f32) -> Self {
        Self { light: [0.0, 0.0, 0.0, -1.0], depth }
    }

    /// Adds radiance where it hides all, ACEScg, cd/m^2.
    pub(crate) fn add_light(&mut self, light: [f32; 3]) {
        (0..3).for_each(|c| self.light[c] += light[c]);
    }
}

impl Default for Patch {
    fn default() -> Self {
        Self {
            origin: [0; 2],
            pixels: [[[0.0; 4]; STRETCH]; BAND],
            depth: [[0.0; STRETCH]; BAND],
            plate_depth: [[0.0; STRETCH]; BAND],
            has_plate: false,
        }
    }
}

impl Patch {
    /// Takes the pixels of `rect` from the planes of `strip`; those around it hold anything.
    #[inline(always)]
    pub(crate) fn load(&mut self, origin: [usize; 2], rect: Rect, strip: Rect, planes: &GrayPlanes) {
        self.origin = origin;
        self.has_plate = !planes.plate_depth.is_empty();
        let [red, green, blue] = &planes.radiance;
        for Run { row, column, start, count } in self.runs(rect, strip) {
            let pixels = self.pixels[row][column..][..count].iter_mut();
            let light = red[start..][..count].iter().zip(&green[start..][..count]).zip(&blue[start..][..count]);
            for ((pixel, ((red, green), blue)), through) in
                pixels.zip(light).zip(&planes.transmittance[start..][..count])
            {
                *pixel = [*red, *green, *blue, *through];
            }
            self.depth[row][column..][..count].copy_from_slice(&planes.depth[start..][..count]);
            if self.has_plate {
                self.plate_depth[row][column..][..count].copy_from_slice(&planes.plate_depth[start..][..count]);
            }
        }
    }

    /// Gives the pixels of `rect` back to the planes of `strip`.
    #[inline(always)]
    pub(crate) fn store(&self, rect: Rect, strip: Rect, planes: &mut GrayPlanes) {
        for Run { row, column, start, count } in self.runs(rect, strip) {
            let pixels = &self.pixels[row][column..][..count];
            for (c, plane) in planes.radiance.iter_mut().enumerate() {
                plane[start..][..count].iter_mut().zip(pixels).for_each(|(value, pixel)| *value = pixel[c]);
            }
            let through = &mut planes.transmittance[start..][..count];
            through.iter_mut().zip(pixels).for_each(|(value, pixel)| *value = pixel[3]);
            planes.depth[start..][..count].copy_from_slice(&self.depth[row][column..][..count]);
        }
    }

    /// Where the rows of `rect` lie in the patch and in a strip.
    #[inline(always)]
    fn runs(&self, rect: Rect, strip: Rect) -> impl Iterator<Item = Run> + use<> {
        let [x, y] = self.origin;
        (rect.y..rect.bottom()).map(move |row| Run {
            row: row - y,
            column: rect.x - x,
            start: (row - strip.y) * strip.width + rect.x - strip.x,
            count: rect.width,
        })
    }

    /// Its first column and row in the picture.
    pub(crate) fn origin(&self) -> [usize; 2] {
        self.origin
    }

    /// Whether there is a plate.
    #[inline(always)]
    pub(crate) fn has_plate(&self) -> bool {
        self.has_plate
    }

    /// Whether a pixel is one of the patch's: places before its first column or row count as far beyond its last.
    #[inline(always)]
    pub(crate) fn holds(&self, [column, row]: [usize; 2]) -> bool {
        column < STRETCH && row < BAND
    }

    /// Whether the plate hides what lies at a depth in a pixel of the patch.
    pub(crate) fn hides(&self, [column, row]: [usize; 2], depth: f32) -> bool {
        self.plate_depth.get(row).and_then(|row| row.get(column)).is_some_and(|plate| *plate <= depth)
    }

    /// Lays a layer of some opacity behind what a pixel holds, `L += T a l; T -= T a`; `depth` is the layer's, infinite where the opacity
    /// is 0. Outside the patch there is nothing.
    #[inline(always)]
    pub(crate) fn put_behind(&mut self, [column, row]: [usize; 2], opacity: f32, depth: f32, layer: &Layer) {
        let Some(pixel) = self.pixels.get_mut(row).and_then(|row| row.get_mut(column)) else { return };
        let hidden = pixel[3] * opacity;
        for c in 0..4 {
            pixel[c] = hidden.mul_add(layer.light[c], pixel[c]);
        }
        let nearest = &mut self.depth[row][column];
        *nearest = if depth < *nearest { depth } else { *nearest };
    }
}

/// A row of pixels: in the patch, and in a strip's planes.
struct Run {
    row: usize,
    column: usize,
    start: usize,
    count: usize,
}
