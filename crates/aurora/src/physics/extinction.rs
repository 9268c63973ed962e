//! What attenuates the light between the aurora and the observer: the extinction of the lower atmosphere, by wavelength and air mass, or the thesis's
//! attenuation by distance (2.27).

pub use bansho_base::world::sky::air_mass;
use bansho_base::{math, parameters::Range};

use super::atmosphere::level_altitude_km;

/// Magnitudes of a transmittance of 1/e.
const MAGNITUDES_PER_OPTICAL_DEPTH: f64 = 1.085_736_204_758_13;

/// Zenith extinction in magnitudes; it may be large in haze.
const MAGNITUDES: Range = Range::new(0.0, 5.0);

bansho_base::parameters! {
    /// Extinction by the atmosphere above the observer. The default is a clear night near sea level: 0.22 magnitudes in the middle of the spectrum
    /// (Hayes & Latham 1975; ozone of 300 Dobson units).
    pub struct Extinction {
        /// Rayleigh scattering at 550 nm, at the zenith.
        rayleigh: f64 = 0.106, limits(MAGNITUDES), unit("mag");
        /// Aerosols at 550 nm, at the zenith; 0.3 is haze.
        aerosol: f64 = 0.09, limits(MAGNITUDES), unit("mag");
        /// Angstrom exponent of the aerosols: the larger, the stronger the extinction of short wavelengths.
        angstrom_exponent: f64 = 1.3, limits(Range::new(0.0, 4.0));
        /// Ozone at its visible maximum near 600 nm, at the zenith.
        ozone: f64 = 0.04, limits(MAGNITUDES), unit("mag");
    }
}

/// Altitude above which an observer has noticeably less air above than one near sea level, km.
const LOW_KM: f64 = 1.0;
/// Scale heights of air and of aerosols, km (US Standard Atmosphere 1976; Elterman 1968).
const AIR_SCALE_HEIGHT_KM: f64 = 8.0;
const AEROSOL_SCALE_HEIGHT_KM: f64 = 1.2;
/// Altitude of the middle of the ozone layer and its width, km: the column above falls by a logistic function.
const OZONE_KM: [f64; 2] = [22.0, 4.5];

/// Ozone column above a height in km, relative to the whole layer: a logistic function about its middle.
fn ozone_above(height: f64) -> f64 {
    let [middle, width] = OZONE_KM;
    1.0 / (1.0 + math::exp((height - middle) / width))
}

impl Extinction {
    /// What is left of it for an observer at an altitude: the air, the aerosols and the ozone above.
    #[must_use]
    pub fn above(&self, altitude_km: f64) -> Self {
        let height = (altitude_km - LOW_KM).max(0.0);
        Self {
            rayleigh: self.rayleigh * math::exp(-height / AIR_SCALE_HEIGHT_KM),
            aerosol: self.aerosol * math::exp(-height / AEROSOL_SCALE_HEIGHT_KM),
            ozone: self.ozone * (ozone_above(height) / ozone_above(0.0)),
            ..self.clone()
        }
    }

    /// Zenith extinction at a wavelength, magnitudes.
    #[must_use]
    pub fn magnitudes(&self, wavelength_nm: f64) -> f64 {
        let ratio = 550.0 / wavelength_nm;
        // The exponent 4.08 includes the dispersion of air in the visible.
        let scattered =
            self.rayleigh * math::pow(ratio, 4.08) + self.aerosol * math::pow(ratio, self.angstrom_exponent);
        // The Chappuis band, approximately a Gaussian about 595 nm.
        let from_center = (wavelength_nm - 595.0) / 50.0;
        scattered + self.ozone * math::exp(-0.5 * from_center * from_center)
    }

    /// Transmittance at `elevation` radians above the horizon.
    #[must_use]
    pub fn transmittance(&self, wavelength_nm: f64, elevation: f64) -> f64 {
        math::exp(-self.magnitudes(wavelength_nm) * air_mass(elevation) / MAGNITUDES_PER_OPTICAL_DEPTH)
    }
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
    /// For an attenuation coefficient d in 1/km, and a dip of the magnetic field.
    pub(crate) fn new(per_km: f64, dip_deg: f64) -> Self {
        let dip_sine = math::sin(dip_deg.abs().max(MIN_DIP_DEG).to_radians());
        Self { per_km, dip_sine }
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
    use bansho_base::assert_measured;

    use super::*;

    #[test]
    fn air_masses_are_the_published_ones() {
        // Kasten & Young (1989), table II.
        for (degrees, expected) in [(90.0, 1.0), (30.0, 1.9939), (10.0, 5.5841), (5.0, 10.3164), (0.0, 37.9196)] {
            let found = air_mass(f64::to_radians(degrees));
            assert!((found / expected - 1.0).abs() < 2e-3, "{degrees}: {found}");
        }
        assert_eq!(air_mass(-0.3), air_mass(0.0));
    }

    #[test]
    fn half_of_the_air_is_above_6_km_and_none_above_100() {
        let air = Extinction::default();
        assert_eq!(air.above(0.5), air);
        let half = air.above(LOW_KM + 8.0 * std::f64::consts::LN_2);
        assert!(
            (half.rayleigh / air.rayleigh - 0.5).abs() < 1e-12 && half.aerosol < 0.02 && half.ozone > 0.9 * air.ozone
        );
        // Even along the horizon.
        assert!(air.above(100.0).transmittance(427.8, 0.0) > 0.999);
    }

    #[test]
    fn blue_is_lost_more_than_red_and_low_more_than_high() {
        let air = Extinction::default();
        let [violet, blue, green, red] = [391.4, 427.8, 557.7, 630.0].map(|nm| air.magnitudes(nm));
        assert!(violet > blue && blue > green && green > red);
        // Bright-star catalogs use 0.2 to 0.25 in V and about twice that in B.
        assert!((0.18..0.26).contains(&green), "{green}");
        assert!((0.36..0.50).contains(&blue), "{blue}");
        assert!(air.transmittance(557.7, 0.1) < air.transmittance(557.7, 1.0));
        let overhead = math::pow(10.0, -0.4 * green);
        assert!((air.transmittance(557.7, std::f64::consts::FRAC_PI_2) / overhead - 1.0).abs() < 1e-3);
    }

    /// (2.27) by hand: d = 0.001 per km, 300 km across the field and 100 km up a vertical field.
    #[test]
    fn light_is_attenuated_by_the_square_of_its_distance() {
        let attenuation = AttenuationByDistance::new(1e-3, 90.0);
        let level = (0..).find(|level| level_altitude_km(*level) >= 100.0).unwrap();
        let [up, across] = [attenuation.of_level(level), f64::from(attenuation.of_field_line([180.0, 240.0]))];
        assert!((up - 0.990_050).abs() < 1e-6 && (across - 0.913_931).abs() < 1e-6, "{up} {across}");
        // The distance is the hypotenuse, 316 km: exp(-0.1).
        assert_measured!("equation (2.27): distance, km", math::hypot(100.0, math::hypot(180.0, 240.0)), 316.0, 0.5);
        assert_measured!("equation (2.27): attenuation", up * across, 0.904_837, 1e-6);
        assert_eq!(AttenuationByDistance::default().of_level(level), 1.0);
    }
}
