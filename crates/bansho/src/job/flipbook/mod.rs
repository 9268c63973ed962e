//! Flipbooks for game engines: all frames in one sheet, their alpha and motion in sheets beside it, and a JSON that says
//! how to read them.

pub(crate) mod contact_sheet;
mod crop;
mod files;
mod motion;
pub(crate) mod tiles;

use std::{path::PathBuf, sync::Arc};

use bansho_base::{
    color::{AlphaConvention, View},
    image::Rect,
};
use bansho_media::{
    files::{naming::OutputPattern, overwrite_policy::OverwritePolicy},
    format::OutputKind,
    imageops::sprite_sheet::SheetLayout,
};
use bansho_render::{CompiledScene, Plan, PlanOptions, Shot, display::BitDepth};
use bansho_scene::{FrameRate, Scene, SceneOptions};

use self::{files::Files, motion::Tile};
use super::{
    error::{Conflict, JobError, SheetKind},
    observer::{JobObserver, Note, Outline},
    scene_file::SceneFile,
    snapshots::Snapshots,
};
use crate::job::{
    checks::{
        memory::{self, MemoryRequest},
        overwrite, plates,
    },
    render::{draw_frames::draw_frames, output, prepare},
};
use tiles::Gather;

pub use self::crop::FlipbookCrop;

/// A flipbook that is wanted. Begin with [`Flipbook::new`].
///
/// PNG: color in sRGB with straight alpha; alpha again, as gray, for engines that want it apart; motion in pixels to
/// the next frame, in 16 bits around a middle that means none. EXR: color scene-linear with premultiplied alpha; motion in
/// pixels as it is.
#[derive(Clone, Debug)]
pub struct Flipbook {
    /// The scene.
    pub scene: SceneFile,
    /// Columns and rows of the sheet.
    pub grid: [usize; 2],
    /// Size of one frame, pixels; in the scene's proportions so that the sheet is up to 2048 wide or high when left out.
    pub tile: Option<[usize; 2]>,
    /// What of the picture tiles show. With a part of it, `tile` is the size of the whole picture; left out, it is such that the part fills
    /// the tiles of a sheet of up to 2048 pixels, but at most twice the scene's.
    pub crop: FlipbookCrop,
    /// The first frame; the scene's first when left out.
    pub first_frame: Option<i64>,
    /// Another seed than the scene's.
    pub seed: Option<u64>,
    /// A seamless loop of so many seconds; the sheet then holds exactly one turn, at whatever frame rate that takes.
    pub loop_s: Option<f64>,
    /// How PNG sheets show the light.
    pub view: View,
    /// Bits of each channel of PNG sheets, but for motion.
    pub bits: BitDepth,
    /// What the straight alpha of PNG sheets is made for; left out it is [`AlphaConvention::Linear`], since engines blend sprites in linear
    /// light.
    pub alpha: Option<AlphaConvention>,
    /// Where it goes: `DIR/NAME.png` stands for `NAME_color.png` and so on; `out/STEM/STEM.png` when left out.
    pub out: Option<PathBuf>,
    /// Whether files that Bansho did not make may be written over. What the scene is read from never is.
    pub overwrite: bool,
}

/// What a flipbook became.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FlipbookSummary {
    /// Its files, the JSON last.
    pub files: Vec<PathBuf>,
}

/// Largest side of a sheet of frames whose size is not given, pixels.
const USUAL_SIDE: usize = 2048;

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
            view: View::DISPLAY,
            bits: BitDepth::Eight,
            alpha: None,
            out: None,
            overwrite: false,
        }
    }

    /// Checks everything: the scene and what it names, the options, whether the sheets can be written. Writes nothing.
    ///
    /// # Errors
    /// The first thing that stands in the way; of the scene all faults at once.
    pub fn prepare(&self) -> Result<PreparedFlipbook, JobError> {
        let mut scene = self.scene.parse()?;
        let [columns, rows] = self.grid;
        let sheet = SheetLayout { count: columns.saturating_mul(rows), columns, cell: self.cell(&scene), gutter: 0 };
        let sheet = tiles::checked(sheet, SheetKind::Flipbook)?;
        if let Some(seconds) = self.loop_s {
            scene.picture.fps = turn_rate(sheet.count, seconds)?;
        }
        let options = PlanOptions {
            size: Some(sheet.cell),
            layers: true,
            aovs: true,
            display: self.view,
            ..PlanOptions::default()
        };
        let wish = SceneOptions { seed: self.seed, loop_s: self.loop_s, implied_backdrop: false };
        let compiled = self.scene.compile(scene.adapted(&wish)?, &prepare::assets(&self.scene))?;
        let plan = Arc::new(Plan::new(&compiled, &options)?);
        let first = self.first_frame.unwrap_or(plan.frames().start);
        let numbers: Vec<i64> = (first..first.saturating_add(sheet.count as i64)).collect();
        plates::check(&self.scene, &compiled, &numbers)?;
        let frames = numbers.len();
        let wanted = MemoryRequest { frames, tiles: frames, display: Some(self.bits), own_size: true };
        memory::check(&self.scene, &compiled, &plan, wanted)?;
        let overwrite = OverwritePolicy::new(overwrite::inputs(&self.scene, &plan, &numbers), self.overwrite);
        let files = self.files(overwrite)?;
        overwrite::check(&files.overwrite, files.paths())?;
        let (scene, own_size, crop) = (self.scene.clone(), self.tile.is_some(), self.crop);
        Ok(PreparedFlipbook { scene, compiled, plan, sheet, own_size, crop, numbers, files })
    }

    /// Size of a frame: as asked for, or the scene's made small enough for a sheet of the usual side.
    fn cell(&self, scene: &Scene) -> [usize; 2] {
        let [columns, rows] = self.grid;
        let [width, height] = scene.picture.size.map(|side| side as usize);
        self.tile.unwrap_or_else(|| {
            let sides = (columns.saturating_mul(width)).max(rows.saturating_mul(height)).max(USUAL_SIDE);
            [width, height].map(|side| (side * USUAL_SIDE / sides).max(1))
        })
    }

    fn files(&self, overwrite: OverwritePolicy) -> Result<Files, JobError> {
        let stem = &self.scene.stem;
        let path = self.out.clone().unwrap_or_else(|| PathBuf::from("out").join(stem).join(format!("{stem}.png")));
        let pattern = OutputPattern::parse(&path, 1)?;
        let is_picture = match pattern.kind() {
            OutputKind::Png | OutputKind::Exr => true,
            OutputKind::Apng | OutputKind::Gif | OutputKind::Mp4 | OutputKind::Mov | OutputKind::Webm => false,
        };
        if !is_picture || pattern.is_numbered() {
            return Err(Conflict::Sheet { path, allowed: "NAME.png or NAME.exr" }.into());
        }
        let alpha = prepare::alpha_convention(self.alpha, self.view, AlphaConvention::Linear)?;
        let base = path.with_extension("");
        let files = Files { base, kind: pattern.kind(), view: self.view, bits: self.bits, alpha, overwrite };
        files.paths().iter().try_for_each(|path| output::check_writable(path))?;
        Ok(files)
    }
}

/// A flipbook that can be made, as far as can be known without doing so.
pub struct PreparedFlipbook {
    scene: SceneFile,
    compiled: Arc<CompiledScene>,
    plan: Arc<Plan>,
    sheet: SheetLayout,
    own_size: bool,
    crop: FlipbookCrop,
    numbers: Vec<i64>,
    files: Files,
}

impl PreparedFlipbook {
    /// How many frames it has.
    pub fn frame_count(&self) -> usize {
        self.numbers.len()
    }

    /// Draws all frames in the caller's rayon pool and writes the sheets.
    ///
    /// # Errors
    /// The observer asked to stop, or a sheet cannot be written.
    pub fn run(&self, observer: &dyn JobObserver) -> Result<FlipbookSummary, JobError> {
        let Self { scene, compiled, numbers, files, .. } = self;
        observer.started(&Outline { total: numbers.len(), kept: 0, size: self.sheet.cell });
        let located = |error| plates::located(scene, error).of_whole("a flipbook");
        let (plan, sheet) = &self.cropped(observer).map_err(located)?;
        let gather = Gather::new(sheet.count, observer, |frame, observer| Tile::of(frame, files, observer));
        let mut shot = Shot::open(compiled.clone(), plan.clone());
        draw_frames(&mut shot, numbers, &Snapshots::default(), &gather, observer).map_err(located)?;
        let tiles = gather.into_tiles();
        if !tiles.iter().any(|tile| tile.has_motion) {
            observer.note(&Note::NoMotion);
        }
        files.write(plan, sheet, numbers, &tiles, observer).map_err(|error| error.of_whole("a flipbook"))
    }
}

impl PreparedFlipbook {
    /// The plan and the sheet of what tiles show: first it must be known what is lit.
    fn cropped(&self, observer: &dyn JobObserver) -> Result<(Arc<Plan>, SheetLayout), JobError> {
        let all = || Ok((self.plan.clone(), self.sheet));
        if self.crop == FlipbookCrop::None {
            return all();
        }
        let exact = self.files.is_exact();
        let region = crop::lit(&self.compiled, &self.plan, &self.numbers, exact, observer)?;
        let most = [self.sheet.columns, self.sheet.rows()].map(|tiles| USUAL_SIDE / tiles);
        let whole = self.plan.scene().picture.size.map(|side| side as usize);
        let fitting = |region: crop::Region| {
            let size = if self.own_size { self.plan.size() } else { region.picture(whole, most)? };
            let part = region.within(size);
            // All of it is drawn as it is without a crop.
            (part != Rect::from_size(size[0], size[1])).then_some((size, part))
        };
        let Some((size, part)) = region.and_then(fitting) else { return all() };
        let plan = Arc::new(self.plan.cropped(size, part)?);
        let sheet = tiles::checked(SheetLayout { cell: [part.width, part.height], ..self.sheet }, SheetKind::Flipbook)?;
        let frames = self.numbers.len();
        let wanted = MemoryRequest { frames, tiles: frames, display: Some(self.files.bits), own_size: true };
        memory::check(&self.scene, &self.compiled, &plan, wanted)?;
        Ok((plan, sheet))
    }
}

/// The frame rate at which `count` frames last `seconds`.
fn turn_rate(count: usize, seconds: f64) -> Result<FrameRate, Conflict> {
    if !(0.01..=3600.0).contains(&seconds) {
        return Err(Conflict::LoopLength(seconds));
    }
    Ok(FrameRate { frames: count as u32 * 1000, seconds: (seconds * 1000.0).round() as u32 })
}
