//! Drops and the streaks that they leave.

use bansho_base::{
    camera::{Camera, Lens},
    math::DVec3,
    random::{self, Purpose},
};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::{
    lattice::{CELL, Cell},
    light::Lighting,
    moment::{Ball, ClassNow, Moment},
    part::{Gathering, Part},
    singles::Singles,
    stroke::{Stroke, Way},
    tiles::Tiles,
};

const COUNT: Purpose = Purpose::named("rain drops of a cell");
const DROP: Purpose = Purpose::named("rain drop");
/// Parts that all cells make, and fewest and most cells of each.
const PARTS: usize = 64;
const CELLS_OF_PART: [usize; 2] = [8, 256];
/// Radius of the pupil, m: that of a 24 mm lens at f/3.
const PUPIL: f64 = 4e-3;
/// Furthest that a drop is seen from its middle, m: the radius of the largest, and what the lens spreads.
pub(crate) const LARGEST: f64 = 4e-3 + PUPIL;
/// Over which part of the number of drops a drop fades in, so that a rising rate shows no drop at once.
pub(crate) const FADE: f64 = 0.02;

/// What turns drops into streaks.
#[derive(Clone, Copy)]
pub(crate) struct Shower<'a> {
    pub(crate) level: Level,
    pub(crate) moment: &'a Moment,
    pub(crate) lighting: &'a Lighting<'a>,
    /// What the sky shines through drops at the corners of tiles; `None` from a dark one.
    pub(crate) sky: Option<(&'a Tiles, &'a [[f32; 3]])>,
    /// Which share of a drop is drawn.
    pub(crate) share: Share<'a>,
}

/// Which share of a drop is drawn, where some are drawn by themselves and others on billboards.
#[derive(Clone, Copy)]
pub(crate) enum Share<'a> {
    /// All of it.
    Whole,
    /// That which is drawn by itself.
    Single(&'a Singles),
    /// That which is on billboards.
    OnBillboard(&'a Singles),
}

impl Share<'_> {
    #[inline(always)]
    fn of(&self, point: DVec3) -> f64 {
        match self {
            Self::Whole => 1.0,
            Self::Single(singles) => singles.share(point),
            Self::OnBillboard(singles) => 1.0 - singles.share(point),
        }
    }
}

/// A drop half way through the exposure.
#[derive(Clone, Copy)]
pub(crate) struct Drop {
    pub(crate) point: DVec3,
    /// m/s.
    pub(crate) velocity: DVec3,
    pub(crate) diameter_mm: f64,
    /// How much of it is there, 0 to 1.
    pub(crate) there: f64,
}

impl Shower<'_> {
    /// The streaks of all cells that may show within some balls, drop by drop.
    pub(crate) fn drops(&self, within: &[Ball]) -> Vec<Part> {
        self.parts(
            within,
            0.5 * CELL,
            |class, cell, gathering| dispatch!(self.level, _simd => self.add_cell(class, cell, gathering)),
        )
    }

    /// The streaks of all cells that may show within some balls, those of the nearest cells first; `add` adds those of a cell, up to
    /// `aside` (m) level from its middle.
    pub(crate) fn parts(
        &self,
        within: &[Ball],
        aside: f64,
        add: impl Fn(&ClassNow, Cell, &mut Gathering) + Sync,
    ) -> Vec<Part> {
        let classes = self.moment.classes.par_iter().filter(|class| class.share > 0.0);
        let lists: Vec<Vec<_>> = classes
            .map(|class| self.cells(class, within, aside).into_iter().map(|(away, cell)| (away, cell, class)).collect())
            .collect();
        let mut cells = lists.concat();
        cells.sort_by(|a, b| a.0.total_cmp(&b.0));
        let size = self.moment.sight.size();
        let fill = |cells: &[(f64, Cell, &ClassNow)]| {
            let mut gathering = Gathering::new(size);
            for (_, cell, class) in cells {
                gathering.add_cell(|gathering| add(class, *cell, gathering));
            }
            gathering.part()
        };
        let [fewest, most] = CELLS_OF_PART;
        cells.par_chunks((cells.len() / PARTS).clamp(fewest, most)).map(fill).collect()
    }

    /// The cells of a class, each once.
    fn cells(&self, class: &ClassNow, within: &[Ball], aside: f64) -> Vec<(f64, Cell)> {
        let mut cells: Vec<_> = within.iter().flat_map(|ball| self.moment.cells(class, *ball, aside)).collect();
        cells.sort_by_key(|(_, cell)| *cell);
        cells.dedup_by_key(|(_, cell)| *cell);
        cells
    }

    /// Adds the streaks of a cell, drop by drop.
    #[inline(always)]
    fn add_cell(&self, class: &ClassNow, cell: Cell, gathering: &mut Gathering) {
        /// Drops whose numbers are drawn together.
        const BATCH: usize = 16;
        let key = self.moment.key;
        let contents = class.lattice.contents(cell);
        let words = key.words(contents, 0, class.purpose(COUNT));
        let count = random::poisson(class.most * class.lattice.volume(), [words[0], words[1]]) as usize;
        let corner = DVec3::from(cell.0.map(|count| count as f64));
        for first in (0..count).step_by(BATCH) {
            let uniforms: [[f32; BATCH]; 4] = key.uniforms_of_steps(contents, first as u32, class.purpose(DROP));
            for index in 0..BATCH.min(count - first) {
                let there = ((class.share * (1.0 + FADE) - f64::from(uniforms[3][index])) / FADE).min(1.0);
                if there <= 0.0 {
                    continue;
                }
                let [x, y, z] = [uniforms[0][index], uniforms[1][index], uniforms[2][index]];
                let place = corner + DVec3::new(x.into(), y.into(), z.into());
                let (point, velocity) = self.moment.drop(class, place);
                let drop = Drop { point, velocity, diameter_mm: class.diameter_mm, there };
                gathering.add(self.stroke(&drop, |_| true));
            }
        }
    }

    /// The streak of a drop, if it shows; `lit` says whether the light of lamps and fires on it may be seen.
    #[inline(always)]
    pub(crate) fn stroke(&self, drop: &Drop, lit: impl FnOnce(&Stroke) -> bool) -> Option<Stroke> {
        let (moment, point) = (self.moment, drop.point);
        let way = drop.velocity * moment.sight.exposure;
        if !moment.sight.may_see(point, DVec3::ZERO, 0.5 * way.length() + LARGEST) {
            return None;
        }
        let toward = point - moment.sight.middle().position;
        let away = toward.length();
        let weight = drop.there * moment.nearness(away) * self.share.of(point);
        if weight <= 0.0 || away == 0.0 || moment.sheltered(point, drop.velocity) {
            return None;
        }
        let flight = Flight { from: point - 0.5 * way, to: point + 0.5 * way, diameter_mm: drop.diameter_mm };
        let mut stroke = flight.above(moment.ground)?.stroke(moment, weight * moment.gain)?;
        if !stroke.meets(moment.sight.middle().size) {
            return None;
        }
        if lit(&stroke) {
            stroke.layer.add_light(self.lighting.radiance(point, toward / away));
        }
        if let Some((tiles, sky)) = self.sky {
            stroke.layer.add_light(tiles.at(sky, stroke.middle()));
        }
        Some(stroke)
    }
}

/// A drop's way through the world while the shutter is open.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flight {
    pub(crate) from: DVec3,
    pub(crate) to: DVec3,
    pub(crate) diameter_mm: f64,
}

impl Flight {
    /// The part of a falling drop's way above the ground; what is cut off is not hidden, see [`Cut`].
    #[inline(always)]
    fn above(self, ground: f64) -> Option<Cut> {
        let fall = self.from.y - self.to.y;
        let share = if fall > 0.0 { ((self.from.y - ground) / fall).min(1.0) } else { 1.0 };
        (share > 0.0).then(|| Cut { flight: Self { to: self.from + (self.to - self.from) * share, ..self }, share })
    }

    /// The whole way.
    pub(crate) fn whole(self) -> Cut {
        Cut { flight: self, share: 1.0 }
    }
}

/// A part of a way: the drop is on it for a share of the exposure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    flight: Flight,
    share: f64,
}

impl Cut {
    /// What the picture shows of it with an opacity `gain`, still without light; `None` where the lens does not see all of it.
    #[inline(always)]
    pub(crate) fn stroke(&self, moment: &Moment, gain: f64) -> Option<Stroke> {
        let [open, _, close] = &moment.sight.cameras;
        let Flight { from, to, diameter_mm } = self.flight;
        // The shutter's end comes early for a drop that ends on the way; cameras hardly move in between.
        let (from, to) = (open.project(from)?, close.project(to)?);
        let depth = 0.5 * (from.depth + to.depth);
        let scale = 0.5 * (from.pixels_per_metre + to.pixels_per_metre);
        let radius = 0.5e-3 * diameter_mm * scale;
        let area = std::f64::consts::PI * radius * radius * stretch(moment.sight.middle(), &self.flight, depth);
        let ends = [from.pixel, to.pixel].map(|pixel| pixel.as_vec2().to_array());
        let blurred = radius + blur(depth) * scale;
        let way = Way { ends, radius: blurred as f32, hidden: (area * self.share * gain) as f32 };
        Some(Stroke::new(way, depth as f32, diameter_mm as f32))
    }
}

/// By how much a lens that is focused on a metre or beyond spreads what is nearer, m at its place: the drop hides as much of the picture, but
/// more thinly.
fn blur(depth: f64) -> f64 {
    /// m.
    const FOCUS: f64 = 1.0;
    PUPIL * (1.0 - depth / FOCUS).clamp(0.0, 1.0)
}

/// How many times more of the picture a ball covers because a flat picture stretches toward its corners.
fn stretch(camera: &Camera, flight: &Flight, depth: f64) -> f64 {
    match camera.lens {
        Lens::Perspective => ((0.5 * (flight.from + flight.to) - camera.position).length() / depth).clamp(1.0, 10.0),
        Lens::Fisheye | Lens::Panorama => 1.0,
    }
}
