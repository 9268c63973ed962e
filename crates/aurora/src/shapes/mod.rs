//! The sheets of the aurora as drawn curves, and their interpolation in time (thesis, 2.2.1 and 2.2.2).
//!
//! A scene lists key shapes; each has sheets, splits and merges. [`Sequence`] is the shape at any time.
//!
//! Coordinates are km in the plane at 100 km altitude: x east, z south, the observer's zenith at the origin. Points are
//! [`DVec2`](bansho_base::math::DVec2)s whose second component is z.

pub(crate) mod control_points;
pub(crate) mod correspondence;
mod error;
mod form;
pub(crate) mod geometry;
pub(crate) mod interpolation;
mod parameters;
mod sequence;
mod shape;
pub(crate) mod strokes;

pub use error::{ShapeError, ShapeErrorKind};
pub use form::Form;
pub use geometry::nearest_segment::NearestSegmentGrid;
pub(crate) use geometry::polyline::{cumulative_lengths, line_length};
pub use interpolation::{Bridge, SheetEnd};
pub use parameters::{
    Correspondence, FRAME_S, GapLight, LinkParameters, MergeParameters, MorphingParameters, ShapeParameters,
    SheetParameters, Spacing, SplitParameters,
};
pub(crate) use sequence::ControlPointIds;
pub use sequence::Sequence;
pub use shape::{SegmentId, Shape, Sheet, SheetSample, SheetSampler};
pub use strokes::intersection::{count_crossings, first_crossing};

/// Altitude of the drawn plane, km.
pub(crate) const FOOT_ALTITUDE_KM: f64 = 100.0;

#[cfg(test)]
mod tests;
