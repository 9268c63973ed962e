//! A software rasterizer for [egui], and a window that shows it, for machines without a GPU.
//!
//! [`window::run`] runs an [`App`] in a native window (`winit`). Per frame:
//! 1. egui tessellates the user interface into clipped triangle meshes.
//! 2. `primitives` converts each mesh to rectangles, where two triangles form one, and triangles.
//! 3. `tiles` bins the primitives into tiles of 64 x 32 pixels. Each tile keeps a hash of the primitives that touch it:
//!    a tile with an unchanged hash and unchanged texels is not repainted.
//! 4. `raster` paints the changed tiles on a thread pool; `triangle` has the edge functions, `blend` egui's blending in gamma space.
//! 5. `surface` copies the changed rectangles to the window (`softbuffer`), with the damage that the system needs to know.
//!
//! A software Vulkan driver such as lavapipe would repaint the whole window for every frame.

mod blend;
mod pixel_rect;
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

pub use pixel_rect::PixelRect;
use primitives::{DrawPrimitive, FramebufferSize};
use textures::Textures;
use tiles::FramebufferTiles;
pub use window::App;

/// Rasterizes egui's meshes into a retained framebuffer: only what changed since the previous frame is painted.
pub struct Painter {
    textures: Textures,
    tile_grid: FramebufferTiles,
    primitives: Vec<DrawPrimitive>,
    /// A pool of its own: the application's pool may be busy with long jobs.
    pool: Option<rayon::ThreadPool>,
}

impl Default for Painter {
    fn default() -> Self {
        // Without a thread pool, the calling thread paints.
        let pool = rayon::ThreadPoolBuilder::new().thread_name(|index| format!("paint {index}")).build().ok();
        Self { textures: Textures::default(), tile_grid: FramebufferTiles::default(), primitives: Vec::new(), pool }
    }
}

impl Painter {
    /// Uploads new and changed textures. Call before [`paint`](Self::paint).
    pub fn set_textures(&mut self, delta: &mut TexturesDelta) {
        for (id, images) in delta.set.drain() {
            for image in &images {
                self.textures.set(id, image);
            }
        }
    }

    /// Frees textures that egui no longer uses. Call after [`paint`](Self::paint).
    pub fn free_textures(&mut self, delta: &mut TexturesDelta) {
        for id in delta.free.drain() {
            self.textures.free(id);
        }
    }

    /// Paints `primitives` into a framebuffer of `size` pixels with `pixels_per_point` pixels per egui point. Returns the rectangles that
    /// changed.
    pub fn paint(&mut self, primitives: &[ClippedPrimitive], pixels_per_point: f32, size: [u32; 2]) -> Vec<PixelRect> {
        let target = FramebufferSize { pixels_per_point, size: size.map(|side| side.min(i32::MAX as u32) as i32) };
        self.primitives.clear();
        for ClippedPrimitive { clip_rect, primitive } in primitives {
            if let Primitive::Mesh(mesh) = primitive {
                target.add(mesh, *clip_rect, &self.textures, &mut self.primitives);
            }
        }
        let Self { textures, tile_grid, primitives, pool } = self;
        let changed = tile_grid.paint(target.size, primitives, textures, pool.as_ref());
        textures.clear_changes();
        changed
    }

    /// Discards the framebuffer: the next frame paints everything.
    pub fn invalidate(&mut self) {
        self.tile_grid = FramebufferTiles::default();
    }

    /// Copies the pixels of `area` into `into`, whose rows have `stride` pixels, as 0x00RRGGBB.
    pub fn copy(&self, area: PixelRect, into: &mut [u32], stride: usize) {
        self.tile_grid.copy(area, into, stride);
    }
}
