//! Spectral lines as a digital camera records and develops them.
//!
//! No camera's channels are linear combinations of the color-matching functions. For the smooth spectra of objects the difference is small, and the matrix
//! of a camera corrects most of it. A spectral line is where the difference is largest: 557.7 nm lies where the red channel sees hardly anything, and the red
//! of 630 to 680 nm is seen more strongly than by the eye. Photographs of auroras are therefore of a purer green and of a stronger crimson than what the eye
//! sees. Radiances and kilorayleighs are the same.
//!
//! The steps are those of raw converters: channels are balanced so that the light of a black body is neutral, and one matrix leads from balanced channels to
//! sRGB.

use std::sync::LazyLock;

use bansho_base::color::{
    ACESCG_FROM_SRGB, LUMINOUS_EFFICACY_LM_PER_W, Matrix3, SRGB_FROM_XYZ, WhiteBalance, line_xyz,
    planck_radiance_per_nm,
};

/// Sensitivities of the camera: a comment, a header, then wavelength in nm and the three channels.
const SENSITIVITIES_TEXT: &str = include_str!("data/nikon_d5100.csv");

/// Channels of the camera from XYZ, for D65: the matrix that raw converters have for it (`ColorMatrix2` of the Adobe DNG Converter).
const CHANNELS_FROM_XYZ: Matrix3 =
    Matrix3([[0.8198, -0.2239, -0.0724], [-0.4871, 1.2389, 0.2798], [-0.1043, 0.2050, 0.7181]]);

/// Wavelength, nm, and the sensitivities of the three channels.
static SENSITIVITIES: LazyLock<Vec<(f64, [f64; 3])>> = LazyLock::new(|| {
    let mut rows = Vec::new();
    for line in SENSITIVITIES_TEXT.lines().skip(2) {
        let mut fields = line.split(',').map(|field| field.parse().unwrap_or(f64::NAN));
        // The table is compiled in and a test parses every field, so NaN cannot occur.
        let mut next = || fields.next().unwrap_or(f64::NAN);
        rows.push((next(), [next(), next(), next()]));
    }
    rows
});

/// A camera with a white balance.
#[derive(Clone, Debug)]
pub(crate) struct DigitalCamera {
    /// Scene-linear ACEScg from channels: a picture with the same white balance shows what the camera shows.
    acescg_from_channels: Matrix3,
}

impl DigitalCamera {
    /// The camera balanced for the light of a black body of that temperature, K.
    #[must_use]
    pub(crate) fn new(white_balance_k: f64) -> Self {
        let (mut white, mut luminance) = ([0.0; 3], 0.0);
        for (wavelength_nm, channels) in SENSITIVITIES.iter() {
            let radiance = planck_radiance_per_nm(*wavelength_nm, white_balance_k);
            let [_, y, _] = line_xyz(*wavelength_nm);
            luminance += LUMINOUS_EFFICACY_LM_PER_W * radiance * y;
            for (sum, channel) in white.iter_mut().zip(channels) {
                *sum += radiance * channel;
            }
        }
        let [red, green, blue] = white.map(|channel| luminance / channel);
        let balanced = Matrix3([[red, 0.0, 0.0], [0.0, green, 0.0], [0.0, 0.0, blue]]);
        let shown = ACESCG_FROM_SRGB.times(&srgb_from_balanced_channels()).times(&balanced);
        Self { acescg_from_channels: WhiteBalance::matrix(white_balance_k).inverse().times(&shown) }
    }

    /// ACEScg color of a line of this radiance in W m^-2 sr^-1. Its luminance is that of the white that the camera records as brightly, in cd/m^2.
    #[must_use]
    pub(crate) fn line_color(&self, wavelength_nm: f64, radiance: f64) -> [f64; 3] {
        self.acescg_from_channels.apply(channels(wavelength_nm).map(|channel| channel * radiance))
    }
}

/// The matrix of the camera for channels in which white is (1, 1, 1).
fn srgb_from_balanced_channels() -> Matrix3 {
    let channels_from_srgb = CHANNELS_FROM_XYZ.times(&SRGB_FROM_XYZ.inverse());
    Matrix3(channels_from_srgb.0.map(|row| {
        let sum: f64 = row.iter().sum();
        row.map(|value| value / sum)
    }))
    .inverse()
}

/// The channels at a wavelength, linear between rows and 0 beyond them.
fn channels(wavelength_nm: f64) -> [f64; 3] {
    for pair in SENSITIVITIES.windows(2) {
        let [(low_nm, low), (high_nm, high)] = [pair[0], pair[1]];
        if (low_nm..=high_nm).contains(&wavelength_nm) {
            let fraction = (wavelength_nm - low_nm) / (high_nm - low_nm);
            return std::array::from_fn(|channel| low[channel] + (high[channel] - low[channel]) * fraction);
        }
    }
    [0.0; 3]
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        color::{ACESCG_FROM_XYZ, SRGB_FROM_ACESCG, luminance},
        math,
    };

    use super::*;

    #[test]
    fn the_table_is_whole() {
        assert_eq!(SENSITIVITIES.len(), 81);
        for (index, (wavelength_nm, channels)) in SENSITIVITIES.iter().enumerate() {
            assert_eq!(*wavelength_nm, (380 + 5 * index) as f64);
            assert!(channels.iter().all(|value| (0.0..=1.0).contains(value)));
        }
        assert_eq!((channels(379.0), channels(781.0)), ([0.0; 3], [0.0; 3]));
    }

    /// What the camera makes of a spectrum, as displayed with the same white balance, and what the eye sees of it: linear sRGB.
    fn shown(white_balance_k: f64, radiance_per_nm: impl Fn(f64) -> f64) -> [[f64; 3]; 2] {
        let camera = DigitalCamera::new(white_balance_k);
        let (mut recorded, mut xyz) = ([0.0; 3], [0.0; 3]);
        for (wavelength_nm, _) in SENSITIVITIES.iter() {
            let radiance = radiance_per_nm(*wavelength_nm);
            let color = camera.line_color(*wavelength_nm, radiance);
            let matching = line_xyz(*wavelength_nm);
            for c in 0..3 {
                recorded[c] += color[c];
                xyz[c] += LUMINOUS_EFFICACY_LM_PER_W * radiance * matching[c];
            }
        }
        let balance = WhiteBalance::matrix(white_balance_k);
        [recorded, ACESCG_FROM_XYZ.apply(xyz)].map(|color| SRGB_FROM_ACESCG.apply(balance.apply(color)))
    }

    #[test]
    fn the_light_of_its_white_balance_is_neutral_and_as_bright_as_for_the_eye() {
        for kelvin in [3400.0, 4000.0, 6500.0] {
            let [recorded, seen] = shown(kelvin, |nm| planck_radiance_per_nm(nm, kelvin));
            assert!((0..3).all(|c| (recorded[c] / seen[1] - 1.0).abs() < 5e-3), "{kelvin} K: {recorded:?} {seen:?}");
        }
    }

    #[test]
    fn smooth_surfaces_in_daylight_nearly_keep_their_colors() {
        // Grass, brick and a blue paint, about.
        for (middle, width) in [(550.0, 60.0), (640.0, 60.0), (460.0, 60.0)] {
            let reflectance = |nm: f64| 0.1 + 0.3 * math::exp(-0.5 * ((nm - middle) / width) * ((nm - middle) / width));
            let [recorded, seen] = shown(6000.0, |nm| reflectance(nm) * planck_radiance_per_nm(nm, 6000.0));
            let [_, white] = shown(6000.0, |nm| planck_radiance_per_nm(nm, 6000.0));
            for c in 0..3 {
                assert!(
                    (recorded[c] - seen[c]).abs() < 0.05 * white[1],
                    "{middle} nm: {recorded:?} {seen:?} {white:?}"
                );
            }
        }
    }

    #[test]
    fn a_camera_sees_green_without_red_and_the_deep_red_stronger_than_the_eye() {
        let camera = DigitalCamera::new(5500.0);
        let srgb = |color: [f64; 3]| SRGB_FROM_ACESCG.apply(color);
        let of_eye = |nm: f64| ACESCG_FROM_XYZ.apply(line_xyz(nm).map(|value| LUMINOUS_EFFICACY_LM_PER_W * value));
        let [eye_red, eye_green, _] = srgb(of_eye(557.7));
        let [red, green, _] = srgb(camera.line_color(557.7, 1.0));
        assert!(eye_red > 0.15 * eye_green && red < 0.0 && green > 0.7 * eye_green, "{red} {green}");
        let luminance_of = |color: [f64; 3]| luminance(color.map(|value| value as f32));
        let ratio = luminance_of(camera.line_color(655.0, 1.0)) / luminance_of(of_eye(655.0));
        assert!((1.5..2.5).contains(&ratio), "{ratio}");
        // Beyond the table no channel sees anything.
        assert_eq!(camera.line_color(900.0, 1.0), [0.0; 3]);
    }
}
