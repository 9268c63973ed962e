//! One frame of rain, ready to draw in strips.

use bansho_base::{
    canvas::{DepthInterval, Strip, View},
    image::{Figure, Rect},
    math::DVec3,
    phenomenon::Prepared,
    surroundings::Surroundings,
};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::{
    Rain,
    aovs::measure,
    bands::{BAND, Bands, Extent},
    billboards::{Billboards, Brush, paint},
    distribution::DropSizes,
    drops::{self, Near},
    extinction::{Losses, extinction, visibility},
    light::Lighting,
    moment::{Ball, Moment},
    parameters::Method,
    singles::{NEAREST, NEAREST_TO_LAMP, Singles},
    source::{SourceField, sky_through_drops},
    splashes::Splashes,
    stroke::Stroke,
    tiles::{COARSE, FINE, Tiles},
    veil::Veil,
};

/// Light below this share of display white is left out: with a hundred streaks over each other it still is below a 255th.
const LEAST_SHARE: f64 = 1.0 / (255.0 * 128.0);

/// Columns that streaks are drawn in at a time: the planes of so many fit into a core's first cache.
const STRETCH: usize = 128;

/// Streaks of single drops, sorted into bands.
struct Strokes {
    strokes: Vec<Stroke>,
    bands: Bands,
}

impl Strokes {
    fn new(strokes: Vec<Stroke>, size: [usize; 2]) -> Self {
        let extents: Vec<Extent> = strokes.par_iter().with_min_len(4096).map(Stroke::extent).collect();
        Self { bands: Bands::new(size, STRETCH, extents.iter().copied()), strokes }
    }
}

/// A frame, ready to draw.
pub(super) struct PreparedRain<'a> {
    view: &'a View,
    level: Level,
    strokes: Strokes,
    billboards: Option<(Billboards, SourceField)>,
    veil: Option<Veil<'a>>,
    least_light: f32,
    figures: Vec<Figure>,
}

impl<'a> PreparedRain<'a> {
    pub(super) fn new(rain: &'a Rain, view: &'a View, surroundings: &'a Surroundings) -> Self {
        let moment = Moment::new(rain, view, surroundings);
        let extinctions = rain.extinctions(view.shutter.middle());
        let lights = &surroundings.others.lights;
        let lighting = Lighting { scattering: &rain.scattering, lights, extinction: extinctions[0], nearest: 0.0 };
        let tiles = Tiles::new(view, COARSE);
        let sky = sky_through_drops(&rain.lens, &tiles, &surroundings.sky);
        let frame = Frame { rain, moment: &moment, lighting: &lighting, tiles: &tiles, sky: &sky, view };
        let eye = moment.sight.middle().position;
        let nearness = |point: DVec3| moment.nearness((point - eye).length());
        let (strokes, billboards) = match rain.parameters.method {
            Method::Drops => (frame.strokes(&[moment.around_camera(1.1 * moment.distance)], &nearness), None),
            Method::Billboards => {
                let singles = Singles::new(&moment, lights);
                let strokes = frame.strokes(singles.balls(), &|point| nearness(point) * singles.share(point));
                (strokes, Some(frame.billboards(&|point| nearness(point) * (1.0 - singles.share(point)))))
            }
        };
        let mut strokes = strokes;
        strokes.extend(frame.splashes());
        let end = if rain.parameters.veil_distance > 0.0 { rain.reach() } else { 0.0 };
        let fine = Tiles::new(view, FINE);
        let fine_sky = sky_through_drops(&rain.lens, &fine, &surroundings.sky);
        let veil = Veil::new(&moment, &lighting, &fine, fine_sky, view, extinctions, end);
        let white = view.white_luminance.filter(|_| rain.parameters.culling);
        let least_light = white.map_or(0.0, |white| (white * LEAST_SHARE) as f32);
        let figures = frame.figures(strokes.len(), billboards.as_ref().map(|(billboards, _)| billboards));
        let strokes = Strokes::new(strokes, view.size);
        Self { view, level: Level::new(), strokes, billboards, veil, least_light, figures }
    }
}

/// What a frame's parts are made from.
struct Frame<'a> {
    rain: &'a Rain,
    moment: &'a Moment,
    lighting: &'a Lighting<'a>,
    tiles: &'a Tiles,
    sky: &'a [[f32; 3]],
    view: &'a View,
}

impl<'a> Frame<'a> {
    /// The sky through drops, if it shines.
    fn shining_sky(&self) -> Option<(&'a Tiles, &'a [[f32; 3]])> {
        self.sky.iter().flatten().any(|value| *value > 0.0).then_some((self.tiles, self.sky))
    }

    fn strokes(&self, within: &[Ball], weight: &(dyn Fn(DVec3) -> f64 + Sync)) -> Vec<Stroke> {
        drops::strokes(&Near { moment: self.moment, lighting: self.lighting, sky: self.shining_sky(), within, weight })
    }

    fn splashes(&self) -> Vec<Stroke> {
        let splashes = Splashes {
            moment: self.moment,
            lighting: self.lighting,
            sky: self.shining_sky(),
            parameters: &self.rain.parameters.splashes,
            time: self.view.shutter.middle(),
            loop_s: self.rain.loop_s,
        };
        splashes.strokes()
    }

    fn billboards(&self, weight: &(dyn Fn(DVec3) -> f64 + Sync)) -> (Billboards, SourceField) {
        let within = self.moment.around_camera(1.1 * self.moment.distance);
        let picture = Rect::of_size(self.view.size[0], self.view.size[1]);
        let sheets = self.rain.sheets.sheets(self.moment);
        let billboards = Billboards::new(self.moment, sheets, picture, within, weight);
        // What is nearer to a lamp is not on billboards; a light that grows on would be seen between the corners of tiles.
        let lighting = Lighting { nearest: NEAREST_TO_LAMP, ..*self.lighting };
        let source = SourceField::new(&lighting, self.tiles, self.sky, within.centre, [NEAREST, within.radius]);
        (billboards, source)
    }
}

impl Frame<'_> {
    /// What the frame is known by; drops on a billboard count by what of it is in the picture.
    fn figures(&self, strokes: usize, billboards: Option<&Billboards>) -> Vec<Figure> {
        let t = self.view.shutter.middle();
        let sizes = DropSizes::marshall_palmer(self.rain.rate(t));
        let on_billboards = billboards.map_or(0.0, |billboards| billboards.drops_in_view());
        let figure = |name, unit, value| Figure { name, unit, value };
        vec![
            figure("rain_rate", "mm/h", self.rain.rate(t)),
            figure("drops_in_view", "", strokes as f64 + on_billboards),
            figure("billboards_in_view", "", billboards.map_or(0.0, |billboards| billboards.cards.len() as f64)),
            figure("extinction", "1/m", extinction(&sizes, Losses::Geometric, DropSizes::ALL)),
            figure("visibility", "m", visibility(&sizes)),
        ]
    }
}

impl Prepared for PreparedRain<'_> {
    fn figures(&self) -> Vec<Figure> {
        self.figures.clone()
    }

    fn bounds(&self, _slice: &DepthInterval) -> Rect {
        Rect::of_size(self.view.size[0], self.view.size[1])
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let rect = strip.rect;
        for band in rect.y / BAND..rect.bottom().div_ceil(BAND) {
            let rows = Rect { x: rect.x, y: band * BAND, width: rect.width, height: BAND }.intersection(&rect);
            dispatch!(self.level, _simd => self.draw_streaks(band, slice, rows, strip));
            if let Some(veil) = &self.veil {
                veil.draw(slice, band, rows, strip);
            }
        }
    }
}

impl PreparedRain<'_> {
    #[inline(always)]
    fn draw_streaks(&self, band: usize, slice: &DepthInterval, rows: Rect, strip: &mut Strip) {
        let rect = strip.rect;
        let mut aovs = std::mem::take(&mut strip.aovs);
        // Rain alone draws into its strip, and takes all colours alike.
        if let Some(mut planes) = strip.gray_planes_mut() {
            for ([from, to], members) in self.strokes.bands.stretches(band, rows.x, rows.right()) {
                let rows = rows.intersection(&Rect { x: from, width: to - from, ..rows });
                for &index in members {
                    let stroke = &self.strokes.strokes[index as usize];
                    if !slice.contains(f64::from(stroke.depth)) {
                        continue;
                    }
                    if aovs.is_empty() {
                        stroke.draw(rows, rect, &mut planes, &mut |_, _| {});
                    } else {
                        stroke.draw(rows, rect, &mut planes, &mut |index, opacity| {
                            measure(&mut aovs, index, opacity, stroke.depth, stroke.diameter_mm);
                        });
                    }
                }
            }
            if let Some((billboards, source)) = &self.billboards {
                paint(
                    &Brush { billboards, source, slice, least_light: self.least_light },
                    band,
                    rows,
                    rect,
                    &mut planes,
                    &mut aovs,
                );
            }
        }
        strip.aovs = aovs;
    }
}
