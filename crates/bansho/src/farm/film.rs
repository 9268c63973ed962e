//! What is made when all frames are whole: a film and a contact sheet from their files, and a flipbook.

use std::path::{Path, PathBuf};

use bansho_base::{
    frame::{DisplayImage, Frame},
    host::observer::{self, Observer},
    image::Rect,
};
use bansho_media::{
    files::{atomic, naming::OutputPattern},
    format::{OutputKind, PictureFormat},
    imageops::{flatten::over_black, label, sprite_sheet::SheetLayout},
    output::{
        frame_file::{self, FrameFileError, LinearPixels},
        sink::{FinishedPicture, FrameSlot},
    },
    png::{self, PngEffort},
};

use super::{error::FarmError, plan::shot_stem, products::Products};
use crate::job::{
    FlipbookSummary, Job, JobError, JobObserver, PreparedFlipbook, PreparedJob,
    render::{contact_sheet, prepare},
    sheet::nearly_square_layout,
};

/// Checks that `products` can be made of `job`, with relative paths in `folder`; the flipbook, ready to run.
///
/// # Errors
/// The name of the film is not that of a film, the contact sheet would be too large, or the flipbook is not possible.
pub fn check(products: &Products, job: &Job, folder: &Path) -> Result<Option<PreparedFlipbook>, FarmError> {
    if let Some(film) = &products.film {
        let kind = check_name(film)?.kind();
        prepare::check_view(job.view, kind, film).map_err(JobError::from)?;
    }
    if let Some(count) = products.contact_sheet {
        sheet_layout(&job.prepare()?, count)?;
    }
    prepared_flipbook(products, job, folder)
}

fn prepared_flipbook(products: &Products, job: &Job, folder: &Path) -> Result<Option<PreparedFlipbook>, FarmError> {
    Ok(products.flipbook.as_ref().map(|request| request.flipbook(job, folder).prepare()).transpose()?)
}

/// All files of `products` of `job`.
///
/// # Errors
/// The name of the flipbook is not possible.
pub fn paths(products: &Products, job: &Job, folder: &Path) -> Result<Vec<PathBuf>, FarmError> {
    let sheet = products.contact_sheet.map(|_| contact_sheet_path(&job.output_path()));
    let of_frames = [products.film.clone(), sheet].into_iter().flatten();
    let mut paths: Vec<PathBuf> = of_frames.map(|path| folder.join(path)).collect();
    if let Some(request) = &products.flipbook {
        paths.extend(request.flipbook(job, folder).paths()?);
    }
    Ok(paths)
}

/// Makes `products` of the finished frames `whole` of `job`. Tells what the flipbook consists of.
///
/// # Errors
/// A frame cannot be read, or a file cannot be written.
pub fn make(
    products: &Products,
    whole: &PreparedJob,
    job: &Job,
    folder: &Path,
    observer: &dyn JobObserver,
) -> Result<Option<FlipbookSummary>, FarmError> {
    // Before the film, which may take long.
    let flipbook = prepared_flipbook(products, job, folder)?;
    if let Some(film) = &products.film {
        make_film(whole, &folder.join(film), observer)?;
    }
    if let Some(count) = products.contact_sheet {
        make_contact_sheet(whole, count, observer)?;
    }
    Ok(flipbook.map(|flipbook| flipbook.run(observer)).transpose()?)
}

/// The contact sheet of the frames at `output`: `shot/fire.sheet.png` of `shot/fire.####.exr`.
pub fn contact_sheet_path(output: &Path) -> PathBuf {
    output.with_file_name(format!("{}.sheet.png", shot_stem(output)))
}

/// The layout of a contact sheet of up to `count` frames.
fn sheet_layout(whole: &PreparedJob, count: usize) -> Result<SheetLayout, FarmError> {
    let (window, count) = (whole.plan().window(), count.min(whole.frames().len()));
    let layout = nearly_square_layout(count, [window.width, window.height], contact_sheet::GUTTER);
    Ok(layout.map_err(JobError::from)?)
}

/// Makes a contact sheet of `count` finished frames that are spread over the shot, over black, with their numbers.
///
/// # Errors
/// The sheet would be too large, a frame cannot be read, or the sheet cannot be written.
pub fn make_contact_sheet(whole: &PreparedJob, count: usize, observer: &dyn Observer) -> Result<(), FarmError> {
    let (frames, layout) = (whole.frames(), sheet_layout(whole, count)?);
    let count = layout.count;
    let mut tiles = Vec::with_capacity(count);
    for index in 0..count {
        observer::check(observer).map_err(|_| JobError::SingleFileCancelled { output: "a sheet" })?;
        let number = frames[index * (frames.len() - 1) / (count - 1).max(1)];
        let mut tile = over_black(&display_picture(whole, number, PictureFormat::OpaqueDisplay, observer)?);
        label::draw_number(&mut tile, number);
        tiles.push(tile);
    }
    let sheet = contact_sheet::compose(&tiles, &layout).map_err(JobError::from)?;
    let output = whole.output();
    let path = output.path(whole.frames()[0]).with_file_name(format!("{}.sheet.png", output.stem()));
    let bytes = png::encode(&sheet, &[0; 32], PngEffort::Fast, &path)?;
    Ok(atomic::write_bytes(&path, &bytes, &whole.format.overwrite)?)
}

/// Checks that `path` is the name of a film.
///
/// # Errors
/// It names pictures.
pub fn check_name(path: &Path) -> Result<OutputPattern, FarmError> {
    let pattern = OutputPattern::parse(path, 1).map_err(JobError::Naming)?;
    if pattern.kind().is_sequence() {
        return Err(FarmError::NotAFilm { path: path.to_path_buf() });
    }
    Ok(pattern)
}

/// Makes a film of finished frames.
///
/// # Errors
/// The name is not that of a film, a frame cannot be read, or the film cannot be written.
pub fn make_film(whole: &PreparedJob, path: &Path, observer: &dyn Observer) -> Result<(), FarmError> {
    let mut format = whole.format.clone();
    format.pattern = check_name(path)?;
    let window = whole.plan().window();
    let (opaque, size) = (whole.compiled.has_opaque_plate(), [window.width, window.height]);
    let sink = format.open(whole.plan(), opaque, whole.frames().len(), size, 1)?;
    for (index, &number) in whole.frames().iter().enumerate() {
        observer::check(observer).map_err(|_| JobError::SingleFileCancelled { output: "a film" })?;
        let slot = FrameSlot { index, number };
        let picture = display_picture(whole, number, sink.picture_format(), observer)?;
        sink.write(slot, FinishedPicture::Display(&picture, &[0; 32]))?;
    }
    Ok(sink.finish()?)
}

/// The display pixels of a finished frame.
fn display_picture(
    whole: &PreparedJob,
    number: i64,
    picture_format: PictureFormat,
    observer: &dyn Observer,
) -> Result<DisplayImage, FarmError> {
    let path = whole.format.pattern.path(number);
    if whole.format.pattern.kind() == OutputKind::Png {
        return frame_file::read_png(&path).map_err(unreadable(&path));
    }
    let LinearPixels { beauty, .. } = frame_file::read_exr(&path).map_err(unreadable(&path))?;
    let header = whole.plan().header(number, whole.expected_fingerprint(number));
    let content = Rect::from_size(beauty.width(), beauty.height());
    let opaque = picture_format == PictureFormat::OpaqueDisplay || whole.compiled.has_opaque_plate();
    let frame = Frame { header, beauty, depth: None, channels: Vec::new(), opaque, metadata: Vec::new(), content };
    Ok(whole.format.to_display(&frame, observer))
}

pub(super) fn unreadable(path: &Path) -> impl Fn(FrameFileError) -> FarmError + '_ {
    move |source| FarmError::FrameFile { path: path.to_path_buf(), source }
}
