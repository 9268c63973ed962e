//! `impl Phenomenon` for the flame sheet.

use std::{any::Any, sync::Arc};

use bansho_base::{
    host::{
        assets::{Assets, Picture},
        observer::{Cancelled, Observer, check},
    },
    image::Rect,
    math::{self, DVec3},
    parameters::{BuildError, Parameter},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Remark, Run, SharedMemory,
        strip::{DepthInterval, Shutter, View},
        surroundings::{Publication, Surroundings},
    },
    tables::{BuildContext, PhenomenonTable, TableKind, TableParameters},
};

use super::{
    FlameSheetParameters,
    model::{FlameInstance, FlameSheet},
    parameters::{SheetMethod, TextureKind},
    render,
    render::aovs::AOVS,
    texture::TABLE_BYTES,
};
use crate::{GAS_FLOW, POSITION, picture_bounds};

/// What [`SharedMemory`] calls the filtered tables of fractals.
const FILTERED_TABLES: &str = "filtered fractal tables";

impl FlameSheetParameters {
    /// The table `[[flame_sheet]]`.
    pub const KIND: TableKind = TableKind {
        placement_keys: &["position", "width", "height"],
        // The flame nearly fills the height of the picture.
        scene_defaults: "camera = { position = [0.0, 0.76, 2.75], target = [0.0, 0.76, 0.0] }\n",
        paper: Some(&super::paper_settings::PAPER),
        first_keys: &[
            "position",
            "width",
            "height",
            "speed",
            "variation",
            "texture.contrast",
            "color.luminance",
            "color.core_temperature_k",
            "sparks.rate",
            "smoke.optical_depth",
        ],
        ..TableKind::phenomenon::<Self>("flame_sheet")
    };
}

impl PhenomenonTable for FlameSheetParameters {
    fn kind(&self) -> TableKind {
        Self::KIND
    }

    /// The speed is a function of each flame's own time. The key is at the latest of these, so that no texture has passed it already.
    fn continue_live(&mut self, before: &dyn TableParameters, t: f64, transition_s: f64) -> bool {
        let Some(before) = before.as_any().downcast_ref::<Self>() else { return false };
        let mut speed = self.speed.clone();
        self.continue_from(before, t, transition_s);
        let ahead = self.instances.iter().map(|instance| instance.phase_s).reduce(f64::max).unwrap_or(0.0);
        speed.continue_after(&before.speed, t + self.phase_s + ahead, transition_s);
        self.speed = speed;
        true
    }

    fn with_quantity(&self, quantity: &str, value: &[f64]) -> Option<Arc<dyn PhenomenonTable>> {
        let mut changed = self.clone();
        match (quantity, value) {
            (GAS_FLOW, &[flow]) => changed.flow = flow.into(),
            (POSITION, &[x, y, z]) => changed.position = [x, y, z].into(),
            _ => return None,
        }
        Some(Arc::new(changed))
    }

    fn build(&self, context: &BuildContext) -> Result<Arc<dyn Phenomenon>, BuildError> {
        let picture = self.texture_picture(context.assets)?;
        match FlameSheet::with_picture(self.clone(), context.name, context.seed, context.loop_s, picture.as_deref()) {
            Ok(mut sheet) => {
                if let Some(previous) = context.previous.and_then(|previous| previous.as_any()?.downcast_ref()) {
                    sheet.share_tables(previous);
                }
                Ok(Arc::new(sheet))
            }
            Err(error) => Err(BuildError::new(error.key, error.kind)),
        }
    }
}

impl FlameSheetParameters {
    /// The picture that is the texture, if one is.
    fn texture_picture(&self, assets: &dyn Assets) -> Result<Option<Arc<Picture>>, BuildError> {
        let file = self.texture.file.as_ref().filter(|_| self.texture.kind == TextureKind::Picture);
        let picture = file.map(|file| assets.picture(&file.0, 0)).transpose();
        picture.map_err(|error| BuildError { key: "texture.file".into(), kind: error.into() })
    }
}

impl Phenomenon for FlameSheet {
    fn info(&self) -> PhenomenonInfo<'_> {
        PhenomenonInfo { aovs: AOVS, ..PhenomenonInfo::new(&self.name) }
    }

    fn luminance(&self) -> f64 {
        /// Luminance of the bright parts relative to the maximum: most of a flame is far dimmer than its hottest soot.
        const BRIGHT_PARTS: f64 = 0.28;
        BRIGHT_PARTS * self.parameters.color.luminance.bounds()[1]
    }

    fn exposed_luminance(&self) -> f64 {
        crate::EXPOSED_LUMINANCE
    }

    fn view_remark(&self, view: &View) -> Option<Remark> {
        self.edge_on_remark(view)
    }

    fn memory_bytes(&self, pixels: f64) -> f64 {
        // Measured: the tables of shape and color, or those of the soot field, and the columns of the picture.
        let tables = match self.parameters.method {
            SheetMethod::FlameTexture => 3.2e5,
            SheetMethod::SootField => 1.2e7,
        };
        // The paper's texture or a picture, and a filtered one for each flame.
        let own_texture = match self.parameters.texture.kind {
            TextureKind::OhshimaItahashi | TextureKind::Picture => TABLE_BYTES * (1 + self.flames.len()) as f64,
            TextureKind::Fractal | TextureKind::OhshimaItahashiExact => 0.0,
        };
        tables + own_texture + 0.5 * pixels
    }

    fn picture_bounds(&self, view: &View) -> Rect {
        let boxes = self.flames.iter().map(|flame| {
            let (base, size) = (self.base(flame, view.shutter.middle()), self.sheet_size(flame));
            let across = 0.5 * size.x;
            [base - DVec3::new(across, 0.0, across), base + DVec3::new(across, size.y, across)]
        });
        picture_bounds::of_boxes(view, boxes)
    }

    fn shared_memory(&self, view: &View) -> Vec<SharedMemory> {
        let keys = self.flames.iter().filter_map(|flame| self.shared_table_key(flame, view));
        let filtered = keys.map(|key| SharedMemory { key: (FILTERED_TABLES, key), bytes: TABLE_BYTES });
        // The table and its coarser levels.
        filtered.chain([SharedMemory { key: ("fractal table", 0), bytes: 2.0 * TABLE_BYTES }]).collect()
    }

    fn as_any(&self) -> Option<&dyn Any> {
        Some(self)
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl FlameSheet {
    /// A remark on the flame that a view shows most nearly edge on, if it shows less than half of one: a sheet has no depth.
    fn edge_on_remark(&self, view: &View) -> Option<Remark> {
        const LEAST_SEEN: f64 = 0.5;
        let edge_on = self.flames.iter().enumerate().filter_map(|(index, flame)| {
            let foreshortening = self.foreshortening(flame, view)?;
            (foreshortening.seen < LEAST_SEEN).then_some((index, foreshortening))
        });
        let (index, Foreshortening { seen, elevation_deg }) =
            edge_on.min_by(|(_, a), (_, b)| a.seen.total_cmp(&b.seen))?;
        let percent = 100.0 * seen;
        let message = if elevation_deg.abs() > 45.0 {
            let side = if elevation_deg > 0.0 { "above" } else { "below" };
            format!(
                "the camera looks at it from {:.0} degrees {side}: it is a flat, upright sheet, and only {percent:.0} % of its height is seen; \
                 use [[flame_particles]], whose gas has depth, or a camera that looks at it less steeply",
                elevation_deg.abs()
            )
        } else {
            format!(
                "the camera sees it nearly edge on: it is a flat sheet, and only {percent:.0} % of its width is seen; `facing = \"camera\"` turns it \
                 to the camera, `yaw_deg` by an angle"
            )
        };
        Some(match self.parameters.instances.is_empty() {
            true => Remark::new(message),
            false => Remark::at(format!("instances.{index}"), message),
        })
    }

    /// How a view shows the sheet of a flame; `None` if the flame is out, or not in the picture.
    fn foreshortening(&self, flame: &FlameInstance, view: &View) -> Option<Foreshortening> {
        let t = view.shutter.middle();
        let (base, size, camera) = (self.base(flame, t), self.sheet_size(flame), &view.camera);
        let middle = base + DVec3::Y * (0.5 * size.y);
        let seen = camera.project(middle)?;
        let margin = 0.5 * size.x.max(size.y) * seen.pixels_per_meter;
        let is_seen = (-margin..camera.size[0] + margin).contains(&seen.pixel.x)
            && (-margin..camera.size[1] + margin).contains(&seen.pixel.y);
        if self.is_out(t) || !is_seen {
            return None;
        }
        let toward = (camera.position - middle).try_normalize()?;
        let normal = self.right(flame, camera, base).cross(DVec3::Y);
        Some(Foreshortening { seen: normal.dot(toward).abs(), elevation_deg: math::asin(toward.y).to_degrees() })
    }
}

/// How a view shows a sheet.
struct Foreshortening {
    /// Fraction of its area that is seen.
    seen: f64,
    /// How far the camera is above it, degrees; negative below.
    elevation_deg: f64,
}

impl Run for FlameSheet {
    fn publish(&self, shutter: Shutter) -> Publication {
        let lights = self.flames.iter().flat_map(|flame| self.point_lights(flame, shutter.middle())).collect();
        let (mut light_parts, mut light_motion) = (1, 0.0_f64);
        for flame in &self.flames {
            let path = self.path(flame, shutter);
            light_parts = light_parts.max(self.light_parts(flame, path, shutter));
            light_motion = light_motion.max(path);
        }
        Publication { lights, light_parts, light_motion, ..Publication::default() }
    }

    fn depth_intervals(&self, view: &View, surroundings: &Surroundings) -> Vec<DepthInterval> {
        self.flames.iter().flat_map(|flame| self.depths(flame, view, surroundings.wind)).collect()
    }

    fn exposure_parts(&self, view: &View, _surroundings: &Surroundings) -> usize {
        self.parts_of_exposure(view)
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        check(observer)?;
        Ok(Box::new(render::prepared::PreparedSheet::new(self, view, surroundings, observer)?))
    }
}
