//! Drawing of the gas: rays through the grid.

pub(crate) mod field;
pub(crate) mod haze;
pub(crate) mod lights;
pub(crate) mod march;
pub(crate) mod prepared;
pub(crate) mod sheet;
pub(crate) mod smoke;
