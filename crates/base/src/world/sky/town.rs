//! The glow of a town at night: its light, scattered once by molecules and aerosol.
//!
//! # References
//! - M. F. Walker, Publ. Astron. Soc. Pac. 89 (1977): brightness above a town by population and distance.
//! - R. H. Garstang, Publ. Astron. Soc. Pac. 98 (1986): light of a town by angle, and its scattering.

use std::f64::consts::PI;

use glam::DVec3;

use crate::math;

/// Luminance of a natural night sky, cd/m^2, to which Walker's law refers.
const NATURAL: f64 = 1.8e-4;
/// Walker's law: brightness 45 degrees high above a town relative to the natural sky, `0.01 P r^-2.5` for P people at r km.
const WALKER_FACTOR: f64 = 0.01;
const WALKER_EXPONENT: f64 = -2.5;
/// Garstang's shares of light that the ground reflects, G, and that goes up directly, F.
const REFLECTED: f64 = 0.15;
const DIRECT: f64 = 0.15;
/// Radius of a town of a million people, km; areas are proportional to populations.
const RADIUS_OF_MILLION_KM: f64 = 10.0;
/// Scattering per km at the ground and scale heights in km of molecules and of aerosol in clear air.
const MOLECULES: [f64; 2] = [0.0116, 8.0];
const AEROSOL: [f64; 2] = [0.03, 1.5];
/// Asymmetry of the aerosol's Henyey-Greenstein phase function.
const ASYMMETRY: f64 = 0.7;
/// Length of lines of sight, km, and their steps, of equal angles seen from the town.
const LENGTH_KM: f64 = 150.0;
const STEPS: usize = 24;

/// The glow of one town.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TownGlow {
    /// Horizontal unit vector toward the town.
    pub(crate) toward: DVec3,
    distance_km: f64,
    radius_km: f64,
    /// Luminance per unit of `scattered`, cd/m^2.
    scale: f64,
    /// Color temperature of its lamps, K.
    pub(crate) temperature_k: f64,
}

impl TownGlow {
    /// The glow of a town of that many people at an azimuth in degrees from north toward east; `None` without people.
    #[must_use]
    pub fn of_population(population: f64, azimuth_deg: f64, distance_km: f64, temperature_k: f64) -> Option<Self> {
        let (east, north) = math::sin_cos(azimuth_deg.to_radians());
        let toward = DVec3::new(east, 0.0, -north);
        let radius_km = RADIUS_OF_MILLION_KM * math::sqrt(population * 1e-6);
        let mut glow = Self { toward, distance_km, radius_km, scale: 1.0, temperature_k };
        let walker = NATURAL * WALKER_FACTOR * population * math::pow(distance_km, WALKER_EXPONENT);
        glow.scale = walker / glow.luminance(PI / 4.0, 1.0);
        (population > 0.0).then_some(glow)
    }

    /// The same glow, dimmed to a fraction.
    pub(super) fn dimmed(self, fraction: f64) -> Self {
        Self { scale: self.scale * fraction, ..self }
    }

    /// Luminance from an elevation in radians, at an azimuth whose difference to the town's has that cosine, cd/m^2: the integral of the light scattered
    /// once along the line of sight.
    #[must_use]
    pub fn luminance(&self, elevation: f64, azimuth_cosine: f64) -> f64 {
        let (sine, cosine) = math::sin_cos(elevation.max(0.0));
        // With equal angles seen from the town, the inverse square of the distance to it cancels (Kulla and Fajardo 2012).
        let nearest = self.distance_km * cosine * azimuth_cosine;
        let miss_squared = self.distance_km * self.distance_km - nearest * nearest + self.radius_km * self.radius_km;
        let miss = math::sqrt(miss_squared.max(1e-6));
        let [first, last] = [-nearest, LENGTH_KM - nearest].map(|along| math::atan2(along, miss));
        let step = (last - first) / STEPS as f64;
        let mut sum = 0.0;
        for number in 0..STEPS {
            let (sin, cos) = math::sin_cos(first + (number as f64 + 0.5) * step);
            let along = miss * sin / cos;
            let distance = miss / cos;
            sum += scattered(nearest + along, distance, sine, along / distance);
        }
        self.scale * sum * step / miss
    }
}

/// Light that a point of a line of sight scatters toward the observer, per intensity of the town over the squared distance: `along` km from the observer,
/// `distance` km from the town, in a direction with that sine of elevation; light is turned by an angle with the cosine `turn`.
fn scattered(along: f64, distance: f64, sine: f64, turn: f64) -> f64 {
    let height = along * sine;
    let up_cosine = (height / distance).clamp(0.0, 1.0);
    let [molecules, aerosol] = [MOLECULES, AEROSOL].map(|[density, scale]| density * math::exp(-height / scale));
    let rayleigh = 3.0 / (16.0 * PI) * (1.0 + turn * turn);
    // Forward is away from the town, and so toward the observer where the line of sight comes toward it.
    let denominator = 1.0 + ASYMMETRY * ASYMMETRY + 2.0 * ASYMMETRY * turn;
    let henyey_greenstein = (1.0 - ASYMMETRY * ASYMMETRY) / (4.0 * PI * denominator * math::sqrt(denominator));
    let depth = [MOLECULES, AEROSOL].map(|[density, scale]| density * mean_density(height / scale)).iter().sum::<f64>();
    let transmittance = math::exp(-depth * (along + distance));
    upward_intensity(up_cosine) * transmittance * (molecules * rayleigh + aerosol * henyey_greenstein)
}

/// Mean of `exp(-x)` from 0 to a height in scale heights.
fn mean_density(height: f64) -> f64 {
    if height < 1e-4 { 1.0 } else { (1.0 - math::exp(-height)) / height }
}

/// Garstang's upward intensity by the cosine of the zenith angle, relative.
fn upward_intensity(cosine: f64) -> f64 {
    let angle = math::acos(cosine);
    let squared = angle * angle;
    2.0 * REFLECTED * (1.0 - DIRECT) * cosine + 0.554 * DIRECT * squared * squared
}

#[cfg(test)]
mod tests {
    use super::*;

    fn town() -> TownGlow {
        TownGlow::of_population(30_000.0, 0.0, 20.0, 2700.0).expect("it has people")
    }

    #[test]
    fn brightness_follows_walkers_law() {
        let at = |population, distance| {
            TownGlow::of_population(population, 0.0, distance, 2700.0).unwrap().luminance(PI / 4.0, 1.0)
        };
        assert!((at(10_000.0, 10.0) / NATURAL / 0.316 - 1.0).abs() < 1e-3);
        assert!((at(20_000.0, 10.0) / at(10_000.0, 10.0) - 2.0).abs() < 1e-9);
        assert!((at(10_000.0, 40.0) / at(10_000.0, 10.0) * 32.0 - 1.0).abs() < 1e-9);
        assert_eq!(TownGlow::of_population(0.0, 0.0, 20.0, 2700.0), None);
    }

    #[test]
    fn it_lies_low_above_the_town() {
        let glow = town();
        let low = glow.luminance(0.05, 1.0);
        assert!(low > 5.0 * glow.luminance(PI / 4.0, 1.0));
        assert!(low > 10.0 * glow.luminance(0.05, -1.0));
        let by_azimuth: Vec<f64> = (0..=20).map(|step| glow.luminance(0.1, 1.0 - f64::from(step) * 0.1)).collect();
        assert!(by_azimuth.is_sorted_by(|near, far| near >= far), "{by_azimuth:?}");
    }

    /// Overhead the azimuth does not matter, and steps do not show: sixteen times as many give the same.
    #[test]
    fn the_integral_has_enough_steps() {
        let glow = town();
        assert!((glow.luminance(PI / 2.0, 1.0) / glow.luminance(PI / 2.0, -1.0) - 1.0).abs() < 1e-9);
        for (elevation, azimuth_cosine) in [(0.02, 1.0), (0.3, 0.9), (1.0, -0.5), (0.05, 0.0)] {
            let (sine, cosine) = math::sin_cos(elevation);
            let (mut fine, count) = (0.0, 60_000);
            for number in 0..count {
                let along = LENGTH_KM * (f64::from(number) + 0.5) / f64::from(count);
                let across = along - 20.0 * cosine * azimuth_cosine;
                let squared = 400.0 * (1.0 - cosine * cosine * azimuth_cosine * azimuth_cosine)
                    + glow.radius_km * glow.radius_km
                    + across * across;
                let distance = math::sqrt(squared);
                fine += scattered(along, distance, sine, across / distance) / squared * LENGTH_KM / f64::from(count);
            }
            let ratio = glow.luminance(elevation, azimuth_cosine) / (glow.scale * fine);
            assert!((ratio - 1.0).abs() < 0.03, "{ratio} at {elevation}, {azimuth_cosine}");
        }
    }
}
