//! Sheets: many frames as tiles of one picture, row by row from the top left.

use std::sync::{Mutex, PoisonError};

use bansho_base::{frame::Frame, host::observer::Observer};
use bansho_media::imageops::sprite_sheet::SheetLayout;
use bansho_render::SceneLinear;

use super::{
    error::{JobError, OptionError, SheetKind},
    observer::{FrameDone, JobObserver},
    pipeline::draw_frames::FrameSink,
};

/// Maximum number of tiles of a sheet.
pub(crate) const MAX_TILES: usize = 4096;

/// The layout of `count` tiles that is nearest to a square.
pub(crate) fn nearly_square_layout(count: usize, cell: [usize; 2], gutter: usize) -> Result<SheetLayout, OptionError> {
    let columns = (1..=count).find(|columns| columns * columns >= count).unwrap_or(1);
    check_layout(SheetLayout { count, columns, cell, gutter }, SheetKind::Contact)
}

/// Returns `layout` if it has between 1 and [`MAX_TILES`] tiles and is no larger than a picture may be.
pub(crate) fn check_layout(layout: SheetLayout, sheet: SheetKind) -> Result<SheetLayout, OptionError> {
    let max = bansho_scene::picture::LARGEST_SIDE as usize;
    if !(1..=MAX_TILES).contains(&layout.count) {
        return Err(OptionError::TileCount { sheet, tiles: layout.count, max: MAX_TILES });
    }
    let [width, height] = layout.size();
    if width.max(height) <= max { Ok(layout) } else { Err(OptionError::SheetSize { sheet, width, height, max }) }
}

/// Collects a tile made from each frame.
pub(crate) struct TileCollector<'a, T, M> {
    make_tile: M,
    observer: &'a dyn JobObserver,
    tiles: Mutex<Vec<Option<T>>>,
}

impl<'a, T, M: Fn(&mut Frame, &dyn Observer) -> T> TileCollector<'a, T, M> {
    /// For `count` tiles, each made from a frame by `make_tile`.
    pub(crate) fn new(count: usize, observer: &'a dyn JobObserver, make_tile: M) -> Self {
        Self { make_tile, observer, tiles: Mutex::new((0..count).map(|_| None).collect()) }
    }

    /// The tiles in the order of the frames.
    pub(crate) fn into_tiles(self) -> Vec<T> {
        self.tiles.into_inner().unwrap_or_else(PoisonError::into_inner).into_iter().flatten().collect()
    }
}

impl<T: Send, M: Fn(&mut Frame, &dyn Observer) -> T + Sync> FrameSink for TileCollector<'_, T, M> {
    type Target = SceneLinear;
    /// Number of the frame, and its tile.
    type Encoded = (i64, T);

    fn target(&self) -> &SceneLinear {
        &SceneLinear
    }

    fn encode(&self, _index: usize, frame: &mut Frame, observer: &dyn Observer) -> Result<(i64, T), JobError> {
        Ok((frame.header.number, (self.make_tile)(frame, observer)))
    }

    fn commit(&self, index: usize, (number, tile): (i64, T), _observer: &dyn Observer) -> Result<(), JobError> {
        let mut tiles = self.tiles.lock().unwrap_or_else(PoisonError::into_inner);
        tiles[index] = Some(tile);
        let drawn = tiles.iter().flatten().count();
        drop(tiles);
        self.observer.frame_done(&FrameDone { number, path: None, drawn });
        Ok(())
    }

    fn max_in_flight(&self) -> usize {
        usize::MAX
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_is_nearly_square_and_has_room_for_all_tiles() {
        for (count, columns, rows) in [(1, 1, 1), (2, 2, 1), (3, 2, 2), (5, 3, 2), (7, 3, 3), (16, 4, 4), (17, 5, 4)] {
            let sheet = nearly_square_layout(count, [10, 6], 2).unwrap();
            assert_eq!((sheet.columns, sheet.rows()), (columns, rows), "{count}");
        }
    }

    #[test]
    fn sheets_too_large_or_of_too_many_tiles_are_refused() {
        assert!(matches!(nearly_square_layout(0, [8, 8], 2), Err(OptionError::TileCount { .. })));
        assert!(matches!(nearly_square_layout(MAX_TILES + 1, [1, 1], 0), Err(OptionError::TileCount { .. })));
        assert!(matches!(
            nearly_square_layout(100, [1920, 1080], 2),
            Err(OptionError::SheetSize { width: 19_218, .. })
        ));
        assert!(nearly_square_layout(64, [1920, 1080], 2).is_ok());
    }
}
