//! Shading of a soot field: light and opacity of sixteen pixels, by table lookups.

use bansho_base::math::simd::{LANES, Lanes, Real, any_positive, linspace};
use fearless_simd::Simd;

use crate::sheet::{
    animate::warp::WarpState,
    equations,
    render::{
        projection::SheetCoordinates,
        shade::{
            ShadedBatch,
            smoke::{LIGHT_SAMPLES, scattered_at, unfused_smoothstep},
        },
    },
    soot_field::{displacement::Displacement, plume::PlumeTables},
};

/// Distance from the side of the sheet over which the soot thins out, sheet widths.
const SIDE_FADE: f32 = 0.1;
/// Distance from the top of the sheet over which the soot thins out, sheet heights.
const TOP_FADE: f32 = 0.3;

/// A soot field at one time.
pub(crate) struct SootState {
    /// Center line and height.
    pub(super) warp: WarpState,
    /// The fractal field.
    pub(super) displacement: Displacement,
    /// Root mean square of the displacement, in sheet widths and in sheet heights.
    pub(super) stir: [f32; 2],
    /// k of the rise (9), by which eddies accelerate.
    pub(super) initial_speed: f32,
    /// Luminance of the hottest soot, cd/m^2.
    pub(super) luminance: f32,
    /// Radiance that opaque soot scatters toward the viewer, at `LIGHT_SAMPLES` heights; ACEScg, cd/m^2.
    pub(super) scattered: [[f32; 3]; LIGHT_SAMPLES],
}

/// Radiance in cd/m^2, opacity, and as `t1` the temperature in K, of sixteen pixels; `None` if all are empty.
#[inline(always)]
pub(super) fn shade_soot<S: Simd>(
    tables: &PlumeTables,
    state: &SootState,
    batch: &SheetCoordinates<S>,
) -> Option<ShadedBatch<S>> {
    let (x, y) = state.warp.unwarp(batch.x, batch.y);
    let envelope = envelope(x, batch.y);
    if !any_positive(envelope) {
        return None;
    }
    let half = x.broadcast(0.5);
    let [across, up] = state.displacement.sample(x, equations::rise(y.simd_clamp01(), state.initial_speed));
    let growth = tables.growth(y);
    let distance = (across * growth).fma(x.broadcast(state.stir[0]), x - half).simd_abs();
    let height = (up * growth).fma(x.broadcast(state.stir[1]), y);
    let soot = tables.soot(distance, height);
    let opacity = tables.opacity(soot.relative_depth * envelope);
    if !any_positive(opacity) {
        return None;
    }
    let [red, green, blue, kelvin] = tables.light(soot.excess);
    let low = scattered_at(&state.scattered, batch.y[0]);
    let high = scattered_at(&state.scattered, batch.y[LANES - 1]);
    let luminance = x.broadcast(state.luminance);
    let mut light = [red, green, blue, opacity];
    for k in 0..3 {
        light[k] = light[k].fma(luminance, linspace(x.simd, low[k], high[k])) * opacity;
    }
    Some(ShadedBatch { t1: kelvin, light })
}

/// Factor of the optical depth that ends the soot smoothly at the sides and the top of the sheet; 0 outside.
#[inline(always)]
fn envelope<S: Simd>(x: Lanes<S>, y: Lanes<S>) -> Lanes<S> {
    let (zero, half, one) = (x.broadcast(0.0), x.broadcast(0.5), x.broadcast(1.0));
    let sides = unfused_smoothstep((half - (x - half).simd_abs()) * one.broadcast(1.0 / SIDE_FADE));
    let top = unfused_smoothstep((one - y) * one.broadcast(1.0 / TOP_FADE));
    zero.select_lt(y, sides * top, zero)
}
