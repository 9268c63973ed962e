//! The codes in files for light at and beyond the ends of its range: 0, just below 1, 1, above 1, infinite, NaN; in every bit depth, for rows of
//! every width, written by the same functions as in a job, and read by other programs.

mod display;
mod exr;
mod film;
mod light;
mod pixels;
mod still;

use std::{
    path::Path,
    process::{Command, Stdio},
};

use bansho::{
    base::{
        color::{AlphaConvention, View},
        frame::{DisplayImage, Frame},
    },
    media::{
        files::naming::OutputPattern,
        format::PictureFormat,
        output::sink::{FinishedPicture, FrameSlot, Sink, SinkOptions},
    },
    render::display::BitDepth,
};

/// How frames are written to a file.
struct Writing {
    view: View,
    bits: BitDepth,
    alpha: Option<AlphaConvention>,
    gif_transparent: bool,
}

impl Writing {
    fn new(bits: BitDepth, alpha: Option<AlphaConvention>) -> Self {
        Self { view: View::STANDARD, bits, alpha, gif_transparent: false }
    }

    /// Writes `frames` and returns the display picture of each; a scene-linear format gets the frames themselves.
    fn write(&self, path: &Path, frames: &[Frame]) -> Vec<DisplayImage> {
        let size = [frames[0].beauty.width(), frames[0].beauty.height()];
        let options = SinkOptions {
            opaque: self.alpha.is_none(),
            alpha: self.alpha.unwrap_or_default(),
            sixteen_bits: self.bits == BitDepth::Sixteen,
            gif_transparent: self.gif_transparent,
            ..SinkOptions::new(size, [24, 1], frames.len())
        };
        let sink = Sink::open(OutputPattern::parse(path, frames.len()).unwrap(), options).unwrap();
        let mut all = Vec::new();
        for (index, frame) in frames.iter().enumerate() {
            let slot = FrameSlot { index, number: index as i64 };
            let mut frame = frame.clone();
            if sink.picture_format() == PictureFormat::Frame {
                sink.write(slot, FinishedPicture::Linear(&frame)).unwrap();
                continue;
            }
            // Over black, premultiplied light is unchanged.
            frame.opaque |= sink.picture_format() == PictureFormat::OpaqueDisplay;
            let shown = light::shown(&frame, &self.view, self.bits, self.alpha);
            sink.write(slot, FinishedPicture::Display(&shown, &[7; 32])).unwrap();
            all.push(shown);
        }
        sink.finish().unwrap();
        all
    }
}

/// Runs a program of `tests/python` on a folder.
fn python(program: &str, folder: &Path) {
    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python").join(program);
    let output = Command::new("python3").arg(program).arg(folder).stdin(Stdio::null()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// What a program has written beside a file.
fn beside(path: &Path, ending: &str) -> Vec<u8> {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    std::fs::read(&name).unwrap_or_else(|error| panic!("{}: {error}", name.display()))
}

/// Bytes as 16-bit numbers, the low byte first.
fn numbers(bytes: &[u8]) -> Vec<u16> {
    bytes.as_chunks().0.iter().map(|pair| u16::from_le_bytes(*pair)).collect()
}
