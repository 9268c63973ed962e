//! Overwriting: files that a scene is read from are never overwritten, and files that Bansho did not make only with `--overwrite`.

use std::{fs, path::Path};

use crate::support::{FLAME, Folder};

/// A particle flame from a mesh, before a plate.
const LAID: &str = "\
bansho = 2
[picture]
size = [48, 64]
frames = 2
[plate]
image = \"plate.png\"
[[flame_particles]]
particles = 60
preroll_s = 0.1
[[flame_particles.burners]]
shape = \"mesh\"
file = \"mesh.gltf\"
";

/// A triangle, its corners in a file of their own.
const MESH: &str = "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],\
    \"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],\
    \"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[1,0,1]}],\
    \"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],\"buffers\":[{\"byteLength\":36,\"uri\":\"mesh.bin\"}]}";

fn laid() -> Folder {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["render", "scene.toml", "--frames", "0", "--out", "plate.png"]);
    folder.write("laid.toml", LAID);
    folder.write("mesh.gltf", MESH);
    let corners = [[0.0_f32; 3], [0.2, 0.0, 0.0], [0.0, 0.0, 0.2]];
    let bytes: Vec<u8> = corners.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
    fs::write(folder.path("mesh.bin"), bytes).unwrap();
    folder
}

/// Runs with and without `--overwrite`, and must leave everything in the folder as it is.
fn refused(folder: &Folder, arguments: &[&str], named: &str) {
    let before = folder.files("");
    for more in [&[][..], &["--overwrite"]] {
        let run = folder.run(&[arguments, more].concat());
        assert_eq!((run.code, run.errors()), (Some(2), 1), "{arguments:?} {more:?}: {}", run.stderr);
        let said = format!("error: {named}: is a file that the scene is read from; allowed: any other name");
        assert!(run.stderr.contains(&said), "{arguments:?}: {}", run.stderr);
        assert!(folder.files("") == before, "{arguments:?}: files have changed");
        assert!(!folder.path("x").exists(), "not even a folder");
    }
}

#[test]
fn a_path_through_a_folder_that_is_missing_does_not_lead_to_an_input() {
    let folder = laid();
    refused(&folder, &["render", "laid.toml", "--frames", "0", "--out", "./x/../plate.png"], "./x/../plate.png");
    refused(&folder, &["render", "laid.toml", "--frames", "0", "--out", "x/y/../../plate.png"], "x/y/../../plate.png");
    refused(&folder, &["render", "laid.toml", "--contact-sheet", "2", "--out", "x/../plate.png"], "x/../plate.png");
}

#[cfg(unix)]
#[test]
fn no_output_of_any_command_is_a_hard_link_to_an_input() {
    let folder = laid();
    folder.succeed(&["render", "laid.toml", "--out", "f.exr", "--frames", "0-1"]);
    let gas = ["simulate", "laid.toml", "--particles", "x/../gas.ply", "--frames", "0"];
    let states = ["render", "laid.toml", "--snapshots", "x/../states", "--snapshot-every", "1"];
    let cases: [(&str, &str, &str, &[&str]); 10] = [
        ("plate.png", "a.png", "x/../a.png", &["render", "laid.toml", "--frames", "0", "--out", "x/../a.png"]),
        ("mesh.bin", "a.png", "a.png", &["render", "laid.toml", "--frames", "0", "--out", "a.png"]),
        ("mesh.gltf", "a.0001.exr", "a.0001.exr", &["render", "laid.toml", "--out", "a.exr"]),
        ("laid.toml", "a.gif", "x/../a.gif", &["render", "laid.toml", "--out", "x/../a.gif"]),
        ("plate.png", "a.mp4", "x/../a.mp4", &["render", "laid.toml", "--out", "x/../a.mp4"]),
        ("plate.png", "f.0001.json", "f.0001.json", &["render", "laid.toml", "--metadata", "--out", "f.exr"]),
        (
            "plate.png",
            "book.json",
            "x/../book.json",
            &["flipbook", "laid.toml", "--grid", "1x2", "--out", "x/../book.png"],
        ),
        ("mesh.bin", "gas.ply", "x/../gas.ply", &gas),
        ("plate.png", "states/state.1.bansho", "x/../states/state.1.bansho", &states),
        ("plate.png", "sheet.png", "sheet.png", &["render", "laid.toml", "--contact-sheet", "2", "--out", "sheet.png"]),
    ];
    fs::create_dir(folder.path("states")).unwrap();
    for (input, link, named, arguments) in cases {
        fs::hard_link(folder.path(input), folder.path(link)).unwrap();
        refused(&folder, arguments, named);
        fs::remove_file(folder.path(link)).unwrap();
    }
}

/// All commands with outputs in `f/`, and one of the files that they write.
const COMMANDS: [(&str, &[&str]); 11] = [
    ("f/a.png", &["render", "scene.toml", "--frames", "0", "--out", "f/a.png"]),
    ("f/b.0000.exr", &["render", "scene.toml", "--frames", "0-1", "--out", "f/b.exr"]),
    ("f/c.json", &["render", "scene.toml", "--frames", "0", "--metadata", "--out", "f/c.png"]),
    ("f/d.apng", &["render", "scene.toml", "--frames", "0-1", "--out", "f/d.apng"]),
    ("f/e.gif", &["render", "scene.toml", "--frames", "0-1", "--out", "f/e.gif"]),
    ("f/g.png", &["render", "scene.toml", "--contact-sheet", "2", "--out", "f/g.png"]),
    ("f/h_alpha.png", &["flipbook", "scene.toml", "--grid", "1x2", "--out", "f/h.png"]),
    ("f/h.json", &["flipbook", "scene.toml", "--grid", "1x2", "--out", "f/h.png"]),
    ("f/streak_1_1.png", &["streaks", "--rates", "1", "--diameters", "1", "--size", "16", "--out", "f"]),
    ("f/streaks.json", &["streaks", "--rates", "1", "--diameters", "1", "--size", "16", "--out", "f"]),
    ("f/i.ply", &["simulate", "gas.toml", "--frames", "0", "--particles", "f/i.ply"]),
];

const GAS: &str = "\
bansho = 2
[picture]
size = [48, 64]
frames = 4
[[flame_particles]]
particles = 60
preroll_s = 0.1
";

/// A foreign file is kept, replaced with `--overwrite`, and then replaced without it, since Bansho made it.
fn keeps_what_is_not_ours(folder: &Folder, file: &str, arguments: &[&str]) {
    folder.write(file, "somebody's work");
    let before = folder.names();
    let run = folder.run(arguments);
    assert_eq!((run.code, run.errors()), (Some(2), 1), "{arguments:?}: {}", run.stderr);
    let said =
        format!("error: {file}: already exists and was not made by Bansho; allowed: another name, or --overwrite");
    assert!(run.stderr.contains(&said), "{arguments:?}: {}", run.stderr);
    assert_eq!(folder.names(), before, "nothing else may be written");
    assert_eq!(fs::read(folder.path(file)).unwrap(), b"somebody's work");
    folder.succeed(&[arguments, &["--overwrite"]].concat());
    let ours = fs::read(folder.path(file)).unwrap();
    assert_ne!(ours, b"somebody's work");
    folder.succeed(arguments);
    assert!(fs::read(folder.path(file)).unwrap() == ours, "{file}: the same job gives the same bytes");
    // What a power cut may leave of a file.
    fs::write(folder.path(file), "").unwrap();
    folder.succeed(arguments);
    assert!(fs::read(folder.path(file)).unwrap() == ours, "{file}");
    fs::remove_dir_all(folder.path("f")).unwrap();
}

#[test]
fn a_file_that_bansho_did_not_make_is_only_replaced_when_asked_to() {
    let folder = Folder::with_scene(FLAME);
    folder.write("gas.toml", GAS);
    for (file, arguments) in COMMANDS {
        keeps_what_is_not_ours(&folder, file, arguments);
    }
}

#[test]
#[ignore = "needs ffmpeg"]
fn a_film_that_bansho_did_not_make_is_only_replaced_when_asked_to() {
    let folder = Folder::with_scene(FLAME);
    for file in ["f/a.mp4", "f/a.mov", "f/a.webm"] {
        keeps_what_is_not_ours(&folder, file, &["render", "scene.toml", "--frames", "0-1", "--out", file]);
    }
}

#[test]
fn the_first_of_many_files_is_named_and_the_others_are_counted() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["render", "scene.toml", "--out", "f.png"]);
    for number in [1, 3, 4] {
        folder.write(&format!("f.000{number}.png"), "a photograph");
    }
    let before = folder.files("");
    for resume in [&[][..], &["--resume"]] {
        let run = folder.run(&[&["render", "scene.toml", "--out", "f.png"], resume].concat());
        assert_eq!((run.code, run.errors()), (Some(2), 1), "{}", run.stderr);
        assert!(
            run.stderr.contains("error: f.0001.png and 2 other files: already exist and were not made by Bansho"),
            "{}",
            run.stderr
        );
        assert!(folder.files("") == before);
    }
}

#[test]
fn a_snapshot_that_bansho_did_not_make_is_only_replaced_when_asked_to() {
    let folder = Folder::with_scene(GAS);
    folder.write("states/state.2.bansho", "somebody's work");
    for arguments in [
        &["render", "scene.toml", "--out", "f/f.png", "--snapshots", "states"][..],
        &["simulate", "scene.toml", "--particles", "f/f.ply", "--snapshots", "states"],
    ] {
        let run = folder.run(arguments);
        assert_eq!((run.code, run.errors()), (Some(2), 1), "{}", run.stderr);
        assert!(run.stderr.contains("error: states/state.2.bansho: already exists"), "{}", run.stderr);
        assert_eq!(folder.names(), ["scene.toml", "states/state.2.bansho"]);
    }
    let render = ["render", "scene.toml", "--out", "f/f.png", "--snapshots", "states"];
    folder.succeed(&[&render[..], &["--overwrite"]].concat());
    assert!(folder.files("states")["state.2.bansho"].starts_with(b"BANSHOSS"));
    assert!(!folder.succeed(&render).stderr.contains("not used"), "ours by now");
}

#[test]
fn a_new_scene_never_takes_the_place_of_a_file() {
    let folder = Folder::with_scene(FLAME);
    for name in ["scene", "x/../scene"] {
        let run = folder.run(&["new", name]);
        assert_eq!((run.code, run.errors()), (Some(1), 1), "{}", run.stderr);
        assert_eq!(fs::read_to_string(folder.path("scene.toml")).unwrap(), FLAME);
    }
}

#[test]
fn what_comes_on_the_way_and_is_not_ours_stays() {
    let folder = Folder::with_scene(&FLAME.replace("48, 64", "160, 120").replace("frames = 6", "frames = 400"));
    let child = folder
        .command(&["render", "scene.toml", "--out", "f/f.png"])
        .stderr(std::process::Stdio::piped())
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    crate::support::wait_until("a frame", || folder.path("f/f.0002.png").exists());
    fs::write(folder.path("f/f.0399.png"), "a photograph").unwrap();
    let run = crate::support::Run::of(child.wait_with_output().unwrap());
    assert_eq!((run.code, run.errors()), (Some(1), 1), "{}", run.stderr);
    let said = "f.0399.png: already exists and was not made by Bansho; allowed: another name, or --overwrite";
    assert!(run.stderr.contains(said), "{}", run.stderr);
    assert_eq!(fs::read(folder.path("f/f.0399.png")).unwrap(), b"a photograph");
    assert!(folder.path("f/f.0100.png").exists() && !has_parts(&folder.path("f")));
}

fn has_parts(folder: &Path) -> bool {
    fs::read_dir(folder).unwrap().any(|entry| entry.unwrap().file_name().to_string_lossy().ends_with(".part"))
}
