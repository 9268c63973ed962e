//! Sheets: many small pictures in one, row after row from the top left.

use std::sync::{Mutex, PoisonError};

use bansho_base::{frame::Frame, host::observer::Observer};
use bansho_media::imageops::sprite_sheet::SheetLayout;

use crate::job::{
    error::{Conflict, JobError, SheetKind},
    observer::{FrameDone, JobObserver},
    render::draw_frames::FrameSink,
};

/// Most tiles of a sheet.
pub(crate) const MOST_TILES: usize = 4096;

/// The sheet nearest to a square of tiles that holds `count` of them.
pub(crate) fn holding(count: usize, cell: [usize; 2], gutter: usize) -> Result<SheetLayout, Conflict> {
    let columns = (1..=count).find(|columns| columns * columns >= count).unwrap_or(1);
    checked(SheetLayout { count, columns, cell, gutter }, SheetKind::Contact)
}

/// A sheet holds some tiles, and may be as large as a picture.
pub(crate) fn checked(sheet: SheetLayout, of: SheetKind) -> Result<SheetLayout, Conflict> {
    let most = bansho_scene::picture::LARGEST_SIDE as usize;
    if !(1..=MOST_TILES).contains(&sheet.count) {
        return Err(Conflict::Tiles { of, tiles: sheet.count, most: MOST_TILES });
    }
    let [width, height] = sheet.size();
    if width <= most && height <= most { Ok(sheet) } else { Err(Conflict::SheetSize { of, width, height, most }) }
}

/// Gathers a tile from each frame.
pub(crate) struct Gather<'a, T, M> {
    make: M,
    observer: &'a dyn JobObserver,
    tiles: Mutex<Vec<Option<T>>>,
}

impl<'a, T, M: Fn(&mut Frame, &dyn Observer) -> T> Gather<'a, T, M> {
    /// Will hold `count` tiles, each made from a frame by `make`.
    pub(crate) fn new(count: usize, observer: &'a dyn JobObserver, make: M) -> Self {
        Self { make, observer, tiles: Mutex::new((0..count).map(|_| None).collect()) }
    }

    /// The tiles in the order of the frames.
    pub(crate) fn into_tiles(self) -> Vec<T> {
        self.tiles.into_inner().unwrap_or_else(PoisonError::into_inner).into_iter().flatten().collect()
    }
}

impl<T: Send, M: Fn(&mut Frame, &dyn Observer) -> T + Sync> FrameSink for Gather<'_, T, M> {
    fn finish(&self, index: usize, frame: &mut Frame, observer: &dyn Observer) -> Result<(), JobError> {
        let number = frame.header.number;
        let tile = (self.make)(frame, observer);
        let mut tiles = self.tiles.lock().unwrap_or_else(PoisonError::into_inner);
        tiles[index] = Some(tile);
        let drawn = tiles.iter().flatten().count();
        drop(tiles);
        self.observer.frame_done(&FrameDone { number, path: None, drawn });
        Ok(())
    }

    fn window(&self) -> usize {
        usize::MAX
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_is_nearly_square_and_holds_all() {
        for (count, columns, rows) in [(1, 1, 1), (2, 2, 1), (3, 2, 2), (5, 3, 2), (7, 3, 3), (16, 4, 4), (17, 5, 4)] {
            let sheet = holding(count, [10, 6], 2).unwrap();
            assert_eq!((sheet.columns, sheet.rows()), (columns, rows), "{count}");
        }
    }

    #[test]
    fn sheets_too_large_or_of_too_many_tiles_are_refused() {
        assert!(matches!(holding(0, [8, 8], 2), Err(Conflict::Tiles { .. })));
        assert!(matches!(holding(MOST_TILES + 1, [1, 1], 0), Err(Conflict::Tiles { .. })));
        assert!(matches!(holding(100, [1920, 1080], 2), Err(Conflict::SheetSize { width: 19_218, .. })));
        assert!(holding(64, [1920, 1080], 2).is_ok());
    }
}
