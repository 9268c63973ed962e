//! Metadata of frames, beside the pictures.

use std::fs;

use serde_json::Value;

use crate::support::{FLAME, Folder};

#[test]
fn every_picture_has_metadata_and_resume_restores_it() {
    let folder = Folder::with_scene(FLAME);
    let render = ["render", "scene.toml", "--metadata", "--out", "f/f.png"];
    folder.succeed(&render);
    let files = folder.files("f");
    assert_eq!(files.len(), 12);
    let metadata: Value = serde_json::from_slice(&files["f.0003.json"]).unwrap();
    assert_eq!(
        (&metadata["frame"], &metadata["picture"], &metadata["fps"]),
        (&3.into(), &"f.0003.png".into(), &30.0.into())
    );
    assert!(metadata["phenomena"].is_object());
    let fingerprint = metadata["fingerprint"].as_str().unwrap();
    assert!(String::from_utf8_lossy(&files["f.0003.png"]).contains(fingerprint), "that of the picture");
    fs::remove_file(folder.path("f/f.0001.json")).unwrap();
    let other =
        String::from_utf8(files["f.0002.json"].clone()).unwrap().replace("\"fingerprint\": \"", "\"fingerprint\": \"0");
    fs::write(folder.path("f/f.0002.json"), other).unwrap();
    let resumed = folder.succeed(&[&render[..], &["--resume"]].concat());
    assert!(resumed.stderr.starts_with("2 frames in "), "{}", resumed.stderr);
    assert!(folder.files("f") == files);
}

#[test]
fn without_the_option_there_is_none() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["render", "scene.toml", "--out", "f/f.png"]);
    assert!(folder.names().iter().all(|name| !name.ends_with(".json")));
}

#[test]
fn films_and_sheets_have_no_metadata() {
    let folder = Folder::with_scene(FLAME);
    for arguments in [&["--out", "f.gif"][..], &["--contact-sheet", "4"]] {
        let run = folder.run(&[&["render", "scene.toml", "--metadata"], arguments].concat());
        assert_eq!((run.code, run.errors()), (Some(2), 1), "{}", run.stderr);
        assert!(run.stderr.contains("--metadata") && run.stderr.contains("allowed: .png or .exr"), "{}", run.stderr);
        assert_eq!(folder.names(), ["scene.toml"]);
    }
}
