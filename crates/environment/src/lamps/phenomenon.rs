//! `impl Phenomenon`: how the renderer uses lamps.

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
    model::Lamps,
    render::{Disc, PreparedLamps, has_glare, project_lamp},
};

impl Phenomenon for Lamps {
    fn info(&self) -> PhenomenonInfo<'_> {
        PhenomenonInfo::new(Self::NAME)
    }

    /// Lamps do not affect the automatic exposure: they are far brighter than the surfaces that they light.
    fn luminance(&self) -> f64 {
        0.0
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for Lamps {
    /// The lights belong to the scene, so all phenomena have them already.
    fn publish(&self, _shutter: Shutter) -> Publication {
        Publication::default()
    }

    fn depth_intervals(&self, view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        let mut intervals = Vec::new();
        for lamp in (self.at)(view.shutter.middle()) {
            let Some(disc) = project_lamp(&lamp, view) else { continue };
            // Glare arises in the lens, in front of everything.
            let near = if has_glare(view) { 0.0 } else { disc.depth };
            intervals.push(DepthInterval { near, far: disc.depth.next_up() });
        }
        intervals
    }

    fn exposure_parts(&self, view: &View, _surroundings: &Surroundings) -> usize {
        self.parts_of_exposure(view)
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        _surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        let lamps = (self.at)(view.shutter.middle());
        let mut discs: Vec<Disc> = lamps.iter().filter_map(|lamp| project_lamp(lamp, view)).collect();
        discs.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        Ok(Box::new(PreparedLamps { view, discs }))
    }
}
