//! Which sheet and which point of a shape becomes which of the next.

pub(crate) mod hungarian;
pub(crate) mod links;
pub(crate) mod sheet_matching;
pub(crate) mod split_merge;
pub(crate) mod time_warping;
