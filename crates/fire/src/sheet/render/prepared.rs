//! One frame of a sheet: its flames in order of depth, nearest first.

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

use super::{
    aovs::{Measured, measure_rows},
    draw::{Paint, SQUEEZED, band_of, draw_rows},
    flame::{Flame, pixels_per_metre},
    shade::{Drawn, Sample},
};
use crate::{
    sheet::{FlameSheet, parameters::StageShown},
    sparks::{Fire, Streak},
};
use fearless_simd::Level;

/// A frame, ready to draw in strips.
pub(crate) struct PreparedSheet<'a> {
    sheet: &'a FlameSheet,
    view: &'a View,
    level: Level,
    parts: Vec<Part<'a>>,
}

/// One thing that is drawn, at one depth.
struct Part<'a> {
    flame: &'a Flame,
    depth: f64,
    rect: Rect,
    matter: Matter,
}

enum Matter {
    /// A sheet of flame or smoke.
    Sheet(Drawn, Vec<Sample>),
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
        let mut parts = Vec::new();
        for flame in &sheet.flames {
            check(observer)?;
            sheet.add_parts(flame, view, surroundings, &mut parts);
        }
        // A stable sort: things at one depth keep the order flame, smoke, sparks of each instance.
        parts.sort_by(|a: &Part, b: &Part| a.depth.total_cmp(&b.depth));
        Ok(Self { sheet, view, level: Level::new(), parts })
    }
}

impl FlameSheet {
    /// Flame, smoke and sparks of one instance.
    fn add_parts<'a>(&'a self, flame: &'a Flame, view: &View, surroundings: &Surroundings, parts: &mut Vec<Part<'a>>) {
        let base = self.base(flame, view.shutter.middle());
        let right = self.right(flame, &view.camera, base);
        let stand = UprightQuad::new(base, right, self.sheet_size(flame), 0.0);
        let scale = pixels_per_metre(&view.camera, &stand);
        let source = flame.source.filtered(scale * stand.size.y);
        let count = self.time_samples(flame, view.shutter, scale);
        let (samples, rect) = self.samples(flame, &source, view, surroundings.wind, count);
        let depth = view.camera.depth(stand.point(0.5, 0.5));
        if !samples.is_empty() {
            parts.push(Part { flame, depth, rect, matter: Matter::Sheet(self.drawn(), samples) });
        }
        if self.parameters.stage != StageShown::Flame {
            return;
        }
        if let Some((sample, rect)) = self.smoke_sample(flame, view, surroundings) {
            parts.push(Part { flame, depth, rect, matter: Matter::Sheet(Drawn::Smoke, vec![sample]) });
        }
        for streak in self.fire(flame, view).streaks(view, surroundings.wind) {
            let rect = streak.bounds(view.size);
            parts.push(Part { flame, depth: streak.depth, rect, matter: Matter::Spark(streak) });
        }
    }

    /// The fire whose sparks fly.
    fn fire(&self, flame: &Flame, view: &View) -> Fire<'_> {
        let t = view.shutter.middle();
        Fire {
            parameters: &self.parameters.sparks,
            key: flame.key,
            now: self.clock.time(self.flame_time(flame, t)),
            loop_s: self.clock.loop_s(),
            base: self.base(flame, t),
            size: self.sheet_size(flame),
            scale: flame.place.scale,
            wind_response: self.parameters.wind_response,
        }
    }

    /// The stretch of depth that a flame with its sparks fills.
    pub(crate) fn depth_interval(&self, flame: &Flame, view: &View) -> DepthInterval {
        let base = self.base(flame, view.shutter.middle());
        let size = self.sheet_size(flame);
        let depth = view.camera.depth(base + bansho_base::math::DVec3::Y * (0.5 * size.y));
        let half = 0.25 * size.x + if self.parameters.sparks.rate > 0.0 { self.parameters.sparks.swirl } else { 0.0 };
        DepthInterval { near: (depth - half).max(0.0), far: (depth + half).max(0.0) }
    }
}

impl Prepared for PreparedSheet<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let shown = self.parts.iter().filter(|part| slice.contains(part.depth));
        shown.fold(Rect::default(), |all, part| all.union(&part.rect))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        for part in self.parts.iter().filter(|part| slice.contains(part.depth)) {
            let rect = part.rect.intersection(&strip.rect);
            if rect.is_empty() {
                continue;
            }
            match &part.matter {
                Matter::Sheet(drawn, samples) => self.draw_sheet(part, *drawn, samples, rect, strip),
                Matter::Spark(streak) => streak.draw(self.view.size, strip),
            }
        }
    }
}

impl PreparedSheet<'_> {
    fn draw_sheet(&self, part: &Part, drawn: Drawn, samples: &[Sample], rect: Rect, strip: &mut Strip) {
        let (sheet, absorbs) = (self.sheet, self.sheet.ramp().absorbs || drawn == Drawn::Smoke);
        let band = samples.first().map_or(1, |sample| band_of(1.0 / f64::from(sample.state.pixel[1])));
        let paint =
            Paint { shape: sheet.shape(), ramp: sheet.ramp(), samples, drawn, absorbs, band, squeezed: SQUEEZED };
        fearless_simd::dispatch!(self.level, simd => draw_rows(simd, &paint, rect, strip));
        if !strip.aovs.is_empty() {
            let measured = Measured { sheet, flame: part.flame, view: self.view, samples, drawn };
            fearless_simd::dispatch!(self.level, simd => measure_rows(simd, &measured, rect, strip));
        }
    }
}
