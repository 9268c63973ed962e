//! Tables of the user's curves, computed once per sheet: the mapping to flame coordinates, and color.

pub(crate) mod color_ramp;
pub(crate) mod curve_pair;
pub(crate) mod shape_tables;
