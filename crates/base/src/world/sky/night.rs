//! The sky at night: airglow, unresolved stars and twilight.

use glam::DVec3;

use super::air_mass;
use crate::{
    color::{ACESCG_FROM_XYZ, LUMINOUS_EFFICACY_LM_PER_W, black_body, line_xyz, luminance},
    math,
    parameters::{Range, animated::Animated},
};

const BRIGHTNESS_RANGE: Range = Range::new(0.0, 100.0);

crate::parameters! {
    /// The night sky, for `kind = "night"`. Its brightness is absolute, so the `luminance` of the sky is ignored.
    pub struct NightParameters {
        /// Elevation of the sun: below -18 there is no twilight, below -6 the brightest stars appear.
        sun_elevation_deg: Animated<f64> = Animated::from(-30.0), limits(Range::new(-90.0, 0.0)), unit("degrees");
        /// Azimuth of the sun, from north toward east.
        sun_azimuth_deg: f64 = 0.0, limits(Range::new(-360.0, 360.0)), unit("degrees");
        /// Brightness of the airglow relative to a typical night.
        airglow: f64 = 1.0, limits(BRIGHTNESS_RANGE);
        /// Brightness of the stars relative to the real sky; 0 for none.
        stars: f64 = 1.0, limits(BRIGHTNESS_RANGE);
        /// Brightness of the Milky Way relative to the real one.
        milky_way: f64 = 1.0, limits(BRIGHTNESS_RANGE);
        /// Atmospheric extinction overhead, magnitudes.
        extinction: f64 = 0.22, limits(Range::new(0.0, 5.0)), unit("mag");
    }
}

/// Lines of the airglow: wavelength in nm, brightness overhead in kR, altitude of the layer in km (Roach & Gordon 1973; Leinert et
/// al. 1998). The last represents the visible hydroxyl bands.
const AIRGLOW: [(f64, f64, f64); 4] =
    [(557.7, 0.22, 97.0), (630.0, 0.08, 250.0), (589.3, 0.03, 92.0), (660.0, 0.2, 87.0)];
/// Luminance of zodiacal light, faint stars and the airglow's continuum together, cd/m^2 (Leinert et al. 1998), and its color, K.
const BACKGROUND: f64 = 1.2e-4;
const BACKGROUND_K: f32 = 9500.0;
/// Base-10 logarithm of the luminance overhead, cd/m^2, in steps of 3 degrees of solar depression from 0 on (Koomen et
/// al. 1952).
const TWILIGHT: [f64; 7] = [2.3, 1.2, -0.2, -1.7, -3.0, -4.1, -5.6];
/// Height of the twilight arch, radians.
const TWILIGHT_ARCH: f64 = 0.17;
/// Mean radius of the Earth, km.
pub const EARTH_RADIUS_KM: f64 = 6371.0;
/// h c / (4 pi) for a kilorayleigh, W m^-2 sr^-1 nm.
const KILORAYLEIGH: f64 = 1e13 / (4.0 * std::f64::consts::PI) * 6.626_070_15e-34 * 299_792_458.0 * 1e9;

/// The night sky at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Night {
    airglow: f64,
    /// Luminance of the twilight overhead, cd/m^2.
    twilight: f64,
    /// Horizontal unit vector toward the azimuth of the sun.
    sunward: DVec3,
    extinction: f64,
}

impl NightParameters {
    /// The night sky at time `t`.
    pub(super) fn at(&self, t: f64) -> Night {
        let depression = -self.sun_elevation_deg.at(t) / 3.0;
        let last_index = TWILIGHT.len() - 1;
        let interval = (depression as usize).min(last_index - 1);
        let log = math::lerp(TWILIGHT[interval], TWILIGHT[interval + 1], depression - interval as f64);
        let (east, north) = math::sin_cos(self.sun_azimuth_deg.to_radians());
        Night {
            airglow: self.airglow,
            twilight: if depression < last_index as f64 + 1.0 { math::pow(10.0, log) } else { 0.0 },
            sunward: DVec3::new(east, 0.0, -north),
            extinction: self.extinction,
        }
    }
}

/// The night sky along an almucantar, a circle of constant elevation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Almucantar {
    /// Radiance independent of azimuth: ACEScg, cd/m^2.
    uniform: [f32; 3],
    /// Radiance added in proportion to the fourth power of the sunwardness (see `Night::sunwardness`) of a direction.
    glow: [f32; 3],
    /// Radiance added in proportion to the sunwardness.
    blue: [f32; 3],
}

impl Almucantar {
    /// The terms of the radiance: independent of azimuth, proportional to the fourth power of the sunwardness, and proportional to the
    /// sunwardness.
    #[must_use]
    pub fn terms(&self) -> [[f32; 3]; 3] {
        [self.uniform, self.glow, self.blue]
    }

    /// Radiance for a sunwardness: 1 at the azimuth of the sun, 0 opposite.
    #[inline(always)]
    #[must_use]
    pub fn radiance(&self, sunwardness: f32) -> [f32; 3] {
        let squared = sunwardness * sunwardness;
        let fourth = squared * squared;
        std::array::from_fn(|c| self.glow[c].mul_add(fourth, self.blue[c].mul_add(sunwardness, self.uniform[c])))
    }
}

impl Night {
    /// Radiance from a direction above the horizon (ACEScg, cd/m^2).
    pub(super) fn radiance(&self, direction: DVec3) -> [f32; 3] {
        let elevation = math::asin(direction.y.clamp(0.0, 1.0));
        self.almucantar(elevation).radiance(self.sunwardness(direction) as f32)
    }

    /// Horizontal unit vector toward the azimuth of the sun.
    #[must_use]
    pub fn sunward(&self) -> DVec3 {
        self.sunward
    }

    /// How far the azimuth of a direction is toward the sun: 1 at the azimuth of the sun, 0 opposite, linear in the cosine.
    fn sunwardness(&self, direction: DVec3) -> f64 {
        0.5 + 0.5 * DVec3::new(direction.x, 0.0, direction.z).normalize_or_zero().dot(self.sunward)
    }

    /// Transmittance of the atmosphere for starlight from an elevation in radians.
    #[must_use]
    pub fn transmittance(&self, elevation: f64) -> f64 {
        math::pow(10.0, -0.4 * self.extinction * air_mass(elevation))
    }

    /// The almucantar of an elevation in radians.
    #[must_use]
    pub fn almucantar(&self, elevation: f64) -> Almucantar {
        let overhead = self.transmittance(std::f64::consts::FRAC_PI_2);
        // Scattering replaces 30 % of the light lost by extinction.
        let diffuse = 0.3 + 0.7 * self.transmittance(elevation) / overhead.max(f64::MIN_POSITIVE);
        let mut uniform = blackbody_light(BACKGROUND_K, BACKGROUND * diffuse);
        for (wavelength_nm, kilorayleigh, altitude_km) in AIRGLOW {
            let scale = LUMINOUS_EFFICACY_LM_PER_W * KILORAYLEIGH / wavelength_nm;
            let brightness = self.airglow * kilorayleigh * van_rhijn(elevation, altitude_km) * diffuse * scale;
            uniform += DVec3::from(ACESCG_FROM_XYZ.apply(line_xyz(wavelength_nm))) * brightness;
        }
        // Twilight: blue overhead, brighter and yellow low above the sun.
        let low = math::exp(-elevation / TWILIGHT_ARCH);
        let blue = blackbody_light(10_000.0, self.twilight);
        let single = |color: DVec3| color.to_array().map(|value| value as f32);
        Almucantar {
            uniform: single(uniform + blue),
            glow: single(blackbody_light(3200.0, self.twilight * 9.0 * low * low)),
            blue: single(blue * (2.0 * low)),
        }
    }
}

/// Path length through a thin layer at an elevation relative to overhead (van Rhijn 1921).
fn van_rhijn(elevation: f64, altitude_km: f64) -> f64 {
    let sine = EARTH_RADIUS_KM / (EARTH_RADIUS_KM + altitude_km) * math::cos(elevation);
    1.0 / math::sqrt(1.0 - sine * sine)
}

/// Light with the color of a black body and the luminance `brightness`.
fn blackbody_light(temperature_k: f32, brightness: f64) -> DVec3 {
    let color = black_body().radiance(temperature_k);
    let scale = brightness / f64::from(luminance(color)).max(f64::MIN_POSITIVE);
    DVec3::from(color.map(f64::from)) * scale
}

#[cfg(test)]
mod tests {
    use super::*;

    fn overhead(parameters: &NightParameters) -> f64 {
        f64::from(luminance(parameters.at(0.0).radiance(DVec3::Y)))
    }

    #[test]
    fn a_dark_night_has_about_22_magnitudes_per_square_second() {
        // 21.6 to 22 mag/arcsec^2 at good sites: 1.7e-4 to 2.5e-4 cd/m^2.
        let dark = overhead(&NightParameters::default());
        assert!((1.6e-4..2.6e-4).contains(&dark), "{dark}");
    }

    #[test]
    fn airglow_brightens_toward_the_horizon_and_the_way_is_the_published_one() {
        // Roach & Meinel (1955): 100 km, zenith distance 80 degrees: 3.9.
        assert!((van_rhijn(10_f64.to_radians(), 100.0) - 4.0).abs() < 0.2);
        assert_eq!(van_rhijn(std::f64::consts::FRAC_PI_2, 100.0), 1.0);
        let night = NightParameters::default().at(0.0);
        let low = DVec3::new(0.97, 0.24, 0.0).normalize();
        assert!(luminance(night.radiance(low)) > 1.1 * luminance(night.radiance(DVec3::Y)));
    }

    #[test]
    fn twilight_falls_a_thousandfold_from_6_to_12_degrees_and_lies_over_the_sun() {
        let at =
            |degrees: f64| NightParameters { sun_elevation_deg: Animated::from(degrees), ..NightParameters::default() };
        let ratio = overhead(&at(-6.0)) / overhead(&at(-12.0));
        assert!((200.0..1500.0).contains(&ratio), "{ratio}");
        let night = at(-9.0).at(0.0);
        let seen = |z: f64| luminance(night.radiance(DVec3::new(0.0, 0.1, z).normalize()));
        assert!(seen(-1.0) > 2.0 * seen(1.0));
    }
}
