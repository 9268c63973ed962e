//! The table `[ground]`.

use std::sync::Arc;

use bansho_base::{
    phenomenon::Phenomenon,
    tables::{BuildContext, BuiltTable, LevelGround, SharedRole, SharedTable, TableCount, TableKind},
};

use super::{Ground, GroundParameters};

impl GroundParameters {
    /// The table `[ground]`.
    pub const KIND: TableKind = TableKind {
        layer: Some(Ground::NAME),
        ..TableKind::shared::<Self>(
            "ground",
            TableCount::Optional,
            SharedRole {
                draw: Some(draw),
                draw_order: 30,
                fingerprint_order: 30,
                implied_unless: Some(&["sky", "light"]),
                ..SharedRole::new::<Self>()
            },
        )
    };
}

impl SharedTable for GroundParameters {
    fn kind(&self) -> TableKind {
        Self::KIND
    }

    fn fills_background(&self) -> bool {
        true
    }

    fn level_ground(&self, t: f64) -> Option<LevelGround> {
        Some(LevelGround { height: self.height, reflectance: self.reflectance(t) })
    }
}

fn draw(tables: &[BuiltTable], context: &BuildContext) -> Arc<dyn Phenomenon> {
    Arc::new(Ground::new(BuiltTable::first_or_default(tables), context.seed, context.loop_s))
}
