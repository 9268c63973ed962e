//! Drops and the streaks that they leave.

use bansho_base::math::{
    DVec3,
    random::{self, Purpose},
    simd::LANES,
};

use super::{
    near_region::Singles,
    project_lanes::{Flights, NOTHING, Row, Streaks, Vectors},
    rasterize::{at_least, at_most},
    time_steps::{Gathering, Part},
};
use crate::{
    drops::{
        exposure::{Ball, ClassNow, Moment},
        lattice::{CELL, Cell},
    },
    lighting::{
        drop_lighting::{Beam, Lighting},
        tiles::Tiles,
    },
};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

const COUNT: Purpose = Purpose::named("rain drops of a cell");
const DROP: Purpose = Purpose::named("rain drop");
/// Parts that all cells make, and fewest and most cells of each.
const PARTS: usize = 64;
const CELLS_OF_PART: [usize; 2] = [8, 256];
/// Over which part of the number of drops a drop fades in, so that a rising rate shows no drop at once.
pub(crate) const FADE: f64 = 0.02;

/// What turns drops into streaks.
#[derive(Clone, Copy)]
pub(crate) struct Shower<'a> {
    pub(crate) level: Level,
    pub(crate) moment: &'a Moment,
    pub(crate) lighting: &'a Lighting<'a>,
    /// Its lights.
    pub(crate) beams: &'a [Beam],
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
    /// For drops at places from the camera.
    #[inline(always)]
    fn of(&self, places: &Vectors) -> Row {
        let mut shares = [1.0; LANES];
        match self {
            Self::Whole => {}
            Self::Single(singles) => shares = singles.shares(places),
            Self::OnBillboard(singles) => {
                let single = singles.shares(places);
                for i in 0..LANES {
                    shares[i] -= single[i];
                }
            }
        }
        shares
    }
}

/// Sixteen drops of one diameter half way through the exposure.
pub(crate) struct Drops {
    /// Places from the camera, m.
    pub(crate) places: Vectors,
    /// m/s.
    pub(crate) velocities: Vectors,
    /// mm.
    pub(crate) diameter_mm: f32,
    /// How much of each is there, 0 to 1.
    pub(crate) there: Row,
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
        let key = self.moment.key;
        let contents = class.lattice.contents(cell);
        let words = key.words(contents, 0, class.purpose(COUNT));
        let count = random::poisson(class.most * class.lattice.volume(), [words[0], words[1]]) as usize;
        let now = self.moment.cell(class, cell);
        let rising = ((1.0 + FADE) * class.share) as f32;
        for first in (0..count).step_by(LANES) {
            let [x, y, z, turn] = key.uniforms_of_steps(contents, first as u32, class.purpose(DROP));
            let mut there = NOTHING;
            for i in 0..LANES {
                let risen = at_most(1.0, at_least(0.0, (rising - turn[i]) * (1.0 / FADE) as f32));
                there[i] = if first + i < count { risen } else { 0.0 };
            }
            let (places, velocities) = now.drops(&[x, y, z]);
            let diameter_mm = class.diameter_mm as f32;
            self.add_drops(&Drops { places, velocities, diameter_mm, there }, 0.0, gathering);
        }
    }

    /// Adds the streaks of drops as far as they show. Those that are nowhere more opaque than `least_peak` are not lit by lamps and fires.
    #[inline(always)]
    pub(crate) fn add_drops(&self, drops: &Drops, least_peak: f32, gathering: &mut Gathering) {
        let moment = self.moment;
        let [xs, ys, zs] = &drops.places;
        let shares = self.share.of(&drops.places);
        let half = 0.5 * moment.sight.exposure as f32;
        let mut flights =
            Flights { from: drops.places, to: drops.places, diameter_mm: [drops.diameter_mm; LANES], gain: NOTHING };
        for i in 0..LANES {
            let away = (xs[i] * xs[i] + ys[i] * ys[i] + zs[i] * zs[i]).sqrt();
            flights.gain[i] = drops.there[i] * moment.nearness(away) * shares[i] * moment.gain as f32;
        }
        for axis in 0..3 {
            for i in 0..LANES {
                let way = half * drops.velocities[axis][i];
                flights.from[axis][i] -= way;
                flights.to[axis][i] += way;
            }
        }
        let eye = moment.sight.middle().position;
        flights.cut((moment.ground - eye.y) as f32);
        let mut streaks = flights.streaks(&moment.sight);
        if moment.has_roofs() {
            for i in 0..LANES {
                let [place, velocity] = [&drops.places, &drops.velocities].map(|vectors| vector(vectors, i));
                if streaks.seen[i] != 0 && moment.sheltered(eye + place, velocity) {
                    streaks.seen[i] = 0;
                }
            }
        }
        self.add(&streaks, &drops.places, &flights.diameter_mm, least_peak, gathering);
    }

    /// Adds the streaks that are seen of drops at some places, lit.
    #[inline(always)]
    pub(crate) fn add(
        &self,
        streaks: &Streaks,
        places: &Vectors,
        diameters_mm: &Row,
        least_peak: f32,
        gathering: &mut Gathering,
    ) {
        if !streaks.any() {
            return;
        }
        let mut lit = NOTHING;
        for i in 0..LANES {
            lit[i] = if streaks.peak[i] >= least_peak { 1.0 } else { 0.0 };
        }
        let mut light = [[0.0; 3]; LANES];
        for beam in self.beams {
            self.lighting.add(beam, places, &lit, &mut light);
        }
        for i in 0..LANES {
            if streaks.seen[i] == 0 {
                continue;
            }
            let mut stroke = streaks.stroke(i, diameters_mm[i], light[i]);
            if let Some((tiles, sky)) = self.sky {
                stroke.layer.add_light(tiles.at(sky, stroke.middle));
            }
            gathering.add(&stroke, streaks.extent(i));
        }
    }
}

/// One of sixteen vectors.
fn vector(vectors: &Vectors, i: usize) -> DVec3 {
    DVec3::new(vectors[0][i].into(), vectors[1][i].into(), vectors[2][i].into())
}
