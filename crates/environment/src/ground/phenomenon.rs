//! `impl Phenomenon`: how the renderer uses the ground.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    host::observer::{Cancelled, Observer, check},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Backdrop, Occluder, Publication, Surroundings},
    },
};

use super::{
    GroundKind,
    hits::{HORIZON, RowDepths},
    lake_reflection,
    lighting::GroundLight,
    model::Ground,
    row_cache::LightInputs,
    sample::SampledImage,
    shade::PreparedGround,
};

/// Height of the ground among what others publish, m: that of the highest level half space.
pub(crate) fn height_of_level_ground(occluders: &[Occluder]) -> Option<f64> {
    let heights = occluders.iter().filter_map(|solid| match solid {
        Occluder::HalfSpace { point, normal } if normal.y > 0.999 => Some(point.y),
        _ => None,
    });
    heights.max_by(f64::total_cmp)
}

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
        vec![DepthInterval { near: 0.0, far: HORIZON }]
    }

    fn exposure_parts(&self, view: &View, surroundings: &Surroundings) -> usize {
        self.parts_of_exposure(view, surroundings)
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
        let lake = self.lake(view, surroundings);
        let slope = self.surface.mean_slope();
        let backdrop = surroundings.backdrop.map(|Backdrop { image, pixel_size }| {
            let sharp = SampledImage { image, pixel_size: *pixel_size, first_row: 0 };
            Backdrop { image: lake_reflection::blurred_reflection(sharp, view, slope), pixel_size: *pixel_size }
        });
        let others = &surroundings.others;
        let light = LightInputs {
            wetness,
            lights: others.lights.clone(),
            shadow_casters: others.shadow_casters.clone(),
            sky: surroundings.sky,
            backdrop: backdrop.as_ref().map(|backdrop| backdrop.image.clone()),
        };
        let has_film = wetness > 0.0 && lake.is_none();
        let camera_height = view.camera.position.y - self.parameters.height;
        Ok(Box::new(PreparedGround {
            parameters: &self.parameters,
            surface: &self.surface,
            view,
            surroundings,
            wetness,
            camera_height,
            row_depths: RowDepths::new(view, camera_height),
            lights: others.lights.iter().map(|light| GroundLight::new(light, view.camera.position)).collect(),
            night_sky: OnceLock::new(),
            has_film,
            lake,
            backdrop,
            known_rows: self.known_rows.rows(view, has_film, light),
        }))
    }
}
