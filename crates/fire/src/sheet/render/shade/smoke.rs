//! Shading of smoke: absorption and light that it scatters once.

use bansho_base::math::{
    self, approximations,
    simd::{LANES, Lanes, Real, any_positive, linspace},
};
use fearless_simd::{Simd, prelude::*};

use super::{ShadedBatch, SheetState};
use crate::sheet::render::projection::SheetCoordinates;

/// Number of heights at which the light on the smoke is sampled.
pub(crate) const LIGHT_SAMPLES: usize = 17;

/// Properties of smoke at one time.
#[derive(Clone, Debug)]
pub(crate) struct SmokeState {
    /// Maximum optical depth.
    pub(crate) optical_depth: f32,
    /// Width at the base relative to that at the top.
    pub(crate) base_width: f32,
    /// Radiance that opaque smoke scatters toward the viewer, at `LIGHT_SAMPLES` heights; ACEScg, cd/m^2.
    pub(crate) scattered: [[f32; 3]; LIGHT_SAMPLES],
}

/// Scattered light at height `y`, interpolated.
pub(crate) fn scattered_at(scattered: &[[f32; 3]; LIGHT_SAMPLES], y: f32) -> [f32; 3] {
    let scaled = y.simd_clamp01() * (LIGHT_SAMPLES - 1) as f32;
    let below = (scaled as usize).min(LIGHT_SAMPLES - 2);
    let fraction = scaled - below as f32;
    std::array::from_fn(|k| math::f32::lerp(scattered[below][k], scattered[below + 1][k], fraction))
}

/// The cubic `3 t^2 - 2 t^3` of `t` clamped to [0, 1]. It is not fused, unlike `simd_smoothstep`: its last bits differ.
#[inline(always)]
pub(crate) fn unfused_smoothstep<S: Simd>(t: Lanes<S>) -> Lanes<S> {
    let clamped = t.simd_clamp01();
    clamped * clamped * (t.broadcast(3.0) - t.broadcast(2.0) * clamped)
}

/// Light and opacity of sixteen pixels of smoke; `None` if all are empty.
#[inline(always)]
pub(super) fn shade_smoke<S: Simd>(
    state: &SheetState,
    smoke: &SmokeState,
    batch: &SheetCoordinates<S>,
) -> Option<ShadedBatch<S>> {
    let (x, y) = state.warp.unwarp(batch.x, batch.y);
    let (zero, one) = (x.broadcast(0.0), x.broadcast(1.0));
    // The plume widens as it rises; its density decreases smoothly to 0 at all edges.
    let width =
        y.simd_max(zero).simd_sqrt().fma(one - one.broadcast(smoke.base_width), one.broadcast(smoke.base_width));
    let across = (one.broadcast(2.0) * (x - one.broadcast(0.5))).simd_abs() / width;
    let side = unfused_smoothstep(one - across);
    let ends = unfused_smoothstep(y * one.broadcast(4.0)) * unfused_smoothstep((one - y) * one.broadcast(1.6));
    let envelope = side * ends;
    if !any_positive(envelope) {
        return None;
    }
    let u = x.select_lt(one.broadcast(0.5), zero - across, across).fma(one.broadcast(0.5), one.broadcast(0.5));
    let gas = state.texture.sample(u, y);
    let density = (gas - (one - envelope)).simd_max(zero) * envelope;
    let mut opacity = [0.0; LANES];
    for lane in 0..LANES {
        opacity[lane] = 1.0 - approximations::exp(-smoke.optical_depth * density[lane]);
    }
    let opacity = Lanes::from_slice(x.simd, &opacity);
    let (first, last) = (y[0], y[LANES - 1]);
    let (low, high) = (scattered_at(&smoke.scattered, first), scattered_at(&smoke.scattered, last));
    let mut light = [opacity; 4];
    for k in 0..3 {
        light[k] = linspace(x.simd, low[k], high[k]) * opacity;
    }
    Some(ShadedBatch { t1: density, light })
}
