//! Textures as egui uploads them, with a dirty flag per block of texels.

use std::{collections::HashMap, sync::Arc};

use egui::{
    Color32, ColorImage, TextureFilter, TextureId, TextureOptions, TextureWrapMode,
    epaint::{ImageData, ImageDelta},
};

use super::blend::Rgba;

/// Size of a block with its own dirty flag, texels.
const BLOCK: [usize; 2] = [64, 32];

/// All textures by id.
#[derive(Default)]
pub(super) struct Textures {
    /// The slot of each texture in `textures`.
    slots: HashMap<TextureId, usize>,
    textures: Vec<Option<Texture>>,
}

/// A texture.
pub(super) struct Texture {
    image: Arc<ColorImage>,
    options: TextureOptions,
    /// The blocks that changed since the last frame.
    changed: Vec<bool>,
    any_changed: bool,
    opaque: bool,
}

impl Textures {
    /// The slot of texture `id`; valid until the texture is freed.
    pub(super) fn slot(&self, id: TextureId) -> Option<usize> {
        self.slots.get(&id).copied()
    }

    pub(super) fn get(&self, slot: usize) -> Option<&Texture> {
        self.textures.get(slot)?.as_ref()
    }

    /// Uploads a whole texture, or a region of an existing one.
    pub(super) fn set(&mut self, id: TextureId, delta: &ImageDelta) {
        let ImageData::Color(image) = &delta.image;
        if image.pixels.len() != image.size[0] * image.size[1] || image.pixels.is_empty() {
            return;
        }
        let slot = *self.slots.entry(id).or_insert_with(|| {
            let free = self.textures.iter().position(Option::is_none);
            free.unwrap_or_else(|| {
                self.textures.push(None);
                self.textures.len() - 1
            })
        });
        let entry = &mut self.textures[slot];
        match (delta.pos, entry) {
            (Some(at), Some(texture)) => texture.set_region(at, image, delta.options),
            (Some(_), None) => {
                self.slots.remove(&id);
            }
            (None, Some(texture)) if (texture.image.size, texture.options) == (image.size, delta.options) => {
                texture.replace(image);
            }
            (None, entry) => {
                let blocks = blocks(image.size);
                let changed = vec![true; blocks[0] * blocks[1]];
                let (image, opaque) = (image.clone(), is_opaque(image));
                *entry = Some(Texture { image, options: delta.options, changed, any_changed: true, opaque });
            }
        }
    }

    pub(super) fn free(&mut self, id: TextureId) {
        if let Some(slot) = self.slots.remove(&id) {
            self.textures[slot] = None;
        }
    }

    /// Clears the dirty flags, after a frame is painted.
    pub(super) fn clear_changes(&mut self) {
        for texture in self.textures.iter_mut().flatten().filter(|texture| texture.any_changed) {
            texture.changed.fill(false);
            texture.any_changed = false;
        }
    }
}

fn blocks(size: [usize; 2]) -> [usize; 2] {
    [size[0].div_ceil(BLOCK[0]), size[1].div_ceil(BLOCK[1])]
}

fn is_opaque(image: &ColorImage) -> bool {
    let mut all = 255;
    for pixel in &image.pixels {
        all &= pixel.a();
    }
    all == 255
}

impl Texture {
    /// Width and height, texels; at least one.
    pub(super) fn size(&self) -> [usize; 2] {
        self.image.size
    }

    /// Whether every texel is opaque.
    pub(super) fn is_opaque(&self) -> bool {
        self.opaque
    }

    /// The texels of row `row`, which must exist.
    pub(super) fn row(&self, row: usize) -> &[Color32] {
        let width = self.image.size[0];
        &self.image.pixels[row * width..][..width]
    }

    /// Whether texels between two corners, with a margin of `margin` texels, changed since the last frame.
    pub(super) fn has_changed(&self, [from, to]: [[f32; 2]; 2], margin: f32) -> bool {
        if !self.any_changed {
            return false;
        }
        let across = blocks(self.image.size)[0];
        let mut ranges = [[0, 0]; 2];
        for axis in 0..2 {
            let last = self.image.size[axis] as f32 - 1.0;
            // With a repeating texture, any texel may be visible.
            let [low, high] = if self.options.wrap_mode == TextureWrapMode::ClampToEdge {
                [from[axis].min(to[axis]) - margin, from[axis].max(to[axis]) + margin].map(|at| at.clamp(0.0, last))
            } else {
                [0.0, last]
            };
            ranges[axis] = [low as usize / BLOCK[axis], high as usize / BLOCK[axis]];
        }
        let [columns, rows] = ranges.map(|[first, last]| first..=last);
        rows.into_iter().any(|row| self.changed[row * across..][columns.clone()].contains(&true))
    }

    /// Replaces the texels by `image`, which has the same size.
    fn replace(&mut self, image: &Arc<ColorImage>) {
        let before = std::mem::replace(&mut self.image, image.clone());
        let [width, height] = image.size;
        let across = blocks(image.size)[0];
        for y in 0..height {
            let rows = [&before, image].map(|image| &image.pixels[y * width..][..width]);
            let changed = &mut self.changed[y / BLOCK[1] * across..][..across];
            for (block, changed) in changed.iter_mut().enumerate() {
                let range = block * BLOCK[0]..((block + 1) * BLOCK[0]).min(width);
                *changed = *changed || rows[0][range.clone()] != rows[1][range];
            }
        }
        self.any_changed |= self.changed.contains(&true);
        self.opaque = is_opaque(image);
    }

    /// Copies `image` into the texture at `at`, clipped to the texture.
    fn set_region(&mut self, at: [usize; 2], image: &ColorImage, options: TextureOptions) {
        let size = self.image.size;
        if at[0] >= size[0] || at[1] >= size[1] {
            return;
        }
        let within = [0, 1].map(|axis| image.size[axis].min(size[axis] - at[axis]));
        let whole = Arc::make_mut(&mut self.image);
        for y in 0..within[1] {
            let row = &mut whole.pixels[(at[1] + y) * size[0] + at[0]..][..within[0]];
            row.copy_from_slice(&image.pixels[y * image.size[0]..][..within[0]]);
        }
        self.any_changed = true;
        if self.options != options {
            self.options = options;
            self.changed.fill(true);
        }
        let across = blocks(size)[0];
        for y in at[1] / BLOCK[1]..=(at[1] + within[1] - 1) / BLOCK[1] {
            let columns = at[0] / BLOCK[0]..=(at[0] + within[0] - 1) / BLOCK[0];
            self.changed[y * across..][columns].fill(true);
        }
        self.opaque &= is_opaque(image);
    }

    /// The texel index for coordinate `at` of `axis` by the wrap mode.
    pub(super) fn wrap(&self, at: i32, axis: usize) -> usize {
        let side = self.image.size[axis].min(i32::MAX as usize / 2) as i32;
        (match self.options.wrap_mode {
            TextureWrapMode::ClampToEdge => at.clamp(0, side - 1),
            TextureWrapMode::Repeat => at.rem_euclid(side),
            TextureWrapMode::MirroredRepeat => {
                let phase = at.rem_euclid(2 * side);
                phase.min(2 * side - 1 - phase)
            }
        }) as usize
    }

    /// The two texels that linear filtering reads at `at` of `axis`, and the weight of the second.
    pub(super) fn taps(&self, at: f32, axis: usize) -> FilterTaps {
        if self.options.magnification == TextureFilter::Nearest {
            let texel = self.wrap(at.floor() as i32, axis);
            return FilterTaps { texels: [texel; 2], weight: 0.0 };
        }
        let floor = (at - 0.5).floor();
        // Saturates, so that nothing overflows.
        let first = (floor as i32).min(i32::MAX - 1);
        let weight = if floor.is_finite() { at - 0.5 - floor } else { 0.0 };
        FilterTaps { texels: [self.wrap(first, axis), self.wrap(first + 1, axis)], weight }
    }

    /// The bilinearly filtered color of four texels, 0 to 255.
    pub(super) fn bilinear(&self, across: FilterTaps, down: FilterTaps) -> [f32; 4] {
        let mut sides = [[0.0; 4]; 2];
        for (side, row) in sides.iter_mut().zip(down.texels) {
            let row = self.row(row);
            let [left, right] = across.texels.map(|texel| row[texel].to_array());
            *side = lerp(left.map(f32::from), right.map(f32::from), across.weight);
        }
        lerp(sides[0], sides[1], down.weight)
    }

    /// The filtered color at `at`, texels.
    pub(super) fn at(&self, at: [f32; 2]) -> [f32; 4] {
        self.bilinear(self.taps(at[0], 0), self.taps(at[1], 1))
    }

    /// The filtered color at `at`, texels, rounded.
    pub(super) fn sample_rounded(&self, at: [f32; 2]) -> Rgba {
        self.at(at).map(|channel| (channel + 0.5) as u8)
    }
}

/// Two texels along an axis and the weight of the second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct FilterTaps {
    pub(super) texels: [usize; 2],
    pub(super) weight: f32,
}

fn lerp(from: [f32; 4], to: [f32; 4], weight: f32) -> [f32; 4] {
    let mut mixture = from;
    for c in 0..4 {
        mixture[c] += (to[c] - from[c]) * weight;
    }
    mixture
}
