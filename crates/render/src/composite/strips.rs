//! From prepared phenomena to a frame: each strip composites its slices from near to far, then adds the background.

use bansho_base::{
    color::DisplayCode,
    frame::{Channel, Frame, FrameHeader, Precision},
    host::{
        observer::{self, Cancelled, Observer, PartGuard, Stage, StagePart},
        parallel::prelude::*,
        scratch_pool::ScratchPool,
    },
    image::{Image, Rect},
    math::MulAdd,
    phenomenon::{
        PlateRole, Prepared,
        strip::{AovDescriptor, AovRule, Strip, View},
    },
};

use super::{
    accumulate::Accumulator,
    background::{Background, BentPixels},
    frame_memory::{FrameMemory, StripPixels},
    hiding::HidingDepth,
    plate::PlateFrame,
    slices::Slice,
};
use crate::{compiled::ActiveRun, pixels::CodeConversion, plan::Plan};
use bansho_scene::PLATE_LAYER;
use fearless_simd::{Level, dispatch};

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
}

impl Outputs {
    /// As the plan requests.
    pub(crate) fn of_plan(plan: &Plan) -> Self {
        let depth = plan.depth || plan.layers || plan.aovs;
        Self { exposure: plan.exposure_scale(), layers: plan.layers, aovs: plan.aovs, depth }
    }

    /// Whether more than the color and the alpha of a display picture is needed of the frame.
    pub(crate) fn needs_light(&self) -> bool {
        self.layers || self.aovs || self.depth
    }

    /// Absolute radiance without layers and AOVs.
    pub(crate) const RADIANCE: Self = Self { exposure: 1.0, layers: false, aovs: false, depth: false };
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

/// Scratch memory of all threads, before any is needed.
pub(crate) fn scratches() -> StripScratches {
    ScratchPool::new(StripScratch::default)
}

/// Scratch memory of one thread.
#[derive(Default)]
pub(crate) struct StripScratch {
    strip: Strip,
    accumulator: Accumulator,
    /// What partly covered pixels show without the opaque surfaces.
    uncovered: Accumulator,
    /// What transparent pixels of the plate show without the plate.
    unplated: Accumulator,
    /// The refracted pixels of the background.
    bent: BentPixels,
    /// A row of refracted colors.
    row: Vec<[f32; 4]>,
    /// The light of a strip of which only display codes are kept.
    light: Vec<[f32; 4]>,
}

impl<'a> Composition<'a> {
    /// The rectangle of the strip with this index.
    fn strip_rect(&self, index: usize) -> Rect {
        let window = self.view.window;
        let y = index * STRIP_ROWS;
        Rect { x: window.x, y: window.y + y, width: window.width, height: STRIP_ROWS.min(window.height - y) }
    }

    /// The rectangle of a strip that must be drawn: the bounds of the phenomena, or the whole strip where there is a background or where layers
    /// or AOVs are requested.
    fn nonempty_rect(&self, rect: Rect) -> Rect {
        if self.background.color.is_some() || self.outputs.layers || self.outputs.aovs {
            return rect;
        }
        let touched = |slice: &Slice| {
            let each = slice.members.iter().map(|&member| self.prepared[member].bounds(&slice.interval));
            each.fold(Rect::default(), |all, bounds| all.union(&bounds.intersection(&rect)))
        };
        self.slices.iter().map(touched).fold(Rect::default(), |all, rect| all.union(&rect))
    }

    /// The rectangle of the frame outside of which all pixels are empty, in pixels of the frame.
    fn content(&self) -> Rect {
        let window = self.view.window;
        let strips = 0..window.height.div_ceil(STRIP_ROWS);
        let all = strips.map(|index| self.nonempty_rect(self.strip_rect(index)));
        let bounds = all.fold(Rect::default(), |all, rect| all.union(&rect));
        Rect { x: bounds.x.saturating_sub(window.x), y: bounds.y.saturating_sub(window.y), ..bounds }
    }

    /// Begins the drawing of a phenomenon or, without a name, compositing.
    fn begin_part(&self, phenomenon: Option<&'a str>) -> PartGuard<'a> {
        let part = StagePart { stage: Stage::Draw, phenomenon, is_mirrored: self.is_mirrored };
        PartGuard::begin(self.observer, part)
    }

    /// Whether a plate fills the picture, so that it is opaque.
    pub(crate) fn is_opaque(&self) -> bool {
        self.plate.color.is_some() && !self.plate.is_transparent && self.view.overscan == 0
    }

    fn layer_count(&self) -> usize {
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
    fn accumulate(&self, level: Level, rect: Rect, scratch: &mut StripScratch) {
        let StripScratch { strip, accumulator, uncovered, unplated, .. } = scratch;
        self.accumulate_covered(level, rect, Pass::before_plate(self), strip, uncovered, accumulator);
        let (Some(hiding), Some(color)) = (self.through, &self.plate.color) else { return };
        let transparency = |x: usize, y: usize| 1.0 - color.at(x, y)[3];
        let Some(clear) = transparent_rect(rect, transparency) else { return };
        self.accumulate_covered(level, clear, Pass::without_plate(hiding), strip, uncovered, unplated);
        accumulator.add_through(unplated, transparency);
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
                let prepared = &self.prepared[member];
                let is_left_out = !pass.with_opaque && pass.hiding.is_opaque(member);
                if is_left_out || Some(prepared.plate_role()) == pass.skipped {
                    continue;
                }
                let aov_count = aovs.get(member).copied().unwrap_or(0);
                let touched = prepared.bounds(&slice.interval).intersection(&rect);
                if touched.is_empty() {
                    continue;
                }
                // AOV planes are added as a whole, so strips with AOVs have the full size.
                let drawn = if aov_count > 0 { rect } else { touched };
                match pass.hiding.depth_for(member, pass.with_opaque, pass.plate_depth) {
                    Some(image) => strip.reset(drawn, Some(&|y| image.row(y).as_flattened()), aov_count),
                    None => strip.reset(drawn, None, aov_count),
                }
                {
                    let _part = self.begin_part(Some(self.runs[member].info().name));
                    prepared.draw(&slice.interval, strip);
                }
                accumulator.add_behind(level, strip, member, self.runs[member].info().aovs);
            }
        }
    }
}

/// Which phenomena are drawn, and what hides them.
#[derive(Clone, Copy)]
struct Pass<'a> {
    hiding: &'a HidingDepth,
    plate_depth: Option<&'a Image<1>>,
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

    /// What is seen without the plate.
    fn without_plate(hiding: &'a HidingDepth) -> Self {
        Self { hiding, plate_depth: None, skipped: Some(PlateRole::Part), with_opaque: true, with_aovs: false }
    }
}

/// The columns of `rect` from the first to the last that are transparent somewhere.
fn transparent_rect(rect: Rect, transparency: impl Fn(usize, usize) -> f32) -> Option<Rect> {
    let is_transparent = |x: &usize| (rect.y..rect.bottom()).any(|y| transparency(*x, y) > 0.0);
    let first = (rect.x..rect.right()).find(is_transparent)?;
    let last = (first..rect.right()).rfind(is_transparent)?;
    Some(Rect { x: first, width: last + 1 - first, ..rect })
}

/// Draws and composites the whole window.
pub(crate) fn draw_frame(
    composition: &Composition,
    header: FrameHeader,
    recycled: Option<Frame>,
) -> Result<Frame, Cancelled> {
    let window = composition.view.window;
    let level = bansho_base::math::simd::level();
    let mut memory = FrameMemory::new(window, composition.outputs.depth, recycled);
    let scratches = composition.scratches;
    let has_channels = composition.outputs.layers || composition.outputs.aovs;
    let strips = memory.strips(STRIP_ROWS).into_par_iter().enumerate().with_max_len(1).map(|(index, mut pixels)| {
        observer::check(composition.observer)?;
        let _part = composition.begin_part(None);
        pixels.clear();
        let strip = composition.strip_rect(index);
        let rect = composition.nonempty_rect(strip);
        if rect.is_empty() {
            return Ok(Vec::new());
        }
        scratches.with(|scratch| {
            let StripPixels { beauty, depth, .. } = &mut pixels;
            draw_strip(composition, level, rect, scratch, StripLight { rect: strip, beauty, depth });
            Ok(if has_channels { channel_planes(composition, scratch) } else { Vec::new() })
        })
    });
    let planes: Vec<Vec<Vec<f32>>> = if has_channels {
        strips.collect::<Result<_, Cancelled>>()?
    } else {
        strips.try_for_each(|planes| planes.map(|_| ()))?;
        Vec::new()
    };
    Ok(Frame {
        header,
        beauty: memory.beauty,
        depth: memory.depth,
        channels: channels(composition, planes),
        opaque: composition.is_opaque(),
        content: composition.content(),
        metadata: Vec::new(),
    })
}

/// Draws and composites the whole window as display codes: each strip is converted while it is in the cache, and its light is not kept.
///
/// `codes` are zero, and remain so where nothing is drawn, unless the picture is opaque.
pub(crate) fn draw_codes<C: DisplayCode + Send + Sync>(
    composition: &Composition,
    conversion: &CodeConversion,
    codes: &mut [[C; 4]],
) -> Result<(), Cancelled> {
    let window = composition.view.window;
    let level = bansho_base::math::simd::level();
    let strips = codes.par_chunks_mut(STRIP_ROWS * window.width.max(1)).enumerate().with_max_len(1);
    strips.try_for_each(|(index, codes)| {
        observer::check(composition.observer)?;
        let _part = composition.begin_part(None);
        let strip = composition.strip_rect(index);
        let rect = composition.nonempty_rect(strip);
        // An opaque pixel without light has a code too.
        let converted = if conversion.is_opaque() { strip } else { rect };
        if converted.is_empty() {
            return Ok(());
        }
        composition.scratches.with(|scratch| {
            let mut light = std::mem::take(&mut scratch.light);
            light.resize(converted.width * converted.height, [0.0; 4]);
            if converted != rect {
                light.fill([0.0; 4]);
            }
            if !rect.is_empty() {
                let pixels = StripLight { rect: converted, beauty: &mut light, depth: &mut [] };
                draw_strip(composition, level, rect, scratch, pixels);
            }
            for (row, light) in light.chunks_exact(converted.width).enumerate() {
                let y = converted.y + row;
                let first = (y - strip.y) * strip.width + converted.x - strip.x;
                conversion.row(y - window.y, converted.x - window.x, light, &mut codes[first..][..converted.width]);
            }
            scratch.light = light;
        });
        Ok(())
    })
}

/// Where the light of a strip goes.
struct StripLight<'a> {
    /// The pixels, in pixels of the picture.
    rect: Rect,
    /// Color and alpha, row by row.
    beauty: &'a mut [[f32; 4]],
    /// Depth, m; empty if it is not kept.
    depth: &'a mut [f32],
}

/// Draws and composites the pixels `rect` of a strip.
fn draw_strip(composition: &Composition, level: Level, rect: Rect, scratch: &mut StripScratch, pixels: StripLight) {
    composition.accumulate(level, rect, scratch);
    composition.background.trace(rect, &mut scratch.bent);
    finish_strip(composition, level, scratch, pixels);
}

/// Exposes a strip, computes its alpha, and composites the background behind it.
fn finish_strip(composition: &Composition, level: Level, scratch: &mut StripScratch, pixels: StripLight) {
    let (exposure, background) = (composition.outputs.exposure, &composition.background);
    let strip = pixels.rect;
    let StripScratch { accumulator, bent, row: buffer, .. } = scratch;
    let rect = accumulator.rect;
    for row in 0..rect.height {
        let accumulated = row * rect.width..(row + 1) * rect.width;
        let first = (rect.y - strip.y + row) * strip.width + rect.x - strip.x;
        let out = &mut pixels.beauty[first..][..rect.width];
        let color = accumulator.color.each_ref().map(|plane| &plane[accumulated.clone()]);
        match accumulator.transmittance() {
            None => dispatch!(level, _simd => expose_row(exposure, color, out)),
            Some(planes) => {
                let transmittance = planes.each_ref().map(|plane| &plane[accumulated.clone()]);
                dispatch!(level, _simd => expose_absorbed_row(exposure, color, transmittance, out));
            }
        }
        if let Some(colors) = background.color_row(rect, row, bent, buffer) {
            match accumulator.transmittance() {
                None => dispatch!(level, _simd => composite_background(colors, out)),
                Some(planes) => {
                    let transmittance = planes.each_ref().map(|plane| &plane[accumulated.clone()]);
                    dispatch!(level, _simd => composite_absorbed_background(transmittance, colors, out));
                }
            }
        }
        if let Some(hidden) = accumulator.hidden_alpha(accumulated.clone()) {
            out.iter_mut().zip(hidden).for_each(|(out, alpha)| out[3] += alpha);
        }
        if let Some(depth) = pixels.depth.get_mut(first..first + rect.width) {
            depth.copy_from_slice(&accumulator.depth[accumulated]);
            if let Some(depths) = background.depth_row(rect, row, composition.view.size[0]) {
                depth.iter_mut().zip(depths).for_each(|(depth, farther)| *depth = depth.min(*farther));
            }
        }
    }
}

#[inline(always)]
fn expose_row(exposure: f32, [red, green, blue]: [&[f32]; 3], out: &mut [[f32; 4]]) {
    for (((out, red), green), blue) in out.iter_mut().zip(red).zip(green).zip(blue) {
        *out = [exposure * red, exposure * green, exposure * blue, 0.0];
    }
}

#[inline(always)]
fn expose_absorbed_row(exposure: f32, color: [&[f32]; 3], transmittance: [&[f32]; 3], out: &mut [[f32; 4]]) {
    expose_row(exposure, color, out);
    let [red, green, blue] = transmittance;
    for (((out, red), green), blue) in out.iter_mut().zip(red).zip(green).zip(blue) {
        out[3] = 1.0 - (red + green + blue) * (1.0 / 3.0);
    }
}

/// Composites the background behind a row in which nothing absorbs.
#[inline(always)]
fn composite_background(background: &[[f32; 4]], out: &mut [[f32; 4]]) {
    for (out, background) in out.iter_mut().zip(background) {
        let weight = [1.0, 1.0, 1.0, 1.0 - out[3]];
        for c in 0..4 {
            out[c] = weight[c].fma(background[c], out[c]);
        }
    }
}

/// As [`composite_background`], where something absorbs.
#[inline(always)]
fn composite_absorbed_background([red, green, blue]: [&[f32]; 3], background: &[[f32; 4]], out: &mut [[f32; 4]]) {
    for ((((out, background), red), green), blue) in out.iter_mut().zip(background).zip(red).zip(green).zip(blue) {
        let weight = [*red, *green, *blue, 1.0 - out[3]];
        for c in 0..4 {
            out[c] = weight[c].fma(background[c], out[c]);
        }
    }
}

/// The planes of this strip for every layer and AOV, in the order of [`channels`].
fn channel_planes(composition: &Composition, scratch: &mut StripScratch) -> Vec<Vec<f32>> {
    let mut planes = layer_planes(composition, scratch);
    let layers = planes.len();
    planes.extend(aov_planes(composition, &scratch.accumulator));
    let rules = composition.runs.iter().flat_map(|run| run.info().aovs).map(|aov| aov.rule);
    let drawn = composition.background.channels.get(layers..).unwrap_or_default();
    for ((plane, drawn), rule) in planes[layers..].iter_mut().zip(drawn).zip(rules) {
        let values = composition.background.plane(
            &drawn.values,
            scratch.accumulator.rect,
            &BentPixels::default(),
            composition.view.size[0],
        );
        plane.iter_mut().zip(values).for_each(|(own, farther)| *own = combine_aov(*own, farther, rule));
    }
    planes
}

/// Combines the AOV of a phenomenon that extends over several groups of slices: the sum, or the value of the nearest group that has one.
fn combine_aov(own: f32, farther: f32, rule: AovRule) -> f32 {
    match rule {
        AovRule::Sum => own + farther,
        AovRule::WeightedMean | AovRule::Nearest if own == 0.0 => farther,
        AovRule::WeightedMean | AovRule::Nearest => own,
    }
}

/// Layers of the phenomena and of the plate: those of this strip, and those of the background times its transmittance.
fn layer_planes(composition: &Composition, scratch: &mut StripScratch) -> Vec<Vec<f32>> {
    let (exposure, background) = (composition.outputs.exposure, &composition.background);
    let accumulator = &scratch.accumulator;
    let mut planes = Vec::new();
    for layer in &accumulator.layers {
        planes.extend(layer[..3].iter().map(|plane| plane.iter().map(|value| exposure * value).collect::<Vec<f32>>()));
        planes.push(layer[3].clone());
    }
    if composition.outputs.layers && composition.plate.color.is_some() {
        match background.channels {
            [] => planes.extend(plate_layer(composition, scratch)),
            _ => planes.extend([0; 4].map(|_| vec![0.0; accumulator.depth.len()])),
        }
    }
    let accumulator = &scratch.accumulator;
    for (channel, (plane, drawn)) in planes.iter_mut().zip(background.channels).enumerate() {
        let values = background.plane(&drawn.values, accumulator.rect, &scratch.bent, composition.view.size[0]);
        for (index, (own, value)) in plane.iter_mut().zip(values).enumerate() {
            let through = accumulator.transmittance_at(index);
            let weight = through.get(channel % 4).copied().unwrap_or((through[0] + through[1] + through[2]) / 3.0);
            *own = weight.fma(value, *own);
        }
    }
    planes
}

fn aov_planes(composition: &Composition, accumulator: &Accumulator) -> Vec<Vec<f32>> {
    let mut planes = Vec::new();
    for (run, aovs) in composition.runs.iter().zip(&accumulator.aovs) {
        for (descriptor, plane) in run.info().aovs.iter().zip(aovs) {
            let pixels = accumulator.rect.width * accumulator.rect.height;
            planes.push((0..pixels).map(|index| plane.resolve(index, descriptor.rule)).collect());
        }
    }
    planes
}

fn plate_layer(composition: &Composition, scratch: &mut StripScratch) -> [Vec<f32>; 4] {
    let StripScratch { accumulator, bent, row: buffer, .. } = scratch;
    let rect = accumulator.rect;
    let mut layer: [Vec<f32>; 4] = Default::default();
    for row in 0..rect.height {
        let Some(plate) = composition.background.color_row(rect, row, bent, buffer) else { break };
        for (x, plate) in plate.iter().enumerate() {
            let through = accumulator.transmittance_at(row * rect.width + x);
            for c in 0..3 {
                layer[c].push(through[c] * plate[c]);
            }
            layer[3].push(plate[3] * (through[0] + through[1] + through[2]) / 3.0);
        }
    }
    layer
}

/// Concatenates the planes of all strips into named channels.
fn channels(composition: &Composition, strips: Vec<Vec<Vec<f32>>>) -> Vec<Channel> {
    let mut channels = channel_names(composition);
    for strip in strips {
        for (channel, plane) in channels.iter_mut().zip(strip) {
            channel.values.extend(plane);
        }
    }
    channels
}

fn channel_names(composition: &Composition) -> Vec<Channel> {
    let channel = |name: String, precision| Channel { name, precision, values: Vec::new() };
    let mut channels = Vec::new();
    if composition.outputs.layers {
        let plate = composition.plate.color.is_some().then_some(PLATE_LAYER);
        let names = composition.runs.iter().map(|run| run.info().name).chain(plate);
        for name in names {
            let color = |suffix| channel(format!("{name}.{suffix}"), Precision::Half);
            channels.extend(["R", "G", "B", "A"].map(color));
        }
    }
    if composition.outputs.aovs {
        for run in composition.runs {
            let aov = |aov: &AovDescriptor| channel(format!("{}.{}", run.info().name, aov.name), Precision::Single);
            channels.extend(run.info().aovs.iter().map(aov));
        }
    }
    channels
}

#[cfg(test)]
mod tests {
    use bansho_base::math::{random::Key, random::Purpose, simd::VectorLevel};

    use super::*;

    /// A plane of random numbers in [0, 1).
    fn plane(id: u64) -> Vec<f32> {
        let key = Key::new(3, "composite");
        (0..17).flat_map(|step| key.uniforms(id, step, Purpose(0))).collect()
    }

    #[test]
    fn rows_are_composited_to_the_same_bits_at_every_vector_level() {
        let planes: [Vec<f32>; 6] = std::array::from_fn(|id| plane(id as u64));
        let [red, green, blue, through_red, through_green, through_blue] = planes.each_ref().map(Vec::as_slice);
        let (color, transmittance) = ([red, green, blue], [through_red, through_green, through_blue]);
        let background: Vec<[f32; 4]> = (0..red.len()).map(|i| [blue[i], red[i], through_red[i], green[i]]).collect();
        let composited = |level: Level| {
            let mut rows = [vec![[0.0; 4]; red.len()], vec![[0.0; 4]; red.len()]];
            let [clear, absorbed] = &mut rows;
            dispatch!(level, _simd => expose_row(0.37, color, clear));
            dispatch!(level, _simd => composite_background(&background, clear));
            dispatch!(level, _simd => expose_absorbed_row(0.37, color, transmittance, absorbed));
            dispatch!(level, _simd => composite_absorbed_background(transmittance, &background, absorbed));
            rows.map(|row| row.into_flattened().into_iter().map(f32::to_bits).collect::<Vec<_>>())
        };
        let levels: Vec<Level> = VectorLevel::available().into_iter().filter_map(VectorLevel::level).collect();
        let narrowest = composited(levels[0]);
        assert!(levels.iter().all(|level| composited(*level) == narrowest));
    }
}
