//! What is made of finished frames, from their files: a film, a contact sheet.

use std::path::{Path, PathBuf};

use bansho_base::{
    frame::{DisplayImage, Frame},
    host::observer::{Observer, check},
    image::Rect,
};
use bansho_media::{
    files::{atomic, naming::OutputPattern},
    format::{OutputKind, PictureFormat},
    imageops::{flatten::over_black, label},
    output::{
        frame_file::{self, FrameFileError, LinearPixels},
        sink::{FrameSlot, Picture},
    },
    png::{self, PngEffort},
};

use super::{error::FarmError, plan::FarmFolder};
use crate::job::{JobError, PreparedJob, render::contact_sheet, sheet::nearly_square_layout};

/// The contact sheet of the frames at `output`: `shot/fire.sheet.png` of `shot/fire.####.exr`.
pub fn contact_sheet_path(output: &Path) -> PathBuf {
    FarmFolder::beside(output).root().with_extension("sheet.png")
}

/// Makes a contact sheet of `count` finished frames that are spread over the shot, over black, with their numbers.
///
/// # Errors
/// The sheet would be too large, a frame cannot be read, or the sheet cannot be written.
pub fn make_contact_sheet(whole: &PreparedJob, count: usize, observer: &dyn Observer) -> Result<(), FarmError> {
    let (frames, window) = (whole.frames(), whole.plan().window());
    let count = count.min(frames.len());
    let layout =
        nearly_square_layout(count, [window.width, window.height], contact_sheet::GUTTER).map_err(JobError::from)?;
    let mut tiles = Vec::with_capacity(count);
    for index in 0..count {
        check(observer).map_err(|_| JobError::SingleFileCancelled { output: "a sheet" })?;
        let number = frames[index * (frames.len() - 1) / (count - 1).max(1)];
        let mut tile = over_black(&display_picture(whole, number, PictureFormat::OpaqueDisplay, observer)?);
        label::draw_number(&mut tile, number);
        tiles.push(tile);
    }
    let sheet = contact_sheet::compose(&tiles, &layout).map_err(JobError::from)?;
    let path = contact_sheet_path(&whole.output().template_path());
    let bytes = png::encode(&sheet, &[0; 32], PngEffort::Fast, &path)?;
    Ok(atomic::write_bytes_with(&path, &bytes, &whole.format.overwrite)?)
}

/// Makes a film of finished frames.
///
/// # Errors
/// The name is not that of a film, a frame cannot be read, or the film cannot be written.
pub fn make_film(whole: &PreparedJob, path: &Path, observer: &dyn Observer) -> Result<(), FarmError> {
    let mut format = whole.format.clone();
    format.pattern = OutputPattern::parse(path, whole.frames().len()).map_err(JobError::Naming)?;
    if format.pattern.kind().is_sequence() {
        return Err(FarmError::NotAFilm { path: path.to_path_buf() });
    }
    let window = whole.plan().window();
    let (opaque, size) = (whole.compiled.has_opaque_plate(), [window.width, window.height]);
    let sink = format.open(whole.plan(), opaque, whole.frames().len(), size, 1)?;
    for (index, &number) in whole.frames().iter().enumerate() {
        check(observer).map_err(|_| JobError::SingleFileCancelled { output: "a film" })?;
        let slot = FrameSlot { index, number };
        let picture = display_picture(whole, number, sink.picture_format(), observer)?;
        sink.write(slot, Picture::Display(&picture, &[0; 32]))?;
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
