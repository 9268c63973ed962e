//! The sky at night: airglow, unresolved stars and twilight.

use glam::DVec3;

use super::{TownGlow, air_mass};
use crate::{
    color::{ACESCG_FROM_XYZ, LUMINOUS_EFFICACY_LM_PER_W, black_body, line_xyz, luminance},
    math,
};

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

/// Altitude above which an observer sees noticeably below the horizontal and through less air, km.
const LOW_KM: f64 = 1.0;
/// Scale height of the air, km.
const AIR_SCALE_HEIGHT_KM: f64 = 8.0;
/// Thickness of the layers of the airglow, km: limits their brightness along the Earth's limb.
const AIRGLOW_THICKNESS_KM: f64 = 10.0;

/// How much of the sky an observer at an altitude sees: below it the Earth's horizon, above it the rest of the air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyObserver {
    /// Height above the lowest kilometer, km.
    height_km: f64,
}

impl SkyObserver {
    /// An observer on the ground.
    pub const ON_THE_GROUND: Self = Self { height_km: 0.0 };

    /// The observer at a position in m, over a spherical Earth whose surface is at the height 0 of the world's origin.
    #[must_use]
    pub fn at(position: DVec3) -> Self {
        let altitude_km = (position * 1e-3 + DVec3::Y * EARTH_RADIUS_KM).length() - EARTH_RADIUS_KM;
        Self { height_km: (altitude_km - LOW_KM).max(0.0) }
    }

    /// Sine of the elevation of the Earth's horizon: 0 near the ground, negative from a height.
    #[must_use]
    pub fn horizon_sine(&self) -> f64 {
        let cosine = EARTH_RADIUS_KM / (EARTH_RADIUS_KM + self.height_km);
        -math::sqrt((1.0 - cosine * cosine).max(0.0))
    }

    /// Fraction of the air that is above.
    fn air_above(&self) -> f64 {
        math::exp(-self.height_km / AIR_SCALE_HEIGHT_KM)
    }

    /// Path length through a thin spherical layer at an elevation relative to the path straight through it. From above, a line of sight passes the
    /// layer twice beside the Earth, and not at all farther up.
    fn layer_path(&self, elevation: f64, altitude_km: f64) -> f64 {
        if self.height_km == 0.0 {
            return van_rhijn(elevation, altitude_km);
        }
        let layer = EARTH_RADIUS_KM + altitude_km;
        let ratio = (EARTH_RADIUS_KM + self.height_km) / layer * math::cos(elevation);
        let is_above = self.height_km > altitude_km;
        if ratio >= 1.0 || (is_above && elevation >= 0.0) {
            return 0.0;
        }
        let crossings = if is_above { 2.0 } else { 1.0 };
        crossings / math::sqrt((1.0 - ratio * ratio).max(AIRGLOW_THICKNESS_KM / layer))
    }
}

/// The night sky at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Night {
    /// Brightness of the airglow relative to a typical night.
    pub airglow: f64,
    /// Luminance of the twilight overhead, cd/m^2: see [`twilight_luminance`].
    pub twilight: f64,
    /// Horizontal unit vector toward the azimuth of the sun.
    pub sunward: DVec3,
    /// Atmospheric extinction overhead, magnitudes.
    pub extinction: f64,
    /// The glow of a town.
    pub town: Option<TownGlow>,
}

/// Luminance of the twilight overhead, cd/m^2, at an elevation of the sun in degrees, 0 or below (Koomen et al. 1952).
#[must_use]
pub fn twilight_luminance(sun_elevation_deg: f64) -> f64 {
    let depression = -sun_elevation_deg / 3.0;
    let last_index = TWILIGHT.len() - 1;
    let interval = (depression as usize).min(last_index - 1);
    let log = math::lerp(TWILIGHT[interval], TWILIGHT[interval + 1], depression - interval as f64);
    if depression < last_index as f64 + 1.0 { math::pow(10.0, log) } else { 0.0 }
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
        let natural = self.almucantar(elevation).radiance(self.sunwardness(direction) as f32);
        let Some(town) = &self.town else { return natural };
        let horizontal = DVec3::new(direction.x, 0.0, direction.z).normalize_or_zero();
        let glow = town.luminance(elevation, horizontal.dot(town.toward)) as f32;
        let color = self.town_color();
        std::array::from_fn(|c| natural[c] + glow * color[c])
    }

    /// Color of the town's glow (ACEScg, luminance 1); black without a town.
    #[must_use]
    pub fn town_color(&self) -> [f32; 3] {
        let color = self.town.map(|town| blackbody_light(town.temperature_k as f32, 1.0));
        color.unwrap_or_default().as_vec3().to_array()
    }

    /// Horizontal unit vector toward the town; 0 without a town.
    #[must_use]
    pub fn townward(&self) -> DVec3 {
        self.town.map_or(DVec3::ZERO, |town| town.toward)
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

    /// The same night for an observer at a height: with the air and the twilight that are left above.
    #[must_use]
    pub fn above(&self, observer: SkyObserver) -> Self {
        let air = observer.air_above();
        let town = self.town.map(|town| town.dimmed(air));
        Self { extinction: self.extinction * air, twilight: self.twilight * air, town, ..*self }
    }

    /// The almucantar of an elevation in radians, seen from the ground.
    fn almucantar(&self, elevation: f64) -> Almucantar {
        self.almucantar_of(elevation, SkyObserver::ON_THE_GROUND)
    }

    /// The almucantar of an elevation in radians for an observer whose air is that of [`above`](Self::above).
    #[must_use]
    pub fn almucantar_of(&self, elevation: f64, observer: SkyObserver) -> Almucantar {
        let overhead = self.transmittance(std::f64::consts::FRAC_PI_2);
        // Scattering replaces 30 % of the light lost by extinction.
        let diffuse = 0.3 + 0.7 * self.transmittance(elevation) / overhead.max(f64::MIN_POSITIVE);
        let mut uniform = blackbody_light(BACKGROUND_K, BACKGROUND * diffuse);
        for (wavelength_nm, kilorayleigh, altitude_km) in AIRGLOW {
            let scale = LUMINOUS_EFFICACY_LM_PER_W * KILORAYLEIGH / wavelength_nm;
            let brightness =
                self.airglow * kilorayleigh * observer.layer_path(elevation, altitude_km) * diffuse * scale;
            uniform += DVec3::from(ACESCG_FROM_XYZ.apply(line_xyz(wavelength_nm))) * brightness;
        }
        // Twilight: blue overhead, brighter and yellow low above the sun.
        let low = math::exp(-elevation.max(0.0) / TWILIGHT_ARCH);
        let blue = blackbody_light(10_000.0, self.twilight);
        let glow = blackbody_light(3200.0, self.twilight * 9.0 * low * low);
        let [uniform, glow, blue] = [uniform + blue, glow, blue * (2.0 * low)].map(|color| color.as_vec3().to_array());
        Almucantar { uniform, glow, blue }
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

    /// A typical night, with the sun in the north.
    fn night(sun_elevation_deg: f64) -> Night {
        let twilight = twilight_luminance(sun_elevation_deg);
        Night { airglow: 1.0, twilight, sunward: -DVec3::Z, extinction: 0.22, town: None }
    }

    fn overhead(night: &Night) -> f64 {
        f64::from(luminance(night.radiance(DVec3::Y)))
    }

    #[test]
    fn a_dark_night_has_about_22_magnitudes_per_square_second() {
        // 21.6 to 22 mag/arcsec^2 at good sites: 1.7e-4 to 2.5e-4 cd/m^2.
        let dark = overhead(&night(-30.0));
        assert!((1.6e-4..2.6e-4).contains(&dark), "{dark}");
    }

    #[test]
    fn airglow_brightens_toward_the_horizon_and_the_way_is_the_published_one() {
        // Roach & Meinel (1955): 100 km, zenith distance 80 degrees: 3.9.
        assert!((van_rhijn(10_f64.to_radians(), 100.0) - 4.0).abs() < 0.2);
        assert_eq!(van_rhijn(std::f64::consts::FRAC_PI_2, 100.0), 1.0);
        let night = night(-30.0);
        let low = DVec3::new(0.97, 0.24, 0.0).normalize();
        assert!(luminance(night.radiance(low)) > 1.1 * luminance(night.radiance(DVec3::Y)));
    }

    #[test]
    fn from_orbit_the_airglow_is_an_arc_along_the_limb() {
        let observer = SkyObserver::at(DVec3::Y * 401e3);
        // The horizon is where the line of sight touches the Earth: cos = R / (R + h).
        assert!((math::asin(observer.horizon_sine()) + math::acos(6371.0 / 6771.0)).abs() < 1e-12);
        let night = night(-30.0).above(observer);
        let at = |tangent_km: f64| {
            let elevation = -math::acos((EARTH_RADIUS_KM + tangent_km) / (EARTH_RADIUS_KM + 400.0));
            luminance(night.almucantar_of(elevation, observer).terms()[0])
        };
        let (space, arc, below) = (at(300.0), at(86.0), at(20.0));
        assert!(arc > 2.0 * below && below > 2.0 * space, "{space} {arc} {below}");
        // Near the ground nothing changes.
        let ground = SkyObserver::at(DVec3::Y * 900.0);
        assert_eq!(ground.horizon_sine(), 0.0);
        assert_eq!(self::night(-30.0).above(ground), self::night(-30.0));
    }

    #[test]
    fn twilight_falls_a_thousandfold_from_6_to_12_degrees_and_lies_over_the_sun() {
        let ratio = overhead(&night(-6.0)) / overhead(&night(-12.0));
        assert!((200.0..1500.0).contains(&ratio), "{ratio}");
        let night = night(-9.0);
        let seen = |z: f64| luminance(night.radiance(DVec3::new(0.0, 0.1, z).normalize()));
        assert!(seen(-1.0) > 2.0 * seen(1.0));
    }
}
