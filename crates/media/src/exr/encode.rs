//! Frames to OpenEXR bytes: one part, lines in increasing order, ZIP in blocks of 16 lines, compressed by the `exr` crate.

use std::{borrow::Cow, ops::Range, path::Path};

use ::exr::{
    compression::Compression,
    math::Vec2,
    meta::{
        BlockDescription,
        attribute::{ChannelDescription, IntegerBounds, LineOrder, SampleType, Text},
        header::Header as CrateHeader,
    },
};
use bansho_base::{
    frame::{Frame, Precision},
    host::observer::{Observer, Unobserved, check},
};

use super::header::{self, ChannelDeclaration, EncodedHeader, FileColors, Window};
use crate::{
    error::{MediaError, SizeRule},
    fingerprint,
};
use half::slice::HalfFloatSliceExt;
use rayon::prelude::*;

/// Lines in a compressed block.
const LINES_PER_BLOCK: usize = 16;
/// Largest side that is written, pixels.
const SIDE_LIMIT: usize = 1 << 20;

/// The bytes of an OpenEXR file of `frame`: beauty as half `R,G,B,A`, depth as float `Z`, and every layer and AOV under
/// its own name. A name without a component (`torch.temperature_k`) gets the suffix `.V`, without which readers ignore the channel.
/// Colors are ACEScg, premultiplied. Compressed in parallel in the caller's rayon pool; the same frame gives the same bytes with any number of
/// threads. Colors beyond the range of half are clamped to 65504, and NaN becomes 0, as in display formats. Depth and AOVs are not changed.
///
/// # Errors
/// A size that the format does not allow, channels of another length than the picture, names that are empty, too long or duplicate. `path` is only
/// used in errors.
pub fn encode(frame: &Frame, path: &Path) -> Result<Vec<u8>, MediaError> {
    encode_observed(frame, path, &Unobserved)
}

/// As [`encode`]; the observer is asked before each block of lines whether to stop.
///
/// # Errors
/// As [`encode`]; [`MediaError::Cancelled`].
pub fn encode_observed(frame: &Frame, path: &Path, observer: &dyn Observer) -> Result<Vec<u8>, MediaError> {
    encode_with(frame, FileColors::Acescg, path, observer)
}

/// As [`encode`], of a file whose red, green and blue are no colors, such as motion or opacity: it has no chromaticities, and its `colorInteropID` is
/// `data`.
///
/// # Errors
/// As [`encode`].
pub fn encode_data(frame: &Frame, path: &Path) -> Result<Vec<u8>, MediaError> {
    encode_with(frame, FileColors::Data, path, &Unobserved)
}

fn encode_with(frame: &Frame, colors: FileColors, path: &Path, observer: &dyn Observer) -> Result<Vec<u8>, MediaError> {
    let planes = planes(frame);
    check_planes(frame, &planes, path)?;
    let (data, display) = windows(frame, path)?;
    let blocks = compressed_blocks(frame, &planes, path, observer)?;
    let channels: Vec<ChannelDeclaration> =
        planes.iter().map(|plane| ChannelDeclaration { name: &plane.name, precision: plane.precision }).collect();
    let EncodedHeader { bytes: mut file, digest_at } =
        header::encode_header(&frame.header, colors, &channels, data, display);
    // The header, a table of the positions of all blocks, then the blocks, each with its first line and its length.
    let mut offset = file.len() + 8 * blocks.len();
    file.reserve(8 * blocks.len() + blocks.iter().map(|block| block.len() + 8).sum::<usize>());
    for block in &blocks {
        file.extend((offset as u64).to_le_bytes());
        offset += 8 + block.len();
    }
    for (index, block) in blocks.iter().enumerate() {
        let line = data.min[1] + (index * LINES_PER_BLOCK) as i32;
        file.extend(line.to_le_bytes());
        file.extend((block.len() as u32).to_le_bytes());
        file.extend_from_slice(block);
    }
    // Of the file with zeros in place of the digits.
    let digest = fingerprint::to_hex(blake3::hash(&file).as_bytes());
    file[digest_at..digest_at + 64].copy_from_slice(digest.as_bytes());
    Ok(file)
}

fn check_planes(frame: &Frame, planes: &[ChannelPlane<'_>], path: &Path) -> Result<(), MediaError> {
    let expected = frame.beauty.width() * frame.beauty.height();
    for (index, plane) in planes.iter().enumerate() {
        let name = &*plane.name;
        // The planes are sorted by name.
        let is_duplicate = index > 0 && planes[index - 1].name == name;
        if name.split('.').any(str::is_empty) || name.len() > 255 || name.contains('\0') || is_duplicate {
            return Err(MediaError::ChannelName { path: path.to_path_buf(), name: name.to_owned() });
        }
        if plane.len() != expected {
            let (path, plane_name) = (path.to_path_buf(), name.to_owned());
            return Err(MediaError::PlaneLength { path, plane: plane_name, got: plane.len(), expected });
        }
    }
    Ok(())
}

/// Data window and display window.
fn windows(frame: &Frame, path: &Path) -> Result<(Window, Window), MediaError> {
    let size = [frame.beauty.width(), frame.beauty.height()];
    let data = window(frame.header.data_origin, size);
    let display = window([0, 0], frame.header.display_size);
    data.zip(display).ok_or(MediaError::Size {
        path: path.to_path_buf(),
        width: size[0],
        height: size[1],
        allowed: SizeRule::UpTo(SIDE_LIMIT),
    })
}

fn window(origin: [i64; 2], size: [usize; 2]) -> Option<Window> {
    if size.iter().any(|&side| side == 0 || side > SIDE_LIMIT) {
        return None;
    }
    let min = [i32::try_from(origin[0]).ok()?, i32::try_from(origin[1]).ok()?];
    let max = [min[0].checked_add(size[0] as i32 - 1)?, min[1].checked_add(size[1] as i32 - 1)?];
    Some(Window { min, max })
}

fn compressed_blocks(
    frame: &Frame,
    planes: &[ChannelPlane<'_>],
    path: &Path,
    observer: &dyn Observer,
) -> Result<Vec<Vec<u8>>, MediaError> {
    let (width, height) = (frame.beauty.width(), frame.beauty.height());
    let header = crate_header(planes, width, height);
    let bytes_per_line = width * planes.iter().map(ChannelPlane::bytes_per_value).sum::<usize>();
    (0..height.div_ceil(LINES_PER_BLOCK))
        .into_par_iter()
        .map(|index| {
            check(observer)?;
            let lines = index * LINES_PER_BLOCK..((index + 1) * LINES_PER_BLOCK).min(height);
            let (mut bytes, mut row) = (Vec::with_capacity(bytes_per_line * lines.len()), PlaneRow::default());
            // Line by line, and in each all values of a channel together.
            for line in lines.clone() {
                planes.iter().for_each(|plane| plane.append(line * width..(line + 1) * width, &mut row, &mut bytes));
            }
            let section = IntegerBounds::new(Vec2(0, lines.start as i32), Vec2(width, lines.len()));
            let compressed = header.compression.compress_image_section_to_le(&header, bytes, section);
            compressed.map_err(|error| MediaError::Encode { path: path.to_path_buf(), reason: error.to_string() })
        })
        .collect()
}

/// The header that the crate needs to compress a block.
fn crate_header(planes: &[ChannelPlane<'_>], width: usize, height: usize) -> CrateHeader {
    let kinds = planes.iter().map(|plane| match plane.precision {
        Precision::Half => SampleType::F16,
        Precision::Single => SampleType::F32,
    });
    // The crate uses only the type. A dummy name avoids its checks of names.
    let channels = kinds.map(|kind| ChannelDescription::new(Text::new_or_none("c").unwrap_or_default(), kind, false));
    CrateHeader::new(Text::default(), (width, height), channels.collect()).with_encoding(
        Compression::ZIP16,
        BlockDescription::ScanLines,
        LineOrder::Increasing,
    )
}

/// Largest finite half, to which brighter pixels are clamped: infinities and NaN spread in every filter.
const HALF_MAX: f32 = 65504.0;

/// Component names that readers recognize. Blender ignores channels with other suffixes.
const COMPONENTS: [&str; 10] = ["R", "G", "B", "A", "X", "Y", "Z", "U", "V", "W"];

/// One channel of the file.
struct ChannelPlane<'a> {
    name: Cow<'a, str>,
    precision: Precision,
    source: ChannelSource<'a>,
}

enum ChannelSource<'a> {
    /// Component 0 to 3 of the color.
    Beauty(&'a [[f32; 4]], usize),
    Values(&'a [f32]),
}

/// All channels of `frame`, sorted by name as the format requires.
fn planes(frame: &Frame) -> Vec<ChannelPlane<'_>> {
    let beauty = ["R", "G", "B", "A"].into_iter().enumerate().map(|(component, name)| ChannelPlane {
        name: name.into(),
        precision: Precision::Half,
        source: ChannelSource::Beauty(frame.beauty.pixels(), component),
    });
    let depth = frame.depth.iter().map(|values| ChannelPlane {
        name: "Z".into(),
        precision: Precision::Single,
        source: ChannelSource::Values(values),
    });
    let channels = frame.channels.iter().map(|channel| ChannelPlane {
        name: exr_channel_name(&channel.name),
        precision: channel.precision,
        source: ChannelSource::Values(&channel.values),
    });
    let mut planes: Vec<_> = beauty.chain(depth).chain(channels).collect();
    planes.sort_by(|a, b| a.name.as_bytes().cmp(b.name.as_bytes()));
    planes
}

/// Channel name in the file. A scalar quantity such as `torch.temperature_k` becomes the single component `V` of a layer.
fn exr_channel_name(name: &str) -> Cow<'_, str> {
    let is_component = name.rsplit('.').next().is_some_and(|last| COMPONENTS.contains(&last));
    if is_component { name.into() } else { format!("{name}.V").into() }
}

impl ChannelPlane<'_> {
    /// Number of values.
    fn len(&self) -> usize {
        match self.source {
            ChannelSource::Beauty(pixels, _) => pixels.len(),
            ChannelSource::Values(values) => values.len(),
        }
    }

    /// Bytes of a value in the file.
    fn bytes_per_value(&self) -> usize {
        match self.precision {
            Precision::Half => 2,
            Precision::Single => 4,
        }
    }

    /// Appends the values of the pixels `range`, in native byte order.
    fn append(&self, range: Range<usize>, row: &mut PlaneRow, bytes: &mut Vec<u8>) {
        row.floats.clear();
        match self.source {
            ChannelSource::Beauty(pixels, component) => {
                row.floats.extend(pixels[range].iter().map(|pixel| pixel[component]));
            }
            ChannelSource::Values(values) => row.floats.extend_from_slice(&values[range]),
        }
        match self.precision {
            Precision::Single => bytes.extend_from_slice(bytemuck::cast_slice(&row.floats)),
            Precision::Half => {
                row.floats.iter_mut().for_each(|value| *value = finite_half(*value));
                row.halves.resize(row.floats.len(), half::f16::ZERO);
                row.halves.convert_from_f32_slice(&row.floats);
                bytes.extend(row.halves.iter().flat_map(|half| half.to_ne_bytes()));
            }
        }
    }
}

/// A finite color within the range of half.
#[inline(always)]
fn finite_half(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(-HALF_MAX, HALF_MAX) }
}

/// Buffer for the conversion of a row.
#[derive(Default)]
struct PlaneRow {
    floats: Vec<f32>,
    halves: Vec<half::f16>,
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use bansho_base::{camera::Lens, frame::Channel};

    use super::*;
    use crate::testing;

    /// Asks to stop once it was asked this many times.
    struct StopsAfter(AtomicUsize);

    impl Observer for StopsAfter {
        fn cancelled(&self) -> bool {
            self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_err()
        }
    }

    #[test]
    fn the_observer_stops_it_between_blocks_of_lines() {
        // Six blocks.
        let frame = testing::frame(50, 90);
        let encoded = |times| encode_observed(&frame, Path::new("a.exr"), &StopsAfter(AtomicUsize::new(times)));
        assert!(matches!(encoded(5), Err(MediaError::Cancelled(_))));
        assert_eq!(encoded(6).unwrap(), encode(&frame, Path::new("a.exr")).unwrap());
    }

    #[test]
    fn the_same_frame_is_the_same_bytes_whatever_the_threads() {
        let frame = testing::frame(50, 90);
        let encode = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| encode(&frame, Path::new("a.exr")).unwrap())
        };
        let one = encode(1);
        assert!((2..6).all(|threads| encode(threads) == one));
    }

    #[test]
    fn names_and_lengths_that_do_not_fit_are_refused() {
        let path = Path::new("a.exr");
        let named = |name: &str| {
            let mut frame = testing::frame(4, 4);
            frame.channels[0].name = name.to_owned();
            encode(&frame, path)
        };
        for name in [
            "",
            ".",
            "torch.",
            ".V",
            "a..V",
            "R",
            "torch.R",
            "a\0b",
            &"x".repeat(254),
            &format!("{}.R", "x".repeat(254)),
        ] {
            assert!(matches!(named(name), Err(MediaError::ChannelName { .. })), "{name}");
        }
        assert!(named(&"x".repeat(253)).is_ok() && named(&format!("{}.R", "x".repeat(253))).is_ok());
        let mut frame = testing::frame(4, 4);
        frame.channels[1].values.pop();
        assert!(matches!(encode(&frame, path), Err(MediaError::PlaneLength { got: 15, expected: 16, .. })));
        frame.header.data_origin = [i64::MAX, 0];
        frame.channels.clear();
        assert!(matches!(encode(&frame, path), Err(MediaError::Size { .. })));
        frame.header.data_origin = [0, 0];
        frame.header.display_size = [0, 4];
        assert!(matches!(encode(&frame, path), Err(MediaError::Size { .. })));
    }

    #[test]
    fn a_quantity_is_the_component_that_readers_look_for() {
        let mut frame = testing::frame(4, 4);
        let (quantity, direction) = (frame.channels[0].clone(), "torch.motion.X".to_owned());
        frame
            .channels
            .extend([Channel { name: direction, ..quantity.clone() }, Channel { name: "opacity".into(), ..quantity }]);
        let names: Vec<_> = planes(&frame).into_iter().map(|plane| plane.name.into_owned()).collect();
        let layers = ["opacity.V", "torch.R", "torch.motion.X", "torch.temperature_k.V"];
        assert_eq!(names, [&["A", "B", "G", "R", "Z"][..], &layers].concat());
        // What is the same in the file is double, however it was called.
        frame.channels[2].name = "torch.temperature_k.V".into();
        assert!(matches!(encode(&frame, Path::new("a.exr")), Err(MediaError::ChannelName { .. })));
    }

    #[test]
    fn what_is_not_known_of_a_lens_does_not_stand_in_the_file() {
        let contains = |frame: &Frame, name: &str| {
            let file = encode(frame, Path::new("a.exr")).unwrap();
            file.windows(name.len() + 1).any(|part| part == [name.as_bytes(), b"\0"].concat())
        };
        let mut frame = testing::frame(8, 8);
        assert!(
            contains(&frame, "worldToNDC") && contains(&frame, "verticalFovDeg") && !contains(&frame, "bansho:lens")
        );
        let camera = &mut frame.header.camera;
        (camera.world_to_ndc, camera.vertical_fov_deg) = (None, None);
        (camera.lens, camera.fisheye_fov_deg) = (Some(Lens::Fisheye), Some(200.0));
        assert!(!contains(&frame, "worldToNDC") && !contains(&frame, "verticalFovDeg"));
        assert!(contains(&frame, "bansho:lens") && contains(&frame, "bansho:fisheyeFovDeg"));
    }

    #[test]
    fn data_do_not_claim_to_be_colors() {
        let frame = testing::frame(8, 8);
        let [color, data] = [encode, encode_data].map(|encode| encode(&frame, Path::new("a.exr")).unwrap());
        let contains = |file: &[u8], word: &str| file.windows(word.len()).any(|part| part == word.as_bytes());
        for (word, in_color, in_data) in [
            ("chromaticities", true, false),
            ("adoptedNeutral", true, false),
            ("lin_ap1_scene", true, false),
            ("colorInteropID\0string\0\x04\0\0\0data", false, true),
        ] {
            assert_eq!([contains(&color, word), contains(&data, word)], [in_color, in_data], "{word}");
        }
    }

    #[test]
    fn no_path_time_or_machine_stands_in_the_file() {
        let file = encode(&testing::frame(8, 8), Path::new("secret/a.exr")).unwrap();
        for word in [&b"secret"[..], b"capDate", b"utcOffset", b"hostname"] {
            assert!(!file.windows(word.len()).any(|part| part == word));
        }
    }
}
