//! The warp of a flame's coordinates at one time: fluttering edges, sway, flicker and wind.

use bansho_base::{
    math::{
        self, DVec3,
        random::{Key, Purpose},
        simd::{Lanes, Real},
    },
    world::wind::Wind,
};
use fearless_simd::Simd;

use super::{clock::Clock, edge_waves::EdgeWaves, fluctuation::Fluctuation};
use crate::sheet::{
    parameters::{FlameSheetParameters, SheetShapeParameters},
    tables::{
        curve_pair::{CurvePair, SEGMENTS, lookup_index},
        shape_tables::ShapeTables,
    },
};

/// The fluctuations of one flame: its edges P (15), the sway of its center line and the flicker of its height.
#[derive(Clone, Debug)]
pub(crate) struct FlameWaves {
    left: EdgeWaves,
    right: EdgeWaves,
    sway: Fluctuation,
    flicker: Fluctuation,
}

impl FlameWaves {
    /// The fluctuations of a flame of this shape with the random numbers of `key`.
    pub(crate) fn new(shape: &SheetShapeParameters, key: Key, clock: &Clock) -> Self {
        // Edges scroll with the texture, so that in a loop a whole number of their waves passes; sway and flicker are functions of time.
        let [left, right] = [(Purpose::named("left edge"), 0.5), (Purpose::named("right edge"), 0.0)]
            .map(|(purpose, phase)| EdgeWaves::new(shape, key, purpose, phase, clock));
        let [sway, flicker] =
            [(Purpose::named("sway"), shape.sway_hz, 0.5), (Purpose::named("flicker"), shape.flicker_hz, 0.6)]
                .map(|(purpose, hz, roughness)| Fluctuation::new(key, purpose, hz, roughness, |f| clock.frequency(f)));
        Self { left, right, sway, flicker }
    }
}

/// How the wind deflects a sheet: tangents of the gas's path to the right and toward `right x up`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WindLean {
    /// Tangent at the top, to the right.
    pub(crate) across: f64,
    /// Tangent toward the front of the sheet.
    pub(crate) toward: f64,
}

impl WindLean {
    /// Maximum of both tangents.
    const MAX_TANGENT: f64 = 1.5;

    /// Deflection by `wind` at `point` of gas that rises at `rise_speed` m/s.
    ///
    /// The tangent is the ratio of drift to rise. It saturates smoothly, since a sheet cannot represent a horizontal flame.
    pub(crate) fn new(wind: &Wind, point: DVec3, t: f64, right: DVec3, rise_speed: f64, response: f64) -> Self {
        let velocity = wind.at(point, t) * (response / rise_speed.max(0.05));
        let [across, toward] = [velocity.dot(right), velocity.dot(right.cross(DVec3::Y))]
            .map(|tangent| Self::MAX_TANGENT * math::tanh(tangent / Self::MAX_TANGENT));
        Self { across, toward }
    }
}

/// The warp of one flame at one time.
#[derive(Clone, Debug)]
pub(crate) struct WarpState {
    /// E, eq. (15), left and right, over w.
    pub(crate) edges: CurvePair,
    /// Displacement of the center line to the right, in sheet widths, over y.
    center: CurvePair,
    /// Minimum and maximum displacement.
    pub(crate) center_range: [f64; 2],
    /// Factor of y: mean height over current height, times the headroom of the sheet.
    height_scale: f32,
    /// Distance that the texture has scrolled, sheet heights.
    pub(crate) scroll: f64,
}

impl WarpState {
    /// The warp at time `t` (of the flame itself, phase included), deflected by `lean`.
    pub(crate) fn new(
        parameters: &FlameSheetParameters,
        shape: &ShapeTables,
        waves: &FlameWaves,
        clock: &Clock,
        t: f64,
        lean: WindLean,
    ) -> Self {
        let level = bansho_base::math::simd::level();
        fearless_simd::dispatch!(level, _simd => evaluate_warp(parameters, shape, waves, clock, t, lean))
    }

    /// The warp of a flame that is `fraction` as high.
    pub(crate) fn with_height(self, fraction: f64) -> Self {
        Self { height_scale: self.height_scale / fraction as f32, ..self }
    }

    /// Inverse warp: the point of the undeformed flame of mean height that appears at (x, y) of the sheet.
    #[inline(always)]
    pub(crate) fn unwarp<S: Simd>(&self, x: Lanes<S>, y: Lanes<S>) -> (Lanes<S>, Lanes<S>) {
        let [center, _] = self.center.lookup(&lookup_index(y));
        (x - center, y * y.broadcast(self.height_scale))
    }

    /// [`unwarp`](Self::unwarp) for one point.
    #[inline(always)]
    pub(crate) fn unwarp_at(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        [x - self.center.at(y)[0], y * self.height_scale]
    }

    /// Displacement of the center line at height y, in sheet widths.
    pub(crate) fn center(&self, y: f64) -> f64 {
        f64::from(self.center.at(y as f32)[0])
    }
}

#[inline(always)]
fn evaluate_warp(
    parameters: &FlameSheetParameters,
    shape: &ShapeTables,
    waves: &FlameWaves,
    clock: &Clock,
    t: f64,
    lean: WindLean,
) -> WarpState {
    let (time, scroll) = (clock.time(t), clock.scroll(t));
    let shape_parameters = &parameters.shape;
    let flutter = shape_parameters.flutter as f32;
    let edges =
        shape.edges(&edge_fluctuation(&waves.left, scroll, flutter), &edge_fluctuation(&waves.right, scroll, flutter));
    let center = center_line(parameters, waves, time, lean);
    let samples = (0..=16).map(|i| f64::from(center.at(i as f32 / 16.0)[0]));
    let center_range = samples.fold([0.0_f64; 2], |[low, high], value| [low.min(value), high.max(value)]);
    let flicker = shape_parameters.flicker * f64::from(waves.flicker.at(time));
    // Sheets have headroom: at the mean height the flame fills 1 / (1 + flicker) of the sheet.
    let height_scale = ((1.0 + shape_parameters.flicker) / (1.0 + flicker)) as f32;
    WarpState { edges, center, center_range, height_scale, scroll }
}

/// P(w - s (t-t0)) of eq. (15), in [0, 1], over w after `scroll` sheet heights: the weaker the flutter, the closer it stays to 1, the outer edge of the fringe.
#[inline(always)]
fn edge_fluctuation(waves: &EdgeWaves, scroll: f64, flutter: f32) -> [f32; SEGMENTS + 1] {
    let mut values = [0.0; SEGMENTS + 1];
    waves.fill(-scroll, 1.0 / SEGMENTS as f64, &mut values);
    for value in &mut values {
        *value = (0.5 * flutter).mul_add(*value - 1.0, 1.0);
    }
    values
}

/// Center line of a flame at one time. Its displacement is proportional to y^1.5, as for gas that accelerates upward in uniform wind; sway travels upward
/// with the gas.
#[inline(always)]
fn center_line(parameters: &FlameSheetParameters, waves: &FlameWaves, time: f64, lean: WindLean) -> CurvePair {
    /// Time for sway to travel from base to tip, as a fraction of its period.
    const LAG: f64 = 0.6;
    let shape_parameters = &parameters.shape;
    let bend = lean.across * parameters.height / parameters.width / 1.5;
    let mut swings = [0.0; SEGMENTS + 1];
    waves.sway.fill(time, -LAG / shape_parameters.sway_hz / SEGMENTS as f64, &mut swings);
    CurvePair::from_samples(|i| {
        let y = i as f32 / SEGMENTS as f32;
        let drift = y * y.sqrt();
        [drift * (shape_parameters.sway as f32).mul_add(swings[i], bend as f32), 0.0]
    })
}
