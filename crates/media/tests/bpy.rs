//! Blender, an independent reader, reads every layer and AOV of our EXR files with its type, and the right colors.

use std::{collections::BTreeMap, path::Path, process::Command};

use bansho_base::{
    camera::CameraHeader,
    color,
    frame::{Channel, Frame, FrameHeader, Precision},
    image::{Image, Rect},
};
use bansho_media::{
    exr,
    files::{atomic, overwrite_policy::OverwritePolicy},
};
use half::f16;

const SIZE: [usize; 2] = [37, 41];
const LAYER: &str = "left torch, a name as long as is allowed: sixty-three bytes, ok";

fn values(scale: f32) -> Vec<f32> {
    (0..SIZE[0] * SIZE[1]).map(|i| i as f32 * scale).collect()
}

fn frame() -> Frame {
    let count = SIZE[0] * SIZE[1];
    let pixels = (0..count).map(|i| [i as f32 * 0.013, 0.7, 9.0 / (i + 1) as f32, 0.25]).collect();
    let unit: [[f64; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
    let header = FrameHeader {
        number: 1,
        exposure_ev100: 0.0,
        white_balance_k: None,
        fps: [30, 1],
        exposure_time_s: 0.02,
        camera: CameraHeader {
            world_to_camera: unit,
            world_to_ndc: None,
            vertical_fov_deg: None,
            lens: None,
            fisheye_fov_deg: None,
        },
        fingerprint: [0; 32],
        display_size: SIZE,
        data_origin: [0; 2],
    };
    let channel = |layer: &str, name: &str, precision, scale| Channel {
        name: format!("{layer}.{name}"),
        precision,
        values: values(scale),
    };
    let layer = |name: &'static str| {
        let scales = [("R", 0.02), ("G", 0.01), ("B", 0.03), ("A", 0.0005)];
        scales.map(|(component, scale)| channel(name, component, Precision::Half, scale))
    };
    let aovs = [("temperature_k", 1.7), ("kilorayleigh_first_positive", 0.3), ("motion.X", 0.5), ("motion.Y", -0.25)]
        .map(|(name, scale)| channel(LAYER, name, Precision::Single, scale));
    Frame {
        header,
        beauty: Image::from_pixels(SIZE[0], SIZE[1], pixels).unwrap(),
        depth: Some((0..count).map(|i| if i % 5 == 0 { f32::INFINITY } else { i as f32 * 0.37 }).collect()),
        channels: layer(LAYER).into_iter().chain(layer("plate")).chain(aovs).collect(),
        opaque: false,
        metadata: Vec::new(),
        content: Rect::from_size(SIZE[0], SIZE[1]),
    }
}

/// A pass as Blender reads it: its type, the number of infinite pixels, and the sum of each component.
#[derive(Debug)]
struct Pass {
    kind: String,
    infinite: usize,
    sums: [f64; 4],
}

fn passes_by_blender(path: &Path) -> (BTreeMap<String, String>, BTreeMap<String, Pass>) {
    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/bpy_reads.py");
    let output = Command::new("python3")
        .arg(program)
        .arg(path)
        .args(SIZE.map(|side| side.to_string()))
        .args([LAYER])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (mut facts, mut passes) = (BTreeMap::new(), BTreeMap::new());
    // Blender itself prints lines, too.
    for line in String::from_utf8(output.stdout).unwrap().lines() {
        if let Some((name, value)) = line.strip_prefix("fact ").and_then(|fact| fact.split_once(" = ")) {
            facts.insert(name.to_owned(), value.to_owned());
        }
        if let Some((name, value)) = line.strip_prefix("pass ").and_then(|pass| pass.rsplit_once(" = ")) {
            let words: Vec<&str> = value.split(' ').collect();
            let sums = std::array::from_fn(|component| words[2 + component].parse().unwrap());
            passes
                .insert(name.to_owned(), Pass { kind: words[0].to_owned(), infinite: words[1].parse().unwrap(), sums });
        }
    }
    (facts, passes)
}

/// Sums of pixels, as the Python program prints them.
fn sums(pixels: impl Iterator<Item = [f32; 4]>) -> [f64; 4] {
    let mut sums = [0.0; 4];
    for (index, pixel) in pixels.enumerate() {
        for (sum, value) in sums.iter_mut().zip(pixel).filter(|(_, value)| value.is_finite()) {
            *sum += f64::from(value) * (index + 1) as f64;
        }
    }
    sums
}

/// A premultiplied ACEScg pixel of the file as Blender converts it: linear, with the primaries of Rec. 709.
fn in_blender(pixel: [f32; 4]) -> [f32; 4] {
    let [r, g, b, a] = pixel.map(|value| f16::from_f32(value).to_f32());
    let [r, g, b] = color::srgb_from_acescg([r, g, b]);
    [r, g, b, a]
}

#[test]
#[ignore = "needs python3 with the package bpy"]
fn bpy_reads_every_pass_with_its_type_and_its_colors() {
    assert_eq!(LAYER.len(), 63);
    let folder = tempfile::tempdir().unwrap();
    let (path, frame) = (folder.path().join("a.exr"), frame());
    atomic::write_bytes(&path, &exr::encode(&frame, &path).unwrap(), &OverwritePolicy::default()).unwrap();
    let (facts, passes) = passes_by_blender(&path);
    assert_eq!(facts["color space"], "ACEScg");

    let beauty = || frame.beauty.pixels().iter().map(|pixel| in_blender(*pixel));
    let plane = |name: &str| &frame.channels.iter().find(|channel| channel.name == name).unwrap().values;
    let layer = |name: &str| {
        let planes = ["R", "G", "B", "A"].map(|component| plane(&format!("{name}.{component}")));
        sums((0..planes[0].len()).map(|index| in_blender(planes.map(|plane| plane[index]))))
    };
    // The compositor shows a scalar as opaque gray.
    let number = |values: &[f32]| sums(values.iter().map(|&value| [value, value, value, 1.0]));
    let [x, y] = ["X", "Y"].map(|axis| plane(&format!("{LAYER}.motion.{axis}")));
    let depth = frame.depth.as_deref().unwrap();
    let aov = |quantity: &str| format!("{LAYER}/{quantity}");
    let expected = BTreeMap::from([
        ("Combined".to_owned(), ("RGBA", sums(beauty()))),
        ("Alpha".to_owned(), ("VALUE", number(&beauty().map(|pixel| pixel[3]).collect::<Vec<_>>()))),
        ("Depth".to_owned(), ("VALUE", number(depth))),
        (LAYER.to_owned(), ("RGBA", layer(LAYER))),
        ("plate".to_owned(), ("RGBA", layer("plate"))),
        (aov("temperature_k"), ("VALUE", number(plane(&format!("{LAYER}.temperature_k"))))),
        (aov("kilorayleigh_first_positive"), ("VALUE", number(plane(&format!("{LAYER}.kilorayleigh_first_positive"))))),
        (aov("motion"), ("VECTOR", sums(x.iter().zip(y).map(|(&x, &y)| [x, y, 0.0, 1.0])))),
    ]);
    assert_eq!(passes.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
    for (name, (kind, wanted)) in &expected {
        let found = &passes[name];
        assert_eq!(found.kind, *kind, "{name}");
        let infinite = if name == "Depth" { depth.iter().filter(|depth| depth.is_infinite()).count() } else { 0 };
        assert_eq!(found.infinite, infinite, "{name}");
        // Blender's matrix and ours are rounded differently; pixels of 1 have the sum 1.2e6.
        let near = |(found, wanted): (&f64, &f64)| (found - wanted).abs() <= 1e-4 * wanted.abs().max(1e4);
        assert!(found.sums.iter().zip(wanted).all(near), "{name}: {found:?} for {wanted:?}");
    }
}
