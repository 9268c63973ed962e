//! Mean of many samples of the gas: over the time for which the shutter is open, and over parts of pixels.
//!
//! Light is not linear in the gas, since it absorbs itself: what is summed over samples is therefore light, not optical depth. Other phenomena may be
//! composited between depth layers. With the transmittance T of the layers in front of layer k in a sample, the mean adds `mean(T l_k)` to the light and
//! `mean(T (1 - t_k))` to the opacity; divided by `mean(T)` they are a layer whose compositing gives the mean of the composited samples.

use bansho_base::{host::parallel::prelude::*, image::Rect, math::simd::LANES, phenomenon::strip::Strip};
use fearless_simd::{Level, dispatch};

use super::{
    aovs::{GasMotionField, Measured},
    resolve::{ColumnExtents, DepthLayer, GasResolver, LayerSums, PixelLight, ResolvedRow},
};

/// Planes of a layer: red, green, blue and opacity, seen through the layers in front of it.
const LIGHT_PLANES: usize = 4;
/// Planes that follow where AOVs are requested: optical depth, luminance, luminance times temperature.
const AOV_PLANES: usize = 3;
/// Transmittance below which nothing is seen through a layer.
const OPAQUE: f32 = 1e-6;

/// Means over samples for the pixels of a rectangle, row by row, layer by layer, plane by plane.
pub(crate) struct ExposedGas {
    /// The pixels that any sample covers, within the window.
    pub(crate) rect: Rect,
    layers: usize,
    planes: usize,
    values: Vec<f32>,
    /// Minimum and maximum temperature of the gas in all samples, K.
    temperatures: [f32; 2],
}

/// A sample to be added.
pub(crate) struct ExposureSample<'a> {
    pub(crate) resolver: &'a GasResolver<'a>,
    pub(crate) extents: &'a ColumnExtents,
    pub(crate) layers: &'a [DepthLayer],
    /// The pixels that the sample covers, within the window.
    pub(crate) rect: Rect,
    /// Pixels of the sample along the side of one of the picture's.
    pub(crate) finer: usize,
    /// Weight of the sample; those of all samples sum to 1.
    pub(crate) weight: f32,
}

impl ExposedGas {
    pub(crate) fn new(layers: usize, with_aovs: bool) -> Self {
        let planes = LIGHT_PLANES + if with_aovs { AOV_PLANES } else { 0 };
        let temperatures = [f32::INFINITY, f32::NEG_INFINITY];
        Self { rect: Rect::default(), layers, planes, values: Vec::new(), temperatures }
    }

    fn row_length(&self) -> usize {
        self.layers * self.planes * self.rect.width
    }

    /// Extends the rectangle to include another one.
    fn extend_to(&mut self, rect: &Rect) {
        let extended = self.rect.union(rect);
        if extended == self.rect {
            return;
        }
        let old = std::mem::replace(self, Self { rect: extended, values: Vec::new(), ..*self });
        self.values = vec![0.0; self.row_length() * extended.height];
        if old.rect.is_empty() {
            return;
        }
        let left = old.rect.x - extended.x;
        for y in 0..old.rect.height {
            let row = (old.rect.y - extended.y + y) * self.row_length();
            for plane in 0..self.layers * self.planes {
                let from = &old.values[y * old.row_length() + plane * old.rect.width..][..old.rect.width];
                self.values[row + plane * extended.width + left..][..old.rect.width].copy_from_slice(from);
            }
        }
    }

    /// Adds a sample.
    pub(crate) fn add(&mut self, sample: &ExposureSample, level: Level) {
        if sample.rect.is_empty() {
            return;
        }
        self.extend_to(&sample.rect);
        let [coldest, hottest] = sample.resolver.temperatures;
        self.temperatures = [self.temperatures[0].min(coldest), self.temperatures[1].max(hottest)];
        let (rect, planes, length) = (self.rect, self.planes, self.row_length());
        let first = (sample.rect.y - rect.y) * length;
        let rows = &mut self.values[first..][..sample.rect.height * length];
        rows.par_chunks_mut(length).enumerate().with_max_len(1).for_each_init(
            || (sample.resolver.row(), vec![1.0; sample.rect.width * sample.finer]),
            |(buffer, transmittance), (row, values)| {
                let mut pixels = PixelRow { y: sample.rect.y + row, x: rect.x, width: rect.width, planes, values };
                dispatch!(level, _simd => pixels.add(sample, buffer, transmittance));
            },
        );
    }

    /// Composites a layer behind the contents of a strip.
    pub(crate) fn draw_layer(&self, layer: &DepthLayer, strip: &mut Strip) {
        let rect = self.rect.intersection(&strip.rect);
        for y in rect.y..rect.bottom() {
            for x in (rect.x / LANES * LANES..rect.right()).step_by(LANES) {
                let columns = x.max(rect.x)..(x + LANES).min(rect.right());
                let mut light = PixelLight { planes: [[0.0; LANES]; 4] };
                let mut is_empty = true;
                for column in columns.clone() {
                    let pixel = self.pixel(column, y, layer.index);
                    is_empty &= pixel == [0.0; 4];
                    (0..4).for_each(|plane| light.planes[plane][column - x] = pixel[plane]);
                }
                if !is_empty {
                    light.composite(layer, [x, y], columns, strip);
                }
            }
        }
    }

    /// Light and opacity of a layer at a pixel.
    fn pixel(&self, x: usize, y: usize, layer: usize) -> [f32; 4] {
        let opacity_in_front: f32 = (0..layer).map(|nearer| self.value([x, y], nearer, 3)).sum();
        let transmittance = 1.0 - opacity_in_front;
        if transmittance < OPAQUE {
            return [0.0; 4];
        }
        [0, 1, 2, 3].map(|plane| self.value([x, y], layer, plane) / transmittance)
    }

    fn value(&self, [x, y]: [usize; 2], layer: usize, plane: usize) -> f32 {
        let row = (y - self.rect.y) * self.row_length();
        self.values[row + (layer * self.planes + plane) * self.rect.width + x - self.rect.x]
    }

    /// Adds the AOVs of a layer to a strip.
    pub(crate) fn write_layer_aovs(&self, layer: &DepthLayer, motion: Option<&GasMotionField<'_>>, strip: &mut Strip) {
        if self.planes == LIGHT_PLANES {
            return;
        }
        let rect = self.rect.intersection(&strip.rect);
        for (x, y) in (rect.y..rect.bottom()).flat_map(|y| (rect.x..rect.right()).map(move |x| (x, y))) {
            let [tau, luminance, luminance_kelvin] =
                [0, 1, 2].map(|plane| self.value([x, y], layer.index, LIGHT_PLANES + plane));
            let measured = Measured { tau, luminance, luminance_kelvin };
            if measured.tau > 0.0 {
                measured.write(strip, layer.depth as f32, [x, y], self.temperatures, motion);
            }
        }
    }
}

/// One row of pixels, to which the rows of a sample are added.
struct PixelRow<'a> {
    y: usize,
    /// First column, and number of columns.
    x: usize,
    width: usize,
    planes: usize,
    values: &'a mut [f32],
}

impl PixelRow<'_> {
    #[inline(always)]
    fn add(&mut self, sample: &ExposureSample, row: &mut ResolvedRow, transmittance: &mut [f32]) {
        let ExposureSample { resolver, extents, layers, rect, finer, weight } = *sample;
        let weight = weight / (finer * finer) as f32;
        let [left, right] = [rect.x * finer, rect.right() * finer];
        for y in self.y * finer..(self.y + 1) * finer {
            transmittance.fill(1.0);
            for layer in layers {
                let Some([first, last]) = resolver.fill(layer.index, y, extents, row) else { continue };
                for x in (first.max(left) / LANES * LANES..last.min(right)).step_by(LANES) {
                    let Some(sums) = resolver.sums(row, layer.index, [x, y]) else { continue };
                    let light = resolver.light(&sums, row, layer, x, y);
                    for column in x.max(left)..(x + LANES).min(right) {
                        let lane = column - x;
                        let in_front = &mut transmittance[column - left];
                        let seen = weight * *in_front;
                        let opacity = light.planes[3][lane];
                        let pixel = layer.index * self.planes * self.width + column / finer - self.x;
                        for plane in 0..LIGHT_PLANES {
                            self.values[pixel + plane * self.width] += seen * light.planes[plane][lane];
                        }
                        *in_front -= *in_front * opacity;
                        if self.planes > LIGHT_PLANES {
                            self.add_measured(pixel + LIGHT_PLANES * self.width, &sums, lane, weight);
                        }
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn add_measured(&mut self, first: usize, sums: &LayerSums, lane: usize, weight: f32) {
        let measured = [sums.tau[lane], sums.luminance[lane], sums.luminance_kelvin[lane]];
        for (plane, value) in measured.into_iter().enumerate() {
            self.values[first + plane * self.width] += weight * value;
        }
    }
}
