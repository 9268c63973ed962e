//! The table `[ground]`; how the renderer uses the ground (`impl Phenomenon`); and how far the ground moves in the picture while the shutter is open, with
//! its shadows and waves.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    host::observer::{Cancelled, Observer, check},
    math::{DVec2, DVec3},
    phenomenon::{
        Phenomenon, PhenomenonInfo, Prepared, Run, SharedMemory,
        light_batch::RelativeLight,
        strip::{DepthInterval, PathCameras, Shutter, View, parts_of_motion},
        surroundings::{Backdrop, Occluder, Publication, Surroundings},
    },
    tables::{BuildContext, BuiltTable, LevelGround, SharedRole, SharedTable, TableCount, TableKind},
};

use super::{
    Ground, GroundKind, GroundParameters,
    hits::{HORIZON, RowDepths},
    lake,
    row_cache::{self, LightInputs},
    sample::SampledImage,
    shade::PreparedGround,
};

/// Height of the ground among what others publish, m: that of the highest level half space.
pub(crate) fn height_of_level_ground(occluders: &[Occluder]) -> Option<f64> {
    let heights = occluders.iter().filter_map(|solid| match solid {
        Occluder::HalfSpace { point, normal } if normal.y > 0.999 => Some(point.y),
        _ => None,
    });
    heights.max_by(f64::total_cmp)
}

impl Phenomenon for Ground {
    fn info(&self) -> PhenomenonInfo<'_> {
        let dry = self.parameters.wetness.constant() == Some(0.0) && self.parameters.kind != GroundKind::Water;
        PhenomenonInfo { mirror: (!dry).then(|| self.parameters.mirror()), ..PhenomenonInfo::new(Self::NAME) }
    }

    /// The ground only reflects the light of others.
    fn luminance(&self) -> f64 {
        0.0
    }

    /// The rows that are kept from frame to frame, for all frames that are drawn at once.
    fn shared_memory(&self, view: &View) -> Vec<SharedMemory> {
        let camera_height = view.camera.position.y - self.parameters.height;
        let (first, end) = RowDepths::new(view, camera_height).rows(&DepthInterval { near: 0.0, far: HORIZON });
        let rows = end.min(view.window.bottom()).saturating_sub(first.max(view.window.y));
        vec![SharedMemory { key: ("rows of the ground", 0), bytes: row_cache::estimated_bytes(view, rows) }]
    }

    fn start(self: Arc<Self>) -> Box<dyn Run> {
        Box::new(self)
    }
}

impl Run for Ground {
    fn publish(&self, _shutter: Shutter) -> Publication {
        let point = bansho_base::math::DVec3::new(0.0, self.parameters.height, 0.0);
        let half_space = Occluder::HalfSpace { point, normal: bansho_base::math::DVec3::Y };
        Publication { occluders: vec![half_space], ..Publication::default() }
    }

    fn depth_intervals(&self, _view: &View, surroundings: &Surroundings) -> Vec<DepthInterval> {
        // Dry ground of a plate that is lit itself adds nothing.
        let is_dry = self.parameters.wetness.constant() == Some(0.0);
        if self.parameters.kind == GroundKind::Plate && surroundings.plate_is_lit && is_dry {
            return Vec::new();
        }
        vec![DepthInterval { near: 0.0, far: HORIZON }]
    }

    fn exposure_parts(&self, view: &View, surroundings: &Surroundings) -> usize {
        self.parts_of_exposure(view, surroundings)
    }

    fn prepare<'a>(
        &'a self,
        view: &'a View,
        surroundings: &'a Surroundings<'a>,
        observer: &dyn Observer,
    ) -> Result<Box<dyn Prepared + 'a>, Cancelled> {
        check(observer)?;
        let wetness = match self.parameters.kind {
            GroundKind::Water => 1.0,
            GroundKind::Land | GroundKind::Plate => self.parameters.wetness.at(view.shutter.middle()),
        };
        let lake = self.lake(view, surroundings);
        let slope = self.surface.mean_slope();
        let backdrop = surroundings.backdrop.map(|Backdrop { image, pixel_size }| {
            let sharp = SampledImage { image, pixel_size: *pixel_size, first_row: 0 };
            Backdrop { image: lake::blurred_reflection(sharp, view, slope), pixel_size: *pixel_size }
        });
        let others = &surroundings.others;
        let light = LightInputs {
            wetness,
            lights: others.lights.clone(),
            shadow_casters: others.shadow_casters.clone(),
            plate_is_lit: surroundings.plate_is_lit,
            sky: surroundings.sky,
            backdrop: backdrop.as_ref().map(|backdrop| backdrop.image.clone()),
        };
        let has_film = wetness > 0.0 && lake.is_none();
        let camera_height = view.camera.position.y - self.parameters.height;
        Ok(Box::new(PreparedGround {
            parameters: &self.parameters,
            surface: &self.surface,
            view,
            surroundings,
            wetness,
            camera_height,
            row_depths: RowDepths::new(view, camera_height),
            lights: others.lights.iter().map(|light| RelativeLight::new(light, view.camera.position)).collect(),
            night_sky: OnceLock::new(),
            has_film,
            lake,
            backdrop,
            cached_rows: self.row_cache.rows(view, has_film, light),
        }))
    }
}

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

/// Motion between the parts of an exposure, pixels.
const PIXELS_PER_PART: f64 = 1.0;
/// Most parts of an exposure for waves, and of lakes, whose parts keep pictures.
const MAX_LAKE_PARTS: usize = 32;

impl Ground {
    /// The parts of an exposure in which nothing on the ground moves by much more than a pixel.
    pub(super) fn parts_of_exposure(&self, view: &View, surroundings: &Surroundings) -> usize {
        let cameras = view.path_cameras();
        let camera_motion = if cameras.is_still() { 0.0 } else { self.camera_motion(view, &cameras) };
        let motion = camera_motion.max(shadow_motion(view, surroundings));
        // Lights that move over ground that stands still are several, each with its share.
        let of_lights = if motion > 0.0 { surroundings.light_parts.len() } else { 1 };
        let max_parts =
            if self.parameters.kind == GroundKind::Water { MAX_LAKE_PARTS } else { view.shutter.max_parts() };
        parts_of_motion(motion, PIXELS_PER_PART, max_parts).max(self.parts_of_waves(view)).max(of_lights)
    }

    /// Longest path of a point of the ground in the picture as the camera moves, pixels.
    fn camera_motion(&self, view: &View, cameras: &PathCameras) -> f64 {
        /// Points along each side of the picture.
        const SIDE: usize = 5;
        let camera = &view.camera;
        let height = camera.position.y - self.parameters.height;
        let mut longest = 0.0_f64;
        for index in 0..SIDE * SIDE {
            let place = DVec2::new((index % SIDE) as f64, (index / SIDE) as f64) / (SIDE - 1) as f64;
            // Within the picture, so that a dome shows the middles of its sides.
            let pixel = DVec2::from(camera.size) * (0.02 + 0.96 * place);
            let Some(direction) = camera.direction(pixel).map(DVec3::normalize) else { continue };
            let is_below = direction.y * height < 0.0;
            let distance = if is_below { (-height / direction.y).min(HORIZON) } else { HORIZON };
            let point = camera.position + direction * distance;
            longest = longest.max(cameras.path_pixels(|_| point));
        }
        longest
    }

    /// The parts of an exposure in which the shortest waves of a lake pass by an eighth of their length.
    fn parts_of_waves(&self, view: &View) -> usize {
        const PARTS_PER_PERIOD: f64 = 8.0;
        if self.parameters.kind != GroundKind::Water || self.parameters.waves <= 0.0 {
            return 1;
        }
        let periods = view.shutter.duration() * super::lake::highest_frequency(self.parameters.wave_length);
        parts_of_motion(periods * PARTS_PER_PERIOD, 1.0, MAX_LAKE_PARTS)
    }
}

/// Length of the path of shadows in the picture, pixels, if they fall near to what casts them.
fn shadow_motion(view: &View, surroundings: &Surroundings) -> f64 {
    let others = &surroundings.others;
    if others.shadow_motion <= 0.0 {
        return 0.0;
    }
    let mut nearest = f64::INFINITY;
    for (center, radius) in others.shadow_casters.iter().filter_map(|caster| caster.bounding_sphere()) {
        nearest = nearest.min(((center - view.camera.position).length() - radius).max(0.5));
    }
    others.shadow_motion * view.camera.focal_pixels / nearest
}
