//! The window's pixels in tiles, each with a hash of all that touches it: tiles whose hash stays are not painted again.

use rayon::prelude::*;

use super::{
    primitives::{Piece, Shape, hashed},
    raster::{ACROSS, Pixels, hides},
    textures::Textures,
    triangle::SUBPIXELS,
};

/// Pixels of a tile down.
const DOWN: usize = 32;

/// Where fewer tiles change, waking other threads takes longer than painting.
const FEW: usize = 4;

/// Pixels of the window, from the first to before the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    /// The first column.
    pub left: i32,
    /// The first row.
    pub top: i32,
    /// Before it the last column.
    pub right: i32,
    /// Before it the last row.
    pub bottom: i32,
}

impl Area {
    /// Whether there is no pixel in it.
    pub fn is_empty(self) -> bool {
        self.left >= self.right || self.top >= self.bottom
    }

    /// Pixels whose middles lie from `low` to before `high`, subpixels.
    pub(super) fn between(low: [i32; 2], high: [i32; 2]) -> Self {
        let first = |at: i32| (at - SUBPIXELS / 2 + SUBPIXELS - 1).div_euclid(SUBPIXELS);
        let ([left, top], [right, bottom]) = (low.map(first), high.map(first));
        Self { left, top, right, bottom }
    }

    /// What lies in both.
    pub(super) fn within(self, other: Self) -> Self {
        Self {
            left: self.left.max(other.left),
            top: self.top.max(other.top),
            right: self.right.min(other.right),
            bottom: self.bottom.min(other.bottom),
        }
    }

    pub(super) fn words(self) -> [u64; 2] {
        let pair = |a: i32, b: i32| u64::from(a as u32) << 32 | u64::from(b as u32);
        [pair(self.left, self.top), pair(self.right, self.bottom)]
    }
}

/// All tiles of a window.
#[derive(Default)]
pub(super) struct Canvas {
    size: [i32; 2],
    /// Tiles across.
    across: usize,
    tiles: Vec<Tile>,
}

struct Tile {
    area: Area,
    pixels: Vec<u32>,
    /// What is painted; nothing at first.
    painted: Option<u64>,
    /// What is to be painted.
    wanted: u64,
    /// Texels that it shows changed since it was painted.
    stale: bool,
    /// Numbers of the pieces that touch it.
    pieces: Vec<u32>,
}

impl Canvas {
    /// Paints `pieces` over black where they changed, or everything where `size` did; what was painted.
    pub(super) fn paint(
        &mut self,
        size: [i32; 2],
        pieces: &[Piece],
        textures: &Textures,
        pool: Option<&rayon::ThreadPool>,
    ) -> Vec<Area> {
        if self.size != size {
            self.resize(size);
        }
        self.sort(pieces, textures);
        let mut changed: Vec<&mut Tile> = Vec::new();
        for tile in &mut self.tiles {
            if tile.stale || tile.painted != Some(tile.wanted) {
                changed.push(tile);
            }
        }
        let areas = changed.iter().map(|tile| tile.area).collect();
        match pool {
            Some(pool) if changed.len() >= FEW => {
                pool.install(|| changed.into_par_iter().for_each(|tile| tile.paint(pieces, textures)));
            }
            _ => changed.into_iter().for_each(|tile| tile.paint(pieces, textures)),
        }
        joined(areas)
    }

    fn resize(&mut self, size: [i32; 2]) {
        let [width, height] = size.map(|side| side.max(0));
        self.size = [width, height];
        self.tiles.clear();
        for top in (0..height).step_by(DOWN) {
            for left in (0..width).step_by(ACROSS) {
                let (right, bottom) = ((left + ACROSS as i32).min(width), (top + DOWN as i32).min(height));
                let pixels = vec![0; ACROSS * DOWN];
                let area = Area { left, top, right, bottom };
                self.tiles.push(Tile { area, pixels, painted: None, wanted: 0, stale: false, pieces: Vec::new() });
            }
        }
        self.across = (width as usize).div_ceil(ACROSS);
    }

    /// Tells every tile what touches it.
    fn sort(&mut self, pieces: &[Piece], textures: &Textures) {
        for tile in &mut self.tiles {
            tile.pieces.clear();
            tile.wanted = 0;
        }
        for (number, piece) in pieces.iter().enumerate() {
            for tile in self.touched(piece.area) {
                let tile = &mut self.tiles[tile];
                tile.wanted = hashed(tile.wanted, [piece.hash]);
                tile.stale = tile.stale || has_changed(piece, tile.area, textures);
                tile.pieces.push(number as u32);
            }
        }
    }

    /// The tiles that `area`, which lies in the window and is not empty, has a part in.
    fn touched(&self, area: Area) -> impl Iterator<Item = usize> + use<> {
        let columns = area.left as usize / ACROSS..=(area.right as usize - 1) / ACROSS;
        let rows = area.top as usize / DOWN..=(area.bottom as usize - 1) / DOWN;
        let across = self.across;
        rows.flat_map(move |row| columns.clone().map(move |column| row * across + column))
    }

    /// Copies the pixels of `area`, as far as there are, into `into`, whose rows have `stride` pixels.
    pub(super) fn copy(&self, area: Area, into: &mut [u32], stride: usize) {
        let [right, bottom] = self.size;
        let area = area.within(Area { left: 0, top: 0, right, bottom });
        if area.is_empty() {
            return;
        }
        for tile in self.touched(area) {
            let tile = &self.tiles[tile];
            let part = area.within(tile.area);
            for y in part.top..part.bottom {
                let from = (y - tile.area.top) as usize * ACROSS + (part.left - tile.area.left) as usize;
                let row = &tile.pixels[from..][..(part.right - part.left) as usize];
                let to = y as usize * stride + part.left as usize;
                if let Some(place) = into.get_mut(to..to + row.len()) {
                    place.copy_from_slice(row);
                }
            }
        }
    }
}

impl Tile {
    fn paint(&mut self, pieces: &[Piece], textures: &Textures) {
        let piece = |number: &u32| &pieces[*number as usize];
        let hidden = self.pieces.iter().rposition(|number| hides(piece(number), self.area, textures));
        let mut pixels = Pixels { area: self.area, rows: &mut self.pixels };
        if hidden.is_none() {
            pixels.clear();
        }
        for number in &self.pieces[hidden.unwrap_or(0)..] {
            pixels.paint(piece(number), textures);
        }
        (self.painted, self.stale) = (Some(self.wanted), false);
    }
}

/// Whether texels changed that `piece` shows in `area`.
fn has_changed(piece: &Piece, area: Area, textures: &Textures) -> bool {
    let (Shape::Texels { texture, .. } | Shape::Picture { texture, .. } | Shape::Triangle { texture, .. }) =
        piece.shape
    else {
        return false;
    };
    let Some(texture) = textures.get(texture) else { return false };
    let part = piece.area.within(area);
    let ends = [[part.left, part.top], [part.right - 1, part.bottom - 1]];
    match piece.shape {
        Shape::Fill(_) => false,
        Shape::Texels { origin, .. } => {
            let texel = |end: [i32; 2], axis: usize| (i64::from(end[axis]) + origin[axis]) as f32;
            texture.has_changed(ends.map(|end| [0, 1].map(|axis| texel(end, axis))), 0.0)
        }
        // What is mixed has a part of its neighbours.
        Shape::Picture { from, step, .. } => {
            let place = |end: [i32; 2], axis: usize| (from[axis] + f64::from(end[axis]) * step[axis]) as f32;
            texture.has_changed(ends.map(|end| [0, 1].map(|axis| place(end, axis))), 1.0)
        }
        Shape::Triangle { triangle, .. } => texture.has_changed(triangle.texels, 1.0),
    }
}

/// Neighbours in a row joined, and rows of the same columns one below the other.
fn joined(areas: Vec<Area>) -> Vec<Area> {
    let mut rows: Vec<Area> = Vec::new();
    for area in areas {
        match rows.last_mut() {
            Some(last) if last.top == area.top && last.right == area.left => last.right = area.right,
            _ => rows.push(area),
        }
    }
    let mut all: Vec<Area> = Vec::new();
    for row in rows {
        let above = |area: &&mut Area| area.bottom == row.top && (area.left, area.right) == (row.left, row.right);
        match all.iter_mut().rev().find(above) {
            Some(area) => area.bottom = row.bottom,
            None => all.push(row),
        }
    }
    all
}
