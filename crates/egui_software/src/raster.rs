//! Paints primitives into a tile, row by row.

use egui::Color32;

use super::{
    blend::{Rgba, blend_over, blend_over_f32, blend_tinted_over, pack_xrgb},
    pixel_rect::PixelRect,
    primitives::{DrawPrimitive, PrimitiveShape, TexelMapping},
    textures::{FilterTaps, Texture, Textures},
    triangle::{Triangle, TriangleColoring},
};

/// Width of a tile, pixels.
pub(super) const TILE_WIDTH: usize = 64;

const WHITE: Rgba = [255; 4];

/// The pixels of one tile, in rows of [`TILE_WIDTH`].
pub(super) struct TilePixels<'a> {
    pub(super) area: PixelRect,
    pub(super) rows: &'a mut [u32],
}

impl TilePixels<'_> {
    /// Pixels `from..to` of row `y`, which must lie in the tile.
    fn row(&mut self, y: i32, from: i32, to: i32) -> &mut [u32] {
        let start = (y - self.area.top) as usize * TILE_WIDTH;
        &mut self.rows[start..][(from - self.area.left) as usize..(to - self.area.left) as usize]
    }

    pub(super) fn clear(&mut self) {
        self.rows.fill(0);
    }

    /// Paints the part of `primitive` that lies in this tile.
    pub(super) fn paint(&mut self, primitive: &DrawPrimitive, textures: &Textures) {
        let area = primitive.area.within(self.area);
        if area.is_empty() {
            return;
        }
        match &primitive.shape {
            PrimitiveShape::Fill(color) => {
                for y in area.top..area.bottom {
                    fill(self.row(y, area.left, area.right), *color);
                }
            }
            PrimitiveShape::Texels { texture, origin, tint } => {
                if let Some(texture) = textures.get(*texture) {
                    self.texels(area, texture, *origin, *tint);
                }
            }
            PrimitiveShape::Picture { texture, mapping, tint } => {
                if let Some(texture) = textures.get(*texture) {
                    self.picture(area, texture, mapping, *tint);
                }
            }
            PrimitiveShape::Triangle { texture, triangle } => {
                if let Some(texture) = textures.get(*texture) {
                    self.triangle(area, triangle, texture);
                }
            }
        }
    }

    fn texels(&mut self, area: PixelRect, texture: &Texture, origin: [i64; 2], tint: Rgba) {
        let width = area.right - area.left;
        let first = texel_of(area.left, origin[0]);
        let within = first >= 0 && (first + width) as usize <= texture.size()[0];
        let plain = tint == WHITE && texture.is_opaque();
        for y in area.top..area.bottom {
            let from = texture.row(texture.wrap(texel_of(y, origin[1]), 1));
            let row = self.row(y, area.left, area.right);
            if within {
                let from = &from[first as usize..][..row.len()];
                if plain { copy(row, from) } else { blend_row(row, from, tint) }
            } else {
                for (x, pixel) in row.iter_mut().enumerate() {
                    let color = from[texture.wrap(first + x as i32, 0)];
                    *pixel = blend_tinted_over(*pixel, color.to_array(), tint);
                }
            }
        }
    }

    fn picture(&mut self, area: PixelRect, texture: &Texture, mapping: &TexelMapping, tint: Rgba) {
        let mut columns = [FilterTaps::default(); TILE_WIDTH];
        for (column, x) in columns.iter_mut().zip(area.left..area.right) {
            *column = texture.taps(mapping.texel(x, 0), 0);
        }
        let plain = tint == WHITE && texture.is_opaque();
        for y in area.top..area.bottom {
            let rows = texture.taps(mapping.texel(y, 1), 1);
            let pixels = self.row(y, area.left, area.right);
            if plain {
                copy_bilinear_row(pixels, &columns, rows, texture);
            } else {
                for (pixel, column) in pixels.iter_mut().zip(&columns) {
                    *pixel = blend_over_f32(*pixel, tinted(texture.bilinear(*column, rows), tint.map(f32::from)));
                }
            }
        }
    }

    fn triangle(&mut self, area: PixelRect, triangle: &Triangle, texture: &Texture) {
        let coverage = triangle.coverage();
        if let TriangleColoring::Plain(color) = triangle.color {
            for y in area.top..area.bottom {
                let [from, to] = coverage.span(y, area.left, area.right);
                fill(self.row(y, from, to), color);
            }
            return;
        }
        let colors = [0, 1, 2, 3].map(|c| triangle.plane(|corner| f32::from(corner.color[c])));
        let coordinates = [0, 1].map(|axis| triangle.plane(|corner| corner.texel[axis]));
        for y in area.top..area.bottom {
            let [from, to] = coverage.span(y, area.left, area.right);
            if from >= to {
                continue;
            }
            let colors = colors.map(|plane| plane.row(from, y));
            let coordinates = coordinates.map(|plane| plane.row(from, y));
            for (x, pixel) in self.row(y, from, to).iter_mut().enumerate() {
                let x = x as f32;
                let texel = match triangle.color {
                    TriangleColoring::Plain(texel) | TriangleColoring::Blended(texel) => texel.map(f32::from),
                    TriangleColoring::Textured => texture.at(coordinates.map(|[start, step]| start + x * step)),
                };
                // Rounding errors may exceed the range.
                let color = colors.map(|[start, step]| (start + x * step).clamp(0.0, 255.0));
                *pixel = blend_over_f32(*pixel, tinted(texel, color));
            }
        }
    }
}

/// Whether `primitive` is opaque everywhere in `area`, so that all primitives below it can be skipped.
pub(super) fn occludes(primitive: &DrawPrimitive, area: PixelRect, textures: &Textures) -> bool {
    if primitive.area.within(area) != area {
        return false;
    }
    match &primitive.shape {
        PrimitiveShape::Fill(color) => color[3] == 255,
        PrimitiveShape::Texels { texture, tint, .. } | PrimitiveShape::Picture { texture, tint, .. } => {
            tint[3] == 255 && textures.get(*texture).is_some_and(Texture::is_opaque)
        }
        PrimitiveShape::Triangle { triangle, .. } => {
            matches!(triangle.color, TriangleColoring::Plain([.., 255])) && triangle.coverage().contains_rect(area)
        }
    }
}

fn tinted(texel: [f32; 4], tint: [f32; 4]) -> [f32; 4] {
    let mut product = texel;
    for c in 0..4 {
        product[c] *= tint[c] * (1.0 / 255.0);
    }
    product
}

fn fill(row: &mut [u32], color: Rgba) {
    if color[3] == 255 {
        row.fill(pack_xrgb(color));
        return;
    }
    for pixel in row {
        *pixel = blend_over(*pixel, color);
    }
}

fn copy(row: &mut [u32], texels: &[Color32]) {
    for (pixel, texel) in row.iter_mut().zip(texels) {
        *pixel = pack_xrgb(texel.to_array());
    }
}

fn blend_row(row: &mut [u32], texels: &[Color32], tint: Rgba) {
    for (pixel, texel) in row.iter_mut().zip(texels) {
        // Most texels of a glyph's rectangle are transparent.
        if *texel != Color32::TRANSPARENT {
            *pixel = blend_tinted_over(*pixel, texel.to_array(), tint);
        }
    }
}

/// Copies a row of a scaled opaque image, bilinearly filtered.
fn copy_bilinear_row(pixels: &mut [u32], columns: &[FilterTaps; TILE_WIDTH], rows: FilterTaps, texture: &Texture) {
    for (pixel, column) in pixels.iter_mut().zip(columns) {
        let color = texture.bilinear(*column, rows).map(|channel| (channel + 0.5) as u8);
        *pixel = pack_xrgb(color);
    }
}

/// The texel of a pixel along one axis, where pixel 0 has the texel `origin`. It is clamped, so that sums of texels and pixels cannot overflow; texels outside
/// of the texture are wrapped.
fn texel_of(pixel: i32, origin: i64) -> i32 {
    (i64::from(pixel) + origin).clamp(-1 << 30, 1 << 30) as i32
}
