//! Whether the file of a picture or a depth is whole, and its size, without decoding its pixels: what is checked of each frame of a sequence before anything
//! is drawn.

use std::{
    fs::File,
    io::{Read, Seek, SeekFrom},
};

use bansho_base::host::assets::AssetProblem;

use crate::{
    decode::damaged,
    exr::header::{self, FileHeader, HeaderError, PartHeader, Window},
    png::chunk::SIGNATURE,
};

/// Bytes of an EXR's header that are read at first, and at most.
const HEADER_BYTES: [u64; 2] = [1 << 16, 1 << 24];

/// Why a file that ends too early is not read.
fn truncated() -> AssetProblem {
    damaged("it is truncated")
}

/// Width and height of the picture in a `file` of `length` bytes with this `extension` (without the dot), which is whole as far as its structure tells; `None`
/// for formats of which only decoding tells that. A JPEG that ends early is drawn, so only its size is read.
pub(super) fn check(file: &mut File, length: u64, extension: &str) -> Result<Option<[usize; 2]>, AssetProblem> {
    match extension.to_ascii_lowercase().as_str() {
        "png" => png(file, length).map(Some),
        "exr" => exr(file, length).map(Some),
        "jpg" | "jpeg" | "jpe" | "jfif" => jpeg(file).map(Some),
        _ => Ok(None),
    }
}

fn unreadable(error: std::io::Error) -> AssetProblem {
    if error.kind() == std::io::ErrorKind::UnexpectedEof {
        return truncated();
    }
    AssetProblem::Unreadable(error.to_string())
}

/// The bytes from `offset` on.
fn read_at<const N: usize>(file: &mut File, offset: u64) -> Result<[u8; N], AssetProblem> {
    let mut bytes = [0; N];
    file.seek(SeekFrom::Start(offset)).and_then(|_| file.read_exact(&mut bytes)).map_err(unreadable)?;
    Ok(bytes)
}

/// Follows the lengths of all chunks up to the last, `IEND`.
fn png(file: &mut File, length: u64) -> Result<[usize; 2], AssetProblem> {
    if read_at(file, 0)? != SIGNATURE {
        return Err(damaged("it does not begin as a PNG"));
    }
    let (mut at, mut size) = (SIGNATURE.len() as u64, None);
    loop {
        let [a, b, c, d, kind @ ..] = read_at::<8>(file, at)?;
        if kind == *b"IHDR" {
            let [width, height] = [read_at(file, at + 8)?, read_at(file, at + 12)?].map(u32::from_be_bytes);
            size = Some([width as usize, height as usize]);
        }
        // Length, kind and checksum are twelve bytes.
        at += 12 + u64::from(u32::from_be_bytes([a, b, c, d]));
        if at > length {
            return Err(truncated());
        }
        if kind == *b"IEND" {
            return size.ok_or_else(|| damaged("it has no header"));
        }
    }
}

/// Follows the segments up to the header of the frame.
fn jpeg(file: &mut File) -> Result<[usize; 2], AssetProblem> {
    if read_at(file, 0)? != [0xff, 0xd8] {
        return Err(damaged("it does not begin as a JPEG"));
    }
    let mut at = 2;
    loop {
        let [mark, kind] = read_at(file, at)?;
        match (mark, kind) {
            // Bytes before a marker are skipped, as decoders do.
            (0xff, 0xff) | (0..=0xfe, _) => at += 1,
            // Start of a frame: every kind but the tables C4, C8 and CC.
            (_, 0xc0..=0xcf) if !matches!(kind, 0xc4 | 0xc8 | 0xcc) => {
                let [height, width] = [read_at(file, at + 5)?, read_at(file, at + 7)?].map(u16::from_be_bytes);
                return Ok([width.into(), height.into()]);
            }
            (_, 0x01 | 0xd0..=0xd9) => at += 2,
            _ => at += 2 + u64::from(u16::from_be_bytes(read_at(file, at + 2)?)).max(2),
        }
    }
}

/// Reads the table of chunks, and whether the last of them is whole.
fn exr(file: &mut File, length: u64) -> Result<[usize; 2], AssetProblem> {
    let (header, header_end) = exr_header(file, length)?;
    let parts = &header.parts;
    let size = parts[0].display_window.ok_or_else(|| damaged("it has no display window"))?.size();
    let chunks: u64 = parts.iter().map(chunk_count).sum::<Option<u64>>().unwrap_or(0);
    let table_end = chunks.checked_mul(8).and_then(|bytes| header_end.checked_add(bytes));
    if table_end.is_none_or(|end| end > length) {
        return Err(truncated());
    }
    let mut table = vec![0; (8 * chunks) as usize];
    file.seek(SeekFrom::Start(header_end)).and_then(|_| file.read_exact(&mut table)).map_err(unreadable)?;
    let offsets = table.as_chunks::<8>().0.iter().map(|bytes| u64::from_le_bytes(*bytes));
    // A writer fills the table last; where it was interrupted, there are zeros.
    if offsets.clone().any(|offset| offset < header_end || offset >= length) {
        return Err(damaged("it was not written to its end"));
    }
    if let Some(last) = offsets.max() {
        // The number of the part, in files of several; the coordinates of a line, or of a tile and its level; the number of bytes.
        let coordinates = if parts.iter().any(|part| part.tile.is_some()) { 16 } else { 4 };
        let prefix = if parts.len() > 1 { 4 } else { 0 } + coordinates;
        let bytes = u64::from(u32::from_le_bytes(read_at(file, last + prefix)?));
        if last + prefix + 4 + bytes > length {
            return Err(truncated());
        }
    }
    Ok(size.map(|side| side as usize))
}

/// The header, and where it ends.
fn exr_header(file: &mut File, length: u64) -> Result<(FileHeader, u64), AssetProblem> {
    for limit in HEADER_BYTES {
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(0)).map_err(unreadable)?;
        (&mut *file).take(limit).read_to_end(&mut bytes).map_err(unreadable)?;
        match header::parse_header_and_end(&bytes) {
            Ok((header, end)) => return Ok((header, end as u64)),
            Err(HeaderError::Damaged) if bytes.len() as u64 == limit && limit < length => {}
            Err(error) => return Err(damaged(error)),
        }
    }
    Err(damaged("its header is too long"))
}

/// Number of chunks of a part; `None` where it has levels of resolution, whose number is not read.
fn chunk_count(part: &PartHeader) -> Option<u64> {
    let [width, height] = part.data_window.map(Window::size)?;
    match part.tile {
        Some([across, down]) if !part.has_levels => {
            Some(width.div_ceil(u64::from(across.max(1))) * height.div_ceil(u64::from(down.max(1))))
        }
        Some(_) => None,
        None => Some(height.div_ceil(header::lines_in_chunk(part.compression))),
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    use super::*;
    use crate::{exr, png, testing};

    fn checked(folder: &Path, name: &str, bytes: &[u8]) -> Result<Option<[usize; 2]>, String> {
        let path = folder.join(name);
        fs::write(&path, bytes).unwrap();
        let extension = name.rsplit('.').next().unwrap();
        check(&mut File::open(&path).unwrap(), bytes.len() as u64, extension).map_err(|error| error.to_string())
    }

    #[test]
    fn a_whole_file_has_its_size_and_one_that_is_cut_anywhere_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let frame = testing::frame(50, 37);
        let files = [
            ("a.png", png::encode_document(&testing::display(50, 37, 0), Path::new("a.png")).unwrap()),
            ("a.exr", exr::encode(&frame, Path::new("a.exr")).unwrap()),
        ];
        for (name, bytes) in files {
            assert_eq!(checked(folder.path(), name, &bytes), Ok(Some([50, 37])), "{name}");
            for cut in (0..bytes.len()).step_by(37).chain([bytes.len() - 1]) {
                assert!(checked(folder.path(), name, &bytes[..cut]).is_err(), "{name} cut at {cut}");
            }
        }
        // SOI, a comment, and the header of a frame of 3 x 2 pixels.
        let jpeg = b"\xff\xd8\xff\xfe\0\x04ab\xff\xc0\0\x0b\x08\0\x02\0\x03\x01\x01\x11\0";
        assert_eq!(checked(folder.path(), "a.JPG", jpeg), Ok(Some([3, 2])));
        assert!(checked(folder.path(), "a.jpg", &jpeg[..12]).is_err());
        assert_eq!(checked(folder.path(), "a.tif", b""), Ok(None));
    }
}
