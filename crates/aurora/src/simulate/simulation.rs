//! The simulation: what it is made of and what a step does.

use std::sync::Arc;

use bansho_base::{
    math::{DVec2, random::Key},
    phenomenon::SnapshotError,
};

use super::{
    AuroraParticles,
    afterglow::{Afterglow, Fading},
    energy_flux::Precipitation,
    field::Grid2,
    forces::{Mover, Repulsion},
    relocation::{Relocation, near_cells},
    snapshot,
};
use crate::{
    AuroraParameters,
    physics::emission::Emission,
    shapes::{FRAME_S, Sequence},
    simulate::{
        field::{
            scatter::{Scattered, scatter},
            sheet_field::{Field, FieldMaker},
        },
        sheets::{
            arc_length::Along,
            refined_shape::{Course, Folding},
        },
    },
};

/// How far from the sheets particles still know where on them they are, beside L_thr.
const REACH: f64 = 3.0;

/// An aurora's particles, afterglow and field, stepped by frames of 1/30 s.
#[derive(Clone, Debug)]
pub struct AuroraSimulation {
    emission: Emission,
    fading: Fading,
    making: Making,
    relocation: Relocation,
    repulsion: Repulsion,
    mover: Mover,
    precipitation: Precipitation,
    state: SimulationState,
    /// The in-between shape that the particles are drawn to, and what follows from it alone.
    target: Target,
}

/// What in-between shapes are made from.
#[derive(Clone, Debug)]
struct Making {
    key: Key,
    parameters: AuroraParameters,
    sequence: Arc<Sequence>,
    folding: Folding,
    fields: FieldMaker,
}

/// What a step changes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SimulationState {
    pub(super) steps: u64,
    pub(super) next_id: u64,
    /// Support radius h of the repulsion, km.
    pub(super) support_km: f64,
    /// The coordinate along the sheets as they are now.
    pub(super) along: Along,
    /// The same for the in-between shape that particles are drawn to, and the time of that shape, s.
    pub(super) target_along: Along,
    pub(super) target_time: f64,
    /// How many renewals there have been.
    pub(super) renewals: u32,
    pub(super) particles: AuroraParticles,
    pub(super) afterglow: Afterglow,
}

#[derive(Clone, Debug)]
struct Target {
    course: Course,
    /// The particles that were scattered about it.
    scattered: Vec<Scattered>,
    field: Field,
    /// delta_0, particles per km^2.
    rest_density: f64,
}

impl Making {
    /// The course of the shape at a time, by the coordinate along it.
    fn course(&self, along: &Along, time: f64) -> Course {
        let reach = REACH * self.parameters.half_thickness_km();
        let (shape, bridges) = (self.sequence.at(time), self.sequence.bridges(time));
        Course::new((&shape, &bridges), along, &self.folding, time, reach)
    }

    /// The coordinate along the sheets at a time that `before` have become.
    fn follow(&self, before: &Along, time: f64) -> Along {
        before.follow(&self.sequence.at(time), &self.sequence.listing(time))
    }

    /// The target that a state speaks of.
    fn target(&self, state: &SimulationState) -> Target {
        let course = self.course(&state.target_along, state.target_time);
        let count = self.parameters.particles.count as usize;
        let scattered = scatter(&course, self.parameters.half_thickness_km(), count, self.key, state.renewals);
        let field = self.fields.make(&course, &scattered, state.target_time);
        let near = near_cells(&field, &self.parameters.particles.relocation);
        let near = near.into_iter().filter(|near| *near).count().max(1) as f64;
        let cell = self.parameters.cell_km();
        Target { course, scattered, field, rest_density: count as f64 / (near * cell * cell) }
    }
}

/// Forces and motion; particles appear and vanish, and those that have vanished are gone.
fn advance(state: &mut SimulationState, target: &Target, (repulsion, mover): (&mut Repulsion, &Mover), fade_s: f64) {
    state.support_km = repulsion.find(&mut state.particles, state.support_km, target.rest_density);
    let particles = &mut state.particles;
    mover.advance(particles, &target.field, &repulsion.accelerations);
    let step = if fade_s > 0.0 { (FRAME_S / fade_s) as f32 } else { 1.0 };
    for (fade, dying) in particles.fades.iter_mut().zip(&particles.dying) {
        *fade = if *dying { *fade - step } else { (*fade + step).min(1.0) };
    }
    let keep: Vec<bool> = particles.fades.iter().map(|fade| *fade > 0.0).collect();
    if keep.contains(&false) {
        particles.retain(&keep);
    }
}

impl AuroraSimulation {
    /// Length of a step, s.
    pub const STEP_S: f64 = FRAME_S;

    /// The aurora `name` at the beginning of its preroll: particles evenly about the first shape, at rest.
    #[must_use]
    pub fn new(parameters: AuroraParameters, sequence: impl Into<Arc<Sequence>>, name: &str, seed: u64) -> Self {
        let sequence = sequence.into();
        let key = Key::new(seed, name);
        let time = -parameters.preroll_s;
        let along = Along::begin(&sequence.at(time), &sequence.listing(time));
        let repulsion = Repulsion::new(&parameters);
        let precipitation = Precipitation::new(&parameters, key);
        let mut state = SimulationState {
            steps: 0,
            next_id: 0,
            support_km: parameters.cell_km(),
            target_along: along.clone(),
            along,
            target_time: time,
            renewals: 0,
            particles: AuroraParticles::default(),
            afterglow: Afterglow::new(parameters.extent_km, parameters.cell_km()),
        };
        let (folding, fields) = (Folding::new(&parameters, key), FieldMaker::new(&parameters, key));
        let making = Making { key, parameters, sequence, folding, fields };
        let target = making.target(&state);
        for (id, particle) in target.scattered.iter().enumerate() {
            state.particles.push(id as u64, particle.place, [0.0; 2], 1.0);
        }
        state.next_id = target.scattered.len() as u64;
        state.support_km = repulsion.support_km(target.rest_density);
        let rays = precipitation.rays(&target.course, time);
        precipitation.share_out(&mut state.particles, (&target.course, &rays), time);
        state.afterglow.settle(&state.particles);
        let parameters = &making.parameters;
        let emission = parameters.drawing.fall.shared_emission(parameters.spectrum);
        Self {
            fading: Fading::new(emission, Self::STEP_S * parameters.time_lapse),
            emission: emission.clone(),
            relocation: Relocation::new(parameters, key),
            mover: Mover::new(parameters),
            repulsion,
            precipitation,
            making,
            state,
            target,
        }
    }

    /// Renews the in-between shape: births and deaths by the one before, then the field of the new one. It is the shape of the
    /// next renewal, so that particles are there when the shape is.
    fn renew(&mut self, frames: u64) {
        let (state, target) = (&mut self.state, &self.target);
        self.relocation.relocate(
            &mut state.particles,
            (&target.field, &target.course, &target.scattered),
            state.renewals,
            &mut state.next_id,
        );
        state.renewals += 1;
        state.target_time = (state.steps + frames) as f64 * Self::STEP_S - self.making.parameters.preroll_s;
        state.target_along = self.making.follow(&state.along, state.target_time);
        self.target = self.making.target(&self.state);
    }

    /// Time of the state, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.state.steps as f64 * Self::STEP_S - self.making.parameters.preroll_s
    }

    /// Steps to [`Self::STEP_S`] later.
    pub fn step(&mut self) {
        let frames = self.making.parameters.motion.renew_frames.round().max(1.0) as u64;
        if self.state.steps.is_multiple_of(frames) {
            self.renew(frames);
        }
        let time = (self.state.steps + 1) as f64 * Self::STEP_S - self.making.parameters.preroll_s;
        let Self { making, repulsion, mover, state, target, precipitation, fading, .. } = self;
        let before = state.along.clone();
        // Where the sheets will be does not depend on the particles, and is found beside them.
        let (_, (along, course, rays)) = rayon::join(
            || advance(state, target, (repulsion, mover), making.parameters.particles.fade_s),
            || {
                let mut along = making.follow(&before, time);
                along.relax(Self::STEP_S);
                let course = making.course(&along, time);
                let rays = precipitation.rays(&course, time);
                (along, course, rays)
            },
        );
        state.steps += 1;
        state.along = along;
        precipitation.share_out(&mut state.particles, (&course, &rays), time);
        state.afterglow.step(&state.particles, fading);
    }

    /// The state as bytes.
    #[must_use]
    pub fn snapshot(&self) -> Vec<u8> {
        snapshot::write(&self.state)
    }

    /// Returns to a state that [`Self::snapshot`] of an aurora with the same parameters gave.
    ///
    /// # Errors
    /// The bytes are not such a state; nothing is changed then.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        let mut state = snapshot::read(bytes, &self.state)?;
        let time = state.steps as f64 * Self::STEP_S - self.making.parameters.preroll_s;
        let (now, then) = (self.making.sequence.listing(time), self.making.sequence.listing(state.target_time));
        if !state.along.take_listing(&now) || !state.target_along.take_listing(&then) {
            return Err(SnapshotError::Damaged);
        }
        self.state = state;
        self.target = self.making.target(&self.state);
        Ok(())
    }

    /// The sheets as they are now, with their folds.
    #[cfg(test)]
    pub(super) fn course(&self) -> Course {
        self.making.course(&self.state.along, self.time())
    }

    /// Its parameters.
    #[must_use]
    pub fn parameters(&self) -> &AuroraParameters {
        &self.making.parameters
    }

    /// Light by energy and altitude for its spectrum.
    #[must_use]
    pub fn emission(&self) -> &Emission {
        &self.emission
    }

    /// Its particles.
    #[must_use]
    pub fn particles(&self) -> &AuroraParticles {
        &self.state.particles
    }

    /// Mean distance of neighbouring particles, km: the side of a square that holds one.
    pub(crate) fn spacing_km(&self) -> f64 {
        (std::f64::consts::PI / self.making.parameters.particles.neighbours).sqrt() * self.state.support_km
    }

    /// Where green and red linger.
    #[must_use]
    pub fn afterglow(&self) -> &Afterglow {
        &self.state.afterglow
    }

    /// Potential of the in-between shape without noise, km^2/s^2: negative, lowest on the shape. Cells of
    /// [`AuroraParameters::cell_km`], x east, z south (thesis, figure 2.12).
    #[must_use]
    pub fn potential(&self) -> &Grid2 {
        &self.target.field.potential
    }

    /// How many particles were scattered into each cell about the in-between shape, N(i, j) (thesis, figure 2.10).
    #[must_use]
    pub fn scatter_counts(&self) -> &Grid2 {
        &self.target.field.counts
    }

    /// What noise adds to the potential at a place, km^2/s^2 (thesis, figure 2.11).
    #[must_use]
    pub fn potential_noise(&self, place: DVec2) -> f64 {
        let noisy = self.target.field.sample(place.x as f32, place.y as f32).potential;
        f64::from(noisy) - self.potential().sample(place.to_array())
    }

    /// How many particles are in each cell now (thesis, figure 2.14).
    #[must_use]
    pub fn particle_counts(&self) -> Grid2 {
        let particles = self.particles();
        self.making.fields.sum((0..particles.len()).map(|index| (particles.place(index), 1.0)))
    }
}
