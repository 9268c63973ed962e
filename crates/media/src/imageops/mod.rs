//! Operations on display pictures before they are written: flattening, labels, sprite sheets.

pub mod bleed;
pub mod flatten;
pub mod label;
pub mod sprite_sheet;
