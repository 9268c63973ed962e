//! AOVs of an aurora: brightness of lines and bands in kilorayleighs, and maps of the simulation grid.

use bansho_base::phenomenon::strip::{AovDescriptor, AovRule};

use super::maps::MAPS;
use crate::physics::emission::{LINES, Line, LineSet, SpectralEmitter};

/// Wavelengths of the lines that the AOVs measure, nm.
pub(crate) const MEASURED: [f64; 6] = [557.7, 630.0, 636.4, 427.8, 391.4, 670.5];
/// Number of brightness AOVs: those of the lines, and that of all first positive bands of N2.
pub(crate) const BRIGHTNESSES: usize = MEASURED.len() + 1;

/// The lines of [`MEASURED`].
pub(crate) fn measured_lines() -> impl Iterator<Item = &'static Line> {
    MEASURED.iter().filter_map(|nm| LINES.iter().find(|line| (line.wavelength_nm - nm).abs() < 0.05))
}

/// Emitter of each of the [`BRIGHTNESSES`], and its photons per counted photon of the emitter: 0 for lines that are not emitted.
pub(crate) fn brightnesses(lines: LineSet) -> impl Iterator<Item = (SpectralEmitter, f64)> {
    let photons = move |line: &Line| if lines.has(line) { line.photons } else { 0.0 };
    let measured = measured_lines().map(move |line| (line.emitter, photons(line)));
    let first_positive = match lines {
        LineSet::Observed => 1.0,
        LineSet::Thesis => lines.lines(SpectralEmitter::Nitrogen).iter().map(|(_, photons)| photons).sum(),
    };
    measured.chain([(SpectralEmitter::Nitrogen, first_positive)])
}

const fn brightness(name: &'static str, doc: &'static str) -> AovDescriptor {
    AovDescriptor { name, unit: "kR", doc, rule: AovRule::Sum }
}

/// AOVs of an aurora, in the order of [`brightnesses`] and then of [`MAPS`].
pub(crate) const AOVS: &[AovDescriptor] = &[
    brightness(
        "kilorayleigh_557",
        "Brightness of the green line of oxygen, 557.7 nm, without extinction; 0 where there is none.",
    ),
    brightness(
        "kilorayleigh_630",
        "Brightness of the red line of oxygen, 630.0 nm, without extinction; 0 where there is none.",
    ),
    brightness(
        "kilorayleigh_636",
        "Brightness of the fainter red line of oxygen, 636.4 nm, without extinction; 0 where there is none.",
    ),
    brightness(
        "kilorayleigh_427",
        "Brightness of the band of N2+ at 427.8 nm, without extinction; 0 where there is none.",
    ),
    brightness(
        "kilorayleigh_391",
        "Brightness of the band of N2+ at 391.4 nm, without extinction; 0 where there is none.",
    ),
    brightness(
        "kilorayleigh_670",
        "Brightness of the band of N2 at 670.5 nm, without extinction; 0 where there is none.",
    ),
    brightness(
        "kilorayleigh_first_positive",
        "Brightness of all first positive bands of N2, most of them infrared, without extinction; 0 where there is none.",
    ),
    MAPS[0],
    MAPS[1],
    MAPS[2],
    MAPS[3],
];
