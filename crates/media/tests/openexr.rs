//! OpenEXR's Python package, an independent reader, reads the values that we wrote.

use std::{collections::BTreeMap, path::Path, process::Command};

use bansho_base::{
    camera::{CameraHeader, Lens},
    frame::{Channel, Frame, FrameHeader, Precision},
    image::{Image, Rect},
};
use bansho_media::{
    exr,
    files::{atomic, overwrite_policy::OverwritePolicy},
};
use half::f16;

fn frame() -> Frame {
    let (width, height) = (37, 41);
    let count = width * height;
    let pixels = (0..count).map(|i| [i as f32 * 0.013, -0.7, 1.0 / (i + 1) as f32, 1.0e9]).collect();
    let matrix = |start: f64| std::array::from_fn(|i| std::array::from_fn(|j| start + 1e-9 + (4 * i + j) as f64));
    let values = |scale: f32| (0..count).map(|i| i as f32 * scale).collect::<Vec<_>>();
    let channel = |name: &str, precision, scale| Channel { name: name.to_owned(), precision, values: values(scale) };
    let header = FrameHeader {
        number: -3,
        exposure_ev100: 7.25,
        white_balance_k: None,
        fps: [24000, 1001],
        exposure_time_s: 0.02,
        camera: CameraHeader {
            world_to_camera: matrix(0.0),
            world_to_ndc: Some(matrix(50.0)),
            vertical_fov_deg: Some(40.0),
            lens: Some(Lens::Perspective),
            fisheye_fov_deg: Some(180.0),
        },
        fingerprint: [0xAB; 32],
        display_size: [40, 30],
        data_origin: [-2, 1],
    };
    let depth = (0..count).map(|i| if i % 5 == 0 { f32::INFINITY } else { i as f32 * 0.37 }).collect();
    let channels = vec![
        channel("torch.temperature_k", Precision::Single, 1.7),
        channel("torch.R", Precision::Half, 0.02),
        channel("a layer whose name is longer than thirty-one letters.R", Precision::Half, 0.5),
    ];
    Frame {
        header,
        beauty: Image::from_pixels(width, height, pixels).unwrap(),
        depth: Some(depth),
        channels,
        opaque: false,
        metadata: Vec::new(),
        content: Rect::from_size(width, height),
    }
}

/// The number that the Python program prints for a channel.
fn fact(values: impl Iterator<Item = f32>) -> f64 {
    let finite = values.map(|value| if value.is_finite() { f64::from(value) } else { 0.0 });
    finite.enumerate().map(|(i, value)| value * (i + 1) as f64).sum()
}

fn facts_by_openexr(path: &Path) -> (BTreeMap<String, String>, BTreeMap<String, (String, f64)>) {
    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/openexr_reads.py");
    let output = Command::new("python3").arg(program).arg(path).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (mut header, mut channels) = (BTreeMap::new(), BTreeMap::new());
    for line in String::from_utf8(output.stdout).unwrap().lines() {
        if let Some(channel) = line.strip_prefix("channel ") {
            let (rest, sum) = channel.rsplit_once(' ').unwrap();
            let (rest, size) = rest.rsplit_once(' ').unwrap();
            let (name, kind) = rest.rsplit_once(' ').unwrap();
            channels.insert(name.to_owned(), (format!("{kind} {size}"), sum.parse().unwrap()));
        } else {
            let (name, value) = line.split_once(" = ").unwrap();
            header.insert(name.to_owned(), value.to_owned());
        }
    }
    (header, channels)
}

#[test]
#[ignore = "needs python3 with the package OpenEXR"]
fn openexr_reads_every_channel_and_attribute() {
    let folder = tempfile::tempdir().unwrap();
    let (path, frame) = (folder.path().join("a.exr"), frame());
    atomic::write_bytes(&path, &exr::encode(&frame, &path).unwrap(), &OverwritePolicy::default()).unwrap();
    let (header, channels) = facts_by_openexr(&path);

    let half = |value: f32| f16::from_f32(value.clamp(-65504.0, 65504.0)).to_f32();
    let beauty = |component: usize| fact(frame.beauty.pixels().iter().map(|pixel| half(pixel[component])));
    let mut expected = BTreeMap::from([
        ("R".to_owned(), ("float16 37x41".to_owned(), beauty(0))),
        ("G".to_owned(), ("float16 37x41".to_owned(), beauty(1))),
        ("B".to_owned(), ("float16 37x41".to_owned(), beauty(2))),
        ("A".to_owned(), ("float16 37x41".to_owned(), beauty(3))),
        ("Z".to_owned(), ("float32 37x41".to_owned(), fact(frame.depth.iter().flatten().copied()))),
    ]);
    for channel in &frame.channels {
        let fact = match channel.precision {
            Precision::Half => ("float16 37x41".to_owned(), fact(channel.values.iter().map(|value| half(*value)))),
            Precision::Single => ("float32 37x41".to_owned(), fact(channel.values.iter().copied())),
        };
        // Colors keep their names; a quantity gets a component.
        expected.insert(channel.name.replace("_k", "_k.V"), fact);
    }
    assert_eq!(channels.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, (kind, sum)) in &expected {
        let (found_kind, found_sum) = &channels[name];
        assert_eq!(found_kind, kind, "{name}");
        assert!((found_sum - sum).abs() <= 1e-9 * sum.abs(), "{name}: {found_sum} for {sum}");
    }
    check_header(&header);
}

fn check_header(header: &BTreeMap<String, String>) {
    let has = |name: &str, part: &str| assert!(header[name].contains(part), "{name} = {}", header[name]);
    has("bansho:fingerprint", &"ab".repeat(32));
    has("bansho:version", env!("CARGO_PKG_VERSION"));
    has("exposure_ev100", "7.25");
    has("imageCounter", "-3");
    has("expTime", "0.0199");
    has("framesPerSecond", "24000/1001");
    has("chromaticities", "0.71299");
    has("chromaticities", "0.32168");
    has("worldToCamera", "15.0");
    has("worldToNDC", "65.0");
    has("bansho:worldToCamera", "15.000000001");
    has("bansho:worldToNDC", "50.000000001");
    has("bansho:lens", "perspective");
    has("bansho:fisheyeFovDeg", "180.0");
    has("colorInteropID", "lin_ap1_scene");
    has("compression", "ZIP_COMPRESSION");
    has("lineOrder", "INCREASING_Y");
    has("dataWindow", "-2");
    assert!(!header.contains_key("capDate"));
}
