//! Templates of Open Job Description, and their steps.

use std::{fs, path::Path};

use super::{SIMULATED, folder, read};
use crate::support::{FLAME, Folder};

#[test]
fn a_template_replaces_only_templates() {
    let folder = folder();
    folder.succeed(&["farm", "openjd", "scene.toml", "-o", "a.yaml", "--", "--seed", "3"]);
    folder.succeed(&["farm", "openjd", "scene.toml", "-o", "a.yaml", "--chunk", "3"]);
    let text = read(&folder, "a.yaml");
    assert!(
        text.contains("name: ChunkFrames\n    type: INT\n    description: \"Frames of a chunk.\"\n    default: 3\n"),
        "{text}"
    );
    let refused = folder.run(&["farm", "openjd", "scene.toml", "-o", "scene.toml"]);
    assert_eq!((refused.code, read(&folder, "scene.toml").as_str()), (Some(1), FLAME));
    let twice = folder.run(&["farm", "openjd", "scene.toml", "-o", "b.yaml", "--", "--size", "9x9"]);
    assert_eq!((twice.code, twice.errors()), (Some(2), 1), "{}", twice.stderr);
    assert!(!Path::new(&folder.path("b.yaml")).exists());
}

#[test]
fn the_steps_of_a_template_draw_the_bytes_of_one_process() {
    let (folder, alone) = (folder(), Folder::with_scene(SIMULATED));
    folder.write("scene.toml", SIMULATED);
    let out = "-o=out/scene/scene.####.png";
    let snapshots = |frames: &str, tiles: &str| {
        let chunks = ["--chunk=3", "--snapshots=out/scene/states", frames, tiles];
        folder.succeed(&[&["farm", "snapshots", "scene.toml", out][..], &chunks].concat()).stdout
    };
    assert_eq!(snapshots("--frames=0-5", "--tiles=1x1"), "0 snapshots written\n", "two chunks need none");
    assert_eq!(snapshots("--frames=0-8", "--tiles=2x1"), "3 snapshots written\n");
    assert_eq!(snapshots("--frames=0-8", "--tiles=2x1"), "0 snapshots written\n");
    let tile = |tile: &str, frames: &str| {
        let states = ["--snapshots=out/scene/states", "--snapshot-every=9223372036854775807"];
        folder
            .run(&[&["farm", "tile", "scene.toml", out, "--resume", "--tiles=2x1", tile, frames][..], &states].concat())
    };
    for frames in ["--frames=0-2", "--frames=3-5", "--frames=6-8"] {
        assert_eq!(tile("--tile=0", frames).code, Some(0));
        let missing = folder.run(&["farm", "finish", "scene.toml", out, "--tiles=2x1"]);
        assert!(missing.code == Some(1) && missing.stderr.contains("are missing"), "{}", missing.stderr);
        assert_eq!(tile("--tile=1", frames).code, Some(0));
    }
    let beyond = tile("--tile=2", "--frames=0");
    assert_eq!(beyond.code, Some(2));
    assert!(beyond.stderr.contains("there is no tile 2; allowed: 0 to 1"), "{}", beyond.stderr);
    fs::remove_dir_all(folder.path("out/scene/states")).unwrap();
    assert_eq!(snapshots("--frames=0-8", "--tiles=2x1"), "0 snapshots written\n", "all frames are whole");
    folder.succeed(&["farm", "finish", "scene.toml", out, "--tiles=2x1", "--film=a.apng", "--contact-sheet=4"]);
    alone.succeed(&["render", "scene.toml"]);
    for (name, bytes) in alone.files("out/scene") {
        assert!(folder.files("out/scene")[&name] == bytes, "{name}");
    }
    assert!(folder.path("a.apng").exists() && folder.path("out/scene/scene.sheet.png").exists());
}

#[test]
fn a_machine_is_checked_against_a_template() {
    let folder = folder();
    let options = [
        "--tiles",
        "2x1",
        "--contact-sheet",
        "4",
        "--film",
        "a.apng",
        "--flipbook",
        "game/f.png",
        "--flipbook-grid",
        "2x2",
    ];
    folder.succeed(&[&["farm", "openjd", "scene.toml", "-o", "a.yaml"][..], &options].concat());
    let text = read(&folder, "a.yaml");
    let value = |name: &str| {
        let (_, rest) = text.split_once(&format!("\"--{name}=")).unwrap();
        format!("--{name}={}", rest.split_once('"').unwrap().0)
    };
    let [token, made_by, arithmetic] = ["token", "made-by", "arithmetic"].map(value);
    let check = |more: &[&str]| {
        let line = ["farm", "check", "--out=shot/a.####.png", &token, &made_by, &arithmetic];
        folder.run(&[&line[..], more].concat())
    };
    assert_eq!(check(&["--leave-token"]).code, Some(0));
    assert_eq!(check(&[]).code, Some(0));
    let other = folder.run(&["farm", "check", "--out=shot/a.####.png", &token, "--made-by=Bansho 0.0.1", &arithmetic]);
    assert!(
        other.code == Some(1) && other.stderr.contains("the tasks were planned by Bansho 0.0.1"),
        "{}",
        other.stderr
    );
    let other = folder.run(&["farm", "check", "--out=shot/a.####.png", &token, &made_by, "--arithmetic=00"]);
    assert!(other.code == Some(1) && other.stderr.contains("does not reproduce the bytes"), "{}", other.stderr);
}
