//! Cuts the frames of a shot into chunks, one task of a batch system each.

use super::{costs::ShotCosts, error::FarmError};

/// Frames cut at every multiple of a fixed number, counted from the first frame of the scene. Which chunk a frame is in does not depend on which frames
/// exist already, so that chunks keep their numbers when the rest is submitted again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChunkGrid {
    first_frame: i64,
    chunk_frames: u64,
    frames: Vec<i64>,
}

impl ChunkGrid {
    /// The chunks of `chunk_frames` frames of a scene that begins at `first_frame`. Only `frames`, which are ascending, are drawn.
    pub fn new(first_frame: i64, chunk_frames: u64, frames: Vec<i64>) -> Self {
        Self { first_frame, chunk_frames: chunk_frames.max(1), frames }
    }

    /// The length of a chunk. One longer than any shot is the whole shot.
    fn length(&self) -> i64 {
        i64::try_from(self.chunk_frames).unwrap_or(i64::MAX)
    }

    /// Which multiple of the length `frame` is in, counted from the first frame of the scene; frames before it have negative numbers.
    fn block(&self, frame: i64) -> i64 {
        frame.saturating_sub(self.first_frame).div_euclid(self.length())
    }

    /// Number of chunks, those without any frame included.
    pub fn count(&self) -> usize {
        match (self.frames.first(), self.frames.last()) {
            (Some(&first), Some(&last)) => (self.block(last) - self.block(first) + 1) as usize,
            _ => 0,
        }
    }

    /// The frames of chunk `index`.
    pub fn chunk(&self, index: usize) -> &[i64] {
        let Some(&first) = self.frames.first() else { return &[] };
        let block = self.block(first).saturating_add(i64::try_from(index).unwrap_or(i64::MAX));
        let begin = self.frames.partition_point(|&frame| self.block(frame) < block);
        let end = self.frames.partition_point(|&frame| self.block(frame) <= block);
        &self.frames[begin..end]
    }

    /// The frame at which chunk `index` is cut, whether it is drawn or not.
    pub fn start(&self, index: usize) -> Option<i64> {
        let frame = self.chunk(index).first()?;
        Some(self.first_frame.saturating_add(self.block(*frame).saturating_mul(self.length())))
    }

    /// All frames.
    pub fn frames(&self) -> &[i64] {
        &self.frames
    }

    /// The first frame of the scene.
    pub fn first_frame(&self) -> i64 {
        self.first_frame
    }

    /// The frame at which the last snapshot is that a chunk begins with: the first frame of the last chunk. `None` where no chunk needs one: two chunks
    /// are ready as early without snapshots, for as much work, since the second one steps through the first while that is drawn.
    pub fn last_snapshot(&self) -> Option<i64> {
        let last = self.frames.last()?;
        (self.block(*last) >= 2).then(|| self.chunk(self.count() - 1)[0])
    }

    /// Number of snapshots that the chunks begin with.
    pub fn snapshot_count(&self) -> u64 {
        self.frames.last().map_or(0, |last| self.block(*last).max(0) as u64 + 1)
    }
}

/// How a shot is to be cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChunkRequest {
    /// Wanted length of a task, s.
    pub task_s: f64,
    /// Tasks for each chunk: one for each tile of the picture.
    pub tiles: usize,
    /// Largest number of tasks.
    pub max_tasks: usize,
}

/// The number of frames of a chunk, so that a task takes about as long as wanted and there are not too many tasks.
///
/// # Errors
/// There are more tiles than tasks may be.
pub fn chunk_frames(frames: &[i64], costs: &ShotCosts, request: &ChunkRequest) -> Result<u64, FarmError> {
    let max_chunks = max_chunks(request)?;
    let (first, last) = (frames.first().copied().unwrap_or(0), frames.last().copied().unwrap_or(0));
    let span = last.abs_diff(first) + 1;
    // Frames of every tenth number are apart by ten.
    let spacing = span as f64 / frames.len().max(1) as f64;
    let wanted = (request.task_s - costs.startup_s).max(0.0) / costs.frame_s().max(1e-6) * spacing;
    Ok((wanted as u64).clamp(1, span.max(1)).max(least_chunk_frames(span, max_chunks)))
}

/// The shortest chunk by which a shot of `span` frames is cut into up to `max_chunks`. Chunks are cut at multiples from the first frame of the scene, so that
/// both ends of the shot may be parts of a chunk: one more may be needed than the span has.
fn least_chunk_frames(span: u64, max_chunks: u64) -> u64 {
    if max_chunks == 1 { span } else { span.div_ceil(max_chunks - 1) }
}

/// The number of chunks of which each may be as many tasks as there are tiles.
fn max_chunks(request: &ChunkRequest) -> Result<u64, FarmError> {
    let (tiles, max) = (request.tiles, request.max_tasks);
    if tiles > max { Err(FarmError::TooManyTiles { tiles, max }) } else { Ok((max / tiles.max(1)) as u64) }
}

/// Checks that there are not more tasks than the batch system takes in one array.
///
/// # Errors
/// There are more. The error says how long chunks must be.
pub fn check_task_count(grid: &ChunkGrid, request: &ChunkRequest) -> Result<(), FarmError> {
    let max_chunks = max_chunks(request)?;
    let tasks = grid.count() * request.tiles;
    if tasks <= request.max_tasks {
        return Ok(());
    }
    let frames = grid.frames();
    let span = frames[frames.len() - 1].abs_diff(frames[0]) + 1;
    let least_chunk = least_chunk_frames(span, max_chunks);
    Err(FarmError::TooManyTasks { tasks, max: request.max_tasks, least_chunk })
}

#[cfg(test)]
mod tests {
    use super::*;

    const REQUEST: ChunkRequest = ChunkRequest { task_s: 600.0, tiles: 1, max_tasks: 1001 };

    fn costs(step_s: f64, draw_s: f64) -> ShotCosts {
        ShotCosts { startup_s: 10.0, step_s, draw_s, ..ShotCosts::default() }
    }

    #[test]
    fn chunks_begin_at_multiples_from_the_first_frame_of_the_scene() {
        let grid = ChunkGrid::new(1001, 10, (1013..=1034).collect());
        assert_eq!(grid.count(), 3);
        assert_eq!(grid.chunk(0), (1013..=1020).collect::<Vec<_>>());
        assert_eq!(grid.chunk(1), (1021..=1030).collect::<Vec<_>>());
        assert_eq!(grid.chunk(2), [1031, 1032, 1033, 1034]);
        assert!(grid.chunk(3).is_empty() && grid.chunk(usize::MAX).is_empty());
        assert_eq!([0, 1, 3].map(|index| grid.start(index)), [Some(1011), Some(1021), None]);
        assert_eq!(ChunkGrid::new(0, 5, vec![-3, 7]).chunk(0), [-3]);
        assert_eq!(ChunkGrid::new(0, 5, vec![-3, 7]).count(), 3);
        assert_eq!(ChunkGrid::new(0, 5, Vec::new()).count(), 0);
    }

    #[test]
    fn every_frame_is_in_one_chunk() {
        for (chunk, frames) in [(1, (0..50).collect()), (7, (-20..31).step_by(3).collect::<Vec<i64>>())] {
            let grid = ChunkGrid::new(-20, chunk, frames.clone());
            let all: Vec<i64> = (0..grid.count()).flat_map(|index| grid.chunk(index).to_vec()).collect();
            assert_eq!(all, frames);
        }
    }

    #[test]
    fn a_task_takes_as_long_as_wanted() {
        let frames: Vec<i64> = (0..10_000).collect();
        // (600 s - 10 s) / 5 s
        assert_eq!(chunk_frames(&frames, &costs(2.0, 3.0), &REQUEST).unwrap(), 118);
        assert_eq!(
            chunk_frames(&frames, &costs(0.0, 900.0), &REQUEST).unwrap(),
            10,
            "one frame takes longer, and 1001 are allowed"
        );
        assert_eq!(chunk_frames(&frames[..20], &costs(0.0, 900.0), &REQUEST).unwrap(), 1);
        assert_eq!(chunk_frames(&frames[..20], &costs(0.0, 0.01), &REQUEST).unwrap(), 20);
        let tenth: Vec<i64> = (0..10_000).step_by(10).collect();
        assert_eq!(chunk_frames(&tenth, &costs(0.0, 5.0), &REQUEST).unwrap(), (118.0 * 9991.0 / 1000.0) as u64);
    }

    #[test]
    fn there_are_never_more_tasks_than_allowed() {
        for (count, tiles, max_tasks) in [(108_000, 1, 1001), (108_000, 4, 1001), (1003, 1, 1001), (5, 4, 4), (5, 1, 2)]
        {
            let frames: Vec<i64> = (3..3 + count).collect();
            let request = ChunkRequest { task_s: 1.0, tiles, max_tasks };
            let chunk = chunk_frames(&frames, &costs(0.0, 5.0), &request).unwrap();
            for first_frame in [0, 1, 2, 3] {
                let grid = ChunkGrid::new(first_frame, chunk, frames.clone());
                assert!(
                    max_tasks < 2 * tiles || grid.count() * tiles <= max_tasks,
                    "{count} {tiles}: {}",
                    grid.count()
                );
            }
        }
        let request = ChunkRequest { task_s: 1.0, tiles: 16, max_tasks: 4 };
        assert!(matches!(chunk_frames(&[0], &costs(0.0, 1.0), &request), Err(FarmError::TooManyTiles { .. })));
    }

    #[test]
    fn too_short_chunks_are_refused_with_the_shortest_that_are_not() {
        let grid = ChunkGrid::new(0, 10, (0..20_000).collect());
        let Err(FarmError::TooManyTasks { tasks: 2000, max: 1001, least_chunk }) = check_task_count(&grid, &REQUEST)
        else {
            panic!("2000 tasks are too many");
        };
        assert_eq!(least_chunk, 20);
        check_task_count(&ChunkGrid::new(0, least_chunk, (0..20_000).collect()), &REQUEST).unwrap();
    }

    #[test]
    fn snapshots_are_for_three_chunks_and_more() {
        let grid = |count: i64| ChunkGrid::new(0, 10, (0..count).collect());
        assert_eq!([10, 20, 21, 45].map(|count| grid(count).last_snapshot()), [None, None, Some(20), Some(40)]);
        assert_eq!(grid(45).snapshot_count(), 5);
        // Also where only the end of a shot is drawn.
        assert_eq!(ChunkGrid::new(0, 10, (40..45).collect()).last_snapshot(), Some(40));
    }
}
