//! The table `[fog]`.

use std::sync::Arc;

use bansho_base::{
    phenomenon::Phenomenon,
    tables::{BuildContext, BuiltTable, SharedRole, SharedTable, TableCount, TableKind},
};

use super::{Fog, FogParameters, scattering};

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
    Arc::new(Fog::new(BuiltTable::first_or_default(tables)))
}
