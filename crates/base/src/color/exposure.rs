//! Exposure values. `EV100` is the exposure value at ISO 100; the saturation-based speed of ISO 12232 puts display white at
//! `L = 1.2 * 2^EV100` cd/m^2 (Lagarde & de Rousiers 2014, section 5.1).

/// Luminance that saturates at EV100 = 0, cd/m^2.
const WHITE_AT_EV_0: f64 = 1.2;

/// Luminance that becomes display white (1.0) at `ev100`, cd/m^2.
#[must_use]
pub fn white_luminance(ev100: f64) -> f64 {
    WHITE_AT_EV_0 * libm::exp2(ev100)
}

/// Factor for scene-linear values in cd/m^2 such that 1.0 is display white at `ev100`.
#[must_use]
pub fn exposure_scale(ev100: f64) -> f64 {
    libm::exp2(-ev100) / WHITE_AT_EV_0
}

/// The EV100 at which `luminance` in cd/m^2 (above 0) becomes display white: the inverse of [`white_luminance`].
#[must_use]
pub fn ev100_of_white_luminance(luminance: f64) -> f64 {
    libm::log2(luminance / WHITE_AT_EV_0)
}

/// The EV100 of a picture taken with an f-number, an exposure time in seconds and a sensitivity (ISO): `log2(N^2 / t) - log2(S / 100)`
/// (ISO 2720). `None` if one of them is not above 0, or if the absolute value of the result exceeds [`MAX_EV100`].
#[must_use]
pub fn ev100_of_camera(f_number: f64, exposure_time_s: f64, iso: f64) -> Option<f64> {
    let ev100 = libm::log2(f_number * f_number / exposure_time_s) - libm::log2(iso / 100.0);
    let are_positive = [f_number, exposure_time_s, iso].iter().all(|value| *value > 0.0);
    (are_positive && (-MAX_EV100..=MAX_EV100).contains(&ev100)).then_some(ev100)
}

/// Largest absolute exposure value at ISO 100.
pub const MAX_EV100: f64 = 40.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cameras_settings_give_its_exposure_value() {
        // Sunny 16: f/16, 1/100 s, ISO 100.
        assert!((ev100_of_camera(16.0, 0.01, 100.0).unwrap() - 14.644).abs() < 1e-3);
        // Two stops more sensitive, two stops darker.
        assert!((ev100_of_camera(2.0, 0.5, 400.0).unwrap() - 1.0).abs() < 1e-12);
        for [f_number, time, iso] in [[0.0, 1.0, 100.0], [2.8, 0.0, 100.0], [2.8, 1.0, 0.0], [f64::NAN, 1.0, 100.0]] {
            assert_eq!(ev100_of_camera(f_number, time, iso), None);
        }
        assert_eq!(ev100_of_camera(1e9, 1e-9, 100.0), None);
    }

    #[test]
    fn hand_worked_values() {
        assert!((white_luminance(0.0) - 1.2).abs() < 1e-15);
        assert!((white_luminance(15.0) - 39_321.6).abs() < 1e-9);
        assert!((exposure_scale(3.0) - 1.0 / 9.6).abs() < 1e-15);
        assert!((ev100_of_white_luminance(4.8) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn forward_and_back() {
        for ev100 in [-20.0, -3.5, 0.0, 7.25, 16.0] {
            assert!((ev100_of_white_luminance(white_luminance(ev100)) - ev100).abs() < 1e-12);
            assert!((white_luminance(ev100) * exposure_scale(ev100) - 1.0).abs() < 1e-12);
        }
    }
}
