//! Files of a folder: names with frame numbers, digests, memory, and what may be read.

use std::fs;

use bansho_base::host::assets::{AssetProblem, Assets};
use bansho_media::assets::{FileAssets, InputLimits};

use crate::{display, png_bytes, smallest_memory_limit};

#[test]
fn files_are_found_numbered_digested_and_remembered() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("p")).unwrap();
    let path = folder.path().join("p/street.0012.png");
    fs::write(&path, png_bytes(&display(3, 2))).unwrap();
    fs::write(folder.path().join("note.txt"), "火").unwrap();
    let assets = FileAssets::new(folder.path());
    let first = assets.picture("p/street.####.png", 12).unwrap();
    assert_eq!(assets.digest("p/street.####.png", 12).unwrap(), *blake3::hash(&fs::read(&path).unwrap()).as_bytes());
    fs::write(&path, png_bytes(&display(5, 2))).unwrap();
    assert_eq!(assets.picture("p/street.0012.png", 0).unwrap(), first);
    assets.clear_cache();
    assert_eq!(assets.picture("p/street.####.png", 12).unwrap().color.width(), 5);
    assert_eq!(&*assets.text("note.txt").unwrap(), "火");
    assert_eq!(assets.picture(path.to_str().unwrap(), 0).unwrap().color.width(), 5);
}

#[test]
fn what_is_wrong_with_a_file_is_said_with_its_path() {
    let folder = tempfile::tempdir().unwrap();
    let assets = FileAssets::new(folder.path());
    fs::write(folder.path().join("a.xyz"), "x").unwrap();
    fs::write(folder.path().join("a.png"), "").unwrap();
    fs::create_dir(folder.path().join("d.png")).unwrap();
    let error = |path: &str| assets.picture(path, 3).unwrap_err();
    assert_eq!(error("no.png").problem, AssetProblem::Missing);
    assert!(error("p.##.png").path.ends_with("p.03.png"));
    assert_eq!(error("a.xyz").problem, AssetProblem::UnknownKind);
    assert!(matches!(error("a.png").problem, AssetProblem::Damaged(_)));
    assert_eq!(error("d.png").problem, AssetProblem::NotAFile { found: "a folder" });
    for name in ["#.#.png".to_owned(), format!("{}.png", "#".repeat(21))] {
        assert_eq!(error(&name).problem, AssetProblem::FrameNumber);
    }
}

#[test]
fn negative_frames_are_numbered_as_by_printf_and_as_formerly() {
    let folder = tempfile::tempdir().unwrap();
    for (name, width) in
        [("n.-003.png", 3), ("n.-0002.png", 2), ("n.0000.png", 5), ("n.-001.png", 4), ("n.-0001.png", 9)]
    {
        fs::write(folder.path().join(name), png_bytes(&display(width, 2))).unwrap();
    }
    let assets = FileAssets::new(folder.path());
    let width = |frame| assets.picture("n.####.png", frame).unwrap().color.width();
    assert_eq!([-3, -2, 0, -1].map(width), [3, 2, 5, 4]);
    assert!(assets.picture("n.####.png", -4).unwrap_err().path.ends_with("n.-004.png"));
}

#[test]
fn a_missing_sequence_in_the_way_of_another_program_is_told_how_it_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let assets = FileAssets::new(folder.path());
    for (name, own) in [("p.%04d.png", "####"), ("p.$F4.exr", "####"), ("p.@@@.png", "###"), ("p.<frame>.png", "####")]
    {
        let hint =
            format!("no such file; write `{own}` for the frame number instead of `{}`", &name[2..name.len() - 4]);
        assert_eq!(assets.picture(name, 1).unwrap_err().problem.to_string(), hint);
        assert_eq!(assets.find(name, 1).unwrap_err().problem.to_string(), hint);
        assert_eq!(assets.digest(name, 1).unwrap_err().problem.to_string(), hint);
    }
    assert_eq!(
        assets.depth("d.%d.pfm", 1, None).unwrap_err().problem.to_string(),
        "no such file; write `#` for the frame number instead of `%d`"
    );
    // A file of that very name is one.
    fs::write(folder.path().join("p.%04d.png"), png_bytes(&display(3, 2))).unwrap();
    assert_eq!(assets.picture("p.%04d.png", 1).unwrap().color.width(), 3);
}

#[test]
fn a_name_with_a_number_sign_is_a_name_if_that_file_exists() {
    let folder = tempfile::tempdir().unwrap();
    for (name, width) in [("take#2.png", 3), ("take72.png", 5), ("shot7.png", 7)] {
        fs::write(folder.path().join(name), png_bytes(&display(width, 2))).unwrap();
    }
    let assets = FileAssets::new(folder.path());
    assert_eq!(assets.picture("take#2.png", 7).unwrap().color.width(), 3);
    assert_eq!(assets.picture("shot#.png", 7).unwrap().color.width(), 7);
}

#[test]
fn pictures_that_are_only_kept_make_room_and_meshes_that_are_used_do_not() {
    let folder = tempfile::tempdir().unwrap();
    let png = png_bytes(&display(64, 64));
    for name in ["a.png", "b.png"] {
        fs::write(folder.path().join(name), &png).unwrap();
    }
    let one = smallest_memory_limit(&png, "png");
    let limits = InputLimits { memory_bytes: one + one / 2, root: None };
    let assets = FileAssets::with_limits(folder.path(), limits);
    assets.picture("a.png", 0).unwrap();
    assets.picture("b.png", 0).unwrap();
    let small = InputLimits { memory_bytes: one - 1, root: None };
    let told = FileAssets::with_limits(folder.path(), small).picture("a.png", 0).unwrap_err().to_string();
    assert!(told.contains("a.png: would take ") && told.contains(" of memory; allowed: up to "), "{told}");
}

#[cfg(unix)]
#[test]
fn what_lies_outside_the_root_is_refused_whatever_its_name() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::create_dir_all(path("job/plates")).unwrap();
    for name in ["secret.png", "job/plates/a.png"] {
        fs::write(path(name), png_bytes(&display(2, 2))).unwrap();
    }
    symlink(path("secret.png"), path("job/link.png")).unwrap();
    symlink(path(""), path("job/out")).unwrap();
    symlink("plates/a.png", path("job/inner.png")).unwrap();
    let limits = InputLimits { root: Some(path("job")), ..InputLimits::default() };
    let assets = FileAssets::with_limits(path("job"), limits);
    for name in ["plates/a.png", "inner.png", "plates/../plates/a.png", path("job/plates/a.png").to_str().unwrap()] {
        assets.picture(name, 0).unwrap();
        assets.digest(name, 0).unwrap();
        assets.find(name, 0).unwrap();
    }
    let absolute = path("secret.png");
    let outside = ["../secret.png", "link.png", "out/secret.png", "../gone.png", "out/gone.png", "gone/../../gone.png"];
    for name in outside.into_iter().chain([absolute.to_str().unwrap(), "/etc/passwd"]) {
        let refused = |problem| matches!(problem, AssetProblem::Outside { .. }) || name.starts_with("gone");
        assert!(refused(assets.picture(name, 0).unwrap_err().problem), "{name}");
        assert!(refused(assets.text(name).unwrap_err().problem), "{name}");
        assert!(refused(assets.digest(name, 0).unwrap_err().problem), "{name}");
        assert!(refused(assets.find(name, 0).unwrap_err().problem), "{name}");
    }
    assert_eq!(assets.picture("gone.png", 0).unwrap_err().problem, AssetProblem::Missing);
    // Without a root, a scene may name any file.
    FileAssets::new(path("job")).picture("../secret.png", 0).unwrap();
}

#[test]
fn the_digest_of_a_mesh_is_that_of_its_buffers_too() {
    let folder = tempfile::tempdir().unwrap();
    let gltf = r#"{"asset":{"version":"2.0"},"buffers":[{"uri":"a.bin","byteLength":1},{"uri":"data:;base64,AA=="}]}"#;
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("a.gltf", gltf);
    write("a.bin", "one");
    let assets = FileAssets::new(folder.path());
    let digest = || {
        assets.clear_cache();
        assets.digest("a.gltf", 0)
    };
    let before = digest().unwrap();
    assert_eq!(digest().unwrap(), before);
    write("a.bin", "two");
    assert_ne!(digest().unwrap(), before);
    assert_eq!(assets.files("a.gltf", 0).unwrap(), ["a.gltf", "a.bin"].map(|name| folder.path().join(name)));
    fs::remove_file(folder.path().join("a.bin")).unwrap();
    // What is missing is named, not the file that names it.
    let missing = folder.path().join("a.bin").display().to_string();
    assert_eq!(digest().unwrap_err().to_string(), format!("{missing}: no such file"));
    assert_eq!(assets.mesh("a.gltf").unwrap_err().to_string(), format!("{missing}: no such file"));
    fs::create_dir(folder.path().join("a.bin")).unwrap();
    assert!(assets.mesh("a.gltf").unwrap_err().to_string().starts_with(&format!("{missing}: is a folder")));
    fs::remove_dir(folder.path().join("a.bin")).unwrap();
    // A damaged file names no buffers.
    write("a.gltf", "{");
    assert_eq!(assets.files("a.gltf", 0).unwrap().len(), 1);
}

#[test]
fn a_mesh_finds_its_buffer_by_an_encoded_uri() {
    let folder = tempfile::tempdir().unwrap();
    let gltf = |uri: &str| format!(r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"uri":"{uri}","byteLength":1}}]}}"#);
    let files = |uri: &str| {
        fs::write(folder.path().join("a.gltf"), gltf(uri)).unwrap();
        FileAssets::new(folder.path()).files("a.gltf", 0).unwrap()[1].file_name().unwrap().to_owned()
    };
    assert_eq!(files("My%20Mesh.bin"), "My Mesh.bin");
    assert_eq!(files("%E7%81%AB.bin"), "火.bin");
    assert_eq!(files("100%.bin"), "100%.bin");
    fs::write(folder.path().join("My%20Mesh.bin"), "x").unwrap();
    assert_eq!(files("My%20Mesh.bin"), "My%20Mesh.bin");
}
