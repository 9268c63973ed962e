//! AOVs of a flame: temperature, optical depth and motion.

use bansho_base::{
    camera::upright_quad::UprightQuad,
    color,
    image::Rect,
    math::{self, simd::LANES},
    phenomenon::strip::{AovDescriptor, AovRule, Strip, View},
};
use fearless_simd::Simd;

use super::shade::{SheetContent, TimeSample, shade_sample};
use crate::sheet::{
    animate::warp::WarpState,
    equations,
    model::{FlameInstance, FlameSheet},
    parameters::SheetMethod,
};

/// AOVs of a flame sheet, in the order of a strip's planes.
pub(crate) const AOVS: &[AovDescriptor] = &[
    AovDescriptor {
        name: "temperature_k",
        unit: "K",
        doc: "Soot temperature, weighted by the luminance that it adds; 0 where there is no flame.",
        rule: AovRule::WeightedMean,
    },
    AovDescriptor {
        name: "optical_depth",
        unit: "",
        doc: "Optical depth of soot and smoke along the line of sight, summed; 0 where there is none.",
        rule: AovRule::Sum,
    },
    AovDescriptor {
        name: "motion.X",
        unit: "pixels",
        doc: "Motion of the gas to the next frame, to the right, weighted by luminance; 0 where there is no flame.",
        rule: AovRule::WeightedMean,
    },
    AovDescriptor {
        name: "motion.Y",
        unit: "pixels",
        doc: "Motion of the gas to the next frame, downward, weighted by luminance; 0 where there is no flame.",
        rule: AovRule::WeightedMean,
    },
];

/// Indices of the planes among a strip's AOVs.
pub(crate) const TEMPERATURE: usize = 0;
pub(crate) const OPTICAL_DEPTH: usize = 1;
pub(crate) const MOTION: [usize; 2] = [2, 3];

/// One flame with the inputs of its AOVs.
pub(crate) struct AovContext<'a> {
    pub(crate) sheet: &'a FlameSheet,
    pub(crate) flame: &'a FlameInstance,
    pub(crate) view: &'a View,
    pub(crate) samples: &'a [TimeSample],
    pub(crate) content: SheetContent,
}

/// Adds the AOVs of all time samples in `rect` of `strip`. Evaluated only where AOVs are requested, one pixel at a time.
#[inline(always)]
pub(crate) fn write_aov_rows<S: Simd>(simd: S, context: &AovContext, rect: Rect, strip: &mut Strip) {
    let start = rect.x / LANES * LANES;
    for y in rect.y..rect.bottom() {
        for column in (start..rect.right()).step_by(LANES) {
            for sample in context.samples {
                write_aov_batch(simd, context, sample, [column, y], rect, strip);
            }
        }
    }
}

#[inline(always)]
fn write_aov_batch<S: Simd>(
    simd: S,
    context: &AovContext,
    sample: &TimeSample,
    pixel: [usize; 2],
    rect: Rect,
    strip: &mut Strip,
) {
    let batch = sample.pixel_to_sheet.batch(simd, pixel[0], pixel[1]);
    let sheet = context.sheet;
    let Some(shade) = shade_sample(sheet.shape(), sheet.ramp(), sample, context.content, &batch) else { return };
    for lane in 0..LANES {
        let x = pixel[0] + lane;
        if !(rect.x..rect.right()).contains(&x) {
            continue;
        }
        let index = (pixel[1] - strip.rect.y) * strip.rect.width + x - strip.rect.x;
        if !strip.visible(index, batch.depth[lane]) {
            continue;
        }
        let sample_weight = 1.0 / context.samples.len() as f32;
        let depth = -math::f32::ln_1p(-shade.light[3][lane].min(0.999_999)) * sample_weight;
        strip.aovs[OPTICAL_DEPTH].add(index, depth, 1.0);
        let weight = color::luminance([0, 1, 2].map(|k| shade.light[k][lane])) * sample.luminance;
        if weight > 0.0 && context.content == SheetContent::Flame {
            strip.aovs[TEMPERATURE].add(index, sheet.ramp().temperature.at(shade.t1[lane])[0], weight);
            let motion = sheet.motion(
                context.flame,
                context.view,
                &sample.quad,
                &sample.state.warp,
                [f64::from(batch.x[lane]), f64::from(batch.y[lane])],
            );
            for (plane, value) in MOTION.into_iter().zip(motion) {
                strip.aovs[plane].add(index, value, weight);
            }
        }
    }
}

/// Minimum of dw/dy: gas moves at most at twice the scroll speed. sqrt(y) of eq. (9) has that slope at the top; near the base it is steeper and the gas is
/// slower.
const MIN_SLOPE: f32 = 0.5;

impl FlameSheet {
    /// Motion of the gas at (x, y) of the sheet until the next frame, pixels to the right and down.
    pub(crate) fn motion(
        &self,
        flame: &FlameInstance,
        view: &View,
        quad: &UprightQuad,
        warp: &WarpState,
        [x, y]: [f64; 2],
    ) -> [f32; 2] {
        let (now, next) = (view.shutter.middle(), view.next_middle);
        let rise = self.gas_speed(flame, x, y, now) * (next - now);
        let shift = self.base_displacement(now, next);
        let bend = warp.center(y + rise) - warp.center(y);
        // Where the gas is seen is as far from where it would be without eddies as they displace it, in the opposite direction.
        let [before, after] = [
            self.eddy_displacement(flame, warp, [x, y], now),
            self.eddy_displacement(flame, warp, [x + bend, y + rise], next),
        ];
        let (bend, rise) = (bend - (after[0] - before[0]), rise - (after[1] - before[1]));
        let before = view.camera.project_beyond_circle(quad.point(x, y));
        let camera = view.camera_at(next);
        let after = camera.project_beyond_circle(quad.point(x + bend, y + rise) + shift);
        match (before, after) {
            (Some(before), Some(after)) => {
                (camera.nearest_repetition(after.pixel, before.pixel) - before.pixel).as_vec2().to_array()
            }
            _ => [0.0; 2],
        }
    }

    /// Displacement by the eddies at (x, y) of the sheet; 0 without them, and for a soot field, which has its own.
    fn eddy_displacement(&self, flame: &FlameInstance, warp: &WarpState, point: [f64; 2], t: f64) -> [f64; 2] {
        match &flame.eddies {
            Some(eddies) if self.parameters.method == SheetMethod::FlameTexture => {
                let state = eddies.after(self.clock.scroll(self.flame_time(flame, t)));
                state.displacement(warp.unwarp_at(point.map(|value| value as f32))).map(f64::from)
            }
            _ => [0.0; 2],
        }
    }

    /// dy/dt of the gas at (x, y), sheet heights per second: s / (dw/dy).
    fn gas_speed(&self, flame: &FlameInstance, x: f64, y: f64, t: f64) -> f64 {
        const STEP: f32 = 0.01;
        // A soot field rises uniformly, as the core does.
        let distance = match self.parameters.method {
            SheetMethod::FlameTexture => equations::axis_distance(x as f32),
            SheetMethod::SootField => 0.0,
        };
        let y = (y as f32).clamp(0.02, 0.98);
        let slope = (self.shape().slowed_rise_at(distance, y + STEP) - self.shape().slowed_rise_at(distance, y - STEP))
            / (2.0 * STEP);
        // Where the outline makes the mapping fold over, its slope is not that of the gas and is clamped.
        self.clock.speed(self.flame_time(flame, t)) / f64::from(slope.max(MIN_SLOPE))
    }
}
