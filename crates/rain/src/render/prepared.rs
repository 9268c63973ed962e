//! One frame of rain, ready to draw in strips.

use bansho_base::{
    image::{Figure, Rect},
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Strip, View},
        surroundings::Surroundings,
    },
};

use super::aovs::measure;
use crate::{
    Rain,
    billboards::Billboards,
    drops::{exposure::Moment, size_distribution::DropSizes},
    lighting::{
        drop_lighting::{Beam, Lighting},
        extinction::{Losses, extinction, visibility},
        single_scattering::Veil,
        tiles::Tiles,
    },
    parameters::Method,
    streaks::{
        bin::BAND,
        near_region::Singles,
        project::{Share, Shower},
        rasterize::{
            Record,
            tile::{Patch, STRETCH},
        },
        splashes::Splashes,
        time_steps::Part,
    },
};
use fearless_simd::{Level, Simd, dispatch};

/// Light below this share of display white is left out: with a hundred streaks over each other it still is below a 255th.
const LEAST_SHARE: f64 = 1.0 / (255.0 * 128.0);

/// A frame, ready to draw.
pub(crate) struct PreparedRain<'a> {
    view: &'a View,
    level: Level,
    /// Nearest first.
    parts: Vec<Part>,
    /// No streak is further away, m.
    streaks_end: f64,
    veil: Option<Veil<'a>>,
    figures: Vec<Figure>,
}

impl<'a> PreparedRain<'a> {
    pub(crate) fn new(rain: &'a Rain, view: &'a View, surroundings: &'a Surroundings) -> Self {
        let moment = Moment::new(rain, view, surroundings);
        let extinctions = rain.extinctions(view.shutter.middle());
        let lights = &surroundings.others.lights;
        let lighting = Lighting { scattering: &rain.optics.scattering, lights, extinction: extinctions[0] };
        let seen = rain.skies.of(&rain.optics.lens, view, surroundings.sky);
        let (tiles, sky) = &seen.coarse;
        let beams = lighting.beams(moment.sight.middle().position);
        let frame = Frame { rain, moment: &moment, lighting: &lighting, beams: &beams, tiles, sky, view };
        let region = moment.around_camera(1.1 * moment.distance);
        let mut billboards = 0;
        let mut parts = match rain.parameters.method {
            Method::Drops => frame.shower(Share::Whole).drops(&[region]),
            Method::Billboards => {
                let singles = Singles::new(&moment, lights);
                let mut parts = frame.shower(Share::Single(&singles)).drops(singles.balls());
                let shower = frame.shower(Share::OnBillboard(&singles));
                let cards = Billboards::new(shower, frame.least_light()).parts(region);
                billboards = cards.iter().map(|part| part.cells).sum();
                parts.extend(cards);
                parts
            }
        };
        parts.extend(frame.splashes());
        let ends =
            [if rain.parameters.veil_distance > 0.0 { rain.near_reach() } else { 0.0 }, rain.reach(surroundings)];
        let veil = Veil::new(&moment, &lighting, seen.clone(), view, extinctions, ends);
        let figures = frame.figures(parts.iter().map(Part::count).sum(), billboards);
        Self { view, level: Level::new(), parts, streaks_end: rain.streaks_end(), veil, figures }
    }
}

/// What a frame's parts are made from.
struct Frame<'a> {
    rain: &'a Rain,
    moment: &'a Moment,
    lighting: &'a Lighting<'a>,
    beams: &'a [Beam],
    tiles: &'a Tiles,
    sky: &'a [[f32; 3]],
    view: &'a View,
}

impl<'a> Frame<'a> {
    /// What turns drops into streaks.
    fn shower(&self, share: Share<'a>) -> Shower<'a> {
        Shower {
            level: Level::new(),
            moment: self.moment,
            lighting: self.lighting,
            beams: self.beams,
            sky: self.shining_sky(),
            share,
        }
    }

    /// The sky through drops, if it shines.
    fn shining_sky(&self) -> Option<(&'a Tiles, &'a [[f32; 3]])> {
        self.sky.iter().flatten().any(|value| *value > 0.0).then_some((self.tiles, self.sky))
    }

    fn splashes(&self) -> Vec<Part> {
        let splashes = Splashes {
            shower: self.shower(Share::Whole),
            parameters: &self.rain.parameters.splashes,
            time: self.view.shutter.middle(),
            loop_s: self.rain.loop_s,
        };
        splashes.parts()
    }

    /// Light that no display would show, cd/m^2.
    fn least_light(&self) -> f32 {
        let white = self.view.white_luminance.filter(|_| self.rain.parameters.culling);
        white.map_or(0.0, |white| (white * LEAST_SHARE) as f32)
    }

    /// What the frame is known by.
    fn figures(&self, streaks: usize, billboards: usize) -> Vec<Figure> {
        let t = self.view.shutter.middle();
        let sizes = DropSizes::marshall_palmer(self.rain.rate(t));
        let figure = |name, unit, value| Figure { name, unit, value };
        vec![
            figure("rain_rate", "mm/h", self.rain.rate(t)),
            figure("drops_in_view", "", streaks as f64),
            figure("billboards_in_view", "", billboards as f64),
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
            if slice.near < self.streaks_end {
                dispatch!(self.level, simd => self.draw_streaks(simd, band, slice, rows, strip));
            }
            if let Some(veil) = &self.veil {
                veil.draw(slice, band, rows, strip);
            }
        }
    }
}

impl PreparedRain<'_> {
    #[inline(always)]
    fn draw_streaks<S: Simd>(&self, simd: S, band: usize, slice: &DepthInterval, rows: Rect, strip: &mut Strip) {
        let rect = strip.rect;
        let mut aovs = std::mem::take(&mut strip.aovs);
        // Rain alone draws into its strip, and takes all colours alike.
        if let Some(mut planes) = strip.gray_planes_mut() {
            let (mut patch, mut streaks) = (Patch::default(), Vec::new());
            for stretch in rows.x / STRETCH..rows.right().div_ceil(STRETCH) {
                let origin = [stretch * STRETCH, band * BAND];
                let shown = rows.intersection(&Rect { x: origin[0], width: STRETCH, ..rows });
                streaks.clear();
                for part in &self.parts {
                    part.collect(band, stretch, &mut streaks);
                }
                if streaks.is_empty() {
                    continue;
                }
                patch.load(simd, origin, shown, rect, &planes);
                let strokes = streaks.iter().map(Record::stroke);
                for stroke in strokes.filter(|stroke| slice.contains(f64::from(stroke.layer.depth))) {
                    if aovs.is_empty() {
                        stroke.draw(&mut patch, &mut |_, _| {});
                        continue;
                    }
                    stroke.draw(&mut patch, &mut |[column, row], opacity| {
                        let [x, y] = [origin[0] + column, origin[1] + row];
                        if (shown.x..shown.right()).contains(&x) && (shown.y..shown.bottom()).contains(&y) {
                            let index = (y - rect.y) * rect.width + x - rect.x;
                            measure(&mut aovs, index, opacity, stroke.layer.depth, stroke.diameter_mm);
                        }
                    });
                }
                patch.store(simd, shown, rect, &mut planes);
            }
        }
        strip.aovs = aovs;
    }
}
