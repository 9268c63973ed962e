//! Forces and time integration (thesis, 2.3.1 to 2.3.3).

use bansho_base::{
    host::parallel::prelude::*,
    math::{self, MulAdd},
    parameters::Auto,
};
use bansho_sph::{Cells, KernelShape, PressureForce, StateEquation, compute_densities};
use fearless_simd::dispatch;

use super::{AuroraParticles, neighbor_cells::NeighborCells};
use crate::{
    AuroraParameters, NeighborSearch, RepulsionForce, RepulsionKernel,
    shapes::{FRAME_S, ShapeError, ShapeErrorKind},
    simulate::field::sheet_field::ElectricField,
};

/// Gas constant k at a repulsion of 1, cells^2 per frame^2.
const STIFFNESS: f64 = 0.1;
/// Particles per task.
const TASK: usize = 4096;
/// Relaxation factor per step of the support radius.
const SUPPORT_RELAXATION: f64 = 0.1;
/// Minimum and maximum support radius, cells.
const SUPPORT_CELLS: [f64; 2] = [0.02, 2.0];
/// Number of neighbors up to which that maximum holds; it grows with more.
const USUAL_NEIGHBORS: f64 = 200.0;
/// Minimum mass of a particle that is fading in.
const MIN_MASS: f32 = 0.05;

/// How the support radius of the kernels is found.
#[derive(Clone, Copy, Debug)]
enum Support {
    /// That with a number of neighbors, within bounds in km.
    Neighbors { count: f64, bounds_km: [f64; 2] },
    /// Fixed, km.
    Fixed(f64),
}

impl Support {
    fn new(parameters: &AuroraParameters) -> Self {
        let (particles, cell) = (&parameters.particles, parameters.cell_km());
        match particles.smoothing_length_cells {
            Auto::Set(cells) => Self::Fixed(kernel_reach(particles.kernel) * cells * cell),
            Auto::Auto => {
                let count = particles.neighbor_count;
                let more = (count / USUAL_NEIGHBORS).sqrt().max(1.0);
                let [min, max] = SUPPORT_CELLS.map(|cells| cells * cell);
                Self::Neighbors { count, bounds_km: [min, max * more] }
            }
        }
    }
}

/// Maximum number of pairs of neighbors.
const MAX_PAIRS: f64 = 1.5e9;
/// Memory of the lists of candidates for each pair of neighbors, bytes: eight particles share a list.
const PAIR_BYTES: f64 = 0.6;

/// Checks the number of neighbors of the particles of a sheet of that length in km, the shortest of a sequence, and returns the memory of the lists of
/// candidates, bytes.
///
/// # Errors
///
/// More pairs than [`MAX_PAIRS`].
pub(crate) fn check_neighbors(parameters: &AuroraParameters, length_km: f64) -> Result<f64, ShapeError> {
    let count = parameters.particles.count;
    let (key, neighbors) = match Support::new(parameters) {
        Support::Neighbors { count, .. } => ("neighbor_count", count),
        Support::Fixed(support_km) => {
            let width = 2.0 * parameters.half_thickness_km();
            let density = count as f64 / (length_km.max(width) * width);
            let area = (std::f64::consts::PI * support_km * support_km).min(2.0 * support_km * width);
            ("smoothing_length_cells", (density * area).min(count as f64))
        }
    };
    let max = MAX_PAIRS / count as f64;
    if neighbors <= max {
        let has_lists = parameters.particles.neighbor_search == NeighborSearch::SupportRadius;
        return Ok(if has_lists { PAIR_BYTES * count as f64 * neighbors } else { 0.0 });
    }
    let kind = ShapeErrorKind::TooManyNeighbors { count, neighbors, max };
    Err(ShapeError { key: format!("particles.{key}"), kind })
}

/// Support radius of a kernel in smoothing lengths h, eqs. (2.12) to (2.18).
fn kernel_reach(kernel: RepulsionKernel) -> f64 {
    match kernel {
        RepulsionKernel::CubicSpline => 2.0,
        RepulsionKernel::Poly6Spiky => 1.0,
    }
}

/// SPH repulsion with reusable buffers.
#[derive(Clone, Debug)]
pub(super) struct Repulsion {
    cells: Cells<2>,
    /// 3 x 3 cells of the thesis, if the scene selects them.
    neighbor_cells: Option<NeighborCells>,
    force: PressureForce,
    density_kernel: KernelShape,
    stiffness: f32,
    /// Whether the force is divided as (2.14) is printed.
    as_printed: bool,
    support: Support,
    masses: Vec<f32>,
    densities: Vec<f32>,
    pressures: Vec<f32>,
    /// Accelerations, km/s^2, x and z, in the particles' order.
    pub(super) accelerations: [Vec<f32>; 2],
}

impl Repulsion {
    pub(super) fn new(parameters: &AuroraParameters) -> Self {
        let particles = &parameters.particles;
        let [density_kernel, force_kernel] = match particles.kernel {
            RepulsionKernel::CubicSpline => [KernelShape::CubicSpline; 2],
            RepulsionKernel::Poly6Spiky => [KernelShape::Poly6, KernelShape::Spiky],
        };
        let cell = parameters.cell_km();
        Self {
            cells: Cells::new(cell as f32),
            neighbor_cells: (particles.neighbor_search == NeighborSearch::ThreeByThreeCells)
                .then(|| NeighborCells::new(kernel_reach(particles.kernel))),
            force: PressureForce::new(force_kernel),
            density_kernel,
            stiffness: (particles.repulsion * STIFFNESS * cell * cell / (FRAME_S * FRAME_S)) as f32,
            as_printed: particles.repulsion_force == RepulsionForce::AsPrinted,
            support: Support::new(parameters),
            masses: Vec::new(),
            densities: Vec::new(),
            pressures: Vec::new(),
            accelerations: Default::default(),
        }
    }

    /// Support radius at a density, km.
    pub(super) fn support_km(&self, density_per_km2: f64) -> f64 {
        match self.support {
            Support::Fixed(support_km) => support_km,
            Support::Neighbors { count, bounds_km: [min, max] } => {
                (count / (std::f64::consts::PI * density_per_km2.max(f64::MIN_POSITIVE))).sqrt().clamp(min, max)
            }
        }
    }

    /// Mean distance between neighboring particles, km, the side of a square with one particle, by the support radius or by the rest density per km^2.
    pub(super) fn spacing_km(&self, support_km: f64, rest_density: f64) -> f64 {
        match self.support {
            Support::Fixed(_) => 1.0 / rest_density.max(f64::MIN_POSITIVE).sqrt(),
            Support::Neighbors { count, .. } => (std::f64::consts::PI / count).sqrt() * support_km,
        }
    }

    /// Sorts the particles and computes the repulsion, eqs. (2.11) to (2.18); `rest_density` per km^2 is delta_0.
    /// Returns the support radius for the next step, km.
    pub(super) fn compute_accelerations(
        &mut self,
        particles: &mut AuroraParticles,
        support_km: f64,
        rest_density: f64,
    ) -> f64 {
        self.cells.set_support_radius(support_km as f32);
        let positions = particles.positions.each_ref().map(Vec::as_slice);
        if self.neighbor_cells.is_some() {
            self.cells.sort(positions, &particles.ids);
        } else {
            self.cells.assign(positions, &particles.ids);
        }
        particles.reorder(&mut self.cells);
        let level = bansho_base::math::simd::level();
        dispatch!(level, _simd => particle_masses(&particles.fades, &mut self.masses));
        if let Some(cells) = &mut self.neighbor_cells {
            cells.assign(&particles.positions, &self.masses, support_km as f32);
            cells.compute_densities(self.density_kernel, &mut self.densities);
        } else {
            compute_densities(&self.cells, self.density_kernel, &self.masses, &mut self.densities);
        }
        // A particle has its full mass in its own density: one that is fading in would otherwise have nearly no density
        // and be accelerated too much.
        let self_density = self.density_kernel.at_center::<2>(support_km as f32);
        let state = StateEquation { rest_density: rest_density as f32, negative_pressure: true };
        let Self { masses, densities, pressures, stiffness, .. } = self;
        dispatch!(level, _simd => add_missing_self_density(densities, masses, self_density));
        pressures.clear();
        pressures.extend(densities.iter().map(|density| state.pressure(*stiffness, *density)));
        if let Some(cells) = &mut self.neighbor_cells {
            cells.compute_accelerations(self.force.kernel, &self.densities, &self.pressures, &mut self.accelerations);
        } else {
            let (cells, masses) = (&self.cells, &self.masses);
            self.force.compute_accelerations(cells, masses, &self.densities, &self.pressures, &mut self.accelerations);
        }
        if self.as_printed {
            // The accelerations are divided by the particle's own density.
            for values in &mut self.accelerations {
                values.iter_mut().zip(&self.densities).for_each(|(value, own)| *value *= own / rest_density as f32);
            }
        }
        let count = self.densities.len().max(1) as f64;
        let mean = self.densities.iter().map(|density| f64::from(*density)).sum::<f64>() / count;
        support_km + SUPPORT_RELAXATION * (self.support_km(mean) - support_km)
    }
}

/// Masses of particles that fade in or out.
#[inline(always)]
fn particle_masses(fades: &[f32], masses: &mut Vec<f32>) {
    masses.resize(fades.len(), 0.0);
    for (mass, fade) in masses.iter_mut().zip(fades) {
        *mass = fade.fma(1.0 - MIN_MASS, MIN_MASS);
    }
}

/// Completes densities to the full mass of the particle itself; `self_density` is that of a particle of full mass.
#[inline(always)]
fn add_missing_self_density(densities: &mut [f32], masses: &[f32], self_density: f32) {
    for (density, mass) in densities.iter_mut().zip(masses) {
        *density += (1.0 - mass) * self_density;
    }
}

/// Integration constants that all particles share.
#[derive(Clone, Copy, Debug)]
pub(super) struct Integrator {
    lorentz_weight: f32,
    repulsion_weight: f32,
    /// Cosine and sine of the rotation of the velocity by the magnetic field per step.
    rotation: [f32; 2],
    friction_factor: f32,
    limit_energy: bool,
    half_km: f32,
}

impl Integrator {
    pub(super) fn new(parameters: &AuroraParameters) -> Self {
        let particles = &parameters.particles;
        let angle = particles.lorentz_weight * parameters.field.gyration_deg_per_frame.to_radians();
        Self {
            lorentz_weight: particles.lorentz_weight as f32,
            repulsion_weight: particles.repulsion_weight as f32,
            rotation: [math::cos(angle) as f32, math::sin(angle) as f32],
            friction_factor: math::exp(-particles.friction_per_s * FRAME_S) as f32,
            limit_energy: particles.limit_energy,
            half_km: (parameters.extent_km / 2.0) as f32,
        }
    }

    /// Advances all particles by a step.
    pub(super) fn advance(&self, particles: &mut AuroraParticles, field: &ElectricField, repulsion: &[Vec<f32>; 2]) {
        let [xs, zs] = &mut particles.positions;
        let [us, ws] = &mut particles.velocities;
        let positions = xs.par_chunks_mut(TASK).zip(zs.par_chunks_mut(TASK));
        let speeds = us.par_chunks_mut(TASK).zip(ws.par_chunks_mut(TASK));
        let repulsion = repulsion[0].par_chunks(TASK).zip(repulsion[1].par_chunks(TASK));
        let level = bansho_base::math::simd::level();
        positions.zip(speeds).zip(repulsion).with_max_len(1).for_each(|((positions, speeds), repulsion)| {
            dispatch!(level, _simd => self.advance_chunk(positions, speeds, repulsion, field));
        });
    }

    #[inline(always)]
    fn advance_chunk(
        &self,
        (xs, zs): (&mut [f32], &mut [f32]),
        (us, ws): (&mut [f32], &mut [f32]),
        (east, south): (&[f32], &[f32]),
        field: &ElectricField,
    ) {
        for i in 0..xs.len() {
            let moved = self.integrate([xs[i], zs[i]], [us[i], ws[i]], [east[i], south[i]], field);
            ([xs[i], zs[i]], [us[i], ws[i]]) = moved;
        }
    }

    /// Eqs. (2.10), (2.19) and (2.20), friction, and the energy limit. The magnetic part of (2.10) is an exact
    /// rotation, so it does not change the energy.
    #[inline(always)]
    fn integrate(
        &self,
        position: [f32; 2],
        speed: [f32; 2],
        repulsion: [f32; 2],
        field: &ElectricField,
    ) -> ([f32; 2], [f32; 2]) {
        const STEP: f32 = FRAME_S as f32;
        let sample = field.sample(position[0], position[1]);
        let [cosine, sine] = self.rotation;
        // First the rotation, so that position (2.19) and velocity (2.20) start from the same velocity.
        let speed = [cosine.fma(speed[0], sine * speed[1]), cosine.fma(speed[1], -sine * speed[0])];
        let (mut to, mut new) = ([0.0; 2], [0.0; 2]);
        for c in 0..2 {
            let force = self.lorentz_weight.fma(sample.field[c], self.repulsion_weight * repulsion[c]);
            let moved = (0.5 * STEP * STEP).fma(force, STEP.fma(speed[c], position[c]));
            // `clamp` would check its bounds for every particle.
            let clamped = if moved > -self.half_km { moved } else { -self.half_km };
            let clamped = if clamped < self.half_km { clamped } else { self.half_km };
            to[c] = if moved.is_finite() { clamped } else { position[c] };
            new[c] = self.friction_factor * STEP.fma(force, speed[c]);
        }
        // At the position after clamping: a particle at the edge of the square gains no energy from where it would have been.
        let potential_drop = sample.potential - field.sample(to[0], to[1]).potential;
        let factor = self.energy_limit_factor(speed, new, potential_drop);
        (to, if factor > 0.0 { [new[0] * factor, new[1] * factor] } else { [0.0; 2] })
    }

    /// Velocity factor that limits kinetic plus potential energy; `potential_drop` is the decrease of the potential.
    #[inline(always)]
    fn energy_limit_factor(&self, before: [f32; 2], after: [f32; 2], potential_drop: f32) -> f32 {
        let energy = (2.0 * self.lorentz_weight).fma(potential_drop, before[0].fma(before[0], before[1] * before[1]));
        // A particle that climbs higher than its kinetic energy allows comes to rest.
        let energy = if energy > 0.0 { energy } else { 0.0 };
        let speed_squared = after[0].fma(after[0], after[1] * after[1]);
        if !speed_squared.is_finite() {
            0.0
        } else if self.limit_energy && speed_squared > energy {
            (energy / speed_squared).sqrt()
        } else {
            1.0
        }
    }
}
