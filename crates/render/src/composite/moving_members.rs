//! What moves in a picture while the shutter is open, and where several things do: cells of a strip, each with the members that move in it.

use std::sync::Arc;

use bansho_base::{
    image::Rect,
    phenomenon::{Prepared, strip::Strip},
};

use super::accumulate::Accumulator;

/// Most columns that are drawn at once: few enough that the planes of 32 moments fit in the L2 cache of a core.
pub(super) const TILE_COLUMNS: usize = 128;

/// The moving members of a composition.
#[derive(Default)]
pub(crate) struct Moments<'a>(pub(super) Vec<MovingMember<'a>>);

/// A member that is prepared in parts.
pub(crate) struct MovingMember<'a> {
    /// Index of the member.
    pub(crate) member: usize,
    /// Its parts: the largest number of parts of all members is a multiple of theirs.
    pub(crate) parts: Vec<Arc<dyn Prepared + 'a>>,
    /// The pixels in which it moves.
    pub(crate) rect: Rect,
}

/// A rectangle of a strip in which the same members move.
#[derive(Debug, PartialEq)]
pub(super) struct Cell {
    pub(super) rect: Rect,
    /// Positions in the list of moving members, two or more; empty if fewer move.
    pub(super) moving: Vec<usize>,
}

impl Cell {
    /// Whether several members move in it.
    pub(super) fn is_drawn_by_moments(&self) -> bool {
        !self.moving.is_empty()
    }
}

impl<'a> Moments<'a> {
    /// The moments of the members that move.
    pub(crate) fn new(moving: Vec<MovingMember<'a>>) -> Self {
        Self(moving)
    }

    /// The cells of a strip; none if at most one member moves in any of its pixels.
    pub(super) fn cells(&self, strip: Rect) -> Vec<Cell> {
        let rects: Vec<Rect> = self.0.iter().map(|moving| moving.rect).collect();
        cells(&rects, strip)
    }
}

/// The cells of a strip over which the rectangles of moving members extend; none if no two of them overlap there.
///
/// Which members move in a pixel, and so its bits, must not depend on the strip or the crop.
fn cells(moving: &[Rect], strip: Rect) -> Vec<Cell> {
    let moving: Vec<(usize, Rect)> =
        moving.iter().map(|rect| rect.intersection(&strip)).enumerate().filter(|(_, rect)| !rect.is_empty()).collect();
    let overlap = moving
        .iter()
        .enumerate()
        .any(|(index, (_, rect))| moving[..index].iter().any(|(_, other)| !rect.intersection(other).is_empty()));
    if !overlap {
        return Vec::new();
    }
    // In a cell between two neighboring edges, both ways, the same members move everywhere.
    let (mut rows, mut columns) = (vec![strip.y, strip.bottom()], vec![strip.x, strip.right()]);
    for (_, rect) in &moving {
        rows.extend([rect.y, rect.bottom()]);
        columns.extend([rect.x, rect.right()]);
    }
    for edges in [&mut rows, &mut columns] {
        edges.sort_unstable();
        edges.dedup();
    }
    let mut cells: Vec<Cell> = Vec::new();
    for rows in rows.windows(2) {
        let first = cells.len();
        for columns in columns.windows(2) {
            let rect = Rect { x: columns[0], y: rows[0], width: columns[1] - columns[0], height: rows[1] - rows[0] };
            let inside = moving.iter().filter(|(_, moving)| !moving.intersection(&rect).is_empty());
            let mut inside: Vec<usize> = inside.map(|(index, _)| *index).collect();
            if inside.len() < 2 {
                inside.clear();
            }
            match cells[first..].last_mut() {
                Some(last) if last.moving == inside => last.rect.width += rect.width,
                _ => cells.push(Cell { rect, moving: inside }),
            }
        }
    }
    cells.into_iter().flat_map(tiles).collect()
}

/// A cell cut into tiles, if it is drawn by moments.
fn tiles(cell: Cell) -> Vec<Cell> {
    if !cell.is_drawn_by_moments() {
        return vec![cell];
    }
    let Cell { rect, moving } = cell;
    let mut tiles = Vec::new();
    // Tiles are aligned to the picture, so that a crop changes no pixel.
    for index in rect.x / TILE_COLUMNS..rect.right().div_ceil(TILE_COLUMNS) {
        let tile = Rect { x: index * TILE_COLUMNS, width: TILE_COLUMNS, ..rect };
        tiles.push(Cell { rect: tile.intersection(&rect), moving: moving.clone() });
    }
    tiles
}

/// Scratch memory of one thread.
#[derive(Default)]
pub(super) struct MomentScratch {
    /// The composite of each moment.
    pub(super) moments: Vec<Accumulator>,
    /// What partly covered pixels show in each moment without the opaque surfaces.
    pub(super) uncovered: Vec<Accumulator>,
    /// What is drawn of a member; where obstacles hide it at some moments, with them and without them.
    pub(super) strips: [Strip; 3],
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rect(x: usize, y: usize, width: usize, height: usize) -> Rect {
        Rect { x, y, width, height }
    }

    #[test]
    fn cells_are_where_two_members_move() {
        let strip = rect(0, 8, 100, 8);
        assert_eq!(cells(&[rect(0, 0, 100, 100)], strip), [], "one moves");
        assert_eq!(cells(&[rect(0, 0, 50, 50), rect(50, 0, 50, 50), rect(0, 20, 100, 9)], strip), [], "side by side");
        let cell = |rect, moving: &[usize]| Cell { rect, moving: moving.to_vec() };
        assert_eq!(
            cells(&[rect(0, 0, 100, 100), rect(10, 12, 20, 40), rect(20, 10, 80, 2)], strip),
            [
                cell(rect(0, 8, 100, 2), &[]),
                cell(rect(0, 10, 20, 2), &[]),
                cell(rect(20, 10, 80, 2), &[0, 2]),
                cell(rect(0, 12, 10, 4), &[]),
                cell(rect(10, 12, 20, 4), &[0, 1]),
                cell(rect(30, 12, 70, 4), &[]),
            ]
        );
    }

    #[test]
    fn cells_cover_a_strip_once_and_tiles_are_aligned_to_the_picture() {
        let strip = rect(30, 8, 500, 8);
        let moving = [rect(0, 0, 1000, 100), rect(40, 10, 300, 100), rect(200, 0, 400, 13)];
        let cells = cells(&moving, strip);
        for y in strip.y..strip.bottom() {
            for x in strip.x..strip.right() {
                let pixel = rect(x, y, 1, 1);
                let mut here = cells.iter().filter(|cell| !cell.rect.intersection(&pixel).is_empty());
                let cell = here.next().unwrap();
                assert!(here.next().is_none());
                let inside: Vec<usize> = (0..3).filter(|&i| !moving[i].intersection(&pixel).is_empty()).collect();
                assert_eq!(cell.moving, if inside.len() < 2 { Vec::new() } else { inside });
            }
        }
        let aligned = |cell: &Cell| cell.rect.x / TILE_COLUMNS == (cell.rect.right() - 1) / TILE_COLUMNS;
        assert!(cells.iter().filter(|cell| cell.is_drawn_by_moments()).all(aligned));
    }
}
