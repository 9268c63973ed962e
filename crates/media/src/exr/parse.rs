//! Parser of OpenEXR headers for untrusted files: every length is checked against the bytes of the file.

use std::ops::Range;

use super::attribute::{FLAG_LONG_NAMES, MAGIC, Window};

/// The header of one part.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PartHeader {
    /// The part's name, which files of several parts have.
    pub(crate) name: Option<String>,
    pub(crate) channels: Vec<ChannelEntry>,
    pub(crate) compression: Option<u8>,
    pub(crate) data_window: Option<Window>,
    pub(crate) display_window: Option<Window>,
    /// Width and height of a tile, pixels; `None` for scan lines.
    pub(crate) tile: Option<[u32; 2]>,
    /// CIE xy of red, green, blue and white.
    pub(crate) chromaticities: Option<[[f32; 2]; 4]>,
    /// String attributes: name, and range of bytes in the file.
    pub(crate) strings: Vec<(String, Range<usize>)>,
    pub(crate) floats: Vec<(String, f32)>,
}

/// A channel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ChannelEntry {
    pub(crate) name: String,
    pub(crate) bytes_per_sample: u64,
    /// Subsampling in x and y.
    pub(crate) sampling: [i32; 2],
}

/// The headers of all parts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FileHeader {
    pub(crate) parts: Vec<PartHeader>,
    pub(crate) deep: bool,
}

/// Why a header is unreadable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum HeaderError {
    #[error("it does not begin as an OpenEXR file")]
    NotExr,
    #[error("its header is truncated or damaged")]
    Damaged,
    #[error("its header has more than {MAX_PARTS} parts or {MAX_CHANNELS} channels")]
    TooManyParts,
}

const MAX_PARTS: usize = 256;
const MAX_CHANNELS: usize = 4096;
const FLAG_DEEP: u32 = 0x800;
const FLAG_PARTS: u32 = 0x1000;

impl PartHeader {
    /// The float attribute `name`.
    pub(crate) fn float(&self, name: &str) -> Option<f64> {
        self.floats.iter().find(|(key, _)| key == name).map(|(_, value)| f64::from(*value))
    }

    /// Byte range of the string attribute `name` in the file.
    pub(crate) fn string(&self, name: &str) -> Option<Range<usize>> {
        self.strings.iter().find(|(key, _)| key == name).map(|(_, range)| range.clone())
    }
}

/// Reads the header of `file`.
pub(crate) fn parse_header(file: &[u8]) -> Result<FileHeader, HeaderError> {
    let mut reader = Reader { file, at: 0 };
    if reader.array() != Some(MAGIC) {
        return Err(HeaderError::NotExr);
    }
    let version = reader.array().map(u32::from_le_bytes).ok_or(HeaderError::Damaged)?;
    let name_limit = if version & FLAG_LONG_NAMES != 0 { 255 } else { 31 };
    let mut parts = Vec::new();
    loop {
        let part = reader.part(name_limit).ok_or(HeaderError::Damaged)?;
        let channels: usize =
            part.channels.len() + parts.iter().map(|part: &PartHeader| part.channels.len()).sum::<usize>();
        parts.push(part);
        if parts.len() > MAX_PARTS || channels > MAX_CHANNELS {
            return Err(HeaderError::TooManyParts);
        }
        // A list of several parts ends with an empty header, a single zero byte.
        if version & FLAG_PARTS == 0 || reader.file.get(reader.at) == Some(&0) {
            return Ok(FileHeader { parts, deep: version & FLAG_DEEP != 0 });
        }
    }
}

struct Reader<'a> {
    file: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let bytes = self.file.get(self.at..)?.get(..length)?;
        self.at += length;
        Some(bytes)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    fn int(&mut self) -> Option<i32> {
        self.array().map(i32::from_le_bytes)
    }

    fn float(&mut self) -> Option<f32> {
        self.array().map(f32::from_le_bytes)
    }

    /// Text up to a zero byte, at most `limit` bytes.
    fn text(&mut self, limit: usize) -> Option<&'a [u8]> {
        let rest = self.file.get(self.at..)?;
        let length = rest.iter().take(limit + 1).position(|&byte| byte == 0)?;
        self.at += length + 1;
        Some(&rest[..length])
    }

    fn part(&mut self, name_limit: usize) -> Option<PartHeader> {
        let mut part = PartHeader::default();
        loop {
            let name = self.text(name_limit)?;
            if name.is_empty() {
                return Some(part);
            }
            let kind = self.text(name_limit)?;
            let size = usize::try_from(self.int()?).ok()?;
            let start = self.at;
            let file = self.take(size).map(|_| &self.file[..start + size])?;
            let value = Reader { file, at: start };
            part.set_attribute(&String::from_utf8_lossy(name), kind, value)?;
        }
    }

    fn window(&mut self) -> Option<Window> {
        Some(Window { min: [self.int()?, self.int()?], max: [self.int()?, self.int()?] })
    }

    fn pair(&mut self) -> Option<[f32; 2]> {
        Some([self.float()?, self.float()?])
    }

    fn channels(&mut self) -> Option<Vec<ChannelEntry>> {
        let mut channels = Vec::new();
        loop {
            let name = self.text(255)?;
            if name.is_empty() {
                return Some(channels);
            }
            let bytes_per_sample = if self.int()? == 1 { 2 } else { 4 };
            self.take(4)?;
            let sampling = [self.int()?, self.int()?];
            channels.push(ChannelEntry {
                name: String::from_utf8_lossy(name).into_owned(),
                bytes_per_sample,
                sampling,
            });
        }
    }
}

impl PartHeader {
    fn set_attribute(&mut self, name: &str, kind: &[u8], mut value: Reader<'_>) -> Option<()> {
        match (name, kind) {
            ("channels", b"chlist") => self.channels = value.channels()?,
            ("compression", b"compression") => self.compression = Some(value.array::<1>()?[0]),
            ("dataWindow", b"box2i") => self.data_window = Some(value.window()?),
            ("displayWindow", b"box2i") => self.display_window = Some(value.window()?),
            ("tiles", b"tiledesc") => {
                self.tile = Some([value.array().map(u32::from_le_bytes)?, value.array().map(u32::from_le_bytes)?]);
            }
            ("chromaticities", b"chromaticities") => {
                self.chromaticities = Some([value.pair()?, value.pair()?, value.pair()?, value.pair()?]);
            }
            ("name", b"string") => {
                let text = &value.file[value.at..];
                self.name = Some(String::from_utf8_lossy(text).into_owned());
            }
            (_, b"float") => self.floats.push((name.to_owned(), value.float()?)),
            (_, b"string") => self.strings.push((name.to_owned(), value.at..value.file.len())),
            _ => {}
        }
        Some(())
    }
}
