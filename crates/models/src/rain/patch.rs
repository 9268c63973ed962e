//! The part of a picture that streaks are laid into at a time.

use bansho_base::{canvas::GrayPlanes, image::Rect};

use super::bands::BAND;

/// Columns of a patch: its pixels and their depths fit into a core's first cache.
pub(crate) const STRETCH: usize = 128;

/// A number for each of eight pixels that stand below each other.
pub(crate) type Rows = [f32; BAND];

/// Eight rows of so many columns. The pixels of a column stand side by side, so that one instruction lays a streak over all eight: most
/// streaks run down.
pub(crate) struct Patch {
    /// Its first column and row in the picture.
    origin: [usize; 2],
    columns: [Column; STRETCH],
    /// Depth of the plate by column, m; where there is none, it is not asked for.
    plate_depth: [Rows; STRETCH],
    has_plate: bool,
}

/// Eight pixels below each other.
#[derive(Clone, Copy)]
struct Column {
    /// L of red, green and blue.
    light: [Rows; 3],
    /// T.
    through: Rows,
    /// Depth of the nearest sample, m.
    depth: Rows,
}

/// What is laid over the pixels of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layer {
    /// Radiance where it hides all, ACEScg, cd/m^2.
    light: [f32; 3],
    /// m.
    pub(crate) depth: f32,
}

impl Layer {
    /// A dark one.
    pub(crate) fn new(depth: f32) -> Self {
        Self { light: [0.0; 3], depth }
    }

    /// Adds radiance where it hides all, ACEScg, cd/m^2.
    pub(crate) fn add_light(&mut self, light: [f32; 3]) {
        (0..3).for_each(|c| self.light[c] += light[c]);
    }
}

impl Default for Patch {
    fn default() -> Self {
        let column = Column { light: [[0.0; BAND]; 3], through: [0.0; BAND], depth: [0.0; BAND] };
        Self {
            origin: [0; 2],
            columns: [column; STRETCH],
            plate_depth: [[0.0; BAND]; STRETCH],
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
        for Run { row, column, start, count } in self.runs(rect, strip) {
            let columns = &mut self.columns[column..][..count];
            for (c, plane) in planes.radiance.iter().enumerate() {
                columns.iter_mut().zip(&plane[start..][..count]).for_each(|(to, from)| to.light[c][row] = *from);
            }
            let through = &planes.transmittance[start..][..count];
            columns.iter_mut().zip(through).for_each(|(to, from)| to.through[row] = *from);
            columns.iter_mut().zip(&planes.depth[start..][..count]).for_each(|(to, from)| to.depth[row] = *from);
            if self.has_plate {
                let depths = &planes.plate_depth[start..][..count];
                self.plate_depth[column..].iter_mut().zip(depths).for_each(|(to, from)| to[row] = *from);
            }
        }
    }

    /// Gives the pixels of `rect` back to the planes of `strip`.
    #[inline(always)]
    pub(crate) fn store(&self, rect: Rect, strip: Rect, planes: &mut GrayPlanes) {
        for Run { row, column, start, count } in self.runs(rect, strip) {
            let columns = &self.columns[column..][..count];
            for (c, plane) in planes.radiance.iter_mut().enumerate() {
                plane[start..][..count].iter_mut().zip(columns).for_each(|(to, from)| *to = from.light[c][row]);
            }
            let through = &mut planes.transmittance[start..][..count];
            through.iter_mut().zip(columns).for_each(|(to, from)| *to = from.through[row]);
            planes.depth[start..][..count].iter_mut().zip(columns).for_each(|(to, from)| *to = from.depth[row]);
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

    /// Takes from the opacities of a column's pixels those that the plate hides at a depth.
    #[inline(always)]
    pub(crate) fn hide_by_plate(&self, column: usize, depth: f32, opacities: &mut Rows) {
        if !self.has_plate {
            return;
        }
        let Some(plate) = self.plate_depth.get(column) else { return };
        for row in 0..BAND {
            opacities[row] = if plate[row] <= depth { 0.0 } else { opacities[row] };
        }
    }

    /// Lays a layer of some opacities behind what the pixels of a column hold, `L += T a l; T -= T a`.
    #[inline(always)]
    pub(crate) fn put_behind(&mut self, column: usize, opacities: &Rows, layer: &Layer) {
        let Some(pixels) = self.columns.get_mut(column) else { return };
        let mut hidden = [0.0; BAND];
        for row in 0..BAND {
            hidden[row] = pixels.through[row] * opacities[row];
        }
        for c in 0..3 {
            for row in 0..BAND {
                pixels.light[c][row] = hidden[row].mul_add(layer.light[c], pixels.light[c][row]);
            }
        }
        for row in 0..BAND {
            pixels.through[row] -= hidden[row];
            let depth = if opacities[row] > 0.0 { layer.depth } else { f32::INFINITY };
            pixels.depth[row] = if depth < pixels.depth[row] { depth } else { pixels.depth[row] };
        }
    }
}

/// A row of pixels: in the patch, and in a strip's planes.
struct Run {
    row: usize,
    column: usize,
    start: usize,
    count: usize,
}
