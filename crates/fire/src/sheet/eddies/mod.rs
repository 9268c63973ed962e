//! Eddies that roll along the edges of a flame and rise slower than its gas.
//!
//! The outline and the texture of the sheet are sampled where the gas has come from: at `p + a(y) d(p)`, with d of [`table::EddyTables`], which rises with
//! the eddies, and an amplitude a that grows from 0 at the base, where the gas has not been carried anywhere yet, and returns to 0 at the top of the sheet.
//! The pattern of the gas passes through the eddies, so it moves sideways, curls, and tears.

mod table;

use bansho_base::math::{
    random::{Key, Purpose},
    simd::{Lanes, Real},
};
use fearless_simd::Simd;
use table::{EDDIES, EddyTables, SIZE, SPACING, VORTICES};

use super::{
    animate::clock::Clock,
    parameters::{FlameSheetParameters, SheetShapeParameters},
    texture::{LayerMapping, ROWS, TextureLayer},
};

/// Largest distance between rows in which the eddies are computed, pixels; between them coordinates are interpolated.
pub(crate) const MAX_EDDY_BAND: usize = 4;

/// The eddies of one flame.
#[derive(Clone, Debug)]
pub(crate) struct Eddies {
    mapping: LayerMapping,
    amplitude: Amplitude,
}

/// Amplitude of the displacement over the height y, and its scale up.
#[derive(Clone, Copy, Debug)]
struct Amplitude {
    strength: f32,
    /// 1 over the height at which it is reached, 1/height.
    inverse_height: f32,
    /// Displacement up in sheet heights for one of 1 in the table.
    up: f32,
}

impl Amplitude {
    /// Part of the sheet's height below its top within which the displacement returns to 0.
    const TOP: f32 = 0.15;

    /// `strength t (2 - t)` with `t` the height over that at which it is reached, and the same below the top.
    #[inline(always)]
    fn at<N: Real>(&self, y: N) -> N {
        let (one, two) = (y.broadcast(1.0), y.broadcast(2.0));
        let grown = (y * y.broadcast(self.inverse_height)).simd_clamp01();
        let left = ((one - y) * y.broadcast(1.0 / Self::TOP)).simd_clamp01();
        y.broadcast(self.strength) * (grown * (two - grown)) * (left * (two - left))
    }
}

impl Eddies {
    /// The eddies of a flame with the random numbers of `key`; `None` if it has none.
    pub(crate) fn new(parameters: &FlameSheetParameters, key: Key, clock: &Clock) -> Option<Self> {
        let SheetShapeParameters { eddies, eddy_size, eddy_speed, eddy_height, .. } = parameters.shape;
        if eddies <= 0.0 {
            return None;
        }
        // Of a sheet that is higher or wider than that, eddies would be finer than its texture, or larger than the sheet.
        let aspect = (parameters.height / parameters.width).clamp(0.05, 20.0);
        let start = f64::from(key.uniforms(0, 0, Purpose::named("eddies"))[0]);
        let mapping = LayerMapping {
            widths: 1.0 / SIZE[0],
            slant: 0.0,
            heights: aspect / (VORTICES as f64 * eddy_size),
            rate: eddy_speed,
            // x = 1/2 is the middle of the table.
            start: [0.5 - 0.5 / SIZE[0], start],
        };
        let amplitude = Amplitude {
            strength: eddies as f32,
            inverse_height: (1.0 / eddy_height) as f32,
            up: (eddy_size / SPACING / aspect) as f32,
        };
        Some(Self { mapping: mapping.fitted([1.0, 1.0], 1.0, clock), amplitude })
    }

    /// Largest displacement of either sign at height `y`, in sheet widths and heights.
    pub(crate) fn reach(&self, y: f32) -> [f32; 2] {
        let ([across, up], amplitude) = (EDDIES.largest, self.amplitude.at(y));
        [amplitude * across, amplitude * self.amplitude.up * up]
    }

    /// Texels of their tables per sheet height.
    pub(crate) fn texels_up(&self) -> f64 {
        ROWS as f64 * self.mapping.heights
    }

    /// The eddies after the texture has scrolled by `scroll` sheet heights.
    pub(crate) fn after(&self, scroll: f64) -> EddyState {
        EddyState { tables: &EDDIES, layer: self.mapping.after(scroll), amplitude: self.amplitude }
    }
}

/// The eddies of one flame at one time.
#[derive(Clone, Debug)]
pub(crate) struct EddyState {
    tables: &'static EddyTables,
    layer: TextureLayer,
    amplitude: Amplitude,
}

impl EddyState {
    /// Where the gas at sixteen points of the sheet would be without eddies.
    #[inline(always)]
    pub(crate) fn displace<S: Simd>(&self, x: Lanes<S>, y: Lanes<S>) -> [Lanes<S>; 2] {
        let amplitude = self.amplitude.at(y);
        let [across, up] = &self.tables.components;
        let (column, row) = self.layer.texel(x, y);
        let (across, up) = (across.sample(column, row), up.sample(column, row));
        [across.fma(amplitude, x), (up * up.broadcast(self.amplitude.up)).fma(amplitude, y)]
    }

    /// The displacement at one point, as in [`displace`](Self::displace).
    pub(crate) fn displacement(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let amplitude = self.amplitude.at(y);
        let (column, row) = self.layer.texel_at([x, y]);
        let [across, up] = self.tables.components.each_ref().map(|table| table.bilinear(column, row));
        [amplitude * across, amplitude * self.amplitude.up * up]
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::{math::simd::LANES, parameters::animated::Animated};
    use fearless_simd::prelude::*;

    use super::*;

    fn eddies(parameters: &FlameSheetParameters, loop_s: Option<f64>) -> (Eddies, Clock) {
        let clock = Clock::new(Animated::from(1.3), loop_s);
        (Eddies::new(parameters, Key::new(3, "test"), &clock).unwrap(), clock)
    }

    /// Displacements across and up of sixteen points across the sheet at height `y`.
    fn row(state: &EddyState, y: f32) -> Vec<[f32; 2]> {
        bansho_base::dispatch_baseline!(simd => {
            let x = Lanes::from_fn(simd, |i| i as f32 / 15.0);
            let [across, up] = state.displace(x, x.broadcast(y));
            (0..LANES).map(|i| [across[i] - x[i], up[i] - y]).collect()
        })
    }

    #[test]
    fn nothing_is_displaced_at_the_base_and_at_the_top() {
        let (eddies, clock) = eddies(&FlameSheetParameters::default(), None);
        for step in 0..50 {
            let state = eddies.after(clock.scroll(0.37 * f64::from(step)));
            for y in [0.0, 1.0] {
                assert!(row(&state, y).iter().flatten().all(|way| way.abs() < 1e-6), "{step}, {y}");
            }
        }
    }

    #[test]
    fn one_point_is_displaced_as_sixteen_are() {
        let (eddies, clock) = eddies(&FlameSheetParameters::default(), None);
        let state = eddies.after(clock.scroll(2.2));
        for (i, way) in row(&state, 0.37).into_iter().enumerate() {
            let single = state.displacement([i as f32 / 15.0, 0.37]);
            assert!((way[0] - single[0]).abs() < 1e-5 && (way[1] - single[1]).abs() < 1e-5, "{way:?} {single:?}");
        }
    }

    #[test]
    fn displacements_are_within_reach_and_come_near_to_it() {
        let (eddies, clock) = eddies(&FlameSheetParameters::default(), None);
        let mut most = [0.0_f32; 2];
        let reach = eddies.reach(0.6);
        for step in 0..300 {
            let state = eddies.after(clock.scroll(0.11 * f64::from(step)));
            for way in row(&state, 0.6) {
                most = [most[0].max(way[0].abs()), most[1].max(way[1].abs())];
            }
        }
        assert!((0..2).all(|k| most[k] <= reach[k] && most[k] > 0.5 * reach[k]), "{most:?} of {reach:?}");
    }

    #[test]
    fn eddies_rise_at_their_own_speed() {
        let parameters = FlameSheetParameters::default();
        let (eddies, _) = eddies(&parameters, None);
        // At both heights the amplitude is the same.
        let (before, after) = (row(&eddies.after(5.0), 0.45), row(&eddies.after(5.25), 0.45 + 0.25 * 0.4));
        assert_eq!(parameters.shape.eddy_speed, 0.4);
        for (a, b) in before.iter().zip(&after) {
            assert!((a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3, "{a:?} {b:?}");
        }
    }

    #[test]
    fn a_loop_closes_whatever_its_length() {
        for length in [1.0, 2.4, 4.0, 7.3] {
            let (eddies, clock) = eddies(&FlameSheetParameters::default(), Some(length));
            let (end, start) = (eddies.after(clock.scroll(length * (1.0 - 1e-9))), eddies.after(clock.scroll(0.0)));
            for (a, b) in row(&end, 0.5).iter().zip(&row(&start, 0.5)) {
                assert!((a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3, "{length}: {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn an_eddy_is_round_in_meters_whatever_the_shape_of_the_sheet() {
        // Twice as high a sheet of the same width: at half the height in sheet heights, the same displacement across, and half of it up.
        let mut parameters = FlameSheetParameters { width: 1.0, height: 1.0, ..FlameSheetParameters::default() };
        parameters.shape.eddy_height = 0.02;
        let (low, _) = eddies(&parameters, None);
        let (high, _) = eddies(&FlameSheetParameters { height: 2.0, ..parameters }, None);
        for (a, b) in row(&low.after(0.0), 0.7).iter().zip(&row(&high.after(0.0), 0.35)) {
            assert!((a[0] - b[0]).abs() < 1e-3 && (a[1] - 2.0 * b[1]).abs() < 1e-3, "{a:?} {b:?}");
        }
    }
}
