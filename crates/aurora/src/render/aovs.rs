//! AOVs of an aurora: brightness of lines and bands in kilorayleighs, and maps of the simulation grid (thesis, figures 2.10
//! to 2.12, 2.14, 3.14), sampled where lines of sight intersect the drawn plane.

use bansho_base::{
    math::DVec2,
    phenomenon::strip::{AovDescriptor, AovRule},
};

use crate::{
    physics::emission::{LINES, Line, LineSet, SpectralEmitter},
    simulate::{AuroraSimulation, field::Grid2},
};

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
    let measured = measured_lines().map(move |line| (line.emitter, if lines.has(line) { line.photons } else { 0.0 }));
    let first_positive = match lines {
        LineSet::Observed => 1.0,
        LineSet::Thesis => lines.lines(SpectralEmitter::Nitrogen).iter().map(|(_, photons)| photons).sum(),
    };
    measured.chain([(SpectralEmitter::Nitrogen, first_positive)])
}

const fn descriptor(name: &'static str, unit: &'static str, doc: &'static str) -> AovDescriptor {
    AovDescriptor { name, unit, doc, rule: AovRule::Sum }
}

const fn brightness(name: &'static str, doc: &'static str) -> AovDescriptor {
    descriptor(name, "kR", doc)
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

/// Descriptors of the maps.
pub(crate) const MAPS: [AovDescriptor; 4] = [
    descriptor(
        "scatter_count",
        "1",
        "Number of particles scattered about the in-between shape, N(i, j), in the cell where the line of sight passes 100 km altitude; 0 outside the drawn square.",
    ),
    descriptor(
        "particle_count",
        "1",
        "Number of particles in the cell where the line of sight passes 100 km altitude; 0 outside the drawn square.",
    ),
    descriptor(
        "potential",
        "km^2/s^2",
        "Potential of the in-between shape where the line of sight passes 100 km altitude, without its noise; 0 outside the drawn square.",
    ),
    descriptor(
        "potential_noise",
        "km^2/s^2",
        "Noise in the potential where the line of sight passes 100 km altitude; 0 outside the drawn square.",
    ),
];

/// The maps of one simulation state.
pub(super) struct CellMaps<'a> {
    simulation: &'a AuroraSimulation,
    particle_counts: Grid2,
}

impl<'a> CellMaps<'a> {
    pub(super) fn new(simulation: &'a AuroraSimulation) -> Self {
        Self { simulation, particle_counts: simulation.particle_counts() }
    }

    /// The values of [`MAPS`] at a position of the drawn plane, km.
    pub(super) fn at(&self, position: DVec2) -> [f32; MAPS.len()] {
        let potential = self.simulation.potential();
        let Some([column, row]) = potential.cell(position.to_array()) else { return [0.0; MAPS.len()] };
        let [scattered, particles] = [self.simulation.scatter_counts(), &self.particle_counts]
            .map(|counts| counts.at(column as isize, row as isize) as f32);
        [
            scattered,
            particles,
            potential.sample(position.to_array()) as f32,
            self.simulation.potential_noise(position) as f32,
        ]
    }
}
