//! Checks a job before anything is drawn or written.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use bansho_base::{
    color::{AlphaConvention, View},
    frame::{DisplayImage, Frame},
    host::observer::Observer,
    phenomenon::Remark,
};
use bansho_media::{
    files::{
        naming::{self, OutputPattern},
        overwrite_policy::OverwritePolicy,
    },
    format::OutputKind,
    imageops::sprite_sheet::SheetLayout,
    output::sink::Sink,
};
use bansho_render::{CompiledScene, GlareUse, Plan, PlanOptions, display::BitDepth};
use bansho_scene::{Positions, SceneOptions, picture};

use super::{
    contact_sheet::{self, ContactBackground},
    metadata,
    output::Format,
};
use crate::job::{
    FramesInFlight, Job,
    checks::{
        memory::{self, MemoryRequest},
        outputs, plates,
    },
    error::{ChannelKind, JobError, OptionError, SheetKind},
    observer::{FilePosition, Warning},
    pipeline::snapshots::Snapshots,
    scene_file::SceneFile,
    sheet::{self, MAX_TILES},
};

/// A checked job, ready to run.
pub struct PreparedJob {
    pub(crate) scene: SceneFile,
    pub(crate) compiled: Arc<CompiledScene>,
    pub(crate) plan: Arc<Plan>,
    pub(crate) frames: Vec<i64>,
    pub(crate) format: Format,
    /// The layout of a contact sheet, if all frames go into one picture.
    pub(crate) sheet: Option<SheetLayout>,
    pub(crate) contact_background: ContactBackground,
    pub(crate) resume: bool,
    pub(crate) snapshots: Snapshots,
    pub(crate) warnings: Vec<Warning>,
    pub(crate) memory_bytes: f64,
    pub(crate) drawn_at_once: usize,
}

impl PreparedJob {
    /// The plan of the shot.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The frames of the job, ascending.
    pub fn frames(&self) -> &[i64] {
        &self.frames
    }

    /// The output files.
    pub fn output(&self) -> &OutputPattern {
        &self.format.pattern
    }

    /// Whether anything in the scene is simulated in steps, so that frames are not independent.
    pub fn is_stepped(&self) -> bool {
        self.compiled.is_stepped()
    }

    /// Estimated peak memory of the process during the job, bytes.
    pub fn memory_bytes(&self) -> f64 {
        self.memory_bytes
    }

    /// How many frames are drawn at once.
    pub fn frames_in_flight(&self) -> usize {
        self.drawn_at_once
    }

    /// Which existing files may be overwritten.
    pub fn overwrite_policy(&self) -> &OverwritePolicy {
        &self.format.overwrite
    }

    /// Whether every pixel of the pictures is opaque, as over an opaque plate.
    pub fn is_opaque(&self) -> bool {
        self.compiled.has_opaque_plate()
    }

    /// Opens the files of `pattern` for `count` pictures of `size` pixels, one after the other, in the format and under the policy of this job: for what is
    /// made of its finished frames, such as a film.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn open_sink(&self, pattern: OutputPattern, count: usize, size: [usize; 2]) -> Result<Sink, JobError> {
        let format = Format { pattern, ..self.format.clone() };
        format.open(&self.plan, self.is_opaque(), count, size, 1)
    }

    /// The display pixels of `frame` by the view of the job.
    pub fn to_display(&self, frame: &Frame, observer: &dyn Observer) -> DisplayImage {
        self.format.to_display(frame, observer)
    }

    /// The layout of a contact sheet of up to `count` frames of the job, which is nearest to a square.
    ///
    /// # Errors
    /// The sheet would be too large.
    pub fn contact_sheet_layout(&self, count: usize) -> Result<SheetLayout, JobError> {
        let (window, count) = (self.plan.window(), count.min(self.frames.len()));
        Ok(sheet::nearly_square_layout(count, [window.width, window.height], contact_sheet::GUTTER)?)
    }

    /// What the user should know before the job begins.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }
}

/// Checks a scene and all files that it names, and plans its shot without further options.
///
/// # Errors
/// The problems of the scene, a missing plate, or too little memory.
pub fn check_scene(scene: &SceneFile) -> Result<(Arc<CompiledScene>, Plan), JobError> {
    let compiled = scene.compile(
        scene.parse()?.with_options(&SceneOptions { implied_backdrop: true, ..SceneOptions::default() })?,
        &scene.assets(),
    )?;
    let plan = Plan::new(&compiled, &PlanOptions::default())?;
    // With the overscan, which only EXR files have.
    let with_overscan = PlanOptions { overscan: true, ..PlanOptions::default() };
    let with_overscan =
        Plan::with_exposure_and_loop_start(plan.scene().clone(), &with_overscan, plan.exposure_ev100, plan.loop_start)?;
    let frames = (plan.frames().end - plan.frames().start) as usize;
    let display = (with_overscan.overscan() == 0).then_some(BitDepth::Eight);
    let request = MemoryRequest { frames, tiles: 0, display, size_is_option: false, in_flight: FramesInFlight::Auto };
    memory::check(scene, &compiled, &with_overscan, request)?;
    plates::check(scene, &compiled, &plan.frames().collect::<Vec<_>>())?;
    Ok((compiled, plan))
}

/// Warnings about how the phenomena of a scene will look, each with its position in the file.
pub fn remarks(scene: &SceneFile, compiled: &Arc<CompiledScene>, plan: &Plan) -> Vec<Warning> {
    let changed = scene.changed().unwrap_or_else(|_| scene.text.clone());
    let of_rate =
        picture::frame_rate_remark(&changed).map(|message| ("picture".to_owned(), Remark::at("fps", message)));
    let mut remarks = bansho_render::remarks::remarks(compiled, plan);
    remarks.extend(of_rate);
    if remarks.is_empty() {
        return Vec::new();
    }
    let mut positions = Positions::new(plan.scene(), &scene.text);
    let mut warnings = Vec::with_capacity(remarks.len());
    for (name, remark) in remarks {
        let position = positions.find(&name, remark.key.as_deref());
        let position = position.map(|position| FilePosition { file: scene.name.clone(), position });
        warnings.push(Warning::Remark { position, name, remark });
    }
    warnings
}

impl Job {
    /// Checks everything: the scene and the files that it names, the options, whether the output can be written. Writes nothing.
    ///
    /// # Errors
    /// The first obstacle; of the scene, all problems at once.
    pub fn prepare(&self) -> Result<PreparedJob, JobError> {
        let scene = self.scene.parse()?;
        let kind = self.output_kind()?;
        self.check_channels(kind)?;
        self.check_metadata(kind)?;
        let view = self.view.unwrap_or_else(|| scene.picture.view.into());
        check_view(view, kind, &self.output_path())?;
        let alpha = alpha_convention(self.alpha, view, AlphaConvention::Encoded)?;
        let compiled = self.scene.compile(scene.with_options(&self.scene_options())?, &self.scene.assets())?;
        let mut plan = Plan::new(&compiled, &self.plan_options(kind, view))?;
        plan.depth = kind.is_scene_linear();
        let plan = Arc::new(plan);
        let frames = self.selected_frames(&plan)?;
        plates::check(&self.scene, &compiled, &frames)?;
        let files = if self.contact_sheet.is_some() { 1 } else { frames.len() };
        let pattern = OutputPattern::parse(&self.output_path(), files)?;
        outputs::check_writable(&pattern.path(frames[0]))?;
        let overwrite = OverwritePolicy::new(outputs::input_files(&self.scene, &plan, &frames), self.overwrite);
        outputs::check_overwriting(&overwrite, self.outputs(&pattern, &frames))?;
        let tile = [plan.window().width, plan.window().height];
        let sheet = self
            .contact_sheet
            .map(|tiles| sheet::nearly_square_layout(tiles, tile, contact_sheet::GUTTER))
            .transpose()?;
        let memory_request = self.memory_request(kind, frames.len());
        memory::check(&self.scene, &compiled, &plan, memory_request)?;
        let snapshots = SnapshotOptions { folder: self.snapshots.as_deref(), interval: self.snapshot_every };
        let snapshots = snapshots.prepare(&compiled, &plan, &overwrite)?;
        let mut prepared = PreparedJob {
            scene: self.scene.clone(),
            format: Format { pattern, view, bits: self.bits, alpha, metadata: self.metadata, overwrite },
            resume: self.resume && kind.is_sequence() && sheet.is_none(),
            warnings: Vec::new(),
            memory_bytes: memory::estimated_bytes(&compiled, &plan, memory_request),
            drawn_at_once: memory::frames_drawn_at_once(&compiled, &plan, memory_request),
            compiled,
            plan,
            frames,
            sheet,
            contact_background: self.contact_background,
            snapshots,
        };
        prepared.warnings = self.warnings(&prepared);
        Ok(prepared)
    }

    /// The name of the output: the option, or the default.
    pub fn output_path(&self) -> PathBuf {
        let stem = &self.scene.stem;
        let name = match self.contact_sheet {
            Some(_) => format!("{}.sheet.png", naming::literal_pattern(stem)),
            None => naming::default_sequence(stem),
        };
        self.out.clone().unwrap_or_else(|| PathBuf::from("out").join(stem).join(name))
    }

    fn memory_request(&self, kind: OutputKind, frames: usize) -> MemoryRequest {
        let display = (!kind.is_scene_linear()).then_some(self.bits);
        MemoryRequest {
            frames,
            tiles: self.contact_sheet.unwrap_or(0),
            display,
            size_is_option: self.size.is_some(),
            in_flight: self.frames_in_flight,
        }
    }

    /// Every file that will be written.
    fn outputs<'a>(&self, pattern: &'a OutputPattern, frames: &'a [i64]) -> impl Iterator<Item = PathBuf> + use<'a> {
        let single = self.contact_sheet.is_some() || !pattern.kind().is_sequence();
        let frames = if single { &frames[..1] } else { frames };
        let with_metadata = self.metadata;
        frames.iter().flat_map(move |&number| {
            let picture = pattern.path(number);
            let metadata = with_metadata.then(|| metadata::path(&picture));
            [Some(picture), metadata].into_iter().flatten()
        })
    }

    fn output_kind(&self) -> Result<OutputKind, JobError> {
        let path = self.output_path();
        let kind = OutputPattern::parse(&path, 2)?.kind();
        if self.contact_sheet.is_some() && kind != OutputKind::Png {
            return Err(OptionError::SheetFormat { path, allowed: ".png" }.into());
        }
        Ok(kind)
    }

    /// Layers and AOVs need a format with many channels.
    fn check_channels(&self, kind: OutputKind) -> Result<(), OptionError> {
        let channels = match (self.layers, self.aovs) {
            (true, _) => ChannelKind::Layers,
            (_, true) => ChannelKind::Aovs,
            _ => return Ok(()),
        };
        if kind.is_scene_linear() {
            return Ok(());
        }
        Err(OptionError::ChannelsUnsupported { channels, path: self.output_path() })
    }

    /// Metadata needs a picture for each frame.
    fn check_metadata(&self, kind: OutputKind) -> Result<(), OptionError> {
        if self.metadata && (self.contact_sheet.is_some() || !kind.is_sequence()) {
            return Err(OptionError::MetadataUnsupported { path: self.output_path() });
        }
        Ok(())
    }

    fn scene_options(&self) -> SceneOptions {
        SceneOptions { seed: self.seed, loop_s: self.loop_s, implied_backdrop: !self.transparent }
    }

    fn plan_options(&self, kind: OutputKind, view: View) -> PlanOptions {
        PlanOptions {
            size: self.size,
            overscan: kind.is_scene_linear(),
            crop: self.crop,
            layers: self.layers,
            aovs: self.aovs,
            metadata: self.metadata,
            glare: self.glare_use(kind, view),
            display: Some(view),
        }
    }

    /// Pictures and films for display have the glare of the camera, scene-linear files have it if this is requested.
    fn glare_use(&self, kind: OutputKind, view: View) -> GlareUse {
        match kind.is_scene_linear() {
            true if self.scene_linear_glare => GlareUse::Always,
            true => GlareUse::Never,
            false if view == View::RAW => GlareUse::Stated,
            false => GlareUse::Always,
        }
    }

    fn selected_frames(&self, plan: &Plan) -> Result<Vec<i64>, JobError> {
        let frames = selected_frames(self.frames.as_deref(), plan)?;
        match self.contact_sheet {
            Some(tiles) if !(1..=MAX_TILES).contains(&tiles) => {
                Err(OptionError::TileCount { sheet: SheetKind::Contact, tiles, max: MAX_TILES }.into())
            }
            None => Ok(frames),
            // No frames or a single one given: consecutive frames from the first, also beyond the end of the shot.
            Some(tiles) if self.frames.is_none() || frames.len() == 1 => {
                Ok((frames[0]..frames[0].saturating_add(tiles as i64)).collect())
            }
            Some(tiles) if frames.len() < tiles => {
                Err(OptionError::TooFewFrames { tiles, frames: frames.len() }.into())
            }
            Some(tiles) => Ok(frames[..tiles].to_vec()),
        }
    }

    fn warnings(&self, job: &PreparedJob) -> Vec<Warning> {
        let kind = job.format.pattern.kind();
        let mut warnings: Vec<Warning> = outside_range(&job.plan, &job.frames).into_iter().collect();
        if let Some(path) = &self.out
            && let Some(part) = OutputPattern::literal_part(path)
        {
            warnings.push(Warning::LiteralName { path: path.clone(), part });
        }
        warnings.extend(remarks(&self.scene, &job.compiled, &job.plan));
        if self.bits == BitDepth::Sixteen && !kind.takes_sixteen_bits() {
            warnings.push(Warning::BitsUnused { kind });
        }
        let scene = job.plan.scene();
        if self.transparent && (scene.has_plate() || scene.shows_stated_backdrop()) {
            warnings.push(Warning::TransparentUnused);
        }
        let has_alpha = kind.has_straight_alpha() && !job.compiled.has_opaque_plate() && job.sheet.is_none();
        if self.alpha.is_some() && !has_alpha {
            warnings.push(Warning::AlphaUnused);
        }
        // With a plate, the view also affects EXR: the inverse view is applied to the plate.
        if kind.is_scene_linear()
            && self.view.is_some_and(|view| view != View::DISPLAY)
            && !job.plan.scene().has_plate()
        {
            warnings.push(Warning::ViewUnused);
        }
        if self.resume && !job.resume {
            warnings.push(if job.sheet.is_some() { Warning::ResumeSheet } else { Warning::ResumeUnused { kind } });
        }
        if self.snapshots.is_some() && job.snapshots == Snapshots::default() {
            warnings.push(Warning::SnapshotsUnused);
        }
        warnings
    }
}

/// Checks that files of this `kind` can say what the pixels of a view are.
///
/// # Errors
/// The view `raw` in a format that only has colors for display.
pub fn check_view(view: View, kind: OutputKind, path: &Path) -> Result<(), OptionError> {
    if view != View::RAW || kind.takes_linear_acescg() {
        return Ok(());
    }
    Err(OptionError::RawFormat { path: path.to_path_buf() })
}

/// The convention of straight alpha: `option`, or `default` if it is `None`. For the view `raw`, which encodes nothing, the default is linear.
///
/// # Errors
/// Encoded alpha for the view `raw`.
pub(crate) fn alpha_convention(
    option: Option<AlphaConvention>,
    view: View,
    default: AlphaConvention,
) -> Result<AlphaConvention, OptionError> {
    let alpha = view.alpha_convention(option.unwrap_or(default));
    if option.is_some_and(|option| option != alpha) { Err(OptionError::RawAlpha) } else { Ok(alpha) }
}

/// The frames of a job, ascending: `option`, or all frames of the plan if it is `None`.
///
/// # Errors
/// The list is empty.
pub(crate) fn selected_frames(option: Option<&[i64]>, plan: &Plan) -> Result<Vec<i64>, OptionError> {
    let mut frames = option.map_or_else(|| plan.frames().collect(), <[i64]>::to_vec);
    frames.sort_unstable();
    frames.dedup();
    if frames.is_empty() { Err(OptionError::NoFrames) } else { Ok(frames) }
}

/// The snapshots that a job may read and write.
pub(crate) struct SnapshotOptions<'a> {
    /// Their folder; `None` for no snapshots.
    pub(crate) folder: Option<&'a Path>,
    /// Frames between them; `None` for one snapshot a second.
    pub(crate) interval: Option<u64>,
}

impl SnapshotOptions<'_> {
    /// Checks the options. There are no snapshots if nothing in the scene has a state.
    ///
    /// # Errors
    /// An interval of zero, or a file in the folder that must not be overwritten.
    pub(crate) fn prepare(
        &self,
        compiled: &CompiledScene,
        plan: &Plan,
        overwrite: &OverwritePolicy,
    ) -> Result<Snapshots, JobError> {
        let frames_per_second = (1.0 / plan.fps().frame_s()).round().max(1.0) as u64;
        let interval = self.interval.unwrap_or(frames_per_second);
        match self.folder {
            _ if interval == 0 => Err(OptionError::SnapshotInterval(interval).into()),
            Some(folder) if compiled.is_stepped() => {
                let snapshots = Snapshots::new(folder.to_path_buf(), plan, interval, overwrite.clone());
                snapshots.check()?;
                Ok(snapshots)
            }
            _ => Ok(Snapshots::default()),
        }
    }
}

/// A warning if some frames lie outside the range of the shot.
pub(crate) fn outside_range(plan: &Plan, frames: &[i64]) -> Option<Warning> {
    let range = plan.frames();
    let count = frames.iter().filter(|frame| !range.contains(frame)).count();
    let (first, last) = (range.start, range.end - 1);
    match (count, plan.loop_s()) {
        (0, _) => None,
        (_, Some(_)) => Some(Warning::OutsideLoop { count, first, last }),
        (_, None) => Some(Warning::OutsideScene { count, first, last }),
    }
}
