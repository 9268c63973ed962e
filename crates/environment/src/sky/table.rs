//! The table `[sky]`.

use std::sync::Arc;

use bansho_base::{
    phenomenon::Phenomenon,
    tables::{BuildContext, BuiltTable, SceneSky, SharedRole, SharedTable, TableCount, TableKind},
    world::sky::SkyKind,
};

use super::{SkyBackdrop, SkyParameters};

/// White balance of a camera at night, K.
const NIGHT_WHITE_K: f64 = 4000.0;

impl SkyParameters {
    /// The table `[sky]`.
    pub const KIND: TableKind = TableKind {
        layer: Some(SkyBackdrop::NAME),
        ..TableKind::shared::<Self>(
            "sky",
            TableCount::Optional,
            SharedRole {
                draw: Some(draw),
                draw_order: 40,
                is_behind_plates: true,
                fingerprint_order: 20,
                implied_unless: Some(&["light"]),
                ..SharedRole::new::<Self>()
            },
        )
    };
}

impl SharedTable for SkyParameters {
    fn kind(&self) -> TableKind {
        Self::KIND
    }

    fn hide(&mut self) -> bool {
        self.visible = false;
        true
    }

    fn is_visible(&self) -> bool {
        self.visible
    }

    fn fills_background(&self) -> bool {
        self.visible
    }

    fn white_balance_k(&self) -> Option<f64> {
        (self.kind == SkyKind::Night).then_some(NIGHT_WHITE_K)
    }

    fn sky(&self, t: f64) -> Option<SceneSky> {
        Some(SceneSky { sky: self.at(t), is_visible: self.visible })
    }
}

fn draw(tables: &[BuiltTable], context: &BuildContext) -> Arc<dyn Phenomenon> {
    Arc::new(SkyBackdrop::new(BuiltTable::first_or_default(tables), context.seed))
}
