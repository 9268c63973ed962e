//! Streaks of a part of the rain, ready to draw.

use super::{bands::Bands, patch::STRETCH, stroke::Stroke};

/// Streaks in the order in which they are drawn, each known to the bands and stretches of the picture that it touches.
///
/// Parts are made by themselves, so that no thread waits for all streaks to be sorted.
#[derive(Default)]
pub(crate) struct Part {
    strokes: Vec<Stroke>,
    bands: Bands,
    /// How many cells have streaks in it.
    pub(crate) cells: usize,
}

impl Part {
    /// A part of a picture of `size` pixels.
    pub(crate) fn new(strokes: Vec<Stroke>, cells: usize, size: [usize; 2]) -> Self {
        let bands = Bands::new(size, STRETCH, strokes.iter().map(Stroke::extent));
        Self { strokes, bands, cells }
    }

    /// Its streaks.
    pub(crate) fn count(&self) -> usize {
        self.strokes.len()
    }

    /// Adds its streaks that touch a stretch of a band.
    ///
    /// They stand far apart in memory; copied together they are waited for all at once instead of one by one as they are drawn.
    pub(crate) fn collect(&self, band: usize, stretch: usize, streaks: &mut Vec<Stroke>) {
        streaks.extend(self.bands.members(band, stretch).iter().map(|index| self.strokes[*index as usize]));
    }
}
