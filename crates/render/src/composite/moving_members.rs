//! What moves in a picture while the shutter is open, and where its moments must be composited apart: cells of a strip, each with the members that move in it.
//!
//! That is where several members move over the same pixels. It is also where a single one moves from one slice of depth to another: its light in the nearer slice,
//! averaged, would hide what it shows in the farther one at other moments.

use std::sync::Arc;

use bansho_base::{
    image::Rect,
    phenomenon::{Prepared, strip::Strip},
};

use super::{accumulate::Accumulator, slices::Slice};

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
    /// Pixels that it may show in several slices of depth.
    pub(crate) in_several_slices: Vec<Rect>,
}

impl<'a> MovingMember<'a> {
    /// A member that moves in `rect`.
    pub(crate) fn new(member: usize, parts: Vec<Arc<dyn Prepared + 'a>>, rect: Rect) -> Self {
        Self { member, parts, rect, in_several_slices: Vec::new() }
    }

    /// Finds the pixels that it may show in several of the slices.
    fn find_pixels_in_several(&mut self, slices: &[Slice]) {
        let mut nearer = Rect::default();
        for slice in slices.iter().filter(|slice| slice.members.contains(&self.member)) {
            let bounds = self.parts.iter().fold(Rect::default(), |all, part| all.union(&part.bounds(&slice.interval)));
            let in_both = bounds.intersection(&nearer);
            if !in_both.is_empty() {
                self.in_several_slices.push(in_both);
            }
            nearer = nearer.union(&bounds);
        }
    }
}

/// A rectangle of a strip in which the same members move.
#[derive(Debug, PartialEq)]
pub(super) struct Cell {
    pub(super) rect: Rect,
    /// Positions in the list of moving members; empty where the mean of each is right.
    pub(super) moving: Vec<usize>,
}

impl Cell {
    /// Whether its moments are composited apart.
    pub(super) fn is_drawn_by_moments(&self) -> bool {
        !self.moving.is_empty()
    }
}

impl<'a> Moments<'a> {
    /// The moments of the members that move, drawn in these slices.
    pub(crate) fn new(mut moving: Vec<MovingMember<'a>>, slices: &[Slice]) -> Self {
        moving.iter_mut().for_each(|moving| moving.find_pixels_in_several(slices));
        Self(moving)
    }

    /// The cells of a strip; none if all of it is right as the mean of each member.
    pub(super) fn cells(&self, strip: Rect) -> Vec<Cell> {
        let rects: Vec<Rect> = self.0.iter().map(|moving| moving.rect).collect();
        let in_several_slices: Vec<Rect> =
            self.0.iter().flat_map(|moving| &moving.in_several_slices).copied().collect();
        cells(&rects, &in_several_slices, strip)
    }
}

/// The cells of a strip over which the rectangles of moving members extend; none if no two of them overlap there, and none is in several slices.
///
/// Which members move in a pixel, and so its bits, must not depend on the strip or the crop.
fn cells(moving: &[Rect], in_several_slices: &[Rect], strip: Rect) -> Vec<Cell> {
    let moving: Vec<(usize, Rect)> =
        moving.iter().map(|rect| rect.intersection(&strip)).enumerate().filter(|(_, rect)| !rect.is_empty()).collect();
    let overlap = moving
        .iter()
        .enumerate()
        .any(|(index, (_, rect))| moving[..index].iter().any(|(_, other)| !rect.intersection(other).is_empty()));
    let in_several: Vec<Rect> =
        in_several_slices.iter().map(|rect| rect.intersection(&strip)).filter(|rect| !rect.is_empty()).collect();
    if !overlap && in_several.is_empty() {
        return Vec::new();
    }
    // In a cell between two neighboring edges, both ways, the same members move everywhere.
    let (mut rows, mut columns) = (vec![strip.y, strip.bottom()], vec![strip.x, strip.right()]);
    for rect in moving.iter().map(|(_, rect)| rect).chain(&in_several) {
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
            if inside.len() < 2 && !in_several.iter().any(|several| !several.intersection(&rect).is_empty()) {
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
        assert_eq!(cells(&[rect(0, 0, 100, 100)], &[], strip), [], "one moves");
        assert_eq!(
            cells(&[rect(0, 0, 50, 50), rect(50, 0, 50, 50), rect(0, 20, 100, 9)], &[], strip),
            [],
            "side by side"
        );
        let cell = |rect, moving: &[usize]| Cell { rect, moving: moving.to_vec() };
        assert_eq!(
            cells(&[rect(0, 0, 100, 100), rect(10, 12, 20, 40), rect(20, 10, 80, 2)], &[], strip),
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
    fn a_single_member_is_cut_where_it_is_in_several_slices() {
        let strip = rect(0, 8, 100, 8);
        let cell = |rect, moving: &[usize]| Cell { rect, moving: moving.to_vec() };
        assert_eq!(
            cells(&[rect(0, 0, 100, 100)], &[rect(0, 12, 100, 2)], strip),
            [cell(rect(0, 8, 100, 4), &[]), cell(rect(0, 12, 100, 2), &[0]), cell(rect(0, 14, 100, 2), &[])]
        );
        assert_eq!(cells(&[rect(0, 0, 100, 100)], &[rect(0, 30, 100, 2)], strip), [], "elsewhere");
    }

    #[test]
    fn cells_cover_a_strip_once_and_tiles_are_aligned_to_the_picture() {
        let strip = rect(30, 8, 500, 8);
        let moving = [rect(0, 0, 1000, 100), rect(40, 10, 300, 100), rect(200, 0, 400, 13)];
        let cells = cells(&moving, &[], strip);
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
