//! Small meshes with known pixels.

mod coverage;
mod textures;

use std::sync::Arc;

use egui::{
    ClippedPrimitive, Color32, ColorImage, Mesh, Pos2, Rect, TextureId, TextureOptions, TexturesDelta,
    epaint::{ImageDelta, Primitive, Vertex},
    pos2,
};

use super::{Painter, PixelRect};

/// The size of the framebuffer, pixels. The tiles at the right and the bottom are cut.
const SIZE: [u32; 2] = [150, 70];

const EVERYWHERE: Rect = Rect { min: pos2(-1e9, -1e9), max: pos2(1e9, 1e9) };

const FONT: TextureId = TextureId::Managed(0);

/// A painter with egui's font texture, which is white at (0, 0).
fn painter() -> Painter {
    let mut painter = Painter::default();
    set(&mut painter, FONT, None, ColorImage::filled([8, 8], Color32::WHITE));
    painter
}

fn set(painter: &mut Painter, id: TextureId, at: Option<[usize; 2]>, image: ColorImage) {
    set_with(painter, id, at, image, TextureOptions::LINEAR);
}

fn set_with(painter: &mut Painter, id: TextureId, at: Option<[usize; 2]>, image: ColorImage, options: TextureOptions) {
    let mut delta = TexturesDelta::default();
    delta.push(id, ImageDelta { image: Arc::new(image).into(), options, pos: at });
    painter.set_textures(&mut delta);
}

fn vertex(pos: Pos2, uv: Pos2, color: Color32) -> Vertex {
    Vertex { pos, uv, color }
}

/// Triangles of one color.
fn triangles(color: Color32, corners: &[[f32; 2]]) -> Mesh {
    let vertices = corners.iter().map(|[x, y]| vertex(pos2(*x, *y), Pos2::ZERO, color)).collect();
    Mesh { indices: (0..corners.len() as u32).collect(), vertices, texture_id: FONT }
}

fn rectangle(rect: Rect, color: Color32) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_colored_rect(rect, color);
    mesh
}

fn within(clip_rect: Rect, mesh: Mesh) -> ClippedPrimitive {
    ClippedPrimitive { clip_rect, primitive: Primitive::Mesh(mesh) }
}

/// Paints `meshes`. Returns all pixels, and the rectangles that were painted.
fn painted(painter: &mut Painter, meshes: impl IntoIterator<Item = Mesh>) -> (Vec<u32>, Vec<PixelRect>) {
    let primitives: Vec<ClippedPrimitive> = meshes.into_iter().map(|mesh| within(EVERYWHERE, mesh)).collect();
    let changed = painter.paint(&primitives, 1.0, SIZE);
    (pixels(painter), changed)
}

fn pixels(painter: &Painter) -> Vec<u32> {
    let [width, height] = SIZE;
    let mut pixels = vec![0xdead_beef; (width * height) as usize];
    let whole = PixelRect { left: 0, top: 0, right: width as i32, bottom: height as i32 };
    painter.copy(whole, &mut pixels, width as usize);
    pixels
}

fn pixel(pixels: &[u32], x: u32, y: u32) -> u32 {
    pixels[(y * SIZE[0] + x) as usize]
}

/// Random numbers in [0, 1).
fn random(seed: u64) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = super::primitives::mix_hash(state, [1]);
        (state >> 40) as f32 / (1 << 24) as f32
    }
}
