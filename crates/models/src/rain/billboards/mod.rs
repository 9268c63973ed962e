//! Billboards: upright squares that carry the streaks of all drops of one diameter in a cell.

mod card;
mod paint;
mod sheet;

use std::sync::{Arc, Mutex, PoisonError};

use bansho_base::{
    image::Rect,
    math::DVec3,
    random::{Key, Purpose},
};
use rayon::prelude::*;

use super::{
    bands::Bands,
    lattice::CELL,
    moment::{Ball, ClassNow, Moment},
    streak::Streak,
};

pub(super) use card::Card;
pub(super) use paint::{Brush, paint};
use sheet::{Contents, Sheet};

const SHEET: Purpose = Purpose::named("rain texture");
/// Textures of each diameter, so that the same streaks are seldom near each other.
const VARIANTS: u64 = 2;

/// The textures of all diameters at one rate and exposure.
#[derive(Debug)]
pub(super) struct Sheets {
    contents: Vec<Contents>,
    /// Those of a diameter follow each other.
    sheets: Vec<Sheet>,
}

impl Sheets {
    fn new(contents: Vec<Contents>, key: Key, classes: &[ClassNow]) -> Self {
        let sheet = |index: usize| {
            let class = index / VARIANTS as usize;
            Sheet::new(&contents[class], key, classes[class].purpose(SHEET), index as u64 % VARIANTS)
        };
        let sheets = (0..contents.len() * VARIANTS as usize).into_par_iter().map(sheet).collect();
        Self { contents, sheets }
    }

    fn sheet(&self, class: usize, variant: u64) -> &Sheet {
        &self.sheets[class * VARIANTS as usize + variant as usize]
    }
}

/// Keeps the last textures: most shots have one rate and one exposure.
#[derive(Debug, Default)]
pub(super) struct SheetCache(Mutex<Option<Arc<Sheets>>>);

impl SheetCache {
    /// The textures of a moment.
    pub(super) fn sheets(&self, moment: &Moment) -> Arc<Sheets> {
        let contents = |class: &ClassNow| Contents {
            count: class.most * class.share * class.lattice.volume(),
            streak: Streak::new(class.diameter_mm, class.speed, moment.sight.exposure),
            cell: [CELL, class.lattice.height()],
        };
        let contents: Vec<Contents> = moment.classes.iter().map(contents).collect();
        // A thread that panicked left whole textures or none.
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(sheets) = last.as_ref().filter(|sheets| sheets.contents == contents) {
            return sheets.clone();
        }
        let sheets = Arc::new(Sheets::new(contents, moment.key, &moment.classes));
        *last = Some(sheets.clone());
        sheets
    }
}

/// The billboards of a frame, nearest first.
pub(super) struct Billboards {
    pub(super) cards: Vec<Card>,
    pub(super) bands: Bands,
    pub(super) sheets: Arc<Sheets>,
}

impl Billboards {
    /// Those within a ball; `weight` says how much of one is drawn where its middle is.
    pub(super) fn new(
        moment: &Moment,
        sheets: Arc<Sheets>,
        picture: Rect,
        within: Ball,
        weight: &(dyn Fn(DVec3) -> f64 + Sync),
    ) -> Self {
        let lists: Vec<Vec<Card>> = moment
            .classes
            .par_iter()
            .filter(|class| class.share > 0.0)
            .map(|class| {
                let cells = moment.cells(class, within);
                cells.iter().filter_map(|(_, cell)| Card::new(moment, class, *cell, picture, weight)).collect()
            })
            .collect();
        let mut cards = lists.concat();
        cards.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        let bands = {
            let columns = [0.0, picture.width as f32];
            let extents = cards.iter().map(|card: &Card| [columns, card.rows]);
            Bands::new([picture.width, picture.height], picture.width.max(1), extents)
        };
        Self { cards, bands, sheets }
    }

    /// Drops that they show in the picture, on average.
    pub(super) fn drops_in_view(&self) -> f64 {
        let share = |card: &Card| card.in_view * self.sheets.contents[card.class].count;
        self.cards.iter().map(share).sum()
    }
}
