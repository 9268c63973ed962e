//! Small files by independent writers are read as independent readers read them. `python/make_corpus.py` writes them, and `expected.json` beside them.

use std::{fs, io::Read, path::PathBuf, sync::LazyLock};

use bansho_base::{
    geometry::strokes::Drawing,
    host::assets::{AssetProblem, DepthMap, Encoding, Picture, PictureAlpha, PictureLayers, PictureRemark},
};
use bansho_media::{
    assets::{decode_depth, decode_picture},
    gltf::decode_mesh,
    limits::MemoryLimit,
    svg::decode_drawing,
};
use serde_json::Value;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/corpus")
}

/// Codes of red, green, blue and alpha of the pictures of PngSuite, one picture after the other.
static PNG_SUITE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let packed = fs::read(folder().join("pngsuite/values.zz")).unwrap();
    let mut codes = Vec::new();
    flate2::read::ZlibDecoder::new(&packed[..]).read_to_end(&mut codes).unwrap();
    codes
});

/// A file, and what is expected of it.
struct Case {
    name: String,
    bytes: Vec<u8>,
    expected: Value,
}

impl Case {
    fn text(&self, key: &str) -> Option<String> {
        self.expected.get(key)?.as_str().map(str::to_owned)
    }

    fn numbers(&self, key: &str) -> Option<Vec<f64>> {
        let number = |value: &Value| match value.as_str() {
            Some("inf") => f64::INFINITY,
            Some(_) => f64::NAN,
            None => value.as_f64().unwrap(),
        };
        Some(self.expected.get(key)?.as_array()?.iter().map(number).collect())
    }

    /// The values of a picture of PngSuite.
    fn values_of_suite(&self) -> Option<Vec<f64>> {
        let start = self.expected.get("values_from")?.as_u64()? as usize;
        let [width, height] = self.numbers("size")?[..] else { return None };
        let codes = &PNG_SUITE[start..][..4 * (width * height) as usize];
        Some(codes.iter().map(|code| f64::from(*code) / 255.0).collect())
    }

    fn extension(&self) -> &str {
        self.name.rsplit('.').next().unwrap()
    }

    /// The problems that a picture or its depth has with the expectation.
    fn differences(&self) -> Result<(), String> {
        match self.text("kind").as_deref() {
            Some("picture") => {
                let layers = PictureLayers { image: self.text("image_layer"), depth: None };
                let read = decode_picture(&self.bytes, self.extension(), &layers, MemoryLimit::default());
                self.judge(read, |picture| self.picture(picture))
            }
            Some("depth") => self
                .judge(decode_depth(&self.bytes, self.extension(), None, MemoryLimit::default()), |map| {
                    self.depth(map)
                }),
            Some("strokes") => self.judge(decode_drawing(&self.bytes), |drawing| self.strokes(drawing)),
            _ => {
                let none = |_: &str, _: u64| Err(AssetProblem::Missing);
                let read = decode_mesh(&self.bytes, self.extension(), &none, MemoryLimit::default());
                self.judge(read, |mesh| {
                    let bounds: Vec<f64> = mesh.bounds().iter().flat_map(|corner| corner.to_array()).collect();
                    let expected = self.expected["bounds"]
                        .as_array()
                        .unwrap()
                        .iter()
                        .flat_map(|corner| corner.as_array().unwrap());
                    near(&bounds, &expected.map(|value| value.as_f64().unwrap()).collect::<Vec<_>>(), 1e-5)?;
                    equal("triangles", mesh.len() as u64, self.expected["triangles"].as_u64().unwrap())
                })
            }
        }
    }

    /// Judges what was read, or the error.
    fn judge<T>(&self, read: Result<T, AssetProblem>, judge: impl Fn(&T) -> Result<(), String>) -> Result<(), String> {
        match (read, self.text("error")) {
            (Ok(read), None) => judge(&read),
            (Ok(_), Some(words)) => Err(format!("is read instead of refused for `{words}`")),
            (Err(error), Some(words)) if error.to_string().contains(&words) => Ok(()),
            (Err(error), _) => Err(format!("is refused: {error}")),
        }
    }

    fn picture(&self, picture: &Picture) -> Result<(), String> {
        self.remark(&picture.remarks)?;
        self.size([picture.color.width(), picture.color.height()])?;
        let is_linear = picture.encoding != Encoding::DisplaySrgb;
        if let Some(encoding) = self.text("encoding") {
            equal("encoding", is_linear, encoding == "linear")?;
        }
        let values: Vec<f64> = picture.color.iter().flatten().map(f64::from).collect();
        if let Some(expected) = self.numbers("values").or_else(|| self.values_of_suite()) {
            near(&values, &expected, self.expected["tolerance"].as_f64().unwrap())?;
        }
        if self.text("alpha").as_deref() == Some("associated") {
            equal("alpha", picture.alpha, PictureAlpha::Associated)?;
        }
        if let Some(expected) = self.numbers("depth") {
            let depth = picture.depth.as_ref().ok_or("has no depth")?;
            near(&depth.iter().map(|value| f64::from(*value)).collect::<Vec<_>>(), &expected, 1e-6)?;
        }
        Ok(())
    }

    fn depth(&self, map: &DepthMap) -> Result<(), String> {
        self.remark(&map.remarks)?;
        self.size([map.values.width(), map.values.height()])?;
        let values: Vec<f64> = map.values.pixels().as_flattened().iter().map(|value| f64::from(*value)).collect();
        near(&values, &self.numbers("values").unwrap(), 1e-6)
    }

    /// The first and the last point of every stroke, within 1e-4 of the page.
    fn strokes(&self, drawing: &Drawing) -> Result<(), String> {
        let ends = drawing.strokes.iter().flat_map(|stroke| [stroke.points.first(), stroke.points.last()]);
        let found: Vec<f64> = ends.flatten().flat_map(|point| point.to_array()).collect();
        let lines = self.expected["lines"].as_array().unwrap().iter().flat_map(|line| line.as_array().unwrap());
        let expected: Vec<f64> =
            lines.flat_map(|point| point.as_array().unwrap()).map(|value| value.as_f64().unwrap()).collect();
        near(&found, &expected, 1e-4 * 100.0)
    }

    /// A remark with the expected words, or none.
    fn remark(&self, remarks: &[PictureRemark]) -> Result<(), String> {
        let told: Vec<String> = remarks.iter().map(ToString::to_string).collect();
        match (self.text("remark"), &told[..]) {
            (None, []) => Ok(()),
            (Some(words), [only]) if only.contains(&words) => Ok(()),
            (words, told) => Err(format!("tells {told:?} instead of {words:?}")),
        }
    }

    fn size(&self, found: [usize; 2]) -> Result<(), String> {
        let expected = self.numbers("size").unwrap();
        equal("size", found.map(|side| side as f64), [expected[0], expected[1]])
    }
}

fn equal<T: PartialEq + std::fmt::Debug>(what: &str, found: T, expected: T) -> Result<(), String> {
    if found == expected { Ok(()) } else { Err(format!("{what} is {found:?} instead of {expected:?}")) }
}

/// Compares numbers: to `tolerance` below 1, relative to it above.
fn near(found: &[f64], expected: &[f64], tolerance: f64) -> Result<(), String> {
    equal("the number of values", found.len(), expected.len())?;
    for (index, (found, expected)) in found.iter().zip(expected).enumerate() {
        let is_same = found == expected || found.is_nan() && expected.is_nan();
        let off = (found - expected).abs();
        // A tolerance of whole codes is met to the rounding of single precision.
        let is_near = off <= tolerance * expected.abs().max(1.0) + 2e-7;
        if !(is_same || is_near) {
            return Err(format!("value {index} is {found} instead of {expected}"));
        }
    }
    Ok(())
}

/// All cases.
fn cases() -> Vec<Case> {
    let text = fs::read_to_string(folder().join("expected.json")).unwrap();
    let entries: Vec<Value> = serde_json::from_str(&text).unwrap();
    let case = |expected: Value| {
        let name = expected["file"].as_str().unwrap().to_owned();
        Case { bytes: fs::read(folder().join(&name)).unwrap(), name, expected }
    };
    entries.into_iter().map(case).collect()
}

/// Numbers that look random.
fn random_numbers() -> impl FnMut() -> usize {
    let mut state = 7_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    }
}

/// Whether a changed JPEG is refused or reported as corrupt.
fn is_reported(bytes: &[u8]) -> bool {
    let read = decode_picture(bytes, "jpg", &PictureLayers::default(), MemoryLimit::default());
    read.is_err() || read.is_ok_and(|picture| matches!(picture.remarks[..], [PictureRemark::Corrupt(_)]))
}

#[test]
fn corrupt_data_of_a_jpeg_are_reported() {
    let mut random = random_numbers();
    let (mut changed, mut reported) = (0, 0);
    for name in ["detailed.jpg", "detailed_restarts.jpg", "detailed_progressive.jpg", "detailed_full.jpg"] {
        let whole = fs::read(folder().join(name)).unwrap();
        assert!(!is_reported(&whole), "{name}");
        let start = whole.windows(2).position(|pair| pair == [0xff, 0xda]).unwrap() + 14;
        let replaced =
            |range: std::ops::Range<usize>, by: &[u8]| [&whole[..range.start], by, &whole[range.end..]].concat();
        // The structure: the marker of the end is missing, half of the data are, a marker is inserted.
        let middle = usize::midpoint(start, whole.len());
        for bad in [
            whole[..whole.len() - 2].to_vec(),
            whole[..middle].to_vec(),
            replaced(middle..middle, &[0xff, 0xd5]),
            replaced(middle..middle, &[0xff, 0x5a]),
        ] {
            assert!(is_reported(&bad), "{name}: {} of {} bytes", bad.len(), whole.len());
        }
        for _ in 0..200 {
            let at = start + random() % (whole.len() - start - 2);
            let bad = replaced(at..at + 1, &[whole[at] ^ (1 + random() % 255) as u8]);
            (changed, reported) = (changed + 1, reported + usize::from(is_reported(&bad)));
        }
    }
    // A change within a number stays a picture; nothing in a JPEG says what it was.
    assert!(10 * reported > 3 * changed, "{reported} of {changed} changed bytes are reported");
}

#[test]
fn restart_markers_out_of_order_are_reported() {
    let mut bytes = fs::read(folder().join("detailed_restarts.jpg")).unwrap();
    let markers: Vec<usize> =
        (0..bytes.len() - 1).filter(|at| bytes[*at] == 0xff && (0xd0..=0xd7).contains(&bytes[at + 1])).collect();
    assert!(markers.len() >= 7, "{markers:?}");
    bytes.swap(markers[2] + 1, markers[3] + 1);
    assert!(is_reported(&bytes));
}

#[test]
fn damaged_files_of_other_programs_never_panic() {
    let mut random = random_numbers();
    for mut case in cases() {
        let whole = case.bytes.clone();
        for _ in 0..40 {
            case.bytes.clone_from(&whole);
            for _ in 0..1 + random() % 4 {
                let reach = if random().is_multiple_of(3) { whole.len() } else { whole.len().min(300) };
                case.bytes[random() % reach] = random() as u8;
            }
            if random().is_multiple_of(8) {
                case.bytes.truncate(random() % whole.len());
            }
            // Any result will do, as long as it returns.
            let _ = case.differences();
        }
    }
}

#[test]
fn files_of_other_programs_are_read_as_other_readers_read_them() {
    let cases = cases();
    assert!(cases.len() >= 400, "{} files", cases.len());
    let mut faults = Vec::new();
    for case in cases {
        if let Err(fault) = case.differences() {
            faults.push(format!("{}: {fault}", case.name));
        }
    }
    assert!(faults.is_empty(), "{} files:\n{}", faults.len(), faults.join("\n"));
}
