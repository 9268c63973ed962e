//! The plan of a shot: everything fixed before the first frame, as plain data.

use std::sync::Arc;

use bansho_base::{
    camera::{Camera, CameraParameters},
    color,
    frame::FrameHeader,
    host::assets::Assets,
    image::Rect,
    parameters::Parameters,
    phenomenon::strip::{Shutter, View},
};

use crate::fingerprint::{self, Fingerprint};
use bansho_scene::{FrameRate, PlateView, Scene};

/// Fraction of the light that the lens of a camera scatters over a picture for display, if its scene states none: that of a clean zoom lens with a filter.
pub const DEFAULT_GLARE: f64 = 0.03;

/// Whether the pictures of a shot have the glare of the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GlareUse {
    /// If the scene states it: for pictures that others composite, such as flipbooks and live effects.
    #[default]
    Stated,
    /// Also by default, as in finished pictures for display.
    Always,
    /// Not at all: scene-linear light, to which a compositor adds the glare of the camera.
    Never,
}

impl GlareUse {
    /// The fraction of the light that is scattered, where the scene states `stated`.
    fn fraction(self, stated: Option<f64>) -> f64 {
        match self {
            Self::Stated => stated.unwrap_or(0.0),
            Self::Always => stated.unwrap_or(DEFAULT_GLARE),
            Self::Never => 0.0,
        }
    }
}

/// Options of a shot that its scene does not state.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlanOptions {
    /// Another picture size, pixels.
    pub size: Option<[usize; 2]>,
    /// Whether the scene's overscan is drawn, which only EXR can hold.
    pub overscan: bool,
    /// The region of the picture that is drawn; `None` for all of it.
    pub crop: Option<Rect>,
    /// Whether each phenomenon gets a layer of its own.
    pub layers: bool,
    /// Whether phenomena write their AOVs.
    pub aovs: bool,
    /// Whether frames carry the phenomena's metadata.
    pub metadata: bool,
    /// Whether pictures have the glare of the camera.
    pub glare: GlareUse,
    /// The view transform of display formats; `None` for that of the scene. Its inverse is applied to a plate that is made for display.
    pub display: Option<color::View>,
}

/// Why a shot cannot be planned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The crop is not inside the picture.
    #[error(
        "the crop of {} x {} pixels at ({}, {}) extends beyond the picture of {} x {} pixels",
        .crop[2], .crop[3], .crop[0], .crop[1], .size[0], .size[1]
    )]
    CropOutside {
        /// x, y, width, height.
        crop: [usize; 4],
        /// Width and height.
        size: [usize; 2],
    },
    /// The picture is empty or too large.
    #[error("a picture of {width} x {height} pixels; allowed: 1 to {limit} on a side")]
    Size {
        /// Width.
        width: usize,
        /// Height.
        height: usize,
        /// Largest side.
        limit: usize,
    },
}

/// Everything that is fixed before the first frame of a shot. Plain data: it holds no assets and nothing that is built.
#[derive(Clone)]
pub struct Plan {
    pub(crate) scene: Arc<Scene>,
    /// The camera: that of the scene, unless a program moves another one.
    pub camera: CameraParameters,
    pub(crate) size: [usize; 2],
    /// Pixels around the picture on every side.
    pub(crate) overscan: usize,
    pub(crate) window: Rect,
    /// Offset of the first frame from the beginning of the loop, frames.
    pub loop_start: i64,
    /// Exposure, chosen once for the shot.
    pub exposure_ev100: f32,
    /// Whether each phenomenon gets a layer of its own.
    pub layers: bool,
    /// Whether phenomena write their AOVs.
    pub aovs: bool,
    /// Whether frames have the depth of each pixel; of what has layers or AOVs it is always kept.
    pub depth: bool,
    /// Whether frames carry the phenomena's metadata.
    pub metadata: bool,
    /// Fraction of the light that the lens scatters over the picture; 0 for pictures without glare.
    pub glare: f64,
    /// The view transform of display formats, without the camera's white balance.
    pub display: color::View,
    /// Whether the headers of frames get a fingerprint of all that their pixels depend on; otherwise it is 0. It takes about as long as drawing a small
    /// picture.
    pub fingerprint_frames: bool,
}

impl Plan {
    /// Plans a shot whose exposure and loop start are already known, for example from another plan of the same scene. [`Plan::new`] chooses
    /// both.
    ///
    /// # Errors
    /// The options do not fit the scene.
    pub fn with_exposure_and_loop_start(
        scene: Arc<Scene>,
        options: &PlanOptions,
        exposure_ev100: f32,
        loop_start: i64,
    ) -> Result<Self, PlanError> {
        let size = options.size.unwrap_or(scene.picture.size.map(|side| side as usize));
        let overscan = if options.overscan { scene.picture.overscan as usize } else { 0 };
        Ok(Self {
            window: window(size, overscan, options.crop)?,
            size,
            overscan,
            loop_start,
            exposure_ev100,
            layers: options.layers,
            aovs: options.aovs,
            metadata: options.metadata,
            depth: true,
            glare: options.glare.fraction(scene.camera.glare),
            display: options.display.unwrap_or_else(|| scene.picture.view.into()),
            fingerprint_frames: true,
            camera: scene.camera.clone(),
            scene,
        })
    }

    /// The same shot of another scene, with the camera of this one, as when a program changes lights while it runs.
    #[must_use]
    pub fn of_scene(&self, scene: Arc<Scene>) -> Self {
        Self { scene, ..self.clone() }
    }

    /// The same shot in another size, without crop and overscan.
    #[must_use]
    pub fn at_size(&self, size: [usize; 2]) -> Self {
        let window = Rect::from_size(size[0], size[1]);
        Self { size, window, overscan: 0, ..self.clone() }
    }

    /// The same shot in another size and without overscan, cropped to `crop`.
    ///
    /// # Errors
    /// A size that is not possible, or a crop that is not inside the picture.
    pub fn cropped(&self, size: [usize; 2], crop: Rect) -> Result<Self, PlanError> {
        Ok(Self { window: window(size, 0, Some(crop))?, ..self.at_size(size) })
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Size of the picture without overscan, pixels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Pixels that are drawn around the picture on every side.
    pub fn overscan(&self) -> usize {
        self.overscan
    }

    /// The region to draw, in pixels of the picture with its overscan.
    pub fn window(&self) -> Rect {
        self.window
    }

    /// Seed of everything random.
    pub fn seed(&self) -> u64 {
        self.scene.seed
    }

    /// Length of the seamless loop, s: a whole number of frames.
    pub fn loop_s(&self) -> Option<f64> {
        self.scene.loop_s
    }

    /// Frames per second.
    pub fn fps(&self) -> FrameRate {
        self.scene.picture.fps
    }

    /// The numbers of the shot's frames; of a loop, those of one period.
    pub fn frames(&self) -> std::ops::Range<i64> {
        let count = match self.loop_s() {
            Some(seconds) => (seconds / self.fps().frame_s()).round() as i64,
            None => self.scene.picture.frames,
        };
        let first = self.scene.picture.first_frame;
        first..first + count
    }

    /// Time at which frame `number` begins, s. Time is periodic in a loop, and the first frame is [`Plan::loop_start`] frames after time 0.
    pub fn time(&self, number: i64) -> f64 {
        let index = number - self.scene.picture.first_frame;
        let fps = self.fps();
        let index = match self.loop_s() {
            Some(_) => (index + self.loop_start).rem_euclid(self.frames().end - self.frames().start),
            None => index,
        };
        index as f64 * f64::from(fps.seconds) / f64::from(fps.frames)
    }

    /// The number of the frame in which time `t` lies; in a loop, that of the frame in its first period.
    pub fn number_at(&self, t: f64) -> i64 {
        let fps = self.fps();
        let index = (t * f64::from(fps.frames) / f64::from(fps.seconds) + 1e-6).floor() as i64;
        let index = match self.loop_s() {
            Some(_) => (index - self.loop_start).rem_euclid(self.frames().end - self.frames().start),
            None => index,
        };
        self.scene.picture.first_frame.saturating_add(index)
    }

    /// The interval of time in which the shutter is open for frame `number`.
    pub fn shutter(&self, number: i64) -> Shutter {
        self.shutter_at(self.time(number))
    }

    /// The interval of time in which the shutter is open for a frame that begins at time `t`, s.
    pub fn shutter_at(&self, t: f64) -> Shutter {
        let camera = &self.camera;
        let open = t + camera.shutter_offset_s;
        Shutter { open, close: open + camera.shutter_s.unwrap_or(0.5 * self.fps().frame_s()) }
    }

    /// Camera, shutter and window of frame `number`.
    pub fn view(&self, number: i64) -> View {
        self.view_at(self.time(number))
    }

    /// Camera, shutter and window of a frame that begins at time `t`, s.
    pub fn view_at(&self, t: f64) -> View {
        let shutter = self.shutter_at(t);
        let overscan = self.overscan;
        let next = shutter.middle() + self.fps().frame_s();
        let mut view = View::new(self.camera.clone(), shutter, next, self.size, overscan);
        view.white_luminance = Some(color::white_luminance(f64::from(self.exposure_ev100)));
        view.aovs_requested = self.aovs;
        view.has_plate = self.scene.has_plate();
        view.glare_is_added = self.glare > 0.0;
        let view = view.with_window(self.window);
        match self.loop_s() {
            Some(seconds) => view.in_loop(seconds),
            None => view,
        }
    }

    /// The camera at the middle of an exposure, on its side of every cut.
    pub(crate) fn middle_camera(&self, shutter: Shutter) -> Camera {
        let middle = shutter.middle();
        self.camera.of_exposure(middle, self.fps().frame_s()).at(middle, self.size)
    }

    /// The view from which the plate of frame `number` was taken.
    pub(crate) fn plate_view(&self, number: i64) -> PlateView {
        let shutter = self.shutter(number);
        let camera = self.middle_camera(shutter);
        let ground_height = self.scene.tables.level_ground(shutter.middle()).map(|ground| ground.height);
        PlateView { camera, size: self.size, ground_height }
    }

    /// A fingerprint of all that the pixels of frame `number` depend on, files in `assets` included.
    pub fn frame_fingerprint(&self, number: i64, assets: &dyn Assets) -> Fingerprint {
        let mut hasher = blake3::Hasher::new();
        fingerprint::hash_state(&self.scene, assets, &mut hasher);
        fingerprint::hash_line("time", self.time(number), &mut hasher);
        fingerprint::hash_line("number", number, &mut hasher);
        fingerprint::hash_line("size", format_args!("{:?} {:?}", self.size, self.window), &mut hasher);
        fingerprint::hash_line("exposure", self.exposure_ev100, &mut hasher);
        fingerprint::hash_line("outputs", format_args!("{} {}", self.layers, self.aovs), &mut hasher);
        fingerprint::hash_line("glare", self.glare, &mut hasher);
        fingerprint::hash_line("view", self.display.name().name(), &mut hasher);
        if let Some(kelvin) = self.scene.picture.white_balance_k {
            fingerprint::hash_line("white balance", kelvin, &mut hasher);
        }
        fingerprint::hash_line("fps", format_args!("{:?}", self.fps()), &mut hasher);
        fingerprint::hash_table("camera", self.camera.to_table(), &mut hasher);
        fingerprint::hash_table("plate", self.scene.plate.to_table(), &mut hasher);
        let plate = &self.scene.plate;
        for (_, path) in plate.files() {
            fingerprint::hash_asset(assets, &path.0, number, &mut hasher);
        }
        // The light of the plate of the first frame is used in all frames.
        plate.image.iter().for_each(|path| fingerprint::hash_shared_asset(&self.scene, assets, &path.0, &mut hasher));
        *hasher.finalize().as_bytes()
    }

    /// The header of frame `number`, whose pixels have the fingerprint `fingerprint`.
    pub fn header(&self, number: i64, fingerprint: Fingerprint) -> FrameHeader {
        self.header_at(number, self.time(number), fingerprint)
    }

    /// The header of frame `number` if it begins at time `t`, s.
    pub(crate) fn header_at(&self, number: i64, t: f64, fingerprint: Fingerprint) -> FrameHeader {
        let shutter = self.shutter_at(t);
        let overscan = self.overscan as i64;
        FrameHeader {
            number,
            exposure_ev100: self.exposure_ev100,
            white_balance_k: self.scene.picture.white_balance_k.map(|kelvin| kelvin as f32),
            fps: [self.fps().frames, self.fps().seconds],
            exposure_time_s: shutter.duration() as f32,
            camera: self.middle_camera(shutter).header(),
            fingerprint,
            display_size: self.size,
            data_origin: [self.window.x as i64 - overscan, self.window.y as i64 - overscan],
        }
    }

    /// Factor from absolute radiance to exposed values, of which 1.0 is display white.
    pub fn exposure_scale(&self) -> f32 {
        color::exposure_scale(f64::from(self.exposure_ev100)) as f32
    }

    /// The view transform of display formats, with the camera's white balance.
    pub(crate) fn view_transform(&self) -> color::View {
        self.display.with_white_balance(self.scene.picture.white_balance_k)
    }
}

/// Whether `length` pixels from `start` on, at least one, are within a side of a picture.
fn is_within_side(start: usize, length: usize, side: usize) -> bool {
    length > 0 && start < side && length <= side - start
}

/// The region to draw, in pixels of the picture with its overscan. `crop` is in pixels of the picture without it.
fn window(size: [usize; 2], overscan: usize, crop: Option<Rect>) -> Result<Rect, PlanError> {
    let limit = bansho_scene::picture::LARGEST_SIDE as usize;
    let [width, height] = size;
    if !(1..=limit).contains(&width) || !(1..=limit).contains(&height) {
        return Err(PlanError::Size { width, height, limit });
    }
    let Some(crop) = crop else {
        return Ok(Rect::from_size(width + 2 * overscan, height + 2 * overscan));
    };
    if !is_within_side(crop.x, crop.width, width) || !is_within_side(crop.y, crop.height, height) {
        return Err(PlanError::CropOutside { crop: [crop.x, crop.y, crop.width, crop.height], size });
    }
    Ok(Rect { x: crop.x + overscan, y: crop.y + overscan, ..crop })
}
