//! Figures of each frame, in a JSON file beside its picture.

use std::{
    fs,
    path::{Path, PathBuf},
};

use bansho_base::frame::{Figure, FigureSet, Frame};
use bansho_media::{
    MediaError,
    files::{atomic, overwrite_policy::OverwritePolicy, provenance},
};
use serde_json::{Map, Value, json};

/// Key of the fingerprint of the picture that figures belong to.
const FINGERPRINT: &str = "fingerprint";

/// Where the figures of a picture are.
pub(crate) fn path(picture: &Path) -> PathBuf {
    picture.with_extension("json")
}

/// Writes the figures of a frame beside `picture`, the whole file or none.
///
/// # Errors
/// The file cannot be written, or would take the place of one that must stay.
pub(crate) fn write(frame: &Frame, picture: &Path, overwrite: &OverwritePolicy) -> Result<(), MediaError> {
    atomic::write_bytes_with(&path(picture), format!("{:#}\n", describe(frame, picture)).as_bytes(), overwrite)
}

/// Whether the figures of a picture of that fingerprint are there, whole.
pub(crate) fn are_there(picture: &Path, fingerprint: [u8; 32]) -> bool {
    let text = fs::read(path(picture)).unwrap_or_default();
    serde_json::from_slice::<Value>(&text).is_ok_and(|value| value[FINGERPRINT] == hex(fingerprint))
}

fn hex(fingerprint: [u8; 32]) -> String {
    blake3::Hash::from_bytes(fingerprint).to_hex().to_string()
}

fn describe(frame: &Frame, picture: &Path) -> Value {
    let header = &frame.header;
    let [frames, seconds] = header.fps;
    json!({
        "format": 1,
        "program": provenance::PROGRAM,
        "picture": picture.file_name().unwrap_or_default().to_string_lossy(),
        "frame": header.number,
        "fps": f64::from(frames) / f64::from(seconds.max(1)),
        "exposure_s": header.exposure_time_s,
        "exposure_ev100": header.exposure_ev100,
        "white_balance_k": header.white_balance_k,
        FINGERPRINT: hex(header.fingerprint),
        "phenomena": frame.figures.iter().map(describe_set).collect::<Map<_, _>>(),
    })
}

fn describe_set(set: &FigureSet) -> (String, Value) {
    // A value that is not finite becomes null.
    let figure = |figure: &Figure| (figure.name.to_owned(), json!({ "value": figure.value, "unit": figure.unit }));
    (set.phenomenon.clone(), Value::Object(set.figures.iter().map(figure).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::testing;

    #[test]
    fn figures_are_told_with_units_and_found_again_by_fingerprint() {
        let folder = tempfile::tempdir().unwrap();
        let picture = folder.path().join("rain.0007.png");
        let figures = vec![
            Figure { name: "rate", unit: "mm/h", value: 20.0 },
            Figure { name: "visibility", unit: "m", value: f64::INFINITY },
        ];
        let mut frame = testing::frame(7);
        frame.figures = vec![FigureSet { phenomenon: "shower".to_owned(), figures }];
        let fingerprint = frame.header.fingerprint;
        assert!(!are_there(&picture, fingerprint));
        write(&frame, &picture, &OverwritePolicy::default()).unwrap();
        assert!(provenance::is_bansho_file(&path(&picture)));
        let value: Value = serde_json::from_slice(&fs::read(folder.path().join("rain.0007.json")).unwrap()).unwrap();
        assert_eq!(value["phenomena"]["shower"]["rate"], json!({ "value": 20.0, "unit": "mm/h" }));
        assert_eq!(value["phenomena"]["shower"]["visibility"]["value"], Value::Null);
        assert_eq!((&value["picture"], &value["frame"]), (&json!("rain.0007.png"), &json!(7)));
        assert!(are_there(&picture, fingerprint) && !are_there(&picture, [0; 32]));
        fs::write(path(&picture), b"{").unwrap();
        assert!(!are_there(&picture, fingerprint));
    }
}
