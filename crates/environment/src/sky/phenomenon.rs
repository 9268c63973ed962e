//! The table `[sky]`, and how the renderer uses the sky (`impl Phenomenon`).

use std::sync::Arc;

use bansho_base::{
    color,
    host::observer::{Cancelled, Observer},
    math::DVec3,
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run,
        strip::{DepthInterval, Shutter, View, parts_of_motion},
        surroundings::{Publication, Surroundings},
    },
    tables::{BuildContext, BuiltTable, SceneSky, SharedRole, SharedTable, TableCount, TableKind},
    world::sky::SkyKind,
};

use super::{
    SkyBackdrop, SkyParameters,
    render::{FAR, PreparedSky},
};

impl Phenomenon for SkyBackdrop {
    fn info(&self) -> PhenomenonInfo<'_> {
        PhenomenonInfo::new(Self::NAME)
    }

    fn luminance(&self) -> f64 {
        f64::from(color::luminance(self.parameters.at(0.0).radiance(DVec3::Y)))
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for SkyBackdrop {
    fn publish(&self, _shutter: Shutter) -> Publication {
        Publication::default()
    }

    fn depth_intervals(&self, _view: &View, _surroundings: &Surroundings) -> Vec<DepthInterval> {
        if self.parameters.hills_deg > 0.0 || self.parameters.trees_deg > 0.0 {
            vec![self.hills(), FAR]
        } else {
            vec![FAR]
        }
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        let sky = surroundings.sky;
        // 16 in usual exposures.
        let cameras = view.cameras_at_most(0.5 * view.shutter.max_parts() as f64);
        let cache = self.cache(&sky, view, &cameras);
        Ok(Box::new(PreparedSky { view, cameras, sky, cache, skyline: self.skyline(), hills: self.hills() }))
    }

    /// By day only the skyline is seen to move.
    fn parts_when_composited(&self, view: &View, surroundings: &Surroundings) -> usize {
        let has_skyline = self.parameters.hills_deg > 0.0 || self.parameters.trees_deg > 0.0;
        if has_skyline || surroundings.sky.night().is_some() {
            parts_of_motion(view.motion_pixels(), 1.0, view.shutter.max_parts())
        } else {
            1
        }
    }

    fn prepare_part<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        _observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        let (sky, cameras) = (surroundings.sky, vec![view.camera]);
        let cache = self.night_sky(&sky, view, &cameras);
        Ok(Box::new(PreparedSky { view, cameras, sky, cache, skyline: self.skyline(), hills: self.hills() }))
    }
}

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
