//! Fingerprints of frames that exist and are complete, so that a job can skip them.

use std::path::Path;

use crate::{exr, files::input, fingerprint, format::OutputKind, png};

/// Largest frame file that is read, bytes. Bansho writes no larger ones.
const FRAME_BYTES: u64 = 8 << 30;

/// The fingerprint of the frame at `path`, a file of format `kind`, if Bansho wrote it and it is complete: every checksum of a PNG is right
/// up to its end; the digest in the header of an OpenEXR file is that of its bytes. `None` for a file that is missing, truncated, damaged or
/// made by another program, for what is not a regular file, and for films.
pub fn existing_fingerprint(path: &Path, kind: OutputKind) -> Option<[u8; 32]> {
    fingerprint(&input::read(path, FRAME_BYTES).ok()?, kind)
}

/// As [`existing_fingerprint`], of the bytes of a file.
pub fn fingerprint(file: &[u8], kind: OutputKind) -> Option<[u8; 32]> {
    match kind {
        OutputKind::Png => of_png(file),
        OutputKind::Exr => of_exr(file),
        // A film contains many frames, and is always written from the start.
        OutputKind::Apng | OutputKind::Gif | OutputKind::Mp4 | OutputKind::Mov | OutputKind::Webm => None,
    }
}

fn of_png(file: &[u8]) -> Option<[u8; 32]> {
    let (mut found, mut has_pixels, mut ended) = (None, false, false);
    for chunk in png::chunk::chunks(file)? {
        let chunk = chunk.ok().filter(|_| !ended)?;
        match &chunk.kind {
            b"tEXt" => {
                let prefix = [png::KEY_FINGERPRINT.as_bytes(), b"\0"].concat();
                found = found.or(chunk.contents.strip_prefix(&prefix[..]).and_then(fingerprint::from_hex));
            }
            b"IDAT" => has_pixels = true,
            b"IEND" => ended = true,
            _ => {}
        }
    }
    found.filter(|_| has_pixels && ended)
}

fn of_exr(file: &[u8]) -> Option<[u8; 32]> {
    let header = exr::parse::parse_header(file).ok()?;
    let [part] = &header.parts[..] else { return None };
    let digest_at = part.string(exr::KEY_DIGEST).filter(|range| range.len() == 64)?;
    let digest = fingerprint::from_hex(file.get(digest_at.clone())?)?;
    let mut hasher = blake3::Hasher::new();
    hasher.update(file.get(..digest_at.start)?).update(&[b'0'; 64]).update(file.get(digest_at.end..)?);
    if *hasher.finalize().as_bytes() != digest {
        return None;
    }
    fingerprint::from_hex(file.get(part.string(exr::KEY_FINGERPRINT)?)?)
}

#[cfg(test)]
mod tests {
    use bansho_base::{
        color::AlphaConvention,
        frame::{DisplayImage, DisplayPixels},
    };

    use super::*;
    use crate::testing;

    const FINGERPRINT: [u8; 32] = *b"the pixels depend on all of this";

    fn a_png() -> Vec<u8> {
        let pixels = (0..35).map(|i| [i * 7, i, 255 - i, 200]).collect();
        let pixels = DisplayPixels::Eight(pixels);
        let picture = DisplayImage { width: 7, height: 5, opaque: false, alpha: AlphaConvention::Encoded, pixels };
        png::encode(&picture, &FINGERPRINT, png::PngEffort::Fast, Path::new("a.png")).unwrap()
    }

    fn an_exr() -> Vec<u8> {
        let mut frame = testing::frame(20, 18);
        frame.header.fingerprint = FINGERPRINT;
        exr::encode(&frame, Path::new("a.exr")).unwrap()
    }

    #[test]
    fn whole_files_give_their_fingerprint() {
        assert_eq!(fingerprint(&a_png(), OutputKind::Png), Some(FINGERPRINT));
        assert_eq!(fingerprint(&an_exr(), OutputKind::Exr), Some(FINGERPRINT));
        // A file of another format than its name says is not the frame that was to be written.
        assert_eq!([fingerprint(&a_png(), OutputKind::Exr), fingerprint(&an_exr(), OutputKind::Png)], [None; 2]);
        assert_eq!(fingerprint(&a_png(), OutputKind::Apng), None);
    }

    #[test]
    fn cut_off_files_count_as_absent() {
        for (file, kind) in [(a_png(), OutputKind::Png), (an_exr(), OutputKind::Exr)] {
            for length in 0..file.len() {
                assert_eq!(fingerprint(&file[..length], kind), None, "cut to {length} of {}", file.len());
            }
        }
    }

    #[test]
    fn any_changed_byte_makes_a_file_count_as_absent() {
        for (file, kind) in [(a_png(), OutputKind::Png), (an_exr(), OutputKind::Exr)] {
            for index in 0..file.len() {
                let mut damaged = file.clone();
                damaged[index] ^= 0x10;
                assert_eq!(fingerprint(&damaged, kind), None, "byte {index} of {}", file.len());
            }
        }
    }

    #[test]
    fn files_with_more_behind_them_and_missing_files_count_as_absent() {
        for (file, kind) in [(a_png(), OutputKind::Png), (an_exr(), OutputKind::Exr)] {
            assert_eq!(fingerprint(&[&file[..], b"x"].concat(), kind), None);
        }
        assert_eq!(existing_fingerprint(Path::new("no such folder/a.png"), OutputKind::Png), None);
        // An endless device.
        #[cfg(unix)]
        assert_eq!(existing_fingerprint(Path::new("/dev/zero"), OutputKind::Png), None);
    }
}
