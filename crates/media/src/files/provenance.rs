//! The mark in a file that Bansho made it, so that it may be replaced without asking.
//!
//! | format | mark | where |
//! | --- | --- | --- |
//! | PNG, APNG | a text chunk whose key begins with `bansho:` | before the pixels |
//! | EXR | an attribute whose name begins with `bansho:` | header |
//! | GIF | a comment that begins with `bansho:` | before the first frame |
//! | MP4 | the tag `comment`, which begins with `bansho:` | `moov`, which is written first |
//! | MOV | a tag that begins with `bansho:` | `moov`, which is written last |
//! | WebM | a tag that begins with `BANSHO:` | before or after the frames |
//! | JSON | `"program"`, second after `"format"` | start |
//! | glTF | `"generator"` of `"asset"`, the first key | start |
//! | PLY | a comment that begins with `Bansho:` | header |
//! | SVG | a comment that begins with `bansho:` | after the first tag |
//! | CSV | a comment that begins with `bansho:` | first line |
//! | shell script | a comment that begins with `bansho:` | second line, after `#!` |
//! | YAML, word files of farms | a comment that begins with `bansho:` | first line |
//! | manual page | a comment that begins with `bansho:` | first line |
//! | snapshot | its first eight bytes | start |
//!
//! A file that was truncated after its mark, for example by a power failure, still has it. Without a mark are a truncated MOV, a file
//! truncated within its first bytes, and GIF, MP4, JSON and films without alpha from before marks were introduced.

use std::{
    fs::{self, File},
    io::{self, Read, Seek, SeekFrom},
    ops::Range,
    path::Path,
};

use crate::{exr, png::chunk};

/// Value of `"program"` in JSON files. It is the second key, after `"format"`.
pub const PROGRAM: &str = concat!("Bansho ", env!("CARGO_PKG_VERSION"));
/// First bytes of a snapshot of a simulation.
pub const SNAPSHOT_MAGIC: [u8; 8] = *b"BANSHOSS";

/// Comment of GIF, SVG and CSV files, and tag of films.
pub const COMMENT_TAG: &str = concat!("bansho:version=", env!("CARGO_PKG_VERSION"));
/// First line of text files whose comments begin with `#`, and second line of shell scripts.
pub const COMMENT_LINE: &str = concat!("# bansho:version=", env!("CARGO_PKG_VERSION"), "\n");
/// First line of manual pages.
pub const MANUAL_LINE: &str = concat!(".\\\" bansho:version=", env!("CARGO_PKG_VERSION"), "\n");
/// How a comment of a manual page begins.
const MANUAL_COMMENT: &[u8] = b".\\\" ";
/// Prefix of all keys, names and comments that mark a file.
const PREFIX: &[u8] = b"bansho:";

/// Bytes at the start of a file that are searched.
const HEAD_BYTES: u64 = 16 << 10;
/// Largest EXR header that is read, bytes: that of the largest number of channels, with long names.
const EXR_HEADER_BYTES: u64 = 2 << 20;
/// Largest size of a film's tags that are read, bytes.
const TAG_BYTES: u64 = 64 << 10;
/// Largest number of a film's boxes that are skipped.
const MAX_MP4_BOXES: usize = 256;

/// Magic number of Matroska and WebM.
const EBML: [u8; 4] = [0x1a, 0x45, 0xdf, 0xa3];

/// Whether Bansho made the file at `path`, by its provenance mark. Reads at most 2 MiB; `false` for what is not a
/// regular file or cannot be read.
pub fn is_bansho_file(path: &Path) -> bool {
    // Opening a pipe would block.
    fs::metadata(path).is_ok_and(|found| found.is_file()) && has_mark(path).unwrap_or(false)
}

fn has_mark(path: &Path) -> io::Result<bool> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let head = read_range(&mut file, 0..HEAD_BYTES)?;
    Ok(match &head[..] {
        head if head.starts_with(&chunk::SIGNATURE) => in_png(head),
        head if head.starts_with(&exr::header::MAGIC) => {
            in_exr(head) || length > HEAD_BYTES && in_exr(&read_range(&mut file, 0..EXR_HEADER_BYTES)?)
        }
        head if head.starts_with(b"GIF8") => in_gif(head).is_some(),
        head if head.starts_with(&EBML) => {
            contains_prefix(head) || contains_prefix(&read_range(&mut file, length.saturating_sub(TAG_BYTES)..length)?)
        }
        head if head.get(4..8) == Some(b"ftyp") => in_film(&mut file, length)?,
        head if head.starts_with(b"ply\n") => in_ply(head),
        head if head.starts_with(b"<svg") => in_svg(head),
        head if head.starts_with(b"# ") => starts_with_prefix(&head[2..]),
        head if head.starts_with(b"#!") => in_script(head),
        head if head.starts_with(MANUAL_COMMENT) => starts_with_prefix(&head[MANUAL_COMMENT.len()..]),
        head if head.starts_with(&SNAPSHOT_MAGIC) => true,
        head => in_json(head) || in_gltf(head),
    })
}

/// The bytes of `range`, up to the end of the file.
fn read_range(file: &mut File, range: Range<u64>) -> io::Result<Vec<u8>> {
    file.seek(SeekFrom::Start(range.start))?;
    let mut bytes = Vec::new();
    file.take(range.end.saturating_sub(range.start)).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn starts_with_prefix(bytes: &[u8]) -> bool {
    bytes.get(..PREFIX.len()).is_some_and(|start| start.eq_ignore_ascii_case(PREFIX))
}

fn contains_prefix(bytes: &[u8]) -> bool {
    bytes.windows(PREFIX.len()).any(starts_with_prefix)
}

fn in_png(head: &[u8]) -> bool {
    let chunks = chunk::chunks(head).into_iter().flatten().map_while(Result::ok);
    chunks
        .take_while(|chunk| chunk.kind != *b"IDAT")
        .any(|chunk| chunk.kind == *b"tEXt" && starts_with_prefix(chunk.contents))
}

fn in_exr(head: &[u8]) -> bool {
    let header = exr::header::parse_header(head);
    header.is_ok_and(|header| {
        header.parts.iter().flat_map(|part| &part.strings).any(|(name, _)| starts_with_prefix(name.as_bytes()))
    })
}

/// Walks the extensions before the first frame (GIF89a, sections 17 to 24).
fn in_gif(head: &[u8]) -> Option<()> {
    const EXTENSION: u8 = 0x21;
    const COMMENT: u8 = 0xfe;
    // The size of the global palette, if there is one, is 2 to the power of three bits plus 1, three bytes each.
    let flags = *head.get(10)?;
    let palette = if flags & 0x80 == 0 { 0 } else { 3 << ((flags & 7) + 1) };
    let mut rest = head.get(13 + palette..)?;
    while let [EXTENSION, label, blocks @ ..] = rest {
        let (length, mut blocks) = blocks.split_first()?;
        if *label == COMMENT && starts_with_prefix(blocks.get(..usize::from(*length))?) {
            return Some(());
        }
        // The data of an extension are blocks, up to an empty one.
        let mut length = *length;
        while length != 0 {
            blocks = blocks.get(usize::from(length)..)?;
            (length, blocks) = blocks.split_first().map(|(length, rest)| (*length, rest))?;
        }
        rest = blocks;
    }
    None
}

/// Searches the tags of MP4 and QuickTime, in boxes of `moov` (ISO/IEC 14496-12, section 4.2).
fn in_film(file: &mut File, length: u64) -> io::Result<bool> {
    let Some(movie) = find_box(file, 0..length, *b"moov")? else { return Ok(false) };
    for kind in [*b"udta", *b"meta"] {
        if let Some(tags) = find_box(file, movie.clone(), kind)?
            && contains_prefix(&read_range(file, tags.start..tags.end.min(tags.start.saturating_add(TAG_BYTES)))?)
        {
            return Ok(true);
        }
    }
    Ok(false)
}

/// The contents of the first box of a kind.
fn find_box(file: &mut File, within: Range<u64>, expected: [u8; 4]) -> io::Result<Option<Range<u64>>> {
    let mut at = within.start;
    for _ in 0..MAX_MP4_BOXES {
        let head = read_range(file, at..within.end.min(at.saturating_add(16)))?;
        let Some((size, kind)) = head.first_chunk().copied().zip(head.get(4..8)) else { break };
        let (size, start) = match (u32::from_be_bytes(size), head.get(8..16).and_then(|long| long.try_into().ok())) {
            // 0: up to the end of the file. 1: the size is in 64 bits behind the kind.
            (0, _) => (within.end - at, 8),
            (1, Some(long)) => (u64::from_be_bytes(long), 16),
            (size, _) => (u64::from(size), 8),
        };
        let end = at.saturating_add(size).min(within.end);
        if size < start {
            break;
        }
        if kind == expected {
            return Ok(Some(at + start..end.max(at + start)));
        }
        at = end;
    }
    Ok(None)
}

fn in_script(head: &[u8]) -> bool {
    let second = head.split(|&byte| byte == b'\n').nth(1);
    second.and_then(|line| line.strip_prefix(b"# ")).is_some_and(starts_with_prefix)
}

fn in_ply(head: &[u8]) -> bool {
    let mut lines = head.split(|&byte| byte == b'\n').take_while(|line| *line != b"end_header");
    lines.any(|line| line.strip_prefix(b"comment ").is_some_and(starts_with_prefix))
}

/// Whether the comment after the first tag is the mark.
fn in_svg(head: &[u8]) -> bool {
    let Some(end) = head.iter().position(|&byte| byte == b'>') else { return false };
    let rest = head[end + 1..].trim_ascii_start();
    rest.strip_prefix(b"<!-- ").is_some_and(starts_with_prefix)
}

fn in_gltf(head: &[u8]) -> bool {
    begins_with(&mut without_white_space(head), b"{\"asset\":{\"generator\":\"Bansho")
}

fn in_json(head: &[u8]) -> bool {
    let mut bytes = without_white_space(head);
    if !begins_with(&mut bytes, b"{\"format\":") {
        return false;
    }
    let version_digits = bytes.by_ref().take_while(u8::is_ascii_digit).count();
    // `take_while` consumed the comma after the number.
    (1..9).contains(&version_digits) && begins_with(&mut bytes, b"\"program\":\"Bansho")
}

/// JSON may have white space between any two of its words.
fn without_white_space(json: &[u8]) -> impl Iterator<Item = u8> {
    json.iter().copied().filter(|byte| !byte.is_ascii_whitespace())
}

/// Whether the next bytes are those of `text`.
fn begins_with(bytes: &mut impl Iterator<Item = u8>, text: &[u8]) -> bool {
    text.iter().all(|&byte| bytes.next() == Some(byte))
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use bansho_base::geometry::point_cloud::PointCloud;

    use super::*;
    use crate::{
        files::{naming::OutputPattern, overwrite_policy::OverwritePolicy},
        format::PictureFormat,
        gltf,
        output::sink::{FinishedPicture, FrameSlot, Sink, SinkOptions},
        ply, testing,
    };

    /// A file of two frames, as the program writes it; of a sequence the second.
    fn made(folder: &Path, name: &str, opaque: bool) -> PathBuf {
        let pattern = OutputPattern::parse(&folder.join(name), 2).unwrap();
        let options =
            SinkOptions { opaque, overwrite: OverwritePolicy::any(), ..SinkOptions::new([34, 16], [24, 1], 2) };
        let sink = Sink::open(pattern, options).unwrap();
        for index in 0..2 {
            let slot = FrameSlot { index, number: index as i64 };
            let picture = bansho_base::frame::DisplayImage { opaque, ..testing::display(34, 16, index) };
            let linear = testing::frame(34, 16);
            let picture = match sink.picture_format() {
                PictureFormat::Frame => FinishedPicture::Linear(&linear),
                _ => FinishedPicture::Display(&picture, &[7; 32]),
            };
            sink.write(slot, picture).unwrap();
        }
        let path = sink.path(1);
        sink.finish().unwrap();
        path
    }

    fn rewritten(path: &Path, change: impl FnOnce(&mut Vec<u8>)) -> bool {
        let mut bytes = fs::read(path).unwrap();
        change(&mut bytes);
        fs::write(path, bytes).unwrap();
        is_bansho_file(path)
    }

    /// Without the letters of the mark it counts as made by another program.
    fn unmark(bytes: &mut [u8]) {
        let offsets: Vec<usize> = (0..bytes.len()).filter(|&offset| starts_with_prefix(&bytes[offset..])).collect();
        offsets.iter().for_each(|&offset| bytes[offset..offset + PREFIX.len()].copy_from_slice(b"bandage"));
    }

    #[test]
    fn pictures_and_films_bear_a_mark_in_their_head() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.png", "a.exr", "a.apng", "a.gif"] {
            for opaque in [false, true] {
                let path = made(folder.path(), name, opaque);
                assert!(is_bansho_file(&path), "{name}");
                // What a power failure may leave.
                assert!(rewritten(&path, |bytes| bytes.truncate(bytes.len() * 9 / 10)), "{name}");
                assert!(!rewritten(&path, |bytes| unmark(bytes)), "{name}");
            }
        }
    }

    #[test]
    #[ignore = "needs ffmpeg"]
    fn films_by_ffmpeg_bear_a_mark() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.mp4", "a.mov", "a.webm"] {
            for opaque in [false, true] {
                let path = made(folder.path(), name, opaque);
                assert!(is_bansho_file(&path), "{name}");
                assert!(!rewritten(&path, |bytes| unmark(bytes)), "{name}");
            }
        }
    }

    fn is_marked_with(bytes: &[u8]) -> bool {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        fs::write(&path, bytes).unwrap();
        is_bansho_file(&path)
    }

    #[test]
    fn particles_snapshots_and_tables_bear_a_mark() {
        assert!(is_marked_with(&ply::encode(&PointCloud::default())));
        assert!(!is_marked_with(b"ply\nformat ascii 1.0\ncomment by hand\nend_header\ncomment Bansho: \n"));
        assert!(is_marked_with(b"BANSHOSS and a state") && !is_marked_with(b"BANSHO"));
        for text in ["<svg width=\"9\">\n<!-- bansho:version=1 -->", "# bansho:version=1; title\nx,y\n"] {
            assert!(is_marked_with(text.as_bytes()) && !is_marked_with(text.replace("bansho", "by hand").as_bytes()));
        }
        for other in ["<svg/><!-- by hand --><!-- bansho:version=1 -->", "<svg", "# ", "x\n# bansho:version=1"] {
            assert!(!is_marked_with(other.as_bytes()), "{other}");
        }
        assert!(is_marked_with(&gltf::encode(&[], &[])));
        assert!(!is_marked_with(b"{\"asset\":{\"version\":\"2.0\",\"generator\":\"by hand\"}}"));
        let json = |text: &str| is_marked_with(text.as_bytes());
        assert!(json(&format!("{{\n  \"format\": 12,\n  \"program\": \"{PROGRAM}\"\n}}")));
        assert!(json("{\"format\":1,\"program\":\"Bansho 9\",\"size\":"), "cut off");
        for other in [
            "",
            "{",
            "{}",
            "{\"format\":1}",
            "{\"format\":,\"program\":\"Bansho\"}",
            "{\"program\":\"Bansho\"}",
            "{\"format\":1,\"program\":\"Other\"}",
        ] {
            assert!(!json(other), "{other}");
        }
    }

    #[test]
    fn a_mark_behind_tags_and_channels_is_found_without_reading_all() {
        let mut frame = testing::frame(4, 4);
        let channel = frame.channels[0].clone();
        frame.channels.extend((0..300).map(|index| {
            let name = format!("{}{index}.R", "long".repeat(50));
            bansho_base::frame::Channel { name, ..channel.clone() }
        }));
        let file = exr::encode(&frame, Path::new("a.exr")).unwrap();
        assert!(file.windows(9).position(|bytes| bytes == b"bansho:ve").unwrap() > HEAD_BYTES as usize);
        assert!(is_marked_with(&file));
        // A film of 1 TB with its index after the pictures: a sparse file.
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mov");
        let mut file = File::create(&path).unwrap();
        let large = |kind: &[u8; 4], size: u64| [&1_u32.to_be_bytes()[..], kind, &size.to_be_bytes()].concat();
        let small =
            |kind: &[u8; 4], contents: &[u8]| [&(contents.len() as u32 + 8).to_be_bytes()[..], kind, contents].concat();
        use std::io::Write;
        file.write_all(&[small(b"ftyp", b"qt  "), large(b"mdat", 1 << 40)].concat()).unwrap();
        file.seek(SeekFrom::Start(12 + (1 << 40))).unwrap();
        file.write_all(&small(b"moov", &[small(b"trak", &[0; 99]), small(b"meta", b"mdtabansho:version")].concat()))
            .unwrap();
        assert!(is_bansho_file(&path));
    }

    #[test]
    fn boxes_and_blocks_that_lead_nowhere_end() {
        for size in [0_u32, 1, 7, 8, u32::MAX] {
            let film = [b"\0\0\0\x0cftypqt  ".as_slice(), &size.to_be_bytes(), b"moov", &size.to_be_bytes(), b"udta"];
            assert!(!is_marked_with(&film.concat()), "{size}");
        }
        assert!(!is_marked_with(&[b"GIF89a\0\0\0\0\xf7\0\0".as_slice(), &[0x21; 4000]].concat()));
        assert!(!is_marked_with(&[b"GIF89a\0\0\0\0\0\0\0".as_slice(), &[0x21, 0xfe, 200], b"bansho:"].concat()));
        assert!(!is_marked_with(b"\x89PNG\r\n\x1a\n\xff\xff\xff\xfftEXtbansho:version\0"));
        assert!(!is_marked_with(b"GIF89a") && !is_marked_with(&EBML) && !is_marked_with(b""));
    }

    #[test]
    fn what_is_no_file_bears_no_mark() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!is_bansho_file(folder.path()) && !is_bansho_file(&folder.path().join("gone")));
    }
}
