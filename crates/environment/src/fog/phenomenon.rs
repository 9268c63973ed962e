//! `impl Phenomenon`: how the renderer uses fog.

use std::sync::Arc;

use bansho_base::{
    host::observer::{Cancelled, Observer, check},
    parameters::animated::Animated,
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Publication, Surroundings},
    },
};

use super::{render::PreparedFog, scattering};

/// The fog of a scene.
pub struct Fog {
    /// Meteorological visibility, m.
    visibility_m: Animated<f64>,
}

impl Fog {
    /// The name of its layer.
    pub const NAME: &str = "fog";

    /// Fog of a meteorological visibility in m.
    pub fn new(visibility_m: Animated<f64>) -> Self {
        Self { visibility_m }
    }
}

impl Phenomenon for Fog {
    fn info(&self) -> PhenomenonInfo<'_> {
        PhenomenonInfo::new(Self::NAME)
    }

    /// Fog emits no light.
    fn luminance(&self) -> f64 {
        0.0
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for Fog {
    /// The extinction belongs to the scene, so all phenomena have it already.
    fn publish(&self, _shutter: Shutter) -> Publication {
        Publication::default()
    }

    fn depth_intervals(&self, _view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        vec![DepthInterval::ALL]
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        check(observer)?;
        let extinction = scattering::extinction(self.visibility_m.at(view.shutter.middle()));
        Ok(Box::new(PreparedFog::new(extinction, view, surroundings)))
    }
}
