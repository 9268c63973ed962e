//! What a task draws: the frames of a chunk, or a tile of each, with everything else as the plan says.

use std::path::{Path, PathBuf};

use bansho::{
    Rect,
    job::{Job, JobError, JobObserver, PreparedJob},
    media::{files::naming::OutputPattern, format::OutputKind},
};

use super::{
    chunks::ChunkGrid,
    error::FarmError,
    plan::{FarmFolder, FarmPlan},
};

/// Snapshots at chunk starts only: this interval is never reached after the first frame.
pub(super) const NO_MORE_SNAPSHOTS: u64 = i64::MAX as u64;

/// The name of the frames of a job.
///
/// # Errors
/// It names a film or a contact sheet.
pub fn sequence_name(job: &Job) -> Result<PathBuf, FarmError> {
    let path = job.output_path();
    let kind = OutputPattern::parse(&path, 2).map_err(JobError::Naming)?.kind();
    if job.contact_sheet.is_some() || !matches!(kind, OutputKind::Png | OutputKind::Exr) {
        return Err(FarmError::NotASequence { path });
    }
    Ok(path)
}

/// Rectangle `tile` of `columns` x `rows` rectangles that cover a picture.
pub fn tile_rect(size: [usize; 2], [columns, rows]: [usize; 2], tile: usize) -> Rect {
    let (left, right) = part_of(size[0], columns, tile % columns);
    let (top, bottom) = part_of(size[1], rows, tile / columns);
    Rect { x: left, y: top, width: right - left, height: bottom - top }
}

/// The bounds of part `index` of a side of `length` pixels in `parts` parts, whose lengths differ by one pixel at most.
fn part_of(length: usize, parts: usize, index: usize) -> (usize, usize) {
    (length * index / parts, length * (index + 1) / parts)
}

/// The job that draws tile `tile` of the pictures of `job`, or all of them where there is only one tile.
///
/// # Errors
/// The tiles do not fit the scene.
pub fn tile_job(job: &Job, folder: &FarmFolder, tiles: [usize; 2], tile: usize) -> Result<Job, FarmError> {
    let path = sequence_name(job)?;
    if tiles == [1, 1] {
        return Ok(job.clone());
    }
    let scene = job.scene.parse()?;
    let size = job.size.unwrap_or(scene.picture.size.map(|side| side as usize));
    if job.metadata {
        return Err(FarmError::TilesWithMetadata);
    }
    if scene.picture.overscan > 0 {
        return Err(FarmError::TilesWithOverscan);
    }
    if tiles[0] > size[0] || tiles[1] > size[1] {
        return Err(FarmError::TilesWithoutPixels { tiles, size });
    }
    let out = folder.tile(tile).join(path.file_name().unwrap_or_default());
    Ok(Job { crop: Some(tile_rect(size, tiles, tile)), out: Some(out), ..job.clone() })
}

/// The job of task `index` of a plan. What exists and is complete is kept.
///
/// # Errors
/// There is no such task, the job cannot run, or the scene is not that of the plan.
pub fn chunk_job(job: &Job, folder: &FarmFolder, plan: &FarmPlan, index: usize) -> Result<PreparedJob, FarmError> {
    let (count, tiles) = (plan.task_count(), plan.tile_count());
    let (chunk, tile) = (index / tiles, index % tiles);
    let grid = plan.grid()?;
    let frames = grid.chunk(chunk).to_vec();
    if index >= count || frames.is_empty() {
        return Err(FarmError::NoSuchTask { index, count });
    }
    let job = Job {
        frames: Some(frames.clone()),
        resume: true,
        snapshots: plan.snapshots.then(|| folder.snapshots()),
        snapshot_every: plan.snapshots.then_some(NO_MORE_SNAPSHOTS),
        ..tile_job(job, folder, plan.tiles, tile)?
    };
    let prepared = job.prepare()?;
    if prepared.shot_digest(&frames) != plan.digests[chunk] {
        return Err(FarmError::SceneChanged);
    }
    Ok(prepared)
}

/// Leaves snapshots for the tasks of a plan at the beginning of every chunk, up to the one that is cut at frame `last`. Nothing is drawn, and what exists is
/// kept. Tells how many were written.
///
/// # Errors
/// The job cannot run, the scene is not that of the plan, or a snapshot cannot be written.
pub fn plan_snapshots(
    job: &Job,
    folder: &FarmFolder,
    plan: &FarmPlan,
    last: i64,
    observer: &dyn JobObserver,
) -> Result<usize, FarmError> {
    let grid = plan.grid()?;
    let chunk = (0..grid.count()).find(|chunk| grid.start(*chunk) == Some(last)).unwrap_or(0);
    let prepared = Job {
        frames: Some(grid.chunk(chunk).to_vec()),
        resume: false,
        snapshots: Some(folder.snapshots()),
        snapshot_every: Some(plan.chunk_frames),
        ..tile_job(job, folder, plan.tiles, 0)?
    };
    let prepared = prepared.prepare()?;
    if plan.digests.get(chunk) != Some(&prepared.shot_digest(grid.chunk(chunk))) {
        return Err(FarmError::SceneChanged);
    }
    Ok(prepared.write_snapshots(last, observer)?)
}

/// The last frame at which one of `chunks` begins without a snapshot in the folder `snapshots`; `None` where all have what they need.
pub fn last_missing_snapshot(
    snapshots: &Path,
    grid: &ChunkGrid,
    chunks: impl IntoIterator<Item = usize>,
) -> Option<i64> {
    grid.last_snapshot()?;
    let starts = chunks.into_iter().filter_map(|chunk| grid.start(chunk)).filter(|start| *start > grid.first_frame());
    starts.filter(|start| !snapshots.join(format!("state.{start}.bansho")).exists()).max()
}

/// Factor from the estimated to the requested memory.
const MEMORY_HEADROOM: f64 = 1.5;
/// Memory for what is not estimated, MiB.
const MEMORY_EXTRA_MIB: f64 = 256.0;

/// The memory to request of a batch system for what is estimated to take `bytes` at its peak, MiB.
pub(super) fn requested_memory_mib(bytes: f64) -> u64 {
    (bytes / f64::from(1 << 20) * MEMORY_HEADROOM + MEMORY_EXTRA_MIB).ceil() as u64
}

/// Checks that a path or an argument can stand in a script.
///
/// # Errors
/// It has a line break or another control character.
pub fn check_printable(text: &str) -> Result<(), FarmError> {
    if text.chars().any(char::is_control) {
        return Err(FarmError::ControlCharacters { path: text.to_owned() });
    }
    Ok(())
}

/// `path` as text for scripts.
///
/// # Errors
/// It is not Unicode, or has control characters.
pub fn script_path(path: &Path) -> Result<String, FarmError> {
    let text = path.to_str().ok_or_else(|| FarmError::ControlCharacters { path: path.display().to_string() })?;
    check_printable(text)?;
    Ok(text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_pixel_once() {
        for (size, tiles) in [([7, 5], [2, 2]), ([64, 64], [3, 5]), ([4, 4], [4, 1]), ([9, 9], [1, 1])] {
            let mut covered = vec![0; size[0] * size[1]];
            for tile in 0..tiles[0] * tiles[1] {
                let Rect { x, y, width, height } = tile_rect(size, tiles, tile);
                assert!(width > 0 && height > 0);
                (y..y + height)
                    .for_each(|row| covered[row * size[0] + x..][..width].iter_mut().for_each(|times| *times += 1));
            }
            assert!(covered.iter().all(|&times| times == 1), "{size:?} {tiles:?}");
        }
    }
}
