//! A run of an aurora: its state, how the renderer steps and draws it, and the export of its particles as a point cloud.

use std::sync::Arc;

use bansho_base::{
    geometry::point_cloud::{PointCloud, Quantity},
    host::observer::{Cancelled, Observer},
    math::{self, DVec2, DVec3},
    phenomenon::{
        Prepared, Run, SnapshotError, Stepped,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Publication, Surroundings},
    },
    world::sky::EARTH_RADIUS_KM,
};

use crate::{
    AuroraStage,
    model::Aurora,
    render::{
        emitted_light::{EmittedLight, emitted_light},
        inputs::RenderInputs,
        integrate::column_buffer::ChartMemory,
        prepared::{DEPTHS, PreparedAurora},
        shutter, stages,
        stages::PreparedStage,
    },
    shapes::FOOT_ALTITUDE_KM,
    simulate::{AuroraParticles, AuroraSimulation},
};

/// An [`Aurora`] during a shot: particles, field and afterglow, stepped by [`AuroraSimulation::STEP_S`].
#[derive(Debug)]
pub struct AuroraRun {
    aurora: Arc<Aurora>,
    /// Its state; `None` while it is still the initial one, which all runs share: remarks start hundreds of runs that are never stepped.
    simulation: Option<AuroraSimulation>,
    /// Memory of charts of earlier frames.
    chart_memory: ChartMemory,
}

impl AuroraRun {
    /// A run at its initial state, before the preroll. Computes nothing.
    #[must_use]
    pub fn new(aurora: Arc<Aurora>) -> Self {
        Self { aurora, simulation: None, chart_memory: ChartMemory::default() }
    }

    /// Its particles, field and afterglow.
    #[must_use]
    pub fn simulation(&self) -> &AuroraSimulation {
        self.simulation.as_ref().unwrap_or_else(|| self.aurora.initial_state())
    }

    /// Mutable [`Self::simulation`].
    pub(super) fn simulation_mut(&mut self) -> &mut AuroraSimulation {
        self.simulation.get_or_insert_with(|| self.aurora.initial_state().clone())
    }

    /// What frames of its state are drawn from.
    pub(super) fn render_inputs(&self) -> RenderInputs<'_> {
        RenderInputs {
            simulation: self.simulation(),
            tables: self.aurora.render_tables(),
            chart_memory: &self.chart_memory,
        }
    }
}

impl Run for AuroraRun {
    fn publish(&self, _shutter: Shutter) -> Publication {
        if self.aurora.parameters.stage != AuroraStage::Light {
            return Publication::default();
        }
        match emitted_light(self.simulation(), &self.aurora.render_tables().emitter_colors) {
            Some(EmittedLight { mean, sky }) => {
                Publication { lights: vec![mean], sky_lights: sky, ..Publication::default() }
            }
            None => Publication::default(),
        }
    }

    fn depth_intervals(&self, _view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        vec![if self.aurora.parameters.stage == AuroraStage::Light { DEPTHS } else { stages::DEPTHS }]
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        _surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        match self.aurora.parameters.stage {
            AuroraStage::Light => Ok(Box::new(PreparedAurora::new(self.render_inputs(), view, observer)?)),
            stage => {
                let shape = self.aurora.sequence().at(view.shutter.middle());
                Ok(Box::new(PreparedStage::new(self.simulation(), &shape, stage, view)))
            }
        }
    }

    fn export_particles(&self, view: &View, _surroundings: &Surroundings) -> Option<PointCloud> {
        let t = view.shutter.middle();
        let step = AuroraSimulation::STEP_S;
        if t - self.simulation().time() <= step {
            return Some(point_cloud(self.simulation().particles(), t - self.simulation().time(), view.export_origin));
        }
        // Within a long exposure, `t` may be many steps after the state.
        let mut simulation = self.simulation().clone();
        shutter::step_until(&mut simulation, t);
        Some(point_cloud(simulation.particles(), t - simulation.time(), view.export_origin))
    }

    fn as_stepped(&self) -> Option<&dyn Stepped> {
        Some(self)
    }

    fn as_stepped_mut(&mut self) -> Option<&mut dyn Stepped> {
        Some(self)
    }
}

impl Stepped for AuroraRun {
    fn step(&mut self, _time: f64, _surroundings: &Surroundings) {
        self.simulation_mut().step();
    }

    fn time_for(&self, shutter: Shutter) -> f64 {
        if shutter::is_long(shutter) { shutter.open } else { shutter.middle() }
    }

    fn snapshot(&self) -> Vec<u8> {
        self.simulation().snapshot()
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), SnapshotError> {
        self.simulation_mut().restore(state)
    }
}

/// Half of the interval of the finite-difference velocity, s.
const MOMENT_S: f64 = 1e-3;

/// Particle positions at 100 km altitude, `offset_s` seconds after their step: x east, y up, z south, as for the
/// camera.
pub(crate) fn point_cloud(particles: &AuroraParticles, offset_s: f64, origin: [f64; 3]) -> PointCloud {
    let offset_s = offset_s.clamp(-AuroraSimulation::STEP_S, AuroraSimulation::STEP_S);
    let (mut positions, mut velocities) = (Vec::new(), Vec::new());
    for index in 0..particles.len() {
        positions.push(position_at(particles, index, offset_s).to_array());
        // The velocity follows the shell.
        let [before, after] = [-MOMENT_S, MOMENT_S].map(|time| position_at(particles, index, time));
        velocities.push(((after - before) / (2.0 * MOMENT_S)).as_vec3().to_array());
    }
    let quantities = [(Quantity::Energy, &particles.energies_ev), (Quantity::Power, &particles.powers_w)]
        .map(|(quantity, values)| (quantity, values.clone()));
    PointCloud::new(origin, positions.into_iter(), velocities, quantities.into())
}

/// Position of a particle on the shell `time` seconds after its step, m.
fn position_at(particles: &AuroraParticles, index: usize, time: f64) -> DVec3 {
    let [east, south] = [0, 1].map(|axis| f64::from(particles.velocities[axis][index]));
    on_shell(particles.position(index) + DVec2::new(east, south) * time)
}

/// Maps a position of the drawn plane, km, to the spherical shell at 100 km, m.
fn on_shell(position: DVec2) -> DVec3 {
    const SHELL_M: f64 = 1e3 * (EARTH_RADIUS_KM + FOOT_ALTITUDE_KM);
    let distance = position.length();
    let (sin, cos) = math::sin_cos(1e3 * distance / SHELL_M);
    let horizontal = position.normalize_or_zero() * (sin * SHELL_M);
    DVec3::new(horizontal.x, cos * SHELL_M - 1e3 * EARTH_RADIUS_KM, horizontal.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn particles_lie_on_the_shell_with_their_quantities() {
        let particles = AuroraParticles {
            positions: [vec![0.0, 647.1], vec![0.0, 0.0]],
            velocities: [vec![3.0, 1.0], vec![0.0, 0.0]],
            ids: vec![0, 1],
            energies_ev: vec![5000.0, 700.0],
            powers_w: vec![2.0, 8.0],
            ..AuroraParticles::default()
        };
        let cloud = point_cloud(&particles, 0.01, [0.0; 3]);
        // 30 m on at 3 km/s; a tenth of a radian along the shell.
        assert!((cloud.positions[0][0] - 30.0).abs() < 1e-2 && (cloud.positions[0][1] - 1e5).abs() < 1e-2);
        let [x, y, z] = point_cloud(&particles, 0.0, [0.0; 3]).positions[1].map(f64::from);
        assert!((x - 6.471e6 * 0.099_833_42).abs() < 1.0 && (y - (6.471e6 * 0.995_004_17 - 6.371e6)).abs() < 1.0);
        assert_eq!(z, 0.0);
        // East there is downward by the same angle.
        let [u, v, w] = cloud.velocities[1].map(f64::from);
        assert!((u - 995.004).abs() < 0.1 && (v + 99.83).abs() < 0.1 && w == 0.0);
        assert_eq!(cloud.quantities[&Quantity::Energy], [5000.0, 700.0]);
        assert_eq!(cloud.quantities[&Quantity::Power], [2.0, 8.0]);
    }
}
