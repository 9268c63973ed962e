//! Input files: only regular files within limits, a scene from standard input, and no file outside of `--asset-root`.

use std::{
    fs,
    io::Write,
    process::{Child, Stdio},
};

use crate::support::{FLAME, Folder, Run, decode_png, read_exr};

/// A scene over the plate `name`.
fn over(name: &str) -> String {
    format!("{FLAME}\n[plate]\nimage = \"{name}\"\n")
}

/// The single error of a command that refuses a scene.
fn refused(folder: &Folder, arguments: &[&str]) -> String {
    let run = folder.run(arguments);
    assert_eq!((run.code, run.errors()), (Some(3), 1), "{arguments:?}: {}", run.stderr);
    run.stderr
}

fn write_to(mut child: Child, text: &str) -> Run {
    let mut stdin = child.stdin.take().unwrap();
    // A program that has seen enough closes it.
    let _ = stdin.write_all(text.as_bytes());
    drop(stdin);
    Run::of(child.wait_with_output().unwrap())
}

fn piped(folder: &Folder, arguments: &[&str], text: &str) -> Run {
    let mut command = folder.command(arguments);
    let child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    write_to(child, text)
}

#[test]
fn a_scene_from_standard_input_is_that_of_a_file() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["render", "scene.toml", "--frames", "3", "--out", "file.png"]);
    let run = piped(&folder, &["render", "-", "--frames", "3", "--out", "pipe.png"], FLAME);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert_eq!(fs::read(folder.path("file.png")).unwrap(), fs::read(folder.path("pipe.png")).unwrap());
    let run = piped(&folder, &["check", "-"], &FLAME.replace("frames = 6", "frames = -6"));
    assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
    assert!(run.stderr.contains("stdin:5:10: picture.frames: -6 is out of range"), "{}", run.stderr);
    // Without another name pictures are called after it.
    assert_eq!(piped(&folder, &["render", "-", "--frames", "0"], FLAME).code, Some(0));
    assert!(folder.path("out/stdin/stdin.0000.png").exists());
}

#[test]
fn more_than_a_scene_may_have_is_not_read() {
    let folder = Folder::new();
    let large = format!("{FLAME}{}", "#".repeat(16 << 20));
    folder.write("scene.toml", &large);
    let told = refused(&folder, &["check", "scene.toml"]);
    assert!(told.contains("scene.toml: the scene cannot be read: has 16.0 MiB; allowed: up to 16.0 MiB"), "{told}");
    let run = piped(&folder, &["check", "-"], &large);
    assert_eq!(run.code, Some(3), "{}", run.stderr);
    assert!(run.stderr.contains("stdin: the scene cannot be read: has more bytes than are read"), "{}", run.stderr);
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused_wherever_a_file_is_named() {
    use std::os::unix::fs::symlink;
    let folder = Folder::new();
    let made = std::process::Command::new("mkfifo").arg(folder.path("pipe")).status().unwrap();
    assert!(made.success());
    for (name, found) in [("pipe", "a pipe"), ("/dev/zero", "a device"), ("/dev", "a folder")] {
        let target = if name == "pipe" { folder.path(name) } else { name.into() };
        for extension in ["toml", "png", "exr", "gltf", "svg"] {
            let link = folder.path(&format!("link.{extension}"));
            drop(fs::remove_file(&link));
            symlink(&target, link).unwrap();
        }
        let obstacle = "bansho = 2\n[[obstacle]]\nshape = \"mesh\"\nfile = \"link.gltf\"\n[[flame_particles]]\n";
        let aurora = "bansho = 2\n[[aurora]]\nshapes = [{ kind = \"svg\", file = \"link.svg\" }]\n";
        folder.write("png.toml", &over("link.png"));
        folder.write("exr.toml", &over("link.exr"));
        folder.write("gltf.toml", obstacle);
        folder.write("svg.toml", aurora);
        for scene in ["link.toml", "png.toml", "exr.toml", "gltf.toml"] {
            let told = refused(&folder, &["check", scene]);
            assert!(told.contains(&format!("is {found}; allowed: a regular file")), "{scene}: {told}");
        }
        assert_eq!(folder.run(&["check", "svg.toml"]).code, Some(3));
    }
}

#[test]
fn a_plate_that_would_take_too_much_memory_is_refused_with_what_may_be_done() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["render", "scene.toml", "--frames", "0", "--size", "400x300", "--out", "plate.png"]);
    folder.write("over.toml", &over("plate.png"));
    folder.succeed(&["check", "over.toml", "--max-asset-memory", "3MiB"]);
    let told = refused(&folder, &["check", "over.toml", "--max-asset-memory", "1MiB"]);
    let parts =
        ["over.toml:16:9: plate.image: ", "would take 1.9 MiB of memory", "up to 1.0 MiB", "--max-asset-memory"];
    assert!(parts.iter().all(|part| told.contains(part)), "{told}");
    let run = folder.run(&["check", "over.toml", "--max-asset-memory", "1"]);
    assert_eq!(run.code, Some(2));
    assert!(run.stderr.contains("512MiB"), "{}", run.stderr);
}

#[test]
fn a_root_confines_all_that_a_scene_names() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["render", "scene.toml", "--frames", "0", "--out", "secret.png"]);
    folder.succeed(&["render", "scene.toml", "--frames", "0", "--out", "job/plates/own.png"]);
    folder.write("job/own.toml", &over("plates/own.png"));
    folder.write("job/other.toml", &over("../secret.png"));
    for root in ["job", "."] {
        folder.succeed(&["check", "job/own.toml", "--asset-root", root]);
    }
    folder.succeed(&["check", "job/other.toml"]);
    folder.succeed(&["check", "job/other.toml", "--asset-root", "."]);
    for command in [&["check"][..], &["render", "--frames", "0", "--out", "a.png"]] {
        let told = refused(&folder, &[command, &["job/other.toml", "--asset-root", "job"]].concat());
        assert!(told.contains("lies outside job, the asset root of this scene"), "{told}");
    }
    let run = folder.run(&["check", "job/own.toml", "--asset-root", "gone"]);
    assert_eq!(run.code, Some(2), "{}", run.stderr);
}

/// A float map of 48 x 64 values, such as one made by an estimator of depth.
fn float_map(value: impl Fn(usize) -> f32) -> Vec<u8> {
    let values = (0..48 * 64).flat_map(|index| value(index % 48).to_le_bytes());
    [b"Pf\n48 64\n-1.0\n".to_vec(), values.collect()].concat()
}

#[test]
fn a_depth_that_hides_nothing_is_told_and_negative_z_hides_as_the_distance_does() {
    let folder = Folder::new();
    folder.write("flat.toml", "bansho = 2\n[picture]\nsize = [48, 64]\nframes = 1\n[sky]\nkind = \"uniform\"\n");
    folder.succeed(&["render", "flat.toml", "-o", "flat.png"]);
    // The flame is about 3 m away.
    let left = |near: f32, far: f32| move |column: usize| if column < 24 { near } else { far };
    let picture = |name: &str, map: Vec<u8>| {
        fs::write(folder.path("depth.pfm"), map).unwrap();
        folder.write("scene.toml", &format!("{}depth = \"depth.pfm\"\nexposure_ev100 = 8\n", over("flat.png")));
        let out = format!("{name}.png");
        let run = folder.succeed(&["render", "scene.toml", "--frames", "3", "-o", &out]);
        let checked = folder.succeed(&["check", "scene.toml"]);
        (decode_png(&fs::read(folder.path(&out)).unwrap()).bytes, [run.stderr, checked.stdout, checked.stderr].concat())
    };
    let (distance, told) = picture("distance", float_map(left(2.0, 100.0)));
    assert!(!told.contains("the depth"), "{told}");
    let (negative, told) = picture("negative", float_map(left(-2.0, -100.0)));
    assert!(told.contains("the depth is negative, as z of a camera that looks toward -z"), "{told}");
    assert!(distance == negative, "the same picture");
    let (open, told) = picture("zero", float_map(left(0.0, 0.0)));
    assert!(told.contains("hides nothing, since none of its 3072 values is a valid depth: all are 0"), "{told}");
    assert!(open != distance, "the left half of the flame is hidden");
    for (value, words) in
        [(f32::NAN, "all are not a number"), (f32::INFINITY, "all are infinite"), (1e30, "farther than")]
    {
        let (other, told) = picture("other", float_map(left(value, value)));
        assert!(told.contains(words) && other == open, "{value}: {told}");
    }
    let (mixed, told) = picture("mixed", float_map(left(2.0, -1.0)));
    assert!(told.contains("1536 of its 3072 values are negative") && mixed == distance, "{told}");
}

#[test]
fn raw_light_comes_back_as_a_plate_and_films_refuse_it() {
    let folder = Folder::new();
    let scene = "bansho = 2\n[picture]\nsize = [32, 18]\nframes = 1\nexposure_ev100 = 8\n";
    let sky = "[sky]\nluminance = 70\nkind = \"uniform\"\ntemperature_k = 3000\n";
    folder.write("sky.toml", &format!("{scene}{sky}"));
    folder.write("back.toml", &format!("{scene}[plate]\nimage = \"raw.png\"\nexposure_ev100 = 8\n"));
    folder.succeed(&["render", "sky.toml", "-o", "sky.exr"]);
    let light = read_exr(&folder.path("sky.exr")).channels["R"][0];
    assert!((0.05..0.95).contains(&light), "{light}");
    for (bits, tolerance) in [("8", 1.01 / 255.0), ("16", 1e-3)] {
        folder.succeed(&["render", "sky.toml", "--view", "raw", "--bits", bits, "-o", "raw.png"]);
        folder.succeed(&["render", "back.toml", "-o", "back.exr"]);
        let back = read_exr(&folder.path("back.exr")).channels["R"][0];
        assert!((back - light).abs() < tolerance, "{bits} bits: {light} became {back}");
    }
    for film in ["a.gif", "a.mp4", "a.mov", "a.webm"] {
        let run = folder.run(&["render", "sky.toml", "--view", "raw", "-o", film]);
        assert_eq!((run.code, run.errors()), (Some(2), 1), "{film}: {}", run.stderr);
        assert!(run.stderr.contains("--view: the view `raw` is linear light in ACEScg, which a."), "{}", run.stderr);
    }
}
