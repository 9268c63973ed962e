//! Frames to OpenEXR bytes: one part, lines in increasing order, ZIP in blocks of 16 lines.
//!
//! The header is written here rather than by the `exr` crate, which keeps custom attributes in a hash map and so writes
//! them in another order every time. Bansho writes the same bytes for the same frame. The compression is by the crate.

use std::path::Path;

use ::exr::{
    compression::Compression,
    math::Vec2,
    meta::{
        BlockDescription,
        attribute::{ChannelDescription, IntegerBounds, LineOrder, SampleType, Text},
        header::Header as CrateHeader,
    },
};
use bansho_base::frame::{Frame, Precision};

use super::{
    attribute::{self, Header, Window},
    plane::{ChannelPlane, RowBuffer, planes},
};
use crate::{
    error::{MediaError, SizeRule},
    fingerprint,
};
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
    let planes = planes(frame);
    check_planes(frame, &planes, path)?;
    let (data, display) = windows(frame, path)?;
    let blocks = compressed_blocks(frame, &planes, path)?;
    let Header { bytes: mut file, digest_at } = attribute::header(&frame.header, &planes, data, display);
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
    let digest = fingerprint::to_hex(blake3::hash(&file).as_bytes());
    file[digest_at..digest_at + 64].copy_from_slice(digest.as_bytes());
    Ok(file)
}

fn check_planes(frame: &Frame, planes: &[ChannelPlane<'_>], path: &Path) -> Result<(), MediaError> {
    let expected = frame.beauty.width() * frame.beauty.height();
    for (index, plane) in planes.iter().enumerate() {
        let name = &*plane.name;
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

fn compressed_blocks(frame: &Frame, planes: &[ChannelPlane<'_>], path: &Path) -> Result<Vec<Vec<u8>>, MediaError> {
    let (width, height) = (frame.beauty.width(), frame.beauty.height());
    let header = crate_header(planes, width, height);
    let bytes_per_line = width * planes.iter().map(ChannelPlane::bytes_per_value).sum::<usize>();
    let block = |index: usize| {
        let lines = index * LINES_PER_BLOCK..((index + 1) * LINES_PER_BLOCK).min(height);
        let (mut bytes, mut row) = (Vec::with_capacity(bytes_per_line * lines.len()), RowBuffer::default());
        for line in lines.clone() {
            planes.iter().for_each(|plane| plane.append(line * width..(line + 1) * width, &mut row, &mut bytes));
        }
        let section = IntegerBounds::new(Vec2(0, lines.start as i32), Vec2(width, lines.len()));
        header.compression.compress_image_section_to_le(&header, bytes, section)
    };
    (0..height.div_ceil(LINES_PER_BLOCK))
        .into_par_iter()
        .map(block)
        .collect::<Result<_, _>>()
        .map_err(|error| MediaError::Encode { path: path.to_path_buf(), reason: error.to_string() })
}

/// The header that the crate needs to compress a block.
fn crate_header(planes: &[ChannelPlane<'_>], width: usize, height: usize) -> CrateHeader {
    let channel = |plane: &ChannelPlane<'_>| {
        let kind = match plane.precision {
            Precision::Half => SampleType::F16,
            Precision::Single => SampleType::F32,
        };
        // The crate uses only the type. A dummy name avoids its checks of names.
        ChannelDescription::new(Text::new_or_none("c").unwrap_or_default(), kind, false)
    };
    CrateHeader::new(Text::default(), (width, height), planes.iter().map(channel).collect()).with_encoding(
        Compression::ZIP16,
        BlockDescription::ScanLines,
        LineOrder::Increasing,
    )
}

#[cfg(test)]
mod tests {
    use bansho_base::{camera::Lens, frame::Channel};

    use super::*;
    use crate::testing;

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
    fn no_path_time_or_machine_stands_in_the_file() {
        let file = encode(&testing::frame(8, 8), Path::new("secret/a.exr")).unwrap();
        for word in [&b"secret"[..], b"capDate", b"utcOffset", b"hostname"] {
            assert!(!file.windows(word.len()).any(|part| part == word));
        }
    }
}
