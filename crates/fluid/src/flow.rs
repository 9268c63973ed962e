//! A time step of the gas.

use bansho_base::{
    host::parallel::prelude::*,
    math::simd::{LANES, Lanes, Real},
    phenomenon::surroundings::Occluder,
    world::gravity::STANDARD_GRAVITY,
};
use fearless_simd::{Simd, dispatch, prelude::*};

use crate::{
    grid::{GHOST_LAYERS, Grid},
    momentum::{MomentumTransport, Velocity, eddy_viscosity, still},
    projection::{Constraint, Projection},
    reconstruction::load,
    sides::{Ambient, advance_side_faces, fill_velocity_ghosts},
    solids::Solids,
    transport::{ActiveRows, Carrier, Contents},
};

/// Largest component of the velocity, m/s.
const FASTEST: f32 = 500.0;

/// What a flow never changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowSettings {
    /// Whether the bottom of the grid is a floor; otherwise it is open.
    pub has_floor: bool,
    /// Coefficient of Smagorinsky's eddy viscosity.
    pub smagorinsky: f32,
    /// Turbulent Schmidt number: viscosity over diffusivity.
    pub schmidt: f32,
    /// The least density that the gas can have, kg/m^3.
    pub least_density: f32,
    /// The air around.
    pub ambient: Ambient,
}

/// Gas of variable density at low Mach number on a grid.
///
/// A step has two halves. [`transport`](Self::transport) moves the gas. Then its owner burns it, and states in [`divergence`](Self::divergence) how fast every
/// cell must expand; [`accelerate`](Self::accelerate) changes the velocity.
pub struct Flow {
    /// The grid.
    pub grid: Grid,
    settings: FlowSettings,
    /// Velocity on faces, m/s.
    pub velocity: Velocity,
    /// Pressure above that of the air at rest, Pa.
    pub pressure: Vec<f32>,
    /// Density and quantities.
    pub contents: Contents,
    /// Divergence that the velocity gets, 1/s.
    pub divergence: Vec<f32>,
    /// The solids in the gas.
    pub solids: Solids,
    ambient: Ambient,
    viscosity: Vec<f32>,
    diffusivity: Vec<f32>,
    stage: Contents,
    carrier: Velocity,
    next: Velocity,
    projection: Projection,
}

impl Flow {
    /// Bytes for each cell of a grid with its ghost cells.
    pub const BYTES_PER_CELL: f64 = 4.0 * 23.0;

    /// Still air.
    #[must_use]
    pub fn new(grid: Grid, settings: FlowSettings) -> Self {
        let field = || vec![0.0; grid.len()];
        let contents = Contents::uniform(&grid, settings.ambient.density);
        let mut velocity = still(&grid);
        for (component, speed) in velocity.iter_mut().zip(settings.ambient.velocity) {
            component.fill(speed);
        }
        let mut flow = Self {
            grid,
            settings,
            pressure: field(),
            divergence: field(),
            solids: Solids::default(),
            ambient: settings.ambient,
            viscosity: field(),
            diffusivity: field(),
            stage: contents.clone(),
            contents,
            carrier: still(&grid),
            next: still(&grid),
            projection: Projection::new(grid, settings.has_floor),
            velocity,
        };
        flow.stop_at_walls();
        flow
    }

    /// The largest sum of the three components of the velocity in a cell, m/s, and so the Courant number times cell over step.
    #[must_use]
    pub fn largest_speed(&self) -> f32 {
        let level = bansho_base::math::simd::level();
        let layers =
            (0..self.grid.size[1]).into_par_iter().map(|y| dispatch!(level, simd => self.layer_speed(simd, y)));
        layers.reduce_with(f32::max).unwrap_or(0.0)
    }

    #[inline(always)]
    fn layer_speed<S: Simd>(&self, simd: S, y: usize) -> f32 {
        let mut largest = Lanes::splat(simd, 0.0);
        for (_, row) in self.grid.rows(y) {
            for x in (0..self.grid.size[0]).step_by(LANES) {
                let mut sum = Lanes::splat(simd, 0.0);
                for (component, stride) in self.velocity.iter().zip(self.grid.strides()) {
                    let low = load(simd, component, row + x).simd_abs();
                    let high = load(simd, component, row + x + stride).simd_abs();
                    sum += low.simd_max(high);
                }
                largest = largest.simd_max(sum);
            }
        }
        let mut lanes = [0.0; LANES];
        largest.store_slice(&mut lanes);
        lanes.into_iter().fold(0.0, f32::max)
    }

    /// Its settings, with the air as it is now.
    #[must_use]
    pub fn settings(&self) -> FlowSettings {
        FlowSettings { ambient: self.ambient, ..self.settings }
    }

    /// The air around.
    #[must_use]
    pub fn ambient(&self) -> Ambient {
        self.ambient
    }

    /// Replaces the settings of a flow whose state is restored.
    pub fn set_settings(&mut self, settings: FlowSettings) {
        (self.settings, self.ambient) = (settings, settings.ambient);
    }

    /// The fields that are its state: velocity, pressure, density, quantities.
    pub fn state(&self) -> impl Iterator<Item = &Vec<f32>> {
        let contents = std::iter::once(&self.contents.density).chain(&self.contents.quantities);
        self.velocity.iter().chain(std::iter::once(&self.pressure)).chain(contents)
    }

    /// The same, to be restored.
    pub fn state_mut(&mut self) -> impl Iterator<Item = &mut Vec<f32>> {
        let contents = std::iter::once(&mut self.contents.density).chain(&mut self.contents.quantities);
        self.velocity.iter_mut().chain(std::iter::once(&mut self.pressure)).chain(contents)
    }

    /// Makes scratch memory agree with a restored state.
    pub fn restore_stage(&mut self) {
        self.stage = self.contents.clone();
    }

    /// Makes these the solids in the gas. Returns whether they are others than before.
    pub fn set_solids(&mut self, occluders: &[Occluder]) -> bool {
        let are_new = self.solids.set(&self.grid, self.settings.has_floor, occluders);
        if are_new {
            self.projection.set_solids(&self.solids);
            self.stop_at_walls();
        }
        are_new
    }

    /// Carries density and quantities of the `active` cells for `seconds`.
    pub fn transport(&mut self, active: &ActiveRows, seconds: f32) {
        fill_velocity_ghosts(&self.grid, self.settings.has_floor, &self.ambient, &mut self.velocity);
        // A third of what would make explicit diffusion unstable.
        let limit = (self.grid.spacing * self.grid.spacing) as f32 / (18.0 * seconds);
        eddy_viscosity(&self.grid, &self.velocity, self.settings.smagorinsky, limit, &mut self.viscosity);
        let per_schmidt = 1.0 / self.settings.schmidt;
        let solids = &self.solids;
        let [_, plane, _] = self.grid.strides();
        self.diffusivity.par_chunks_mut(plane).zip(self.viscosity.par_chunks(plane)).enumerate().for_each(
            |(y, (diffusivity, viscosity))| {
                for (place, (diffusivity, viscosity)) in diffusivity.iter_mut().zip(viscosity).enumerate() {
                    *diffusivity = if solids.contains(y * plane + place) { 0.0 } else { per_schmidt * viscosity };
                }
            },
        );
        let carrier = Carrier {
            grid: &self.grid,
            velocity: self.velocity.each_ref().map(Vec::as_slice),
            diffusivity: &self.diffusivity,
            has_floor: self.settings.has_floor,
            active,
        };
        carrier.advance(&mut self.contents, &mut self.stage, seconds);
    }

    /// Replaces what is in cells that are not active any more by air.
    pub fn empty(&mut self, before: &ActiveRows, now: &ActiveRows) {
        let (grid, air) = (self.grid, self.settings.ambient.density);
        let [_, plane, _] = grid.strides();
        for contents in [&mut self.contents, &mut self.stage] {
            let [first, second] = &mut contents.quantities;
            let layers = contents
                .density
                .par_chunks_mut(plane)
                .zip(first.par_chunks_mut(plane))
                .zip(second.par_chunks_mut(plane));
            layers.enumerate().for_each(|(padded_y, ((density, first), second))| {
                let Some(y) = padded_y.checked_sub(GHOST_LAYERS).filter(|y| *y < grid.size[1]) else { return };
                for (z, row) in grid.rows(y) {
                    let (old, new) = (before.row(y, z), now.row(y, z));
                    if new.start <= old.start && old.end <= new.end {
                        continue;
                    }
                    for x in old.filter(|x| !new.contains(x)) {
                        let at = row + x - padded_y * plane;
                        (density[at], first[at], second[at]) = (air, 0.0, 0.0);
                    }
                }
            });
        }
    }

    /// Changes the velocity for `seconds`: transport of momentum, viscosity, buoyancy, pressure. `wind` is the wind at the end of the step, m/s; the air
    /// everywhere takes part in its changes.
    pub fn accelerate(&mut self, wind: [f32; 3], seconds: f32) {
        for axis in 0..3 {
            self.carrier[axis].copy_from_slice(&self.velocity[axis]);
        }
        advance_side_faces(&self.grid, self.settings.has_floor, &mut self.velocity, seconds);
        let transport = MomentumTransport { grid: &self.grid, carrier: &self.carrier, viscosity: &self.viscosity };
        transport.advance(&mut self.velocity, &mut self.next, seconds);
        self.add_forces(wind, seconds);
        self.ambient.velocity = wind;
        self.stop_at_walls();
        let constraint = Constraint {
            divergence: &self.divergence,
            ambient: &self.ambient,
            solids: &self.solids,
            density: self.settings.least_density,
            seconds,
        };
        self.projection.project(&mut self.velocity, &mut self.pressure, &constraint);
    }

    /// Buoyancy, the change of the wind, and the part of the pressure's acceleration that the projection, which knows one density only, leaves out: that of the
    /// last step's pressure (Dodd and Ferrante 2014).
    fn add_forces(&mut self, wind: [f32; 3], seconds: f32) {
        let (grid, level) = (self.grid, bansho_base::math::simd::level());
        let change: [f32; 3] = std::array::from_fn(|axis| wind[axis] - self.ambient.velocity[axis]);
        for (axis, component) in self.velocity.iter_mut().enumerate() {
            let forces = Forces {
                grid: &grid,
                axis,
                density: &self.contents.density,
                pressure: &self.pressure,
                ambient_density: self.ambient.density,
                least_density: self.settings.least_density,
                change: change[axis],
                seconds,
            };
            component.par_chunks_mut(grid.strides()[1]).enumerate().for_each(|(padded_y, values)| {
                let last = GHOST_LAYERS + grid.size[1] + usize::from(axis == 1);
                if (GHOST_LAYERS..last).contains(&padded_y) {
                    dispatch!(level, simd => forces.layer(simd, padded_y, values));
                }
            });
        }
    }

    /// No gas flows through a floor and into solids.
    fn stop_at_walls(&mut self) {
        if self.settings.has_floor {
            let [_, plane, _] = self.grid.strides();
            self.velocity[1][GHOST_LAYERS * plane..(GHOST_LAYERS + 1) * plane].fill(0.0);
        }
        for (axis, component) in self.velocity.iter_mut().enumerate() {
            if let Some(open_faces) = self.solids.open_faces(axis) {
                component.par_iter_mut().zip(open_faces.par_iter()).for_each(|(speed, open)| *speed *= open);
            }
        }
    }
}

/// Forces on a component of the velocity.
struct Forces<'a> {
    grid: &'a Grid,
    axis: usize,
    density: &'a [f32],
    pressure: &'a [f32],
    ambient_density: f32,
    least_density: f32,
    change: f32,
    seconds: f32,
}

impl Forces<'_> {
    /// The faces of a layer, with those on the sides: there the gas beyond the side is that inside, and the pressure falls to 0 half a cell away, which is
    /// left to the projection.
    #[inline(always)]
    fn layer<S: Simd>(&self, simd: S, padded_y: usize, values: &mut [f32]) {
        let splat = |value: f32| Lanes::splat(simd, value);
        let [width, height, depth] = self.grid.size;
        let strides = self.grid.strides();
        let stride = strides[self.axis];
        let plane_start = padded_y * strides[1];
        let gravity = if self.axis == 1 { self.seconds * STANDARD_GRAVITY as f32 } else { 0.0 };
        let (gravity, ambient, change) = (splat(gravity), splat(self.ambient_density), splat(self.change));
        let gradient_scale = splat(self.seconds / self.grid.spacing as f32);
        let per_least = splat(1.0 / self.least_density);
        let y = padded_y - GHOST_LAYERS;
        let rows = depth + usize::from(self.axis == 2);
        for z in 0..rows {
            let row = plane_start + (z + GHOST_LAYERS) * strides[2] + GHOST_LAYERS;
            // Faces on a side take the density of the cell inside.
            let (is_low, is_high) = match self.axis {
                1 => (y == 0, y == height),
                2 => (z == 0, z == depth),
                _ => (false, false),
            };
            for x in (0..width).step_by(LANES) {
                let index = row + x;
                let above = if is_high { index - stride } else { index };
                let below = if is_low { index } else { index - stride };
                let density = (load(simd, self.density, above) + load(simd, self.density, below)) * splat(0.5);
                let volume = splat(1.0) / density;
                let mut acceleration = gravity * (ambient - density) * volume + change;
                if !is_low && !is_high {
                    let rise = load(simd, self.pressure, index) - load(simd, self.pressure, index - stride);
                    let extra = gradient_scale * rise * (per_least - volume);
                    acceleration += extra;
                }
                let own = &mut values[index - plane_start..][..LANES];
                let first = own[0];
                let speed = Lanes::from_slice(simd, own) + acceleration;
                // Whatever the wind: a value that is no number becomes one.
                speed.simd_min(splat(FASTEST)).simd_max(splat(-FASTEST)).store_slice(own);
                if self.axis == 0 && x == 0 {
                    own[0] = first + self.change;
                }
            }
            if self.axis == 0 {
                values[row + width - plane_start] += self.change;
            }
        }
    }
}
