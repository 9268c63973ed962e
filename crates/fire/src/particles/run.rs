//! A run of a particle flame: its state, and how the renderer steps and draws it.

use std::sync::Arc;

use bansho_base::{
    geometry::point_cloud::{PointCloud, Quantity},
    host::observer::{Cancelled, Observer},
    math::{DVec2, DVec3},
    parameters::Auto,
    phenomenon::{
        Prepared, Run, SnapshotError, Stepped,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Publication, Surroundings},
    },
    world::air::Air,
};

use super::{
    model::FlameParticles,
    past_states::PastStates,
    render::{self, BufferPool, FadeOut, Gas, GasExposure, GasState, PreparedGas},
    simulate::{Simulation, particles::GasParticles, snapshot},
};

/// Speed of gas with isotropic detail, relative to the gas on the axis at half the height of the flame.
const ISOTROPIC_DETAIL_SPEED: f64 = 0.35;

/// A [`FlameParticles`] during a shot: its gas, stepped by [`FlameParticlesParameters::step_s`](super::FlameParticlesParameters::step_s).
#[derive(Clone, Debug)]
pub struct FlameParticlesRun {
    pub(super) flame: Arc<FlameParticles>,
    pub(super) simulation: Simulation,
    /// Earlier states from which a long exposure is drawn.
    past: PastStates,
    /// Time of the state, s.
    pub(super) time: f64,
    /// Temperature of the air at the last step, K.
    air_temperature_k: f64,
    /// Scratch memory of the renderer.
    buffers: BufferPool,
}

impl FlameParticlesRun {
    /// A run at its initial state, before the preroll.
    #[must_use]
    pub fn new(flame: Arc<FlameParticles>) -> Self {
        let step_s = flame.parameters().step_s;
        let start = -(flame.constants.derived.preroll / step_s).round() * step_s;
        Self {
            simulation: Simulation::new(flame.constants.clone()),
            past: PastStates::new(step_s, start),
            time: start,
            air_temperature_k: Air::default().temperature_k,
            buffers: BufferPool::default(),
            flame,
        }
    }

    /// The particles of the current state.
    pub fn particles(&self) -> &GasParticles {
        &self.simulation.particles
    }

    /// The gas of the current state as the renderer sees it.
    pub(super) fn gas(&self) -> Gas<'_> {
        self.gas_of(&self.simulation.particles, self.time)
    }

    /// The gas of the last state that is not after `t`, as far as states are kept: also that of a part of the exposure to whose end it was stepped.
    fn gas_at(&self, t: f64) -> Gas<'_> {
        let earlier = self.past.state_at(t).filter(|_| !self.past.is_reached(self.time, t));
        earlier.map_or_else(|| self.gas(), |state| self.gas_of(&state.particles, state.time))
    }

    /// The gas of a state as the renderer sees it.
    fn gas_of<'a>(&'a self, particles: &'a GasParticles, time: f64) -> Gas<'a> {
        let (parameters, tallest) = (self.flame.parameters(), self.flame.tallest_burner());
        let position = DVec3::from(parameters.position) + tallest.position(time);
        Gas {
            particles,
            time,
            air_temperature_k: self.air_temperature_k,
            detail_speed: match parameters.rendering.detail_speed {
                Auto::Set(speed) => speed,
                Auto::Auto => ISOTROPIC_DETAIL_SPEED * tallest.axis_speed(0.5 * tallest.height),
            },
            base: position,
            size: DVec2::new(tallest.diameter, tallest.height),
            key: self.flame.constants.key,
            fade_out: self.fade_out(),
            buffers: &self.buffers,
        }
    }

    /// The states from which an exposure is drawn, each with its part of the exposure.
    pub(super) fn states(&self, shutter: Shutter) -> Vec<GasState<'_>> {
        let past = self.past.of_exposure(shutter).map(|state| self.gas_of(&state.particles, state.time));
        let mut gases: Vec<Gas> = past.collect();
        if self.past.is_exposed(self.time, shutter) {
            gases.push(self.gas());
        }
        if gases.is_empty() {
            gases.push(self.gas_at(shutter.middle()));
        }
        let mut states = Vec::with_capacity(gases.len());
        for (index, gas) in gases.iter().enumerate() {
            // A state is exposed until the next one; the first stands for what precedes it, too.
            let open = if index == 0 { shutter.open } else { gas.time.max(shutter.open) };
            let close = gases.get(index + 1).map_or(shutter.close, |next| next.time.max(shutter.open));
            let part = Shutter { open, close };
            if part.close > part.open || gases.len() == 1 {
                states.push(GasState { gas: *gas, shutter: part });
            }
        }
        states
    }

    /// What an exposure sees of the gas.
    pub(super) fn exposure(&self, shutter: Shutter) -> GasExposure<'_> {
        let states = self.states(shutter);
        let middle = states.iter().rev().find(|state| self.past.is_reached(state.gas.time, shutter.middle()));
        let middle = middle.or(states.first()).map_or_else(|| self.gas(), |state| state.gas);
        GasExposure { middle, states, is_short: self.past.is_short(shutter) }
    }

    /// How gas fades out before it is removed.
    fn fade_out(&self) -> FadeOut {
        /// Duration of the fade-out as a fraction of the time for which burnt gas remains.
        const FADE_FRACTION: f64 = 0.2;
        let parameters = self.flame.parameters();
        let seconds = (FADE_FRACTION * parameters.combustion.burnt_gas_lifetime_s).max(parameters.step_s) as f32;
        FadeOut { seconds, domain: self.simulation.constants().domain.map(|corner| corner.as_vec3()) }
    }
}

impl Run for FlameParticlesRun {
    fn publish(&self, shutter: Shutter) -> Publication {
        let lights =
            render::point_lights_of_exposure(&self.exposure(shutter), &self.flame.parameters().rendering, shutter);
        Publication { lights, ..Publication::default() }
    }

    fn depth_intervals(&self, view: &View, surroundings: &Surroundings) -> Vec<DepthInterval> {
        render::depth_intervals(
            &self.exposure(view.shutter).middle,
            &self.flame.parameters().rendering,
            view,
            surroundings.wind,
        )
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        let (exposure, rendering) = (self.exposure(view.shutter), &self.flame.parameters().rendering);
        Ok(Box::new(PreparedGas::of_exposure(&exposure, rendering, view, surroundings, observer)?))
    }

    fn export_particles(&self, view: &View, _surroundings: &Surroundings) -> Option<PointCloud> {
        let t = view.shutter.middle();
        let gas = self.exposure(view.shutter).middle;
        let GasParticles { velocity: [u, v, w], temperature, density, .. } = gas.particles;
        let positions = (0..gas.particles.len()).map(|index| gas.position(index, t).to_array());
        let velocities = u.iter().zip(v).zip(w).map(|((u, v), w)| [*u, *v, *w]).collect();
        let quantities = [(Quantity::Temperature, temperature.clone()), (Quantity::Density, density.clone())];
        Some(PointCloud::new(view.export_origin, positions, velocities, quantities.into()))
    }

    fn as_stepped(&self) -> Option<&dyn Stepped> {
        Some(self)
    }

    fn as_stepped_mut(&mut self) -> Option<&mut dyn Stepped> {
        Some(self)
    }
}

impl Stepped for FlameParticlesRun {
    fn step(&mut self, time: f64, surroundings: &Surroundings) {
        self.past.keep(self.time, &self.simulation.particles);
        self.simulation.step(time, surroundings);
        self.time = time + self.simulation.step_s();
        self.air_temperature_k = surroundings.air.temperature_k;
    }

    fn time_for(&self, shutter: Shutter) -> f64 {
        if self.past.has_several(shutter) { shutter.close } else { shutter.middle() }
    }

    fn begin_exposure(&mut self, shutter: Shutter) {
        self.past.begin(shutter);
    }

    fn keeps_states_for(&self, shutter: Shutter) -> bool {
        self.past.keeps(shutter, self.time)
    }

    fn snapshot(&self) -> Vec<u8> {
        let head = [self.time, self.air_temperature_k].into_iter().flat_map(f64::to_le_bytes);
        let mut bytes: Vec<u8> = head.chain(snapshot::write(&self.simulation.particles)).collect();
        self.past.write(&mut bytes);
        bytes
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), SnapshotError> {
        let (time, rest) = state.split_first_chunk::<8>().ok_or(SnapshotError::Damaged)?;
        let (air, rest) = rest.split_first_chunk::<8>().ok_or(SnapshotError::Damaged)?;
        let (time, air) = (f64::from_le_bytes(*time), f64::from_le_bytes(*air));
        if !time.is_finite() || !air.is_finite() {
            return Err(SnapshotError::Damaged);
        }
        let burners = self.simulation.constants().burners.len();
        let (state, past) = snapshot::split_first(rest)?;
        let particles = snapshot::read(&self.simulation.particles, state, burners)?;
        self.past.restore(self.past.read(past, &particles, burners)?);
        self.simulation.particles = particles;
        (self.time, self.air_temperature_k) = (time, air);
        Ok(())
    }
}
