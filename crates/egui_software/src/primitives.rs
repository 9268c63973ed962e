//! egui's meshes taken apart into what can be painted: rectangles wherever two triangles make one, and triangles.

use egui::{
    Color32, Mesh, Pos2, Rect,
    epaint::{TextureId, Vertex},
};

use super::{
    blend::{Rgba, times},
    textures::{Texture, Textures},
    tiles::Area,
    triangle::{Corner, SUBPIXELS, Triangle},
};

/// Where pictures lie pixel by pixel, up to this share of a texel, nothing is mixed: half a step of 255 at most.
const EXACT: f64 = 1.0 / 512.0;

/// What is painted at once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Where it may be seen: its bounds within its clip, never empty.
    pub(super) area: Area,
    pub(super) shape: Shape,
    /// Of everything that it looks like, but for the texels.
    pub(super) hash: u64,
}

/// How a piece fills its area; textures by their slots.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    /// With one colour.
    Fill(Rgba),
    /// With texels, one a pixel; the texel of pixel (0, 0).
    Texels { texture: usize, origin: [i64; 2], tint: Rgba },
    /// With a picture of another size: the place in it, texels, of the middle of pixel (0, 0), and how much farther each pixel is.
    Picture { texture: usize, from: [f64; 2], step: [f64; 2], tint: Rgba },
    /// What of it lies within a triangle.
    Triangle { texture: usize, triangle: Triangle },
}

/// What is painted on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    pub(super) pixels_per_point: f32,
    /// Pixels.
    pub(super) size: [i32; 2],
}

impl Target {
    /// Adds what `mesh` shows within `clip`.
    pub(super) fn add(&self, mesh: &Mesh, clip: Rect, textures: &Textures, pieces: &mut Vec<Piece>) {
        let clip = self.clip(clip);
        let Some(slot) = textures.slot(mesh.texture_id).filter(|_| !clip.is_empty()) else { return };
        let Some(texture) = textures.get(slot) else { return };
        // Nearly all that is no letter shows this texel, which is white.
        let add = Adding { clip, id: mesh.texture_id, slot, texture, first_texel: texture.rounded_at([0.0; 2]) };
        let mut indices = mesh.indices.as_slice();
        while let [a, b, c, rest @ ..] = indices {
            indices = rest;
            let Some(first) = self.corners(mesh, [*a, *b, *c], texture) else { continue };
            if let [d, e, f, beyond @ ..] = rest
                && is_half(&first)
                && let Some(second) = self.corners(mesh, [*d, *e, *f], texture)
                && let Some([low, high]) = rectangle(&first, &second)
            {
                indices = beyond;
                pieces.extend(add.rectangle(&low, &high));
                continue;
            }
            pieces.extend(add.triangle(first));
        }
    }

    /// Rounded to pixels, as egui's own painters round it.
    fn clip(&self, clip: Rect) -> Area {
        // Casts saturate.
        let pixel = |at: f32, side: i32| ((at * self.pixels_per_point).round() as i32).clamp(0, side);
        let [width, height] = self.size;
        Area {
            left: pixel(clip.min.x, width),
            top: pixel(clip.min.y, height),
            right: pixel(clip.max.x, width),
            bottom: pixel(clip.max.y, height),
        }
    }

    /// Corners that are somewhere, of a triangle of the mesh.
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

/// Whether a triangle may be half of a rectangle: two of its sides go along the axes.
fn is_half([a, b, c]: &[Corner; 3]) -> bool {
    let level = |axis: usize| a.at[axis] == b.at[axis] || b.at[axis] == c.at[axis] || c.at[axis] == a.at[axis];
    level(0) && level(1)
}

/// The first and the last corner of the rectangle that two triangles make which have one colour, and of which each axis goes along one
/// of the texture.
fn rectangle(first: &[Corner; 3], second: &[Corner; 3]) -> Option<[Corner; 2]> {
    let all = [first, second];
    let colour = first[0].colour;
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
    // Which of the four corners each triangle has, as bits; the one that each lacks must be the other one's own.
    let mut seen = [0_u8; 2];
    for (triangle, seen) in all.into_iter().zip(&mut seen) {
        for corner in triangle {
            let mut place = 0;
            for axis in 0..2 {
                let end = if corner.at[axis] == high.at[axis] { high } else { low };
                if corner.at[axis] != end.at[axis] || corner.texel[axis] != end.texel[axis] || corner.colour != colour {
                    return None;
                }
                place |= u8::from(corner.at[axis] == high.at[axis]) << axis;
            }
            *seen |= 1 << place;
        }
    }
    let [lacks, other_lacks] = seen.map(|seen| !seen & 15);
    let opposite = |place: u8| 1 << (3 - place.trailing_zeros());
    let fit = lacks.count_ones() == 1 && other_lacks.count_ones() == 1 && opposite(lacks) == other_lacks;
    fit.then_some([low, high])
}

/// Pieces of one mesh.
struct Adding<'a> {
    clip: Area,
    id: TextureId,
    slot: usize,
    texture: &'a Texture,
    /// The colour at (0, 0).
    first_texel: Rgba,
}

impl Adding<'_> {
    /// `None` where nothing of it is seen.
    fn rectangle(&self, low: &Corner, high: &Corner) -> Option<Piece> {
        let area = Area::between(low.at, high.at).within(self.clip);
        if area.is_empty() {
            return None;
        }
        let tint = low.colour;
        let shape = if low.texel == high.texel {
            let colour = times(self.texel(low), tint);
            if colour == [0; 4] {
                return None;
            }
            Shape::Fill(colour)
        } else {
            self.picture(low, high, tint)
        };
        let hash = match shape {
            Shape::Fill(colour) => hashed(0, [u64::from(u32::from_le_bytes(colour))]),
            _ => hash_of(self.id, [low, high]),
        };
        Some(Piece { area, shape, hash: hashed(hash, area.words()) })
    }

    fn texel(&self, corner: &Corner) -> Rgba {
        if corner.texel == [0.0; 2] { self.first_texel } else { self.texture.rounded_at(corner.texel) }
    }

    fn picture(&self, low: &Corner, high: &Corner, tint: Rgba) -> Shape {
        let (mut from, mut step, mut origin) = ([0.0; 2], [0.0; 2], [0; 2]);
        let mut exact = true;
        for axis in 0..2 {
            let [start, end] = [low.at[axis], high.at[axis]].map(|at| f64::from(at) / f64::from(SUBPIXELS));
            let [first, last] = [low.texel[axis], high.texel[axis]].map(f64::from);
            step[axis] = (last - first) / (end - start);
            from[axis] = first + (0.5 - start) * step[axis];
            let nearest = (first - start).round();
            exact &= (first - start - nearest).abs() <= EXACT && (last - end - nearest).abs() <= EXACT;
            origin[axis] = nearest as i64;
        }
        if exact {
            Shape::Texels { texture: self.slot, origin, tint }
        } else {
            Shape::Picture { texture: self.slot, from, step, tint }
        }
    }

    /// `None` where nothing of it is seen.
    fn triangle(&self, corners: [Corner; 3]) -> Option<Piece> {
        let triangle = Triangle::new(corners, |corner| self.texel(corner))?;
        let area = triangle.bounds().within(self.clip);
        let hash = hashed(hash_of(self.id, &corners), area.words());
        (!area.is_empty()).then_some(Piece { area, shape: Shape::Triangle { texture: self.slot, triangle }, hash })
    }
}

/// Goes on with a hash.
pub(super) fn hashed(hash: u64, words: impl IntoIterator<Item = u64>) -> u64 {
    let mut hash = hash;
    for word in words {
        let product =
            u128::from(hash.rotate_left(23) ^ word ^ 0x9e37_79b9_7f4a_7c15) * u128::from(0xd6e8_feb8_6659_fd93_u64);
        hash = (product >> 64) as u64 ^ product as u64;
    }
    hash
}

fn hash_of<'a>(id: TextureId, corners: impl IntoIterator<Item = &'a Corner>) -> u64 {
    let mut hash = match id {
        TextureId::Managed(number) => hashed(1, [number]),
        TextureId::User(number) => hashed(2, [number]),
    };
    for corner in corners {
        let pair = |[a, b]: [u32; 2]| u64::from(a) << 32 | u64::from(b);
        let colour = u64::from(u32::from_le_bytes(corner.colour));
        hash = hashed(hash, [pair(corner.at.map(|at| at as u32)), pair(corner.texel.map(f32::to_bits)), colour]);
    }
    hash
}
