//! One prepared frame of a sheet: flames, smoke and sparks sorted by depth, nearest first.

use bansho_base::{
    camera::upright_quad::UprightQuad,
    host::{
        observer::{Cancelled, Observer, check},
        scratch_pool::ScratchPool,
    },
    image::Rect,
    math::DVec3,
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Strip, View},
        surroundings::Surroundings,
    },
    world::wind::Wind,
};
use fearless_simd::Level;

use super::{
    aovs::{AovContext, write_aov_rows},
    cells::{CellResolution, SheetCells, small_height},
    draw::{DrawContext, MAX_MINIFICATION, draw_rows, row_band_height},
    draw_cells::{CellContext, CellSample, CellSums, TextureCells, draw_cells},
    shade::{SheetContent, TimeSample},
    soot_field::{SootContext, SootSample, draw_soot_rows},
    time_samples::pixels_per_meter,
};
use crate::{
    sheet::{
        model::{FlameInstance, FlameSheet},
        parameters::{SheetMethod, SheetStage},
    },
    sparks::{SheetPlane, SparkEmitter, SparkStreak},
};

/// A frame, ready to be drawn into strips.
pub(crate) struct PreparedSheet<'a> {
    sheet: &'a FlameSheet,
    view: &'a View,
    level: Level,
    commands: Vec<DrawCommand<'a>>,
    /// Sums of small sheets.
    cell_sums: ScratchPool<CellSums, fn() -> CellSums>,
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
    Spark(SparkStreak),
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
        Ok(Self {
            sheet,
            view,
            level: bansho_base::math::simd::level(),
            commands,
            cell_sums: ScratchPool::new(CellSums::default),
        })
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
        let t = view.shutter.middle();
        let base = self.base(flame, t);
        let right = self.right(flame, &view.camera, base);
        let quad = UprightQuad::new(base, right, self.sheet_size(flame), 0.0);
        let scale = pixels_per_meter(&view.camera, &quad);
        let count = self.time_samples(flame, view.shutter, scale);
        let depth = self.flame_depth(flame, view);
        match self.parameters.method {
            _ if self.is_out(t) => {}
            SheetMethod::FlameTexture => {
                let texels_up = flame.texels_up();
                let is_flame = self.content() == SheetContent::Flame;
                let top = if is_flame { self.height_fraction(t).min(1.0) } else { 1.0 };
                let grid = SheetCells::new(&view.camera, &quad, &CellResolution { texels_up, top });
                // Never filtered further, also where cells cannot be used, as at the pole of a panorama: the texture is thresholded afterwards, and a mean that is
                // thresholded is darker than the mean of what is thresholded.
                let height_pixels = (scale * quad.size.y).max(small_height(texels_up));
                let texture = flame.texture_source.filtered(height_pixels, &self.filter_cache);
                let (samples, rect) = self.samples(flame, &texture, view, surroundings.wind, count, grid);
                if !samples.is_empty() {
                    commands.push(DrawCommand { flame, depth, rect, item: DrawItem::Sheet(self.content(), samples) });
                }
            }
            SheetMethod::SootField => {
                let resolution = CellResolution { texels_up: self.soot_texels_up(flame), top: 1.0 };
                let grid = SheetCells::new(&view.camera, &quad, &resolution);
                let (samples, rect) = self.soot_samples(flame, view, surroundings, count, grid);
                commands.push(DrawCommand { flame, depth, rect, item: DrawItem::SootField(samples) });
            }
        }
        if self.parameters.stage != SheetStage::Flame {
            return;
        }
        if let Some((sample, rect)) = self.smoke_sample(flame, view, surroundings) {
            commands.push(DrawCommand { flame, depth, rect, item: DrawItem::Sheet(SheetContent::Smoke, vec![sample]) });
        }
        for streak in self.spark_emitter(flame, view).streaks(view, surroundings.wind) {
            let rect = streak.bounds(view.size);
            commands.push(DrawCommand { flame, depth: streak.sorting_depth, rect, item: DrawItem::Spark(streak) });
        }
    }

    /// The filtered texture that a flame shares with others in a view: see `TextureSource::shared_table_key`.
    pub(crate) fn shared_table_key(&self, flame: &FlameInstance, view: &View) -> Option<u64> {
        let base = self.base(flame, view.shutter.middle());
        let right = self.right(flame, &view.camera, base);
        let quad = UprightQuad::new(base, right, self.sheet_size(flame), 0.0);
        let scale = pixels_per_meter(&view.camera, &quad);
        let is_drawn = self.parameters.method == SheetMethod::FlameTexture && !self.is_out(view.shutter.middle());
        flame.texture_source.shared_table_key(scale * quad.size.y).filter(|_| is_drawn)
    }

    /// Emitter of the sparks of one instance.
    fn spark_emitter(&self, flame: &FlameInstance, view: &View) -> SparkEmitter<'_> {
        let t = view.shutter.middle();
        let base = self.base(flame, t);
        let across = self.right(flame, &view.camera, base).cross(DVec3::Y);
        let normal = across * (view.camera.position - base).dot(across).signum();
        let sheet = SheetPlane { point: base, normal, depth: self.flame_depth(flame, view) };
        SparkEmitter {
            parameters: &self.parameters.sparks,
            key: flame.key,
            now: self.clock.time(self.flame_time(flame, t)),
            loop_s: self.clock.loop_s(),
            flow: Some(&self.parameters.flow),
            phase_s: self.parameters.phase_s + flame.placement.phase_s,
            base,
            size: self.sheet_size(flame),
            scale: flame.placement.scale,
            wind_response: self.parameters.wind_response,
            sheet: Some(sheet),
        }
    }

    /// Depth at which a flame and its smoke are drawn, that of the sheet's middle, m.
    fn flame_depth(&self, flame: &FlameInstance, view: &View) -> f64 {
        let base = self.base(flame, view.shutter.middle());
        view.camera.depth(base + DVec3::Y * (0.5 * self.sheet_size(flame).y))
    }

    /// Depths at which a flame is drawn, without thickness, so that whatever is nearer hides it and whatever is farther is hidden; and the interval of its
    /// sparks.
    pub(crate) fn depths(
        &self,
        flame: &FlameInstance,
        view: &View,
        wind: &Wind,
    ) -> impl Iterator<Item = DepthInterval> + use<> {
        // The same number of intervals for every view: where it moves, those of the parts of an exposure are joined one by one.
        let depth = self.flame_depth(flame, view).max(0.0);
        let sheet = DepthInterval { near: depth, far: depth.next_up() };
        let sparks = (self.parameters.sparks.rate > 0.0)
            .then(|| self.spark_emitter(flame, view).depths(view, wind).unwrap_or(sheet));
        std::iter::once(sheet).chain(sparks)
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
                DrawItem::SootField(samples) if samples.iter().any(|sample| sample.cells.is_some()) => {
                    self.draw_cells(command, samples, true, rect, strip);
                }
                DrawItem::SootField(samples) => {
                    let context = SootContext { sheet: self.sheet, flame: command.flame, view: self.view, samples };
                    fearless_simd::dispatch!(self.level, simd => draw_soot_rows(simd, &context, rect, strip));
                }
                DrawItem::Spark(streak) => streak.draw(self.view, strip),
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
        if samples.iter().any(|sample| sample.cells.is_some()) {
            if let [sample] = samples {
                // Without a list, which every strip would allocate.
                return self.draw_cells(command, &[TextureCells(sample, content)], absorbs, rect, strip);
            }
            let samples: Vec<TextureCells> = samples.iter().map(|sample| TextureCells(sample, content)).collect();
            return self.draw_cells(command, &samples, absorbs, rect, strip);
        }
        let row_band = samples
            .first()
            .map_or(1, |sample| row_band_height(1.0 / f64::from(sample.state.pixel[1]), sample.state.eddies.is_some()));
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

    /// Draws a sheet that is small in the picture.
    fn draw_cells<T: CellSample>(
        &self,
        command: &DrawCommand,
        samples: &[T],
        absorbs: bool,
        rect: Rect,
        strip: &mut Strip,
    ) {
        let context = CellContext { sheet: self.sheet, flame: command.flame, view: self.view, samples, absorbs };
        self.cell_sums.with(|sums| {
            fearless_simd::dispatch!(self.level, simd => draw_cells(simd, &context, rect, sums, strip));
        });
    }
}
