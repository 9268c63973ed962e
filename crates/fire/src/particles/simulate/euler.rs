//! The paper's algorithm to the letter, section 4.3: `gas_model = "euler"`.
//!
//! A step does what the paper lists, in its order: (1) particles are added, (2) their neighbors are found, (3) their densities computed, (4) the
//! pressure gradient and the external force; then velocities and positions. Mass and temperature are constants that a particle gets when it is added.
//!
//! The paper leaves open how particles end. It adds a fixed number in every frame and reports about 3000, so the number is held by removing the
//! oldest: [`EulerStep::remove_oldest`]. It states neither k, rho_0, d, m nor the time step; see [`DerivedConstants`].

use bansho_base::{
    host::parallel::prelude::*,
    math::{DVec3, Vec3, random::Key},
    phenomenon::surroundings::Surroundings,
};

use crate::particles::{
    parameters::FlameParticlesParameters,
    simulate::{
        collision::Colliders,
        derived::DerivedConstants,
        fluid::FluidSolver,
        integrate::{CLEARANCE, MAX_SPEED, max_acceleration},
        particle_lanes::PARTICLES_PER_TASK,
        particles::{GasParticles, Particle},
        spawning::ORDINAL_BITS,
    },
};

/// Age at which particles are removed, s: never, since the oldest are removed when there are too many, whatever their age.
const NEVER_S: f32 = 1e9;

/// One step of the paper's gas from `time`.
pub(super) struct EulerStep<'a> {
    pub(super) parameters: &'a FlameParticlesParameters,
    pub(super) constants: &'a DerivedConstants,
    pub(super) key: Key,
    pub(super) surroundings: &'a Surroundings<'a>,
    pub(super) time: f64,
}

impl EulerStep<'_> {
    /// Advances the particles by one step.
    pub(super) fn advance(&self, particles: &mut GasParticles, solver: &mut FluidSolver) {
        self.add_particles(particles);
        self.remove_oldest(particles);
        // Neighbors, density (3), pressure (11), its force (12) and its acceleration (8).
        solver.compute_pressure_forces(particles, self.parameters.step_s as f32);
        self.integrate(particles, solver.acceleration.each_ref().map(Vec::as_slice), solver.support_radius());
        self.remove_outside(particles);
    }

    /// Step 1: adds the particles of this step, all with the same initial speed, mass and temperature.
    fn add_particles(&self, particles: &mut GasParticles) {
        for burner in 0..self.constants.burners.len() {
            let [before, after] = [self.time, self.time + self.parameters.step_s].map(|t| self.added_count(burner, t));
            for ordinal in before..after {
                if particles.len() >= self.constants.max_particles {
                    return;
                }
                self.add_one(particles, burner, ordinal);
            }
        }
    }

    /// Number of particles that a burner has added until `t`: the same number in each step at full flow.
    fn added_count(&self, burner: usize, t: f64) -> u64 {
        let DerivedConstants { burners, rates, preroll, .. } = self.constants;
        let step_s = self.parameters.step_s;
        let per_step = (rates[burner] * step_s).round().max(1.0);
        let start = -(preroll / step_s).round() * step_s;
        let steps_at_full_flow = burners[burner].parameters.flow.integral(start, t) / step_s;
        (per_step * steps_at_full_flow).round().max(0.0) as u64
    }

    fn add_one(&self, particles: &mut GasParticles, burner_index: usize, ordinal: u64) {
        let (constants, burner) = (self.constants, &self.constants.burners[burner_index]);
        let id = (burner_index as u64) << ORDINAL_BITS | ordinal;
        let spawn_point = burner.spawn_point(self.key, id, self.time);
        let particle = Particle {
            id,
            position: spawn_point.position.as_vec3().to_array(),
            velocity: (spawn_point.direction * burner.speed).as_vec3().to_array(),
            mass: constants.mass,
            density: constants.density,
            temperature: burner.parameters.temperature_k as f32,
            support_radius: constants.support_radius,
            age: 0.0,
            max_age: NEVER_S,
            fuel: 1.0,
            soot: self.parameters.combustion.soot_ppm as f32 * 1e-6,
        };
        particles.push_from(burner_index as u32, 1.0, particle);
    }

    /// Keeps as many particles of each burner as are to be alive at a time, those added last.
    fn remove_oldest(&self, particles: &mut GasParticles) {
        let DerivedConstants { rates, residence_times, .. } = self.constants;
        let mut first_kept = Vec::with_capacity(rates.len());
        for (burner, (rate, residence_time)) in rates.iter().zip(residence_times).enumerate() {
            let alive = (rate * residence_time).round().max(1.0) as u64;
            first_kept.push(self.added_count(burner, self.time + self.parameters.step_s).saturating_sub(alive));
        }
        let GasParticles { id, burner, .. } = &*particles;
        let ordinals = id.iter().map(|id| id & ((1 << ORDINAL_BITS) - 1));
        let keep: Vec<bool> =
            ordinals.zip(burner).map(|(ordinal, burner)| ordinal >= first_kept[*burner as usize]).collect();
        particles.retain(&keep);
    }

    /// Removes particles that have left the domain.
    fn remove_outside(&self, particles: &mut GasParticles) {
        let [min, max] = self.constants.domain.map(|corner| corner.as_vec3());
        let [x, y, z] = particles.positions();
        let are_inside = (0..x.len()).map(|index| {
            let position = Vec3::new(x[index], y[index], z[index]);
            position.cmpge(min).all() && position.cmple(max).all()
        });
        let keep: Vec<bool> = are_inside.collect();
        particles.retain(&keep);
    }

    /// Adds the external force of section 4.2.3, the wind as a force per volume, to the acceleration by pressure, eq. (8); then velocity, then position.
    ///
    /// The limits of acceleration and speed only take effect where the step is too long for the gas, so that no scene diverges.
    fn integrate(&self, particles: &mut GasParticles, acceleration: [&[f32]; 3], radius: f32) {
        let GasParticles { origin, position: [x, y, z], velocity: [u, v, w], density, age, .. } = particles;
        let (origin, seconds) = (*origin, self.parameters.step_s as f32);
        let occluders = &self.surroundings.others.occluders;
        let colliders = Colliders { occluders, origin, clearance: CLEARANCE * radius };
        let max_acceleration = max_acceleration(radius, seconds);
        let positions = x.par_iter_mut().zip(y).zip(z);
        let velocities = u.par_iter_mut().zip(v).zip(w);
        positions.zip(velocities).zip(age).with_min_len(PARTICLES_PER_TASK).enumerate().for_each(
            |(index, ((((x, y), z), ((u, v), w)), age))| {
                let position = Vec3::new(*x, *y, *z);
                let by_pressure =
                    Vec3::from(acceleration.map(|values| values[index])).clamp_length_max(max_acceleration);
                let acceleration = by_pressure + self.wind_force(origin + position.as_dvec3()) / density[index];
                let velocity = (Vec3::new(*u, *v, *w) + acceleration * seconds).clamp_length_max(MAX_SPEED);
                let (position, [velocity]) = colliders.collide(position, velocity * seconds, [velocity]);
                ([*x, *y, *z], [*u, *v, *w]) = (position.to_array(), velocity.to_array());
                *age += seconds;
            },
        );
    }

    /// The external force per volume at a place, N/m^3: the wind itself, times `wind_response`.
    fn wind_force(&self, place: DVec3) -> Vec3 {
        self.surroundings.wind.at(place, self.time).as_vec3() * self.parameters.forces.wind_response as f32
    }
}
