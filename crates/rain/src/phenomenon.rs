//! `impl Phenomenon`: how the renderer uses rain.

use std::sync::Arc;

use bansho_base::{
    parameters::BuildError,
    phenomenon::{Phenomenon, PhenomenonInfo, Remark, Run, surroundings::OtherPhenomena},
    tables::{BuildContext, PhenomenonTable, TableKind},
};

use super::{model::Rain, parameters::RainParameters, run::RainRun};
use crate::aovs::AOVS;

impl RainParameters {
    /// The table `[[rain]]`.
    pub const KIND: TableKind = TableKind {
        paper: Some(&crate::paper_settings::PAPER),
        first_keys: &["rate_mm_per_h", "distance", "airlight_distance", "splashes.fraction"],
        // Lamps at dusk along a wet street: drops only scatter the light of others.
        scene_defaults: "\
        camera = { position = [0.4, 1.3, 4.2], target = [0.0, 1.25, 0.0], vertical_fov_deg = 34.0 }\n\
        sky = { luminance = 0.12, temperature_k = 10000.0 }\n\
        ground = { wetness = 0.9, puddles = 0.4 }\n\
        light = [\
        { visible = true, position = [-1.3, 2.3, -1.5], intensity = 120.0, color = [1.0, 0.68, 0.36] }, \
        { visible = true, position = [2.4, 2.3, -9.0], intensity = 120.0, color = [1.0, 0.68, 0.36] }, \
        { visible = true, position = [-4.6, 2.3, -17.0], intensity = 120.0, color = [1.0, 0.68, 0.36] }]\n",
        ..TableKind::phenomenon::<Self>("rain")
    };
}

impl PhenomenonTable for RainParameters {
    fn kind(&self) -> TableKind {
        Self::KIND
    }

    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError> {
        match Rain::new(self.clone(), context.name, context.seed, context.loop_s) {
            Ok(rain) => Ok(Arc::new(rain)),
            Err(error) => Err(BuildError::new(error.key, error.kind)),
        }
    }
}

impl Phenomenon for Rain {
    fn info(&self) -> PhenomenonInfo<'_> {
        let strengthened_by = "raise `rate_mm_per_h` or `opacity_gain`, add a [[light]] of more candela";
        PhenomenonInfo { aovs: AOVS, strengthened_by, ..PhenomenonInfo::new(&self.name) }
    }

    fn memory_bytes(&self, pixels: f64) -> f64 {
        // Measured: what is fixed; the streaks, cells and tiles of the picture; and the light that drops scatter before each tile, which is as much where
        // there are lamps.
        4e5 + 8.5 * pixels
    }

    /// Rain emits no light.
    fn luminance(&self) -> f64 {
        0.0
    }

    fn remark(&self, neighbors: &OtherPhenomena) -> Option<Remark> {
        let unlit = neighbors.sky.is_dark()
            && neighbors.lights().all(|light| light.intensity.iter().all(|value| *value <= 0.0));
        let message = "nothing lights it, so it is drawn black; add a [[light]], a [sky] or a fire";
        unlit.then(|| Remark { unless_lit_later: true, ..Remark::new(message) })
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(RainRun::new(self))
    }
}
