//! A run of rain, which has no state, and the light that it has computed for earlier frames.

use std::sync::Arc;

use bansho_base::{
    geometry::point_cloud::PointCloud,
    host::observer::{Cancelled, Observer, check},
    phenomenon::{
        Prepared, Run,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Publication, Surroundings},
    },
};

use super::model::Rain;
use crate::{lighting::LightCaches, raindrop, render::PreparedRain};

/// [`Rain`] during a shot. It can be drawn at any time.
#[derive(Debug)]
pub struct RainRun {
    rain: Arc<Rain>,
    light_caches: LightCaches,
}

impl RainRun {
    /// A run. Computes nothing.
    #[must_use]
    pub fn new(rain: Arc<Rain>) -> Self {
        Self { rain, light_caches: LightCaches::default() }
    }
}

impl Run for RainRun {
    fn publish(&self, shutter: Shutter) -> Publication {
        Publication { extinction: self.rain.extinction(shutter.middle()).all, ..Publication::default() }
    }

    /// Rain fills all depths. Its intervals end at the depths of lights, so that a fire has streaks in front of, within and behind it.
    fn depth_intervals(&self, view: &View, surroundings: &Surroundings) -> Vec<DepthInterval> {
        const MAX_LIGHTS: usize = 8;
        const MIN_LENGTH: f64 = 0.05;
        let (near, far) = (view.camera.near, self.rain.reach(surroundings));
        let positions = surroundings.others.lights.iter().filter_map(|light| light.emitter.position());
        let depths = positions.map(|position| view.camera.depth(position));
        let mut edges: Vec<f64> = depths.filter(|depth| *depth > near && *depth < far).take(MAX_LIGHTS).collect();
        edges.extend([near, far]);
        edges.sort_by(f64::total_cmp);
        edges.dedup_by(|next, last| *next - *last < MIN_LENGTH);
        edges.windows(2).map(|pair| DepthInterval { near: pair[0], far: pair[1] }).collect()
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        check(observer)?;
        Ok(Box::new(PreparedRain::new(&self.rain, &self.light_caches, view, surroundings)))
    }

    /// [`Rain::drops`], with their diameters and opacities.
    fn export_particles(&self, view: &View, surroundings: &Surroundings) -> Option<PointCloud> {
        Some(raindrop::point_cloud(&self.rain.drops(view, surroundings), view.export_origin))
    }
}
