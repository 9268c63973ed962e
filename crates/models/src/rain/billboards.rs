//! Billboards: upright squares that face the camera, each with the streaks of all drops of one diameter in a cell.
//!
//! The texture T(R, D) that they carry is kept as the places of its drops instead of as pixels: a drop is narrower than a pixel, so that
//! nearly all of a picture of them is empty, and what is drawn from places is as sharp at any size.

use bansho_base::{
    math::{DVec2, DVec3},
    random::{Key, Purpose},
};

use fearless_simd::dispatch;

use crate::flame_sheet::placement::{Stand, right_facing};

use super::{
    drops::{Drop, FADE, Shower},
    lattice::{CELL, Cell},
    moment::{Ball, ClassNow},
    part::{Gathering, Part},
    stroke::Stroke,
};

const SHEET: Purpose = Purpose::named("rain texture");
const OFFSET: Purpose = Purpose::named("rain billboard offset");
const PLACE: Purpose = Purpose::named("rain billboard place");
/// Furthest that any of a billboard is from its middle, m.
const RADIUS: f64 = 0.75;
/// Textures of each diameter, so that the same streaks are seldom near each other.
const VARIANTS: usize = 2;

/// Where the drops of a texture are, across and up, 0 to 1.
type Sheet = Vec<[f64; 2]>;

/// The textures of all diameters at one rate.
struct Sheets(Vec<[Sheet; VARIANTS]>);

impl Sheets {
    /// Drop after drop, so that a texture with more of them has the same and others.
    fn new(key: Key, classes: &[ClassNow]) -> Self {
        let sheet = |class: &ClassNow, variant: usize| -> Sheet {
            let place = |index: u64| {
                let [x, y, ..] = key.uniforms((variant as u64) << 32 | index, 0, class.purpose(SHEET)).map(f64::from);
                [x, y]
            };
            (0..class.count().ceil() as u64).map(place).collect()
        };
        Self(classes.iter().map(|class| std::array::from_fn(|variant| sheet(class, variant))).collect())
    }
}

/// A billboard: where it stands and which part of which texture it shows.
struct Card<'a> {
    stand: Stand,
    /// m/s.
    velocity: DVec3,
    sheet: &'a Sheet,
    /// Where in the texture it begins.
    offset: [f64; 2],
    /// 1, or -1 where it is mirrored.
    side: f64,
    /// Which part of a drop its texture must hold for the card to show that drop.
    chance: f64,
}

impl Card<'_> {
    /// How much it shows of the last drop of a texture, of which this holds a part: that of all billboards together, each all of it or
    /// nothing but for those that change.
    fn shows(&self, part: f64) -> f64 {
        ((part - self.chance * (1.0 - FADE)) / FADE).clamp(0.0, 1.0)
    }

    /// Where a drop of its texture is, m. A texture repeats in both directions.
    fn point(&self, [x, y]: [f64; 2]) -> DVec3 {
        let wrapped = |place: f64| place - place.floor();
        self.stand.point(wrapped(self.side * (x - self.offset[0])), wrapped(y - self.offset[1]))
    }
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
        let middle = card.stand.point(0.5, 0.5);
        // A bound that holds for all its streaks is worth finding only where it may spare some their light.
        let brightest =
            if self.least_light > 0.0 { self.shower.lighting.brightest(middle, RADIUS) } else { f32::INFINITY };
        for (number, place) in card.sheet.iter().enumerate() {
            let drop = Drop {
                point: card.point(*place),
                velocity: card.velocity,
                diameter_mm: class.diameter_mm,
                there: card.shows(class.count() - number as f64),
            };
            let lit = |stroke: &Stroke| brightest * stroke.peak() >= self.least_light;
            gathering.add(self.shower.stroke(&drop, lit));
        }
    }

    fn card(&self, class: &ClassNow, cell: Cell) -> Card<'_> {
        let moment = self.shower.moment;
        let contents = class.lattice.contents(cell);
        let [across, up, choice, mirrored] = moment.key.uniforms(contents, 0, class.purpose(OFFSET)).map(f64::from);
        let [x, z, chance, _] = moment.key.uniforms(contents, 0, class.purpose(PLACE)).map(f64::from);
        // Anywhere within the cell's ground: no two stand in a row.
        let place = DVec3::from(cell.0.map(|count| count as f64)) + DVec3::new(x, 0.5, z);
        let (middle, velocity) = moment.drop(class, place);
        let height = class.lattice.height();
        let base = middle - DVec3::Y * (0.5 * height);
        let right = right_facing(moment.sight.middle(), base);
        Card {
            stand: Stand::new(base, right, DVec2::new(CELL, height), 0.0),
            velocity,
            sheet: &self.sheets.0[class.index][(choice * VARIANTS as f64) as usize],
            offset: [across, up],
            side: if mirrored < 0.5 { 1.0 } else { -1.0 },
            chance,
        }
    }
}
