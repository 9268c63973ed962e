//! Tile binning: for each tile of the picture, the streaks that may touch it.

use bansho_base::phenomenon::strip::DepthInterval;

use super::rasterize::{
    PackedStreak, StreakSegment,
    tile::{TILE_COLUMNS, TILE_ROWS},
};
use crate::shutter_cameras::{PixelBounds, ShutterCameras};

/// For each tile of a picture, the indices of the streaks that may touch it, in drawing order; stored as in a
/// compressed sparse row matrix.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileBins {
    /// Tiles in a row of tiles.
    tile_columns: usize,
    starts: Vec<u32>,
    members: Vec<u32>,
}

/// The range of tiles that a streak may touch, in rows and columns of tiles: the first, and one past the last.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileRange {
    tile_rows: [u16; 2],
    tile_columns: [u16; 2],
}

impl TileRange {
    /// The range for a bounding box in a picture of `size` pixels, with tiles of `width` columns.
    #[inline(always)]
    pub(crate) fn new([columns, rows]: PixelBounds, size: [usize; 2], width: usize) -> Self {
        Self {
            tile_rows: touched_tiles(rows, size[1], TILE_ROWS),
            tile_columns: touched_tiles(columns, size[0], width),
        }
    }

    /// Visits the indices of all tiles in the range.
    #[inline(always)]
    fn for_each(&self, columns_per_row: usize, mut visit: impl FnMut(usize)) {
        for tile_row in self.tile_rows[0]..self.tile_rows[1] {
            for tile_column in self.tile_columns[0]..self.tile_columns[1] {
                visit(usize::from(tile_row) * columns_per_row + usize::from(tile_column));
            }
        }
    }
}

/// The tiles of `tile_size` pixels each, along `length` pixels, that the interval `[low, high]` touches.
#[inline(always)]
fn touched_tiles([low, high]: [f32; 2], length: usize, tile_size: usize) -> [u16; 2] {
    // NaN touches nothing. A picture without pixels has no tiles.
    if length == 0 || !(high >= 0.0 && low < length as f32) {
        return [0, 0];
    }
    let (last, scale) = (((length - 1) / tile_size) as f32, 1.0 / tile_size as f32);
    // Clamped before the cast, since bounds may be infinite; to `i32` first, to which every instruction set converts directly.
    let [first, last] = [(low * scale).clamp(0.0, last), (high * scale).clamp(0.0, last)];
    [first as i32 as u16, last as i32 as u16 + 1]
}

impl TileBins {
    /// Bins streaks by counting sort into the tiles of a picture of `size` pixels, with tiles of `width` columns.
    pub(crate) fn new(size: [usize; 2], width: usize, ranges: &[TileRange]) -> Self {
        let tile_columns = size[0].div_ceil(width);
        let count = size[1].div_ceil(TILE_ROWS) * tile_columns;
        // A counting sort, which is stable: the streaks of a tile stay in drawing order, nearest cells first.
        let mut starts = vec![0_u32; count + 1];
        ranges.iter().for_each(|range| range.for_each(tile_columns, |tile| starts[tile + 1] += 1));
        for tile in 0..count {
            starts[tile + 1] += starts[tile];
        }
        let mut members = vec![0; starts[count] as usize];
        let mut next = starts.clone();
        for (index, range) in ranges.iter().enumerate() {
            range.for_each(tile_columns, |tile| {
                members[next[tile] as usize] = index as u32;
                next[tile] += 1;
            });
        }
        Self { tile_columns, starts, members }
    }

    /// The streaks of a tile; none outside the picture.
    #[inline(always)]
    pub(crate) fn members(&self, tile_row: usize, tile_column: usize) -> &[u32] {
        let tile = tile_row * self.tile_columns + tile_column;
        match self.starts.get(tile..tile + 2) {
            Some(&[start, end]) if tile_column < self.tile_columns => &self.members[start as usize..end as usize],
            _ => &[],
        }
    }
}

/// Streaks in drawing order, binned into the tiles of the picture.
///
/// Chunks are binned independently, so that no thread waits for a global sort.
pub(crate) struct StreakChunk {
    streaks: Vec<PackedStreak>,
    bins: TileBins,
    /// The depths of all streaks.
    depths: DepthInterval,
    /// Number of drops that the streaks stand for.
    pub(crate) drop_count: f64,
    /// Number of cells with streaks in it.
    pub(crate) cell_count: usize,
}

/// A chunk under construction.
pub(crate) struct StreakChunkBuilder {
    /// Columns and rows of the picture.
    size: [usize; 2],
    /// Pixels after which a panorama repeats.
    period: Option<f32>,
    streaks: Vec<PackedStreak>,
    ranges: Vec<TileRange>,
    /// Number of drops that each of the next streaks stands for.
    drops_per_streak: f64,
    drop_count: f64,
    cell_count: usize,
}

impl StreakChunkBuilder {
    /// An empty chunk for the picture of some cameras.
    pub(crate) fn new(cameras: &ShutterCameras) -> Self {
        let (size, period) = (cameras.size(), cameras.period);
        Self {
            size,
            period,
            streaks: Vec::new(),
            ranges: Vec::new(),
            drops_per_streak: 1.0,
            drop_count: 0.0,
            cell_count: 0,
        }
    }

    /// Adds a streak with its bounding box.
    #[inline(always)]
    pub(crate) fn add(&mut self, segment: &StreakSegment, extent: PixelBounds) {
        if let Some(period) = self.period {
            return self.add_repetitions(segment, extent, period);
        }
        self.add_once(segment, extent);
    }

    #[inline(always)]
    fn add_once(&mut self, segment: &StreakSegment, extent: PixelBounds) {
        self.ranges.push(TileRange::new(extent, self.size, TILE_COLUMNS));
        self.streaks.push(PackedStreak::new(segment));
    }

    /// Adds a streak where a panorama shows it: one that crosses its seam, on both sides.
    fn add_repetitions(&mut self, segment: &StreakSegment, [columns, rows]: PixelBounds, period: f32) {
        for shift in [0.0, -period, period] {
            let columns = columns.map(|column| column + shift);
            if columns[1] > 0.0 && columns[0] < self.size[0] as f32 {
                let repeated = StreakSegment { center: [segment.center[0] + shift, segment.center[1]], ..*segment };
                self.add_once(&repeated, [columns, rows]);
            }
        }
    }

    /// Sets how many drops each streak stands for that is added to this cell.
    pub(crate) fn set_drops_per_streak(&mut self, drops: f64) {
        self.drops_per_streak = drops;
    }

    /// Adds a cell's streaks, and counts the cell if there are any.
    #[inline(always)]
    pub(crate) fn add_cell(&mut self, add: impl FnOnce(&mut Self)) {
        let before = self.streaks.len();
        self.drops_per_streak = 1.0;
        add(self);
        let added = self.streaks.len() - before;
        self.drop_count += added as f64 * self.drops_per_streak;
        self.cell_count += usize::from(added > 0);
    }

    /// Bins the streaks.
    pub(crate) fn build(self) -> StreakChunk {
        let depths = self.streaks.iter().map(|streak| f64::from(streak.depth()));
        let nothing = DepthInterval { near: f64::INFINITY, far: f64::NEG_INFINITY };
        let depths =
            depths.fold(nothing, |all, depth| DepthInterval { near: all.near.min(depth), far: all.far.max(depth) });
        StreakChunk {
            depths,
            bins: TileBins::new(self.size, TILE_COLUMNS, &self.ranges),
            streaks: self.streaks,
            drop_count: self.drop_count,
            cell_count: self.cell_count,
        }
    }
}

impl StreakChunk {
    /// Appends the streaks of a tile in a depth interval to `streaks`.
    ///
    /// They are far apart in memory: copying them in one go overlaps the cache misses, which would otherwise occur one
    /// by one while drawing.
    #[inline(always)]
    pub(crate) fn collect_tile(
        &self,
        tile_row: usize,
        tile_column: usize,
        slice: &DepthInterval,
        streaks: &mut Vec<PackedStreak>,
    ) {
        if self.depths.far < slice.near || self.depths.near >= slice.far {
            return;
        }
        let members = self.bins.members(tile_row, tile_column);
        streaks.reserve(members.len());
        for index in members {
            let streak = self.streaks[*index as usize];
            if slice.contains(f64::from(streak.depth())) {
                streaks.push(streak);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_come_in_their_order_to_every_band_and_stretch_that_they_touch() {
        let all = [0.0, 99.0];
        let rows = [[-5.0, 3.0], [7.5, 16.5], [30.0, 40.0], [-9.0, -1.0], [f32::NAN, 3.0], [0.0, 1e9]];
        let narrow = [[31.0, 33.0], [0.0, 3.0]];
        let extents = rows.into_iter().map(|rows| [all, rows]).chain([narrow]);
        let range: Vec<TileRange> = extents.map(|extent| TileRange::new(extent, [48, 21], 32)).collect();
        let tile_rows = TileBins::new([48, 21], 32, &range);
        assert_eq!(tile_rows.members(0, 0), [0, 1, 5, 6]);
        assert_eq!(tile_rows.members(0, 1), [0, 1, 5, 6]);
        assert_eq!([0, 1].map(|tile_column| tile_rows.members(1, tile_column)), [[1, 5]; 2]);
        assert_eq!([0, 1].map(|tile_column| tile_rows.members(2, tile_column)), [[1, 5]; 2]);
        assert!(tile_rows.members(3, 0).is_empty() && tile_rows.members(0, 2).is_empty());
        assert!(TileBins::default().members(0, 0).is_empty());
        let everywhere = TileRange::new([all, all], [32, 0], 32);
        assert!(TileBins::new([32, 0], 32, &[everywhere]).members(0, 0).is_empty());
        let in_one_row = TileRange::new([all, all], [32, 1], 32);
        assert_eq!(TileBins::new([32, 1], 32, &[in_one_row]).members(0, 0), [0]);
    }
}
