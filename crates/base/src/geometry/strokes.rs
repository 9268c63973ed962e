//! Line drawings: strokes in the plane, as they come from a vector graphics file.

use crate::math::DVec2;

/// A stroke as a line through points.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// Its name in the file, if it has one.
    pub id: Option<String>,
    /// Its points, x to the right and y down, in the drawing's units; at least two.
    pub points: Vec<DVec2>,
}

/// Strokes in the order in which they were drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Its strokes.
    pub strokes: Vec<Stroke>,
    /// The corner of the sheet that was drawn on with the least coordinates.
    pub min: DVec2,
    /// The corner with the greatest.
    pub max: DVec2,
}

impl Drawing {
    /// Bytes that its points take in memory.
    pub fn memory_bytes(&self) -> u64 {
        self.strokes.iter().map(|stroke| size_of_val(&stroke.points[..]) as u64).sum()
    }
}
