//! One frame of rain, ready to draw in strips.

use bansho_base::{
    canvas::{DepthInterval, Strip, View},
    image::Rect,
    phenomenon::Prepared,
    surroundings::Surroundings,
};
use fearless_simd::{Level, dispatch};

use super::{
    Rain,
    bands::{BAND, Bands},
    drops::{self, Near},
    light::Lighting,
    moment::Moment,
    stroke::Stroke,
};

/// Streaks of single drops, sorted into bands.
struct Strokes {
    strokes: Vec<Stroke>,
    bands: Bands,
}

impl Strokes {
    fn new(strokes: Vec<Stroke>, height: usize) -> Self {
        let rows: Vec<[f32; 2]> = strokes.iter().map(Stroke::rows).collect();
        Self { bands: Bands::new(height, &rows), strokes }
    }
}

/// A frame, ready to draw.
pub(super) struct PreparedRain<'a> {
    view: &'a View,
    level: Level,
    strokes: Strokes,
}

impl<'a> PreparedRain<'a> {
    pub(super) fn new(rain: &'a Rain, view: &'a View, surroundings: &'a Surroundings) -> Self {
        let moment = Moment::new(rain, view, surroundings);
        let [extinction, _] = rain.extinctions(view.shutter.middle());
        let lighting = Lighting { lens: &rain.lens, lights: &surroundings.others.lights, extinction };
        let distance = 1.1 * moment.distance;
        let weight = |away: f64| moment.nearness(away);
        let near = Near { moment: &moment, lighting: &lighting, distance, weight: &weight };
        let strokes = Strokes::new(drops::strokes(&near), view.size[1]);
        Self { view, level: Level::new(), strokes }
    }
}

impl Prepared for PreparedRain<'_> {
    fn bounds(&self, _slice: &DepthInterval) -> Rect {
        Rect::of_size(self.view.size[0], self.view.size[1])
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let rect = strip.rect;
        for band in rect.y / BAND..rect.bottom().div_ceil(BAND) {
            let rows = Rect { x: rect.x, y: band * BAND, width: rect.width, height: BAND }.intersection(&rect);
            dispatch!(self.level, _simd => draw_strokes(&self.strokes, band, slice, rows, strip));
        }
    }
}

#[inline(always)]
fn draw_strokes(strokes: &Strokes, band: usize, slice: &DepthInterval, rows: Rect, strip: &mut Strip) {
    let rect = strip.rect;
    let mut aovs = std::mem::take(&mut strip.aovs);
    // Rain alone draws into its strip, and takes all colours alike.
    if let Some(mut planes) = strip.gray_planes_mut() {
        for &index in strokes.bands.members(band) {
            let stroke = &strokes.strokes[index as usize];
            if !slice.contains(f64::from(stroke.depth)) {
                continue;
            }
            if aovs.is_empty() {
                stroke.draw(rows, rect, &mut planes, &mut |_, _| {});
            } else {
                stroke.draw(rows, rect, &mut planes, &mut |index, opacity| {
                    let values = [1.0, stroke.depth, stroke.diameter_mm];
                    aovs.iter_mut().zip(values).for_each(|(plane, value)| plane.add(index, value, opacity));
                });
            }
        }
    }
    strip.aovs = aovs;
}
