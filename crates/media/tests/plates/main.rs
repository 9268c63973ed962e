//! Plates of every format are read, and hostile files are rejected.

mod file_assets;

use std::{fs, path::Path};

use bansho_base::{
    camera::CameraHeader,
    color::AlphaConvention,
    frame::{Channel, DisplayEncoding, DisplayImage, DisplayPixels, Frame, FrameHeader, Precision},
    host::assets::{AssetProblem, Encoding, Picture, PictureAlpha, PictureLayers, PictureRemark},
    image::{Image, Rect},
};
use bansho_media::{
    assets, exr,
    limits::MemoryLimit,
    png::{self, PngEffort},
};

fn decode_picture(bytes: &[u8], extension: &str) -> Result<Picture, AssetProblem> {
    assets::decode_picture(bytes, extension, &PictureLayers::default(), MemoryLimit::default())
}

fn display(width: usize, height: usize) -> DisplayImage {
    let pixels = (0..width * height).map(|i| [(i * 5) as u8, (i * 3) as u8, 200, 255 - (i % 7) as u8]).collect();
    DisplayImage {
        width,
        height,
        opaque: false,
        alpha: AlphaConvention::Linear,
        encoding: DisplayEncoding::Srgb,
        pixels: DisplayPixels::Eight(pixels),
    }
}

fn frame(width: usize, height: usize) -> Frame {
    let count = width * height;
    let pixels = (0..count).map(|i| [i as f32 * 0.5, 0.25, -0.5, 0.5]).collect();
    let identity = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
    let camera = CameraHeader {
        world_to_camera: identity,
        world_to_ndc: Some(identity),
        vertical_fov_deg: Some(40.0),
        lens: None,
        fisheye_fov_deg: None,
    };
    let header = FrameHeader {
        number: 1,
        exposure_ev100: 0.0,
        white_balance_k: None,
        fps: [24, 1],
        exposure_time_s: 0.02,
        camera,
        fingerprint: [7; 32],
        display_size: [width, height],
        data_origin: [0, 0],
    };
    let depth = (0..count).map(|i| if i % 3 == 0 { f32::INFINITY } else { i as f32 * 1.5 }).collect();
    let channel = Channel { name: "fire.kelvin".to_owned(), precision: Precision::Single, values: vec![1500.0; count] };
    let beauty = Image::from_pixels(width, height, pixels).unwrap();
    let content = Rect::from_size(beauty.width(), beauty.height());
    Frame { header, beauty, depth: Some(depth), channels: vec![channel], opaque: false, content, metadata: Vec::new() }
}

fn png_bytes(picture: &DisplayImage) -> Vec<u8> {
    png::encode(picture, &[0; 32], PngEffort::Fast, Path::new("a.png")).unwrap()
}

fn exr_bytes(frame: &Frame) -> Vec<u8> {
    exr::encode(frame, Path::new("a.exr")).unwrap()
}

/// A PNG of any color type, by the encoder of the `png` crate.
fn raw_png(width: u32, height: u32, kind: ::png::ColorType, depth: ::png::BitDepth, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(kind);
    encoder.set_depth(depth);
    if kind == ::png::ColorType::Indexed {
        encoder.set_palette(vec![255, 0, 0, 0, 255, 0]);
        encoder.set_trns(vec![255, 51]);
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn png_plates_of_every_kind() {
    use ::png::{BitDepth::*, ColorType::*};
    let first = |bytes: Vec<u8>| decode_picture(&bytes, "PNG").unwrap().color.at(1, 0);
    assert_eq!(first(raw_png(2, 1, Grayscale, Eight, &[0, 51])), [0.2, 0.2, 0.2, 1.0]);
    assert_eq!(first(raw_png(2, 1, Grayscale, One, &[0b0100_0000])), [1.0; 4]);
    assert_eq!(first(raw_png(2, 1, GrayscaleAlpha, Eight, &[0, 0, 255, 51])), [1.0, 1.0, 1.0, 0.2]);
    assert_eq!(first(raw_png(2, 1, Rgb, Eight, &[0, 0, 0, 255, 51, 0])), [1.0, 0.2, 0.0, 1.0]);
    assert_eq!(first(raw_png(2, 1, Indexed, One, &[0b0100_0000])), [0.0, 1.0, 0.0, 0.2]);
    let wide = [0, 0, 0, 0, 0, 0, 0, 0, 255, 255, 0, 0, 0x33, 0x33, 255, 255];
    assert_eq!(first(raw_png(2, 1, Rgba, Sixteen, &wide)), [1.0, 0.0, 0.2, 1.0]);
}

#[test]
fn what_bansho_writes_it_reads() {
    let picture = decode_picture(&png_bytes(&display(9, 5)), "png").unwrap();
    assert_eq!(picture.encoding, Encoding::DisplaySrgb);
    assert_eq!(picture.color.at(2, 1), [55, 33, 200, 251].map(|code| code as f32 / 255.0));

    let original = frame(21, 35);
    let picture = decode_picture(&exr_bytes(&original), "exr").unwrap();
    assert_eq!(picture.encoding, Encoding::LinearAcescg);
    assert_eq!(picture.depth, original.depth);
    // Associated, as it is in the file.
    assert_eq!((picture.color.at(4, 0), picture.alpha), ([2.0, 0.25, -0.5, 0.5], PictureAlpha::Associated));
}

#[test]
fn an_exr_with_another_data_window_is_laid_into_its_display_window() {
    let mut original = frame(4, 3);
    original.header.display_size = [4, 4];
    original.header.data_origin = [-1, 2];
    let picture = decode_picture(&exr_bytes(&original), "exr").unwrap();
    assert_eq!((picture.color.width(), picture.color.height()), (4, 4));
    assert_eq!(picture.color.at(0, 2)[0], 0.5);
    assert_eq!(picture.color.at(2, 3)[0], 3.5);
    assert_eq!(picture.color.at(3, 3), [0.0; 4]);
    assert_eq!(picture.color.at(0, 0), [0.0; 4]);
    assert_eq!(picture.depth.unwrap()[0], f32::INFINITY);
}

/// A tiled file with 70 x 50 floats per channel, by the writer of the `exr` crate.
fn tiled_exr(names: &[&str], compression: ::exr::compression::Compression) -> Vec<u8> {
    use ::exr::prelude::{
        AnyChannel, AnyChannels, Blocks, Encoding as ExrEncoding, FlatSamples, Image as ExrImage, Layer,
        LayerAttributes, LineOrder, Vec2, WritableImage,
    };
    let channel = |(index, name): (usize, &&str)| {
        let samples = (0..70 * 50).map(|i| (i + index) as f32);
        let samples = match *name {
            "half" => FlatSamples::F16(samples.map(half::f16::from_f32).collect()),
            "uint" => FlatSamples::U32(samples.map(|value| value as u32).collect()),
            _ => FlatSamples::F32(samples.collect()),
        };
        AnyChannel::new(*name, samples)
    };
    let channels = AnyChannels::sort(names.iter().enumerate().map(channel).collect());
    let encoding = ExrEncoding { compression, blocks: Blocks::Tiles(Vec2(16, 16)), line_order: LineOrder::Increasing };
    let layer = Layer::new((70, 50), LayerAttributes::default(), encoding, channels);
    let mut bytes = std::io::Cursor::new(Vec::new());
    ExrImage::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

#[test]
fn tiled_float_and_depth_only_exr_files_are_read() {
    use ::exr::prelude::Compression;
    for compression in [Compression::Uncompressed, Compression::RLE, Compression::ZIP1, Compression::PIZ] {
        let picture = decode_picture(&tiled_exr(&["R", "G", "B", "depth.Z"], compression), "exr").unwrap();
        assert_eq!(picture.encoding, Encoding::LinearSrgb);
        assert_eq!(picture.color.at(69, 49), [3499.0, 3500.0, 3501.0, 1.0], "{compression:?}");
        assert_eq!(picture.depth.unwrap()[70], 73.0);
    }
    let depth_only = decode_picture(&tiled_exr(&["distance"], Compression::ZIP16), "exr").unwrap();
    assert_eq!(depth_only.depth.unwrap()[71], 71.0);
    let lossy = decode_picture(&tiled_exr(&["R", "G", "B"], Compression::DWAA(None)), "exr").unwrap();
    assert!((lossy.color.at(40, 30)[0] / 2140.0 - 1.0).abs() < 0.01);
    for kind in ["half", "uint"] {
        assert_eq!(decode_picture(&tiled_exr(&[kind], Compression::ZIP1), "exr").unwrap().depth.unwrap()[71], 71.0);
    }
    let layered = decode_picture(&tiled_exr(&["plate.R", "plate.G", "plate.B"], Compression::ZIP16), "exr").unwrap();
    assert_eq!(layered.color.at(0, 0), [0.0, 1.0, 2.0, 1.0]);
    let useless = decode_picture(&tiled_exr(&["a", "b"], Compression::ZIP16), "exr");
    assert!(matches!(useless, Err(AssetProblem::NoKnownLayer { .. })));
}

/// A gray JPEG of 8 x 8 pixels, all 128: the smallest possible baseline file.
fn grey_jpeg() -> Vec<u8> {
    let mut file = vec![0xFF, 0xD8, 0xFF, 0xDB, 0, 67, 0];
    file.extend([1; 64]);
    file.extend([0xFF, 0xC0, 0, 11, 8, 0, 8, 0, 8, 1, 1, 0x11, 0]);
    // One code each: difference of 0, and end of block.
    for class in [0x00, 0x10] {
        file.extend([0xFF, 0xC4, 0, 20, class, 1]);
        file.extend([0; 15]);
        file.push(0);
    }
    file.extend([0xFF, 0xDA, 0, 8, 1, 1, 0, 0, 63, 0, 0b0011_1111, 0xFF, 0xD9]);
    file
}

#[test]
fn a_jpeg_is_read() {
    let picture = decode_picture(&grey_jpeg(), "JPG").unwrap();
    assert_eq!((picture.color.width(), picture.color.height()), (8, 8));
    let [r, g, b, alpha] = picture.color.at(3, 3);
    assert!((r - 128.0 / 255.0).abs() < 0.01 && r == g && g == b && alpha == 1.0);
}

/// CRC of a changed chunk of a PNG, bit by bit, as in annex D of the standard.
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc: u32, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0xEDB8_8320 } else { crc >> 1 })
    })
}

fn with_png_size(mut file: Vec<u8>, width: u32, height: u32) -> Vec<u8> {
    file[16..20].copy_from_slice(&width.to_be_bytes());
    file[20..24].copy_from_slice(&height.to_be_bytes());
    let sum = crc(&file[12..29]);
    file[29..33].copy_from_slice(&sum.to_be_bytes());
    file
}

/// Changes the windows in the header of an EXR file.
fn with_exr_size(mut file: Vec<u8>, width: i32, height: i32) -> Vec<u8> {
    for name in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let start = file.windows(name.len()).position(|part| part == name).unwrap() + name.len() + 4;
        file[start + 8..start + 12].copy_from_slice(&(width - 1).to_le_bytes());
        file[start + 12..start + 16].copy_from_slice(&(height - 1).to_le_bytes());
    }
    file
}

#[test]
fn claims_of_a_hundred_thousand_pixels_are_refused() {
    let png = with_png_size(png_bytes(&display(9, 5)), 100_000, 100_000);
    let exr = with_exr_size(exr_bytes(&frame(9, 5)), 100_000, 100_000);
    for (bytes, extension) in [(png, "png"), (exr, "exr")] {
        let refused = decode_picture(&bytes, extension);
        assert_eq!(refused, Err(AssetProblem::TooLarge { width: 100_000, height: 100_000, limit: 16384 }));
    }
    let mut jpeg = grey_jpeg();
    let size = jpeg.windows(2).position(|pair| pair == [0xFF, 0xC0]).unwrap() + 5;
    jpeg[size..size + 4].copy_from_slice(&[0xFF; 4]);
    assert_eq!(decode_picture(&jpeg, "jpg"), Err(AssetProblem::TooLarge { width: 65535, height: 65535, limit: 16384 }));
}

#[test]
fn claims_within_the_limit_that_the_file_cannot_hold_are_refused() {
    let png = with_png_size(png_bytes(&display(9, 5)), 16000, 8000);
    let exr = with_exr_size(exr_bytes(&frame(9, 5)), 16000, 8000);
    for (bytes, extension) in [(png, "png"), (exr, "exr")] {
        let Err(AssetProblem::Damaged(reason)) = decode_picture(&bytes, extension) else { panic!("{extension}") };
        assert!(reason.contains("16000 x 8000"), "{reason}");
    }
    let square = with_png_size(png_bytes(&display(9, 5)), 16384, 16384);
    assert!(matches!(decode_picture(&square, "png"), Err(AssetProblem::TooManyPixels { .. })));
}

#[test]
fn files_cut_off_anywhere_are_refused() {
    for (bytes, extension) in [(png_bytes(&display(40, 30)), "png"), (exr_bytes(&frame(40, 30)), "exr")] {
        for length in (0..bytes.len() - 12).step_by(7) {
            assert!(decode_picture(&bytes[..length], extension).is_err(), "{extension} cut to {length}");
        }
    }
    assert!(decode_picture(&grey_jpeg()[..40], "jpg").is_err());
}

#[test]
fn damaged_files_never_panic() {
    use ::exr::prelude::Compression;
    let sources = [
        (png_bytes(&display(40, 30)), "png"),
        (exr_bytes(&frame(40, 30)), "exr"),
        (grey_jpeg(), "jpg"),
        (Vec::new(), "png"),
        (Vec::new(), "exr"),
        (Vec::new(), "jpg"),
        (vec![0; 100], "exr"),
        (tiled_exr(&["R", "G", "B", "half"], Compression::PIZ), "exr"),
        (tiled_exr(&["half"], Compression::B44), "exr"),
        (tiled_exr(&["R", "G", "B"], Compression::DWAA(None)), "exr"),
        (tiled_exr(&["R", "G", "B"], Compression::PXR24), "exr"),
        (tiled_exr(&["R", "G", "B"], Compression::RLE), "exr"),
    ];
    let mut state = 1_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    };
    for (bytes, extension) in &sources {
        for _ in 0..500 {
            let mut damaged = bytes.clone();
            // Mostly in the header, where lengths and sizes are.
            let reach = if random() % 3 == 0 { damaged.len() } else { damaged.len().min(900) };
            for _ in 0..1 + random() % 4 {
                if reach > 0 {
                    damaged[random() % reach] = random() as u8;
                }
            }
            // Any result will do, as long as it returns.
            let _ = decode_picture(&damaged, extension);
        }
    }
}

/// An Exif block with 1/250 s, f/4 and ISO 400.
fn exif_block() -> Vec<u8> {
    use ::exif::{Field, In, Rational, Tag, Value, experimental::Writer};
    let rational = |num, denom| Value::Rational(vec![Rational { num, denom }]);
    let fields = [
        (Tag::ExposureTime, rational(1, 250)),
        (Tag::FNumber, rational(4, 1)),
        (Tag::PhotographicSensitivity, Value::Short(vec![400])),
    ]
    .map(|(tag, value)| Field { tag, ifd_num: In::PRIMARY, value });
    let mut writer = Writer::new();
    fields.iter().for_each(|field| writer.push_field(field));
    let mut bytes = std::io::Cursor::new(Vec::new());
    writer.write(&mut bytes, false).unwrap();
    bytes.into_inner()
}

#[test]
fn plates_of_every_kind_say_with_which_exposure_they_were_taken() {
    // log2(16 * 250) - 2.
    let is_known = |ev100: Option<f64>| ev100.is_some_and(|ev100| (ev100 - 9.9658).abs() < 1e-3);
    let jpeg = fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/plates/court.jpg")).unwrap();
    assert_eq!(decode_picture(&jpeg, "jpg").unwrap().exposure_ev100, None);
    let block = [b"Exif\0\0".as_slice(), &exif_block()].concat();
    let length = (block.len() as u16 + 2).to_be_bytes();
    let marked = [&jpeg[..2], &[0xff, 0xe1], &length, &block, &jpeg[2..]].concat();
    assert!(is_known(decode_picture(&marked, "jpg").unwrap().exposure_ev100));

    let mut png = Vec::new();
    let mut info = ::png::Info::with_size(1, 1);
    info.exif_metadata = Some(exif_block().into());
    let mut writer = ::png::Encoder::with_info(&mut png, info).unwrap().write_header().unwrap();
    writer.write_image_data(&[7]).unwrap();
    writer.finish().unwrap();
    assert!(is_known(decode_picture(&png, "png").unwrap().exposure_ev100));

    let mut frame = frame(4, 2);
    frame.header.exposure_ev100 = 9.5;
    assert_eq!(decode_picture(&exr_bytes(&frame), "exr").unwrap().exposure_ev100, Some(9.5));
}

/// An Exif block with an orientation, as a camera writes it: big-endian, one entry.
fn orientation_block(tag: u8) -> Vec<u8> {
    [&b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0"[..], &[tag], &[0; 6]].concat()
}

#[test]
fn a_photograph_is_turned_as_its_camera_was_held() {
    let jpeg = fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/plates/court.jpg")).unwrap();
    let stored = decode_picture(&jpeg, "jpg").unwrap();
    let block = [b"Exif\0\0".as_slice(), &orientation_block(6)].concat();
    let length = (block.len() as u16 + 2).to_be_bytes();
    let turned = [&jpeg[..2], &[0xff, 0xe1], &length, &block, &jpeg[2..]].concat();
    let turned = decode_picture(&turned, "jpg").unwrap();
    let (width, height) = (stored.color.width(), stored.color.height());
    assert_eq!((turned.color.width(), turned.color.height()), (height, width));
    // The stored row 0 is at the right, the stored column 0 at the top.
    for [x, y] in [[0, 0], [width - 1, 0], [5, height - 3]] {
        assert_eq!(turned.color.at(height - 1 - y, x), stored.color.at(x, y));
    }

    let mut png = Vec::new();
    let mut info = ::png::Info::with_size(2, 1);
    info.exif_metadata = Some(orientation_block(8).into());
    let mut writer = ::png::Encoder::with_info(&mut png, info).unwrap().write_header().unwrap();
    writer.write_image_data(&[0, 255]).unwrap();
    writer.finish().unwrap();
    let picture = decode_picture(&png, "png").unwrap();
    assert_eq!((picture.color.width(), picture.color.at(0, 0)[0], picture.color.at(0, 1)[0]), (1, 1.0, 0.0));
    let depth = assets::decode_depth(&png, "png", None, MemoryLimit::default()).unwrap();
    assert_eq!((depth.values.width(), depth.values.at(0, 0), depth.values.at(0, 1)), (1, [255.0], [0.0]));
}

#[test]
fn a_damaged_photograph_is_drawn_and_told_and_junk_between_its_segments_changes_nothing() {
    let jpeg = fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/plates/court.jpg")).unwrap();
    let whole = decode_picture(&jpeg, "jpg").unwrap();
    assert_eq!(whole.remarks, []);
    let junk = [&jpeg[..2], &[0xff, 0xfe, 0, 4, 1, 2], &[7; 9], &jpeg[2..]].concat();
    assert_eq!(decode_picture(&junk, "jpg").unwrap(), whole);
    let cut = decode_picture(&jpeg[..jpeg.len() / 2], "jpg").unwrap();
    assert!(matches!(cut.remarks[..], [PictureRemark::Corrupt(_)]), "{:?}", cut.remarks);
}

/// The smallest memory limit with which `bytes` are decoded, and the error with one byte less.
fn smallest_memory_limit(bytes: &[u8], extension: &str) -> u64 {
    let read =
        |total| assets::decode_picture(bytes, extension, &PictureLayers::default(), MemoryLimit { total, used: 0 });
    let AssetProblem::Memory { bytes: least, limit: 0, others: 0 } = read(0).unwrap_err() else {
        panic!("{extension}")
    };
    assert!(read(least).is_ok(), "{extension}");
    assert_eq!(read(least - 1).unwrap_err(), AssetProblem::Memory { bytes: least, limit: least - 1, others: 0 });
    least
}

#[test]
fn pictures_that_would_take_too_much_memory_are_refused_before_they_are_read() {
    let (width, height) = (600, 400);
    let pixels = width * height * 16;
    let png = png_bytes(&display(width as usize, height as usize));
    let exr = exr_bytes(&frame(width as usize, height as usize));
    for (bytes, extension, most) in [(&png, "png", 1.05), (&exr, "exr", 6.0)] {
        let least = smallest_memory_limit(bytes, extension) - bytes.len() as u64;
        assert!(least >= pixels && (least as f64) < most * pixels as f64, "{extension}: {least} for {pixels}");
    }
}
