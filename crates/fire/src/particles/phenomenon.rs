//! `impl Phenomenon` for the particle flame.

use std::sync::Arc;

use bansho_base::{
    color,
    image::Rect,
    math::{self, DVec3},
    parameters::BuildError,
    phenomenon::{Phenomenon, PhenomenonInfo, Remark, Run, Stepping, strip::View, surroundings::OtherPhenomena},
    tables::{BuildContext, PhenomenonTable, TableKind},
};

use super::{
    error::ParticleErrorKind,
    model::FlameParticles,
    parameters::{
        BurnerParameters, CombustionParameters, FlameParticlesParameters, FluidParameters, ForceParameters, GasModel,
        TemperatureLaw,
    },
    render::{self, SpriteStyle},
    run::FlameParticlesRun,
};
use crate::{
    GAS_FLOW, POSITION,
    particles::simulate::{
        burner::Burner,
        derived::{BYTES_PER_PARTICLE, DerivedConstants, check_particle_count},
    },
    picture_bounds,
};

impl FlameParticlesParameters {
    /// The same parameters with a list of burners that is not empty.
    fn with_stated_burners(&self) -> Self {
        let mut stated = self.clone();
        if stated.burners.is_empty() {
            stated.burners.push(BurnerParameters::default());
        }
        stated
    }

    /// Moves the burners, so that the first is at `position`. Gas that burns already stays where it is.
    fn move_burners(&mut self, position: DVec3) {
        let first = self.burners.first().map_or(DVec3::ZERO, last_position);
        let displacement = position - DVec3::from(self.position) - first;
        for burner in &mut self.burners {
            burner.position = (last_position(burner) + displacement).to_array().into();
        }
    }
}

/// Where a burner stays after it has moved, relative to the flame, m.
fn last_position(burner: &BurnerParameters) -> DVec3 {
    burner.position.values().last().map_or(DVec3::ZERO, |last| DVec3::from(*last))
}

impl FlameParticlesParameters {
    /// The table `[[flame_particles]]`.
    pub const KIND: TableKind = TableKind {
        placement_keys: &["position", "burners", "domain_min", "domain_max"],
        paper: Some(&super::paper_settings::PAPER),
        first_keys: &[
            "position",
            "particles",
            "forces.turbulence",
            "combustion.soot_ppm",
            "combustion.smoke_fraction",
            "burners.diameter",
            "burners.heat_release_kw",
        ],
        scene_defaults: "\
        camera = { position = [0.0, 0.9, 3.8], target = [0.0, 0.9, 0.0] }\n\
        wind = { velocity = [0.25, 0.0, 0.0], gust = 0.8 }\n",
        ..TableKind::phenomenon::<Self>("flame_particles")
    };
}

impl PhenomenonTable for FlameParticlesParameters {
    fn kind(&self) -> TableKind {
        Self::KIND
    }

    fn check_particle_budget(&self, others: i64) -> Result<i64, BuildError> {
        check_particle_count(self.particles, others).map_err(|error| BuildError::new(error.key, error.kind))?;
        Ok(self.particles + others)
    }

    fn with_quantity(&self, quantity: &str, value: &[f64]) -> Option<Arc<dyn PhenomenonTable>> {
        let mut changed = self.with_stated_burners();
        match (quantity, value) {
            (GAS_FLOW, &[flow]) => changed.burners.iter_mut().for_each(|burner| burner.flow = flow.into()),
            (POSITION, &[x, y, z]) => changed.move_burners(DVec3::new(x, y, z)),
            _ => return None,
        }
        Some(Arc::new(changed))
    }

    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError> {
        match FlameParticles::new(self.clone(), context.name, context.seed, context.loop_s, context.assets) {
            Ok(flame) => Ok(Arc::new(flame)),
            Err(error) => Err(match error.kind {
                ParticleErrorKind::Asset(asset_error) => BuildError { key: error.key, kind: asset_error.into() },
                other => BuildError::new(error.key, other),
            }),
        }
    }
}

impl Phenomenon for FlameParticles {
    fn info(&self) -> PhenomenonInfo<'_> {
        let DerivedConstants { preroll, crossfade, .. } = self.constants.derived;
        let stepping = Stepping { step: self.parameters().step_s, preroll, crossfade };
        let refracts = self.parameters().rendering.heat_haze_gain > 0.0;
        PhenomenonInfo { aovs: render::AOVS, stepping: Some(stepping), refracts, ..PhenomenonInfo::new(&self.name) }
    }

    fn memory_bytes(&self, pixels: f64) -> f64 {
        // Measured: what is fixed, the particles, and the grids of the picture.
        1e6 + BYTES_PER_PARTICLE * self.parameters().particles as f64 + 44.0 * pixels
    }

    /// Around each burner the flame, which sways by about a quarter of its height, and the hot gas above it.
    fn picture_bounds(&self, view: &View) -> Rect {
        let origin = DVec3::from(self.parameters().position);
        let boxes = self.constants.derived.burners.iter().map(|burner| {
            let [first, last] = burner.parameters.position.bounds().map(|position| origin + DVec3::from(position));
            let around = burner.bounding_radius + 0.25 * burner.height;
            [first - around, last + DVec3::new(around, burner.bounding_radius + 2.0 * burner.height, around)]
        });
        picture_bounds::of_boxes(view, boxes)
    }

    fn luminance(&self) -> f64 {
        /// Mean luminance of the bright parts, relative to a uniform flame with soot of the highest temperature.
        const BRIGHT_PARTS: f64 = 0.09;
        let hottest = match (self.parameters().gas_model, self.parameters().combustion.temperature_model) {
            (GasModel::Combustion, TemperatureLaw::Simulated) => self.parameters().combustion.flame_temperature_k,
            (GasModel::Euler, _) | (_, TemperatureLaw::Constant) => self.tallest_burner().parameters.temperature_k,
        };
        let black_body = f64::from(color::luminance(color::black_body().radiance(hottest as f32)));
        let absorption =
            render::soot_absorption(self.parameters().combustion.soot_ppm * 1e-6, &self.parameters().rendering);
        let emissivity = match self.parameters().rendering.sprite {
            SpriteStyle::LineIntegral => -math::exp_m1(-absorption * 0.5 * self.tallest_burner().diameter),
            SpriteStyle::Poly6 | SpriteStyle::Squares => 1.0,
        };
        BRIGHT_PARTS * black_body * emissivity
    }

    fn exposed_luminance(&self) -> f64 {
        crate::EXPOSED_LUMINANCE
    }

    fn remark(&self, neighbors: &OtherPhenomena) -> Option<Remark> {
        let burners = &self.constants.derived.burners;
        if !burners.iter().any(Burner::emits_gas) {
            return Some(Remark::new("none of its burners emits gas; set a `flow` above 0"));
        }
        if let Some(key) = table_without_effect(self.parameters()) {
            return Some(Remark::at(key, format!("`{key}` sets something without effect; {EULER_KEYS}")));
        }
        let index =
            burners.iter().position(|burner| burner.emits_gas() && self.is_inside_obstacle(burner, neighbors))?;
        let message = format!("its burner {} is inside an obstacle, so that its gas cannot escape", index + 1);
        Some(Remark::at(format!("burners.{index}"), message))
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(FlameParticlesRun::new(self))
    }
}

impl FlameParticles {
    /// Whether a burner lies inside obstacles at time 0, judged by 32 random spawn points, which represent its whole surface.
    fn is_inside_obstacle(&self, burner: &Burner, neighbors: &OtherPhenomena) -> bool {
        let origin = DVec3::from(self.parameters().position);
        (0..32).all(|id| {
            let position = origin + burner.spawn_point(self.constants.key, id, 0.0).position;
            neighbors.occluders().any(|occluder| occluder.signed_distance(position) < 0.0)
        })
    }
}

/// What of the tables below has an effect on the paper's gas.
const EULER_KEYS: &str = "with `gas_model = \"euler\"` only these have one: `support_radius`, `rest_density`, `stiffness`, \
     `pressure_kernel` and `negative_pressure` of `fluid`, `wind_response` of `forces`, `soot_ppm` of `combustion`";

/// Key of the first table of the paper's gas that sets something without effect.
fn table_without_effect(parameters: &FlameParticlesParameters) -> Option<&'static str> {
    let FlameParticlesParameters { gas_model, fluid, forces, combustion, .. } = parameters;
    let FluidParameters { viscosity, conduction, max_substeps, .. } = FluidParameters::default();
    let ForceParameters { wind_response, wind_model, .. } = *forces;
    let tables = [
        ("fluid", *fluid != FluidParameters { viscosity, conduction, max_substeps, ..fluid.clone() }),
        // Its wind is the model `body_force`, which may be stated.
        ("forces", *forces != ForceParameters { wind_response, wind_model, ..ForceParameters::default() }),
        (
            "combustion",
            *combustion != CombustionParameters { soot_ppm: combustion.soot_ppm, ..CombustionParameters::default() },
        ),
    ];
    tables.into_iter().find(|(_, differs)| *gas_model == GasModel::Euler && *differs).map(|(key, _)| key)
}
