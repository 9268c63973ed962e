//! A frame that is ready to be composited, and the accumulation of its slices in one strip.

use bansho_base::{
    host::{
        observer::{Observer, PartGuard, Stage, StagePart},
        scratch_pool::ScratchPool,
    },
    image::{Image, Rect},
    phenomenon::{
        PlateRole, Prepared,
        strip::{DepthInterval, Strip, View},
    },
};
use fearless_simd::Level;

use super::{
    accumulate::Accumulator,
    background::{Background, BentPixels},
    hiding::{HidingDepth, HidingRows},
    moving_members::{MomentScratch, Moments},
    plate::PlateFrame,
    slices::Slice,
};
use crate::{compiled::ActiveRun, plan::Plan};

/// Rows of a strip: few enough that the planes of a strip of 1920 pixels fit in the L2 cache of a core.
pub(crate) const STRIP_ROWS: usize = 8;

/// What a frame contains.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outputs {
    /// Factor from absolute radiance to exposed values.
    pub(crate) exposure: f32,
    /// Whether each phenomenon gets a layer of its own.
    pub(crate) layers: bool,
    /// Whether AOVs are written.
    pub(crate) aovs: bool,
    /// Whether the depth of each pixel is needed.
    pub(crate) depth: bool,
    /// Whether the light that is not the plate's is kept apart, if there is a plate.
    pub(crate) plate_apart: bool,
}

impl Outputs {
    /// As the plan requests.
    pub(crate) fn of_plan(plan: &Plan) -> Self {
        let depth = plan.depth || plan.layers || plan.aovs;
        Self { exposure: plan.exposure_scale(), layers: plan.layers, aovs: plan.aovs, depth, plate_apart: false }
    }

    /// Whether more than the color and the alpha of a display picture is needed of the frame.
    pub(crate) fn needs_light(&self) -> bool {
        self.layers || self.aovs || self.depth
    }

    /// Whether there are layers or AOVs.
    pub(crate) fn has_channels(&self) -> bool {
        self.layers || self.aovs
    }

    /// Absolute radiance without layers and AOVs.
    pub(crate) const RADIANCE: Self =
        Self { exposure: 1.0, layers: false, aovs: false, depth: false, plate_apart: false };
}

/// A frame that is ready to be composited.
#[derive(Clone, Copy)]
pub(crate) struct Composition<'a> {
    pub(crate) outputs: Outputs,
    /// Whether it is the reflection in a mirror.
    pub(crate) is_mirrored: bool,
    pub(crate) observer: &'a dyn Observer,
    pub(crate) view: &'a View,
    /// The phenomena, to which members of slices refer.
    pub(crate) runs: &'a [&'a ActiveRun],
    pub(crate) prepared: &'a [Box<dyn Prepared + 'a>],
    /// Those of the phenomena that move while the shutter is open.
    pub(crate) moments: &'a Moments<'a>,
    pub(crate) slices: &'a [Slice],
    pub(crate) plate: &'a PlateFrame,
    /// What hides phenomena.
    pub(crate) hiding: &'a HidingDepth,
    /// What hides those that are seen through the plate's transparency; `None` where there are none.
    pub(crate) through: Option<&'a HidingDepth>,
    /// What is behind the slices.
    pub(crate) background: Background<'a>,
    /// Scratch memory, which frames reuse.
    pub(crate) scratches: &'a StripScratches,
}

/// Scratch memory of all threads.
pub(crate) type StripScratches = ScratchPool<StripScratch, fn() -> StripScratch>;

/// Scratch memory of a thread that draws strips of a view, bytes.
pub fn scratch_bytes_per_thread(view: &View) -> f64 {
    /// Planes in single precision: color, transmittance and depth of two composites and of a strip.
    const PLANES: usize = 14;
    (PLANES * size_of::<f32>() * STRIP_ROWS * view.window.width) as f64
}

/// Scratch memory of all threads, before any is needed.
pub(crate) fn scratches() -> StripScratches {
    ScratchPool::new(StripScratch::default)
}

/// Scratch memory of one thread.
#[derive(Default)]
pub(crate) struct StripScratch {
    pub(super) accumulator: Accumulator,
    pass: PassScratch,
    /// What transparent pixels of the plate show without the plate.
    unplated: Accumulator,
    /// The refracted pixels of the background.
    pub(super) bent: BentPixels,
    /// A row of refracted colors.
    pub(super) row: Vec<[f32; 4]>,
    /// The light of a strip of which only display codes are kept.
    pub(super) light: Vec<[f32; 4]>,
}

/// Scratch memory of a pass.
#[derive(Default)]
struct PassScratch {
    strip: Strip,
    /// What partly covered pixels show without the opaque surfaces.
    uncovered: Accumulator,
    /// A cell of a strip in which several things move.
    cell: Accumulator,
    moments: MomentScratch,
}

impl<'a> Composition<'a> {
    /// The rectangle of the strip with this index.
    pub(super) fn strip_rect(&self, index: usize) -> Rect {
        let window = self.view.window;
        let y = index * STRIP_ROWS;
        Rect { x: window.x, y: window.y + y, width: window.width, height: STRIP_ROWS.min(window.height - y) }
    }

    /// The rectangle of a strip that must be drawn: the bounds of the phenomena, or the whole strip where there is a background or where layers
    /// or AOVs are requested.
    pub(super) fn nonempty_rect(&self, rect: Rect) -> Rect {
        if self.background.color.is_some() || self.outputs.has_channels() {
            return rect;
        }
        let mut touched = Rect::default();
        for slice in self.slices {
            for &member in &slice.members {
                let bounds = self.prepared[member].bounds(&slice.interval);
                touched = touched.union(&bounds.intersection(&rect));
            }
        }
        touched
    }

    /// The rectangle of the frame outside of which all pixels are empty, in pixels of the frame.
    pub(super) fn content(&self) -> Rect {
        let window = self.view.window;
        let strips = 0..window.height.div_ceil(STRIP_ROWS);
        let all = strips.map(|index| self.nonempty_rect(self.strip_rect(index)));
        let bounds = all.fold(Rect::default(), |all, rect| all.union(&rect));
        Rect { x: bounds.x.saturating_sub(window.x), y: bounds.y.saturating_sub(window.y), ..bounds }
    }

    /// Begins the drawing of a phenomenon or, without a name, compositing.
    pub(super) fn begin_part(&self, phenomenon: Option<&'a str>) -> PartGuard<'a> {
        let part = StagePart { stage: Stage::Draw, phenomenon, is_mirrored: self.is_mirrored };
        PartGuard::begin(self.observer, part)
    }

    /// Whether a plate fills the picture, so that it is opaque.
    pub(crate) fn is_opaque(&self) -> bool {
        self.plate.color.is_some() && !self.plate.is_transparent && self.view.overscan == 0
    }

    pub(super) fn layer_count(&self) -> usize {
        if self.outputs.layers { self.runs.len() } else { 0 }
    }

    fn aov_counts(&self) -> Vec<usize> {
        if !self.outputs.aovs {
            return Vec::new();
        }
        self.runs.iter().map(|run| run.info().aovs.len()).collect()
    }

    /// Draws the slices within `rect` into the accumulator of `scratch`, nearest first. Where the plate is transparent, what those pixels show without the
    /// plate is mixed in.
    pub(super) fn accumulate(&self, level: Level, rect: Rect, scratch: &mut StripScratch) {
        let StripScratch { accumulator, pass, unplated, .. } = scratch;
        self.accumulate_exposure(level, rect, Pass::before_plate(self), pass, accumulator);
        let (Some(hiding), Some(color)) = (self.through, &self.plate.color) else { return };
        let Some(clear) = transparent_rect(rect, color) else { return };
        self.accumulate_exposure(level, clear, Pass::without_plate(hiding), pass, unplated);
        accumulator.add_through(unplated, |x, y| transparency(color, x, y));
    }

    /// Draws the slices within `rect` into an accumulator: where several things move, as the mean of the moments of the exposure. AOVs are always those of
    /// phenomena as wholes.
    fn accumulate_exposure(
        &self,
        level: Level,
        rect: Rect,
        pass: Pass,
        scratch: &mut PassScratch,
        accumulator: &mut Accumulator,
    ) {
        let PassScratch { strip, uncovered, cell: drawn, moments } = scratch;
        let cells = self.moments.cells(rect);
        let has_aovs = self.outputs.aovs && pass.with_aovs;
        if cells.is_empty() || has_aovs {
            self.accumulate_covered(level, rect, pass, strip, uncovered, accumulator);
        } else {
            accumulator.reset(rect, self.layer_count(), &[]);
        }
        for cell in &cells {
            if cell.is_drawn_by_moments() {
                self.accumulate_moments(level, cell, pass, moments, drawn);
            } else if has_aovs {
                continue;
            } else {
                self.accumulate_covered(level, cell.rect, pass, strip, uncovered, drawn);
            }
            accumulator.replace(drawn);
        }
    }

    /// Draws the slices within `rect` into an accumulator. Where opaque surfaces cover pixels partly, what those show without the surfaces is mixed in.
    fn accumulate_covered(
        &self,
        level: Level,
        rect: Rect,
        pass: Pass,
        strip: &mut Strip,
        uncovered: &mut Accumulator,
        accumulator: &mut Accumulator,
    ) {
        self.accumulate_with(level, rect, pass, strip, accumulator);
        for edge in pass.hiding.edges(rect) {
            self.accumulate_with(level, edge, Pass { with_opaque: false, ..pass }, strip, uncovered);
            accumulator.mix(uncovered, |x, y| pass.hiding.coverage(x, y));
        }
    }

    /// Draws the slices within `rect` into an accumulator, in one pass.
    fn accumulate_with(&self, level: Level, rect: Rect, pass: Pass, strip: &mut Strip, accumulator: &mut Accumulator) {
        let aovs = if pass.with_aovs && pass.with_opaque { self.aov_counts() } else { Vec::new() };
        accumulator.reset(rect, self.layer_count(), &aovs);
        for slice in self.slices {
            for &member in &slice.members {
                let prepared = self.prepared[member].as_ref();
                if pass.leaves_out(prepared, member, pass.with_opaque) {
                    continue;
                }
                let aov_count = aovs.get(member).copied().unwrap_or(0);
                let touched = prepared.bounds(&slice.interval).intersection(&rect);
                if touched.is_empty() {
                    continue;
                }
                // AOV planes are added as a whole, so strips with AOVs have the full size.
                let drawn = if aov_count > 0 { rect } else { touched };
                let depth = pass.hiding.depth_for(member, pass.with_opaque, pass.plate_depth);
                self.draw_member(member, prepared, &slice.interval, drawn, depth, aov_count, strip);
                accumulator.add_behind(level, strip, member, self.runs[member].info().aovs);
            }
        }
    }

    /// Draws what is prepared of a member in a slice into `strip`, over the pixels of `rect`.
    pub(super) fn draw_member(
        &self,
        member: usize,
        prepared: &dyn Prepared,
        slice: &DepthInterval,
        rect: Rect,
        hidden_from: Option<HidingRows>,
        aovs: usize,
        strip: &mut Strip,
    ) {
        strip.reset(rect, None, aovs);
        if let Some(rows) = hidden_from {
            strip.hide_beyond(|y| rows.row(rect, y));
        }
        let _part = self.begin_part(Some(self.runs[member].info().name));
        prepared.draw(slice, strip);
    }
}

/// Which phenomena are drawn, and what hides them.
#[derive(Clone, Copy)]
pub(super) struct Pass<'a> {
    pub(super) hiding: &'a HidingDepth,
    pub(super) plate_depth: Option<&'a Image<1>>,
    /// Phenomena of this role are left out.
    skipped: Option<PlateRole>,
    /// Whether there are opaque surfaces.
    with_opaque: bool,
    /// Whether AOVs are measured.
    with_aovs: bool,
}

impl<'a> Pass<'a> {
    /// What is before the plate, or before its depth.
    fn before_plate(composition: &Composition<'a>) -> Self {
        let (hiding, plate) = (composition.hiding, composition.plate);
        let skipped = plate.color.as_ref().map(|_| PlateRole::Behind);
        Self { hiding, plate_depth: plate.depth.as_ref(), skipped, with_opaque: true, with_aovs: true }
    }

    /// Whether a member is not drawn, with opaque surfaces or without.
    pub(super) fn leaves_out(&self, prepared: &dyn Prepared, member: usize, with_opaque: bool) -> bool {
        (!with_opaque && self.hiding.is_opaque(member)) || Some(prepared.plate_role()) == self.skipped
    }

    /// What is seen without the plate.
    fn without_plate(hiding: &'a HidingDepth) -> Self {
        Self { hiding, plate_depth: None, skipped: Some(PlateRole::Part), with_opaque: true, with_aovs: false }
    }
}

/// Fraction of a pixel of a plate through which one sees what is behind it.
fn transparency(plate: &Image<4>, x: usize, y: usize) -> f32 {
    1.0 - plate.at(x, y)[3]
}

/// The columns of `rect` from the first to the last in which a plate is transparent somewhere.
fn transparent_rect(rect: Rect, plate: &Image<4>) -> Option<Rect> {
    let mut transparent =
        (rect.x..rect.right()).filter(|&x| (rect.y..rect.bottom()).any(|y| transparency(plate, x, y) > 0.0));
    let first = transparent.next()?;
    // From the right, so that the columns between are not looked at.
    let last = transparent.next_back().unwrap_or(first);
    Some(Rect { x: first, width: last + 1 - first, ..rect })
}
