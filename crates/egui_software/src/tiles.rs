//! The framebuffer in tiles. Each tile keeps a hash of the primitives that touch it; a tile is repainted only where that hash changes.

use rayon::prelude::*;

use super::{
    pixel_rect::PixelRect,
    primitives::{DrawPrimitive, PrimitiveShape, mix_hash},
    raster::{TILE_WIDTH, TilePixels, occludes},
    textures::Textures,
};

/// Height of a tile, pixels.
const TILE_HEIGHT: usize = 32;

/// With fewer changed tiles than this, waking other threads takes longer than painting.
const PARALLEL_TILES_MIN: usize = 4;

/// All tiles of a framebuffer, row by row.
#[derive(Default)]
pub(super) struct FramebufferTiles {
    size: [i32; 2],
    /// Tiles per row.
    tiles_across: usize,
    tiles: Vec<Tile>,
}

struct Tile {
    area: PixelRect,
    pixels: Vec<u32>,
    /// The hash of what is painted; `None` at first.
    painted_hash: Option<u64>,
    /// The hash of this frame's primitives.
    pending_hash: u64,
    /// Whether texels in it changed since it was painted.
    stale: bool,
    /// Indices of the primitives that touch it.
    primitives: Vec<u32>,
}

impl FramebufferTiles {
    /// Paints `primitives` over black in the tiles that changed, or in all tiles where `size` changed. Returns the painted rectangles.
    pub(super) fn paint(
        &mut self,
        size: [i32; 2],
        primitives: &[DrawPrimitive],
        textures: &Textures,
        pool: Option<&rayon::ThreadPool>,
    ) -> Vec<PixelRect> {
        if self.size != size {
            self.resize(size);
        }
        self.bin(primitives, textures);
        let mut changed: Vec<&mut Tile> = Vec::new();
        for tile in &mut self.tiles {
            if tile.stale || tile.painted_hash != Some(tile.pending_hash) {
                changed.push(tile);
            }
        }
        let areas = changed.iter().map(|tile| tile.area).collect();
        match pool {
            Some(pool) if changed.len() >= PARALLEL_TILES_MIN => {
                pool.install(|| changed.into_par_iter().for_each(|tile| tile.paint(primitives, textures)));
            }
            _ => changed.into_iter().for_each(|tile| tile.paint(primitives, textures)),
        }
        merge_rects(areas)
    }

    fn resize(&mut self, size: [i32; 2]) {
        let [width, height] = size.map(|side| side.max(0));
        self.size = [width, height];
        self.tiles.clear();
        for top in (0..height).step_by(TILE_HEIGHT) {
            for left in (0..width).step_by(TILE_WIDTH) {
                let (right, bottom) = ((left + TILE_WIDTH as i32).min(width), (top + TILE_HEIGHT as i32).min(height));
                let pixels = vec![0; TILE_WIDTH * TILE_HEIGHT];
                let area = PixelRect { left, top, right, bottom };
                self.tiles.push(Tile {
                    area,
                    pixels,
                    painted_hash: None,
                    pending_hash: 0,
                    stale: false,
                    primitives: Vec::new(),
                });
            }
        }
        self.tiles_across = (width as usize).div_ceil(TILE_WIDTH);
    }

    /// Assigns each primitive to the tiles that it touches.
    fn bin(&mut self, primitives: &[DrawPrimitive], textures: &Textures) {
        for tile in &mut self.tiles {
            tile.primitives.clear();
            tile.pending_hash = 0;
        }
        for (number, primitive) in primitives.iter().enumerate() {
            for tile in self.tiles_in(primitive.area) {
                let tile = &mut self.tiles[tile];
                tile.pending_hash = mix_hash(tile.pending_hash, [primitive.hash]);
                tile.stale = tile.stale || has_changed(primitive, tile.area, textures);
                tile.primitives.push(number as u32);
            }
        }
    }

    /// Indices of the tiles that `area` overlaps; it must lie in the framebuffer and not be empty.
    fn tiles_in(&self, area: PixelRect) -> impl Iterator<Item = usize> + use<> {
        let columns = area.left as usize / TILE_WIDTH..=(area.right as usize - 1) / TILE_WIDTH;
        let rows = area.top as usize / TILE_HEIGHT..=(area.bottom as usize - 1) / TILE_HEIGHT;
        let tiles_across = self.tiles_across;
        rows.flat_map(move |row| columns.clone().map(move |column| row * tiles_across + column))
    }

    /// Copies the pixels of `area`, clipped to the framebuffer, into `into`, whose rows have `stride` pixels.
    pub(super) fn copy(&self, area: PixelRect, into: &mut [u32], stride: usize) {
        let [right, bottom] = self.size;
        let area = area.within(PixelRect { left: 0, top: 0, right, bottom });
        if area.is_empty() {
            return;
        }
        for tile in self.tiles_in(area) {
            let tile = &self.tiles[tile];
            let overlap = area.within(tile.area);
            for y in overlap.top..overlap.bottom {
                let from = (y - tile.area.top) as usize * TILE_WIDTH + (overlap.left - tile.area.left) as usize;
                let row = &tile.pixels[from..][..(overlap.right - overlap.left) as usize];
                let to = y as usize * stride + overlap.left as usize;
                if let Some(target) = into.get_mut(to..to + row.len()) {
                    target.copy_from_slice(row);
                }
            }
        }
    }
}

impl Tile {
    fn paint(&mut self, primitives: &[DrawPrimitive], textures: &Textures) {
        // What lies below the topmost primitive that hides the whole tile need not be painted.
        let mut numbers = self.primitives.iter();
        let occluder = numbers.rposition(|number| occludes(&primitives[*number as usize], self.area, textures));
        let mut pixels = TilePixels { area: self.area, rows: &mut self.pixels };
        if occluder.is_none() {
            pixels.clear();
        }
        for number in &self.primitives[occluder.unwrap_or(0)..] {
            pixels.paint(&primitives[*number as usize], textures);
        }
        (self.painted_hash, self.stale) = (Some(self.pending_hash), false);
    }
}

/// Whether texels of `primitive` in `area` changed.
fn has_changed(primitive: &DrawPrimitive, area: PixelRect, textures: &Textures) -> bool {
    let (PrimitiveShape::Texels { texture, .. }
    | PrimitiveShape::Picture { texture, .. }
    | PrimitiveShape::Triangle { texture, .. }) = primitive.shape
    else {
        return false;
    };
    let Some(texture) = textures.get(texture) else { return false };
    let overlap = primitive.area.within(area);
    let ends = [[overlap.left, overlap.top], [overlap.right - 1, overlap.bottom - 1]];
    match primitive.shape {
        PrimitiveShape::Fill(_) => false,
        PrimitiveShape::Texels { origin, .. } => {
            texture.has_changed(ends.map(|end| [0, 1].map(|axis| (i64::from(end[axis]) + origin[axis]) as f32)), 0.0)
        }
        // Bilinear filtering reads the neighboring texels.
        PrimitiveShape::Picture { mapping, .. } => {
            texture.has_changed(ends.map(|end| [0, 1].map(|axis| mapping.texel(end[axis], axis))), 1.0)
        }
        PrimitiveShape::Triangle { triangle, .. } => texture.has_changed(triangle.texels, 1.0),
    }
}

/// Merges rectangles that adjoin in a row, and then rows of equal columns.
fn merge_rects(areas: Vec<PixelRect>) -> Vec<PixelRect> {
    let mut rows: Vec<PixelRect> = Vec::new();
    for area in areas {
        match rows.last_mut() {
            Some(last) if last.top == area.top && last.right == area.left => last.right = area.right,
            _ => rows.push(area),
        }
    }
    let mut all: Vec<PixelRect> = Vec::new();
    for row in rows {
        let columns = (row.left, row.right);
        match all.iter_mut().rev().find(|area| area.bottom == row.top && (area.left, area.right) == columns) {
            Some(area) => area.bottom = row.bottom,
            None => all.push(row),
        }
    }
    all
}
