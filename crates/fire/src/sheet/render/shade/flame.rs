//! Shading of the flame and of its flat texture square.

use bansho_base::math::simd::{Lanes, Real, any_positive};
use fearless_simd::Simd;

use super::{ShadedBatch, SheetState};
use crate::sheet::{
    eddies::MAX_EDDY_BAND,
    equations,
    render::projection::SheetCoordinates,
    tables::{
        color_ramp::ColorRamp,
        shape_tables::{FlameCoordinates, ShapeTables},
    },
    texture::FlameTexture,
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
    let t1 = excess(shape, &state.texture, coordinates);
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

/// T1, eq. (5), times the factor of soot by `thinning`.
///
/// The soot of layers that overlap adds: the square of the excess of the coarse layer, whose edges are soft, and half of that of the fine one, whose edges are
/// sharp.
#[inline(always)]
fn excess<S: Simd>(shape: &ShapeTables, texture: &FlameTexture, coordinates: &FlameCoordinates<S>) -> Lanes<S> {
    let FlameCoordinates { u, w, threshold, .. } = *coordinates;
    let soot = shape.soot(threshold);
    if let FlameTexture::Overlapping(table, layers) = texture {
        // Without a closure, which would be compiled for the baseline.
        let (coarse, fine) = (layers[0].sample(table, u, w), layers[1].sample(table, u, w));
        let coarse = equations::above_threshold(shape.apply_contrast(coarse), threshold);
        let fine = equations::above_threshold(shape.apply_contrast(fine), threshold);
        return coarse.fma(coarse, fine * u.broadcast(0.5)) * soot;
    }
    equations::above_threshold(shape.apply_contrast(texture.sample(u, w)), threshold) * soot
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
            let (mut x, mut y) = state.warp.unwarp(batch.x, batch.y);
            if let Some(eddies) = &state.eddies {
                if shape.is_outside(x, y, MAX_EDDY_BAND as f32 * state.pixel[1]) {
                    return FlameCoordinates::outside(y);
                }
                [x, y] = eddies.displace(x, y);
            }
            let mut coordinates = shape.coordinates(x, y, &state.warp.edges, state.pixel);
            shape.hide_below_fuel(&mut coordinates, batch.x, batch.y, state.pixel);
            coordinates
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

/// Heights w up to which the blue zone sets in, and at which it ends.
const BLUE_ONSET: f32 = 0.12;
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
    let across = equations::axis_distance(coordinates.u).simd_min(one);
    let up = (one - coordinates.w * one.broadcast(1.0 / BLUE_TOP)).simd_clamp01();
    let rim = (across * across).fma(one.broadcast(0.75), one.broadcast(0.25)) * (one - across) * one.broadcast(3.0);
    // It sets in over a short way above the base, whose row of pixels would else be a line.
    let onset = (coordinates.w * one.broadcast(1.0 / BLUE_ONSET)).simd_clamp01();
    let amount = up * up * rim * onset * coverage;
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use fearless_simd::SimdBase;

    use super::*;
    use crate::sheet::{
        FlameSheetParameters,
        tables::curve_pair::CurvePair,
        texture::{COLUMNS, ROWS, TextureLayer, TextureTable},
    };

    #[test]
    fn soot_of_overlapping_layers_adds_and_thins_with_the_threshold() {
        let mut parameters = FlameSheetParameters::default();
        parameters.texture.thinning = 0.6;
        let shape = ShapeTables::new(&parameters.shape, &parameters.texture, &parameters.color, |_| [0.0; 2]);
        let edges = CurvePair::from_samples(|_| [1.0, 1.0]);
        let table = Arc::new(TextureTable::new(&vec![0.7; ROWS * COLUMNS]));
        let layers = [TextureLayer::default(); 2];
        let t1 = |texture: &FlameTexture| {
            bansho_base::dispatch_baseline!(simd => {
                let half = Lanes::splat(simd, 0.5);
                let mut coordinates = shape.coordinates(half, half, &edges, [0.01, 0.01]);
                coordinates.threshold = Lanes::splat(simd, 0.2);
                excess(&shape, texture, &coordinates)[5]
            })
        };
        // T - L is 0.5. By hand: 0.5^2 + 0.5 / 2 = 0.5, and 1 - 0.6 * 0.2 = 0.88.
        let overlapping = t1(&FlameTexture::Overlapping(table.clone(), layers));
        assert!((overlapping - 0.5 * 0.88).abs() < 1e-5, "{overlapping}");
        let single = t1(&FlameTexture::Single(table, TextureLayer::default()));
        assert!((single - 0.5 * 0.88).abs() < 1e-5, "{single}");
    }
}
