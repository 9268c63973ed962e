//! The table `[[obstacle]]`, and how the renderer uses visible obstacles (`impl Phenomenon`).

use std::{any::Any, sync::Arc};

use bansho_base::{
    host::{
        assets::Assets,
        observer::{Cancelled, Observer},
    },
    parameters::BuildError,
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run, SharedMemory,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Publication, Surroundings},
    },
    tables::{BuildContext, BuiltTable, SharedObject, SharedRole, SharedTable, TableCount, TableKind},
    world::occluder::Occluder,
};

use super::{
    Obstacle, ObstacleParameters, ObstacleShape, Solids,
    pose::parts_of_exposure,
    trace::{PreparedSolids, UntracedSolids, depth_intervals, picture_bounds},
    trace_cache,
};

impl Phenomenon for Solids {
    fn info(&self) -> PhenomenonInfo<'_> {
        PhenomenonInfo::new(Self::NAME)
    }

    /// Obstacles only reflect the light of others.
    fn luminance(&self) -> f64 {
        0.0
    }

    /// The pixels that are kept from frame to frame, for all frames that are drawn at once.
    fn shared_memory(&self, view: &View) -> Vec<SharedMemory> {
        let bytes = trace_cache::estimated_bytes(view, picture_bounds(self, view));
        vec![SharedMemory { key: ("pixels of obstacles", 0), bytes }]
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for Solids {
    /// The solids themselves belong to the scene, so all phenomena have them already.
    fn publish(&self, shutter: Shutter) -> Publication {
        let shadow_casters = self.solids.iter().map(|solid| solid.obstacle.at(shutter.middle())).collect();
        Publication { shadow_casters, shadow_motion: self.longest_path(shutter), ..Publication::default() }
    }

    fn depth_intervals(&self, view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        depth_intervals(self, view)
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        Ok(Box::new(PreparedSolids::new(self, view, surroundings, observer)?))
    }

    fn parts_when_composited(&self, view: &View, _surroundings: &Surroundings) -> usize {
        parts_of_exposure(self, view)
    }

    fn prepare_part<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        Ok(Box::new(UntracedSolids::new(self, view, surroundings)))
    }
}

impl ObstacleParameters {
    /// The table `[[obstacle]]`.
    pub const KIND: TableKind = TableKind {
        layer: Some(Solids::NAME),
        ..TableKind::shared::<Self>(
            "obstacle",
            TableCount::List,
            SharedRole {
                draw: Some(draw),
                draw_order: 20,
                fingerprint_order: 40,
                determines_view: true,
                ..SharedRole::new::<Self>()
            },
        )
    };
}

impl SharedTable for ObstacleParameters {
    fn kind(&self) -> TableKind {
        Self::KIND
    }

    /// A plane is never drawn: that is what `[ground]` is for.
    fn is_visible(&self) -> bool {
        self.visible && self.shape != ObstacleShape::Plane
    }

    fn build(&self, assets: &dyn Assets) -> Result<Option<Arc<dyn SharedObject>>, BuildError> {
        Ok(Some(Arc::new(Obstacle::new(self, assets)?)))
    }
}

impl SharedObject for Obstacle {
    fn solid(&self, t: f64) -> Option<Occluder> {
        Some(self.at(t))
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}

fn draw(tables: &[BuiltTable], _context: &BuildContext) -> Arc<dyn Phenomenon> {
    Arc::new(Solids::new(tables.iter().filter_map(BuiltTable::object).cloned().collect()))
}
