//! Compositing front to back: `C += Tacc L; Tacc *= T`. For frames with little content this is the hot loop.

use bansho_base::{
    image::Rect,
    math::MulAdd,
    phenomenon::strip::{AovDescriptor, AovPlane, Strip},
};
use fearless_simd::{Level, dispatch};

use super::hiding::is_partly_covered;

/// The composite of a strip of the picture from the camera to some depth. Planes are stored in rows.
#[derive(Default)]
pub(crate) struct Accumulator {
    pub(crate) rect: Rect,
    /// C: red, green, blue of the light that reaches the camera.
    pub(crate) color: [Vec<f32>; 3],
    /// Tacc: fraction of the light from behind that still reaches the camera. Valid only if `absorbs`; otherwise it is 1 everywhere.
    transmittance: [Vec<f32>; 3],
    absorbs: bool,
    /// Alpha of what is seen through the transparency of a plate; empty if nothing is.
    hidden_alpha: Vec<f32>,
    /// Depth of the nearest sample, m.
    pub(crate) depth: Vec<f32>,
    /// Red, green, blue and alpha that each phenomenon adds to the picture; empty unless layers are requested.
    pub(crate) layers: Vec<[Vec<f32>; 4]>,
    /// AOVs of each phenomenon; empty unless they are requested.
    pub(crate) aovs: Vec<Vec<AovPlane>>,
}

/// The mean of `own` with a weight and `other` with the rest.
fn weighted_mean(own: f32, own_weight: f32, other: f32) -> f32 {
    (own - other).fma(own_weight, other)
}

fn refill(plane: &mut Vec<f32>, pixels: usize, value: f32) {
    plane.clear();
    plane.resize(pixels, value);
}

impl Accumulator {
    /// Clears it for the pixels of `rect`, with `layers` layers and `aovs[i]` AOVs of phenomenon `i`.
    pub(crate) fn reset(&mut self, rect: Rect, layers: usize, aovs: &[usize]) {
        let pixels = rect.width * rect.height;
        self.rect = rect;
        self.color.iter_mut().for_each(|plane| refill(plane, pixels, 0.0));
        self.absorbs = false;
        self.hidden_alpha.clear();
        refill(&mut self.depth, pixels, f32::INFINITY);
        self.layers.resize_with(layers, Default::default);
        self.layers.iter_mut().flatten().for_each(|plane| refill(plane, pixels, 0.0));
        self.aovs.resize_with(aovs.len(), Vec::new);
        for (planes, &count) in self.aovs.iter_mut().zip(aovs) {
            planes.resize_with(count, AovPlane::default);
            planes.iter_mut().for_each(|plane| plane.reset(pixels));
        }
    }

    /// Planes of Tacc; `None` while nothing absorbs, so that all are 1.
    pub(crate) fn transmittance(&self) -> Option<&[Vec<f32>; 3]> {
        self.absorbs.then_some(&self.transmittance)
    }

    /// Tacc at a pixel of the strip.
    pub(crate) fn transmittance_at(&self, index: usize) -> [f32; 3] {
        if self.absorbs { [0, 1, 2].map(|c| self.transmittance[c][index]) } else { [1.0; 3] }
    }

    fn start_absorbing(&mut self) {
        if !self.absorbs {
            let pixels = self.rect.width * self.rect.height;
            self.transmittance.iter_mut().for_each(|plane| refill(plane, pixels, 1.0));
            self.absorbs = true;
        }
    }

    /// Composites `strip` of the phenomenon with index `phenomenon` and AOVs `aovs` behind the accumulated content.
    pub(crate) fn add_behind(&mut self, level: Level, strip: &Strip, phenomenon: usize, aovs: &[AovDescriptor]) {
        if strip.transmittance_planes().is_some() {
            self.start_absorbing();
        }
        for row in 0..strip.rect.height {
            let from = row * strip.rect.width;
            let to = (strip.rect.y - self.rect.y + row) * self.rect.width + strip.rect.x - self.rect.x;
            if phenomenon < self.layers.len() {
                self.add_layer_row(strip, phenomenon, from, to);
            }
            self.add_row(level, strip, from, to);
        }
        if let Some(planes) = self.aovs.get_mut(phenomenon) {
            let each = planes.iter_mut().zip(&strip.aovs).zip(aovs);
            each.for_each(|((sum, plane), aov)| sum.add_plane(plane, aov.rule));
        }
    }

    /// Alpha of what is seen through the transparency of a plate, in a range of pixels; `None` if nothing is.
    pub(crate) fn hidden_alpha(&self, pixels: std::ops::Range<usize>) -> Option<&[f32]> {
        self.hidden_alpha.get(pixels).filter(|alpha| !alpha.is_empty())
    }

    /// Adds what is seen through the transparency of a plate: `other` is the composite of some of its pixels without the plate, `transparency` the fraction of
    /// a pixel (column and row in the picture) that it fills. The transmittance stays that of what is before the plate: `C a + C' (1 - a) + T P`,
    /// with C and T before a plate P of coverage a, and C' without it. AOVs stay.
    pub(crate) fn add_through(&mut self, other: &Self, transparency: impl Fn(usize, usize) -> f32) {
        refill(&mut self.hidden_alpha, self.depth.len(), 0.0);
        let rect = other.rect;
        for from in 0..rect.width * rect.height {
            let [x, y] = [rect.x + from % rect.width, rect.y + from / rect.width];
            let (to, weight) = ((y - self.rect.y) * self.rect.width + x - self.rect.x, transparency(x, y));
            if weight <= 0.0 {
                continue;
            }
            for c in 0..3 {
                let color = &mut self.color[c][to];
                *color = weight.fma(other.color[c][from] - *color, *color);
            }
            for (plane, other) in self.layers.iter_mut().flatten().zip(other.layers.iter().flatten()) {
                plane[to] = weight.fma(other[from] - plane[to], plane[to]);
            }
            let [before, without] = [self.transmittance_at(to), other.transmittance_at(from)];
            let absorbed = (0..3).map(|c| before[c] - without[c]).sum::<f32>() / 3.0;
            self.hidden_alpha[to] = weight * absorbed;
            self.depth[to] = self.depth[to].min(other.depth[from]);
        }
    }

    /// Mixes with another composite, over some of its pixels: `own_weight` (column and row in the picture) is its own weight, the other's is the rest. Pixels
    /// of which one composite has all stay as they are, so that no pixel depends on how large the other one is. AOVs stay.
    pub(crate) fn mix(&mut self, other: &Self, own_weight: impl Fn(usize, usize) -> f32) {
        if other.absorbs {
            self.start_absorbing();
        }
        let rect = other.rect;
        for from in 0..rect.width * rect.height {
            let [x, y] = [rect.x + from % rect.width, rect.y + from / rect.width];
            let (to, weight) = ((y - self.rect.y) * self.rect.width + x - self.rect.x, own_weight(x, y));
            if !is_partly_covered(weight) {
                continue;
            }
            let transmittance = other.transmittance_at(from);
            for c in 0..3 {
                self.color[c][to] = weighted_mean(self.color[c][to], weight, other.color[c][from]);
                if self.absorbs {
                    self.transmittance[c][to] = weighted_mean(self.transmittance[c][to], weight, transmittance[c]);
                }
            }
            for (plane, other) in self.layers.iter_mut().flatten().zip(other.layers.iter().flatten()) {
                plane[to] = weighted_mean(plane[to], weight, other[from]);
            }
            self.depth[to] = self.depth[to].min(other.depth[from]);
        }
    }

    /// Replaces some of its pixels by those of another composite. AOVs stay.
    pub(crate) fn replace(&mut self, other: &Self) {
        if other.absorbs {
            self.start_absorbing();
        }
        let rect = other.rect;
        for row in 0..rect.height {
            let from = row * rect.width..(row + 1) * rect.width;
            let first = (rect.y - self.rect.y + row) * self.rect.width + rect.x - self.rect.x;
            let to = first..first + rect.width;
            for c in 0..3 {
                self.color[c][to.clone()].copy_from_slice(&other.color[c][from.clone()]);
                match (self.absorbs, other.absorbs) {
                    (_, true) => {
                        self.transmittance[c][to.clone()].copy_from_slice(&other.transmittance[c][from.clone()]);
                    }
                    (true, false) => self.transmittance[c][to.clone()].fill(1.0),
                    (false, false) => {}
                }
            }
            for (own, other) in self.layers.iter_mut().flatten().zip(other.layers.iter().flatten()) {
                own[to.clone()].copy_from_slice(&other[from.clone()]);
            }
            self.depth[to].copy_from_slice(&other.depth[from]);
        }
    }

    /// Adds a composite of the same pixels that shows a fraction `share` of the exposure, to one that contains other fractions of it and nothing else.
    pub(crate) fn add_share(&mut self, level: Level, other: &Self, share: f32) {
        for (sum, color) in self.color.iter_mut().zip(&other.color) {
            dispatch!(level, _simd => add_weighted(sum, color, share));
        }
        if other.absorbs {
            self.start_absorbing();
            for (sum, transmittance) in self.transmittance.iter_mut().zip(&other.transmittance) {
                dispatch!(level, _simd => add_weighted_absorption(sum, transmittance, share));
            }
        }
        for (sum, layer) in self.layers.iter_mut().flatten().zip(other.layers.iter().flatten()) {
            dispatch!(level, _simd => add_weighted(sum, layer, share));
        }
        dispatch!(level, _simd => nearest_row(&mut self.depth, &other.depth));
    }

    fn add_row(&mut self, level: Level, strip: &Strip, from: usize, to: usize) {
        let width = strip.rect.width;
        for c in 0..3 {
            let color = &mut self.color[c][to..][..width];
            let radiance = &strip.radiance[c][from..][..width];
            if !self.absorbs {
                dispatch!(level, _simd => add_light(color, radiance));
                continue;
            }
            let transmittance = &mut self.transmittance[c][to..][..width];
            match strip.transmittance_planes() {
                None => dispatch!(level, _simd => emit_row(color, transmittance, radiance)),
                Some(planes) => {
                    let absorbed = &planes[c][from..][..width];
                    dispatch!(level, _simd => absorb_row(color, transmittance, radiance, absorbed));
                }
            }
        }
        let nearest = &mut self.depth[to..][..width];
        dispatch!(level, _simd => nearest_row(nearest, &strip.depth[from..][..width]));
    }

    /// What a phenomenon adds to the picture: its light as it reaches the camera, and the mean transmittance that it absorbs.
    fn add_layer_row(&mut self, strip: &Strip, phenomenon: usize, from: usize, to: usize) {
        for x in 0..strip.rect.width {
            let own = strip.transmittance(from + x);
            let reaches = self.transmittance_at(to + x);
            let layer = &mut self.layers[phenomenon];
            let mut alpha = 0.0;
            for c in 0..3 {
                layer[c][to + x] = reaches[c].fma(strip.radiance[c][from + x], layer[c][to + x]);
                alpha += reaches[c] * (1.0 - own[c]);
            }
            layer[3][to + x] += alpha / 3.0;
        }
    }
}

#[inline(always)]
fn add_light(color: &mut [f32], radiance: &[f32]) {
    color.iter_mut().zip(radiance).for_each(|(color, radiance)| *color += radiance);
}

#[inline(always)]
fn add_weighted(sum: &mut [f32], values: &[f32], weight: f32) {
    sum.iter_mut().zip(values).for_each(|(sum, value)| *sum = weight.fma(*value, *sum));
}

#[inline(always)]
fn add_weighted_absorption(sum: &mut [f32], transmittance: &[f32], weight: f32) {
    sum.iter_mut().zip(transmittance).for_each(|(sum, value)| *sum = weight.fma(*value - 1.0, *sum));
}

#[inline(always)]
fn nearest_row(nearest: &mut [f32], depth: &[f32]) {
    nearest.iter_mut().zip(depth).for_each(|(old, new)| *old = if *new < *old { *new } else { *old });
}

#[inline(always)]
fn emit_row(color: &mut [f32], transmittance: &[f32], radiance: &[f32]) {
    for ((color, transmittance), radiance) in color.iter_mut().zip(transmittance).zip(radiance) {
        *color = transmittance.fma(*radiance, *color);
    }
}

#[inline(always)]
fn absorb_row(color: &mut [f32], transmittance: &mut [f32], radiance: &[f32], absorbed: &[f32]) {
    for (((color, transmittance), radiance), absorbed) in
        color.iter_mut().zip(transmittance).zip(radiance).zip(absorbed)
    {
        *color = transmittance.fma(*radiance, *color);
        *transmittance *= absorbed;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A composite of two pixels, of which the second has light and absorbs a part.
    fn composite(light: f32, transmittance: Option<f32>, depth: f32) -> Accumulator {
        let mut strip = Strip::default();
        strip.reset(Rect { x: 5, y: 3, width: 2, height: 1 }, None, 0);
        match transmittance {
            None => strip.emit(1, [light, 2.0 * light, 0.0], depth),
            Some(value) => strip.add_behind(1, [light, 2.0 * light, 0.0], [value; 3], depth),
        }
        let mut composite = Accumulator::default();
        composite.reset(strip.rect, 1, &[]);
        composite.add_behind(bansho_base::math::simd::level(), &strip, 0, &[]);
        composite
    }

    #[test]
    fn shares_of_an_exposure_come_to_their_mean() {
        let level = bansho_base::math::simd::level();
        let mut mean = Accumulator::default();
        mean.reset(Rect { x: 5, y: 3, width: 2, height: 1 }, 1, &[]);
        for (light, transmittance, depth) in
            [(4.0, None, 7.0), (8.0, Some(0.5), 6.0), (0.0, Some(0.0), 9.0), (4.0, None, 8.0)]
        {
            mean.add_share(level, &composite(light, transmittance, depth), 0.25);
        }
        assert_eq!(mean.color, [vec![0.0, 4.0], vec![0.0, 8.0], vec![0.0; 2]]);
        assert_eq!([0, 1].map(|pixel| mean.transmittance_at(pixel)), [[1.0; 3], [0.625; 3]]);
        assert_eq!(mean.layers[0][3], [0.0, 0.375], "of the mean transmittance");
        assert_eq!(mean.depth, [f32::INFINITY, 6.0]);
    }

    #[test]
    fn replaced_pixels_do_not_keep_what_was_there() {
        let mut all = composite(4.0, Some(0.5), 2.0);
        all.replace(&composite(1.0, None, 3.0));
        assert_eq!((all.color[1][1], all.transmittance_at(1), all.depth[1]), (2.0, [1.0; 3], 3.0));
        all.replace(&composite(1.0, Some(0.25), 4.0));
        assert_eq!(
            (all.transmittance_at(0), all.transmittance_at(1), all.layers[0][3][1]),
            ([1.0; 3], [0.25; 3], 0.75)
        );
    }

    #[test]
    fn only_pixels_that_are_covered_partly_are_mixed() {
        let mut own = composite(4.0, Some(0.5), 2.0);
        own.mix(&composite(8.0, None, 3.0), |x, _| if x == 6 { 1.0 } else { 0.0 });
        assert_eq!((own.color[0][1], own.transmittance_at(1)), (4.0, [0.5; 3]));
        own.mix(&composite(8.0, None, 3.0), |_, _| 0.25);
        assert_eq!((own.color[0][1], own.transmittance_at(1)), (7.0, [0.875; 3]));
    }
}
