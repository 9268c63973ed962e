//! The header of an OpenEXR file, written and read ("OpenEXR File Layout": attributes of name, type, size and value; little-endian).
//!
//! It is written by these functions rather than by the `exr` crate, which keeps custom attributes in a hash map and so writes them in another order every
//! time. It is read for untrusted files: every length is checked against the bytes of the file.

use std::ops::Range;

use bansho_base::{
    camera::CameraHeader,
    color::white_balance::chromaticity,
    frame::{FrameHeader, Precision},
};

use super::{
    KEY_COLOR_SPACE, KEY_DIGEST, KEY_EXPOSURE, KEY_FINGERPRINT, KEY_FISHEYE_FOV, KEY_LENS, KEY_VERSION,
    KEY_WORLD_TO_CAMERA, KEY_WORLD_TO_NDC,
};
use crate::{decode::color::primaries::AP1, fingerprint, frame_rate};

/// What red, green and blue of a file are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FileColors {
    /// Scene-linear ACEScg.
    Acescg,
    /// No colors, such as motion: readers must not convert them.
    Data,
}

impl FileColors {
    /// Its name by the Color Interop Forum, for readers that ignore chromaticities, such as Blender.
    fn color_space(self) -> &'static str {
        match self {
            Self::Acescg => "lin_ap1_scene",
            Self::Data => "data",
        }
    }
}

/// First bytes of every file.
pub(crate) const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
/// Set in the version field where a name is longer than 31 bytes.
const FLAG_LONG_NAMES: u32 = 0x400;
/// ZIP compression of blocks of 16 lines.
const COMPRESSION_ZIP16: u8 = 3;

/// A rectangle as OpenEXR stores it: both ends are inclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Window {
    pub(crate) min: [i32; 2],
    pub(crate) max: [i32; 2],
}

impl Window {
    /// Width and height, pixels; 0 where an upper end is below the lower one.
    pub(crate) fn size(self) -> [u64; 2] {
        [0, 1].map(|axis| (i64::from(self.max[axis]) - i64::from(self.min[axis]) + 1).max(0) as u64)
    }
}

/// A channel to be declared in a header.
pub(crate) struct ChannelDeclaration<'a> {
    pub(crate) name: &'a str,
    pub(crate) precision: Precision,
}

/// A header being written.
struct HeaderBytes(Vec<u8>);

/// A frame rate for the format, whose numerator is a signed integer.
fn rational(fps: [u32; 2]) -> [u32; 2] {
    const MAX: u32 = i32::MAX.cast_unsigned();
    if fps[0] <= MAX { fps } else { frame_rate::approximate(fps, MAX).unwrap_or(fps) }
}

/// A header in which the 64 digits of the digest are zeros.
pub(crate) struct EncodedHeader {
    pub(crate) bytes: Vec<u8>,
    /// Offset of the digits of the digest.
    pub(crate) digest_at: usize,
}

/// The header of a frame with red, green and blue of these `colors`. No attribute depends on time, host or path, and their order is fixed.
pub(crate) fn encode_header(
    frame: &FrameHeader,
    colors: FileColors,
    channels: &[ChannelDeclaration<'_>],
    data: Window,
    display: Window,
) -> EncodedHeader {
    let mut bytes = HeaderBytes::begin(channels.iter().any(|channel| channel.name.len() > 31));
    bytes.attribute("channels", "chlist", &channel_list(channels));
    bytes.attribute("compression", "compression", &[COMPRESSION_ZIP16]);
    bytes.window("dataWindow", data);
    bytes.window("displayWindow", display);
    // 0: from the top to the bottom.
    bytes.attribute("lineOrder", "lineOrder", &[0]);
    bytes.floats("pixelAspectRatio", "float", &[1.0]);
    bytes.floats("screenWindowCenter", "v2f", &[0.0; 2]);
    bytes.floats("screenWindowWidth", "float", &[1.0]);
    if colors == FileColors::Acescg {
        bytes.floats("chromaticities", "chromaticities", AP1.as_flattened());
    }
    bytes.attribute(KEY_COLOR_SPACE, "string", colors.color_space().as_bytes());
    if colors == FileColors::Acescg {
        let white = frame.white_balance_k.map(|kelvin| chromaticity(f64::from(kelvin)).map(|value| value as f32));
        bytes.floats("adoptedNeutral", "v2f", &white.unwrap_or(AP1[3]));
    }
    let rational = rational(frame.fps).map(u32::to_le_bytes);
    bytes.attribute("framesPerSecond", "rational", rational.as_flattened());
    let number = frame.number.clamp(i32::MIN.into(), i32::MAX.into()) as i32;
    bytes.attribute("imageCounter", "int", &number.to_le_bytes());
    bytes.floats("expTime", "float", &[frame.exposure_time_s]);
    bytes.floats(KEY_EXPOSURE, "float", &[frame.exposure_ev100]);
    bytes.matrix("worldToCamera", KEY_WORLD_TO_CAMERA, &frame.camera.world_to_camera);
    lens(&frame.camera, &mut bytes);
    bytes.attribute("software", "string", format!("Bansho {}", fingerprint::VERSION).as_bytes());
    bytes.attribute(KEY_VERSION, "string", fingerprint::VERSION.as_bytes());
    bytes.attribute(KEY_FINGERPRINT, "string", fingerprint::to_hex(&frame.fingerprint).as_bytes());
    bytes.attribute(KEY_DIGEST, "string", &[b'0'; 64]);
    // The last attribute, so that its digits end where the header does, before the zero that ends the list.
    let HeaderBytes(mut bytes) = bytes;
    let digest_at = bytes.len() - 64;
    bytes.push(0);
    EncodedHeader { bytes, digest_at }
}

/// The lens. A projection matrix and a field of view are written only for perspective cameras, since they cannot describe a dome or a panorama.
fn lens(camera: &CameraHeader, bytes: &mut HeaderBytes) {
    if let Some(matrix) = &camera.world_to_ndc {
        bytes.matrix("worldToNDC", KEY_WORLD_TO_NDC, matrix);
    }
    if let Some(angle) = camera.vertical_fov_deg {
        bytes.floats("verticalFovDeg", "float", &[angle]);
    }
    if let Some(lens) = camera.lens {
        bytes.attribute(KEY_LENS, "string", lens.name().as_bytes());
    }
    if let Some(angle) = camera.fisheye_fov_deg {
        bytes.floats(KEY_FISHEYE_FOV, "float", &[angle]);
    }
}

impl HeaderBytes {
    fn begin(long_names: bool) -> Self {
        let version = 2 | if long_names { FLAG_LONG_NAMES } else { 0 };
        Self([MAGIC, version.to_le_bytes()].concat())
    }

    fn attribute(&mut self, name: &str, kind: &str, value: &[u8]) {
        for text in [name, kind] {
            self.0.extend(text.as_bytes());
            self.0.push(0);
        }
        self.0.extend((value.len() as u32).to_le_bytes());
        self.0.extend(value);
    }

    fn floats(&mut self, name: &str, kind: &str, values: &[f32]) {
        let bytes: Vec<[u8; 4]> = values.iter().map(|value| value.to_le_bytes()).collect();
        self.attribute(name, kind, bytes.as_flattened());
    }

    /// The standard attribute of a matrix, which has single precision, and our own with all digits: centimeters count far from the origin.
    fn matrix(&mut self, standard: &str, precise: &str, matrix: &[[f64; 4]; 4]) {
        let rounded: Vec<f32> = matrix.as_flattened().iter().map(|value| *value as f32).collect();
        self.floats(standard, "m44f", &rounded);
        let bytes: Vec<[u8; 8]> = matrix.as_flattened().iter().map(|value| value.to_le_bytes()).collect();
        self.attribute(precise, "m44d", bytes.as_flattened());
    }

    fn window(&mut self, name: &str, window: Window) {
        let [x0, y0] = window.min;
        let [x1, y1] = window.max;
        self.attribute(name, "box2i", [x0, y0, x1, y1].map(i32::to_le_bytes).as_flattened());
    }
}

fn channel_list(channels: &[ChannelDeclaration<'_>]) -> Vec<u8> {
    let mut list = Vec::new();
    for channel in channels {
        list.extend(channel.name.as_bytes());
        list.push(0);
        let kind: u32 = match channel.precision {
            Precision::Half => 1,
            Precision::Single => 2,
        };
        list.extend(kind.to_le_bytes());
        list.extend([0; 4]); // not perceptually linear, and three reserved bytes
        list.extend([1_u32.to_le_bytes(); 2].as_flattened()); // a sample for every pixel
    }
    list.push(0);
    list
}

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
    /// Whether its tiles are of several levels of resolution.
    pub(crate) has_levels: bool,
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
    #[error("it is not an OpenEXR file")]
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

/// Lines in a chunk of a part of scan lines with this compression; the largest of all for one that is not known.
pub(crate) fn lines_in_chunk(compression: Option<u8>) -> u64 {
    match compression {
        // None, RLE, ZIPS.
        Some(0..=2) => 1,
        // ZIP, PXR24.
        Some(3 | 5) => 16,
        // PIZ, B44, B44A, DWAA.
        Some(4 | 6..=8) => 32,
        // DWAB.
        _ => 256,
    }
}

/// Reads the header of `file`.
pub(crate) fn parse_header(file: &[u8]) -> Result<FileHeader, HeaderError> {
    parse_header_and_end(file).map(|(header, _)| header)
}

/// Reads the header of `file`; and where the table of its chunks begins.
pub(crate) fn parse_header_and_end(file: &[u8]) -> Result<(FileHeader, usize), HeaderError> {
    let mut reader = AttributeReader { file, at: 0 };
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
        // In each round, so that memory is bounded whatever the file lists.
        if parts.len() > MAX_PARTS || channels > MAX_CHANNELS {
            return Err(HeaderError::TooManyParts);
        }
        // A list of several parts ends with an empty header, a single zero byte.
        if version & FLAG_PARTS == 0 || reader.file.get(reader.at) == Some(&0) {
            let end = reader.at + usize::from(version & FLAG_PARTS != 0);
            return Ok((FileHeader { parts, deep: version & FLAG_DEEP != 0 }, end));
        }
    }
}

/// Reads values of attributes.
struct AttributeReader<'a> {
    file: &'a [u8],
    at: usize,
}

impl<'a> AttributeReader<'a> {
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
            // The value is read from the file up to its end, so that positions within it are those of the file.
            let start = self.at;
            let file = self.take(size).map(|_| &self.file[..start + size])?;
            let value = AttributeReader { file, at: start };
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
            // 1 is half; 0 and 2 are whole numbers and single precision.
            let bytes_per_sample = if self.int()? == 1 { 2 } else { 4 };
            // Whether it is perceptually linear, and three reserved bytes.
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
    fn set_attribute(&mut self, name: &str, kind: &[u8], mut value: AttributeReader<'_>) -> Option<()> {
        match (name, kind) {
            ("channels", b"chlist") => self.channels = value.channels()?,
            ("compression", b"compression") => self.compression = Some(value.array::<1>()?[0]),
            ("dataWindow", b"box2i") => self.data_window = Some(value.window()?),
            ("displayWindow", b"box2i") => self.display_window = Some(value.window()?),
            ("tiles", b"tiledesc") => {
                self.tile = Some([value.array().map(u32::from_le_bytes)?, value.array().map(u32::from_le_bytes)?]);
                self.has_levels = value.array::<1>().is_some_and(|[mode]| mode & 15 != 0);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_beyond_a_signed_number_keep_their_value() {
        for fps in [[30, 1], [29_970, 1000], [i32::MAX.cast_unsigned(), 7]] {
            assert_eq!(rational(fps), fps);
        }
        for fps in [[u32::MAX, 4_294_968], [4_000_000_000, 3_999_999_999], [3_000_000_001, 100_000_000]] {
            let rate = |[frames, seconds]: [u32; 2]| f64::from(frames) / f64::from(seconds);
            let kept = rational(fps);
            assert!(i32::try_from(kept[0]).is_ok() && (rate(kept) / rate(fps) - 1.0).abs() < 1e-9, "{fps:?}: {kept:?}");
        }
    }
}
