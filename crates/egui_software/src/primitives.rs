//! Converts egui's meshes to draw primitives: rectangles wherever two triangles form one, and triangles.

use egui::{
    Color32, Mesh, Pos2, Rect,
    epaint::{TextureId, Vertex},
};

use super::{
    blend::{Rgba, multiply},
    pixel_rect::{PixelRect, SUBPIXELS, packed},
    textures::{Texture, Textures},
    triangle::{Corner, Triangle},
};

/// Images whose texels align with pixels within this fraction of a texel are copied without filtering: the error is half of 1/255 at most.
const TEXEL_TOLERANCE: f64 = 1.0 / 512.0;

/// A rectangle or a triangle, clipped.
#[derive(Clone, Copy, Debug)]
pub(super) struct DrawPrimitive {
    /// Its bounds within its clip rectangle, never empty.
    pub(super) area: PixelRect,
    pub(super) shape: PrimitiveShape,
    /// Hash of its geometry, colors and texture id; texels are tracked by [`Textures`].
    pub(super) hash: u64,
}

/// How a primitive fills its area; textures by slot.
#[derive(Clone, Copy, Debug)]
pub(super) enum PrimitiveShape {
    /// One color.
    Fill(Rgba),
    /// One texel per pixel; `origin` is the texel of pixel (0, 0).
    Texels { texture: usize, origin: [i64; 2], tint: Rgba },
    /// A scaled image.
    Picture { texture: usize, mapping: TexelMapping, tint: Rgba },
    /// The pixels inside a triangle.
    Triangle { texture: usize, triangle: Triangle },
}

/// The texture coordinates of pixel centers, a linear function along each axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct TexelMapping {
    /// The texture coordinate of the center of pixel (0, 0), texels.
    origin: [f64; 2],
    /// Increment per pixel, texels.
    step: [f64; 2],
}

impl TexelMapping {
    /// The texture coordinate along `axis` of the center of a pixel.
    pub(super) fn texel(&self, pixel: i32, axis: usize) -> f32 {
        (self.origin[axis] + f64::from(pixel) * self.step[axis]) as f32
    }
}

/// The framebuffer that is painted.
#[derive(Clone, Copy, Debug)]
pub(super) struct FramebufferSize {
    pub(super) pixels_per_point: f32,
    /// Pixels.
    pub(super) size: [i32; 2],
}

impl FramebufferSize {
    /// Appends the primitives of `mesh` within `clip`.
    pub(super) fn add(&self, mesh: &Mesh, clip: Rect, textures: &Textures, primitives: &mut Vec<DrawPrimitive>) {
        let clip = self.clip(clip);
        let Some(slot) = textures.slot(mesh.texture_id).filter(|_| !clip.is_empty()) else { return };
        let Some(texture) = textures.get(slot) else { return };
        // Untextured shapes use this texel of the font atlas, which is white.
        let add =
            MeshContext { clip, id: mesh.texture_id, slot, texture, first_texel: texture.sample_rounded([0.0; 2]) };
        let mut indices = mesh.indices.as_slice();
        while let [a, b, c, rest @ ..] = indices {
            indices = rest;
            let Some(first) = self.corners(mesh, [*a, *b, *c], texture) else { continue };
            if let [d, e, f, beyond @ ..] = rest
                && may_be_half_rectangle(&first)
                && let Some(second) = self.corners(mesh, [*d, *e, *f], texture)
                && let Some([low, high]) = rectangle(&first, &second)
            {
                indices = beyond;
                primitives.extend(add.rectangle(&low, &high));
                continue;
            }
            primitives.extend(add.triangle(first));
        }
    }

    /// The clip rectangle rounded to pixels, as egui's wgpu and glow painters round it.
    fn clip(&self, clip: Rect) -> PixelRect {
        let [width, height] = self.size;
        // Casts saturate.
        let [left, right] = [clip.min.x, clip.max.x].map(|at| (at * self.pixels_per_point).round() as i32);
        let [top, bottom] = [clip.min.y, clip.max.y].map(|at| (at * self.pixels_per_point).round() as i32);
        PixelRect {
            left: left.clamp(0, width),
            top: top.clamp(0, height),
            right: right.clamp(0, width),
            bottom: bottom.clamp(0, height),
        }
    }

    /// The corners of a triangle of the mesh; `None` where a position is NaN or an index is out of range.
    fn corners(&self, mesh: &Mesh, indices: [u32; 3], texture: &Texture) -> Option<[Corner; 3]> {
        let size = texture.size().map(|side| side as f32);
        let mut corners = [Corner::default(); 3];
        for (corner, index) in corners.iter_mut().zip(indices) {
            let Vertex { pos, uv, color } = *mesh.vertices.get(index as usize)?;
            let Pos2 { x, y } = pos * self.pixels_per_point;
            if x.is_nan() || y.is_nan() {
                return None;
            }
            *corner = Corner::at([x, y], [uv.x * size[0], uv.y * size[1]], Color32::to_array(&color));
        }
        Some(corners)
    }
}

/// Whether a triangle may be half of a rectangle: two of its sides are parallel to the axes.
fn may_be_half_rectangle([a, b, c]: &[Corner; 3]) -> bool {
    let has_aligned_side =
        |axis: usize| a.at[axis] == b.at[axis] || b.at[axis] == c.at[axis] || c.at[axis] == a.at[axis];
    has_aligned_side(0) && has_aligned_side(1)
}

/// The minimum and maximum corner of the rectangle that two triangles form, where all corners have one color and each texture coordinate
/// depends on one axis only.
fn rectangle(first: &[Corner; 3], second: &[Corner; 3]) -> Option<[Corner; 2]> {
    let all = [first, second];
    let color = first[0].color;
    let (mut low, mut high) = (first[0], first[0]);
    for corner in all.into_iter().flatten() {
        for axis in 0..2 {
            if corner.at[axis] < low.at[axis] {
                (low.at[axis], low.texel[axis]) = (corner.at[axis], corner.texel[axis]);
            }
            if corner.at[axis] > high.at[axis] {
                (high.at[axis], high.texel[axis]) = (corner.at[axis], corner.texel[axis]);
            }
        }
    }
    // Bit masks of the rectangle corners that each triangle has: each must lack exactly one, opposite to the one that the other lacks.
    let mut masks = [0_u8; 2];
    for (triangle, mask) in all.into_iter().zip(&mut masks) {
        for corner in triangle {
            let mut corner_bits = 0;
            for axis in 0..2 {
                let end = if corner.at[axis] == high.at[axis] { high } else { low };
                if corner.at[axis] != end.at[axis] || corner.texel[axis] != end.texel[axis] || corner.color != color {
                    return None;
                }
                corner_bits |= u8::from(corner.at[axis] == high.at[axis]) << axis;
            }
            *mask |= 1 << corner_bits;
        }
    }
    let [lacks, other_lacks] = masks.map(|mask| !mask & 15);
    // Each triangle lacks one corner, and these are opposite: bits 0 and 3, or 1 and 2.
    let is_rectangle = lacks.count_ones() == 1
        && other_lacks.count_ones() == 1
        && lacks.trailing_zeros() + other_lacks.trailing_zeros() == 3;
    is_rectangle.then_some([low, high])
}

/// The inputs that all primitives of a mesh have in common.
struct MeshContext<'a> {
    clip: PixelRect,
    id: TextureId,
    slot: usize,
    texture: &'a Texture,
    /// The color at texture coordinate (0, 0).
    first_texel: Rgba,
}

impl MeshContext<'_> {
    /// `None` where nothing of it is visible.
    fn rectangle(&self, low: &Corner, high: &Corner) -> Option<DrawPrimitive> {
        let area = PixelRect::covering(low.at, high.at).within(self.clip);
        if area.is_empty() {
            return None;
        }
        let tint = low.color;
        let shape = if low.texel == high.texel {
            let color = multiply(self.texel(low), tint);
            if color == [0; 4] {
                return None;
            }
            PrimitiveShape::Fill(color)
        } else {
            self.picture(low, high, tint)
        };
        let hash = match shape {
            PrimitiveShape::Fill(color) => mix_hash(0, [u64::from(u32::from_le_bytes(color))]),
            _ => hash_vertices(self.id, [low, high]),
        };
        Some(DrawPrimitive { area, shape, hash: mix_hash(hash, area.hash_words()) })
    }

    fn texel(&self, corner: &Corner) -> Rgba {
        if corner.texel == [0.0; 2] { self.first_texel } else { self.texture.sample_rounded(corner.texel) }
    }

    fn picture(&self, low: &Corner, high: &Corner, tint: Rgba) -> PrimitiveShape {
        let mut mapping = TexelMapping { origin: [0.0; 2], step: [0.0; 2] };
        let mut origin = [0; 2];
        let mut exact = true;
        for axis in 0..2 {
            let [start, end] = [low.at[axis], high.at[axis]].map(|at| f64::from(at) / f64::from(SUBPIXELS));
            let [first, last] = [low.texel[axis], high.texel[axis]].map(f64::from);
            mapping.step[axis] = (last - first) / (end - start);
            mapping.origin[axis] = first + (0.5 - start) * mapping.step[axis];
            let nearest = (first - start).round();
            exact &=
                (first - start - nearest).abs() <= TEXEL_TOLERANCE && (last - end - nearest).abs() <= TEXEL_TOLERANCE;
            origin[axis] = nearest as i64;
        }
        if exact {
            PrimitiveShape::Texels { texture: self.slot, origin, tint }
        } else {
            PrimitiveShape::Picture { texture: self.slot, mapping, tint }
        }
    }

    /// `None` where nothing of it is visible.
    fn triangle(&self, corners: [Corner; 3]) -> Option<DrawPrimitive> {
        let triangle = Triangle::new(corners, |corner| self.texel(corner))?;
        let area = triangle.bounds().within(self.clip);
        let hash = mix_hash(hash_vertices(self.id, &corners), area.hash_words());
        (!area.is_empty()).then_some(DrawPrimitive {
            area,
            shape: PrimitiveShape::Triangle { texture: self.slot, triangle },
            hash,
        })
    }
}

/// Mixes `words` into `hash`: multiply and fold, as wyhash does.
pub(super) fn mix_hash(hash: u64, words: impl IntoIterator<Item = u64>) -> u64 {
    let mut hash = hash;
    for word in words {
        let product =
            u128::from(hash.rotate_left(23) ^ word ^ 0x9e37_79b9_7f4a_7c15) * u128::from(0xd6e8_feb8_6659_fd93_u64);
        hash = (product >> 64) as u64 ^ product as u64;
    }
    hash
}

fn hash_vertices<'a>(id: TextureId, corners: impl IntoIterator<Item = &'a Corner>) -> u64 {
    let mut hash = match id {
        TextureId::Managed(number) => mix_hash(1, [number]),
        TextureId::User(number) => mix_hash(2, [number]),
    };
    for corner in corners {
        let ([x, y], [u, v]) = (corner.at.map(|at| at as u32), corner.texel.map(f32::to_bits));
        let color = u64::from(u32::from_le_bytes(corner.color));
        hash = mix_hash(hash, [packed(x, y), packed(u, v), color]);
    }
    hash
}
