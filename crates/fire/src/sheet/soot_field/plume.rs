//! The undisturbed plume in closed form, and its tables.
//!
//! The section of the plume is Gaussian. A Gaussian distribution of soot, integrated along a line of sight at the distance x from the axis, is a Gaussian
//! of x with the same width, so that the optical depth needs no integration.

use bansho_base::{
    color,
    math::{
        self,
        simd::{Lanes, Real, gather, round_to_u32},
    },
};
use fearless_simd::Simd;

use crate::sheet::{
    parameters::{ColorParameters, SootFieldParameters},
    tables::curve_pair::{CurvePair, lookup_index, table_index},
};

/// Height up to which the plume is tabulated, sheet heights: displacements may reach above the sheet.
const MAX_HEIGHT: f64 = 2.0;
/// Distance from the axis, in half widths, at which the section ends; exp(-9) is below what a display shows.
const MAX_ACROSS: f64 = 3.0;
/// Height over which the soot forms, sheet heights.
const FORMATION_HEIGHT: f64 = 0.05;
/// Entries of light over temperature: less than 1 K apart, so that nearest-neighbor lookup suffices.
const ENTRIES: usize = 4096;

/// Half width at `height`, sheet widths: a buoyant plume entrains air in proportion to its speed and widens linearly (Morton, Taylor and Turner 1956).
pub(crate) fn half_width(plume: &SootFieldParameters, height: f64) -> f64 {
    plume.spread * height.max(0.0) + plume.base_half_width
}

/// Optical depth through the axis at `height`.
pub(crate) fn axis_optical_depth(plume: &SootFieldParameters, height: f64) -> f64 {
    let formed = math::smoothstep(0.0, 1.0, height / FORMATION_HEIGHT);
    plume.optical_depth * formed * math::pow(plume.base_half_width / half_width(plume, height), plume.dilution)
}

/// Excess temperature on the axis at `height` relative to that at the base: 1 in the flame, and proportional to height^(-5/3) in the plume above it
/// (McCaffrey 1979), with a smooth transition.
pub(crate) fn axis_excess(plume: &SootFieldParameters, height: f64) -> f64 {
    const EXPONENT: f64 = 5.0 / 3.0;
    let relative = height.max(0.0) / plume.flame_height;
    math::pow(1.0 + relative * relative * relative, -EXPONENT / 3.0)
}

/// Profile of the optical depth at the distance `across` from the axis, in half widths: a Gaussian, lowered to 0 at [`MAX_ACROSS`].
pub(crate) fn profile(across: f64) -> f64 {
    let end = math::exp(-MAX_ACROSS * MAX_ACROSS);
    ((math::exp(-across * across) - end) / (1.0 - end)).max(0.0)
}

/// Profile of the excess temperature.
pub(crate) fn excess_profile(plume: &SootFieldParameters, across: f64) -> f64 {
    math::exp(-plume.edge_cooling * across * across)
}

/// Soot at sixteen points.
#[derive(Clone, Copy)]
pub(crate) struct Soot<S: Simd> {
    /// Optical depth relative to that through the axis at the base.
    pub(crate) relative_depth: Lanes<S>,
    /// Excess temperature relative to that on the axis at the base.
    pub(crate) excess: Lanes<S>,
}

/// The closed forms as tables.
#[derive(Clone, Debug)]
pub(crate) struct PlumeTables {
    /// Reciprocal of the half width, and relative optical depth on the axis, over height / [`MAX_HEIGHT`].
    axis: CurvePair,
    /// Relative excess temperature on the axis, over height / [`MAX_HEIGHT`].
    axis_excess: CurvePair,
    /// Profiles of optical depth and excess temperature, over the distance from the axis / [`MAX_ACROSS`].
    section: CurvePair,
    /// Fraction of the displacement, over height in the sheet.
    growth: CurvePair,
    /// Opacity 1 - exp(-tau) over the relative optical depth.
    opacity: CurvePair,
    /// Radiance of a black body (ACEScg, luminance 1 at the core's temperature) and temperature in K, over the relative excess temperature.
    light: Box<[[f32; 4]; ENTRIES]>,
}

impl PlumeTables {
    pub(crate) fn new(plume: &SootFieldParameters, color: &ColorParameters) -> Self {
        let depth = plume.optical_depth.max(f64::MIN_POSITIVE);
        Self {
            axis: CurvePair::new(|fraction| {
                let height = fraction * MAX_HEIGHT;
                [1.0 / half_width(plume, height), axis_optical_depth(plume, height) / depth]
            }),
            axis_excess: CurvePair::new(|fraction| [axis_excess(plume, fraction * MAX_HEIGHT), 0.0]),
            section: CurvePair::new(|fraction| {
                [profile(fraction * MAX_ACROSS), excess_profile(plume, fraction * MAX_ACROSS)]
            }),
            growth: CurvePair::new(|height| [(height / plume.stir_height).min(1.0), 0.0]),
            opacity: CurvePair::new(|relative| [-math::exp_m1(-plume.optical_depth * relative), 0.0]),
            light: tabulate_light(plume, color),
        }
    }

    /// Fraction of the displacement at `height`.
    #[inline(always)]
    pub(crate) fn growth<S: Simd>(&self, height: Lanes<S>) -> Lanes<S> {
        let [growth, _] = self.growth.lookup(&lookup_index(height));
        growth
    }

    /// The soot at a distance from the axis, sheet widths, and a height, sheet heights.
    #[inline(always)]
    pub(crate) fn soot<S: Simd>(&self, distance: Lanes<S>, height: Lanes<S>) -> Soot<S> {
        let at = table_index(height * height.broadcast((1.0 / MAX_HEIGHT) as f32));
        let ([inverse_half_width, relative_depth], [excess, _]) = (self.axis.fetch(&at), self.axis_excess.fetch(&at));
        let across = distance * inverse_half_width;
        let [depth_profile, excess_profile] = self.section.sample(across * across.broadcast((1.0 / MAX_ACROSS) as f32));
        Soot { relative_depth: relative_depth * depth_profile, excess: excess * excess_profile }
    }

    /// 1 - exp(-tau).
    #[inline(always)]
    pub(crate) fn opacity<S: Simd>(&self, relative_depth: Lanes<S>) -> Lanes<S> {
        let [opacity, _] = self.opacity.sample(relative_depth);
        opacity
    }

    /// Black-body radiance, of luminance up to 1, and temperature.
    #[inline(always)]
    pub(crate) fn light<S: Simd>(&self, excess: Lanes<S>) -> [Lanes<S>; 4] {
        let scaled = excess.simd_clamp01() * excess.broadcast((ENTRIES - 1) as f32);
        gather(excess.simd, &self.light, round_to_u32(scaled))
    }
}

fn tabulate_light(plume: &SootFieldParameters, color: &ColorParameters) -> Box<[[f32; 4]; ENTRIES]> {
    let luminance = color::luminance(color::black_body().radiance(color.core_temperature_k as f32));
    let scale = if luminance > 0.0 { 1.0 / luminance } else { 0.0 };
    let mut entries = Box::new([[0.0; 4]; ENTRIES]);
    for (i, entry) in entries.iter_mut().enumerate() {
        let excess = i as f64 / (ENTRIES - 1) as f64;
        let kelvin = math::lerp(plume.ambient_temperature_k, color.core_temperature_k, excess) as f32;
        let [r, g, b] = color::black_body().radiance(kelvin).map(|value| value * scale);
        *entry = [r, g, b, kelvin];
    }
    entries
}

#[cfg(test)]
mod tests {
    use fearless_simd::SimdBase;

    use super::*;

    fn plume() -> SootFieldParameters {
        SootFieldParameters {
            optical_depth: 2.0,
            base_half_width: 0.1,
            spread: 0.3,
            dilution: 1.0,
            flame_height: 0.25,
            edge_cooling: 0.5,
            ..SootFieldParameters::default()
        }
    }

    #[test]
    fn the_undisturbed_plume_has_hand_worked_values() {
        let plume = plume();
        // 0.1 + 0.3 / 3 is twice the half width at the base, so half the optical depth.
        assert!((half_width(&plume, 1.0 / 3.0) - 0.2).abs() < 1e-12);
        assert!((axis_optical_depth(&plume, 1.0 / 3.0) - 1.0).abs() < 1e-12);
        assert_eq!(axis_optical_depth(&plume, 0.0), 0.0);
        // At the flame's height 2^(-5/9); four and eight times as high, where 1 is small beside 64 and 512, nearly 4^(-5/3) and 8^(-5/3).
        assert!((axis_excess(&plume, 0.25) - 0.680_395).abs() < 1e-6);
        assert_eq!(axis_excess(&plume, 0.0), 1.0);
        let exponent = math::ln(axis_excess(&plume, 8.0) / axis_excess(&plume, 4.0)) / math::ln(2.0);
        assert!((exponent + 5.0 / 3.0).abs() < 1e-3, "{exponent}");
        assert!((profile(1.0) - 0.367_8).abs() < 2e-4 && profile(0.0) == 1.0 && profile(3.5) == 0.0);
        assert!((excess_profile(&plume, 2.0) - 0.135_335).abs() < 1e-6);
    }

    #[test]
    fn tables_are_the_closed_forms() {
        let (plume, color) = (plume(), ColorParameters { core_temperature_k: 1900.0, ..ColorParameters::default() });
        let tables = PlumeTables::new(&plume, &color);
        for (distance, height) in [(0.0, 0.1), (0.05, 0.2), (0.2, 0.35), (0.3, 0.7), (0.1, 1.4), (0.9, 0.2)] {
            let [relative_depth, excess, opacity, red, kelvin] = bansho_base::dispatch_baseline!(simd => {
                let soot = tables.soot(Lanes::splat(simd, distance as f32), Lanes::splat(simd, height as f32));
                let [red, _, _, kelvin] = tables.light(soot.excess);
                [soot.relative_depth, soot.excess, tables.opacity(soot.relative_depth), red, kelvin].map(|lanes| lanes[3])
            });
            let across = distance / half_width(&plume, height);
            let depth = axis_optical_depth(&plume, height) * profile(across);
            assert!((f64::from(relative_depth) * 2.0 - depth).abs() < 2e-3, "{distance} {height}: {relative_depth}");
            assert!((f64::from(opacity) + math::exp_m1(-depth)).abs() < 2e-3, "{opacity}");
            if across < MAX_ACROSS {
                let wanted = axis_excess(&plume, height) * excess_profile(&plume, across);
                assert!((f64::from(excess) - wanted).abs() < 2e-3, "{distance} {height}: {excess} {wanted}");
                assert!((f64::from(kelvin) - (290.0 + 1610.0 * wanted)).abs() < 4.0);
            }
            let hottest = color::luminance(color::black_body().radiance(1900.0));
            let wanted = color::black_body().radiance(kelvin)[0] / hottest;
            assert!((red - wanted).abs() < 1e-5 + 1e-4 * wanted, "{red} {wanted}");
        }
    }
}
