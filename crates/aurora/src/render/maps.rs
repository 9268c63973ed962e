//! AOVs of the simulation grid (thesis, figures 2.10 to 2.12, 2.14, 3.14), sampled where lines of sight intersect the
//! drawn plane.

use bansho_base::{
    math::DVec2,
    phenomenon::strip::{AovDescriptor, AovRule},
};

use crate::simulate::{AuroraSimulation, field::Grid2};

const fn of_cells(name: &'static str, unit: &'static str, doc: &'static str) -> AovDescriptor {
    AovDescriptor { name, unit, doc, rule: AovRule::Sum }
}

/// Descriptors of the maps.
pub(crate) const MAPS: [AovDescriptor; 4] = [
    of_cells(
        "scatter_count",
        "1",
        "Number of particles scattered about the in-between shape, N(i, j), in the cell where the line of sight passes 100 km altitude; 0 outside the drawn square.",
    ),
    of_cells(
        "particle_count",
        "1",
        "Number of particles in the cell where the line of sight passes 100 km altitude; 0 outside the drawn square.",
    ),
    of_cells(
        "potential",
        "km^2/s^2",
        "Potential of the in-between shape where the line of sight passes 100 km altitude, without its noise; 0 outside the drawn square.",
    ),
    of_cells(
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
        let count = |counts: &Grid2| counts.at(column as isize, row as isize) as f32;
        [
            count(self.simulation.scatter_counts()),
            count(&self.particle_counts),
            potential.sample(position.to_array()) as f32,
            self.simulation.potential_noise(position) as f32,
        ]
    }
}
