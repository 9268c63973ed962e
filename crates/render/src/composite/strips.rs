//! From prepared phenomena to a frame: strip by strip, slice by slice, nearest first, the plate behind all.

use bansho_base::{
    host::{
        observer::{self, Cancelled, Observer},
        scratch_pool::ScratchPool,
    },
    image::{Channel, Frame, FrameHeader, Image, Precision, Rect},
    math::MulAdd,
    phenomenon::{
        Prepared,
        strip::{AovRule, Strip, View},
    },
};

use super::{
    accumulate::Accumulator,
    background::{Behind, Sources},
    plate::PlateFrame,
    slices::Slice,
};
use crate::compiled::ActiveRun;
use bansho_scene::PLATE_LAYER;
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

/// Rows of a strip: the planes of a 1920-pixel strip stay within a core's second-level cache.
pub(crate) const STRIP_ROWS: usize = 8;

/// What a frame is to hold.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outputs {
    /// What absolute radiance is multiplied by.
    pub(crate) exposure: f32,
    /// Whether each phenomenon gets a layer.
    pub(crate) layers: bool,
    /// Whether AOVs are written.
    pub(crate) aovs: bool,
}

impl Outputs {
    /// What the shot asks for.
    pub(crate) fn of_plan(plan: &crate::plan::Plan) -> Self {
        Self { exposure: plan.exposure_scale(), layers: plan.layers, aovs: plan.aovs }
    }

    /// Nothing but absolute radiance.
    pub(crate) const RADIANCE: Self = Self { exposure: 1.0, layers: false, aovs: false };
}

/// One frame, ready to be composited.
#[derive(Clone, Copy)]
pub(crate) struct Composition<'a> {
    pub(crate) outputs: Outputs,
    pub(crate) view: &'a View,
    pub(crate) runs: &'a [ActiveRun],
    pub(crate) prepared: &'a [Box<dyn Prepared + 'a>],
    pub(crate) slices: &'a [Slice],
    pub(crate) plate: &'a PlateFrame,
    /// What the slices stand before.
    pub(crate) behind: Behind<'a>,
}

/// Scratch of one thread.
#[derive(Default)]
struct Worker {
    strip: Strip,
    accumulator: Accumulator,
    /// Where the light behind the strip comes from, where it is bent, and a row of it.
    sources: Sources,
    row: Vec<[f32; 4]>,
}

impl Composition<'_> {
    /// The strip with index `index` of the window.
    fn strip_rect(&self, index: usize) -> Rect {
        let window = self.view.window;
        let y = index * STRIP_ROWS;
        Rect { x: window.x, y: window.y + y, width: window.width, height: STRIP_ROWS.min(window.height - y) }
    }

    /// The part of a strip that can differ from nothing; all of it where there is something behind, a layer or an AOV to fill.
    fn worth_drawing(&self, rect: Rect) -> Rect {
        if self.behind.color.is_some() || self.outputs.layers || self.outputs.aovs {
            return rect;
        }
        let touched = |slice: &Slice| {
            let each = slice.members.iter().map(|&member| self.prepared[member].bounds(&slice.interval));
            each.fold(Rect::default(), |all, bounds| all.union(&bounds.intersection(&rect)))
        };
        self.slices.iter().map(touched).fold(Rect::default(), |all, part| all.union(&part))
    }

    /// The part of the frame that can differ from nothing, in the frame's own pixels.
    fn content(&self) -> Rect {
        let window = self.view.window;
        let strips = 0..window.height.div_ceil(STRIP_ROWS);
        let all = strips.map(|index| self.worth_drawing(self.strip_rect(index)));
        let part = all.fold(Rect::default(), |all, part| all.union(&part));
        Rect { x: part.x.saturating_sub(window.x), y: part.y.saturating_sub(window.y), ..part }
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

    /// Draws the slices within `rect` into the worker's accumulator, nearest first.
    fn accumulate(&self, level: Level, rect: Rect, worker: &mut Worker) {
        let aovs = self.aov_counts();
        worker.accumulator.reset(rect, self.layer_count(), &aovs);
        let plate_depth = self.plate.depth.as_ref();
        for slice in self.slices {
            for &member in &slice.members {
                let prepared = &self.prepared[member];
                let wanted = aovs.get(member).copied().unwrap_or(0);
                let touched = prepared.bounds(&slice.interval).intersection(&rect);
                if touched.is_empty() {
                    continue;
                }
                // AOV planes are added as wholes, so their strips keep the full size.
                let drawn = if wanted > 0 { rect } else { touched };
                match plate_depth {
                    Some(image) => worker.strip.reset(drawn, Some(&|y| image.row(y).as_flattened()), wanted),
                    None => worker.strip.reset(drawn, None, wanted),
                }
                prepared.draw(&slice.interval, &mut worker.strip);
                worker.accumulator.add_behind(level, &worker.strip, member, self.runs[member].info().aovs);
            }
        }
    }
}

/// Memory for a frame: empty pixels, but for those of the frame that it held before.
struct Canvas {
    beauty: Image<4>,
    depth: Vec<f32>,
    stale: Rect,
}

impl Canvas {
    /// Takes the memory of a spent frame if it fits: fresh memory costs more than drawing a sparse frame.
    fn new(window: Rect, spent: Option<Frame>) -> Self {
        let (width, height) = (window.width, window.height);
        let fits = |frame: &Frame| frame.beauty.width() == width && frame.beauty.height() == height;
        if let Some(Frame { beauty, depth: Some(depth), content, .. }) = spent.filter(fits) {
            return Self { beauty, depth, stale: content };
        }
        let depth = vec![f32::INFINITY; width * height];
        Self { beauty: Image::filled(width, height, [0.0; 4]), depth, stale: Rect::default() }
    }
}

/// Empties what a spent frame left in the rows from `first` on.
fn clear(stale: Rect, first: usize, width: usize, beauty: &mut [[f32; 4]], depth: &mut [f32]) {
    for (row, (beauty, depth)) in beauty.chunks_mut(width).zip(depth.chunks_mut(width)).enumerate() {
        if (stale.y..stale.bottom()).contains(&(first + row)) {
            beauty[stale.x..stale.right()].fill([0.0; 4]);
            depth[stale.x..stale.right()].fill(f32::INFINITY);
        }
    }
}

/// Draws and composites the whole window.
pub(crate) fn frame(
    composition: &Composition,
    header: FrameHeader,
    spent: Option<Frame>,
    observer: &dyn Observer,
) -> Result<Frame, Cancelled> {
    let window = composition.view.window;
    let level = Level::new();
    let Canvas { mut beauty, mut depth, stale } = Canvas::new(window, spent);
    let strip_pixels = STRIP_ROWS * window.width;
    let workers = ScratchPool::new(Worker::default);
    let planes: Vec<Vec<Vec<f32>>> = beauty
        .pixels_mut()
        .par_chunks_mut(strip_pixels)
        .zip(depth.par_chunks_mut(strip_pixels))
        .enumerate()
        .with_max_len(1)
        .map(|(index, (beauty, depth))| {
            observer::check(observer)?;
            clear(stale, index * STRIP_ROWS, window.width, beauty, depth);
            let strip = composition.strip_rect(index);
            let rect = composition.worth_drawing(strip);
            if rect.is_empty() {
                return Ok(Vec::new());
            }
            workers.with(|worker| {
                composition.accumulate(level, rect, worker);
                composition.behind.trace(rect, &mut worker.sources);
                finish_strip(composition, level, worker, strip, beauty, depth);
                Ok(channel_planes(composition, worker))
            })
        })
        .collect::<Result<_, Cancelled>>()?;
    let opaque = composition.plate.color.is_some() && composition.view.overscan == 0;
    let content = composition.content();
    Ok(Frame {
        header,
        beauty,
        depth: Some(depth),
        channels: channels(composition, planes),
        opaque,
        content,
        metadata: Vec::new(),
    })
}

/// Exposes the strip, puts behind it what is there, and gives it its alpha.
fn finish_strip(
    composition: &Composition,
    level: Level,
    worker: &mut Worker,
    strip: Rect,
    beauty: &mut [[f32; 4]],
    depth: &mut [f32],
) {
    let (exposure, behind) = (composition.outputs.exposure, &composition.behind);
    let Worker { accumulator, sources, row: buffer, .. } = worker;
    let rect = accumulator.rect;
    for row in 0..rect.height {
        let pixels = row * rect.width..(row + 1) * rect.width;
        let first = (rect.y - strip.y + row) * strip.width + rect.x - strip.x;
        let (out, depth) = (&mut beauty[first..][..rect.width], &mut depth[first..][..rect.width]);
        depth.copy_from_slice(&accumulator.depth[pixels.clone()]);
        let color = accumulator.color.each_ref().map(|plane| &plane[pixels.clone()]);
        match accumulator.transmittance() {
            None => dispatch!(level, _simd => expose_row(exposure, color, out)),
            Some(planes) => {
                let through = planes.each_ref().map(|plane| &plane[pixels.clone()]);
                dispatch!(level, _simd => expose_absorbed_row(exposure, color, through, out));
            }
        }
        if let Some(colors) = behind.color_row(rect, row, sources, buffer) {
            match accumulator.transmittance() {
                None => dispatch!(level, _simd => lay_behind(colors, out)),
                Some(planes) => {
                    let through = planes.each_ref().map(|plane| &plane[pixels.clone()]);
                    dispatch!(level, _simd => lay_behind_absorbed(through, colors, out));
                }
            }
        }
        if let Some(depths) = behind.depth_row(rect, row, composition.view.size[0]) {
            depth.iter_mut().zip(depths).for_each(|(depth, behind)| *depth = depth.min(*behind));
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
fn expose_absorbed_row(exposure: f32, color: [&[f32]; 3], through: [&[f32]; 3], out: &mut [[f32; 4]]) {
    expose_row(exposure, color, out);
    let [red, green, blue] = through;
    for (((out, red), green), blue) in out.iter_mut().zip(red).zip(green).zip(blue) {
        out[3] = 1.0 - (red + green + blue) * (1.0 / 3.0);
    }
}

/// Puts behind a row what is there, where nothing absorbs.
#[inline(always)]
fn lay_behind(behind: &[[f32; 4]], out: &mut [[f32; 4]]) {
    for (out, behind) in out.iter_mut().zip(behind) {
        let share = [1.0, 1.0, 1.0, 1.0 - out[3]];
        for c in 0..4 {
            out[c] = share[c].fma(behind[c], out[c]);
        }
    }
}

/// The same where something absorbs.
#[inline(always)]
fn lay_behind_absorbed([red, green, blue]: [&[f32]; 3], behind: &[[f32; 4]], out: &mut [[f32; 4]]) {
    for ((((out, behind), red), green), blue) in out.iter_mut().zip(behind).zip(red).zip(green).zip(blue) {
        let share = [*red, *green, *blue, 1.0 - out[3]];
        for c in 0..4 {
            out[c] = share[c].fma(behind[c], out[c]);
        }
    }
}

/// This strip's part of every layer and AOV, in the order of [`channels`].
fn channel_planes(composition: &Composition, worker: &mut Worker) -> Vec<Vec<f32>> {
    let mut planes = layer_planes(composition, worker);
    let layers = planes.len();
    planes.extend(aov_planes(composition, &worker.accumulator));
    let rules = composition.runs.iter().flat_map(|run| run.info().aovs).map(|aov| aov.rule);
    let behind = composition.behind.channels.get(layers..).unwrap_or_default();
    for ((plane, behind), rule) in planes[layers..].iter_mut().zip(behind).zip(rules) {
        let values = composition.behind.plane(
            &behind.values,
            worker.accumulator.rect,
            &Sources::default(),
            composition.view.size[0],
        );
        plane.iter_mut().zip(values).for_each(|(own, behind)| *own = nearest_aov(*own, behind, rule));
    }
    planes
}

/// An AOV of a phenomenon that reaches into several groups of slices: of the nearest group with a value, unless values are added.
fn nearest_aov(own: f32, behind: f32, rule: AovRule) -> f32 {
    match rule {
        AovRule::Sum => own + behind,
        AovRule::WeightedMean | AovRule::Nearest if own == 0.0 => behind,
        AovRule::WeightedMean | AovRule::Nearest => own,
    }
}

/// Layers of the phenomena and of the plate: what is behind the strip, as far as it lets it through, and its own.
fn layer_planes(composition: &Composition, worker: &mut Worker) -> Vec<Vec<f32>> {
    let (exposure, behind) = (composition.outputs.exposure, &composition.behind);
    let accumulator = &worker.accumulator;
    let mut planes = Vec::new();
    for layer in &accumulator.layers {
        planes.extend(layer[..3].iter().map(|plane| plane.iter().map(|value| exposure * value).collect::<Vec<f32>>()));
        planes.push(layer[3].clone());
    }
    if composition.outputs.layers && composition.plate.color.is_some() {
        match behind.channels {
            [] => planes.extend(plate_layer(composition, worker)),
            _ => planes.extend([0; 4].map(|_| vec![0.0; accumulator.depth.len()])),
        }
    }
    let accumulator = &worker.accumulator;
    for (number, (plane, drawn)) in planes.iter_mut().zip(behind.channels).enumerate() {
        let values = behind.plane(&drawn.values, accumulator.rect, &worker.sources, composition.view.size[0]);
        for (index, (own, value)) in plane.iter_mut().zip(values).enumerate() {
            let through = accumulator.transmittance_at(index);
            let share = through.get(number % 4).copied().unwrap_or((through[0] + through[1] + through[2]) / 3.0);
            *own = share.fma(value, *own);
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

fn plate_layer(composition: &Composition, worker: &mut Worker) -> [Vec<f32>; 4] {
    let Worker { accumulator, sources, row: buffer, .. } = worker;
    let rect = accumulator.rect;
    let mut layer: [Vec<f32>; 4] = Default::default();
    for row in 0..rect.height {
        let Some(plate) = composition.behind.color_row(rect, row, sources, buffer) else { break };
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

/// Joins the strips' planes and names them.
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
            let aov = |aov: &bansho_base::phenomenon::strip::AovDescriptor| {
                channel(format!("{}.{}", run.info().name, aov.name), Precision::Single)
            };
            channels.extend(run.info().aovs.iter().map(aov));
        }
    }
    channels
}
