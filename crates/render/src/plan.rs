//! The plan of a shot: everything fixed before the first frame.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    color,
    host::{assets::Assets, once::get_or_make},
    image::{FrameHeader, Rect},
    parameters::{Auto, path},
    phenomenon::{
        Phenomenon, Remark,
        strip::{Shutter, View},
        surroundings::Occluder,
    },
    world::{
        sky::{ElevationProfile, Sky},
        wind::Wind,
    },
};

use crate::{
    cpu, exposure, fingerprint, phenomena,
    scene::{FrameRate, ObstacleParameters, OpeningFault, SHARED_TABLES, Scene, SharedTable},
};

/// What a job may change of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlanOptions {
    /// Another picture size, pixels.
    pub size: Option<[usize; 2]>,
    /// Another seed.
    pub seed: Option<u64>,
    /// Whether sky, ground and lamps that the scene's text does not state are seen; they light the scene either way.
    pub implied_backdrop: bool,
    /// Whether the scene's overscan is drawn, which only EXR has room for.
    pub overscan: bool,
    /// Only this part of the picture.
    pub crop: Option<Rect>,
    /// A seamless loop of about so many seconds.
    pub loop_s: Option<f64>,
    /// Whether each phenomenon gets a layer of its own.
    pub layers: bool,
    /// Whether phenomena write their AOVs.
    pub aovs: bool,
    /// Whether frames carry the phenomena's figures.
    pub figures: bool,
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
    /// A loop shorter than two frames or longer than an hour.
    #[error("a loop of {seconds} s is out of range; allowed: {min} (two frames) to 3600 s")]
    LoopLength {
        /// What was asked for.
        seconds: f64,
        /// Two frames.
        min: f64,
    },
    /// Something keyed does not end as it begins.
    #[error(
        "the loop of {seconds} s jumps: {what} differs between its first and its last moment; allowed: the same at 0 s and at {seconds} s"
    )]
    LoopJumps {
        /// Length of the loop.
        seconds: f64,
        /// What is keyed.
        what: String,
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
    /// A phenomenon or an obstacle cannot be made.
    #[error("{name}: {key}: {}", .fault.kind)]
    Opening {
        /// The phenomenon's name.
        name: String,
        /// Its parameter.
        key: String,
        /// The fault.
        fault: Box<OpeningFault>,
    },
}

/// A shot: the scene, and all that the frames have in common.
#[derive(Clone)]
pub struct Plan {
    /// Where the scene's pictures come from.
    pub assets: Arc<dyn Assets>,
    // These three agree about the overscan.
    pub(crate) scene: Scene,
    pub(crate) size: [usize; 2],
    pub(crate) window: Rect,
    /// Seed of everything random.
    pub seed: u64,
    /// Length of the seamless loop, s: a whole number of frames.
    pub loop_s: Option<f64>,
    /// Frames from the beginning of the loop's turn to the first one.
    pub loop_start: i64,
    /// Exposure, chosen once for the shot.
    pub exposure_ev100: f32,
    /// Whether each phenomenon gets a layer of its own.
    pub layers: bool,
    /// Whether phenomena write their AOVs.
    pub aovs: bool,
    /// Whether frames carry the phenomena's figures.
    pub figures: bool,
    /// How display formats show the picture.
    pub display: color::View,
    /// The one wind.
    pub wind: Wind,
    /// The scene's obstacles.
    pub occluders: Vec<Occluder>,
    /// The light that the plate shows, beside its display white; found when it is first asked for.
    pub(crate) plate_light: Arc<OnceLock<Option<ElevationProfile>>>,
}

impl Plan {
    /// Plans a shot of `scene`.
    ///
    /// # Errors
    /// The options do not fit the scene, or a phenomenon cannot be made.
    pub fn new(scene: Scene, options: &PlanOptions, assets: Arc<dyn Assets>) -> Result<Self, PlanError> {
        let mut plan = Self::unexposed(scene, options, assets)?;
        plan.exposure_ev100 = plan.exposure()?;
        Ok(plan.begun_calmly())
    }

    /// Plans a shot whose exposure is known, as from planning it elsewhere: no phenomenon is made for it, unless it is a loop.
    ///
    /// # Errors
    /// The options do not fit the scene.
    pub fn exposed(
        scene: Scene,
        options: &PlanOptions,
        assets: Arc<dyn Assets>,
        exposure_ev100: f32,
    ) -> Result<Self, PlanError> {
        let plan = Self { exposure_ev100, ..Self::unexposed(scene, options, assets)? };
        Ok(plan.begun_calmly())
    }

    fn unexposed(mut scene: Scene, options: &PlanOptions, assets: Arc<dyn Assets>) -> Result<Self, PlanError> {
        let size = options.size.unwrap_or(scene.picture.size.map(|side| side as usize));
        if !options.overscan {
            scene.picture.overscan = 0;
        }
        if !options.implied_backdrop {
            scene.hide_implied_backdrop();
        }
        let overscan = scene.picture.overscan as usize;
        let loop_s = options.loop_s.map(|seconds| loop_length(seconds, scene.picture.fps)).transpose()?;
        let seed = options.seed.unwrap_or(scene.picture.seed as u64);
        let wind = Wind::new(scene.wind.clone(), seed, loop_s);
        let occluders = occluders(&scene, assets.as_ref())?;
        let mut plan = Self {
            window: window(size, overscan, options.crop)?,
            size,
            seed,
            loop_s,
            loop_start: 0,
            exposure_ev100: 0.0,
            layers: options.layers,
            aovs: options.aovs,
            figures: options.figures,
            display: options.display,
            wind,
            occluders,
            plate_light: Arc::default(),
            assets,
            scene,
        };
        plan.close_loop()?;
        Ok(plan)
    }

    /// The shot, its loop begun at a calm moment. What cannot be drawn to find that will say so when it is drawn.
    fn begun_calmly(self) -> Self {
        let loop_start = self.loop_s.and_then(|_| cpu::calmest_start(&self).ok()).unwrap_or_default();
        Self { loop_start, ..self }
    }

    /// The same shot in another size, whole and without overscan.
    #[must_use]
    pub fn at_size(&self, size: [usize; 2]) -> Self {
        let window = Rect::of_size(size[0], size[1]);
        let mut plan = Self { size, window, plate_light: Arc::default(), ..self.clone() };
        plan.scene.picture.overscan = 0;
        plan
    }

    /// The same shot in another size and without overscan, of which only `crop` is drawn.
    ///
    /// # Errors
    /// A size that no picture has, or a crop that reaches outside it.
    pub fn cropped(&self, size: [usize; 2], crop: Rect) -> Result<Self, PlanError> {
        Ok(Self { window: window(size, 0, Some(crop))?, ..self.at_size(size) })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Size of the picture without overscan, pixels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The part to draw, within the picture with its overscan.
    pub fn window(&self) -> Rect {
        self.window
    }

    /// Makes every enabled phenomenon, at its beginning; then the scene's own lamps, ground and sky.
    ///
    /// # Errors
    /// A phenomenon cannot be made.
    pub fn open(&self) -> Result<Vec<Box<dyn Phenomenon>>, PlanError> {
        phenomena::parts(&self.scene).iter().map(|part| part.open(self)).collect()
    }

    /// What users should know of how phenomena will look, each with its phenomenon's name.
    ///
    /// # Errors
    /// A phenomenon cannot be made.
    pub fn remarks(&self) -> Result<Vec<(String, Remark)>, PlanError> {
        cpu::remarks(self)
    }

    /// Frames a second.
    pub fn fps(&self) -> FrameRate {
        self.scene.picture.fps
    }

    /// The numbers of the whole shot's frames; of one turn where it is a loop.
    pub fn frames(&self) -> std::ops::Range<i64> {
        let count = match self.loop_s {
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
        let index = match self.loop_s {
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
        let overscan = self.scene.picture.overscan as usize;
        let next = shutter.middle() + self.fps().frame_s();
        let mut view = View::new(self.scene.camera.clone(), shutter, next, self.size, overscan);
        view.white_luminance = Some(color::white_luminance(f64::from(self.exposure_ev100)));
        view.measured = self.aovs;
        let view = view.through(self.window);
        match self.loop_s {
            Some(turn) => view.in_loop(turn),
            None => view,
        }
    }

    /// The header of frame `number`.
    pub fn header(&self, number: i64) -> FrameHeader {
        let view = self.view(number);
        let overscan = self.scene.picture.overscan;
        FrameHeader {
            number,
            exposure_ev100: self.exposure_ev100,
            white_balance_k: self.scene.picture.white_balance_k.map(|kelvin| kelvin as f32),
            fps: [self.fps().frames, self.fps().seconds],
            exposure_time_s: view.shutter.duration() as f32,
            camera: self.scene.camera.at(view.shutter.middle(), self.size).header(),
            fingerprint: fingerprint::of_frame(self, number),
            display_size: self.size,
            data_origin: [self.window.x as i64 - overscan, self.window.y as i64 - overscan],
        }
    }

    /// What absolute radiance is multiplied by, so that 1.0 is display white.
    pub fn exposure_scale(&self) -> f32 {
        color::exposure_scale(f64::from(self.exposure_ev100)) as f32
    }

    /// The light of the sky at time `t`: the scene's own, or where there is a plate in its place what that plate shows, which is as bright
    /// as the plate looks at the shot's exposure.
    pub fn sky(&self, t: f64) -> Sky {
        if let Some(sky) = &self.scene.sky {
            return sky.at(t);
        }
        let light = get_or_make(&self.plate_light, || cpu::plate_light(self));
        light.map_or(Sky::DARK, |light| Sky::measured(light.scaled(1.0 / self.exposure_scale())))
    }

    /// The exposure value of a plate that neither the scene nor the picture states, and the shot therefore assumes.
    pub(crate) fn assumed_plate_ev100(&self) -> Option<f64> {
        let is_open = self.scene.has_plate() && self.scene.picture.exposure_ev100 == Auto::Auto;
        (is_open && exposure::of_plate(self).is_none()).then(|| f64::from(self.exposure_ev100))
    }

    /// How display formats show the picture, with the camera's white balance.
    pub fn shown(&self) -> color::View {
        self.display.balanced(self.scene.picture.white_balance_k)
    }

    fn exposure(&self) -> Result<f32, PlanError> {
        // Those that were made already need not be made again.
        let as_read = self.loop_s.is_none() && self.seed == self.scene.picture.seed as u64;
        let mut brightest = 0.0_f64;
        for part in phenomena::parts(&self.scene) {
            let luminance = match part.luminance().filter(|_| as_read) {
                Some(luminance) => luminance,
                None => part.open(self)?.luminance(),
            };
            brightest = brightest.max(luminance);
        }
        Ok(match self.scene.picture.exposure_ev100 {
            Auto::Set(ev100) => ev100 as f32,
            Auto::Auto => exposure::of_plate(self).unwrap_or_else(|| exposure::automatic(self, brightest)) as f32,
        })
    }

    /// Makes keyed values repeat, which must come back to where they began.
    fn close_loop(&mut self) -> Result<(), PlanError> {
        let Some(seconds) = self.loop_s else { return Ok(()) };
        let scene = &mut self.scene;
        let jumps = |table: &SharedTable| (table.close_loop)(scene, seconds).map(|rest| path(table.key, &rest));
        match SHARED_TABLES.iter().find_map(jumps) {
            Some(what) => Err(PlanError::LoopJumps { seconds, what }),
            None => Ok(()),
        }
    }
}

pub(crate) fn opening_error(name: String, fault: OpeningFault) -> PlanError {
    PlanError::Opening { name, key: fault.key.clone(), fault: Box::new(fault) }
}

/// The scene's obstacles.
fn occluders(scene: &Scene, assets: &dyn Assets) -> Result<Vec<Occluder>, PlanError> {
    let open = |(index, obstacle): (usize, &ObstacleParameters)| {
        obstacle.open(assets).map_err(|fault| opening_error(format!("obstacle {}", index + 1), fault))
    };
    scene.obstacles.iter().enumerate().map(open).collect()
}

/// The nearest whole number of frames.
fn loop_length(seconds: f64, fps: FrameRate) -> Result<f64, PlanError> {
    let min = 2.0 * fps.frame_s();
    if !(min * 0.999..=3600.0).contains(&seconds) {
        let min = (1e3 * min).ceil() / 1e3;
        return Err(PlanError::LoopLength { seconds, min });
    }
    Ok((seconds / fps.frame_s()).round() * f64::from(fps.seconds) / f64::from(fps.frames))
}

/// The drawn part within the picture with its overscan; crops count from the picture's own corner.
fn window(size: [usize; 2], overscan: usize, crop: Option<Rect>) -> Result<Rect, PlanError> {
    let most = crate::scene::picture::LARGEST_SIDE as usize;
    let [width, height] = size;
    if !(1..=most).contains(&width) || !(1..=most).contains(&height) {
        return Err(PlanError::Size { width, height, most });
    }
    let Some(crop) = crop else {
        return Ok(Rect::of_size(width + 2 * overscan, height + 2 * overscan));
    };
    let inside = |start: usize, length: usize, side: usize| length > 0 && start < side && length <= side - start;
    if !inside(crop.x, crop.width, width) || !inside(crop.y, crop.height, height) {
        return Err(PlanError::CropOutside { crop: [crop.x, crop.y, crop.width, crop.height], size });
    }
    Ok(Rect { x: crop.x + overscan, y: crop.y + overscan, ..crop })
}
