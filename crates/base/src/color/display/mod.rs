//! From exposed light to the codes of a display, and back.

pub(crate) mod agx;
pub mod alpha;
pub(crate) mod camera_response;
pub mod gamut;
pub mod quantize;
pub(crate) mod row;
pub mod tone;
pub mod transfer;
pub mod view;
