//! A step of the simulation, section 4.3, and what Bansho adds to it.

use bansho_base::{math::Vec3, random::Key, surroundings::Surroundings};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::{
    beside::Beside,
    births::Births,
    collision::Solids,
    design::Design,
    draught::{Flow, flows},
    life::{Being, Exposure, Laws},
    parameters::{FlameParticlesParameters, Tension, WindForce},
    particles::Particles,
    turbulence::Turbulence,
    weather::Weather,
};
use crate::sph::{Cells, KernelShape, PressureForce, StateEquation, densities, longest_step, sub_steps};

/// Most sub-steps of a step. Gas that would need more keeps its time and loses stiffness: `press` holds k where sound goes no further
/// than a fifth of d in a sub-step, and `pushed` holds every force there.
const MOST_SUB_STEPS: u32 = 3;
/// Gas is never faster, m/s.
pub(crate) const GREATEST_SPEED: f32 = 150.0;
/// Speed of gas against the gas beside it, as a share of its speed.
const RELATIVE_SPEED: f32 = 0.15;
/// Time in which `viscosity` and `conduction` say how far neighbours even out, s.
const EVENING_TIME: f32 = 0.01;
/// Distance from a solid, in support radii, at which gas stays.
const CLEARANCE: f32 = 0.2;
/// Mean distance of the neighbours from a particle on a flat surface of the gas, in support radii.
const SURFACE_OFFSET: f32 = 0.2;
/// Share of its own in a particle's density: from there on it counts as alone, fully after as much more.
const ALONE_SHARE: [f32; 2] = [0.2, 0.5];
/// Particles of a task.
const PARTICLES_OF_TASK: usize = 512;

/// The gas and what it needs to move.
#[derive(Clone, Debug)]
pub(crate) struct Simulation {
    pub(crate) design: Design,
    laws: Laws,
    pub(crate) parameters: FlameParticlesParameters,
    pub(crate) turbulence: Turbulence,
    pub(crate) key: Key,
    pub(crate) particles: Particles,
    cells: Cells<3>,
    force: PressureForce,
    acceleration: [Vec<f32>; 3],
    pressure: Vec<f32>,
    beside: Beside,
    flows: Vec<Flow>,
    moved: Vec<Moved>,
}

/// A particle after a sub-step.
#[derive(Clone, Copy, Debug, Default)]
struct Moved {
    place: Vec3,
    velocity: Vec3,
    drift: Vec3,
    being: Being,
    life: f32,
}

impl Simulation {
    pub(crate) fn new(parameters: &FlameParticlesParameters, design: Design, key: Key) -> Self {
        Self {
            laws: Laws::from(&parameters.life),
            turbulence: Turbulence::new(key),
            particles: Particles::new(parameters.position.into()),
            cells: Cells::new(design.support_radius),
            force: PressureForce::new(parameters.fluid.force_kernel),
            acceleration: Default::default(),
            pressure: Vec::new(),
            beside: Beside::default(),
            flows: Vec::new(),
            moved: Vec::new(),
            parameters: parameters.clone(),
            design,
            key,
        }
    }

    /// Length of a step, s.
    pub(crate) fn step_s(&self) -> f64 {
        self.parameters.step_s
    }

    /// Steps from `time` to one step later.
    pub(crate) fn step(&mut self, time: f64, around: &Surroundings) {
        let seconds = self.step_s();
        let Self { design, turbulence, key, parameters, particles, .. } = self;
        let afterlife_s = parameters.life.afterlife_s;
        Births { design, turbulence, key: *key, afterlife_s }.add(particles, time, seconds);
        let parts = self.sub_steps(seconds as f32);
        for part in 0..parts {
            let share = seconds / f64::from(parts);
            self.sub_step(time + share * f64::from(part), share as f32, around);
        }
        self.bury();
    }

    /// Sub-steps by the condition of Courant, Friedrichs and Lewy, for gas that moves with the gas beside it.
    ///
    /// No acceleration shortens them: buoyancy and wind move neighbours alike, pressure's is bounded by the sound that counts here, and
    /// `pushed` holds what is left. The forces of the last step would also have to be part of every snapshot.
    fn sub_steps(&self, seconds: f32) -> u32 {
        let [u, v, w] = &self.particles.velocity;
        let square = |index: usize| u[index] * u[index] + v[index] * v[index] + w[index] * w[index];
        let greatest = |values: &(dyn Fn(usize) -> f32 + Sync)| {
            let parts = (0..u.len()).into_par_iter().step_by(PARTICLES_OF_TASK);
            let of_part =
                |first: usize| (first..(first + PARTICLES_OF_TASK).min(u.len())).map(values).fold(0.0, f32::max);
            parts.map(of_part).reduce(|| 0.0, f32::max)
        };
        let speed = greatest(&square).sqrt();
        let hottest = greatest(&|index| self.particles.temperature[index]);
        let stiffness = self.design.stiffness_per_kelvin * hottest;
        let longest = longest_step(self.design.support_radius, stiffness, RELATIVE_SPEED * speed);
        sub_steps(seconds, longest, MOST_SUB_STEPS)
    }

    fn sub_step(&mut self, time: f64, seconds: f32, around: &Surroundings) {
        if self.particles.is_empty() {
            return;
        }
        self.particles.sort(&mut self.cells);
        densities(&self.cells, KernelShape::Poly6, &self.particles.mass, &mut self.particles.density);
        self.press(seconds);
        self.beside.look(&self.cells, &self.particles);
        let (mut carried, mut moved) = (std::mem::take(&mut self.flows), std::mem::take(&mut self.moved));
        let weather = Weather::new(self, around, time);
        flows(&weather.draughts, &self.particles, &mut carried);
        moved.resize(self.particles.len(), Moved::default());
        let radius = self.cells.support_radius();
        let at_centre = KernelShape::Poly6.at_centre::<3>(radius);
        let mover = Mover { simulation: &*self, weather: &weather, flows: &carried, seconds, radius, at_centre };
        let level = Level::new();
        moved.par_chunks_mut(PARTICLES_OF_TASK).enumerate().for_each(|(task, moved)| {
            dispatch!(level, _simd => mover.move_all(task * PARTICLES_OF_TASK, moved));
        });
        self.take_over(&moved, seconds);
        (self.flows, self.moved) = (carried, moved);
    }

    /// Pressure (11) and its force (12), with k held where sound does not outrun the sub-step.
    fn press(&mut self, seconds: f32) {
        let fluid = &self.parameters.fluid;
        let state =
            StateEquation { rest_density: self.design.rest_density, tension: fluid.tension == Tension::Unclamped };
        let fastest_sound = 0.2 * self.design.support_radius / seconds;
        let most = fastest_sound * fastest_sound;
        let per_kelvin = self.design.stiffness_per_kelvin;
        let Particles { density, temperature, mass, .. } = &self.particles;
        let pressure =
            |(density, temperature): (&f32, &f32)| state.pressure((per_kelvin * temperature).min(most), *density);
        density
            .par_iter()
            .zip(temperature)
            .with_min_len(PARTICLES_OF_TASK)
            .map(pressure)
            .collect_into_vec(&mut self.pressure);
        self.force.accelerations(&self.cells, mass, density, &self.pressure, &mut self.acceleration);
    }

    /// Writes what the sub-step made of the particles into their arrays.
    fn take_over(&mut self, moved: &[Moved], seconds: f32) {
        let Particles { position, velocity, drift, temperature, fuel, soot, support_radius, life, age, .. } =
            &mut self.particles;
        let ([x, y, z], [u, v, w], [d, e, f]) = (position, velocity, drift);
        let arrays = [x, y, z, u, v, w, d, e, f, temperature, fuel, soot, support_radius, life, age];
        let mut chunks = arrays.map(|values| values.chunks_mut(PARTICLES_OF_TASK));
        let tasks = moved.chunks(PARTICLES_OF_TASK).map(|moved| (moved, chunks.each_mut().map(|chunks| chunks.next())));
        let tasks: Vec<_> = tasks.collect();
        tasks.into_par_iter().for_each(|(moved, columns)| {
            let mut columns = columns.map(Option::unwrap_or_default);
            for (row, moved) in moved.iter().enumerate() {
                let Moved { place, velocity, drift, being, life } = *moved;
                let Being { temperature, fuel, soot, support_radius } = being;
                let ([x, y, z], [u, v, w], [d, e, f]) = (place.to_array(), velocity.to_array(), drift.to_array());
                let age = columns[14][row] + seconds;
                let values = [x, y, z, u, v, w, d, e, f, temperature, fuel, soot, support_radius, life, age];
                for (column, value) in columns.iter_mut().zip(values) {
                    column[row] = value;
                }
            }
        });
    }

    /// Removes what has lived its time or left the domain, and whatever is not a number.
    fn bury(&mut self) {
        let [min, max] = self.design.domain.map(|corner| corner.as_vec3());
        let Particles { position, velocity, temperature, age, life, .. } = &self.particles;
        let keep: Vec<bool> = (0..age.len())
            .into_par_iter()
            .with_min_len(PARTICLES_OF_TASK)
            .map(|index| {
                let place = Vec3::from(position.each_ref().map(|values| values[index]));
                let speed = Vec3::from(velocity.each_ref().map(|values| values[index])).length_squared();
                let inside = place.cmpge(min).all() && place.cmple(max).all();
                inside && age[index] < life[index] && speed.is_finite() && temperature[index].is_finite()
            })
            .collect();
        self.particles.retain(&keep);
    }
}

/// Moves particles through one sub-step.
struct Mover<'a> {
    simulation: &'a Simulation,
    weather: &'a Weather<'a>,
    /// The air's motion at each particle.
    flows: &'a [Flow],
    seconds: f32,
    radius: f32,
    /// Poly6, eq. (2), at its centre.
    at_centre: f32,
}

impl Mover<'_> {
    #[inline(always)]
    fn vector(values: &[Vec<f32>], index: usize) -> Vec3 {
        Vec3::new(values[0][index], values[1][index], values[2][index])
    }

    /// The particles from `first` on after the sub-step; inlined, so that it becomes code for the machine at hand.
    #[inline(always)]
    fn move_all(&self, first: usize, all: &mut [Moved]) {
        for (along, moved) in all.iter_mut().enumerate() {
            *moved = self.moved(first + along);
        }
    }

    #[inline(always)]
    fn moved(&self, index: usize) -> Moved {
        let Self { simulation, weather, seconds, radius, .. } = *self;
        let particles = &simulation.particles;
        let draught = &weather.draughts[particles.burner[index] as usize];
        let place = Self::vector(&particles.position, index);
        let before = Self::vector(&particles.velocity, index);
        let temperature = particles.temperature[index];
        let wind = weather.breezes[particles.burner[index] as usize].at(place);
        let to_air = self.to_air(index);
        let mixing = draught.entrainment * (before - wind).length() * (0.5 + to_air);
        let velocity = self.pushed(index, before - Self::vector(&particles.drift, index), wind, mixing);
        let drift = draught.velocity(&self.flows[index], velocity.length(), particles.age[index]);
        let total = (velocity + drift).clamp_length_max(GREATEST_SPEED);
        let clearance = CLEARANCE * radius;
        let solids = Solids { occluders: weather.occluders, origin: weather.origin, clearance };
        let (new_place, total) = solids.carry(place, total * seconds, total);
        let exposure = Exposure {
            to_air,
            mixing,
            burning: particles.hunger[index] * (draught.burning[0] * total.length() + draught.burning[1]),
            density: weather.density_kelvin / temperature.max(1.0),
            air_temperature: weather.air_temperature,
            smallest_radius: radius,
        };
        let even = self.evening(simulation.parameters.fluid.conduction, index);
        let being = Being {
            temperature: even.mul_add(simulation.beside.temperature(index), temperature),
            fuel: particles.fuel[index],
            soot: particles.soot[index],
            support_radius: particles.support_radius[index],
        };
        let after = simulation.laws.live(being, &exposure, seconds);
        let burnt_out = being.fuel > 0.0 && after.fuel == 0.0;
        let rest = simulation.parameters.life.afterlife_s as f32;
        let life = if burnt_out { particles.age[index] + rest } else { particles.life[index] };
        Moved { place: new_place, velocity: total, drift, being: after, life }
    }

    /// What of the difference to the neighbours is evened out in this sub-step, for a share in [`EVENING_TIME`].
    #[inline(always)]
    fn evening(&self, share: f64, index: usize) -> f32 {
        (share as f32 * self.seconds / EVENING_TIME).min(1.0) / self.simulation.particles.density[index].sqrt()
    }

    /// Own velocity after pressure, viscosity, buoyancy and wind.
    #[inline(always)]
    fn pushed(&self, index: usize, own: Vec3, wind: Vec3, mixing: f32) -> Vec3 {
        let Self { simulation, weather, seconds, .. } = *self;
        let particles = &simulation.particles;
        // No force moves a particle by more than a quarter of d in a sub-step.
        let most = 0.25 * self.radius / (seconds * seconds);
        let mut acceleration = Self::vector(&simulation.acceleration, index).clamp_length_max(most);
        acceleration.y += weather.buoyancy * (particles.temperature[index] / weather.air_temperature - 1.0);
        let per_volume = weather.wind == WindForce::PerVolume;
        if per_volume {
            acceleration += wind * (weather.wind_gain / particles.density[index].max(1e-6));
        }
        let viscosity = self.evening(simulation.parameters.fluid.viscosity, index);
        let pushed = own + acceleration * seconds + Vec3::from(simulation.beside.velocity(index)) * viscosity;
        let rate = mixing * seconds;
        let air = if per_volume { Vec3::ZERO } else { wind * weather.wind_gain };
        let mixed = ((pushed + air * rate) / (1.0 + rate)).clamp_length_max(GREATEST_SPEED);
        if per_volume { mixed } else { self.dragged(index, mixed, air) }
    }

    /// Velocity after the drag of air that blows across the fire: `C rho_air / (rho r) |w - u| (w - u)`, level and implicit.
    ///
    /// Gas is several times thinner than air, so that a wind it would hardly mix with still bends it.
    #[inline(always)]
    fn dragged(&self, index: usize, own: Vec3, air: Vec3) -> Vec3 {
        let across = (air - own) * Vec3::new(1.0, 0.0, 1.0);
        let particles = &self.simulation.particles;
        let thinner = particles.temperature[index] / self.weather.air_temperature;
        let drag = self.weather.draughts[particles.burner[index] as usize].drag;
        let rate = drag * thinner * across.length() * self.seconds;
        own + across * (rate / (1.0 + rate))
    }

    /// How much of a particle lies at the edge of the gas: neighbours all on one side, or none.
    #[inline(always)]
    fn to_air(&self, index: usize) -> f32 {
        let beside = &self.simulation.beside;
        let sum = beside.weight(index);
        if sum <= 0.0 {
            return 1.0;
        }
        let offset = Vec3::from(beside.offset(index)).length() / (sum * self.radius * SURFACE_OFFSET);
        let own = beside.weights[index] * self.at_centre / sum;
        let alone = (own - ALONE_SHARE[0]) / ALONE_SHARE[1];
        offset.max(alone).clamp(0.0, 1.0)
    }
}
