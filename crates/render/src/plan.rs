//! The plan of a shot: everything fixed before the first frame, as plain data.

use std::sync::Arc;

use bansho_base::{
    color,
    image::{FrameHeader, Rect},
    phenomenon::strip::{Shutter, View},
};

use crate::{compiled::CompiledScene, exposure, fingerprint::Fingerprint, loop_start};
use bansho_scene::{FrameRate, Scene};

/// What a job may ask of a shot beside its scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlanOptions {
    /// Another picture size, pixels.
    pub size: Option<[usize; 2]>,
    /// Whether the scene's overscan is drawn, which only EXR has room for.
    pub overscan: bool,
    /// Only this part of the picture.
    pub crop: Option<Rect>,
    /// Whether each phenomenon gets a layer of its own.
    pub layers: bool,
    /// Whether phenomena write their AOVs.
    pub aovs: bool,
    /// Whether frames carry the phenomena's metadata.
    pub metadata: bool,
    /// How display formats will show the picture; a plate made for display is taken back through it.
    pub display: color::View,
}

/// Why a shot cannot be planned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The part lies outside the picture.
    #[error("the crop {crop:?} reaches outside the picture of {size:?} pixels")]
    CropOutside {
        /// x, y, width, height.
        crop: [usize; 4],
        /// Width and height.
        size: [usize; 2],
    },
    /// The picture has more pixels than are drawn.
    #[error("{width} x {height} pixels are too many; allowed: 1 to {most} on a side")]
    Size {
        /// Width.
        width: usize,
        /// Height.
        height: usize,
        /// Largest side.
        most: usize,
    },
}

/// A shot: the scene, and all that the frames have in common. Plain data: it holds no assets, and nothing that is built.
#[derive(Clone)]
pub struct Plan {
    pub(crate) scene: Arc<Scene>,
    pub(crate) size: [usize; 2],
    /// Pixels around the picture on every side.
    pub(crate) overscan: usize,
    pub(crate) window: Rect,
    /// Frames from the beginning of the loop's turn to the first one.
    pub loop_start: i64,
    /// Exposure, chosen once for the shot.
    pub exposure_ev100: f32,
    /// Whether each phenomenon gets a layer of its own.
    pub layers: bool,
    /// Whether phenomena write their AOVs.
    pub aovs: bool,
    /// Whether frames carry the phenomena's metadata.
    pub metadata: bool,
    /// How display formats show the picture.
    pub display: color::View,
}

impl Plan {
    /// Plans a shot of `compiled`, whose exposure and loop are measured where the scene leaves them open.
    ///
    /// # Errors
    /// The options do not fit the scene.
    pub fn new(compiled: &Arc<CompiledScene>, options: &PlanOptions) -> Result<Self, PlanError> {
        let mut plan = Self::given(compiled.scene().clone(), options, 0.0, 0)?;
        plan.exposure_ev100 = exposure::measure(compiled, &plan);
        plan.loop_start = loop_start::search(compiled, &plan);
        Ok(plan)
    }

    /// Plans a shot whose exposure and loop start are known, as from measuring them elsewhere.
    ///
    /// # Errors
    /// The options do not fit the scene.
    pub fn given(
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
            display: options.display,
            scene,
        })
    }

    /// The same shot in another size, whole and without overscan.
    #[must_use]
    pub fn at_size(&self, size: [usize; 2]) -> Self {
        let window = Rect::from_size(size[0], size[1]);
        Self { size, window, overscan: 0, ..self.clone() }
    }

    /// The same shot in another size and without overscan, of which only `crop` is drawn.
    ///
    /// # Errors
    /// A size that no picture has, or a crop that reaches outside it.
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

    /// The part to draw, within the picture with its overscan.
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

    /// Frames a second.
    pub fn fps(&self) -> FrameRate {
        self.scene.picture.fps
    }

    /// The numbers of the whole shot's frames; of one turn where it is a loop.
    pub fn frames(&self) -> std::ops::Range<i64> {
        let count = match self.loop_s() {
            Some(seconds) => (seconds / self.fps().frame_s()).round() as i64,
            None => self.scene.picture.frames,
        };
        let first = self.scene.picture.first_frame;
        first..first + count
    }

    /// When frame `number` begins, s; a loop begins again, at a calm moment of its turn.
    pub fn time(&self, number: i64) -> f64 {
        let index = number - self.scene.picture.first_frame;
        let fps = self.fps();
        let index = match self.loop_s() {
            Some(_) => (index + self.loop_start).rem_euclid(self.frames().end - self.frames().start),
            None => index,
        };
        index as f64 * f64::from(fps.seconds) / f64::from(fps.frames)
    }

    /// When the shutter is open for frame `number`.
    pub fn shutter(&self, number: i64) -> Shutter {
        let camera = &self.scene.camera;
        let open = self.time(number) + camera.shutter_offset_s;
        Shutter { open, close: open + camera.shutter_s.unwrap_or(0.5 * self.fps().frame_s()) }
    }

    /// What frame `number` shows.
    pub fn view(&self, number: i64) -> View {
        let shutter = self.shutter(number);
        let overscan = self.overscan;
        let next = shutter.middle() + self.fps().frame_s();
        let mut view = View::new(self.scene.camera.clone(), shutter, next, self.size, overscan);
        view.white_luminance = Some(color::white_luminance(f64::from(self.exposure_ev100)));
        view.aovs_requested = self.aovs;
        let view = view.with_window(self.window);
        match self.loop_s() {
            Some(turn) => view.in_loop(turn),
            None => view,
        }
    }

    /// The header of frame `number`, whose pixels have that fingerprint.
    pub fn header(&self, number: i64, fingerprint: Fingerprint) -> FrameHeader {
        let view = self.view(number);
        let overscan = self.overscan as i64;
        FrameHeader {
            number,
            exposure_ev100: self.exposure_ev100,
            white_balance_k: self.scene.picture.white_balance_k.map(|kelvin| kelvin as f32),
            fps: [self.fps().frames, self.fps().seconds],
            exposure_time_s: view.shutter.duration() as f32,
            camera: self.scene.camera.at(view.shutter.middle(), self.size).header(),
            fingerprint,
            display_size: self.size,
            data_origin: [self.window.x as i64 - overscan, self.window.y as i64 - overscan],
        }
    }

    /// What absolute radiance is multiplied by, so that 1.0 is display white.
    pub fn exposure_scale(&self) -> f32 {
        color::exposure_scale(f64::from(self.exposure_ev100)) as f32
    }

    /// How display formats show the picture, with the camera's white balance.
    pub fn shown(&self) -> color::View {
        self.display.with_white_balance(self.scene.picture.white_balance_k)
    }
}

/// The drawn part within the picture with its overscan; crops count from the picture's own corner.
fn window(size: [usize; 2], overscan: usize, crop: Option<Rect>) -> Result<Rect, PlanError> {
    let most = bansho_scene::picture::LARGEST_SIDE as usize;
    let [width, height] = size;
    if !(1..=most).contains(&width) || !(1..=most).contains(&height) {
        return Err(PlanError::Size { width, height, most });
    }
    let Some(crop) = crop else {
        return Ok(Rect::from_size(width + 2 * overscan, height + 2 * overscan));
    };
    let inside = |start: usize, length: usize, side: usize| length > 0 && start < side && length <= side - start;
    if !inside(crop.x, crop.width, width) || !inside(crop.y, crop.height, height) {
        return Err(PlanError::CropOutside { crop: [crop.x, crop.y, crop.width, crop.height], size });
    }
    Ok(Rect { x: crop.x + overscan, y: crop.y + overscan, ..crop })
}
