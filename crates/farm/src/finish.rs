//! The last job of a shot: checks that every frame is whole, joins tiles, and makes what is asked for.

use std::path::{Path, PathBuf};

use bansho::{
    Frame, Image, Observer, Rect,
    base::{
        frame::{DisplayImage, DisplayPixels},
        host::observer::check,
    },
    job::{FlipbookSummary, FrameState, Job, JobError, JobObserver, PreparedJob, frames},
    media::{
        files::naming::OutputPattern,
        format::OutputKind,
        output::{
            frame_file::{self, FrameFileError, LinearPixels},
            sink::{FinishedPicture, FrameSlot},
        },
    },
};
use rayon::prelude::*;

use super::{
    error::FarmError,
    plan::{FarmFolder, FarmPlan},
    products::{Products, unreadable},
    task::{tile_job, tile_rect},
};

/// Finishes the shot of a plan. Tells what the flipbook consists of.
///
/// # Errors
/// Frames are missing or incomplete, the scene has changed, or a product cannot be written.
pub fn finish(
    job: &Job,
    folder: &FarmFolder,
    plan: &FarmPlan,
    observer: &dyn JobObserver,
) -> Result<Option<FlipbookSummary>, FarmError> {
    let job = Job { frames: Some(plan.grid()?.frames().to_vec()), ..job.clone() };
    finish_frames(&job, folder, plan.tiles, observer)?.products(&plan.products, &plan.folder, observer)
}

/// A shot whose frames are whole.
pub struct FinishedFrames {
    job: Job,
    whole: PreparedJob,
}

impl FinishedFrames {
    /// Makes `products`, whose relative paths are those of `current`. Tells what the flipbook consists of.
    ///
    /// # Errors
    /// A frame cannot be read, or a file cannot be written.
    pub fn products(
        &self,
        products: &Products,
        current: &Path,
        observer: &dyn JobObserver,
    ) -> Result<Option<FlipbookSummary>, FarmError> {
        products.make(&self.whole, &self.job, current, observer)
    }
}

/// Checks that all frames of `job` are whole. Where they are drawn as tiles, these must be, and are joined.
///
/// # Errors
/// Frames are missing or incomplete, or a joined one cannot be written.
pub fn finish_frames(
    job: &Job,
    folder: &FarmFolder,
    tiles: [usize; 2],
    observer: &dyn Observer,
) -> Result<FinishedFrames, FarmError> {
    let whole = Job { resume: true, ..job.clone() }.prepare()?;
    let missing = if tiles == [1, 1] { unfinished(&whole) } else { unfinished_tiles(job, folder, tiles)? };
    if !missing.is_empty() {
        return Err(FarmError::Incomplete { frames: frames::format_ranges(&missing), files: job.output_path() });
    }
    if tiles != [1, 1] {
        join(&whole, job, folder, tiles, observer)?;
    }
    Ok(FinishedFrames { job: job.clone(), whole })
}

/// The frames of a job that are not whole.
fn unfinished(job: &PreparedJob) -> Vec<i64> {
    let states = job.frame_states().into_iter();
    let unfinished = job.frames().iter().zip(states).filter(|(_, state)| *state != FrameState::Whole);
    unfinished.map(|(frame, _)| *frame).collect()
}

/// The frames of which a tile is not whole.
fn unfinished_tiles(job: &Job, folder: &FarmFolder, tiles: [usize; 2]) -> Result<Vec<i64>, FarmError> {
    let mut missing = Vec::new();
    for tile in 0..tiles[0] * tiles[1] {
        missing.extend(unfinished(&tile_job(job, folder, tiles, tile)?.prepare()?));
    }
    missing.sort_unstable();
    missing.dedup();
    Ok(missing)
}

/// Joins the tiles of all frames that are not joined yet.
fn join(
    whole: &PreparedJob,
    job: &Job,
    folder: &FarmFolder,
    tiles: [usize; 2],
    observer: &dyn Observer,
) -> Result<(), FarmError> {
    let mut patterns = Vec::new();
    for tile in 0..tiles[0] * tiles[1] {
        let path = tile_job(job, folder, tiles, tile)?.output_path();
        patterns.push(OutputPattern::parse(&path, whole.frames().len()).map_err(JobError::Naming)?);
    }
    for number in unfinished(whole) {
        check(observer).map_err(|_| JobError::Cancelled)?;
        let paths: Vec<PathBuf> = patterns.iter().map(|pattern| pattern.path(number)).collect();
        join_frame(whole, number, tiles, &paths)?;
    }
    Ok(())
}

/// Joins the tiles of one frame to the bytes of the whole picture.
fn join_frame(whole: &PreparedJob, number: i64, tiles: [usize; 2], paths: &[PathBuf]) -> Result<(), FarmError> {
    let size = whole.plan().size();
    let rects: Vec<Rect> = (0..paths.len()).map(|tile| tile_rect(size, tiles, tile)).collect();
    let sink = whole.open_sink(whole.output().clone(), 1, size)?;
    let slot = FrameSlot { index: 0, number };
    let fingerprint = whole.expected_fingerprint(number);
    let written = match whole.output().kind() {
        OutputKind::Exr => {
            let parts = read_tiles(paths, frame_file::read_exr)?;
            let frame = join_linear(whole, number, fingerprint, &rects, parts);
            sink.write(slot, FinishedPicture::Linear(&frame))
        }
        _ => {
            let parts = read_tiles(paths, frame_file::read_png)?;
            sink.write(slot, FinishedPicture::Display(&join_display(size, &rects, parts), &fingerprint))
        }
    };
    written.map_err(|error| JobError::from(error).in_frame(number))?;
    Ok(sink.finish()?)
}

/// The tiles of one frame, in the order of `paths`.
fn read_tiles<T: Send>(
    paths: &[PathBuf],
    read: impl Fn(&Path) -> Result<T, FrameFileError> + Sync,
) -> Result<Vec<T>, FarmError> {
    paths.par_iter().map(|path| read(path).map_err(unreadable(path))).collect()
}

/// Copies the values of a rectangle into a picture of `width` columns.
fn paste<T: Copy>(whole: &mut [T], width: usize, rect: Rect, part: &[T]) {
    for (row, values) in part.chunks(rect.width.max(1)).enumerate().take(rect.height) {
        let begin = (rect.y + row) * width + rect.x;
        whole[begin..begin + values.len()].copy_from_slice(values);
    }
}

/// Joins display pixels of 8 or of 16 bits: all tiles of a picture have the same depth.
fn join_display(size: [usize; 2], rects: &[Rect], parts: Vec<DisplayImage>) -> DisplayImage {
    let [width, height] = size;
    let (opaque, alpha) = parts.first().map_or((true, Default::default()), |part| (part.opaque, part.alpha));
    let encoding = parts.first().map(|part| part.encoding).unwrap_or_default();
    let is_sixteen = parts.iter().any(|part| matches!(part.pixels, DisplayPixels::Sixteen(_)));
    let (mut eight, mut sixteen) = (Vec::new(), Vec::new());
    if is_sixteen {
        sixteen.resize(width * height, [0; 4]);
    } else {
        eight.resize(width * height, [0; 4]);
    }
    for (part, &rect) in parts.iter().zip(rects) {
        match &part.pixels {
            DisplayPixels::Eight(pixels) if !is_sixteen => paste(&mut eight, width, rect, pixels),
            DisplayPixels::Sixteen(pixels) => paste(&mut sixteen, width, rect, pixels),
            DisplayPixels::Eight(_) => {}
        }
    }
    let pixels = if is_sixteen { DisplayPixels::Sixteen(sixteen) } else { DisplayPixels::Eight(eight) };
    DisplayImage { width, height, opaque, alpha, encoding, pixels }
}

/// Joins scene-linear light with its depth and channels: all tiles of a picture have the same ones, in the same order.
fn join_linear(
    whole: &PreparedJob,
    number: i64,
    fingerprint: [u8; 32],
    rects: &[Rect],
    parts: Vec<LinearPixels>,
) -> Frame {
    let [width, height] = whole.plan().size();
    let mut beauty = Image::filled(width, height, [0.0; 4]);
    let first = parts.first().map(|part| (part.depth.is_some(), part.channels.clone()));
    let (has_depth, mut channels) = first.unwrap_or_default();
    let mut depth = has_depth.then(|| vec![f32::INFINITY; width * height]);
    channels.iter_mut().for_each(|channel| channel.values = vec![0.0; width * height]);
    for (part, &rect) in parts.iter().zip(rects) {
        paste(beauty.pixels_mut(), width, rect, part.beauty.pixels());
        if let (Some(depth), Some(values)) = (&mut depth, &part.depth) {
            paste(depth, width, rect, values);
        }
        for (channel, values) in channels.iter_mut().zip(&part.channels) {
            paste(&mut channel.values, width, rect, &values.values);
        }
    }
    let header = whole.plan().header(number, fingerprint);
    let content = Rect::from_size(width, height);
    Frame { header, beauty, depth, channels, opaque: false, metadata: Vec::new(), content }
}

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    use bansho::{
        Unobserved,
        job::{Flipbook, FlipbookCrop, OptionError, SceneFile},
    };

    use super::*;
    use crate::{chunks::ChunkGrid, plan::FarmPlanOptions, products::FlipbookRequest, task::chunk_job};

    const SCENE: &str = "bansho = 2\n[picture]\nsize = [53, 37]\nframes = 3\n[[flame_sheet]]\n";

    /// A job in `folder` and its plan with these tiles and chunks of two frames.
    fn shot(folder: &Path, name: &str, tiles: [usize; 2]) -> (Job, FarmFolder, FarmPlan) {
        let scene = SceneFile::read_stream("scene", SCENE.as_bytes()).unwrap();
        let out = folder.join(name);
        let farm = FarmFolder::beside(&out);
        let is_exr = name.ends_with("exr");
        let job = Job { out: Some(out), layers: is_exr, aovs: is_exr, ..Job::new(scene) };
        let prepared = job.prepare().unwrap();
        let grid = ChunkGrid::new(0, 2, prepared.frames().to_vec());
        let digests = (0..grid.count()).map(|chunk| prepared.shot_digest(grid.chunk(chunk))).collect();
        let options = FarmPlanOptions { folder: folder.to_path_buf(), tiles, ..FarmPlanOptions::default() };
        (job, farm, FarmPlan::new(options, &grid, 0, 2, digests))
    }

    #[test]
    fn joined_tiles_have_the_bytes_of_the_whole_picture() {
        for name in ["a.####.png", "a.####.exr"] {
            let (whole, tiled) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
            let (job, ..) = shot(whole.path(), name, [1, 1]);
            job.prepare().unwrap().run(&Unobserved).unwrap();
            let (job, farm, plan) = shot(tiled.path(), name, [3, 2]);
            for task in 0..plan.task_count() - 1 {
                chunk_job(&job, &farm, &plan, task).unwrap().run(&Unobserved).unwrap();
            }
            let refused = finish(&job, &farm, &plan, &Unobserved);
            assert!(matches!(refused, Err(FarmError::Incomplete { frames, .. }) if frames == "2"), "{name}");
            chunk_job(&job, &farm, &plan, plan.task_count() - 1).unwrap().run(&Unobserved).unwrap();
            finish(&job, &farm, &plan, &Unobserved).unwrap();
            for number in 0..3 {
                let file = name.replace("####", &format!("{number:04}"));
                let [expected, found] = [&whole, &tiled].map(|folder| fs::read(folder.path().join(&file)).unwrap());
                assert!(expected == found, "{file}");
            }
        }
    }

    #[test]
    fn a_contact_sheet_is_made_of_finished_frames() {
        for name in ["a.####.png", "a.####.exr"] {
            let folder = tempfile::tempdir().unwrap();
            let (job, farm, plan) = shot(folder.path(), name, [1, 1]);
            job.prepare().unwrap().run(&Unobserved).unwrap();
            let products = Products { contact_sheet: Some(9), ..Products::default() };
            finish(&job, &farm, &FarmPlan { products, ..plan }, &Unobserved).unwrap();
            let sheet = frame_file::read_png(&folder.path().join("a.sheet.png")).unwrap();
            // Three frames: two columns and two rows.
            assert_eq!((sheet.width, sheet.height, sheet.opaque), (2 * 53 + 2, 2 * 37 + 2, true), "{name}");
            let DisplayPixels::Eight(pixels) = sheet.pixels else { panic!("8 bits") };
            assert!(pixels.iter().any(|pixel| pixel[0] > 150 && pixel[2] < pixel[0]), "{name}: a flame");
        }
    }

    #[test]
    fn the_film_of_finished_frames_is_that_of_a_render() {
        let folder = tempfile::tempdir().unwrap();
        let (job, farm, plan) = shot(folder.path(), "a.####.png", [1, 1]);
        job.prepare().unwrap().run(&Unobserved).unwrap();
        let with_film = |name: &str| Products { film: Some(name.into()), ..Products::default() };
        let plan = FarmPlan { products: with_film("a.apng"), ..plan };
        finish(&job, &farm, &plan, &Unobserved).unwrap();
        let direct = Job { out: Some(folder.path().join("b.apng")), ..job.clone() };
        direct.prepare().unwrap().run(&Unobserved).unwrap();
        let [film, direct] = ["a.apng", "b.apng"].map(|name| fs::read(folder.path().join(name)).unwrap());
        assert!(film == direct);
        let sequence = FarmPlan { products: with_film("c.####.png"), ..plan };
        assert!(matches!(finish(&job, &farm, &sequence, &Unobserved), Err(FarmError::NotAFilm { .. })));
    }

    #[test]
    fn the_flipbook_of_the_last_job_is_that_of_the_command() {
        for (name, tile) in [("flip.png", None), ("flip.exr", Some([24, 16]))] {
            let folder = tempfile::tempdir().unwrap();
            let (job, farm, plan) = shot(folder.path(), "a.####.png", [1, 1]);
            let job = Job { frames: Some(vec![1, 2]), seed: Some(3), loop_s: Some(0.5), ..job };
            job.prepare().unwrap().run(&Unobserved).unwrap();
            let flipbook = Some(FlipbookRequest { path: name.into(), grid: [2, 2], tile });
            let products = Products { flipbook, ..Products::default() };
            assert_eq!(products.flipbook.as_ref().unwrap().frame_count(), 4);
            let finished = finish_frames(&job, &farm, plan.tiles, &Unobserved).unwrap();
            let summary = finished.products(&products, folder.path(), &Unobserved).unwrap().unwrap();
            assert_eq!(summary.files, products.paths(&job, folder.path()).unwrap());
            let alone = tempfile::tempdir().unwrap();
            let crop = if tile.is_some() { FlipbookCrop::None } else { FlipbookCrop::Auto };
            let out = Some(alone.path().join(name));
            let options = Flipbook {
                tile,
                crop,
                out,
                first_frame: Some(1),
                seed: Some(3),
                ..Flipbook::new(job.scene.clone(), [2, 2])
            };
            let options = Flipbook { loop_s: Some(0.5), ..options };
            let expected = options.prepare().unwrap().run(&Unobserved).unwrap();
            assert_eq!(expected.files.len(), summary.files.len());
            for (found, expected) in summary.files.iter().zip(&expected.files) {
                assert!(fs::read(found).unwrap() == fs::read(expected).unwrap(), "{}", found.display());
            }
        }
    }

    #[test]
    fn a_flipbook_that_is_not_possible_is_refused_before_the_film_is_made() {
        let folder = tempfile::tempdir().unwrap();
        let (job, farm, plan) = shot(folder.path(), "a.####.png", [1, 1]);
        job.prepare().unwrap().run(&Unobserved).unwrap();
        let flipbook = Some(FlipbookRequest { path: "flip.gif".into(), grid: [2, 2], tile: None });
        let products = Products { film: Some("a.apng".into()), contact_sheet: None, flipbook };
        let refused = finish(&job, &farm, &FarmPlan { products, ..plan }, &Unobserved);
        assert!(matches!(refused, Err(FarmError::Job(JobError::Option(OptionError::SheetFormat { .. })))));
        assert!(!folder.path().join("a.apng").exists());
    }
}
