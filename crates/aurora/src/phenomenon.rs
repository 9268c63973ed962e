//! `impl Phenomenon`: how the renderer uses an aurora.

use std::sync::Arc;

use bansho_base::{
    parameters::BuildError,
    phenomenon::{
        Phenomenon, PhenomenonInfo, Remark, Run, SharedMemory, Stepping, strip::View, surroundings::OtherPhenomena,
    },
    tables::{BuildContext, PhenomenonTable, TableKind},
};

use super::{
    AuroraParameters, AuroraStage,
    model::{Aurora, OBLIQUE_LUMINANCE_FACTOR},
    parameters::Blur,
    render::{aovs::AOVS, emitted_light::SKY_LIGHTS, stages::WHITE_LUMINANCE},
    run::AuroraRun,
    shapes::ShapeErrorKind,
    simulate::AuroraSimulation,
};

impl AuroraParameters {
    /// The table `[[aurora]]`.
    pub const KIND: TableKind = TableKind {
        built_bytes: 75e3,
        placement_keys: &["shapes", "extent_km"],
        paper: Some(&crate::paper_settings::PAPER),
        first_keys: &[
            "flux_mw_per_m2",
            "energy_ev",
            "dip_deg",
            "time_lapse",
            "particles.count",
            "rays.contrast",
            "folds.amplitude_km",
        ],
        in_the_sky: true,
        // View from the ground toward the northern sky of a clear night, with the last of the twilight. With the airglow of a quiet night the sky is darker
        // than the curtains.
        scene_defaults: "\
        picture = { exposure_ev100 = -7.3, white_balance_k = 4000.0 }\n\
        camera = { position = [0.0, 1.7, 0.0], target = [0.0, 32.0, -57.0], vertical_fov_deg = 62.0 }\n\
        sky = { kind = \"night\", hills_deg = 6.0, hills_form = \"mountains\", night = { sun_elevation_deg = -14.5, sun_azimuth_deg = 180.0, airglow = 0.3, stars = 0.6, milky_way = 0.5 } }\n",
        ..TableKind::phenomenon::<Self>("aurora")
    };
}

impl PhenomenonTable for AuroraParameters {
    fn kind(&self) -> TableKind {
        Self::KIND
    }

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
        let sky_lights = if self.parameters.stage == AuroraStage::Light { SKY_LIGHTS } else { 0 };
        PhenomenonInfo { aovs: AOVS, stepping: Some(stepping), sky_lights, ..PhenomenonInfo::new(&self.name) }
    }

    fn memory_bytes(&self, pixels: f64) -> f64 {
        // Measured: the fields, the state and the sources of each particle, and the column buffers and the chart, which have up to 20 and 16 bytes for each pixel
        // of the sky; the latter is most of the picture only where the lens is a fisheye, whose aurora covers less of it.
        let particles = &self.parameters.particles;
        // By table 3.3 as printed the number of particles grows, up to threefold in the scenes of the thesis.
        let growth = if particles.relocation.enabled && !particles.relocation.scale_counts { 1.3 } else { 1.0 };
        let measured = 1.4e7 + 500.0 * growth * particles.count as f64 + 20.0 * pixels;
        // The picture before and after the second pass of the blur, with four values.
        let blur = if self.parameters.rendering.blur_space == Blur::Screen { 32.0 * pixels } else { 0.0 };
        measured + self.neighbor_list_bytes + blur
    }

    fn shared_memory(&self, _view: &View) -> Vec<SharedMemory> {
        // Measured: the tables of emission and of the spread of electrons.
        let rendering = &self.parameters.rendering;
        let key = (rendering.energy_deposition as u64) << 8 | self.parameters.spectrum as u64;
        vec![SharedMemory { key: ("emission tables of auroras", key), bytes: 1e7 }]
    }

    fn luminance(&self) -> f64 {
        if self.parameters.stage == AuroraStage::Light {
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
        Box::new(AuroraRun::new(self))
    }
}
