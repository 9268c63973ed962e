//! The table `[[obstacle]]`.

use std::{any::Any, sync::Arc};

use bansho_base::{
    host::assets::Assets,
    parameters::BuildError,
    phenomenon::Phenomenon,
    tables::{BuildContext, BuiltTable, SharedObject, SharedRole, SharedTable, TableCount, TableKind},
    world::occluder::Occluder,
};

use super::{Obstacle, ObstacleParameters, ObstacleShape, Solids};

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
