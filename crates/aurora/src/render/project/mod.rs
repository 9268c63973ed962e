//! From the magnetic field to a chart of the sky about the magnetic zenith.

pub(crate) mod altitude_polynomial;
pub(crate) mod chart;
pub(crate) mod field_lines;
pub(crate) mod visible_rows;
