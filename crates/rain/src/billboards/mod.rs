//! Billboards: upright squares that face the camera, each with the streaks of all drops of one diameter in a cell.
//!
//! The texture T(R, D) that they carry is kept as the places of its drops instead of as pixels: a drop is narrower than a pixel, so that
//! nearly all of a picture of them is empty, and what is drawn from places is as sharp at any size.

pub mod texture;

use bansho_base::{
    camera::upright_quad::{UprightQuad, right_facing},
    math::{
        DVec2, DVec3, MulAdd,
        random::{Key, Purpose},
        simd::LANES,
    },
};

use crate::{
    drops::{
        exposure::{Ball, ClassNow},
        lattice::{CELL, Cell},
    },
    streaks::{
        project::{Drops, FADE, Shower},
        project_lanes::{NOTHING, Row},
        rasterize::{at_least, at_most},
        time_steps::{Gathering, Part},
    },
};

use fearless_simd::dispatch;

const SHEET: Purpose = Purpose::named("rain texture");
const OFFSET: Purpose = Purpose::named("rain billboard offset");
const PLACE: Purpose = Purpose::named("rain billboard place");
/// Furthest that any of a billboard is from its middle, m.
const RADIUS: f64 = 0.75;
/// Textures of each diameter, so that the same streaks are seldom near each other.
const VARIANTS: usize = 2;

/// Where the drops of a texture are, across and up, 0 to 1, sixteen at a time.
type Sheet = Vec<[Row; 2]>;

/// The textures of all diameters at one rate.
struct Sheets(Vec<[Sheet; VARIANTS]>);

impl Sheets {
    /// Drop after drop, so that a texture with more of them has the same and others.
    fn new(key: Key, classes: &[ClassNow]) -> Self {
        let sheet = |class: &ClassNow, variant: usize| -> Sheet {
            let drops = class.count().ceil() as u64;
            let mut sheet = vec![[NOTHING; 2]; (drops as usize).div_ceil(LANES)];
            for index in 0..drops {
                let [x, y, ..] = key.uniforms((variant as u64) << 32 | index, 0, class.purpose(SHEET));
                let (part, i) = (&mut sheet[index as usize / LANES], index as usize % LANES);
                (part[0][i], part[1][i]) = (x, y);
            }
            sheet
        };
        Self(classes.iter().map(|class| std::array::from_fn(|variant| sheet(class, variant))).collect())
    }
}

/// A billboard: where it stands and which part of which texture it shows.
struct Card<'a> {
    stand: UprightQuad,
    /// m/s.
    velocity: DVec3,
    sheet: &'a Sheet,
    /// Where in the texture it begins.
    offset: [f32; 2],
    /// 1, or -1 where it is mirrored.
    side: f32,
    /// Which part of a drop its texture must hold for the card to show that drop.
    chance: f32,
}

impl Card<'_> {
    /// How much it shows of the last drop of a texture, of which this holds a part: that of all billboards together, each all of it or
    /// nothing but for those that change.
    #[inline(always)]
    fn shows(&self, part: f32) -> f32 {
        at_most(1.0, at_least(0.0, (part - self.chance * (1.0 - FADE) as f32) * (1.0 / FADE) as f32))
    }
}

/// A place in a texture, which repeats in both directions.
#[inline(always)]
fn wrapped(place: f32) -> f32 {
    place - place.floor()
}

/// What billboards are made from.
pub(super) struct Billboards<'a> {
    shower: Shower<'a>,
    sheets: Sheets,
    /// Radiance below which the light of a streak is left out, cd/m^2.
    least_light: f32,
}

impl<'a> Billboards<'a> {
    /// Streaks whose light is nowhere above `least_light` (cd/m^2) are drawn without that of lamps and fires.
    pub(super) fn new(shower: Shower<'a>, least_light: f32) -> Self {
        let moment = shower.moment;
        Self { shower, sheets: Sheets::new(moment.key, &moment.classes), least_light }
    }

    /// All that may show within a ball.
    pub(super) fn parts(&self, within: Ball) -> Vec<Part> {
        self.shower.parts(
            &[within],
            CELL,
            |class, cell, gathering| dispatch!(self.shower.level, _simd => self.add_card(class, cell, gathering)),
        )
    }

    /// Adds the streaks of a cell's billboard.
    #[inline(always)]
    fn add_card(&self, class: &ClassNow, cell: Cell, gathering: &mut Gathering) {
        let card = self.card(class, cell);
        let [base, right, up] = self.edges(&card.stand);
        // A bound that holds for all its streaks is worth finding only where it may spare some their light.
        let least_peak = if self.least_light > 0.0 {
            self.least_light / self.shower.lighting.brightest(card.stand.point(0.5, 0.5), RADIUS)
        } else {
            0.0
        };
        let velocity = card.velocity.as_vec3().to_array();
        let (diameter_mm, count) = (class.diameter_mm as f32, class.count() as f32);
        for (part, sheet) in card.sheet.iter().enumerate() {
            let mut drops =
                Drops { places: [NOTHING; 3], velocities: velocity.map(|v| [v; LANES]), diameter_mm, there: NOTHING };
            for i in 0..LANES {
                drops.there[i] = card.shows(count - (part * LANES + i) as i32 as f32);
                let (x, y) =
                    (wrapped(card.side * (sheet[0][i] - card.offset[0])), wrapped(sheet[1][i] - card.offset[1]));
                for axis in 0..3 {
                    drops.places[axis][i] = up[axis].fma(y, right[axis].fma(x, base[axis]));
                }
            }
            self.shower.add_drops(&drops, least_peak, gathering);
        }
    }

    /// The first corner of a square from the camera, and its edges, m.
    fn edges(&self, stand: &UprightQuad) -> [[f32; 3]; 3] {
        let eye = self.shower.moment.sight.middle().position;
        let [corner, right, up] = [stand.point(0.0, 0.0), stand.point(1.0, 0.0), stand.point(0.0, 1.0)];
        [corner - eye, right - corner, up - corner].map(|vector| vector.as_vec3().to_array())
    }

    fn card(&self, class: &ClassNow, cell: Cell) -> Card<'_> {
        let moment = self.shower.moment;
        let contents = class.lattice.contents(cell);
        let [across, up, choice, mirrored] = moment.key.uniforms(contents, 0, class.purpose(OFFSET));
        let [x, z, chance, _] = moment.key.uniforms(contents, 0, class.purpose(PLACE));
        // Anywhere within the cell's ground: no two stand in a row.
        let (middle, velocity) = moment.drop(class, cell, DVec3::new(x.into(), 0.5, z.into()));
        let height = class.lattice.height();
        let base = middle - DVec3::Y * (0.5 * height);
        let right = right_facing(moment.sight.middle(), base);
        Card {
            stand: UprightQuad::new(base, right, DVec2::new(CELL, height), 0.0),
            velocity,
            sheet: &self.sheets.0[class.index][(choice * VARIANTS as f32) as usize],
            offset: [across, up],
            side: if mirrored < 0.5 { 1.0 } else { -1.0 },
            chance,
        }
    }
}
