//! Sheets: many small pictures in one, row after row from the top left.

use bansho_base::image::Rect;

/// How tiles lie in a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Tiles in a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
    /// Size of a tile, pixels.
    pub tile: [usize; 2],
    /// Empty pixels between tiles.
    pub gutter: usize,
}

impl Grid {
    /// The grid nearest to a square of tiles that holds `count` of them.
    pub fn holding(count: usize, tile: [usize; 2], gutter: usize) -> Self {
        let columns = (1..=count).find(|columns| columns * columns >= count).unwrap_or(1);
        Self { columns, rows: count.div_ceil(columns), tile, gutter }
    }

    /// Size of the sheet, pixels.
    pub fn size(&self) -> [usize; 2] {
        let side = |tiles: usize, tile: usize| tiles * tile + tiles.saturating_sub(1) * self.gutter;
        [side(self.columns, self.tile[0]), side(self.rows, self.tile[1])]
    }

    /// Where tile `index` lies.
    pub fn place(&self, index: usize) -> Rect {
        let at = |tiles: usize, tile: usize| tiles * (tile + self.gutter);
        let (x, y) = (at(index % self.columns, self.tile[0]), at(index / self.columns, self.tile[1]));
        Rect { x, y, width: self.tile[0], height: self.tile[1] }
    }

    /// Copies the rows of tile `index` into the sheet's pixels.
    pub(super) fn put<P: Copy>(&self, sheet: &mut [P], index: usize, tile: &[P]) {
        let (place, width) = (self.place(index), self.size()[0]);
        for (row, pixels) in tile.chunks_exact(place.width).enumerate() {
            sheet[(place.y + row) * width + place.x..][..place.width].copy_from_slice(pixels);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_is_nearly_square_and_holds_all() {
        for (count, columns, rows) in [(1, 1, 1), (2, 2, 1), (3, 2, 2), (5, 3, 2), (7, 3, 3), (16, 4, 4), (17, 5, 4)] {
            let grid = Grid::holding(count, [10, 6], 2);
            assert_eq!((grid.columns, grid.rows), (columns, rows), "{count}");
        }
        let grid = Grid::holding(5, [10, 6], 2);
        assert_eq!(grid.size(), [34, 14]);
        assert_eq!(grid.place(4), Rect { x: 12, y: 8, width: 10, height: 6 });
    }

    #[test]
    fn tiles_land_in_their_places_and_nowhere_else() {
        let grid = Grid { columns: 2, rows: 1, tile: [2, 2], gutter: 1 };
        let mut sheet = [0; 10];
        grid.put(&mut sheet, 1, &[1, 2, 3, 4]);
        assert_eq!(sheet, [0, 0, 0, 1, 2, 0, 0, 0, 3, 4]);
    }
}
