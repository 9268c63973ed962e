//! The aurora's foot as an artist draws it (thesis, 2.2.1 and 2.2.2).
//!
//! Geometry is in km in the plane at 100 km altitude: x east, z south, the observer's nadir at the origin. Points are
//! [`DVec2`](bansho_base::math::DVec2)s whose second component is z.

mod cells;
mod crossing;
mod fault;
mod form;
mod parameters;
mod polyline;

pub use crossing::{SegmentId, count_crossings, first_crossing};
pub use fault::{ShapeFault, ShapeFaultKind};
pub use form::Form;
pub use parameters::{
    Correspondence, FRAME_S, MergeParameters, MotionParameters, ShapeParameters, SheetParameters, Spacing,
    SplitParameters,
};
