//! `impl Phenomenon` for the volume flame.

use std::sync::Arc;

use bansho_base::{
    color,
    math::{self, DVec3},
    parameters::BuildError,
    phenomenon::{Phenomenon, PhenomenonInfo, Remark, Run, Stepping, surroundings::OtherPhenomena},
    tables::{BuildContext, PhenomenonTable, TableKind},
};

use super::{
    error::VolumeErrorKind,
    model::FlameVolume,
    parameters::{FlameVolumeParameters, VolumeBurnerParameters},
    render::prepared::AOVS,
    run::FlameVolumeRun,
    simulate::domain::BYTES_PER_CELL,
};
use crate::{
    GAS_FLOW, POSITION,
    particles::{ParticleErrorKind, render::VISIBLE_SOOT_ABSORPTION},
};

impl FlameVolumeParameters {
    /// The table `[[flame_volume]]`.
    pub const KIND: TableKind = TableKind {
        placement_keys: &["position", "burners", "domain_min", "domain_max"],
        first_keys: &["position", "fuel", "quality", "gas.smoke_yield", "burners.diameter", "burners.heat_release_kw"],
        scene_defaults: "\
        camera = { position = [0.0, 0.6, 3.0], target = [0.0, 0.6, 0.0] }\n\
        wind = { velocity = [0.1, 0.0, 0.0], gust = 0.5 }\n",
        ..TableKind::phenomenon::<Self>("flame_volume")
    };

    /// The same parameters with a list of burners that is not empty.
    fn with_stated_burners(&self) -> Self {
        let mut stated = self.clone();
        if stated.burners.is_empty() {
            stated.burners.push(VolumeBurnerParameters::default());
        }
        stated
    }
}

impl PhenomenonTable for FlameVolumeParameters {
    fn kind(&self) -> TableKind {
        Self::KIND
    }

    fn with_quantity(&self, quantity: &str, value: &[f64]) -> Option<Arc<dyn PhenomenonTable>> {
        let mut changed = self.with_stated_burners();
        match (quantity, value) {
            (GAS_FLOW, &[flow]) => changed.burners.iter_mut().for_each(|burner| burner.flow = flow.into()),
            (POSITION, &[x, y, z]) => changed.position = [x, y, z],
            _ => return None,
        }
        Some(Arc::new(changed))
    }

    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError> {
        match FlameVolume::new(self.clone(), context.name, context.seed, context.loop_s, context.assets) {
            Ok(flame) => Ok(Arc::new(flame)),
            Err(error) => Err(match error.kind {
                VolumeErrorKind::Burner(ParticleErrorKind::Asset(asset)) => {
                    BuildError { key: error.key, kind: asset.into() }
                }
                other => BuildError::new(error.key, other),
            }),
        }
    }
}

impl Phenomenon for FlameVolume {
    fn info(&self) -> PhenomenonInfo<'_> {
        let stepping = Stepping { step: self.parameters().step_s, preroll: self.preroll, crossfade: self.crossfade };
        let refracts = self.parameters().rendering.heat_haze_gain > 0.0;
        PhenomenonInfo { aovs: AOVS, stepping: Some(stepping), refracts, ..PhenomenonInfo::new(&self.name) }
    }

    fn memory_bytes(&self, pixels: f64) -> f64 {
        1e6 + BYTES_PER_CELL * 8.0 * self.constants.coarse_grid.cells() as f64 + 24.0 * pixels
    }

    fn luminance(&self) -> f64 {
        /// Optical depth of a sheet, over that of soot of the largest fraction over the characteristic diameter.
        const SHEET: f64 = 0.08;
        let fuel = &self.constants.fuel;
        // What the soot has lost by the time at which it is seen.
        let kelvin = fuel.flame_temperature_k - 0.8 * fuel.radiant_fraction * (fuel.flame_temperature_k - 293.0);
        let black_body = f64::from(color::luminance(color::black_body().radiance(kelvin as f32)));
        let absorption = fuel.soot_ppm * 1e-6 * VISIBLE_SOOT_ABSORPTION * self.parameters().rendering.soot_gain;
        black_body * -math::exp_m1(-absorption * SHEET * self.constants.size.characteristic_diameter)
    }

    fn exposed_luminance(&self) -> f64 {
        crate::EXPOSED_LUMINANCE
    }

    fn remark(&self, neighbors: &OtherPhenomena) -> Option<Remark> {
        let burners = &self.constants.burners;
        if burners.iter().all(|burner| burner.largest_flow <= 0.0) {
            return Some(Remark::new("none of its burners emits gas; set a `flow` above 0"));
        }
        let origin = DVec3::from(self.parameters().position);
        let index = burners.iter().position(|burner| {
            let corners = burner.extent();
            let inside = |point: DVec3| {
                neighbors
                    .occluders()
                    .any(|occluder| occluder.signed_distance(origin + point) < -self.constants.coarse_grid.spacing)
            };
            inside(0.5 * (corners[0] + corners[1])) && corners.into_iter().all(inside)
        })?;
        let message = format!("its burner {} is inside an obstacle, so that its gas cannot escape", index + 1);
        Some(Remark::at(format!("burners.{index}"), message))
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(FlameVolumeRun::new(self))
    }
}
