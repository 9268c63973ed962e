//! Every drop by itself.

use bansho_base::{
    camera::{Camera, Lens},
    math::DVec3,
    random::{self, Purpose},
};
use rayon::prelude::*;

use super::{
    lattice::Cell,
    light::Lighting,
    moment::{Ball, ClassNow, Moment},
    stroke::Stroke,
    tiles::Tiles,
};

const COUNT: Purpose = Purpose::named("rain drops of a cell");
const DROP: Purpose = Purpose::named("rain drop");
/// Cells that one task fills.
const CELLS_AT_ONCE: usize = 16;
/// Over which part of the number of drops a drop fades in, so that a rising rate shows no drop at once.
const FADE: f64 = 0.02;

/// Which drops are drawn one by one.
#[derive(Clone, Copy)]
pub(crate) struct Near<'a> {
    pub(crate) moment: &'a Moment,
    pub(crate) lighting: &'a Lighting<'a>,
    /// What the sky shines through drops at the corners of tiles; `None` from a dark one.
    pub(crate) sky: Option<(&'a Tiles, &'a [[f32; 3]])>,
    /// Where they are.
    pub(crate) within: &'a [Ball],
    /// How much of a drop at a point is drawn.
    pub(crate) weight: &'a (dyn Fn(DVec3) -> f64 + Sync),
}

/// Strokes of all drops that may show, those of the nearest cells first.
pub(crate) fn strokes(near: &Near) -> Vec<Stroke> {
    let moment = near.moment;
    let mut cells: Vec<(f64, Cell, &ClassNow)> = moment
        .classes
        .iter()
        .filter(|class| class.share > 0.0)
        .flat_map(|class| near.cells(class).into_iter().map(move |(away, cell)| (away, cell, class)))
        .collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0));
    let fill = |cells: &[(f64, Cell, &ClassNow)]| {
        let mut strokes = Vec::new();
        cells.iter().for_each(|(_, cell, class)| near.add_cell(class, *cell, &mut strokes));
        strokes
    };
    let parts: Vec<Vec<Stroke>> = cells.par_chunks(CELLS_AT_ONCE).map(fill).collect();
    parts.concat()
}

impl Near<'_> {
    /// The cells of a class, each once.
    fn cells(&self, class: &ClassNow) -> Vec<(f64, Cell)> {
        let mut cells: Vec<_> = self.within.iter().flat_map(|ball| self.moment.cells(class, *ball)).collect();
        cells.sort_by_key(|(_, cell)| *cell);
        cells.dedup_by_key(|(_, cell)| *cell);
        cells
    }

    fn add_cell(&self, class: &ClassNow, cell: Cell, strokes: &mut Vec<Stroke>) {
        let key = self.moment.key;
        let contents = class.lattice.contents(cell);
        let words = key.words(contents, 0, class.purpose(COUNT));
        let count = random::poisson(class.most * class.lattice.volume(), [words[0], words[1]]);
        let corner = DVec3::from(cell.0.map(|count| count as f64));
        for index in 0..count {
            let uniforms = key.uniforms(contents, index as u32, class.purpose(DROP)).map(f64::from);
            let there = ((class.share * (1.0 + FADE) - uniforms[3]) / FADE).min(1.0);
            if there <= 0.0 {
                continue;
            }
            let place = corner + DVec3::new(uniforms[0], uniforms[1], uniforms[2]);
            strokes.extend(self.stroke(class, place, there));
        }
    }

    /// The stroke of the drop at a place of its lattice, of which so much is there.
    fn stroke(&self, class: &ClassNow, place: DVec3, there: f64) -> Option<Stroke> {
        let moment = self.moment;
        let (point, velocity) = moment.drop(class, place);
        let toward = point - moment.sight.middle().position;
        let away = toward.length();
        let weight = there * (self.weight)(point);
        if weight <= 0.0 || away == 0.0 || moment.sheltered(point, velocity) {
            return None;
        }
        let way = velocity * moment.sight.exposure;
        let flight = Flight { from: point - 0.5 * way, to: point + 0.5 * way, diameter_mm: class.diameter_mm };
        let mut stroke = flight.above(moment.ground)?.stroke(moment, weight * moment.gain, [0.0; 3])?;
        if !stroke.meets(moment.sight.middle().size) {
            return None;
        }
        stroke.light = self.lighting.radiance(point, toward / away);
        if let Some((tiles, sky)) = self.sky {
            let sky = tiles.at(sky, stroke.middle());
            (0..3).for_each(|c| stroke.light[c] += sky[c]);
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
    /// What the picture shows of it with an opacity `gain`; `None` where the lens does not see all of it.
    pub(crate) fn stroke(&self, moment: &Moment, gain: f64, light: [f32; 3]) -> Option<Stroke> {
        let [open, _, close] = &moment.sight.cameras;
        let Flight { from, to, diameter_mm } = self.flight;
        // The shutter's end comes early for a drop that ends on the way; cameras hardly move in between.
        let (from, to) = (open.project(from)?, close.project(to)?);
        let depth = 0.5 * (from.depth + to.depth);
        let radius = 0.25e-3 * diameter_mm * (from.pixels_per_metre + to.pixels_per_metre);
        let area = std::f64::consts::PI * radius * radius * stretch(moment.sight.middle(), &self.flight, depth);
        Some(Stroke {
            ends: [from.pixel, to.pixel].map(|pixel| pixel.as_vec2().to_array()),
            radius: radius as f32,
            hidden: (area * self.share * gain) as f32,
            depth: depth as f32,
            diameter_mm: diameter_mm as f32,
            light,
        })
    }
}

/// How many times more of the picture a ball covers because a flat picture stretches toward its corners.
fn stretch(camera: &Camera, flight: &Flight, depth: f64) -> f64 {
    match camera.lens {
        Lens::Perspective => ((0.5 * (flight.from + flight.to) - camera.position).length() / depth).clamp(1.0, 10.0),
        Lens::Fisheye | Lens::Panorama => 1.0,
    }
}
