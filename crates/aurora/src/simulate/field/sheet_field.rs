//! The electric field that attracts particles to the in-between shape (thesis, 2.2.3).
//!
//! Units: km and s, particle charge and mass 1; the field is an acceleration in km/s^2 and the potential is in
//! km^2/s^2. Constants are given in cells and frames.

use bansho_base::{
    host::parallel::prelude::*,
    math::{
        self, DVec2, MulAdd,
        random::{Key, Purpose},
    },
    noise::{Coordinate, Fractal, Noise},
    parameters::Auto,
};

use super::{
    Grid2, PoissonSolver, gauss_seidel_sweep,
    sheet_charge::{ChargeTarget, ScatteredParticle, SheetCharge, SheetCoordinate},
};
use crate::{
    AuroraParameters, FieldCharge, FieldSolver, shapes::FRAME_S, simulate::sheets::refined_shape::RefinedShape,
};

/// Default screening length l, cells: particles within a few cells are attracted, those farther away can be removed.
const REACH_CELLS: f64 = 3.0;
/// Iterations of the conductor charge.
const ADJUSTMENTS: usize = 4;
/// Minimum particles per task.
const TASK: usize = 4096;
/// Field at the edge of a sheet at an attraction of 1, cells per frame^2.
const EDGE_FIELD: f64 = 0.25;

/// Builds the field of a shape; holds all data that do not depend on the shape.
#[derive(Clone, Debug)]
pub(crate) struct FieldBuilder {
    parameters: AuroraParameters,
    solver: PoissonSolver,
    /// 1 / l^2, 1/km^2.
    pub(crate) screening: f64,
    noise: Noise<3>,
}

/// The field of one in-between shape.
#[derive(Clone, Debug)]
pub(crate) struct ElectricField {
    /// N(i, j): number of scattered particles per cell.
    pub(crate) counts: Grid2,
    /// phi(i, j) without noise, as used by relocation.
    pub(crate) potential: Grid2,
    /// Potential with noise and field (2.7) to (2.9), padded to four components, with one ghost row and column on each
    /// side.
    table: Vec<[f32; 4]>,
    /// Columns and rows, the lower corner in cells, and cells per km.
    size: [f32; 2],
    corner: [f32; 2],
    per_km: f32,
}

/// Potential and field at a position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FieldSample {
    /// km^2/s^2.
    pub(crate) potential: f32,
    /// km/s^2, x and z.
    pub(crate) field: [f32; 2],
}

impl FieldBuilder {
    pub(crate) fn new(parameters: &AuroraParameters, key: Key) -> Self {
        let cells = parameters.field.cells as usize;
        let reach = match parameters.field.screening_length_km {
            Auto::Auto => REACH_CELLS * parameters.cell_km(),
            Auto::Set(reach) => reach,
        };
        let screening = 1.0 / (reach * reach);
        let [seed, ..] = key.words(0, 0, Purpose::named("aurora field noise"));
        Self {
            solver: PoissonSolver::new([cells; 2], parameters.cell_km(), screening),
            screening,
            noise: Noise::new(seed, Fractal { octaves: 3, ..Fractal::default() }, [0; 3])
                .expect("three octaves without a period are noise"),
            parameters: parameters.clone(),
        }
    }

    /// An empty grid over the drawn square.
    pub(super) fn grid(&self) -> Grid2 {
        let cells = self.parameters.field.cells as usize;
        Grid2::new([cells; 2], self.parameters.cell_km(), [-self.parameters.extent_km / 2.0; 2])
    }

    /// Screening length, km.
    pub(super) fn reach_km(&self) -> f64 {
        1.0 / self.screening.sqrt()
    }

    /// The field of scattered particles, with the noise at a time.
    pub(crate) fn build(&self, refined: &RefinedShape, scattered: &[ScatteredParticle], time: f64) -> ElectricField {
        let counts = self.sum_by_cell(scattered.iter().map(|particle| (particle.position, 1.0)));
        let source = self.charge_density(refined, scattered, &counts);
        let potential = match self.parameters.field.solver {
            FieldSolver::SineTransform => self.solve_directly(source),
            FieldSolver::GaussSeidel => self.solve_by_relaxation(&source),
        };
        let table = self.sample_table(&potential, time);
        let per_km = 1.0 / counts.spacing();
        ElectricField {
            size: counts.size().map(|cells| cells as f32),
            corner: counts.origin().map(|corner| (corner * per_km) as f32),
            per_km: per_km as f32,
            counts,
            potential,
            table,
        }
    }

    /// Sums values by cell.
    pub(crate) fn sum_by_cell(&self, values: impl Iterator<Item = (DVec2, f64)>) -> Grid2 {
        let mut sums = self.grid();
        for (position, value) in values {
            if let Some(cell) = sums.index(position.to_array()) {
                sums.values_mut()[cell] += value;
            }
        }
        sums
    }

    /// Charge density over eps, eq. (2.2), normalized so that all sheets attract equally whatever the number of
    /// particles; by default with constant potential along the sheets.
    pub(crate) fn charge_density(
        &self,
        refined: &RefinedShape,
        scattered: &[ScatteredParticle],
        counts: &Grid2,
    ) -> Grid2 {
        let half_thickness = self.parameters.half_thickness_km();
        let density = self.edge_field() / half_thickness;
        let unit = density / full_cell_count(counts).max(1.0);
        // In the middle of a long, straight, isolated sheet.
        let reach = self.reach_km();
        // A slab of half-thickness d in a medium with screening length l has the potential -rho l^2 (1 - exp(-d / l)) in its middle.
        let potential = density * reach * reach * (math::exp(-half_thickness / reach) - 1.0);
        let target = ChargeTarget { potential, density, half_thickness };
        let mut charge =
            SheetCharge::uniform(refined, self.parameters.cell_km(), self.parameters.particles.count as f64);
        let coordinates: Vec<(usize, SheetCoordinate)> = scattered
            .par_iter()
            .with_min_len(TASK)
            .filter_map(|particle| Some((counts.index(particle.position.to_array())?, charge.coordinate(particle))))
            .collect();
        // Sheets without attraction have no target potential.
        let is_conductor = self.parameters.field.charge == FieldCharge::Conductor;
        let adjustments = if density > 0.0 && is_conductor { ADJUSTMENTS } else { 0 };
        for _ in 0..adjustments {
            let potential = self.solve_directly(self.sum_charge(&charge, &coordinates, unit));
            charge.adjust_toward(refined, &potential, target);
        }
        self.sum_charge(&charge, &coordinates, unit)
    }

    /// Sums the charge of particles with these cells and coordinates along the sheets, in units of `unit`.
    fn sum_charge(&self, charge: &SheetCharge, coordinates: &[(usize, SheetCoordinate)], unit: f64) -> Grid2 {
        let mut source = self.grid();
        let cells = source.values_mut();
        for (cell, position) in coordinates {
            cells[*cell] += unit * charge.charge(*position);
        }
        source
    }

    /// Field at the edge of a sheet, km/s^2.
    fn edge_field(&self) -> f64 {
        self.parameters.field.attraction * EDGE_FIELD * self.parameters.cell_km() / (FRAME_S * FRAME_S)
    }

    /// Solves `laplacian(phi) - phi / l^2 = rho` directly; phi is negative, lowest on the shape.
    fn solve_directly(&self, mut source: Grid2) -> Grid2 {
        self.solver.solve(&mut source);
        source
    }

    /// Eq. (2.6), until the maximum number of sweeps or the tolerance.
    fn solve_by_relaxation(&self, source: &Grid2) -> Grid2 {
        let mut potential = self.grid();
        let tolerance = self.parameters.field.tolerance * self.edge_field() * self.reach_km();
        let sweeps = self.parameters.field.sweeps;
        (0..sweeps).take_while(|_| gauss_seidel_sweep(&mut potential, source, self.screening) > tolerance).count();
        potential
    }

    /// Potential with the noise of (x, z, t) and field (the negative gradient) of each cell, row by row, with a border that
    /// repeats the outermost cells.
    fn sample_table(&self, potential: &Grid2, time: f64) -> Vec<[f32; 4]> {
        let mut noisy = potential.clone();
        self.add_noise(&mut noisy, time);
        let gradient = noisy.gradient();
        let [columns, rows] = noisy.size();
        let entries = (0..(columns + 2) * (rows + 2)).into_par_iter().with_min_len(TASK);
        entries
            .map(|index| {
                let (column, row) = (index % (columns + 2), index / (columns + 2));
                let inner = (row.clamp(1, rows) - 1) * columns + column.clamp(1, columns) - 1;
                let [x, z] = gradient.values()[inner];
                [noisy.values()[inner] as f32, -x as f32, -z as f32, 0.0]
            })
            .collect()
    }

    fn add_noise(&self, potential: &mut Grid2, time: f64) {
        let field = &self.parameters.field;
        if field.noise == 0.0 {
            return;
        }
        // Relative to the depth of the potential: the noise disturbs a weak field as much as a strong one.
        let depth = potential.values().iter().fold(0.0_f64, |low, value| low.min(*value)).abs();
        let scale = potential.spacing() / field.noise_scale_km;
        let columns = potential.size()[0];
        let along: Vec<f32> = (0..columns).map(|column| (column as f64 * scale) as f32).collect();
        let level = bansho_base::math::simd::level();
        let rows = potential.values_mut().par_chunks_mut(columns).enumerate();
        rows.for_each_with(vec![0.0_f32; columns], |values, (row, cells)| {
            let origin = [0.0, row as f64 * scale, time / field.noise_correlation_time_s].map(Coordinate::from_f64);
            self.noise.row(level, origin, &along, values);
            cells.iter_mut().zip(values).for_each(|(cell, noise)| *cell += field.noise * depth * f64::from(*noise));
        });
    }
}

/// Typical count of a cell that is entirely within a sheet: the mean over particles of their cell's count.
pub(crate) fn full_cell_count(counts: &Grid2) -> f64 {
    let sum: f64 = counts.values().iter().sum();
    let squares: f64 = counts.values().iter().map(|count| count * count).sum();
    if sum > 0.0 { squares / sum } else { 0.0 }
}

impl ElectricField {
    /// Bilinear interpolation between cell centers, clamped to the outermost.
    #[inline(always)]
    pub(crate) fn sample(&self, x: f32, z: f32) -> FieldSample {
        let coordinates = [x, z];
        let (mut cells, mut fractions) = ([0; 2], [0.0; 2]);
        for axis in 0..2 {
            let position = coordinates[axis].fma(self.per_km, 0.5 - self.corner[axis]);
            // Comparisons, so that NaN becomes 0. The table has a border of one cell: there is a cell after the last one of the grid.
            let clamped = if position > 0.0 { position } else { 0.0 };
            let max = self.size[axis] + 0.999;
            let clamped = if clamped < max { clamped } else { max };
            cells[axis] = clamped as usize;
            fractions[axis] = clamped - cells[axis] as f32;
        }
        let columns = self.size[0] as usize + 2;
        let first = cells[1] * columns + cells[0];
        let (lower, upper) = (&self.table[first..first + 2], &self.table[first + columns..first + columns + 2]);
        let mut sample = [0.0; 4];
        for k in 0..4 {
            let lower = fractions[0].fma(lower[1][k] - lower[0][k], lower[0][k]);
            let upper = fractions[0].fma(upper[1][k] - upper[0][k], upper[0][k]);
            sample[k] = fractions[1].fma(upper - lower, lower);
        }
        let [potential, east, south, _] = sample;
        FieldSample { potential, field: [east, south] }
    }
}
