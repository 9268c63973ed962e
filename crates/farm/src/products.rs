//! What is made when all frames are whole: a film and a contact sheet from their files, and a flipbook.

use std::path::{Path, PathBuf};

use bansho::{
    Frame, Observer, Rect,
    base::{frame::DisplayImage, host::observer},
    job::{
        Flipbook, FlipbookCrop, FlipbookSummary, Job, JobError, JobObserver, PreparedFlipbook, PreparedJob, check_view,
        compose_contact_sheet,
    },
    media::{
        files::{atomic, naming::OutputPattern},
        format::{OutputKind, PictureFormat},
        imageops::{flatten::over_black, label},
        output::{
            frame_file::{self, FrameFileError, LinearPixels},
            sink::{FinishedPicture, FrameSlot},
        },
        png::{self, PngEffort},
    },
};
use serde::{Deserialize, Serialize};

use super::error::FarmError;

/// What is made at the end. Relative paths are those of the current folder of whoever asked for it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Products {
    /// The film of the frames.
    pub film: Option<PathBuf>,
    /// Number of frames of the contact sheet.
    pub contact_sheet: Option<usize>,
    /// The flipbook.
    pub flipbook: Option<FlipbookRequest>,
}

/// The flipbook of a shot.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlipbookRequest {
    /// `DIR/NAME.png` or `DIR/NAME.exr` for `NAME_color.png` and so on.
    pub path: PathBuf,
    /// Columns and rows of the sheet.
    pub grid: [usize; 2],
    /// Size of the whole picture in a cell, pixels; `None` crops the pictures to what is lit, and chooses their size.
    pub tile: Option<[usize; 2]>,
}

impl FlipbookRequest {
    /// The flipbook of the shot of `job`, from its first frame on, at a path relative to `folder`.
    ///
    /// It draws its frames itself. Those of the shot have another size, and no room for what is lit to be cropped and enlarged; in a loop they have another
    /// rate; and they lack the lights, and mostly the motion, that a flipbook has beside its pictures.
    pub fn flipbook(&self, job: &Job, folder: &Path) -> Flipbook {
        Flipbook {
            tile: self.tile,
            crop: if self.tile.is_some() { FlipbookCrop::None } else { FlipbookCrop::Auto },
            first_frame: job.frames.as_deref().and_then(|frames| frames.iter().min()).copied(),
            seed: job.seed,
            loop_s: job.loop_s,
            view: job.view,
            bits: job.bits,
            alpha: job.alpha,
            out: Some(folder.join(&self.path)),
            overwrite: job.overwrite,
            ..Flipbook::new(job.scene.clone(), self.grid)
        }
    }

    /// Number of its frames.
    pub fn frame_count(&self) -> usize {
        self.grid[0].saturating_mul(self.grid[1])
    }
}

impl Products {
    /// Checks that all this can be made of `job`, with relative paths in `folder`; the flipbook, ready to run.
    ///
    /// # Errors
    /// The name of the film is not that of a film, the contact sheet would be too large, or the flipbook is not possible.
    pub fn check(&self, job: &Job, folder: &Path) -> Result<Option<PreparedFlipbook>, FarmError> {
        if let Some(film) = &self.film {
            let kind = film_pattern(film)?.kind();
            check_view(job.prepare()?.plan().display, kind, film).map_err(JobError::from)?;
        }
        if let Some(count) = self.contact_sheet {
            job.prepare()?.contact_sheet_layout(count)?;
        }
        self.prepared_flipbook(job, folder)
    }

    fn prepared_flipbook(&self, job: &Job, folder: &Path) -> Result<Option<PreparedFlipbook>, FarmError> {
        Ok(self.flipbook.as_ref().map(|request| request.flipbook(job, folder).prepare()).transpose()?)
    }

    /// All files that are made of `job`.
    ///
    /// # Errors
    /// The name of the flipbook is not possible.
    pub fn paths(&self, job: &Job, folder: &Path) -> Result<Vec<PathBuf>, FarmError> {
        let sheet = self.contact_sheet.map(|_| contact_sheet_path(&job.output_path()));
        let of_frames = [self.film.clone(), sheet].into_iter().flatten();
        let mut paths: Vec<PathBuf> = of_frames.map(|path| folder.join(path)).collect();
        if let Some(request) = &self.flipbook {
            paths.extend(request.flipbook(job, folder).paths()?);
        }
        Ok(paths)
    }

    /// Makes all this of the finished frames `whole` of `job`. Tells what the flipbook consists of.
    ///
    /// # Errors
    /// A frame cannot be read, or a file cannot be written.
    pub fn make(
        &self,
        whole: &PreparedJob,
        job: &Job,
        folder: &Path,
        observer: &dyn JobObserver,
    ) -> Result<Option<FlipbookSummary>, FarmError> {
        // Before the film, which may take long.
        let flipbook = self.prepared_flipbook(job, folder)?;
        if let Some(film) = &self.film {
            make_film(whole, &folder.join(film), observer)?;
        }
        if let Some(count) = self.contact_sheet {
            make_contact_sheet(whole, count, observer)?;
        }
        Ok(flipbook.map(|flipbook| flipbook.run(observer)).transpose()?)
    }
}

/// The contact sheet of the frames at `output`: `shot/fire.sheet.png` of `shot/fire.####.exr`.
fn contact_sheet_path(output: &Path) -> PathBuf {
    output.with_file_name(format!("{}.sheet.png", shot_stem(output)))
}

/// Makes a contact sheet of `count` finished frames that are spread over the shot, over black, with their numbers.
///
/// # Errors
/// The sheet would be too large, a frame cannot be read, or the sheet cannot be written.
fn make_contact_sheet(whole: &PreparedJob, count: usize, observer: &dyn Observer) -> Result<(), FarmError> {
    let (frames, layout) = (whole.frames(), whole.contact_sheet_layout(count)?);
    let count = layout.count;
    let mut tiles = Vec::with_capacity(count);
    for index in 0..count {
        observer::check(observer).map_err(|_| JobError::SingleFileCancelled { output: "a sheet" })?;
        let number = frames[index * (frames.len() - 1) / (count - 1).max(1)];
        let mut tile = over_black(&display_picture(whole, number, PictureFormat::OpaqueDisplay, observer)?);
        label::draw_number(&mut tile, number);
        tiles.push(tile);
    }
    let sheet = compose_contact_sheet(&tiles, &layout).map_err(JobError::from)?;
    let output = whole.output();
    let path = output.path(whole.frames()[0]).with_file_name(format!("{}.sheet.png", output.stem()));
    let bytes = png::encode(&sheet, &[0; 32], PngEffort::Fast, &path)?;
    Ok(atomic::write_bytes(&path, &bytes, whole.overwrite_policy())?)
}

/// `path` as the name of a film.
///
/// # Errors
/// It names pictures.
fn film_pattern(path: &Path) -> Result<OutputPattern, FarmError> {
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
fn make_film(whole: &PreparedJob, path: &Path, observer: &dyn Observer) -> Result<(), FarmError> {
    let window = whole.plan().window();
    let sink = whole.open_sink(film_pattern(path)?, whole.frames().len(), [window.width, window.height])?;
    for (index, &number) in whole.frames().iter().enumerate() {
        observer::check(observer).map_err(|_| JobError::SingleFileCancelled { output: "a film" })?;
        let slot = FrameSlot { index, number };
        let picture = display_picture(whole, number, sink.picture_format(), observer)?;
        sink.write(slot, FinishedPicture::Display(&picture, &[0; 32]))
            .map_err(|error| JobError::from(error).in_frame(number))?;
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
    let path = whole.output().path(number);
    if whole.output().kind() == OutputKind::Png {
        return frame_file::read_png(&path).map_err(unreadable(&path));
    }
    let LinearPixels { beauty, .. } = frame_file::read_exr(&path).map_err(unreadable(&path))?;
    let header = whole.plan().header(number, whole.expected_fingerprint(number));
    let content = Rect::from_size(beauty.width(), beauty.height());
    let opaque = picture_format == PictureFormat::OpaqueDisplay || whole.is_opaque();
    let frame = Frame { header, beauty, depth: None, channels: Vec::new(), opaque, metadata: Vec::new(), content };
    Ok(whole.to_display(&frame, observer))
}

/// The error of the frame at `path`.
pub(super) fn unreadable(path: &Path) -> impl Fn(FrameFileError) -> FarmError + '_ {
    move |source| FarmError::FrameFile { path: path.to_path_buf(), source }
}

/// The name of the shot whose frames are at `output`.
pub(super) fn shot_stem(output: &Path) -> String {
    match OutputPattern::parse(output, 2) {
        Ok(pattern) => pattern.stem().to_owned(),
        // What uses the name has reported it.
        Err(_) => {
            let name = output.file_name().unwrap_or_default().to_string_lossy();
            name.chars().take_while(|c| !matches!(c, '.' | '#' | '%')).collect()
        }
    }
}
