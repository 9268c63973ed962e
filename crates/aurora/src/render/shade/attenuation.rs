//! From kilorayleighs to color, with the extinction of the lower atmosphere, or the thesis's attenuation by distance.

use std::f64::consts::FRAC_PI_2;

use bansho_base::math::{
    self, DVec3,
    simd::{FourLanes, Real},
};
use fearless_simd::{Simd, prelude::*};

use crate::{
    physics::{
        atmosphere::level_altitude_km,
        emission::{ColorMatching, EMITTERS, Emitter, LineSet, PerEmitter},
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
                [red, green, blue, if emitter == Emitter::Nitrogen { 0.0 } else { 1.0 }]
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
    emitter: Emitter,
    lines: LineSet,
    color_matching: ColorMatching,
    air: &Extinction,
    elevation: f64,
) -> [f64; 3] {
    if emitter == Emitter::Nitrogen && lines == LineSet::Observed {
        let transmittance = air.transmittance(BANDS_NM, elevation);
        return emitter.color_per_kilorayleigh().map(|value| value * transmittance);
    }
    let sum = lines.lines(emitter).into_iter().fold(DVec3::ZERO, |sum, (wavelength_nm, photons)| {
        let color = DVec3::from(color_matching.line_color(wavelength_nm));
        sum + color * (photons * air.transmittance(wavelength_nm, elevation))
    });
    sum.to_array()
}

/// The thesis's attenuation by distance, exp(-(d z)^2) (2.27), with z the distance from the observer.
///
/// z^2 is the sum of the squared distances along the field and across it, so that the attenuation is the product of a factor of the altitude and one
/// of the field line. The field is taken as straight over a flat Earth; the thesis looks along no horizon. The default is no attenuation.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct AttenuationByDistance {
    /// d, 1/km.
    per_km: f64,
    /// Sine of the dip: altitude over distance along the field.
    dip_sine: f64,
}

/// Minimum dip, degrees, as for field lines.
const MIN_DIP_DEG: f64 = 30.0;

impl AttenuationByDistance {
    /// For a rendering, and a dip of the magnetic field.
    pub(crate) fn new(rendering: &RenderingParameters, dip_deg: f64) -> Self {
        let dip_sine = math::sin(dip_deg.abs().max(MIN_DIP_DEG).to_radians());
        Self { per_km: rendering.attenuation_per_km, dip_sine }
    }

    /// Factor of the light of a level of the atmosphere.
    pub(crate) fn of_level(&self, level: usize) -> f64 {
        self.of_distance(level_altitude_km(level) / self.dip_sine)
    }

    /// Factor of the light of a field line at these distances from the observer's, km.
    #[inline(always)]
    pub(crate) fn of_field_line(&self, [x, y]: [f32; 2]) -> f32 {
        // Checked here, too: the square root would cost where there is no attenuation.
        if self.per_km == 0.0 { 1.0 } else { self.of_distance(math::hypot(f64::from(x), f64::from(y))) as f32 }
    }

    /// Factor of the light of a distance along or across the field, km.
    fn of_distance(&self, distance_km: f64) -> f64 {
        if self.per_km == 0.0 {
            return 1.0;
        }
        let depth = self.per_km * distance_km;
        math::exp(-depth * depth)
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    #[test]
    fn without_air_every_emitter_has_its_own_color() {
        let none = Extinction { rayleigh: 0.0, aerosol: 0.0, ozone: 0.0, ..Extinction::default() };
        let rendering = RenderingParameters { extinction: none, ..RenderingParameters::default() };
        let emitter_colors = EmitterColors::new(&rendering, LineSet::Observed);
        for emitter in EMITTERS {
            let mut light = [0.0; 4];
            light[emitter.index()] = 2.0;
            let color: [f32; 4] = dispatch!(Level::new(), simd => emitter_colors.attenuated(simd, &light, EmitterColors::table_coordinate(0.3)).into());
            let expected = emitter.color_per_kilorayleigh();
            assert!(
                (0..3).all(|c| (f64::from(color[c]) - 2.0 * expected[c]).abs() < 1e-4 * expected[1].abs().max(1e-6))
            );
        }
    }

    #[test]
    fn blue_fades_before_red_toward_the_horizon() {
        let emitter_colors = EmitterColors::new(&RenderingParameters::default(), LineSet::Observed);
        let transmittance = |emitter: Emitter| {
            let mut light = [0.0; 4];
            light[emitter.index()] = 1.0;
            let blue = |sine: f32| dispatch!(Level::new(), simd => emitter_colors.attenuated(simd, &light, EmitterColors::table_coordinate(sine))[2]);
            blue(0.02) / blue(1.0)
        };
        assert!(transmittance(Emitter::NitrogenIon) < 0.5 * transmittance(Emitter::OxygenGreen).abs());
    }

    /// (2.27) by hand: d = 0.001 per km, 300 km across the field and 100 km up a vertical field.
    #[test]
    fn light_is_attenuated_by_the_square_of_its_distance() {
        let rendering = RenderingParameters { attenuation_per_km: 1e-3, ..RenderingParameters::default() };
        let attenuation = AttenuationByDistance::new(&rendering, 90.0);
        let level = (0..).find(|level| level_altitude_km(*level) >= 100.0).unwrap();
        let [up, across] = [attenuation.of_level(level), f64::from(attenuation.of_field_line([180.0, 240.0]))];
        assert!((up - 0.990_050).abs() < 1e-6 && (across - 0.913_931).abs() < 1e-6, "{up} {across}");
        // The distance is the hypotenuse: exp(-0.1).
        assert!((up * across - 0.904_837).abs() < 1e-6);
        assert_eq!(AttenuationByDistance::default().of_level(level), 1.0);
    }
}
