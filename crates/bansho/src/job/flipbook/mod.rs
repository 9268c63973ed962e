//! Flipbooks for game engines: all frames in one sheet, their alpha and motion in further sheets, and a JSON file that describes how to read
//! them.

mod crop;
mod files;
mod lights;
mod motion;

use std::{path::PathBuf, sync::Arc};

use bansho_base::{
    color::{AlphaConvention, View},
    image::Rect,
};
use bansho_media::{
    files::{
        naming::{self, OutputPattern},
        overwrite_policy::OverwritePolicy,
    },
    format::OutputKind,
    imageops::sprite_sheet::SheetLayout,
};
use bansho_render::{CompiledScene, Plan, PlanOptions, Shot, display::BitDepth};
use bansho_scene::{FrameRate, Scene, SceneOptions};

use self::{
    files::{DrawnFrames, Files, Tile},
    lights::LightRecorder,
};
use super::{
    FramesInFlight,
    checks::{
        memory::{self, MemoryRequest},
        outputs, plates,
    },
    error::{JobError, OptionError, SheetKind},
    observer::{JobObserver, JobStarted, Warning},
    pipeline::{draw_frames::draw_frames, snapshots::Snapshots},
    render::prepare,
    scene_file::SceneFile,
    sheet::{self, TileCollector},
};

pub use self::crop::FlipbookCrop;

/// A flipbook of a scene. Create it with [`Flipbook::new`].
///
/// PNG: color in sRGB with straight alpha; alpha also as a gray picture, for engines that read it separately; motion to the next frame in
/// pixels, in 16 bits with a middle code for zero. EXR: color scene-linear with premultiplied alpha; motion in pixels.
#[derive(Clone, Debug)]
pub struct Flipbook {
    /// The scene.
    pub scene: SceneFile,
    /// Columns and rows of the sheet.
    pub grid: [usize; 2],
    /// Size of one frame, pixels. `None` chooses a size in the scene's proportions with which the sheet is up to 2048 wide or high.
    pub tile: Option<[usize; 2]>,
    /// The part of the picture that tiles show. If it is cropped, `tile` is the size of the whole picture; `None` then chooses a size with
    /// which the part fills the tiles of a sheet of up to 2048 pixels, but at most twice the scene's size.
    pub crop: FlipbookCrop,
    /// The first frame; `None` for the scene's first.
    pub first_frame: Option<i64>,
    /// Replaces the scene's seed.
    pub seed: Option<u64>,
    /// Makes a seamless loop of this length, s. The sheet then contains exactly one pass through it, at the frame rate that follows from this.
    pub loop_s: Option<f64>,
    /// The view transform of PNG sheets; `None` for that of the scene.
    pub view: Option<View>,
    /// Bits of each channel of PNG sheets, except motion, which always has 16.
    pub bits: BitDepth,
    /// Convention of the straight alpha of PNG sheets. `None` is [`AlphaConvention::Linear`], since engines blend sprites in linear light.
    pub alpha: Option<AlphaConvention>,
    /// Whether the lights of the flames are also written as glTF, `DIR/NAME.gltf`.
    pub gltf: bool,
    /// The output: `DIR/NAME.png` for `NAME_color.png` and so on. `None` is `out/STEM/STEM.png`.
    pub out: Option<PathBuf>,
    /// Whether files that Bansho did not make may be overwritten. Files that the scene is read from never are.
    pub overwrite: bool,
}

/// The result of a flipbook job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FlipbookSummary {
    /// Number of its frames.
    pub frames: usize,
    /// Its files, the JSON last.
    pub files: Vec<PathBuf>,
}

/// Largest side of a sheet if the size of its frames is not given, pixels.
const DEFAULT_SHEET_SIDE: usize = 2048;

impl Flipbook {
    /// A flipbook of `grid` columns and rows from the first frames of `scene`.
    pub fn new(scene: SceneFile, grid: [usize; 2]) -> Self {
        Self {
            scene,
            grid,
            tile: None,
            crop: FlipbookCrop::Auto,
            first_frame: None,
            seed: None,
            loop_s: None,
            view: None,
            bits: BitDepth::Eight,
            alpha: None,
            gltf: false,
            out: None,
            overwrite: false,
        }
    }

    /// Checks everything: the scene and the files that it names, the options, whether the sheets can be written. Writes nothing.
    ///
    /// # Errors
    /// The first obstacle; of the scene, all problems at once.
    pub fn prepare(&self) -> Result<PreparedFlipbook, JobError> {
        let mut scene = self.scene.parse()?;
        let [columns, rows] = self.grid;
        let sheet = SheetLayout { count: columns.saturating_mul(rows), columns, cell: self.cell(&scene), gutter: 0 };
        let sheet = sheet::check_layout(sheet, SheetKind::Flipbook)?;
        if let Some(seconds) = self.loop_s {
            scene.picture.fps = loop_frame_rate(sheet.count, seconds)?;
        }
        let options = PlanOptions {
            size: Some(sheet.cell),
            layers: true,
            aovs: true,
            display: self.view,
            ..PlanOptions::default()
        };
        let scene_options = SceneOptions { seed: self.seed, loop_s: self.loop_s, implied_backdrop: false };
        let compiled = self.scene.compile(scene.with_options(&scene_options)?, &self.scene.assets())?;
        let plan = Arc::new(Plan::new(&compiled, &options)?);
        let first = self.first_frame.unwrap_or(plan.frames().start);
        let numbers: Vec<i64> = (first..first.saturating_add(sheet.count as i64)).collect();
        plates::check(&self.scene, &compiled, &numbers)?;
        let frames = numbers.len();
        let request = memory_request(frames, self.bits);
        memory::check(&self.scene, &compiled, &plan, request)?;
        let overwrite = OverwritePolicy::new(outputs::input_files(&self.scene, &plan, &numbers), self.overwrite);
        let files = self.files(plan.display, overwrite)?;
        files.paths().iter().try_for_each(|path| outputs::check_writable(path))?;
        outputs::check_overwriting(&files.overwrite, files.paths())?;
        let memory_bytes = memory::estimated_bytes(&compiled, &plan, request);
        let (scene, size_is_option, crop) = (self.scene.clone(), self.tile.is_some(), self.crop);
        Ok(PreparedFlipbook { scene, compiled, plan, sheet, size_is_option, crop, numbers, files, memory_bytes })
    }

    /// All its files, the JSON last.
    ///
    /// # Errors
    /// The output is not the name of a picture.
    pub fn paths(&self) -> Result<Vec<PathBuf>, JobError> {
        Ok(self.files(self.view.unwrap_or_default(), OverwritePolicy::default())?.paths())
    }

    /// Size of a tile: that of the options, or the scene's, reduced until the sheet is no larger than [`DEFAULT_SHEET_SIDE`].
    fn cell(&self, scene: &Scene) -> [usize; 2] {
        let [columns, rows] = self.grid;
        let [width, height] = scene.picture.size.map(|side| side as usize);
        self.tile.unwrap_or_else(|| {
            let sides = (columns.saturating_mul(width)).max(rows.saturating_mul(height)).max(DEFAULT_SHEET_SIDE);
            [width, height].map(|side| (side * DEFAULT_SHEET_SIDE / sides).max(1))
        })
    }

    fn files(&self, view: View, overwrite: OverwritePolicy) -> Result<Files, JobError> {
        let stem = &self.scene.stem;
        let path = match &self.out {
            Some(path) => path.clone(),
            None => PathBuf::from("out").join(stem).join(format!("{}.png", naming::literal_pattern(stem))),
        };
        let pattern = OutputPattern::parse(&path, 1)?;
        let is_picture = match pattern.kind() {
            OutputKind::Png | OutputKind::Exr => true,
            OutputKind::Apng | OutputKind::Gif | OutputKind::Mp4 | OutputKind::Mov | OutputKind::Webm => false,
        };
        if !is_picture || pattern.is_numbered() {
            return Err(OptionError::SheetFormat { path, allowed: "NAME.png or NAME.exr" }.into());
        }
        let alpha = prepare::alpha_convention(self.alpha, view, AlphaConvention::Linear)?;
        let base = pattern.path(0).with_extension("");
        let (kind, bits, gltf) = (pattern.kind(), self.bits, self.gltf);
        Ok(Files { base, kind, view, bits, alpha, gltf, overwrite })
    }
}

/// A checked flipbook, ready to run.
pub struct PreparedFlipbook {
    scene: SceneFile,
    compiled: Arc<CompiledScene>,
    plan: Arc<Plan>,
    sheet: SheetLayout,
    size_is_option: bool,
    crop: FlipbookCrop,
    numbers: Vec<i64>,
    files: Files,
    memory_bytes: f64,
}

impl PreparedFlipbook {
    /// How many frames it has.
    pub fn frame_count(&self) -> usize {
        self.numbers.len()
    }

    /// Estimated peak memory of the process while it is made, bytes.
    pub fn memory_bytes(&self) -> f64 {
        self.memory_bytes
    }

    /// How many frames are drawn at once in the caller's rayon pool; fewer if the crop makes them larger.
    pub fn frames_in_flight(&self) -> usize {
        let request = memory_request(self.numbers.len(), self.files.bits);
        memory::frames_drawn_at_once(&self.compiled, &self.plan, request)
    }

    /// Draws all frames in the caller's rayon pool and writes the sheets.
    ///
    /// # Errors
    /// The observer canceled the job, or a sheet cannot be written.
    pub fn run(&self, observer: &dyn JobObserver) -> Result<FlipbookSummary, JobError> {
        let Self { compiled, numbers, files, .. } = self;
        observer.started(&JobStarted { frames: numbers.len(), kept: 0, size: self.sheet.cell });
        let (plan, sheet) = &self.cropped(observer).map_err(|error| self.described(error))?;
        let collector = TileCollector::new(sheet.count, observer, |frame, observer| files.tile(frame, observer));
        let mut shot = LightRecorder::new(Shot::open(compiled.clone(), plan.clone()));
        let at_once = memory::frames_drawn_at_once(compiled, plan, memory_request(numbers.len(), files.bits));
        let at_once = at_once.min(self.frames_in_flight());
        draw_frames(&mut shot, numbers, &Snapshots::default(), at_once, &collector, observer)
            .map_err(|error| self.described(error))?;
        let tiles = collector.into_tiles();
        if !tiles.iter().any(Tile::has_motion) {
            observer.warning(&Warning::NoMotion);
        }
        let drawn = DrawnFrames { numbers, tiles: &tiles, lights: &shot.into_lights() };
        files.write(plan, sheet, &drawn, observer).map_err(|error| error.for_single_file("a flipbook"))
    }

    /// An error of drawing, with the position of a plate in the scene.
    fn described(&self, error: JobError) -> JobError {
        plates::with_position(&self.scene, error).for_single_file("a flipbook")
    }

    /// The size of the picture, and the part of it that is drawn, so that `region` fills a tile; `None` if it does not fit, or is the whole picture,
    /// which is drawn like a flipbook without a crop.
    fn size_and_crop(&self, region: &crop::Region) -> Option<([usize; 2], Rect)> {
        let size = if self.size_is_option {
            self.plan.size()
        } else {
            let max_tile = [self.sheet.columns, self.sheet.rows()].map(|tiles| DEFAULT_SHEET_SIDE / tiles);
            region.picture_size(self.plan.scene().picture.size.map(|side| side as usize), max_tile)?
        };
        let crop = region.pixels(size);
        (crop != Rect::from_size(size[0], size[1])).then_some((size, crop))
    }

    /// The plan and the layout of the cropped flipbook. Finding the lit region draws small pictures of all frames.
    fn cropped(&self, observer: &dyn JobObserver) -> Result<(Arc<Plan>, SheetLayout), JobError> {
        if self.crop == FlipbookCrop::None {
            return Ok((self.plan.clone(), self.sheet));
        }
        let exact = self.files.is_exact();
        let region = crop::lit_region(&self.compiled, &self.plan, &self.numbers, exact, observer)?;
        let Some((size, crop)) = region.and_then(|region| self.size_and_crop(&region)) else {
            return Ok((self.plan.clone(), self.sheet));
        };
        let plan = Arc::new(self.plan.cropped(size, crop)?);
        let layout = SheetLayout { cell: [crop.width, crop.height], ..self.sheet };
        let sheet = sheet::check_layout(layout, SheetKind::Flipbook)?;
        let frames = self.numbers.len();
        let request = memory_request(frames, self.files.bits);
        memory::check(&self.scene, &self.compiled, &plan, request)?;
        Ok((plan, sheet))
    }
}

/// What the memory of a sheet of so many frames depends on.
fn memory_request(frames: usize, bits: BitDepth) -> MemoryRequest {
    let in_flight = FramesInFlight::Auto;
    MemoryRequest { frames, tiles: frames, display: Some(bits), size_is_option: true, in_flight }
}

/// The frame rate at which `count` frames last `seconds`.
fn loop_frame_rate(count: usize, seconds: f64) -> Result<FrameRate, OptionError> {
    if !(0.01..=3600.0).contains(&seconds) {
        return Err(OptionError::LoopLength(seconds));
    }
    Ok(FrameRate { frames: count as u32 * 1000, seconds: (seconds * 1000.0).round() as u32 })
}
