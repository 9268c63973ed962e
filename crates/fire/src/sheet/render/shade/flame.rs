//! Shading of the flame and of its flat texture square.

use bansho_base::math::simd::{Lanes, Real, any_positive};
use fearless_simd::Simd;

use super::{ShadedBatch, SheetState};
use crate::sheet::{
    equations,
    render::projection::SheetCoordinates,
    tables::{
        color_ramp::ColorRamp,
        shape_tables::{FlameCoordinates, ShapeTables},
    },
};

/// Light and opacity at flame coordinates; `None` if all pixels are empty.
#[inline(always)]
pub(crate) fn shade_coordinates<S: Simd>(
    shape: &ShapeTables,
    ramp: &ColorRamp,
    state: &SheetState,
    coordinates: &FlameCoordinates<S>,
) -> Option<ShadedBatch<S>> {
    let coverage = coordinates.coverage(state.pixel);
    if !any_positive(coverage) {
        return None;
    }
    let t1 = equations::above_threshold(
        shape.apply_contrast(state.texture.sample(coordinates.u, coordinates.w)),
        coordinates.threshold,
    );
    let zero = t1.broadcast(0.0);
    let strength = zero.select_lt(t1, coverage * coordinates.glow, zero);
    let has_blue_zone = ramp.base_blue[2] > 0.0 && any_positive(coordinates.w.broadcast(BLUE_TOP) - coordinates.w);
    if !has_blue_zone && !any_positive(strength) {
        return None;
    }
    let [red, green_over_red] = coordinates.cooling;
    let (red, opacity) = (red * strength, strength);
    let green = red * green_over_red;
    let blue = green * green_over_red * green_over_red.simd_sqrt();
    let mut light = ramp.light(t1);
    for (plane, factor) in light.iter_mut().zip([red, green, blue, opacity]) {
        *plane *= factor;
    }
    if has_blue_zone {
        add_base_blue(&mut light, ramp, coordinates, coverage);
    }
    Some(ShadedBatch { t1, light })
}

/// Flame coordinates of a batch of pixels. Not inlined, so that the code is compiled once.
pub(crate) fn coordinates<S: Simd>(
    shape: &ShapeTables,
    state: &SheetState,
    batch: &SheetCoordinates<S>,
) -> FlameCoordinates<S> {
    batch.x.simd.vectorize(
        #[inline(always)]
        || {
            let (x, y) = state.warp.unwarp(batch.x, batch.y);
            shape.coordinates(x, y, &state.warp.edges, state.pixel)
        },
    )
}

/// Light and opacity of a batch of pixels of the flame; `None` if all are empty. Not inlined, so that the code is compiled once.
pub(crate) fn shade<S: Simd>(
    shape: &ShapeTables,
    ramp: &ColorRamp,
    state: &SheetState,
    batch: &SheetCoordinates<S>,
) -> Option<ShadedBatch<S>> {
    let coordinates = coordinates(shape, state, batch);
    batch.x.simd.vectorize(
        #[inline(always)]
        || shade_coordinates(shape, ramp, state, &coordinates),
    )
}

/// Height w at which the blue zone ends.
const BLUE_TOP: f32 = 0.45;

/// Adds the blue zone at the flame's lower edge, where fuel burns before soot has formed.
#[inline(always)]
fn add_base_blue<S: Simd>(
    light: &mut [Lanes<S>; 4],
    ramp: &ColorRamp,
    coordinates: &FlameCoordinates<S>,
    coverage: Lanes<S>,
) {
    let one = coordinates.w.broadcast(1.0);
    let across = equations::axis_distance(coordinates.u);
    let up = (one - coordinates.w * one.broadcast(1.0 / BLUE_TOP)).simd_clamp01();
    let rim = (across * across).fma(one.broadcast(0.75), one.broadcast(0.25)) * (one - across) * one.broadcast(3.0);
    let amount = up * up * rim * coverage;
    for (plane, blue) in light.iter_mut().zip(ramp.base_blue) {
        *plane = amount.fma(one.broadcast(blue), *plane);
    }
}

/// Distance from [0, 1]: 0 within.
#[inline(always)]
fn distance_from_unit_interval<S: Simd>(x: Lanes<S>) -> Lanes<S> {
    let (zero, one) = (x.broadcast(0.0), x.broadcast(1.0));
    (zero - x).simd_max(x - one).simd_max(zero)
}

/// Shades the flat texture square of the paper's pictures 1 to 4, after the threshold if `thresholded`.
#[inline(always)]
pub(super) fn shade_flat<S: Simd>(
    shape: &ShapeTables,
    ramp: &ColorRamp,
    state: &SheetState,
    batch: &SheetCoordinates<S>,
    thresholded: bool,
) -> Option<ShadedBatch<S>> {
    let (zero, one) = (batch.x.broadcast(0.0), batch.x.broadcast(1.0));
    let outside = distance_from_unit_interval(batch.x) + distance_from_unit_interval(batch.y);
    let strength = zero.select_lt(outside, zero, one);
    if !any_positive(strength) {
        return None;
    }
    let texture = shape.apply_contrast(state.texture.sample(batch.x, batch.y));
    let t1 =
        if thresholded { equations::above_threshold(texture, shape.flat_threshold(batch.x, batch.y)) } else { texture };
    let mut light = ramp.light(t1);
    for plane in &mut light {
        *plane *= strength;
    }
    Some(ShadedBatch { t1, light })
}
