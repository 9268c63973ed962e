//! What files hold of light at and beyond the ends of its range: 0, just below 1, 1, above 1, infinite, not a number; in every depth, for rows
//! of every width, through the same door that a job uses, and read by programs that are not Bansho.

mod display;
mod exr;
mod film;
mod light;
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
        output::sink::{FrameSlot, Picture, Sink, SinkOptions},
    },
    render::display::BitDepth,
};

/// How frames become a file.
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

    /// Writes `frames` and gives back what was shown of each; as they are, where the format takes light.
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
                sink.write(slot, Picture::Linear(&frame)).unwrap();
                continue;
            }
            // Premultiplied light over black is the light itself.
            frame.opaque |= sink.picture_format() == PictureFormat::OpaqueDisplay;
            let shown = light::shown(&frame, &self.view, self.bits, self.alpha);
            sink.write(slot, Picture::Display(&shown, &[7; 32])).unwrap();
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
