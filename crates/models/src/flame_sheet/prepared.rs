//! One frame of a sheet: its flames in order of depth, nearest first.

use bansho_base::{
    canvas::{DepthInterval, Strip, View},
    image::Rect,
    observer::{Cancelled, Observer, check},
    phenomenon::Prepared,
    surroundings::Surroundings,
};
use fearless_simd::Level;

use super::{
    FlameSheet,
    draw::{Sample, draw_rows},
    flame::{Flame, pixels_per_metre},
    placement::Stand,
};

/// A frame, ready to draw in strips.
pub(crate) struct PreparedSheet<'a> {
    sheet: &'a FlameSheet,
    level: Level,
    parts: Vec<Part>,
}

/// One thing that is drawn, at one depth.
struct Part {
    depth: f64,
    rect: Rect,
    samples: Vec<Sample>,
}

impl<'a> PreparedSheet<'a> {
    pub(crate) fn new(
        sheet: &'a FlameSheet,
        view: &View,
        surroundings: &Surroundings,
        observer: &dyn Observer,
    ) -> Result<Self, Cancelled> {
        let mut parts = Vec::new();
        for flame in &sheet.flames {
            check(observer)?;
            parts.push(flame_part(sheet, flame, view, surroundings));
        }
        parts.sort_by(|a: &Part, b: &Part| a.depth.total_cmp(&b.depth));
        Ok(Self { sheet, level: Level::new(), parts })
    }
}

fn flame_part(sheet: &FlameSheet, flame: &Flame, view: &View, surroundings: &Surroundings) -> Part {
    let base = sheet.base(flame, view.shutter.middle());
    let right = sheet.right(flame, &view.camera, base);
    let stand = Stand::new(base, right, sheet.sheet_size(flame), 0.0);
    let scale = pixels_per_metre(&view.camera, &stand);
    let source = flame.source.filtered(scale * stand.size.y);
    let count = sheet.time_samples(flame, view.shutter, scale);
    let (samples, rect) = sheet.samples(flame, &source, view, surroundings.wind, count);
    Part { depth: view.camera.depth(stand.point(0.5, 0.5)), rect, samples }
}

impl Prepared for PreparedSheet<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let shown = self.parts.iter().filter(|part| slice.contains(part.depth));
        shown.fold(Rect::default(), |all, part| all.union(&part.rect))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let (shape, ramp, drawn) = (&self.sheet.shape, &self.sheet.ramp, self.sheet.drawn());
        for part in self.parts.iter().filter(|part| slice.contains(part.depth)) {
            let rect = part.rect.intersection(&strip.rect);
            if !rect.is_empty() {
                fearless_simd::dispatch!(self.level, simd => draw_rows(simd, shape, ramp, &part.samples, drawn, rect, strip));
            }
        }
    }
}
