//! Animated PNG (PNG third edition, sections 4.9 and 11.3.6), in an endless loop.
//!
//! Each frame is compressed as a separate PNG, on any thread. Its chunks are then renumbered and appended.

use std::{io::Write, path::Path};

use bansho_base::frame::DisplayImage;

use super::ordered::FilmEncoder;
use crate::{
    error::MediaError,
    files::{atomic::AtomicFile, overwrite_policy::OverwritePolicy},
    frame_rate,
    imageops::flatten,
    png::{self, chunk},
};

/// The format of all frames.
#[derive(Clone, Debug)]
pub(crate) struct ApngFormat {
    pub(crate) frame_count: usize,
    pub(crate) size: [usize; 2],
    pub(crate) fps: [u32; 2],
}

/// A film in progress.
pub(crate) struct ApngFilm {
    file: AtomicFile,
    format: ApngFormat,
    delay: [u16; 2],
    /// Number of the next fcTL or fdAT chunk.
    sequence: u32,
}

impl ApngFilm {
    pub(crate) fn create(path: &Path, format: ApngFormat, overwrite: &OverwritePolicy) -> Result<Self, MediaError> {
        let [numerator, denominator] = format.fps;
        let delay = frame_rate::apng_delay(format.fps).ok_or_else(|| MediaError::FrameRate {
            path: path.to_path_buf(),
            numerator,
            denominator,
        })?;
        Ok(Self { file: AtomicFile::create(path, overwrite)?, format, delay, sequence: 0 })
    }

    /// The next number; control and data chunks are numbered together.
    fn next_sequence(&mut self) -> [u8; 4] {
        self.sequence += 1;
        (self.sequence - 1).to_be_bytes()
    }

    /// Appends the control chunk of a frame: its rectangle, its delay and how it replaces the last.
    fn push_control(&mut self, bytes: &mut Vec<u8>) {
        let sequence = self.next_sequence();
        let [width, height] = self.format.size.map(|side| (side as u32).to_be_bytes());
        let [seconds, frames] = self.delay.map(u16::to_be_bytes);
        // No offset, no disposal: each frame replaces all pixels.
        let rest: &[&[u8]] = &[&sequence, &width, &height, &[0; 8], &seconds, &frames, &[0, 0]];
        chunk::push(bytes, *b"fcTL", rest);
    }
}

/// One frame as a PNG, with the same color type for all frames.
pub(crate) fn prepare(picture: &DisplayImage, opaque: bool, path: &Path) -> Result<Vec<u8>, MediaError> {
    match (opaque, picture.opaque) {
        (true, false) => png::encode_frame(&flatten::over_black(picture), path),
        (false, true) => png::encode_frame(&DisplayImage { opaque: false, ..picture.clone() }, path),
        _ => png::encode_frame(picture, path),
    }
}

impl FilmEncoder for ApngFilm {
    type EncodedFrame = Vec<u8>;

    fn append(&mut self, encoded: Vec<u8>) -> Result<(), MediaError> {
        let (mut bytes, is_first) = (Vec::with_capacity(encoded.len() + 256), self.sequence == 0);
        if is_first {
            bytes.extend(chunk::SIGNATURE);
        }
        let mut has_control = false;
        // The file begins with the chunks of the first frame, which say what all frames have in common. Of the others only the pixels are kept, as fdAT.
        for chunk in chunk::chunks(&encoded).into_iter().flatten().flatten() {
            match &chunk.kind {
                b"IDAT" => {
                    if !std::mem::replace(&mut has_control, true) {
                        self.push_control(&mut bytes);
                    }
                    if is_first {
                        chunk::push(&mut bytes, *b"IDAT", &[chunk.contents]);
                    } else {
                        let sequence = self.next_sequence();
                        chunk::push(&mut bytes, *b"fdAT", &[&sequence, chunk.contents]);
                    }
                }
                b"IEND" => {}
                _ if !is_first => {}
                kind => {
                    chunk::push(&mut bytes, *kind, &[chunk.contents]);
                    if kind == b"IHDR" {
                        let frames = (self.format.frame_count as u32).to_be_bytes();
                        // 0 plays: without end.
                        chunk::push(&mut bytes, *b"acTL", &[&frames, &[0; 4]]);
                    }
                }
            }
        }
        let written = self.file.file().write_all(&bytes);
        written.map_err(|source| MediaError::from_io(self.file.path(), source))
    }

    fn finish(mut self) -> Result<(), MediaError> {
        let mut end = Vec::new();
        chunk::push(&mut end, *b"IEND", &[]);
        let written = self.file.file().write_all(&end);
        written.map_err(|source| MediaError::from_io(self.file.path(), source))?;
        self.file.finish()
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::frame::DisplayPixels;

    use super::*;
    use crate::testing;

    #[test]
    fn an_animation_is_read_back_frame_by_frame_with_its_timing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.apng");
        let format = ApngFormat { frame_count: 3, size: [6, 5], fps: [24000, 1001] };
        let mut film = ApngFilm::create(&path, format, &OverwritePolicy::default()).unwrap();
        for index in 0..3 {
            film.append(prepare(&testing::display(6, 5, index), false, &path).unwrap()).unwrap();
        }
        film.finish().unwrap();

        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = ::png::Decoder::new(file).read_info().unwrap();
        let control = *reader.info().animation_control().unwrap();
        assert_eq!((control.num_frames, control.num_plays), (3, 0));
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        for index in 0..3 {
            reader.next_frame(&mut bytes).unwrap();
            let frame = reader.info().frame_control().unwrap();
            assert_eq!((frame.delay_num, frame.delay_den), (1001, 24000));
            let DisplayPixels::Eight(pixels) = testing::display(6, 5, index).pixels else { unreachable!() };
            assert_eq!(bytes, pixels.as_flattened(), "frame {index}");
        }
    }
}
