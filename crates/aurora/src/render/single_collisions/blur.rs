//! The thesis's blur (2.28): Gaussians in the picture whose radii in pixels depend on the line only.
//!
//! A sum of equal Gaussians is one blur of the sum of points. The whole picture with a margin is sampled from the
//! charts, and each emitter is blurred separably along rows and columns.

use bansho_base::{
    camera::Camera,
    host::parallel::prelude::*,
    math,
    math::simd::{FourLanes, Real},
    phenomenon::strip::View,
};
use fearless_simd::{Simd, dispatch, prelude::*};

use crate::{
    parameters::BlurParameters,
    physics::emission::{EMITTERS, PerEmitter, SpectralEmitter},
    render::{
        project::{
            chart::{PIXEL_BATCH, PixelBatch},
            field_lines::FieldLines,
        },
        shade::ChartSampler,
    },
};

/// Support of the kernel in standard deviations.
const KERNEL_SIGMAS: f64 = 3.0;
/// Standard deviation that the charts already have, pixels: that of the smallest patch.
const CHART_SIGMA: f64 = 0.6;

/// A picture of brightness by emitter, kR.
pub(crate) struct BlurredImage {
    light: Vec<PerEmitter<f32>>,
    /// Row length including margins, and the margin, pixels.
    width: usize,
    margin: usize,
}

/// Weights by emitter from the center outward.
struct BlurKernel(Vec<PerEmitter<f32>>);

impl BlurKernel {
    fn new(radii: &BlurParameters) -> Self {
        let sigmas = EMITTERS.map(|emitter| radii.pixels(emitter));
        let max_sigma = sigmas.into_iter().fold(0.0, f64::max);
        let count = (KERNEL_SIGMAS * max_sigma).ceil() as usize + 1;
        let mut weights = vec![[0.0; EMITTERS.len()]; count];
        for (emitter, sigma) in sigmas.into_iter().enumerate() {
            // Variances add: the kernel adds what the charts lack.
            let remaining = math::sqrt((sigma * sigma - CHART_SIGMA * CHART_SIGMA).max(1e-4));
            let mut gaussian = vec![0.0; count];
            for (distance, value) in gaussian.iter_mut().enumerate() {
                *value = math::exp(-0.5 * math::pow(distance as f64 / remaining, 2.0));
            }
            // Both sides; the center counts once.
            let whole = 2.0 * gaussian.iter().sum::<f64>() - 1.0;
            for (weights, value) in weights.iter_mut().zip(gaussian) {
                weights[emitter] = (value / whole) as f32;
            }
        }
        Self(weights)
    }

    /// Half-width of the support, pixels.
    fn reach(&self) -> usize {
        self.0.len() - 1
    }

    /// Convolution at an index, with elements `stride` apart.
    #[inline(always)]
    fn sum<S: Simd>(&self, simd: S, light: &[PerEmitter<f32>], middle: usize, stride: usize) -> PerEmitter<f32> {
        let mut sum = FourLanes::simd_from(simd, self.0[0]) * FourLanes::simd_from(simd, light[middle]);
        for (distance, weights) in self.0.iter().enumerate().skip(1) {
            let before = FourLanes::simd_from(simd, light[middle - distance * stride]);
            let after = FourLanes::simd_from(simd, light[middle + distance * stride]);
            // Both sides share a weight, so they are added first.
            sum = (before + after).fma(FourLanes::simd_from(simd, *weights), sum);
        }
        sum.into()
    }
}

impl BlurredImage {
    /// The whole picture of a view.
    pub(crate) fn new(view: &View, field: &FieldLines, samplers: &[ChartSampler; 2], radii: &BlurParameters) -> Self {
        let level = bansho_base::math::simd::level();
        let kernel = BlurKernel::new(radii);
        let margin = kernel.reach();
        let [width, height] = view.size.map(|side| side + 2 * margin);
        let camera = view.camera.with_overscan(margin);
        let mut rows = vec![[0.0; 4]; width * height];
        rows.par_chunks_mut(width).enumerate().for_each_init(Vec::new, |sharp: &mut Vec<PerEmitter<f32>>, (y, row)| {
            dispatch!(level, simd => {
                sample_row(simd, &camera, field, samplers, y, width, sharp);
                for (x, light) in row.iter_mut().enumerate().take(width - margin).skip(margin) {
                    *light = kernel.sum(simd, sharp, x, 1);
                }
            });
        });
        let mut light = vec![[0.0; 4]; width * view.size[1]];
        light.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            dispatch!(level, simd => {
                for (x, light) in row.iter_mut().enumerate().take(width - margin).skip(margin) {
                    // Down the picture the terms of a sum are a row apart, but successive pixels read successive memory in each of these rows.
                    *light = kernel.sum(simd, &rows, (y + margin) * width + x, width);
                }
            });
        });
        Self { light, width, margin }
    }

    /// Pixels from `x` on in row `y`; clamped at the picture's edge.
    #[inline(always)]
    pub(crate) fn batch(&self, x: usize, y: usize) -> [PerEmitter<f32>; PIXEL_BATCH] {
        let row = &self.light[y * self.width..(y + 1) * self.width];
        let mut light = [[0.0; 4]; PIXEL_BATCH];
        for (i, light) in light.iter_mut().enumerate() {
            *light = row[(x + i + self.margin).min(self.width - 1)];
        }
        light
    }
}

/// Brightness by emitter of a picture row, sampled from the charts.
#[inline(always)]
fn sample_row<S: Simd>(
    simd: S,
    camera: &Camera,
    field: &FieldLines,
    samplers: &[ChartSampler; 2],
    y: usize,
    width: usize,
    light: &mut Vec<PerEmitter<f32>>,
) {
    light.clear();
    let mut x = 0;
    while x < width {
        let batch = PixelBatch::new(camera, field, x, y);
        let mut batch_light = [[0.0; 4]; PIXEL_BATCH];
        for sampler in samplers {
            sampler.add(simd, &batch.longitude, &batch.colatitude, &mut batch_light);
        }
        light.extend_from_slice(&batch_light[..PIXEL_BATCH.min(width - x)]);
        x += PIXEL_BATCH;
    }
}

impl BlurParameters {
    /// Standard deviation of an emitter's light, pixels.
    fn pixels(&self, emitter: SpectralEmitter) -> f64 {
        match emitter {
            SpectralEmitter::OxygenGreen => self.green_px,
            SpectralEmitter::OxygenRed => self.red_px,
            SpectralEmitter::NitrogenIon => self.violet_px,
            SpectralEmitter::Nitrogen => self.deep_red_px,
        }
    }
}
