//! Draws a soot field into strips, sixteen pixels at a time, with its AOVs.

use bansho_base::{
    color,
    image::Rect,
    math::{self, simd::LANES},
    phenomenon::strip::{Strip, View},
};
use fearless_simd::Simd;

use super::{shade::shade_soot, time_samples::SootSample};
use crate::sheet::{
    model::{FlameInstance, FlameSheet},
    render::{
        aovs::{MOTION, OPTICAL_DEPTH, TEMPERATURE},
        draw::PixelSums,
        projection::SheetCoordinates,
        shade::ShadedBatch,
    },
    soot_field::SootFieldTables,
};

/// One soot field with the inputs of drawing.
pub(crate) struct SootContext<'a> {
    pub(crate) sheet: &'a FlameSheet,
    pub(crate) flame: &'a FlameInstance,
    pub(crate) view: &'a View,
    pub(crate) samples: &'a [SootSample],
}

/// Draws all time samples into `rect` of `strip`, behind its current contents, and adds the AOVs that it has planes for.
///
/// Batches start at multiples of sixteen columns of the whole picture, so that pixels do not depend on strips and crops.
#[inline(always)]
pub(crate) fn draw_soot_rows<S: Simd>(simd: S, context: &SootContext, rect: Rect, strip: &mut Strip) {
    let Some(tables) = context.sheet.soot_field() else { return };
    let start = rect.x / LANES * LANES;
    for y in rect.y..rect.bottom() {
        for column in (start..rect.right()).step_by(LANES) {
            draw_batch(simd, context, tables, [column, y], rect, strip);
        }
    }
}

/// Not inlined, so that the code is compiled once.
fn draw_batch<S: Simd>(
    simd: S,
    context: &SootContext,
    tables: &SootFieldTables,
    [column, y]: [usize; 2],
    rect: Rect,
    strip: &mut Strip,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut sums = PixelSums::new(simd);
            let count = context.samples.len();
            for sample in context.samples {
                let batch = sample.pixel_to_sheet.batch(simd, column, y);
                let Some(shade) = shade_soot(&tables.plume, &sample.state, &batch) else { continue };
                if !strip.aovs.is_empty() {
                    write_aovs(context, sample, &shade, &batch, [column, y], rect, strip);
                }
                sums.add(&shade, batch.depth, 1.0 / count as f32, count);
            }
            sums.composite(column, y, rect, true, strip);
        },
    );
}

/// Adds the AOVs of one time sample of sixteen pixels, one pixel at a time.
fn write_aovs<S: Simd>(
    context: &SootContext,
    sample: &SootSample,
    shade: &ShadedBatch<S>,
    batch: &SheetCoordinates<S>,
    [column, y]: [usize; 2],
    rect: Rect,
    strip: &mut Strip,
) {
    let sample_weight = 1.0 / context.samples.len() as f32;
    for lane in 0..LANES {
        let x = column + lane;
        if !(rect.x..rect.right()).contains(&x) {
            continue;
        }
        let index = (y - strip.rect.y) * strip.rect.width + x - strip.rect.x;
        if !strip.visible(index, batch.depth[lane]) {
            continue;
        }
        let depth = -math::f32::ln_1p(-shade.light[3][lane].min(0.999_999));
        strip.aovs[OPTICAL_DEPTH].add(index, depth * sample_weight, 1.0);
        let weight = color::luminance([0, 1, 2].map(|k| shade.light[k][lane])) * sample_weight;
        if weight > 0.0 {
            strip.aovs[TEMPERATURE].add(index, shade.t1[lane], weight);
            let at = [f64::from(batch.x[lane]), f64::from(batch.y[lane])];
            let motion = context.sheet.motion(context.flame, context.view, &sample.quad, &sample.state.warp, at);
            for (plane, value) in MOTION.into_iter().zip(motion) {
                strip.aovs[plane].add(index, value, weight);
            }
        }
    }
}
