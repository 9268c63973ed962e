//! Sheets that are small in the picture, whose structure is finer than its pixels: shaded in cells of the sheet, whose light is averaged over pixels.
//!
//! The threshold (5) and the color ramp are not linear. Light of a texture that was averaged first is not the average of the light: a flame of a few pixels
//! would lose most of it. So the light is averaged. Cells are fixed to the sheet, and the light of each is spread over the pixels in
//! proportion to the area that it covers in them. The sum over the picture is therefore that of a large picture, with every lens and at any position of the
//! flame relative to the pixels.

mod projected;

use bansho_base::{
    camera::{Camera, upright_quad::UprightQuad},
    math::DVec2,
};

pub(crate) use projected::{PATCHES, Projected, ProjectedCells};

/// Height up to which a sheet is drawn in cells, pixels. Above, one sample per pixel has the light of a large picture to two percent.
const SMALL_HEIGHT: f64 = 96.0;
/// The same for a texture or a field that is finer than the default one, at the most.
const MAX_SMALL_HEIGHT: f64 = 768.0;
/// Texels per pixel from which on a sheet is drawn in cells: low-pass filtered by more, a texture loses visible light.
const MAX_TEXELS_PER_PIXEL: f64 = 2.5;
/// Width up to which a sheet of any height is drawn in cells, pixels: narrow ones, and those that are seen nearly edge on.
const SMALL_WIDTH: f64 = 32.0;
/// Cells per pixel.
const CELLS_PER_PIXEL: f64 = 1.5;
/// Bounds of the smallest number of rows of cells, which is half of [`small_height`]: little less than the texture has where it is filtered for that height.
const MIN_ROWS: [f64; 2] = [64.0, 128.0];
/// Bounds of the number of columns across the sheet if they do not follow from its size in the picture.
const COLUMNS: [f64; 2] = [48.0, 512.0];

/// How finely a sheet is divided into cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SheetCells {
    /// Columns per sheet width.
    pub(crate) columns: usize,
    /// Rows up to `top`.
    pub(crate) rows: usize,
    /// Height up to which there are rows, sheet heights.
    pub(crate) top: f64,
}

/// What the number of cells depends on, besides the projection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellResolution {
    /// Texels of the texture per sheet height.
    pub(crate) texels_up: f64,
    /// Height of the flame as a fraction of that of the sheet, at most 1.
    pub(crate) top: f64,
}

/// Height in pixels up to which a sheet is drawn in cells, for a texture of so many texels per sheet height.
///
/// It is also the height for which the texture of smaller sheets is filtered, so that their light is that of a sheet of this height.
pub(crate) fn small_height(texels_up: f64) -> f64 {
    (texels_up / MAX_TEXELS_PER_PIXEL).clamp(SMALL_HEIGHT, MAX_SMALL_HEIGHT)
}

impl SheetCells {
    /// The cells of a sheet; `None` if it is so large in the picture that a sample per pixel is enough.
    pub(crate) fn new(camera: &Camera, quad: &UprightQuad, resolution: &CellResolution) -> Option<Self> {
        let camera = camera.with_unlimited_angle();
        let center = camera.project(quad.point(0.5, 0.5))?.pixel;
        let mut sides = [DVec2::ZERO; 4];
        for (side, [x, y]) in sides.iter_mut().zip([[0.5, 0.0], [0.5, 1.0], [0.0, 0.5], [1.0, 0.5]]) {
            *side = camera.nearest_repetition(camera.project(quad.point(x, y))?.pixel, center);
        }
        let [bottom, top, left, right] = sides;
        let up = (top - bottom).length() * resolution.top;
        let across = (right - left).length();
        let small_height = small_height(resolution.texels_up);
        if up >= small_height && across >= SMALL_WIDTH {
            return None;
        }
        let [least, most] = MIN_ROWS;
        let fewest = (0.5 * small_height).clamp(least, most);
        let rows = (CELLS_PER_PIXEL * up).max(fewest).ceil();
        let [least, most] = COLUMNS;
        let columns = (fewest * quad.size.x / quad.size.y).clamp(least, most).max(CELLS_PER_PIXEL * across).ceil();
        Some(Self { columns: columns as usize, rows: rows as usize, top: resolution.top })
    }

    /// Size of a cell in x' and in y, over which the flame's outline is antialiased.
    pub(crate) fn cell(&self) -> [f32; 2] {
        [(2.0 / self.columns as f64) as f32, (self.top / self.rows as f64) as f32]
    }
}
