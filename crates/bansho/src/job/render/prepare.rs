//! Checking a job before anything is drawn or written.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use bansho_base::{
    color::{AlphaConvention, View},
    host::assets::Assets,
    phenomenon::Remark,
};
use bansho_media::{
    assets::FileAssets,
    files::{
        naming::{self, OutputPattern},
        overwrite_policy::OverwritePolicy,
    },
    format::OutputKind,
    imageops::sprite_sheet::SheetLayout,
};
use bansho_render::{CompiledScene, Plan, PlanOptions, display::BitDepth};
use bansho_scene::{Positions, SceneOptions};

use super::{
    figures,
    output::{self, Format},
};
use crate::job::{
    Job,
    checks::{
        memory::{self, MemoryRequest},
        overwrite, plates,
    },
    error::{Channels, Conflict, JobError, SheetKind},
    flipbook::{
        contact_sheet::{self, ContactBackground},
        tiles::{self, MOST_TILES},
    },
    observer::{Note, Spot},
    scene_file::SceneFile,
    snapshots::Snapshots,
};

/// A job that can be carried out, as far as can be known without doing so.
pub struct PreparedJob {
    pub(crate) scene: SceneFile,
    pub(crate) compiled: Arc<CompiledScene>,
    pub(crate) plan: Arc<Plan>,
    pub(crate) frames: Vec<i64>,
    pub(crate) format: Format,
    /// Where all frames go into one picture.
    pub(crate) sheet: Option<SheetLayout>,
    pub(crate) contact_background: ContactBackground,
    pub(crate) resume: bool,
    pub(crate) snapshots: Snapshots,
    pub(crate) notes: Vec<Note>,
}

impl PreparedJob {
    /// The plan of the shot.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The frames that were asked for, ascending.
    pub fn frames(&self) -> &[i64] {
        &self.frames
    }

    /// Where frames go.
    pub fn output(&self) -> &OutputPattern {
        &self.format.pattern
    }

    /// What the user should know before the work begins.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }
}

/// Reads the files that a scene names from the folder it lies in, within its limits.
pub(crate) fn assets(scene: &SceneFile) -> Arc<dyn Assets> {
    Arc::new(FileAssets::with_limits(&scene.folder, scene.inputs.clone()))
}

/// Checks a scene and all it names, and plans it as it is.
///
/// # Errors
/// What the scene would be refused for.
pub fn check_scene(scene: &SceneFile) -> Result<(Arc<CompiledScene>, Plan), JobError> {
    let compiled = scene.compile(
        scene.parse()?.adapted(&SceneOptions { implied_backdrop: true, ..SceneOptions::default() })?,
        &assets(scene),
    )?;
    let plan = Plan::new(&compiled, &PlanOptions::default())?;
    // With its overscan, as EXR is drawn.
    let widest = PlanOptions { overscan: true, ..PlanOptions::default() };
    let widest =
        Plan::with_exposure_and_loop_start(plan.scene().clone(), &widest, plan.exposure_ev100, plan.loop_start)?;
    let frames = (plan.frames().end - plan.frames().start) as usize;
    let request = MemoryRequest { frames, tiles: 0, display: Some(BitDepth::Eight), own_size: false };
    memory::check(scene, &compiled, &widest, request)?;
    plates::check(scene, &compiled, &plan.frames().collect::<Vec<_>>())?;
    Ok((compiled, plan))
}

/// What users should know of how the phenomena of a scene will look, each at its place in the file.
pub fn remarks(scene: &SceneFile, compiled: &Arc<CompiledScene>, plan: &Plan) -> Vec<Note> {
    let remarks = bansho_render::remarks::remarks(compiled, plan);
    if remarks.is_empty() {
        return Vec::new();
    }
    let mut positions = Positions::new(plan.scene(), &scene.text);
    let note = |(name, remark): (String, Remark)| {
        let position = positions.of(&name, remark.key.as_deref());
        let place = position.map(|position| Spot { file: scene.name.clone(), position });
        Note::Remark { place, name, remark }
    };
    remarks.into_iter().map(note).collect()
}

impl Job {
    /// Checks everything: the scene and what it names, the options, whether the output can be written. Writes nothing.
    ///
    /// # Errors
    /// The first thing that stands in the way; of the scene all faults at once.
    pub fn prepare(&self) -> Result<PreparedJob, JobError> {
        let scene = self.scene.parse()?;
        let kind = self.output_kind()?;
        self.check_channels(kind)?;
        self.check_figures(kind)?;
        let alpha = alpha_convention(self.alpha, self.view, AlphaConvention::Encoded)?;
        let compiled = self.scene.compile(scene.adapted(&self.scene_options())?, &assets(&self.scene))?;
        let plan = Arc::new(Plan::new(&compiled, &self.plan_options(kind))?);
        let frames = self.chosen_frames(&plan)?;
        plates::check(&self.scene, &compiled, &frames)?;
        let files = if self.contact_sheet.is_some() { 1 } else { frames.len() };
        let pattern = OutputPattern::parse(&self.output_path(), files)?;
        output::check_writable(&pattern.path(frames[0]))?;
        let overwrite = OverwritePolicy::new(overwrite::inputs(&self.scene, &plan, &frames), self.overwrite);
        overwrite::check(&overwrite, self.outputs(&pattern, &frames))?;
        let tile = [plan.window().width, plan.window().height];
        let sheet = self.contact_sheet.map(|tiles| tiles::holding(tiles, tile, contact_sheet::GUTTER)).transpose()?;
        memory::check(&self.scene, &compiled, &plan, self.memory_request(kind, frames.len()))?;
        let snapshots = snapshots(self.snapshots.as_deref(), self.snapshot_every, (&compiled, &plan), &overwrite)?;
        let mut prepared = PreparedJob {
            scene: self.scene.clone(),
            format: Format { pattern, view: self.view, bits: self.bits, alpha, figures: self.figures, overwrite },
            resume: self.resume && kind.is_sequence() && sheet.is_none(),
            notes: Vec::new(),
            compiled,
            plan,
            frames,
            sheet,
            contact_background: self.contact_background,
            snapshots,
        };
        prepared.notes = self.notes(&prepared);
        Ok(prepared)
    }

    fn output_path(&self) -> PathBuf {
        let stem = &self.scene.stem;
        let name =
            if self.contact_sheet.is_some() { format!("{stem}.sheet.png") } else { naming::default_sequence(stem) };
        self.out.clone().unwrap_or_else(|| PathBuf::from("out").join(stem).join(name))
    }

    fn memory_request(&self, kind: OutputKind, frames: usize) -> MemoryRequest {
        let display = (!kind.is_scene_linear()).then_some(self.bits);
        MemoryRequest { frames, tiles: self.contact_sheet.unwrap_or(0), display, own_size: self.size.is_some() }
    }

    /// Every file that will be written.
    fn outputs<'a>(&self, pattern: &'a OutputPattern, frames: &'a [i64]) -> impl Iterator<Item = PathBuf> + use<'a> {
        let single = self.contact_sheet.is_some() || !pattern.kind().is_sequence();
        let frames = if single { &frames[..1] } else { frames };
        let with_figures = self.figures;
        frames.iter().flat_map(move |&number| {
            let picture = pattern.path(number);
            let figures = with_figures.then(|| figures::path(&picture));
            [Some(picture), figures].into_iter().flatten()
        })
    }

    fn output_kind(&self) -> Result<OutputKind, JobError> {
        let path = self.output_path();
        let kind = OutputPattern::parse(&path, 2)?.kind();
        if self.contact_sheet.is_some() && kind != OutputKind::Png {
            return Err(Conflict::Sheet { path, allowed: ".png" }.into());
        }
        Ok(kind)
    }

    /// Layers and AOVs need a file that holds them.
    fn check_channels(&self, kind: OutputKind) -> Result<(), Conflict> {
        let what = match (self.layers, self.aovs) {
            (true, _) => Channels::Layers,
            (_, true) => Channels::Aovs,
            _ => return Ok(()),
        };
        if kind.is_scene_linear() { Ok(()) } else { Err(Conflict::NoChannels { what, path: self.output_path() }) }
    }

    /// Figures lie beside a picture of one frame.
    fn check_figures(&self, kind: OutputKind) -> Result<(), Conflict> {
        if self.figures && (self.contact_sheet.is_some() || !kind.is_sequence()) {
            return Err(Conflict::NoFigures { path: self.output_path() });
        }
        Ok(())
    }

    fn scene_options(&self) -> SceneOptions {
        SceneOptions { seed: self.seed, loop_s: self.loop_s, implied_backdrop: !self.transparent }
    }

    fn plan_options(&self, kind: OutputKind) -> PlanOptions {
        PlanOptions {
            size: self.size,
            overscan: kind.is_scene_linear(),
            crop: self.crop,
            layers: self.layers,
            aovs: self.aovs,
            figures: self.figures,
            display: self.view,
        }
    }

    fn chosen_frames(&self, plan: &Plan) -> Result<Vec<i64>, JobError> {
        let frames = chosen_frames(self.frames.as_deref(), plan)?;
        match self.contact_sheet {
            Some(tiles) if !(1..=MOST_TILES).contains(&tiles) => {
                Err(Conflict::Tiles { of: SheetKind::Contact, tiles, most: MOST_TILES }.into())
            }
            None => Ok(frames),
            // All of a shot, or from one frame on: one after the other, also beyond its end.
            Some(tiles) if self.frames.is_none() || frames.len() == 1 => {
                Ok((frames[0]..frames[0].saturating_add(tiles as i64)).collect())
            }
            Some(tiles) if frames.len() < tiles => Err(Conflict::FewFrames { tiles, frames: frames.len() }.into()),
            Some(tiles) => Ok(frames[..tiles].to_vec()),
        }
    }

    fn notes(&self, job: &PreparedJob) -> Vec<Note> {
        let kind = job.format.pattern.kind();
        let mut notes: Vec<Note> = outside(&job.plan, &job.frames).into_iter().collect();
        notes.extend(remarks(&self.scene, &job.compiled, &job.plan));
        if self.bits == BitDepth::Sixteen && !kind.takes_sixteen_bits() {
            notes.push(Note::BitsUnused { kind });
        }
        let scene = job.plan.scene();
        if self.transparent && (scene.has_plate() || scene.shows_stated_backdrop()) {
            notes.push(Note::TransparentUnused);
        }
        let has_alpha = kind.has_straight_alpha() && !job.plan.scene().has_plate() && job.sheet.is_none();
        if self.alpha.is_some() && !has_alpha {
            notes.push(Note::AlphaUnused);
        }
        // With a plate the view matters to EXR too: the plate is taken back through it.
        if kind.is_scene_linear() && self.view != View::DISPLAY && !job.plan.scene().has_plate() {
            notes.push(Note::ViewUnused);
        }
        if self.resume && !job.resume {
            notes.push(if job.sheet.is_some() { Note::ResumeSheet } else { Note::ResumeUnused { kind } });
        }
        if self.snapshots.is_some() && job.snapshots == Snapshots::default() {
            notes.push(Note::SnapshotsUnused);
        }
        notes
    }
}

/// What straight alpha is made for: as asked for, else as `usual`; linear where the view encodes nothing.
///
/// # Errors
/// Encoded alpha of a view that encodes nothing.
pub(crate) fn alpha_convention(
    asked: Option<AlphaConvention>,
    view: View,
    usual: AlphaConvention,
) -> Result<AlphaConvention, Conflict> {
    match asked {
        Some(AlphaConvention::Encoded) if view == View::RAW => Err(Conflict::RawAlpha),
        None if view == View::RAW => Ok(AlphaConvention::Linear),
        asked => Ok(asked.unwrap_or(usual)),
    }
}

/// The frames that are asked for, ascending; at least one.
pub(crate) fn chosen_frames(asked: Option<&[i64]>, plan: &Plan) -> Result<Vec<i64>, JobError> {
    let mut frames = asked.map_or_else(|| plan.frames().collect(), <[i64]>::to_vec);
    frames.sort_unstable();
    frames.dedup();
    if frames.is_empty() { Err(Conflict::NoFrames.into()) } else { Ok(frames) }
}

/// Snapshots in `folder`, `every` so many frames; none where nothing in the plan has a state.
///
/// # Errors
/// No frame between snapshots, or a file in the folder that must stay.
pub(crate) fn snapshots(
    folder: Option<&Path>,
    every: Option<u64>,
    (compiled, plan): (&CompiledScene, &Plan),
    overwrite: &OverwritePolicy,
) -> Result<Snapshots, JobError> {
    let second = (1.0 / plan.fps().frame_s()).round().max(1.0) as u64;
    let every = every.unwrap_or(second);
    match folder {
        _ if every == 0 => Err(Conflict::SnapshotStep(every).into()),
        Some(folder) if compiled.is_stepped() => {
            let snapshots = Snapshots::new(folder.to_path_buf(), plan, every, overwrite.clone());
            snapshots.check()?;
            Ok(snapshots)
        }
        _ => Ok(Snapshots::default()),
    }
}

/// How many frames lie outside the shot's own.
pub(crate) fn outside(plan: &Plan, frames: &[i64]) -> Option<Note> {
    let own = plan.frames();
    let count = frames.iter().filter(|frame| !own.contains(frame)).count();
    let (first, last) = (own.start, own.end - 1);
    match (count, plan.loop_s()) {
        (0, _) => None,
        (_, Some(_)) => Some(Note::OutsideLoop { count, first, last }),
        (_, None) => Some(Note::OutsideScene { count, first, last }),
    }
}
