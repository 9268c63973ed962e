//! The thesis's attenuation of light by distance (2.27).

use bansho_base::math;

use super::atmosphere::level_altitude_km;

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
    use super::*;

    /// (2.27) by hand: d = 0.001 per km, 300 km across the field and 100 km up a vertical field.
    #[test]
    fn light_is_attenuated_by_the_square_of_its_distance() {
        let attenuation = AttenuationByDistance::new(1e-3, 90.0);
        let level = (0..).find(|level| level_altitude_km(*level) >= 100.0).unwrap();
        let [up, across] = [attenuation.of_level(level), f64::from(attenuation.of_field_line([180.0, 240.0]))];
        assert!((up - 0.990_050).abs() < 1e-6 && (across - 0.913_931).abs() < 1e-6, "{up} {across}");
        // The distance is the hypotenuse: exp(-0.1).
        assert!((up * across - 0.904_837).abs() < 1e-6);
        assert_eq!(AttenuationByDistance::default().of_level(level), 1.0);
    }
}
