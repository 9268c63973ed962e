//! Projection of the velocity: the pressure that gives it the divergence that follows from the expansion of the gas.

mod capacitance;
mod poisson;
mod transform;

use bansho_base::{
    host::parallel::prelude::*,
    math::simd::{LANES, Lanes},
};
use fearless_simd::{Simd, dispatch, prelude::*};

use crate::{
    grid::{GHOST_LAYERS, Grid},
    momentum::Velocity,
    reconstruction::load,
    sides::{Ambient, Side, SideFace, side_pressure},
    solids::Solids,
};
use capacitance::SolidBoundary;
use poisson::{PoissonSolver, Slab};

/// Solver of the pressure of a grid, with its buffers.
pub(crate) struct Projection {
    grid: Grid,
    has_floor: bool,
    solver: PoissonSolver,
    /// All layers.
    whole: Slab,
    /// Where gas touches solids.
    boundary: Option<SolidBoundary>,
    /// Source, then solution, without ghost cells.
    values: Vec<f32>,
}

/// What a projection is told besides the velocity.
pub(crate) struct Constraint<'a> {
    /// Divergence that the velocity gets, 1/s.
    pub(crate) divergence: &'a [f32],
    pub(crate) ambient: &'a Ambient,
    pub(crate) solids: &'a Solids,
    /// The constant density of the pressure's equation, kg/m^3.
    pub(crate) density: f32,
    pub(crate) seconds: f32,
}

impl Projection {
    pub(crate) fn new(grid: Grid, has_floor: bool) -> Self {
        let solver = PoissonSolver::new(grid, has_floor);
        let whole = solver.slab(0..grid.size[1]);
        Self { grid, has_floor, solver, whole, boundary: None, values: vec![0.0; grid.cells()] }
    }

    /// Makes these the solids in the gas.
    pub(crate) fn set_solids(&mut self, solids: &Solids) {
        self.boundary = if solids.is_empty() { None } else { SolidBoundary::new(&self.solver, self.grid, solids) };
    }

    /// Finds the pressure, which is written to the cells of `pressure` (Pa), and subtracts its gradient from the velocity.
    pub(crate) fn project(&mut self, velocity: &mut Velocity, pressure: &mut [f32], constraint: &Constraint) {
        self.set_source(velocity, constraint);
        match &mut self.boundary {
            None => self.solver.solve(&self.whole, &mut self.values),
            Some(boundary) => boundary.solve(&self.solver, &self.whole, &mut self.values, pressure),
        }
        self.copy_to(pressure);
        self.subtract_gradient(velocity, pressure, constraint);
    }

    /// The right side of the equation: `rho (div u - S) / t`, and what the pressures on the open sides add.
    fn set_source(&mut self, velocity: &Velocity, constraint: &Constraint) {
        let grid = self.grid;
        let plane = grid.size[0] * grid.size[2];
        let scale = constraint.density / constraint.seconds;
        let level = bansho_base::math::simd::level();
        self.values.par_chunks_mut(plane).enumerate().for_each(|(y, values)| {
            dispatch!(level, simd => divergence_layer(simd, &grid, velocity, constraint.divergence, scale, y, values));
        });
        let per_area = (2.0 / (grid.spacing * grid.spacing)) as f32;
        for side in Side::open(self.has_floor) {
            for SideFace { face, position: [x, y, z], .. } in side.faces(&grid) {
                let pressure = pressure_on(side, velocity[side.axis][face], constraint.ambient);
                self.values[y * plane + z * grid.size[0] + x] -= per_area * pressure;
            }
        }
        if !constraint.solids.is_empty() {
            self.values.par_chunks_mut(plane).enumerate().for_each(|(y, values)| {
                for (z, row) in grid.rows(y) {
                    let own = &mut values[z * grid.size[0]..][..grid.size[0]];
                    let cells = own.iter_mut().enumerate();
                    cells.filter(|(x, _)| constraint.solids.contains(row + x)).for_each(|(_, value)| *value = 0.0);
                }
            });
        }
    }

    fn copy_to(&self, pressure: &mut [f32]) {
        let grid = self.grid;
        let [_, plane, _] = grid.strides();
        pressure.par_chunks_mut(plane).enumerate().for_each(|(padded_y, values)| {
            let Some(y) = padded_y.checked_sub(GHOST_LAYERS).filter(|y| *y < grid.size[1]) else { return };
            for (z, row) in grid.rows(y) {
                let from = &self.values[(y * grid.size[2] + z) * grid.size[0]..][..grid.size[0]];
                values[row - padded_y * plane..][..grid.size[0]].copy_from_slice(from);
            }
        });
    }

    fn subtract_gradient(&self, velocity: &mut Velocity, pressure: &[f32], constraint: &Constraint) {
        let grid = self.grid;
        let (strides, level) = (grid.strides(), bansho_base::math::simd::level());
        let scale = constraint.seconds / (constraint.density * grid.spacing as f32);
        // Faces on the sides: the pressure on them is half a cell from that in the cell.
        for side in Side::open(self.has_floor) {
            for SideFace { face, cell, .. } in side.faces(&grid) {
                let speed = &mut velocity[side.axis][face];
                let on_side = pressure_on(side, *speed, constraint.ambient);
                *speed -= 2.0 * scale * side.outward() * (on_side - pressure[cell]);
            }
        }
        for (axis, component) in velocity.iter_mut().enumerate() {
            let open_faces = constraint.solids.open_faces(axis);
            component.par_chunks_mut(strides[1]).enumerate().for_each(|(padded_y, values)| {
                let Some(y) = padded_y.checked_sub(GHOST_LAYERS).filter(|y| *y < grid.size[1]) else { return };
                if axis == 1 && y == 0 {
                    return;
                }
                let gradient = GradientRows { grid: &grid, axis, pressure, open_faces, scale };
                dispatch!(level, simd => gradient.subtract(simd, y, values));
            });
        }
    }
}

fn pressure_on(side: Side, speed: f32, ambient: &Ambient) -> f32 {
    let outward = side.outward();
    side_pressure(speed * outward, ambient.velocity[side.axis] * outward, ambient.density)
}

#[inline(always)]
fn divergence_layer<S: Simd>(
    simd: S,
    grid: &Grid,
    velocity: &Velocity,
    target: &[f32],
    scale: f32,
    y: usize,
    values: &mut [f32],
) {
    let per_spacing = Lanes::splat(simd, (1.0 / grid.spacing) as f32);
    let scale = Lanes::splat(simd, scale);
    for (z, row) in grid.rows(y) {
        for x in (0..grid.size[0]).step_by(LANES) {
            let index = row + x;
            let mut sum = Lanes::splat(simd, 0.0);
            for (axis, stride) in grid.strides().into_iter().enumerate() {
                sum += load(simd, &velocity[axis], index + stride) - load(simd, &velocity[axis], index);
            }
            let source = scale * (sum * per_spacing - load(simd, target, index));
            source.store_slice(&mut values[z * grid.size[0] + x..][..LANES]);
        }
    }
}

/// Subtraction of a component of the gradient from the faces between cells.
struct GradientRows<'a> {
    grid: &'a Grid,
    axis: usize,
    pressure: &'a [f32],
    open_faces: Option<&'a [f32]>,
    scale: f32,
}

impl GradientRows<'_> {
    #[inline(always)]
    fn subtract<S: Simd>(&self, simd: S, y: usize, values: &mut [f32]) {
        let strides = self.grid.strides();
        let stride = strides[self.axis];
        let plane_start = (y + GHOST_LAYERS) * strides[1];
        let scale = Lanes::splat(simd, self.scale);
        for (_, row) in self.grid.rows(y).skip(usize::from(self.axis == 2)) {
            // The first face of a row is on the side.
            let first = if self.axis == 0 { values[row - plane_start] } else { 0.0 };
            for x in (0..self.grid.size[0]).step_by(LANES) {
                let index = row + x;
                let mut step = scale * (load(simd, self.pressure, index) - load(simd, self.pressure, index - stride));
                if let Some(open_faces) = self.open_faces {
                    step *= load(simd, open_faces, index);
                }
                let own = &mut values[index - plane_start..][..LANES];
                (Lanes::from_slice(simd, own) - step).store_slice(own);
            }
            if self.axis == 0 {
                values[row - plane_start] = first;
            }
        }
    }
}
