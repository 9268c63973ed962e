//! A window that needs no GPU: egui's triangles painted by the processor's own cores, and only where something changed.
//!
//! [`window`] runs a [`App`] in a window of the system; [`Painter`] turns what egui wants painted
//! into pixels; `Screen` brings those that changed to the window. No library does this for this version of egui, and
//! painters that pretend to be a GPU paint the whole window for every frame.

mod app;
mod blend;
mod primitives;
mod raster;
mod surface;
#[cfg(test)]
mod tests;
mod textures;
mod tiles;
mod triangle;
pub mod window;

use egui::{ClippedPrimitive, TexturesDelta, epaint::Primitive};

pub use app::App;
use primitives::{Piece, Target};
use textures::Textures;
pub use tiles::Area;
use tiles::Canvas;

/// Paints what egui wants seen, and keeps it: where the next frame is the same, nothing is painted.
pub struct Painter {
    textures: Textures,
    canvas: Canvas,
    pieces: Vec<Piece>,
    /// A pool of its own: the application's pool may be busy with long jobs.
    pool: Option<rayon::ThreadPool>,
}

impl Default for Painter {
    fn default() -> Self {
        // Where the system gives no threads, the window's own paints.
        let pool = rayon::ThreadPoolBuilder::new().thread_name(|index| format!("paint {index}")).build().ok();
        Self { textures: Textures::default(), canvas: Canvas::default(), pieces: Vec::new(), pool }
    }
}

impl Painter {
    /// Takes in textures that are new or changed.
    pub fn set_textures(&mut self, delta: &mut TexturesDelta) {
        for (id, images) in delta.set.drain() {
            for image in &images {
                self.textures.set(id, image);
            }
        }
    }

    /// Gives up textures that nothing shows any more; after a frame is painted.
    pub fn free_textures(&mut self, delta: &mut TexturesDelta) {
        for id in delta.free.drain() {
            self.textures.free(id);
        }
    }

    /// Paints `primitives` in a window of `size` pixels, of which a point of the screen has `pixels_per_point`. What changed, pixels.
    pub fn paint(&mut self, primitives: &[ClippedPrimitive], pixels_per_point: f32, size: [u32; 2]) -> Vec<Area> {
        let target = Target { pixels_per_point, size: size.map(|side| side.min(i32::MAX as u32) as i32) };
        self.pieces.clear();
        for ClippedPrimitive { clip_rect, primitive } in primitives {
            if let Primitive::Mesh(mesh) = primitive {
                target.add(mesh, *clip_rect, &self.textures, &mut self.pieces);
            }
        }
        let Self { textures, canvas, pieces, pool } = self;
        let changed = canvas.paint(target.size, pieces, textures, pool.as_ref());
        textures.settle();
        changed
    }

    /// Forgets what was painted: the next frame paints everything.
    pub fn forget(&mut self) {
        self.canvas = Canvas::default();
    }

    /// Copies the pixels of `area` into `into`, whose rows have `stride` pixels: 0 in the highest byte, then red, green, blue.
    pub fn copy(&self, area: Area, into: &mut [u32], stride: usize) {
        self.canvas.copy(area, into, stride);
    }
}
