//! Line drawings: strokes in the plane, read from a vector graphics file.

use crate::math::DVec2;

/// A stroke as a polyline.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// Its name in the file, if it has one.
    pub id: Option<String>,
    /// Its points, x to the right and y down, in the drawing's units; at least two.
    pub points: Vec<DVec2>,
}

/// A line drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// The strokes, in drawing order.
    pub strokes: Vec<Stroke>,
    /// Corner of the drawing area with the smallest coordinates.
    pub min: DVec2,
    /// Corner of the drawing area with the largest coordinates.
    pub max: DVec2,
}

impl Drawing {
    /// Size of its points in memory, bytes.
    pub fn memory_bytes(&self) -> u64 {
        self.strokes.iter().map(|stroke| size_of_val(&stroke.points[..]) as u64).sum()
    }
}
