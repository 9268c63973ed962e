//! Forces and the step (thesis, 2.3.1 to 2.3.3).

use bansho_base::math::{self, MulAdd};

use super::AuroraParticles;
use crate::{AuroraParameters, RepulsionKernel, shapes::FRAME_S, simulate::field::sheet_field::Field};
use bansho_sph::{Cells, KernelShape, PressureForce, StateEquation, compute_densities};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

/// Gas constant k at a repulsion of 1, cells^2 per frame^2.
const STIFFNESS: f64 = 0.1;
/// Particles that a task of the thread pool moves.
const TASK: usize = 4096;
/// The support radius follows the density by this share each step.
const FOLLOWING: f64 = 0.1;
/// The support radius is at least this share of a cell and at most so many cells.
const SUPPORT_CELLS: [f64; 2] = [0.02, 2.0];
/// Mass of a particle that is just appearing, beside 1 of one that is there: none is lighter.
const LEAST_MASS: f32 = 0.05;

/// What the particles do to each other; buffers are kept from step to step.
#[derive(Clone, Debug)]
pub(super) struct Repulsion {
    cells: Cells<2>,
    force: PressureForce,
    density_kernel: KernelShape,
    stiffness: f32,
    neighbours: f64,
    bounds_km: [f64; 2],
    masses: Vec<f32>,
    densities: Vec<f32>,
    pressures: Vec<f32>,
    /// km/s^2, x and z, in the particles' order.
    pub(super) accelerations: [Vec<f32>; 2],
}

impl Repulsion {
    pub(super) fn new(parameters: &AuroraParameters) -> Self {
        let particles = &parameters.particles;
        let [density_kernel, force_kernel] = match particles.kernel {
            RepulsionKernel::Spline => [KernelShape::CubicSpline; 2],
            RepulsionKernel::Poly6Spiky => [KernelShape::Poly6, KernelShape::Spiky],
        };
        let cell = parameters.cell_km();
        Self {
            cells: Cells::new(cell as f32),
            force: PressureForce::new(force_kernel),
            density_kernel,
            stiffness: (particles.repulsion * STIFFNESS * cell * cell / (FRAME_S * FRAME_S)) as f32,
            neighbours: particles.neighbours,
            bounds_km: SUPPORT_CELLS.map(|cells| cells * cell),
            masses: Vec::new(),
            densities: Vec::new(),
            pressures: Vec::new(),
            accelerations: Default::default(),
        }
    }

    /// The support radius h about which particles of that density have as many neighbours as is asked for, km.
    pub(super) fn support_km(&self, density_per_km2: f64) -> f64 {
        let [least, most] = self.bounds_km;
        (self.neighbours / (std::f64::consts::PI * density_per_km2.max(f64::MIN_POSITIVE))).sqrt().clamp(least, most)
    }

    /// Sorts the particles and finds how they push each other, eqs. (2.11) to (2.18); `rest_density` per km^2 is delta_0. Gives the
    /// support radius for the next step, km.
    pub(super) fn find(&mut self, particles: &mut AuroraParticles, support_km: f64, rest_density: f64) -> f64 {
        self.cells.set_support_radius(support_km as f32);
        particles.sort(&mut self.cells);
        let level = Level::new();
        dispatch!(level, _simd => masses_of(&particles.fades, &mut self.masses));
        compute_densities(&self.cells, self.density_kernel, &self.masses, &mut self.densities);
        // To itself a particle is all there: one that is just appearing would be next to weightless, and be flung away.
        let whole = self.density_kernel.at_center::<2>(self.cells.support_radius());
        let state = StateEquation { rest_density: rest_density as f32, negative_pressure: true };
        let Self { masses, densities, pressures, stiffness, .. } = self;
        dispatch!(level, _simd => complete(densities, masses, whole));
        pressures.clear();
        pressures.extend(densities.iter().map(|density| state.pressure(*stiffness, *density)));
        let (cells, masses) = (&self.cells, &self.masses);
        self.force.compute_accelerations(cells, masses, &self.densities, &self.pressures, &mut self.accelerations);
        let count = self.densities.len().max(1) as f64;
        let mean = self.densities.iter().map(|density| f64::from(*density)).sum::<f64>() / count;
        support_km + FOLLOWING * (self.support_km(mean) - support_km)
    }
}

/// Masses of particles that are there so far.
#[inline(always)]
fn masses_of(fades: &[f32], masses: &mut Vec<f32>) {
    masses.resize(fades.len(), 0.0);
    for (mass, fade) in masses.iter_mut().zip(fades) {
        *mass = fade.fma(1.0 - LEAST_MASS, LEAST_MASS);
    }
}

/// Adds to densities what particles lack themselves; `whole` is what one that is all there has.
#[inline(always)]
fn complete(densities: &mut [f32], masses: &[f32], whole: f32) {
    for (density, mass) in densities.iter_mut().zip(masses) {
        *density += (1.0 - mass) * whole;
    }
}

/// Numbers of a step that all particles share.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mover {
    pull_weight: f32,
    repulsion_weight: f32,
    /// Cosine and sine of the angle by which the magnetic field turns a velocity in a step.
    turn: [f32; 2],
    kept_speed: f32,
    limit_energy: bool,
    half_km: f32,
}

impl Mover {
    pub(super) fn new(parameters: &AuroraParameters) -> Self {
        let particles = &parameters.particles;
        let angle = particles.pull_weight * parameters.field.turn_deg_per_frame.to_radians();
        Self {
            pull_weight: particles.pull_weight as f32,
            repulsion_weight: particles.repulsion_weight as f32,
            turn: [math::cos(angle) as f32, math::sin(angle) as f32],
            kept_speed: math::exp(-particles.friction_per_s * FRAME_S) as f32,
            limit_energy: particles.limit_energy,
            half_km: (parameters.extent_km / 2.0) as f32,
        }
    }

    /// Moves all particles by a step.
    pub(super) fn advance(&self, particles: &mut AuroraParticles, field: &Field, pushes: &[Vec<f32>; 2]) {
        let [xs, zs] = &mut particles.positions;
        let [us, ws] = &mut particles.velocities;
        let places = xs.par_chunks_mut(TASK).zip(zs.par_chunks_mut(TASK));
        let speeds = us.par_chunks_mut(TASK).zip(ws.par_chunks_mut(TASK));
        let pushes = pushes[0].par_chunks(TASK).zip(pushes[1].par_chunks(TASK));
        let level = Level::new();
        places.zip(speeds).zip(pushes).with_max_len(1).for_each(|((places, speeds), pushes)| {
            dispatch!(level, _simd => self.advance_part(places, speeds, pushes, field));
        });
    }

    #[inline(always)]
    fn advance_part(
        &self,
        (xs, zs): (&mut [f32], &mut [f32]),
        (us, ws): (&mut [f32], &mut [f32]),
        (east, south): (&[f32], &[f32]),
        field: &Field,
    ) {
        for i in 0..xs.len() {
            let moved = self.moved([xs[i], zs[i]], [us[i], ws[i]], [east[i], south[i]], field);
            ([xs[i], zs[i]], [us[i], ws[i]]) = moved;
        }
    }

    /// Eqs. (2.10), (2.19) and (2.20), friction, and the bound on energy. The magnetic part of (2.10) only turns the velocity,
    /// and is done as a turn: it can then not feed energy in.
    #[inline(always)]
    fn moved(&self, place: [f32; 2], speed: [f32; 2], push: [f32; 2], field: &Field) -> ([f32; 2], [f32; 2]) {
        const STEP: f32 = FRAME_S as f32;
        let here = field.sample(place[0], place[1]);
        let [cosine, sine] = self.turn;
        let speed = [cosine.fma(speed[0], sine * speed[1]), cosine.fma(speed[1], -sine * speed[0])];
        let (mut to, mut new) = ([0.0; 2], [0.0; 2]);
        for c in 0..2 {
            let force = self.pull_weight.fma(here.field[c], self.repulsion_weight * push[c]);
            let moved = (0.5 * STEP * STEP).fma(force, STEP.fma(speed[c], place[c]));
            let held = if moved > -self.half_km { moved } else { -self.half_km };
            let held = if held < self.half_km { held } else { self.half_km };
            to[c] = if moved.is_finite() { held } else { place[c] };
            new[c] = self.kept_speed * STEP.fma(force, speed[c]);
        }
        let fall = here.potential - field.sample(to[0], to[1]).potential;
        let factor = self.allowed(speed, new, fall);
        (to, if factor > 0.0 { [new[0] * factor, new[1] * factor] } else { [0.0; 2] })
    }

    /// The factor that holds kinetic plus potential energy; `fall` is by how much the potential has fallen.
    #[inline(always)]
    fn allowed(&self, before: [f32; 2], after: [f32; 2], fall: f32) -> f32 {
        let energy = (2.0 * self.pull_weight).fma(fall, before[0].fma(before[0], before[1] * before[1]));
        let energy = if energy > 0.0 { energy } else { 0.0 };
        let found = after[0].fma(after[0], after[1] * after[1]);
        if !found.is_finite() {
            0.0
        } else if self.limit_energy && found > energy {
            (energy / found).sqrt()
        } else {
            1.0
        }
    }
}
