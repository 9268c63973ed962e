//! The simulation: state and step.

use std::sync::Arc;

use bansho_base::{
    host::parallel,
    math::{DVec2, random::Key},
    phenomenon::SnapshotError,
};

use super::{
    AuroraParticles,
    afterglow::{Afterglow, AfterglowDecay},
    energy_flux::EnergyFlux,
    field::Grid2,
    forces::{Integrator, Repulsion},
    relocation::{Relocation, cells_of_low_potential, near_cells},
    state::SimulationState,
};
use crate::{
    AuroraParameters,
    physics::emission::Emission,
    shapes::{FRAME_S, Sequence},
    simulate::{
        field::{
            sheet_charge::{ScatteredParticle, scatter},
            sheet_field::{ElectricField, FieldBuilder, full_cell_count},
        },
        sheets::{
            arc_length::ArcLengthMap,
            refined_shape::{FoldModel, RefinedShape},
        },
    },
};

/// Maximum distance of sheet queries relative to L_thr.
const REACH: f64 = 3.0;

/// An aurora's particles, afterglow and field, stepped by frames of 1/30 s.
#[derive(Clone, Debug)]
pub struct AuroraSimulation {
    emission: Arc<Emission>,
    decay: AfterglowDecay,
    targets: TargetBuilder,
    relocation: Relocation,
    repulsion: Repulsion,
    integrator: Integrator,
    energy_flux: EnergyFlux,
    state: SimulationState,
    /// The in-between shape that attracts the particles, and data derived from it.
    target: Target,
}

/// Builds targets from the sequence.
#[derive(Clone, Debug)]
struct TargetBuilder {
    key: Key,
    parameters: AuroraParameters,
    sequence: Arc<Sequence>,
    fold_model: FoldModel,
    fields: FieldBuilder,
}

#[derive(Clone, Debug)]
struct Target {
    refined: RefinedShape,
    /// Scattered particles of the shape.
    scattered: Vec<ScatteredParticle>,
    field: ElectricField,
    /// delta_0, particles per km^2.
    rest_density: f64,
}

impl TargetBuilder {
    /// The refined shape at a time, with its arc-length map.
    fn refined_shape(&self, arc_map: &ArcLengthMap, time: f64) -> RefinedShape {
        let reach = REACH * self.parameters.half_thickness_km();
        let (shape, bridges) = (self.sequence.at(time), self.sequence.bridges(time));
        RefinedShape::new(&shape, &bridges, arc_map, &self.fold_model, time, reach)
    }

    /// The arc-length map at a time, transferred from `before`.
    fn transfer_arc_map(&self, before: &ArcLengthMap, time: f64) -> ArcLengthMap {
        before.transfer(&self.sequence.at(time), &self.sequence.control_point_ids(time))
    }

    /// The target of a state.
    fn target(&self, state: &SimulationState) -> Target {
        let refined = self.refined_shape(&state.target_arc_map, state.target_time);
        let count = self.parameters.particles.count as usize;
        let scattered = scatter(&refined, self.parameters.half_thickness_km(), count, self.key, state.target_updates);
        let field = self.fields.build(&refined, &scattered, state.target_time);
        let near = near_cells(&field, &self.parameters.particles.relocation);
        let near = near.into_iter().filter(|near| *near).count().max(1) as f64;
        let cell = self.parameters.cell_km();
        Target { refined, scattered, field, rest_density: count as f64 / (near * cell * cell) }
    }
}

/// Forces, integration and fading; particles that have faded out are removed.
fn advance(
    state: &mut SimulationState,
    target: &Target,
    repulsion: &mut Repulsion,
    integrator: &Integrator,
    fade_s: f64,
) {
    state.support_km = repulsion.compute_accelerations(&mut state.particles, state.support_km, target.rest_density);
    let particles = &mut state.particles;
    integrator.advance(particles, &target.field, &repulsion.accelerations);
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

    /// The aurora `name` at the start of its preroll: particles at rest, uniformly distributed about the first shape.
    #[must_use]
    pub fn new(parameters: AuroraParameters, sequence: impl Into<Arc<Sequence>>, name: &str, seed: u64) -> Self {
        let emission = parameters.rendering.emission(parameters.spectrum, parameters.sunlit_above_km);
        Self::with_emission(parameters, sequence.into(), emission, name, seed)
    }

    /// [`Self::new`] with the emission table of its rendering and spectrum.
    pub(crate) fn with_emission(
        parameters: AuroraParameters,
        sequence: Arc<Sequence>,
        emission: Arc<Emission>,
        name: &str,
        seed: u64,
    ) -> Self {
        let key = Key::new(seed, name);
        let time = -parameters.preroll_s;
        let arc_map = ArcLengthMap::from_lengths(&sequence.at(time), &sequence.control_point_ids(time));
        let repulsion = Repulsion::new(&parameters);
        let energy_flux = EnergyFlux::new(&parameters, key);
        let mut state = SimulationState {
            steps: 0,
            next_id: 0,
            support_km: parameters.cell_km(),
            target_arc_map: arc_map.clone(),
            arc_map,
            target_time: time,
            target_updates: 0,
            particles: AuroraParticles::default(),
            afterglow: Afterglow::new(parameters.extent_km, parameters.cell_km()),
        };
        let (fold_model, fields) = (FoldModel::new(&parameters, key), FieldBuilder::new(&parameters, key));
        let targets = TargetBuilder { key, parameters, sequence, fold_model, fields };
        let target = targets.target(&state);
        for (id, particle) in target.scattered.iter().enumerate() {
            state.particles.push(id as u64, particle.position, [0.0; 2], 1.0);
        }
        state.next_id = target.scattered.len() as u64;
        state.support_km = repulsion.support_km(target.rest_density);
        let rays = energy_flux.ray_table(&target.refined, time);
        energy_flux.distribute_power(&mut state.particles, &target.refined, &rays, time);
        if targets.parameters.afterglow {
            state.afterglow.fill_steady_state(&state.particles);
        }
        let parameters = &targets.parameters;
        Self {
            decay: AfterglowDecay::new(&emission, Self::STEP_S * parameters.time_lapse),
            emission,
            relocation: Relocation::new(parameters, key),
            integrator: Integrator::new(parameters),
            repulsion,
            energy_flux,
            targets,
            state,
            target,
        }
    }

    /// Updates the target: births and deaths by the previous target, then the field of the new one. The target is the shape
    /// at the time of the next update, so that particles arrive in time.
    fn update_target(&mut self, frames: u64) {
        let (state, target) = (&mut self.state, &self.target);
        if self.targets.parameters.particles.relocation.enabled {
            self.relocation.relocate(
                &mut state.particles,
                &target.field,
                &target.refined,
                &target.scattered,
                state.target_updates,
                &mut state.next_id,
            );
        }
        state.target_updates += 1;
        state.target_time = (state.steps + frames) as f64 * Self::STEP_S - self.targets.parameters.preroll_s;
        state.target_arc_map = self.targets.transfer_arc_map(&state.arc_map, state.target_time);
        self.target = self.targets.target(&self.state);
    }

    /// Time of the state, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.state.steps as f64 * Self::STEP_S - self.targets.parameters.preroll_s
    }

    /// Advances by [`Self::STEP_S`].
    pub fn step(&mut self) {
        let frames = self.targets.parameters.morphing.update_interval_frames.round().max(1.0) as u64;
        if self.state.steps.is_multiple_of(frames) {
            self.update_target(frames);
        }
        let time = (self.state.steps + 1) as f64 * Self::STEP_S - self.targets.parameters.preroll_s;
        let Self { targets, repulsion, integrator, state, target, energy_flux, decay, .. } = self;
        let before = state.arc_map.clone();
        // The sheets do not depend on the particles and are computed in parallel.
        let (_, (arc_map, refined, rays)) = parallel::join(
            || advance(state, target, repulsion, integrator, targets.parameters.particles.fade_s),
            || {
                let mut arc_map = targets.transfer_arc_map(&before, time);
                arc_map.relax(Self::STEP_S);
                let refined = targets.refined_shape(&arc_map, time);
                let rays = energy_flux.ray_table(&refined, time);
                (arc_map, refined, rays)
            },
        );
        state.steps += 1;
        state.arc_map = arc_map;
        energy_flux.distribute_power(&mut state.particles, &refined, &rays, time);
        if targets.parameters.afterglow {
            state.afterglow.step(&state.particles, decay);
        }
    }

    /// Serializes the state.
    #[must_use]
    pub fn snapshot(&self) -> Vec<u8> {
        self.state.serialize()
    }

    /// Restores a state from [`Self::snapshot`] of an aurora with the same parameters.
    ///
    /// # Errors
    ///
    /// Invalid bytes; the state is then unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        let mut state = SimulationState::deserialize(bytes, &self.state)?;
        let time = state.steps as f64 * Self::STEP_S - self.targets.parameters.preroll_s;
        let (ids, target_ids) =
            (self.targets.sequence.control_point_ids(time), self.targets.sequence.control_point_ids(state.target_time));
        if !state.arc_map.take_control_point_ids(&ids) || !state.target_arc_map.take_control_point_ids(&target_ids) {
            return Err(SnapshotError::Damaged);
        }
        self.state = state;
        self.target = self.targets.target(&self.state);
        Ok(())
    }

    /// The current sheets with folds.
    #[cfg(test)]
    pub(super) fn refined_shape(&self) -> RefinedShape {
        self.targets.refined_shape(&self.state.arc_map, self.time())
    }

    /// Its parameters.
    #[must_use]
    pub fn parameters(&self) -> &AuroraParameters {
        &self.targets.parameters
    }

    /// Emission table of its spectrum.
    #[must_use]
    pub fn emission(&self) -> &Emission {
        &self.emission
    }

    /// Its particles.
    #[must_use]
    pub fn particles(&self) -> &AuroraParticles {
        &self.state.particles
    }

    /// Mean distance between neighboring particles, km: the side of a square with one particle.
    pub(crate) fn spacing_km(&self) -> f64 {
        self.repulsion.spacing_km(self.state.support_km, self.target.rest_density)
    }

    /// Afterglow of the green and the red line.
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

    /// Scattered particles per cell of the in-between shape, N(i, j) (thesis, figure 2.10).
    #[must_use]
    pub(crate) fn scatter_counts(&self) -> &Grid2 {
        &self.target.field.counts
    }

    /// Typical number of scattered particles in a cell that is entirely within a sheet.
    pub(crate) fn full_cell_count(&self) -> f64 {
        full_cell_count(&self.target.field.counts)
    }

    /// Electric field with the noise at a position, km/s^2 (thesis, figure 2.12).
    pub(crate) fn electric_field(&self, position: DVec2) -> DVec2 {
        let [east, south] = self.target.field.sample(position.x as f32, position.y as f32).field;
        DVec2::new(f64::from(east), f64::from(south))
    }

    /// Cells that are near the shape by their potential alone, and by potential and scatter count (thesis, 2.3.4).
    pub(crate) fn near_cells(&self) -> [Vec<bool>; 2] {
        let table = &self.targets.parameters.particles.relocation;
        [cells_of_low_potential(&self.target.field, table), near_cells(&self.target.field, table)]
    }

    /// Noise in the potential at a position, km^2/s^2 (thesis, figure 2.11).
    #[must_use]
    pub fn potential_noise(&self, position: DVec2) -> f64 {
        let noisy = self.target.field.sample(position.x as f32, position.y as f32).potential;
        f64::from(noisy) - self.potential().sample(position.to_array())
    }

    /// Particles per cell (thesis, figure 2.14).
    #[must_use]
    pub(crate) fn particle_counts(&self) -> Grid2 {
        let particles = self.particles();
        self.targets.fields.sum_by_cell((0..particles.len()).map(|index| (particles.position(index), 1.0)))
    }
}
