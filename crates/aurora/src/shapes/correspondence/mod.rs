//! Correspondence of sheets and control points between successive shapes.

pub(crate) mod links;
pub(crate) mod sheet_matching;
pub(crate) mod split_merge;
pub(crate) mod time_warping;
