//! Excited states, their lines and the colors of these. Lines of one state have the same altitude profile and decay, so four maps store all
//! the light.
//!
//! The thesis's way from lines to RGB mixes two observers: its table 2.1 is that of a later one (the CIE 2006 functions), its matrix that of sRGB, which
//! belongs to the observer of 1931. Its five colors differ from those of one observer, most for 391.4 nm, of which table 2.1 sees a fifth.

use std::sync::LazyLock;

use bansho_base::color::{ACESCG_FROM_SRGB, ACESCG_FROM_XYZ, LUMINOUS_EFFICACY_LM_PER_W, Matrix3, line_xyz};

use super::{PHOTONS_PER_KILORAYLEIGH, camera::DigitalCamera};

/// Bands of the N2 first positive system in the visible (Vallance Jones 1974, table 4.12): a header, then upper and lower vibrational
/// level, wavelength in nm, A in 1/s, fraction of the photons of the whole system.
const FIRST_POSITIVE_TEXT: &str = include_str!("data/n2_1p_bands.csv");
/// h c, J m (SI 2019, exact).
const PLANCK_TIMES_LIGHT_SPEED: f64 = 6.626_070_15e-34 * 299_792_458.0;

/// An excited state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SpectralEmitter {
    /// O(1S): green, lifetime 0.75 s. Counted in photons of 557.7 nm.
    OxygenGreen,
    /// O(1D): red, radiative lifetime 134 s, shorter where it is quenched. Counted in photons of 630.0 nm.
    OxygenRed,
    /// N2+(B), first negative bands: violet and blue, prompt. Counted in photons of 427.8 nm.
    NitrogenIon,
    /// N2(B), first positive bands: deep red, prompt. Counted in photons of the whole system, most of them infrared.
    Nitrogen,
}

/// One value for each emitter, in the order of [`EMITTERS`].
pub type PerEmitter<T> = [T; 4];

/// All emitters.
pub const EMITTERS: PerEmitter<SpectralEmitter> =
    [SpectralEmitter::OxygenGreen, SpectralEmitter::OxygenRed, SpectralEmitter::NitrogenIon, SpectralEmitter::Nitrogen];

/// A spectral line or band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Its usual name.
    pub name: &'static str,
    /// Wavelength in air, nm.
    pub wavelength_nm: f64,
    /// The upper state.
    pub emitter: SpectralEmitter,
    /// Photons of this line per photon in which the emitter is counted.
    pub photons: f64,
}

const fn line(name: &'static str, wavelength_nm: f64, emitter: SpectralEmitter, photons: f64) -> Line {
    Line { name, wavelength_nm, emitter, photons }
}

/// Lines that AOVs and tests measure separately. Ratios: 630.0/636.4 Sharpee & Slanger (2006); first negative bands and
/// 670.5 nm, a band of the first positive system, Vallance Jones (1974).
pub const LINES: [Line; 7] = [
    line("O 557.7 nm", 557.734, SpectralEmitter::OxygenGreen, 1.0),
    line("O 630.0 nm", 630.03, SpectralEmitter::OxygenRed, 1.0),
    line("O 636.4 nm", 636.378, SpectralEmitter::OxygenRed, 1.0 / 2.997),
    line("N2+ 391.4 nm", 391.44, SpectralEmitter::NitrogenIon, 3.28),
    line("N2+ 427.8 nm", 427.81, SpectralEmitter::NitrogenIon, 1.0),
    line("N2+ 470.9 nm", 470.92, SpectralEmitter::NitrogenIon, 0.201),
    line("N2 670.5 nm", 670.48, SpectralEmitter::Nitrogen, 0.021_44),
];

bansho_base::choice! {
    /// Color matching functions by which spectral lines become color, eqs. (2.29) and (2.30).
    pub enum ColorMatching {
        /// CIE 1931 standard observer, 2 degrees, straight to the working space.
        Cie1931 = "cie_1931",
        /// Channels of a digital camera (Nikon D5100, Darrodi et al. 2015), developed for the white balance `camera_white_k`: a purer green and a stronger
        /// crimson, as in photographs. Luminance is the camera's, not the eye's.
        Camera = "camera",
        /// The thesis's table 2.1, which has its five lines only, and its matrix (2.30) to sRGB.
        Table21 = "table_2_1",
    }
}

/// The lines that a model of the emission knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineSet {
    /// All visible lines and bands of each state: [`LINES`], and the whole first positive system.
    Observed,
    /// The five lines of the thesis (2.4.2): 557.7 and 630.0 nm of O; 391.4, 427.8 and 670.5 nm of N2.
    Thesis,
}

impl LineSet {
    /// Wavelength, nm, and photons of each line or band of an emitter, per counted photon.
    #[must_use]
    pub fn lines(self, emitter: SpectralEmitter) -> Vec<(f64, f64)> {
        if self == Self::Observed && emitter == SpectralEmitter::Nitrogen {
            return first_positive_bands();
        }
        let lines = LINES.iter().filter(|line| line.emitter == emitter && self.has(line));
        lines.map(|line| (line.wavelength_nm, line.photons)).collect()
    }

    /// Whether it has a line.
    #[must_use]
    pub fn has(self, line: &Line) -> bool {
        self == Self::Observed || TABLE_2_1.iter().any(|(nm, _)| (nm - line.wavelength_nm).abs() < 0.05)
    }

    /// Absolute ACEScg color per kilorayleigh of the counted photons of an emitter; luminance in cd/m^2.
    #[must_use]
    pub(crate) fn color_per_kilorayleigh(self, emitter: SpectralEmitter) -> [f64; 3] {
        static COLORS: LazyLock<[PerEmitter<[f64; 3]>; 2]> = LazyLock::new(|| {
            [LineSet::Observed, LineSet::Thesis].map(|set| EMITTERS.map(|emitter| color(set, emitter)))
        });
        COLORS[self as usize][emitter.index()]
    }
}

impl ColorMatching {
    /// Absolute ACEScg color per kilorayleigh of a line, luminance in cd/m^2. A camera's colors are those of `camera`.
    #[must_use]
    pub(crate) fn line_color(self, camera: &DigitalCamera, wavelength_nm: f64) -> [f64; 3] {
        match self {
            Self::Cie1931 => ACESCG_FROM_XYZ.apply(absolute_xyz(wavelength_nm)),
            Self::Camera => camera.line_color(wavelength_nm, watts_per_kilorayleigh(wavelength_nm)),
            Self::Table21 => table_2_1_acescg(wavelength_nm, watts_per_kilorayleigh(wavelength_nm)),
        }
    }
}

impl SpectralEmitter {
    /// Its index in [`EMITTERS`].
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Absolute ACEScg color per kilorayleigh of the counted photons, all lines and bands included; luminance in
    /// cd/m^2. The color is outside the AP1 gamut: components may be negative and are kept until the view transform.
    #[must_use]
    pub(crate) fn color_per_kilorayleigh(self) -> [f64; 3] {
        LineSet::Observed.color_per_kilorayleigh(self)
    }
}

fn color(set: LineSet, emitter: SpectralEmitter) -> [f64; 3] {
    let sum = set.lines(emitter).into_iter().fold([0.0; 3], |sum: [f64; 3], (wavelength_nm, photons)| {
        let xyz = absolute_xyz(wavelength_nm);
        std::array::from_fn(|i| sum[i] + photons * xyz[i])
    });
    ACESCG_FROM_XYZ.apply(sum)
}

/// Radiance of a kilorayleigh at a wavelength, W m^-2 sr^-1: 10^13 photons m^-2 s^-1 over the full sphere (Hunten et al.
/// 1956).
pub(super) fn watts_per_kilorayleigh(wavelength_nm: f64) -> f64 {
    let photon = PLANCK_TIMES_LIGHT_SPEED / (wavelength_nm * 1e-9);
    PHOTONS_PER_KILORAYLEIGH / (4.0 * std::f64::consts::PI) * photon
}

/// XYZ per kilorayleigh at a wavelength, Y in cd/m^2, (2.29).
fn absolute_xyz(wavelength_nm: f64) -> [f64; 3] {
    let radiance = watts_per_kilorayleigh(wavelength_nm);
    line_xyz(wavelength_nm).map(|value| LUMINOUS_EFFICACY_LM_PER_W * radiance * value)
}

/// Columns 2 and 4 of each row of the table: wavelength, nm, and photons.
fn first_positive_bands() -> Vec<(f64, f64)> {
    let mut bands = Vec::new();
    for row in FIRST_POSITIVE_TEXT.lines().skip(1) {
        let fields: Vec<&str> = row.split(',').collect();
        // The table is compiled in and a test parses every field, so NaN cannot occur.
        let [wavelength_nm, photons] =
            [2, 4].map(|column| fields.get(column).and_then(|field| field.parse().ok()).unwrap_or(f64::NAN));
        bands.push((wavelength_nm, photons));
    }
    bands
}

/// Table 2.1 of the thesis: wavelength, nm, and the color matching functions there.
const TABLE_2_1: [(f64, [f64; 3]); 5] = [
    (557.734, [0.5739, 0.9993, 0.0018]),
    (630.03, [0.6924, 0.2981, 0.0000]),
    (391.44, [0.0049, 0.0005, 0.0239]),
    (427.81, [0.2736, 0.0299, 1.4463]),
    (670.48, [0.0893, 0.0345, 0.0000]),
];

/// (2.30): linear sRGB of XYZ.
const RGB_FROM_XYZ: Matrix3 =
    Matrix3([[3.24097, -1.53738, -0.498612], [-0.969241, 1.87596, 0.0415554], [0.0556299, -0.203976, 1.05697]]);

/// Linear sRGB of a line of a radiance in W m^-2 sr^-1, (2.29) with K = 683 lm/W and (2.30). The line is the nearest of the five. Components are negative
/// where the line lies outside sRGB.
#[must_use]
pub(super) fn table_2_1_srgb(wavelength_nm: f64, radiance: f64) -> [f64; 3] {
    let nearest =
        TABLE_2_1.iter().min_by(|(a, _), (b, _)| (a - wavelength_nm).abs().total_cmp(&(b - wavelength_nm).abs()));
    let xyz = nearest.map_or([0.0; 3], |(_, xyz)| xyz.map(|value| LUMINOUS_EFFICACY_LM_PER_W * radiance * value));
    RGB_FROM_XYZ.apply(xyz)
}

/// [`table_2_1_srgb`] in the working space.
#[must_use]
fn table_2_1_acescg(wavelength_nm: f64, radiance: f64) -> [f64; 3] {
    ACESCG_FROM_SRGB.apply(table_2_1_srgb(wavelength_nm, radiance))
}

#[cfg(test)]
mod tests {
    use bansho_base::color::luminance;

    use super::*;

    fn luminance_of(color: [f64; 3]) -> f64 {
        luminance(color.map(|value| value as f32)) as f64
    }

    #[test]
    fn bands_are_whole() {
        let bands = first_positive_bands();
        assert_eq!(bands.len(), 27);
        assert!(bands.iter().all(|(nm, weight)| (570.0..780.0).contains(nm) && *weight > 0.0));
        // 670.5 nm is one of them.
        assert!(bands.iter().any(|(nm, weight)| (nm - 670.5).abs() < 0.1 && (weight - LINES[6].photons).abs() < 1e-9));
    }

    #[test]
    fn luminances_are_those_of_the_reference() {
        let mut compared = 0;
        for row in include_str!("data/line_colors.csv").lines().skip(1) {
            let fields: Vec<&str> = row.split(',').collect();
            let number = |column: usize| fields[column].parse::<f64>().unwrap();
            if fields[2] == "CIE1931_2deg" && !fields[0].contains("composite") {
                let line = LINES.iter().find(|line| (line.wavelength_nm - number(1)).abs() < 0.02).unwrap();
                let found =
                    luminance_of(ColorMatching::Cie1931.line_color(&DigitalCamera::new(6500.0), line.wavelength_nm));
                assert!((found / number(19) - 1.0).abs() < 0.01, "{row}: {found}");
                compared += 1;
            }
        }
        assert_eq!(compared, 6);
    }

    #[test]
    fn composite_of_the_first_positive_bands_agrees_with_the_reference() {
        // 5.68975e-6 cd/m^2 per kR of the bands in 575-780 nm alone.
        let visible: f64 = first_positive_bands().iter().map(|(_, weight)| weight).sum();
        let found = luminance_of(SpectralEmitter::Nitrogen.color_per_kilorayleigh()) / visible;
        assert!((found / 5.68975e-6 - 1.0).abs() < 0.02, "{found}");
    }

    #[test]
    fn saturated_lines_lie_outside_the_working_space() {
        let negative = |emitter: SpectralEmitter| emitter.color_per_kilorayleigh().iter().any(|value| *value < 0.0);
        assert!(
            negative(SpectralEmitter::OxygenGreen)
                || negative(SpectralEmitter::OxygenRed)
                || negative(SpectralEmitter::NitrogenIon)
        );
        let [r, g, b] = SpectralEmitter::OxygenGreen.color_per_kilorayleigh();
        assert!(g > r.max(b));
        let [r, g, b] = SpectralEmitter::NitrogenIon.color_per_kilorayleigh();
        assert!(b > r.max(g));
    }

    #[test]
    fn the_five_colors_of_table_2_1_by_hand() {
        // Table 2.1 as printed, lines to a tenth of a nanometer.
        let printed = [
            (557.7, [0.5739, 0.9993, 0.0018]),
            (630.0, [0.6924, 0.2981, 0.0000]),
            (391.4, [0.0049, 0.0005, 0.0239]),
            (427.8, [0.2736, 0.0299, 1.4463]),
            (670.5, [0.0893, 0.0345, 0.0000]),
        ];
        let is_line = |(nm, xyz): &&(f64, [f64; 3])| {
            TABLE_2_1.iter().any(|(of_line, functions)| (of_line - nm).abs() < 0.05 && functions == xyz)
        };
        let lines = printed.iter().filter(is_line).count();
        bansho_base::assert_measured!("table 2.1: lines as printed", lines as f64, 5.0, 0.0);
        // 3.24097 x 0.5739 - 1.53738 x 0.9993 - 0.498612 x 0.0018 = 0.322793; -0.556247 + 1.874647 + 0.000075 = 1.318475;
        // 0.031926 - 0.203833 + 0.001903 = -0.170005. Times 683.
        let [r, g, b] = table_2_1_srgb(557.7, 1.0);
        bansho_base::assert_measured!("equation (2.29): red of 557.7 nm over 683", r / 683.0, 0.322793, 1e-5);
        bansho_base::assert_measured!("equation (2.29): green of 557.7 nm over 683", g / 683.0, 1.318475, 1e-5);
        bansho_base::assert_measured!("equation (2.29): blue of 557.7 nm over 683", b / 683.0, -0.170005, 1e-5);
        // 427.8 nm: 0.886729 - 0.045968 - 0.721143 = 0.119619; -0.265184 + 0.056091 + 0.060102 = -0.148991; 0.015220 - 0.006099 + 1.528696 = 1.537817.
        let [r, g, b] = table_2_1_srgb(427.8, 2.0).map(|value| value / (2.0 * 683.0));
        bansho_base::assert_measured!("equation (2.30): red of 427.8 nm over 683", r, 0.119619, 1e-5);
        bansho_base::assert_measured!("equation (2.30): green of 427.8 nm over 683", g, -0.148991, 1e-5);
        bansho_base::assert_measured!("equation (2.30): blue of 427.8 nm over 683", b, 1.537817, 1e-5);
    }
}
