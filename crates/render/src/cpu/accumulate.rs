//! Compositing front to back: `C += Tacc L; Tacc *= T` (the hot loop of a frame that holds little).

use bansho_base::{
    canvas::{AovPlane, Strip},
    image::Rect,
};
use fearless_simd::{Level, dispatch};

/// What a strip of the picture has come to, from the camera up to some depth. Planes are row after row.
#[derive(Default)]
pub(super) struct Accumulator {
    pub(super) rect: Rect,
    /// C: red, green, blue of the light that reaches the camera.
    pub(super) colour: [Vec<f32>; 3],
    /// Tacc: share of the light from behind that still reaches the camera.
    pub(super) transmittance: [Vec<f32>; 3],
    /// Depth of the nearest sample, m.
    pub(super) depth: Vec<f32>,
    /// Red, green, blue and alpha that each phenomenon adds to the picture; empty unless layers are wanted.
    pub(super) layers: Vec<[Vec<f32>; 4]>,
    /// AOVs of each phenomenon; empty unless they are wanted.
    pub(super) aovs: Vec<Vec<AovPlane>>,
}

fn refill(plane: &mut Vec<f32>, pixels: usize, value: f32) {
    plane.clear();
    plane.resize(pixels, value);
}

impl Accumulator {
    /// Makes it empty over `rect`, with so many layers, and so many AOVs for each phenomenon.
    pub(super) fn reset(&mut self, rect: Rect, layers: usize, aovs: &[usize]) {
        let pixels = rect.width * rect.height;
        self.rect = rect;
        self.colour.iter_mut().for_each(|plane| refill(plane, pixels, 0.0));
        self.transmittance.iter_mut().for_each(|plane| refill(plane, pixels, 1.0));
        refill(&mut self.depth, pixels, f32::INFINITY);
        self.layers.resize_with(layers, Default::default);
        self.layers.iter_mut().flatten().for_each(|plane| refill(plane, pixels, 0.0));
        self.aovs.resize_with(aovs.len(), Vec::new);
        for (planes, &count) in self.aovs.iter_mut().zip(aovs) {
            planes.resize_with(count, AovPlane::default);
            planes.iter_mut().for_each(|plane| plane.reset(pixels));
        }
    }

    /// Puts `strip`, drawn by `phenomenon`, behind what is there.
    pub(super) fn add_behind(&mut self, level: Level, strip: &Strip, phenomenon: usize) {
        for row in 0..strip.rect.height {
            let from = row * strip.rect.width;
            let to = (strip.rect.y - self.rect.y + row) * self.rect.width + strip.rect.x - self.rect.x;
            let width = strip.rect.width;
            if let Some(layer) = self.layers.get_mut(phenomenon) {
                add_layer_row(layer, &self.transmittance, strip, from, to, width);
            }
            for c in 0..3 {
                let colour = &mut self.colour[c][to..][..width];
                let transmittance = &mut self.transmittance[c][to..][..width];
                let radiance = &strip.radiance[c][from..][..width];
                match strip.transmittance_planes() {
                    None => dispatch!(level, _simd => emit_row(colour, transmittance, radiance)),
                    Some(planes) => {
                        let absorbed = &planes[c][from..][..width];
                        dispatch!(level, _simd => absorb_row(colour, transmittance, radiance, absorbed));
                    }
                }
            }
            let nearest = &mut self.depth[to..][..width];
            nearest.iter_mut().zip(&strip.depth[from..]).for_each(|(old, new)| *old = old.min(*new));
        }
        if let Some(planes) = self.aovs.get_mut(phenomenon) {
            planes.iter_mut().zip(&strip.aovs).for_each(|(sum, plane)| sum.add_plane(plane));
        }
    }
}

#[inline(always)]
fn emit_row(colour: &mut [f32], transmittance: &[f32], radiance: &[f32]) {
    for ((colour, transmittance), radiance) in colour.iter_mut().zip(transmittance).zip(radiance) {
        *colour = transmittance.mul_add(*radiance, *colour);
    }
}

#[inline(always)]
fn absorb_row(colour: &mut [f32], transmittance: &mut [f32], radiance: &[f32], absorbed: &[f32]) {
    for (((colour, transmittance), radiance), absorbed) in
        colour.iter_mut().zip(transmittance).zip(radiance).zip(absorbed)
    {
        *colour = transmittance.mul_add(*radiance, *colour);
        *transmittance *= absorbed;
    }
}

/// A layer's share of the picture: its light as the camera gets it, and the mean transmittance that it takes.
fn add_layer_row(
    layer: &mut [Vec<f32>; 4],
    transmittance: &[Vec<f32>; 3],
    strip: &Strip,
    from: usize,
    to: usize,
    width: usize,
) {
    for x in 0..width {
        let taken = strip.transmittance(from + x);
        let mut alpha = 0.0;
        for c in 0..3 {
            let reaches = transmittance[c][to + x];
            layer[c][to + x] = reaches.mul_add(strip.radiance[c][from + x], layer[c][to + x]);
            alpha += reaches * (1.0 - taken[c]);
        }
        layer[3][to + x] += alpha / 3.0;
    }
}
