//! A run of an aurora: its state, and how the renderer steps and draws it.

use std::sync::Arc;

use bansho_base::{
    geometry::point_cloud::PointCloud,
    host::observer::{Cancelled, Observer},
    phenomenon::{
        Prepared, Run, SnapshotError, Stepped,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Publication, Surroundings},
    },
};

use super::{AuroraStage, model::Aurora, simulate::AuroraSimulation};
use crate::{
    render::{
        emitted_light::directional_light,
        inputs::RenderInputs,
        integrate::chart_memory::ChartMemory,
        prepared::{DEPTHS, PreparedAurora},
        shutter,
        stages::{self, PreparedStage},
    },
    simulate::point_cloud::point_cloud,
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
        Publication {
            lights: directional_light(self.simulation(), &self.aurora.render_tables().emitter_colors)
                .into_iter()
                .collect(),
            ..Publication::default()
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
