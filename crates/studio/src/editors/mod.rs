//! Editors of single kinds of phenomena: the shapes of an aurora, the stages and curves of a flame sheet.

pub mod aurora;
pub(crate) mod flame_sheet;
