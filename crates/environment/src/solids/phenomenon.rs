//! `impl Phenomenon`: how the renderer uses visible obstacles.

use std::sync::Arc;

use bansho_base::{
    host::observer::{Cancelled, Observer},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Publication, Surroundings},
    },
};

use super::{
    model::Solids,
    pose::parts_of_exposure,
    trace::{PreparedSolids, UntracedSolids, depth_intervals},
};

impl Phenomenon for Solids {
    fn info(&self) -> PhenomenonInfo<'_> {
        PhenomenonInfo::new(Self::NAME)
    }

    /// Obstacles only reflect the light of others.
    fn luminance(&self) -> f64 {
        0.0
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for Solids {
    /// The solids themselves belong to the scene, so all phenomena have them already.
    fn publish(&self, shutter: Shutter) -> Publication {
        let shadow_casters = self.solids.iter().map(|solid| solid.obstacle.at(shutter.middle())).collect();
        Publication { shadow_casters, shadow_motion: self.longest_path(shutter), ..Publication::default() }
    }

    fn depth_intervals(&self, view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        depth_intervals(self, view)
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        Ok(Box::new(PreparedSolids::new(self, view, surroundings, observer)?))
    }

    fn parts_when_composited(&self, view: &View, _surroundings: &Surroundings) -> usize {
        parts_of_exposure(self, view)
    }

    fn prepare_part<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        Ok(Box::new(UntracedSolids::new(self, view, surroundings)))
    }
}
