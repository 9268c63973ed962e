//! The table `[[light]]`, and how the renderer uses lamps (`impl Phenomenon`).

use std::sync::Arc;

use bansho_base::{
    host::observer::{Cancelled, Observer},
    parameters::{BuildError, ProblemKind},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Light, Publication, Surroundings},
    },
    tables::{BuildContext, BuiltTable, SharedRole, SharedTable, TableCount, TableKind},
};

use super::{
    Lamp, Lamps, LightKind, LightParameters,
    render::{Disc, PreparedLamps, project_lamp},
};

impl Phenomenon for Lamps {
    fn info(&self) -> PhenomenonInfo<'_> {
        PhenomenonInfo::new(Self::NAME)
    }

    /// Lamps do not affect the automatic exposure: they are far brighter than the surfaces that they light.
    fn luminance(&self) -> f64 {
        0.0
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for Lamps {
    /// The lights belong to the scene, so all phenomena have them already.
    fn publish(&self, _shutter: Shutter) -> Publication {
        Publication::default()
    }

    fn depth_intervals(&self, view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        let mut intervals = Vec::new();
        for lamp in (self.at)(view.shutter.middle()) {
            let Some(disc) = project_lamp(&lamp, view) else { continue };
            // From the camera on, so that a slice ends at the lamp and none begins there: within a slice, lamps are behind all phenomena and fog. Glare arises
            // in the lens, in front of everything.
            intervals.push(DepthInterval { near: 0.0, far: disc.depth.next_up() });
        }
        intervals
    }

    fn exposure_parts(&self, view: &View, _surroundings: &Surroundings) -> usize {
        self.parts_of_exposure(view)
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        _surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        let lamps = (self.at)(view.shutter.middle());
        let mut discs: Vec<Disc> = lamps.iter().filter_map(|lamp| project_lamp(lamp, view)).collect();
        discs.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        Ok(Box::new(PreparedLamps { view, discs }))
    }
}

impl LightParameters {
    /// The table `[[light]]`.
    pub const KIND: TableKind = TableKind {
        layer: Some(Lamps::NAME),
        ..TableKind::shared::<Self>(
            "light",
            TableCount::List,
            SharedRole {
                draw: Some(draw),
                draw_order: 10,
                fingerprint_order: 10,
                implied_unless: Some(&["sky", "ground"]),
                ..SharedRole::new::<Self>()
            },
        )
    };
}

impl SharedTable for LightParameters {
    fn kind(&self) -> TableKind {
        Self::KIND
    }

    /// A directed light needs a direction, and the inner cone of a spot must not exceed its outer cone. An inner cone that the file does not state is
    /// limited to the outer one.
    fn conflicts(&self, is_stated: &dyn Fn(&str) -> bool) -> Vec<BuildError> {
        let mut errors = Vec::new();
        if self.is_directed() && !self.has_valid_direction() {
            let reason = "is the zero vector; allowed: a vector with at least one nonzero component".to_owned();
            errors.push(BuildError { key: "direction".into(), kind: ProblemKind::Conflict(reason) });
        }
        let is_wider = self.inner_cone_deg > self.outer_cone_deg;
        if self.kind == LightKind::Spot && is_wider && is_stated("inner_cone_deg") {
            let reason = format!(
                "{} degrees is wider than `outer_cone_deg` ({}); allowed: up to `outer_cone_deg`",
                self.inner_cone_deg, self.outer_cone_deg
            );
            errors.push(BuildError { key: "inner_cone_deg".into(), kind: ProblemKind::Conflict(reason) });
        }
        errors
    }

    fn hide(&mut self) -> bool {
        self.visible = false;
        true
    }

    fn is_visible(&self) -> bool {
        self.visible
    }

    fn light(&self, t: f64) -> Option<Light> {
        Some(self.at(t))
    }

    fn light_parts(&self, shutter: Shutter) -> usize {
        self.parts_of_exposure(shutter)
    }
}

fn draw(tables: &[BuiltTable], _context: &BuildContext) -> Arc<dyn Phenomenon> {
    let lights: Vec<LightParameters> = tables.iter().filter_map(BuiltTable::parameters).cloned().collect();
    Arc::new(Lamps::new(move |t| {
        lights.iter().map(|light| Lamp { light: light.at(t), radius: light.radius }).collect()
    }))
}
