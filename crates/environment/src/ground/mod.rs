//! A level ground: lit by lamps, fires and sky, dry or wet, or a lake.
//!
//! Not one of the four methods: what they stand on. Wet ground mirrors everything in the scene, through a picture that the renderer draws
//! with a camera behind the mirror ([`Surroundings::reflection`]).

mod lake_reflection;
mod parameters;
mod shade;
mod surface;
mod waves;
mod wet_reflection;

use std::sync::Arc;

use bansho_base::{
    host::observer::{Cancelled, Observer, check},
    image::Image,
    math::{DVec2, random::Key},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Backdrop, Occluder, Publication, Surroundings},
    },
};

use self::{shade::PreparedGround, surface::Surface, waves::Waves};

pub use parameters::{GroundKind, GroundParameters};

/// The ground of a scene.
pub struct Ground {
    parameters: GroundParameters,
    surface: Surface,
    key: Key,
    loop_s: Option<f64>,
}

impl Ground {
    /// The name of its layer.
    pub const NAME: &str = "ground";

    /// A ground with these parameters.
    pub fn new(parameters: GroundParameters, seed: u64, loop_s: Option<f64>) -> Self {
        let key = Key::new(seed, Self::NAME);
        Self { surface: Surface::new(&parameters, key), parameters, key, loop_s }
    }

    /// The lake, if that is what it is.
    fn lake(&self, view: &View, surroundings: &Surroundings) -> Option<Lake> {
        let parameters = &self.parameters;
        let sharp = surroundings.reflection.filter(|_| parameters.kind == GroundKind::Water)?;
        let t = view.shutter.middle();
        let wind = surroundings.wind.mean(t);
        let heading = DVec2::new(wind.x, wind.z).try_normalize().unwrap_or(DVec2::X);
        let waves = Waves::new(self.key, parameters.waves, parameters.wave_length, heading, t, self.loop_s);
        Some(Lake { waves, rough: lake_reflection::rough(sharp, 1, view, parameters.waves) })
    }
}

/// One frame of a lake.
struct Lake {
    waves: Waves,
    /// What is mirrored by waves too short to be seen.
    rough: Image<4>,
}

impl Phenomenon for Ground {
    fn info(&self) -> PhenomenonInfo<'_> {
        let dry = self.parameters.wetness.constant() == Some(0.0) && self.parameters.kind != GroundKind::Water;
        PhenomenonInfo { mirror: (!dry).then(|| self.parameters.level()), ..PhenomenonInfo::new(Self::NAME) }
    }

    /// It only shows the light of others.
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
        let solid = Occluder::HalfSpace { point, normal: bansho_base::math::DVec3::Y };
        Publication { occluders: vec![solid], ..Publication::default() }
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
                image: lake_reflection::rough(&sharp.image, sharp.side, view, self.surface.mean_slope()),
                side: sharp.side,
            }),
        }))
    }
}

#[cfg(test)]
mod tests;
