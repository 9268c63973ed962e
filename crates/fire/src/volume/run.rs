//! A run of a volume flame: its state, and how the renderer steps and draws it.

use std::sync::Arc;

use bansho_base::{
    host::observer::{Cancelled, Observer, Unobserved, check},
    math::{DVec2, DVec3},
    phenomenon::{
        Prepared, Run, SnapshotError, Stepped,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Publication, Surroundings},
    },
    world::{air::Air, wind::Wind},
};

use super::{
    model::FlameVolume,
    render::{
        field::GasField,
        lights::point_lights,
        prepared::{PreparedVolume, RenderedGas, depths_of_box},
        smoke::SmokeLight,
    },
    simulate::{Simulation, snapshot},
};
use crate::{particles::render::VISIBLE_SOOT_ABSORPTION, sparks::SparkEmitter};

/// A [`FlameVolume`] during a shot.
pub struct FlameVolumeRun {
    flame: Arc<FlameVolume>,
    /// The gas, once it has been stepped or restored.
    simulation: Option<Simulation>,
    /// Time of the state, s.
    time: f64,
}

impl FlameVolumeRun {
    /// A run at its initial state, before the preroll.
    #[must_use]
    pub fn new(flame: Arc<FlameVolume>) -> Self {
        let step_s = flame.parameters().step_s;
        let start = -(flame.preroll / step_s).round() * step_s;
        Self { flame, simulation: None, time: start }
    }

    fn rendered_gas(&self, simulation: &Simulation) -> RenderedGas<'_> {
        let fuel = &self.flame.constants.fuel;
        RenderedGas {
            mixture: simulation.mixture,
            rendering: &self.flame.parameters().rendering,
            soot: fuel.soot_ppm * 1e-6,
            smoke_yield: fuel.smoke_yield,
            time: self.time,
            speed: f64::from(simulation.flow.largest_speed()),
        }
    }

    fn sparks(&self, view: &View) -> SparkEmitter<'_> {
        let size = &self.flame.constants.size;
        let parameters = self.flame.parameters();
        SparkEmitter {
            parameters: &parameters.rendering.sparks,
            key: self.flame.constants.key,
            now: view.shutter.middle(),
            loop_s: None,
            flow: None,
            phase_s: 0.0,
            base: DVec3::from(parameters.position),
            size: DVec2::new(size.diameter, size.height),
            scale: 1.0,
            wind_response: 1.0,
            sheet: None,
        }
    }

    /// Side of a cell in pixels, at the nearest corner of the grid.
    fn cell_pixels(&self, simulation: &Simulation, view: &View) -> f64 {
        let grid = &simulation.flow.grid;
        let origin = DVec3::from(self.flame.parameters().position);
        let (low, high) = (grid.origin + origin, grid.far_corner() + origin);
        let position = view.camera.position;
        let distance = (position.clamp(low, high) - position).length().max(view.camera.near);
        grid.spacing * view.camera.focal_pixels / distance
    }

    /// Luminance of the picture, row by row, by rays one at a time: the naive way, for benchmarks.
    #[doc(hidden)]
    #[must_use]
    pub fn single_ray_luminance(&self, view: &View, surroundings: &Surroundings) -> Vec<f32> {
        let Some(simulation) = &self.simulation else { return Vec::new() };
        let prepared = self.prepared(simulation, view, surroundings, &Unobserved);
        prepared.map_or_else(|Cancelled| Vec::new(), |prepared| prepared.single_ray_luminance())
    }

    fn prepared<'a>(
        &'a self,
        simulation: &'a Simulation,
        view: &'a View,
        surroundings: &Surroundings,
        observer: &dyn Observer,
    ) -> Result<PreparedVolume<'a>, Cancelled> {
        let gas = self.rendered_gas(simulation);
        let step = if self.cell_pixels(simulation, view) > 1.0 { 0.5 } else { 1.0 };
        let position = DVec3::from(self.flame.parameters().position);
        let field = GasField::new(
            &simulation.flow,
            &simulation.active,
            position,
            gas.time_samples(view, &simulation.flow.grid).longest(),
            gas.seen(),
        );
        let mut sparks = self.sparks(view).streaks(view, surroundings.wind);
        sparks.sort_by(|a, b| a.sorting_depth.total_cmp(&b.sorting_depth));
        let lights = self.publish(view.shutter).lights;
        check(observer)?;
        let optics = gas.optics();
        let smoke_light = if optics.smoke_extinction > 0.0 {
            let (flow, active, albedo) = (&simulation.flow, &simulation.active, gas.rendering.smoke_albedo);
            SmokeLight::new(&field, flow, active, &optics, &lights, surroundings, albedo)
        } else {
            None
        };
        Ok(PreparedVolume::new(gas, field, smoke_light, step, sparks, view))
    }
}

/// A wind that does not blow, for air before the first step.
fn initial_wind(wind: &Wind, time: f64) -> [f32; 3] {
    wind.mean(time).as_vec3().to_array()
}

impl Run for FlameVolumeRun {
    fn publish(&self, _shutter: Shutter) -> Publication {
        let Some(simulation) = &self.simulation else { return Publication::default() };
        let parameters = self.flame.parameters();
        let absorption =
            self.flame.constants.fuel.soot_ppm * 1e-6 * VISIBLE_SOOT_ABSORPTION * parameters.rendering.soot_gain;
        let lights = point_lights(simulation, absorption, &parameters.rendering.light);
        Publication { lights, ..Publication::default() }
    }

    fn depth_intervals(&self, view: &View, surroundings: &Surroundings) -> Vec<DepthInterval> {
        let mut intervals = Vec::new();
        if let Some(simulation) = self.simulation.as_ref().filter(|simulation| simulation.active.cells() > 0) {
            intervals.extend(simulation.active_corners().map(|corners| depths_of_box(corners, view)));
        }
        intervals.extend(self.sparks(view).depths(view, surroundings.wind));
        intervals
    }

    fn exposure_parts(&self, view: &View, _surroundings: &Surroundings) -> usize {
        let cameras = view.path_cameras();
        if cameras.is_still() {
            return 1;
        }
        let origin = DVec3::from(self.flame.parameters().position);
        let middle = origin + DVec3::Y * (0.5 * self.flame.constants.size.height);
        let path = cameras.path_pixels(|_| middle);
        bansho_base::phenomenon::strip::parts_of_motion(path, 1.0, view.shutter.max_parts())
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        match &self.simulation {
            Some(simulation) => Ok(Box::new(self.prepared(simulation, view, surroundings, observer)?)),
            None => Ok(Box::new(Nothing)),
        }
    }

    fn as_stepped(&self) -> Option<&dyn Stepped> {
        Some(self)
    }

    fn as_stepped_mut(&mut self) -> Option<&mut dyn Stepped> {
        Some(self)
    }
}

impl Stepped for FlameVolumeRun {
    fn step(&mut self, time: f64, surroundings: &Surroundings) {
        let constants = &self.flame.constants;
        let simulation = self.simulation.get_or_insert_with(|| {
            let is_coarse = time < constants.refined_from;
            Simulation::new(constants.clone(), is_coarse, surroundings.air, initial_wind(surroundings.wind, time))
        });
        simulation.step(time, surroundings);
        self.time = time + constants.parameters.step_s;
    }

    fn snapshot(&self) -> Vec<u8> {
        snapshot::write(self.time, self.simulation.as_ref())
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), SnapshotError> {
        let (time, simulation) = snapshot::read(state, |is_coarse| {
            Simulation::new(self.flame.constants.clone(), is_coarse, &Air::default(), [0.0; 3])
        })?;
        (self.time, self.simulation) = (time, simulation);
        Ok(())
    }
}

/// A flame before its first step.
struct Nothing;

impl Prepared for Nothing {
    fn bounds(&self, _slice: &DepthInterval) -> bansho_base::image::Rect {
        bansho_base::image::Rect::default()
    }

    fn draw(&self, _slice: &DepthInterval, _strip: &mut bansho_base::phenomenon::strip::Strip) {}
}
