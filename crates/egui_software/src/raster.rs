//! Pieces painted into a tile: pixels of a rectangle of the window, row by row.

use egui::Color32;

use super::{
    blend::{Rgba, exactly_over, over, packed, tinted_over},
    primitives::{Piece, Shape},
    textures::{Taps, Texture, Textures},
    tiles::Area,
    triangle::{Colour, Triangle},
};

/// Pixels of a tile across: no row of one is longer.
pub(super) const ACROSS: usize = 64;

const WHITE: Rgba = [255; 4];

/// Part of the window's pixels, all of `area`, in rows of [`ACROSS`].
pub(super) struct Pixels<'a> {
    pub(super) area: Area,
    pub(super) rows: &'a mut [u32],
}

impl Pixels<'_> {
    /// Pixels `from..to` of row `y`, which lie within.
    fn row(&mut self, y: i32, from: i32, to: i32) -> &mut [u32] {
        let start = (y - self.area.top) as usize * ACROSS;
        &mut self.rows[start..][(from - self.area.left) as usize..(to - self.area.left) as usize]
    }

    pub(super) fn clear(&mut self) {
        self.rows.fill(0);
    }

    /// Paints what of `piece` lies here.
    pub(super) fn paint(&mut self, piece: &Piece, textures: &Textures) {
        let area = piece.area.within(self.area);
        if area.is_empty() {
            return;
        }
        match &piece.shape {
            Shape::Fill(colour) => {
                for y in area.top..area.bottom {
                    fill(self.row(y, area.left, area.right), *colour);
                }
            }
            Shape::Texels { texture, origin, tint } => {
                if let Some(texture) = textures.get(*texture) {
                    self.texels(area, texture, *origin, *tint);
                }
            }
            Shape::Picture { texture, from, step, tint } => {
                if let Some(texture) = textures.get(*texture) {
                    self.picture(area, texture, [*from, *step], *tint);
                }
            }
            Shape::Triangle { texture, triangle } => {
                if let Some(texture) = textures.get(*texture) {
                    self.triangle(area, triangle, texture);
                }
            }
        }
    }

    fn texels(&mut self, area: Area, texture: &Texture, origin: [i64; 2], tint: Rgba) {
        let width = area.right - area.left;
        // What lies beyond the texture is repeated from within; saturates.
        let texel = |pixel: i32, axis: usize| (i64::from(pixel) + origin[axis]).clamp(-1 << 30, 1 << 30) as i32;
        let first = texel(area.left, 0);
        let within = first >= 0 && (first + width) as usize <= texture.size()[0];
        let plain = tint == WHITE && texture.is_opaque();
        for y in area.top..area.bottom {
            let from = texture.row(texture.wrapped(texel(y, 1), 1));
            let row = self.row(y, area.left, area.right);
            if within {
                let from = &from[first as usize..][..row.len()];
                if plain { copy(row, from) } else { lay(row, from, tint) }
            } else {
                for (x, pixel) in row.iter_mut().enumerate() {
                    let colour = from[texture.wrapped(first + x as i32, 0)];
                    *pixel = tinted_over(*pixel, colour.to_array(), tint);
                }
            }
        }
    }

    fn picture(&mut self, area: Area, texture: &Texture, [from, step]: [[f64; 2]; 2], tint: Rgba) {
        let place = |pixel: i32, axis: usize| (from[axis] + f64::from(pixel) * step[axis]) as f32;
        let mut columns = [Taps::default(); ACROSS];
        for (column, x) in columns.iter_mut().zip(area.left..area.right) {
            *column = texture.taps(place(x, 0), 0);
        }
        let plain = tint == WHITE && texture.is_opaque();
        for y in area.top..area.bottom {
            let rows = texture.taps(place(y, 1), 1);
            let pixels = self.row(y, area.left, area.right);
            if plain {
                mixed_row(pixels, &columns, rows, texture);
            } else {
                for (pixel, column) in pixels.iter_mut().zip(&columns) {
                    *pixel = exactly_over(*pixel, tinted(texture.mixed(*column, rows), tint.map(f32::from)));
                }
            }
        }
    }

    fn triangle(&mut self, area: Area, triangle: &Triangle, texture: &Texture) {
        let coverage = triangle.coverage();
        if let Colour::Plain(colour) = triangle.colour {
            for y in area.top..area.bottom {
                let [from, to] = coverage.span(y, area.left, area.right);
                fill(self.row(y, from, to), colour);
            }
            return;
        }
        let colours = [0, 1, 2, 3].map(|c| triangle.plane(|corner| f32::from(corner.colour[c])));
        let places = [0, 1].map(|axis| triangle.plane(|corner| corner.texel[axis]));
        for y in area.top..area.bottom {
            let [from, to] = coverage.span(y, area.left, area.right);
            if from >= to {
                continue;
            }
            let colours = colours.map(|plane| plane.row(from, y));
            let places = places.map(|plane| plane.row(from, y));
            for (x, pixel) in self.row(y, from, to).iter_mut().enumerate() {
                let at = |[start, step]: [f32; 2]| start + x as f32 * step;
                let texel = match triangle.colour {
                    Colour::Plain(texel) | Colour::Blended(texel) => texel.map(f32::from),
                    Colour::Textured => texture.at(places.map(at)),
                };
                // By rounding only they lie outside.
                let colour = colours.map(|channel| at(channel).clamp(0.0, 255.0));
                *pixel = exactly_over(*pixel, tinted(texel, colour));
            }
        }
    }
}

/// Whether `piece` hides all that lies below it in `area`.
pub(super) fn hides(piece: &Piece, area: Area, textures: &Textures) -> bool {
    if piece.area.within(area) != area {
        return false;
    }
    match &piece.shape {
        Shape::Fill(colour) => colour[3] == 255,
        Shape::Texels { texture, tint, .. } | Shape::Picture { texture, tint, .. } => {
            tint[3] == 255 && textures.get(*texture).is_some_and(Texture::is_opaque)
        }
        Shape::Triangle { triangle, .. } => {
            matches!(triangle.colour, Colour::Plain([.., 255])) && triangle.coverage().holds(area)
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

fn fill(row: &mut [u32], colour: Rgba) {
    if colour[3] == 255 {
        row.fill(packed(colour));
        return;
    }
    for pixel in row {
        *pixel = over(*pixel, colour);
    }
}

fn copy(row: &mut [u32], texels: &[Color32]) {
    for (pixel, texel) in row.iter_mut().zip(texels) {
        *pixel = packed(texel.to_array());
    }
}

fn lay(row: &mut [u32], texels: &[Color32], tint: Rgba) {
    for (pixel, texel) in row.iter_mut().zip(texels) {
        // Most of a letter's box is empty.
        if *texel != Color32::TRANSPARENT {
            *pixel = tinted_over(*pixel, texel.to_array(), tint);
        }
    }
}

/// A row of an opaque picture of another size.
fn mixed_row(pixels: &mut [u32], columns: &[Taps; ACROSS], rows: Taps, texture: &Texture) {
    for (pixel, column) in pixels.iter_mut().zip(columns) {
        let colour = texture.mixed(*column, rows).map(|channel| (channel + 0.5) as u8);
        *pixel = packed(colour);
    }
}
