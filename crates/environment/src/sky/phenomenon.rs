//! `impl Phenomenon`: how the renderer uses the sky.

use std::sync::Arc;

use bansho_base::{
    color,
    host::observer::{Cancelled, Observer},
    math::DVec3,
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run,
        strip::{DepthInterval, Shutter, View, parts_of_motion},
        surroundings::{Publication, Surroundings},
    },
};

use super::{model::SkyBackdrop, render::PreparedSky, row_cache::FAR};

impl Phenomenon for SkyBackdrop {
    fn info(&self) -> PhenomenonInfo<'_> {
        PhenomenonInfo::new(Self::NAME)
    }

    fn luminance(&self) -> f64 {
        f64::from(color::luminance(self.parameters.at(0.0).radiance(DVec3::Y)))
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for SkyBackdrop {
    fn publish(&self, _shutter: Shutter) -> Publication {
        Publication::default()
    }

    fn depth_intervals(&self, _view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        if self.parameters.hills_deg > 0.0 || self.parameters.trees_deg > 0.0 {
            vec![self.hills(), FAR]
        } else {
            vec![FAR]
        }
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        let sky = surroundings.sky;
        // 16 in usual exposures.
        let cameras = view.cameras_at_most(0.5 * view.shutter.max_parts() as f64);
        let cache = self.cache(&sky, view, &cameras);
        Ok(Box::new(PreparedSky { view, cameras, sky, cache, skyline: self.skyline(), hills: self.hills() }))
    }

    /// By day only the skyline is seen to move.
    fn parts_when_composited(&self, view: &View, surroundings: &Surroundings) -> usize {
        let has_skyline = self.parameters.hills_deg > 0.0 || self.parameters.trees_deg > 0.0;
        if has_skyline || surroundings.sky.night().is_some() {
            parts_of_motion(view.motion_pixels(), 1.0, view.shutter.max_parts())
        } else {
            1
        }
    }

    fn prepare_part<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        let (sky, cameras) = (surroundings.sky, vec![view.camera]);
        let cache = self.night_sky(&sky, view, &cameras);
        Ok(Box::new(PreparedSky { view, cameras, sky, cache, skyline: self.skyline(), hills: self.hills() }))
    }
}
