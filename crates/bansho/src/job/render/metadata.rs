//! Metadata of each frame in a JSON file beside its picture.

use std::{
    fs,
    path::{Path, PathBuf},
};

use bansho_base::frame::{FrameHeader, MetadataEntry, PhenomenonMetadata};
use bansho_media::{
    MediaError,
    files::{atomic, overwrite_policy::OverwritePolicy, provenance},
};
use serde_json::{Map, Value, json};

/// Key of the fingerprint of the picture that the metadata belongs to.
const FINGERPRINT: &str = "fingerprint";

/// The file with the metadata of a picture.
pub(crate) fn path(picture: &Path) -> PathBuf {
    picture.with_extension("json")
}

/// The text of the metadata of a frame that is written to `picture`.
pub(crate) fn text(header: &FrameHeader, phenomena: &[PhenomenonMetadata], picture: &Path) -> String {
    format!("{:#}\n", describe(header, phenomena, picture))
}

/// Writes the text of metadata beside `picture`, atomically.
///
/// # Errors
/// The file cannot be written, or would replace one that must not be overwritten.
pub(crate) fn write(text: &str, picture: &Path, overwrite: &OverwritePolicy) -> Result<(), MediaError> {
    atomic::write_bytes(&path(picture), text.as_bytes(), overwrite)
}

/// Whether the complete metadata of a picture with this fingerprint exists.
pub(crate) fn exists(picture: &Path, fingerprint: [u8; 32]) -> bool {
    let text = fs::read(path(picture)).unwrap_or_default();
    serde_json::from_slice::<Value>(&text).is_ok_and(|value| value[FINGERPRINT] == hex(fingerprint))
}

fn hex(fingerprint: [u8; 32]) -> String {
    blake3::Hash::from_bytes(fingerprint).to_hex().to_string()
}

fn describe(header: &FrameHeader, phenomena: &[PhenomenonMetadata], picture: &Path) -> Value {
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
        "phenomena": phenomena.iter().map(describe_phenomenon).collect::<Map<_, _>>(),
    })
}

fn describe_phenomenon(metadata: &PhenomenonMetadata) -> (String, Value) {
    let mut entries = Map::new();
    for MetadataEntry { name, unit, value } in &metadata.entries {
        // A value that is not finite becomes null.
        entries.insert((*name).to_owned(), json!({ "value": value, "unit": unit }));
    }
    (metadata.phenomenon.clone(), Value::Object(entries))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::testing;

    #[test]
    fn metadata_has_units_and_is_found_by_fingerprint() {
        let folder = tempfile::tempdir().unwrap();
        let picture = folder.path().join("rain.0007.png");
        let entries = vec![
            MetadataEntry { name: "rate", unit: "mm/h", value: 20.0 },
            MetadataEntry { name: "visibility", unit: "m", value: f64::INFINITY },
        ];
        let header = testing::frame(7).header;
        let phenomena = [PhenomenonMetadata { phenomenon: "shower".to_owned(), entries }];
        let fingerprint = header.fingerprint;
        assert!(!exists(&picture, fingerprint));
        write(&text(&header, &phenomena, &picture), &picture, &OverwritePolicy::default()).unwrap();
        assert!(provenance::is_bansho_file(&path(&picture)));
        let value: Value = serde_json::from_slice(&fs::read(folder.path().join("rain.0007.json")).unwrap()).unwrap();
        assert_eq!(value["phenomena"]["shower"]["rate"], json!({ "value": 20.0, "unit": "mm/h" }));
        assert_eq!(value["phenomena"]["shower"]["visibility"]["value"], Value::Null);
        assert_eq!((&value["picture"], &value["frame"]), (&json!("rain.0007.png"), &json!(7)));
        assert!(exists(&picture, fingerprint) && !exists(&picture, [0; 32]));
        fs::write(path(&picture), b"{").unwrap();
        assert!(!exists(&picture, fingerprint));
    }
}
