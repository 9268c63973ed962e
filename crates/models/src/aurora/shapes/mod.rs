//! The aurora's foot as an artist draws it, and as it moves (thesis, 2.2.1 and 2.2.2).
//!
//! A scene lists shapes; each has sheets, and says what splits and merges on the way to it. [`Sequence`] is the shape at any time.
//!
//! Geometry is in km in the plane at 100 km altitude: x east, z south, the observer's nadir at the origin. Points are
//! [`DVec2`](bansho_base::math::DVec2)s whose second component is z.

mod anchors;
mod assignment;
mod cells;
mod change;
mod crossing;
mod drawn;
mod factors;
mod fault;
mod follow;
mod form;
mod gap;
mod matching;
mod neighbourhood;
mod parameters;
mod passing;
mod polyline;
mod segments;
mod sequence;
mod shape;
mod track;
mod usual;
mod warp;

pub use crossing::{SegmentId, count_crossings, first_crossing};
pub use fault::{ShapeFault, ShapeFaultKind};
pub use form::Form;
pub use gap::Bridge;
pub use neighbourhood::Neighbourhood;
pub use parameters::{
    Correspondence, FRAME_S, LinkParameters, MergeParameters, MotionParameters, ShapeParameters, SheetParameters,
    Spacing, SplitParameters,
};
pub(in crate::aurora) use polyline::lengths;
pub use segments::{Sample, Segments};
pub(in crate::aurora) use sequence::Listing;
pub use sequence::Sequence;
pub use shape::{Shape, Sheet};

#[cfg(test)]
mod tests;
