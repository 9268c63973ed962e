//! The table `[fog]` with its parameters, and how the renderer uses fog (`impl Phenomenon`).

use std::sync::Arc;

use bansho_base::{
    host::observer::{Cancelled, Observer, check},
    parameters::{Range, animated::Animated},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run, SharedMemory,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Publication, Surroundings},
    },
    tables::{BuildContext, BuiltTable, SharedRole, SharedTable, TableCount, TableKind},
};

use super::{
    render::PreparedFog,
    row_cache::{self, FogCache},
    scattering,
};

/// The fog of a scene.
pub struct Fog {
    /// Meteorological visibility, m.
    visibility_m: Animated<f64>,
    cache: FogCache,
}

impl Fog {
    /// The name of its layer.
    pub const NAME: &str = "fog";

    /// Fog of a meteorological visibility in m.
    pub fn new(visibility_m: Animated<f64>) -> Self {
        Self { visibility_m, cache: FogCache::default() }
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

    /// The rows that are kept from frame to frame, for all frames that are drawn at once.
    fn shared_memory(&self, view: &View) -> Vec<SharedMemory> {
        vec![SharedMemory { key: ("rows of fog", 0), bytes: row_cache::estimated_bytes(view) }]
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
        Ok(Box::new(PreparedFog::new(extinction, view, surroundings, &self.cache)))
    }
}

bansho_base::parameters! {
    /// Fog, everywhere above the ground: it dims what is far, and is lit by the sky, lamps and fires. Over a plate it needs the plate's depth, since a plate
    /// without depth is infinitely far away.
    pub struct FogParameters {
        /// Meteorological visibility: the distance at which a black object has 2 % contrast against the horizon. Below 1000 it is called fog, 1000 to 5000 mist,
        /// above haze.
        visibility_m: Animated<f64> = Animated::from(500.0), limits(Range::new(1.0, 1e6)), unit("m");
    }
}

impl FogParameters {
    /// The table `[fog]`. It is drawn before all other shared tables: within a slice, it is in front of their surfaces.
    pub const KIND: TableKind = TableKind {
        layer: Some(Fog::NAME),
        ..TableKind::shared::<Self>(
            "fog",
            TableCount::Optional,
            SharedRole { draw: Some(draw), draw_order: 0, fingerprint_order: 50, ..SharedRole::new::<Self>() },
        )
    };
}

impl SharedTable for FogParameters {
    fn kind(&self) -> TableKind {
        Self::KIND
    }

    /// Endless fog hides everything, so that a picture with fog is opaque.
    fn fills_background(&self) -> bool {
        true
    }

    fn extinction(&self, t: f64) -> f64 {
        scattering::extinction(self.visibility_m.at(t))
    }
}

fn draw(tables: &[BuiltTable], _context: &BuildContext) -> Arc<dyn Phenomenon> {
    let parameters: FogParameters = BuiltTable::first_or_default(tables);
    Arc::new(Fog::new(parameters.visibility_m))
}
