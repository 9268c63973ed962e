//! `impl Phenomenon`: how the renderer uses an aurora.

use std::sync::Arc;

use bansho_base::{
    geometry::point_cloud::PointCloud,
    host::observer::{Cancelled, Observer},
    parameters::BuildError,
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Remark, Run, SnapshotError, Stepped, Stepping,
        editor_hints::{DraftLimit, EditorHints},
        kind::{BuildContext, Describe},
        strip::{DepthInterval, Shutter, View},
        surroundings::{OtherPhenomena, Publication, Surroundings},
    },
};

use super::{
    AuroraParameters, Stage,
    model::{Aurora, OBLIQUE_LUMINANCE_FACTOR},
    render::aovs::AOVS,
    shapes::ShapeErrorKind,
    simulate::AuroraSimulation,
};
use crate::{
    render::{
        prepared::{DEPTHS, PreparedAurora},
        shutter,
        stages::{self, PreparedStage, WHITE_LUMINANCE},
    },
    simulate::point_cloud::point_cloud,
};

impl Describe for AuroraParameters {
    const KEY: &'static str = "aurora";
    const PLACEMENT_KEYS: &'static [&'static str] = &["shapes", "extent_km"];
    const FIRST_KEYS: &'static [&'static str] = &[
        "flux_mw_per_m2",
        "energy_ev",
        "dip_deg",
        "time_lapse",
        "particles.count",
        "rays.contrast",
        "folds.amplitude_km",
    ];
    const EDITOR_HINTS: EditorHints =
        EditorHints { draft_limits: &[DraftLimit { key: "particles.count", max: 24_000 }], ..EditorHints::NONE };
    const IN_THE_SKY: bool = true;
    // View from the ground toward the northern sky of a clear night. With the airglow of a quiet night the sky is darker than the curtains.
    const SCENE_DEFAULTS: &'static str = "\
        picture = { exposure_ev100 = -6.9, white_balance_k = 4000.0 }\n\
        camera = { position = [0.0, 1.7, 0.0], target = [0.0, 32.0, -57.0], vertical_fov_deg = 62.0 }\n\
        sky = { kind = \"night\", hills_deg = 2.0, trees_deg = 1.1, night = { airglow = 0.3, stars = 0.6, milky_way = 0.5 } }\n";

    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError> {
        match Aurora::new(self.clone(), context.name, context.seed, context.loop_s, context.assets) {
            Ok(aurora) => Ok(Arc::new(aurora)),
            Err(error) => Err(match error.kind {
                ShapeErrorKind::Asset(asset_error) => BuildError { key: error.key, kind: asset_error.into() },
                other => BuildError::new(error.key, other),
            }),
        }
    }
}

impl Phenomenon for Aurora {
    fn info(&self) -> PhenomenonInfo<'_> {
        let preroll = self.parameters.preroll_s;
        let stepping = Stepping { step: AuroraSimulation::STEP_S, preroll, crossfade: self.crossfade_s };
        PhenomenonInfo { aovs: AOVS, stepping: Some(stepping), ..PhenomenonInfo::new(&self.name) }
    }

    fn memory_bytes(&self, pixels: f64) -> f64 {
        // Measured: tables, the state and the sources of each particle, and the chart, which has up to a cell of 16 bytes for each pixel of the sky.
        4e7 + 480.0 * self.parameters.particles.count as f64 + 8.0 * pixels
    }

    fn luminance(&self) -> f64 {
        if self.parameters.stage == Stage::Light {
            OBLIQUE_LUMINANCE_FACTOR * self.max_column_luminance
        } else {
            WHITE_LUMINANCE
        }
    }

    fn remark(&self, _neighbors: &OtherPhenomena) -> Option<Remark> {
        let shape = self.crossing?;
        let message = format!(
            "its sheets pass through each other on the way to shape {}; another shape between, `link`, or sheets in another order would keep \
             them apart",
            shape + 1
        );
        Some(Remark::at(format!("shapes.{shape}"), message))
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        // A run copies the shared initial state when it is first stepped or drawn: remarks start hundreds of runs that never are.
        Box::new((*self).clone())
    }
}

impl Run for Aurora {
    fn publish(&self, _shutter: Shutter) -> Publication {
        if self.parameters.stage != Stage::Light {
            return Publication::default();
        }
        Publication { lights: self.directional_light().into_iter().collect(), ..Publication::default() }
    }

    fn depth_intervals(&self, _view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        vec![if self.parameters.stage == Stage::Light { DEPTHS } else { stages::DEPTHS }]
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        _surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        match self.parameters.stage {
            Stage::Light => Ok(Box::new(PreparedAurora::new(self, view, observer)?)),
            stage => Ok(Box::new(PreparedStage::new(self, stage, view))),
        }
    }

    fn export(&self, view: &View, _surroundings: &Surroundings) -> Option<PointCloud> {
        let t = view.shutter.middle();
        let step = AuroraSimulation::STEP_S;
        if t - self.simulation().time() <= step {
            return Some(point_cloud(self.simulation().particles(), t - self.simulation().time()));
        }
        // Within a long exposure, `t` may be many steps after the state.
        let mut simulation = self.simulation().clone();
        shutter::step_until(&mut simulation, t);
        Some(point_cloud(simulation.particles(), t - simulation.time()))
    }

    fn as_stepped(&self) -> Option<&dyn Stepped> {
        Some(self)
    }

    fn as_stepped_mut(&mut self) -> Option<&mut dyn Stepped> {
        Some(self)
    }
}

impl Stepped for Aurora {
    fn step(&mut self, _time: f64, _surroundings: &Surroundings) {
        if let Some(simulation) = self.simulation_mut() {
            simulation.step();
        }
    }

    fn time_for(&self, shutter: Shutter) -> f64 {
        if shutter::is_long(shutter) { shutter.open } else { shutter.middle() }
    }

    fn snapshot(&self) -> Vec<u8> {
        self.simulation().snapshot()
    }

    fn restore(&mut self, state: &[u8]) -> Result<(), SnapshotError> {
        self.simulation_mut().map_or(Err(SnapshotError::NoState), |simulation| simulation.restore(state))
    }
}
