//! Streaks of a part of the rain, ready to draw.

use super::{
    bin::{Bands, Extent, Spans},
    rasterize::{Record, Stroke},
};
use crate::streaks::rasterize::tile::STRETCH;

/// Streaks in the order in which they are drawn, each known to the bands and stretches of the picture that it touches.
///
/// Parts are made by themselves, so that no thread waits for all streaks to be sorted.
pub(crate) struct Part {
    records: Vec<Record>,
    bands: Bands,
    /// How many cells have streaks in it.
    pub(crate) cells: usize,
}

/// A part that streaks are added to.
pub(crate) struct Gathering {
    /// Columns and rows of the picture.
    size: [usize; 2],
    records: Vec<Record>,
    spans: Vec<Spans>,
    cells: usize,
}

impl Gathering {
    /// Nothing yet, of a picture of `size` pixels.
    pub(crate) fn new(size: [usize; 2]) -> Self {
        Self { size, records: Vec::new(), spans: Vec::new(), cells: 0 }
    }

    /// Adds a streak that may touch so much of the picture.
    #[inline(always)]
    pub(crate) fn add(&mut self, stroke: &Stroke, extent: Extent) {
        self.spans.push(Spans::new(extent, self.size, STRETCH));
        self.records.push(Record::new(stroke));
    }

    /// Adds a cell's streaks and counts it, if there are any.
    #[inline(always)]
    pub(crate) fn add_cell(&mut self, add: impl FnOnce(&mut Self)) {
        let before = self.records.len();
        add(self);
        self.cells += usize::from(self.records.len() > before);
    }

    /// All of it, sorted.
    pub(crate) fn part(self) -> Part {
        Part { bands: Bands::new(self.size, STRETCH, &self.spans), records: self.records, cells: self.cells }
    }
}

impl Part {
    /// Its streaks.
    pub(crate) fn count(&self) -> usize {
        self.records.len()
    }

    /// Adds its streaks that touch a stretch of a band.
    ///
    /// They stand far apart in memory; copied together they are waited for all at once instead of one by one as they are drawn.
    #[inline(always)]
    pub(crate) fn collect(&self, band: usize, stretch: usize, streaks: &mut Vec<Record>) {
        let members = self.bands.members(band, stretch);
        streaks.reserve(members.len());
        for index in members {
            streaks.push(self.records[*index as usize]);
        }
    }
}
