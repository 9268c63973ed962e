//! From kilorayleighs to color, with the extinction of the lower atmosphere.

use std::f64::consts::FRAC_PI_2;

use bansho_base::math::{
    self, DVec3,
    simd::{FourLanes, Real},
};
use fearless_simd::{Simd, prelude::*};

use crate::{
    physics::{
        emission::{ColorMatching, EMITTERS, LineSet, PerEmitter, SpectralEmitter},
        extinction::Extinction,
    },
    render::RenderingParameters,
};

/// Steps from the horizon to the zenith, uniform in the square root of the sine of the elevation: extinction varies
/// rapidly near the horizon.
const STEPS: usize = 1024;
/// Effective wavelength of the visible first positive bands, nm.
const BANDS_NM: f64 = 655.0;

/// ACEScg of a kilorayleigh of each emitter by elevation; luminance in cd/m^2.
#[derive(Clone, Debug)]
pub(crate) struct EmitterColors {
    /// Red, green, blue, and 1 for emitters that contribute to the brightness, else 0.
    colors: Vec<PerEmitter<[f32; 4]>>,
}

impl EmitterColors {
    /// Precomputes the table for the extinction and the color matching functions of a rendering, and the lines of its emission.
    pub(crate) fn new(rendering: &RenderingParameters, lines: LineSet) -> Self {
        let RenderingParameters { extinction: air, color_matching, .. } = rendering;
        let colors = (0..=STEPS).map(|step| {
            let root = step as f64 / STEPS as f64;
            let elevation = math::asin(root * root).min(FRAC_PI_2);
            EMITTERS.map(|emitter| {
                let [red, green, blue] =
                    attenuated_color(emitter, lines, *color_matching, air, elevation).map(|value| value as f32);
                [red, green, blue, if emitter == SpectralEmitter::Nitrogen { 0.0 } else { 1.0 }]
            })
        });
        Self { colors: colors.collect() }
    }

    /// Table coordinate of a sine of elevation, clamped at the horizon.
    #[inline(always)]
    pub(crate) fn table_coordinate(sine: f32) -> f32 {
        let clamped = if sine > 0.0 { sine } else { 0.0 };
        clamped.sqrt().fma(STEPS as f32, 0.5)
    }

    /// Color of light by emitter in kR at a [`table_coordinate`](Self::table_coordinate); the fourth component is its
    /// brightness in kR without the dim first positive bands.
    #[inline(always)]
    pub(crate) fn attenuated<S: Simd>(&self, simd: S, light: &PerEmitter<f32>, coordinate: f32) -> FourLanes<S> {
        let mut sum = FourLanes::splat(simd, 0.0);
        for (light, color) in light.iter().zip(&self.colors[(coordinate as usize).min(STEPS)]) {
            sum = sum.broadcast(*light).fma(FourLanes::simd_from(simd, *color), sum);
        }
        sum
    }
}

/// Attenuated color of a kilorayleigh of an emitter, all lines included.
fn attenuated_color(
    emitter: SpectralEmitter,
    lines: LineSet,
    color_matching: ColorMatching,
    air: &Extinction,
    elevation: f64,
) -> [f64; 3] {
    if emitter == SpectralEmitter::Nitrogen && lines == LineSet::Observed {
        let transmittance = air.transmittance(BANDS_NM, elevation);
        return emitter.color_per_kilorayleigh().map(|value| value * transmittance);
    }
    let sum = lines.lines(emitter).into_iter().fold(DVec3::ZERO, |sum, (wavelength_nm, photons)| {
        let color = DVec3::from(color_matching.line_color(wavelength_nm));
        sum + color * (photons * air.transmittance(wavelength_nm, elevation))
    });
    sum.to_array()
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;

    use super::*;

    #[test]
    fn without_air_every_emitter_has_its_own_color() {
        let none = Extinction { rayleigh: 0.0, aerosol: 0.0, ozone: 0.0, ..Extinction::default() };
        let rendering = RenderingParameters { extinction: none, ..RenderingParameters::default() };
        let emitter_colors = EmitterColors::new(&rendering, LineSet::Observed);
        for emitter in EMITTERS {
            let mut light = [0.0; 4];
            light[emitter.index()] = 2.0;
            let color: [f32; 4] = dispatch!(bansho_base::math::simd::level(), simd => emitter_colors.attenuated(simd, &light, EmitterColors::table_coordinate(0.3)).into());
            let expected = emitter.color_per_kilorayleigh();
            assert!(
                (0..3).all(|c| (f64::from(color[c]) - 2.0 * expected[c]).abs() < 1e-4 * expected[1].abs().max(1e-6))
            );
        }
    }

    #[test]
    fn blue_fades_before_red_toward_the_horizon() {
        let emitter_colors = EmitterColors::new(&RenderingParameters::default(), LineSet::Observed);
        let transmittance = |emitter: SpectralEmitter| {
            let mut light = [0.0; 4];
            light[emitter.index()] = 1.0;
            let blue = |sine: f32| dispatch!(bansho_base::math::simd::level(), simd => emitter_colors.attenuated(simd, &light, EmitterColors::table_coordinate(sine))[2]);
            blue(0.02) / blue(1.0)
        };
        assert!(transmittance(SpectralEmitter::NitrogenIon) < 0.5 * transmittance(SpectralEmitter::OxygenGreen).abs());
    }
}
