//! `impl Phenomenon`: how the renderer uses the ground.

use std::sync::Arc;

use bansho_base::{
    host::observer::{Cancelled, Observer, check},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Backdrop, Occluder, Publication, Surroundings},
    },
};

use super::{GroundKind, lake_reflection, model::Ground, shade, shade::PreparedGround};

impl Phenomenon for Ground {
    fn info(&self) -> PhenomenonInfo<'_> {
        let dry = self.parameters.wetness.constant() == Some(0.0) && self.parameters.kind != GroundKind::Water;
        PhenomenonInfo { mirror: (!dry).then(|| self.parameters.mirror()), ..PhenomenonInfo::new(Self::NAME) }
    }

    /// The ground only reflects the light of others.
    fn luminance(&self) -> f64 {
        0.0
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for Ground {
    fn publish(&self, _shutter: Shutter) -> Publication {
        let point = bansho_base::math::DVec3::new(0.0, self.parameters.height, 0.0);
        let half_space = Occluder::HalfSpace { point, normal: bansho_base::math::DVec3::Y };
        Publication { occluders: vec![half_space], ..Publication::default() }
    }

    fn depth_intervals(&self, _view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        vec![DepthInterval { near: 0.0, far: shade::HORIZON }]
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        check(observer)?;
        let wetness = match self.parameters.kind {
            GroundKind::Water => 1.0,
            GroundKind::Land | GroundKind::Plate => self.parameters.wetness.at(view.shutter.middle()),
        };
        Ok(Box::new(PreparedGround {
            parameters: &self.parameters,
            surface: &self.surface,
            view,
            surroundings,
            wetness,
            lake: self.lake(view, surroundings),
            backdrop: surroundings.backdrop.map(|sharp| Backdrop {
                image: lake_reflection::blurred_reflection(
                    &sharp.image,
                    sharp.pixel_size,
                    view,
                    self.surface.mean_slope(),
                ),
                pixel_size: sharp.pixel_size,
            }),
        }))
    }
}
