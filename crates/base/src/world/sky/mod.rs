//! The sky as a light source: its radiance from each direction.

mod elevations;
mod night;
mod town;

use std::f64::consts::PI;

use glam::DVec3;

use crate::{
    color::{self, black_body},
    math,
};

pub use elevations::{ElevationProfile, ElevationSample};
pub use night::{Almucantar, EARTH_RADIUS_KM, Night, SkyObserver, twilight_luminance};
pub use town::TownGlow;

/// Air masses along a line of sight `elevation` radians above the horizon: 1 overhead, 38 at the horizon (Kasten & Young 1989). Below
/// the horizon it is that of the horizon.
#[must_use]
pub fn air_mass(elevation: f64) -> f64 {
    let degrees = elevation.to_degrees().clamp(0.0, 90.0);
    1.0 / (math::sin(degrees.to_radians()) + 0.50572 * math::pow(degrees + 6.07995, -1.6364))
}

crate::choice! {
    /// Distribution of the sky's luminance.
    pub enum SkyKind {
        /// The CIE overcast sky: three times as bright overhead as at the horizon.
        Overcast = "overcast",
        /// The same in all directions.
        Uniform = "uniform",
        /// Airglow, stars and twilight, as set in `night`.
        Night = "night",
    }
}

/// Albedo of the ground, for the radiance from below the horizon.
const GROUND_ALBEDO: f64 = 0.15;

/// The sky at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    kind: SkyKind,
    zenith: [f32; 3],
    night: Option<Night>,
    measured: Option<ElevationProfile>,
}

impl Sky {
    /// No light from anywhere.
    pub const DARK: Self = Self { kind: SkyKind::Uniform, zenith: [0.0; 3], night: None, measured: None };

    /// Measured light from above and below (ACEScg, cd/m^2).
    #[must_use]
    pub fn measured(profile: ElevationProfile) -> Self {
        Self { zenith: profile.radiance(1.0), measured: Some(profile), ..Self::DARK }
    }

    /// A sky with this luminance overhead, cd/m^2, and the color of a black body at `temperature_k`. That of a night follows from [`Night`] instead.
    #[must_use]
    pub fn new(kind: SkyKind, luminance: f64, temperature_k: f64) -> Self {
        let color = black_body().radiance(temperature_k as f32);
        let scale = luminance / f64::from(color::luminance(color)).max(f64::MIN_POSITIVE);
        Self { kind, zenith: color.map(|value| (f64::from(value) * scale) as f32), ..Self::DARK }
    }

    /// A sky at night.
    #[must_use]
    pub fn from_night(night: Night) -> Self {
        Self { kind: SkyKind::Night, zenith: night.radiance(DVec3::Y), night: Some(night), measured: None }
    }

    /// Radiance from a direction, a unit vector (ACEScg, cd/m^2). From below the horizon it is the light reflected by a diffuse ground, unless
    /// it was measured.
    pub fn radiance(&self, direction: DVec3) -> [f32; 3] {
        if let Some(measured) = &self.measured {
            return measured.radiance(direction.y);
        }
        if direction.y < 0.0 {
            return self.horizontal_illuminance().map(|value| value * (GROUND_ALBEDO / PI) as f32);
        }
        if let Some(night) = &self.night {
            return night.radiance(direction);
        }
        let relative_luminance = match self.kind {
            SkyKind::Overcast => overcast(direction.y),
            SkyKind::Uniform | SkyKind::Night => 1.0,
        };
        self.zenith.map(|value| value * relative_luminance as f32)
    }

    /// [`radiance`](Self::radiance) for sines of elevation, as one array per component, with the same bits; `None` unless the sky was measured.
    #[inline(always)]
    pub fn measured_radiances<const N: usize>(&self, sines: &[f64; N]) -> Option<[[f32; N]; 3]> {
        Some(self.measured.as_ref()?.radiances(sines))
    }

    /// [`radiance`](Self::radiance) for sines of elevation, as one array per component; `None` for a night, whose radiance depends on the
    /// azimuth.
    #[inline(always)]
    pub fn radiance_at_elevations<const N: usize>(&self, sines: &[f32; N]) -> Option<[[f32; N]; 3]> {
        if self.night.is_some() {
            return None;
        }
        if let Some(measured) = &self.measured {
            let each = sines.map(|sine| measured.radiance(f64::from(sine)));
            return Some(std::array::from_fn(|c| each.map(|radiance| radiance[c])));
        }
        let ground = self.radiance(-DVec3::Y);
        let mut relative_luminances = [1.0; N];
        if self.kind == SkyKind::Overcast {
            for i in 0..N {
                relative_luminances[i] = overcast(f64::from(sines[i])) as f32;
            }
        }
        let mut planes = [[0.0; N]; 3];
        for c in 0..3 {
            for i in 0..N {
                planes[c][i] = if sines[i] < 0.0 { ground[c] } else { self.zenith[c] * relative_luminances[i] };
            }
        }
        Some(planes)
    }

    /// Illuminance of open, horizontal ground (ACEScg, lux).
    pub fn horizontal_illuminance(&self) -> [f32; 3] {
        if let Some(measured) = &self.measured {
            return measured.horizontal_illuminance();
        }
        let hemisphere = match self.kind {
            SkyKind::Overcast => 7.0 / 9.0 * PI,
            // Nearly uniform: near the horizon extinction cancels the stronger airglow.
            SkyKind::Uniform | SkyKind::Night => PI,
        };
        self.zenith.map(|value| value * hemisphere as f32)
    }

    /// The night sky, if it is one.
    pub fn night(&self) -> Option<&Night> {
        self.night.as_ref()
    }

    /// Whether it emits no light.
    pub fn is_dark(&self) -> bool {
        self.measured.map_or(self.zenith == [0.0; 3], |measured| measured.is_dark())
    }
}

/// Luminance of an overcast sky relative to its zenith, by the sine of the elevation: CIE S 011, `L = Lz (1 + 2 sin elevation) / 3`.
#[inline(always)]
fn overcast(sine: f64) -> f64 {
    (1.0 + 2.0 * sine) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::luminance;

    fn sky(kind: SkyKind) -> Sky {
        let night = Night { airglow: 1.0, twilight: 0.0, sunward: -DVec3::Z, extinction: 0.22, town: None };
        if kind == SkyKind::Night { Sky::from_night(night) } else { Sky::new(kind, 900.0, 7000.0) }
    }

    #[test]
    fn luminance_is_as_set_overhead_and_a_third_at_an_overcast_horizon() {
        let overcast = sky(SkyKind::Overcast);
        assert!((luminance(overcast.radiance(DVec3::Y)) - 900.0).abs() < 0.1);
        assert!((luminance(overcast.radiance(DVec3::X)) - 300.0).abs() < 0.1);
        assert!((luminance(sky(SkyKind::Uniform).radiance(DVec3::X)) - 900.0).abs() < 0.1);
    }

    #[test]
    fn many_elevations_have_the_radiance_of_each() {
        let sines = [-1.0, -0.25, 0.0, 0.3, 0.71, 1.0_f32];
        for kind in [SkyKind::Overcast, SkyKind::Uniform] {
            let planes = sky(kind).radiance_at_elevations(&sines).unwrap();
            for (i, sine) in sines.into_iter().map(f64::from).enumerate() {
                let direction = DVec3::new(math::sqrt(1.0 - sine * sine), sine, 0.0);
                assert_eq!(planes.map(|plane| plane[i]), sky(kind).radiance(direction));
            }
        }
        assert_eq!(sky(SkyKind::Night).radiance_at_elevations(&sines), None);
        let samples = [(-0.5, 1.0), (0.5, 9.0)];
        let sample = |(sine, value)| ElevationSample { sine, weight: 1.0, radiance: [value; 3] };
        let measured = Sky::measured(ElevationProfile::from_samples(samples.map(sample)).unwrap());
        let planes = measured.radiance_at_elevations(&sines).unwrap();
        assert_eq!(planes[1].map(|value| value), sines.map(|sine| measured.radiance(DVec3::Y * f64::from(sine))[1]));
    }

    #[test]
    fn illuminance_is_the_integral_of_radiance_over_the_hemisphere() {
        for kind in [SkyKind::Overcast, SkyKind::Uniform] {
            let sky = sky(kind);
            let steps = 2000;
            let sum: f64 = (0..steps)
                .map(|step| {
                    let elevation = (f64::from(step) + 0.5) / f64::from(steps) * 0.5 * PI;
                    let (sin, cos) = math::sin_cos(elevation);
                    let radiance = luminance(sky.radiance(DVec3::new(cos, sin, 0.0)));
                    2.0 * PI * sin * cos * f64::from(radiance) * 0.5 * PI / f64::from(steps)
                })
                .sum();
            let closed = f64::from(luminance(sky.horizontal_illuminance()));
            assert!((sum / closed - 1.0).abs() < 1e-4, "{kind:?}: {sum} against {closed}");
        }
    }

    #[test]
    fn a_warmer_sky_is_redder() {
        let warm = Sky::new(SkyKind::Overcast, 2000.0, 3000.0).radiance(DVec3::Y);
        let cold = Sky::new(SkyKind::Overcast, 2000.0, 10_000.0).radiance(DVec3::Y);
        assert!(warm[0] / warm[2] > 2.0 * cold[0] / cold[2]);
        assert!(Sky::DARK.is_dark() && !sky(SkyKind::Overcast).is_dark());
    }
}
