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

/// What users should know about how a drawing was read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DrawingRemark {
    /// Elements that are no lines.
    #[error("its elements {} are not lines and are ignored", .names.join(", "))]
    OtherElements {
        /// Their names, each once.
        names: Vec<&'static str>,
    },
    /// Paths of a single point.
    #[error("{paths} path{} with only one point {} ignored", if *.paths == 1 { "" } else { "s" }, if *.paths == 1 { "is" } else { "are" })]
    Dots {
        /// Their number.
        paths: usize,
    },
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
    /// What users should know about how it was read.
    pub remarks: Vec<DrawingRemark>,
}

impl Drawing {
    /// Size of its points in memory, bytes.
    pub fn memory_bytes(&self) -> u64 {
        self.strokes.iter().map(|stroke| size_of_val(&stroke.points[..]) as u64).sum()
    }
}
