//! One prepared frame of a sheet: flames, smoke and sparks sorted by depth, nearest first.

use bansho_base::{
    camera::upright_quad::UprightQuad,
    host::observer::{Cancelled, Observer, check},
    image::Rect,
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Strip, View},
        surroundings::Surroundings,
    },
};
use fearless_simd::Level;

use super::{
    aovs::{AovContext, write_aov_rows},
    draw::{DrawContext, MAX_MINIFICATION, draw_rows, row_band_height},
    shade::{SheetContent, TimeSample},
    soot_field::{SootContext, SootSample, draw_soot_rows},
    time_samples::pixels_per_meter,
};
use crate::{
    sheet::{
        model::{FlameInstance, FlameSheet},
        parameters::{SheetMethod, Stage},
    },
    sparks::{SparkEmitter, Streak},
};

/// A frame, ready to be drawn into strips.
pub(crate) struct PreparedSheet<'a> {
    sheet: &'a FlameSheet,
    view: &'a View,
    level: Level,
    commands: Vec<DrawCommand<'a>>,
}

/// A sheet or a spark at one depth.
struct DrawCommand<'a> {
    flame: &'a FlameInstance,
    depth: f64,
    rect: Rect,
    item: DrawItem,
}

enum DrawItem {
    /// A sheet of flame or smoke.
    Sheet(SheetContent, Vec<TimeSample>),
    /// Flame and smoke as one field.
    SootField(Vec<SootSample>),
    /// A spark.
    Spark(Streak),
}

impl<'a> PreparedSheet<'a> {
    pub(crate) fn new(
        sheet: &'a FlameSheet,
        view: &'a View,
        surroundings: &Surroundings,
        observer: &dyn Observer,
    ) -> Result<Self, Cancelled> {
        let mut commands = Vec::new();
        for flame in &sheet.flames {
            check(observer)?;
            sheet.add_draw_commands(flame, view, surroundings, &mut commands);
        }
        // A stable sort: at one depth the order is flame, smoke, sparks of each instance.
        commands.sort_by(|a: &DrawCommand, b: &DrawCommand| a.depth.total_cmp(&b.depth));
        Ok(Self { sheet, view, level: bansho_base::math::simd::level(), commands })
    }
}

impl FlameSheet {
    /// Adds flame, smoke and sparks of one instance.
    fn add_draw_commands<'a>(
        &'a self,
        flame: &'a FlameInstance,
        view: &View,
        surroundings: &Surroundings,
        commands: &mut Vec<DrawCommand<'a>>,
    ) {
        let base = self.base(flame, view.shutter.middle());
        let right = self.right(flame, &view.camera, base);
        let quad = UprightQuad::new(base, right, self.sheet_size(flame), 0.0);
        let scale = pixels_per_meter(&view.camera, &quad);
        let count = self.time_samples(flame, view.shutter, scale);
        let depth = view.camera.depth(quad.point(0.5, 0.5));
        match self.parameters.method {
            _ if self.is_out(view.shutter.middle()) => {}
            SheetMethod::Texture => {
                let texture = flame.texture_source.filtered(scale * quad.size.y, &self.filter_cache);
                let (samples, rect) = self.samples(flame, &texture, view, surroundings.wind, count);
                if !samples.is_empty() {
                    commands.push(DrawCommand { flame, depth, rect, item: DrawItem::Sheet(self.content(), samples) });
                }
            }
            SheetMethod::SootField => {
                let (samples, rect) = self.soot_samples(flame, view, surroundings, count);
                commands.push(DrawCommand { flame, depth, rect, item: DrawItem::SootField(samples) });
            }
        }
        if self.parameters.stage != Stage::Flame {
            return;
        }
        if let Some((sample, rect)) = self.smoke_sample(flame, view, surroundings) {
            commands.push(DrawCommand { flame, depth, rect, item: DrawItem::Sheet(SheetContent::Smoke, vec![sample]) });
        }
        for streak in self.spark_emitter(flame, view).streaks(view, surroundings.wind) {
            let rect = streak.bounds(view.size);
            commands.push(DrawCommand { flame, depth: streak.depth, rect, item: DrawItem::Spark(streak) });
        }
    }

    /// Emitter of the sparks of one instance.
    fn spark_emitter(&self, flame: &FlameInstance, view: &View) -> SparkEmitter<'_> {
        let t = view.shutter.middle();
        SparkEmitter {
            parameters: &self.parameters.sparks,
            key: flame.key,
            now: self.clock.time(self.flame_time(flame, t)),
            loop_s: self.clock.loop_s(),
            flow: Some(&self.parameters.flow),
            phase_s: self.parameters.phase_s + flame.placement.phase_s,
            base: self.base(flame, t),
            size: self.sheet_size(flame),
            scale: flame.placement.scale,
            wind_response: self.parameters.wind_response,
        }
    }

    /// Depth interval of a flame and its sparks.
    pub(crate) fn depth_interval(&self, flame: &FlameInstance, view: &View) -> DepthInterval {
        let base = self.base(flame, view.shutter.middle());
        let size = self.sheet_size(flame);
        let depth = view.camera.depth(base + bansho_base::math::DVec3::Y * (0.5 * size.y));
        let half = 0.25 * size.x + if self.parameters.sparks.rate > 0.0 { self.parameters.sparks.swirl } else { 0.0 };
        DepthInterval { near: (depth - half).max(0.0), far: (depth + half).max(0.0) }
    }
}

impl Prepared for PreparedSheet<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let in_slice = self.commands.iter().filter(|command| slice.contains(command.depth));
        in_slice.fold(Rect::default(), |all, command| all.union(&command.rect))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        for command in self.commands.iter().filter(|command| slice.contains(command.depth)) {
            let rect = command.rect.intersection(&strip.rect);
            if rect.is_empty() {
                continue;
            }
            match &command.item {
                DrawItem::Sheet(content, samples) => self.draw_sheet(command, *content, samples, rect, strip),
                DrawItem::SootField(samples) => {
                    let context = SootContext { sheet: self.sheet, flame: command.flame, view: self.view, samples };
                    fearless_simd::dispatch!(self.level, simd => draw_soot_rows(simd, &context, rect, strip));
                }
                DrawItem::Spark(streak) => streak.draw(self.view.size, strip),
            }
        }
    }
}

impl PreparedSheet<'_> {
    fn draw_sheet(
        &self,
        command: &DrawCommand,
        content: SheetContent,
        samples: &[TimeSample],
        rect: Rect,
        strip: &mut Strip,
    ) {
        let (sheet, absorbs) = (self.sheet, self.sheet.ramp().absorbs || content == SheetContent::Smoke);
        let row_band = samples.first().map_or(1, |sample| row_band_height(1.0 / f64::from(sample.state.pixel[1])));
        let context = DrawContext {
            shape: sheet.shape(),
            ramp: sheet.ramp(),
            samples,
            content,
            absorbs,
            row_band,
            max_minification: MAX_MINIFICATION,
        };
        fearless_simd::dispatch!(self.level, simd => draw_rows(simd, &context, rect, strip));
        if !strip.aovs.is_empty() {
            let context = AovContext { sheet, flame: command.flame, view: self.view, samples, content };
            fearless_simd::dispatch!(self.level, simd => write_aov_rows(simd, &context, rect, strip));
        }
    }
}
