//! At the end, all requested files exist, or the program lists those that do not.

use std::{
    fs,
    process::{Child, Stdio},
};

use crate::support::{FLAME, Folder, Run, wait_until};

const FRAMES: usize = 200;

fn long_scene() -> Folder {
    Folder::with_scene(&FLAME.replace("48, 64", "160, 120").replace("frames = 6", &format!("frames = {FRAMES}")))
}

fn start(folder: &Folder, arguments: &[&str]) -> Child {
    folder.command(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn failed(child: Child) -> String {
    let run = Run::of(child.wait_with_output().unwrap());
    assert_eq!((run.code, run.errors()), (Some(1), 1), "{}", run.stderr);
    run.stderr
}

#[test]
fn frames_that_vanish_or_are_changed_on_the_way_are_listed() {
    for extension in ["png", "exr"] {
        let folder = long_scene();
        let name = |number: usize| folder.path(&format!("f/f.{number:04}.{extension}"));
        let child = start(&folder, &["render", "scene.toml", "--out", &format!("f/f.{extension}"), "--metadata"]);
        // Frames finish in another order than that of their numbers, but not that far apart.
        wait_until("half of the frames", || name(100).exists());
        (3..=14).for_each(|number| fs::remove_file(name(number)).unwrap());
        let bytes = fs::read(name(20)).unwrap();
        fs::write(name(20), &bytes[..bytes.len() - 1]).unwrap();
        fs::remove_file(folder.path("f/f.0022.json")).unwrap();
        // Another program that makes the same frame.
        let (copy, bytes) = (folder.path("copy"), fs::read(name(25)).unwrap());
        fs::write(&copy, bytes).unwrap();
        fs::rename(&copy, name(25)).unwrap();
        let told = failed(child);
        let said = format!(
            "error: f/f.####.{extension}: frames 3-14, 20, 22 are missing, or changed after this job wrote them"
        );
        assert!(told.contains(&said) && told.contains("; --frames draws them again"), "{told}");
        // The list can be used as `--frames`.
        let again = ["render", "scene.toml", "--frames", "3-14,20,22", "--out", &format!("f/f.{extension}")];
        folder.succeed(&[&again[..], &["--metadata"]].concat());
        let all =
            folder.succeed(&["render", "scene.toml", "--out", &format!("f/f.{extension}"), "--resume", "--metadata"]);
        assert!(all.stderr.starts_with("0 frames in "), "{}", all.stderr);
    }
}

#[test]
fn a_folder_that_is_moved_away_on_the_way_is_no_success() {
    let folder = long_scene();
    let child = start(&folder, &["render", "scene.toml", "--out", "f/f.png"]);
    wait_until("some frames", || folder.path("f/f.0012.png").exists());
    fs::rename(folder.path("f"), folder.path("gone")).unwrap();
    let told = failed(child);
    let is_gone = |number: &usize| !folder.path(&format!("f/f.{number:04}.png")).exists();
    let gone: Vec<usize> = (0..FRAMES).filter(is_gone).collect();
    assert!(gone.len() >= 12, "{gone:?}");
    let range = |run: &[usize]| match run {
        [first, .., last] => format!("{first}-{last}"),
        run => format!("{}", run[0]),
    };
    let ranges: Vec<String> = gone.chunk_by(|a, b| a + 1 == *b).map(range).collect();
    let is_listed = told.contains(&format!("f/f.####.png: frames {} are missing", ranges.join(", ")));
    // The frame that was just being written may be what fails.
    assert!(is_listed || told.contains("cannot be written"), "{told}, {gone:?}");
}

#[test]
fn frames_that_were_there_before_are_looked_for_too() {
    let folder = long_scene();
    folder.succeed(&["render", "scene.toml", "--out", "f/f.png", "--frames", "0-9"]);
    let child = start(&folder, &["render", "scene.toml", "--out", "f/f.png", "--resume"]);
    wait_until("a new frame", || folder.path("f/f.0010.png").exists());
    fs::remove_file(folder.path("f/f.0004.png")).unwrap();
    let told = failed(child);
    assert!(told.contains("f/f.####.png: frame 4 is missing, or changed after this job wrote it"), "{told}");
}

#[test]
fn particles_and_textures_are_looked_for_too() {
    let gas = "bansho = 2\n[picture]\nframes = 60\n[[flame_particles]]\nparticles = 300\npreroll_s = 0.1\n";
    let folder = Folder::with_scene(gas);
    let child = start(&folder, &["simulate", "scene.toml", "--particles", "p/gas.ply"]);
    wait_until("particles", || folder.path("p/gas.0003.ply").exists());
    fs::remove_file(folder.path("p/gas.0001.ply")).unwrap();
    fs::write(folder.path("p/gas.0002.ply"), "ply").unwrap();
    let told = failed(child);
    assert!(told.contains("p/gas.####.ply: frames 1-2 are missing") && told.contains("--frames"), "{told}");
    let streaks = ["streaks", "--variants", "40", "--size", "256", "--out", "s", "--threads", "1"];
    let child = start(&folder, &streaks);
    wait_until("a texture", || folder.path("s/streak_1_1_1.png").exists());
    fs::remove_file(folder.path("s/streak_1_1_0.png")).unwrap();
    let told = failed(child);
    assert!(told.contains("error: s/streak_1_1_0.png: missing, or changed after this job wrote"), "{told}");
}

/// The messages of a program that writes to a full device.
#[cfg(target_os = "linux")]
fn onto_a_full_device(folder: &Folder, arguments: &[&str]) -> String {
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let child = folder.command(arguments).stdout(full).stderr(Stdio::piped()).spawn().unwrap();
    let run = Run::of(child.wait_with_output().unwrap());
    assert_eq!((run.code, run.errors()), (Some(1), 1), "{arguments:?}: {}", run.stderr);
    run.stderr
}

#[cfg(target_os = "linux")]
#[test]
fn progress_that_cannot_be_written_costs_no_picture_and_is_an_error() {
    let folder = Folder::with_scene(FLAME);
    let told = onto_a_full_device(&folder, &["render", "scene.toml", "--out", "f/f.png", "--progress", "json"]);
    assert!(told.contains("error: progress was lost: standard output: No space left on device"), "{told}");
    assert_eq!(folder.files("f").len(), 6);
    let gas = "bansho = 2\n[picture]\nframes = 1\n[[flame_particles]]\nparticles = 60\npreroll_s = 0.1\n";
    folder.write("gas.toml", gas);
    for arguments in [
        &["flipbook", "scene.toml", "--grid", "1x2", "--out", "f/book.png"][..],
        &["streaks", "--rates", "1", "--size", "16", "--out", "f"],
        &["simulate", "gas.toml", "--particles", "f/gas.ply"],
    ] {
        onto_a_full_device(&folder, &[arguments, &["--progress", "json"]].concat());
    }
    assert!(["f/book.json", "f/streaks.json", "f/gas.ply"].iter().all(|name| folder.path(name).exists()));
}

#[cfg(target_os = "linux")]
#[test]
fn text_that_cannot_be_written_is_an_error() {
    let folder = Folder::with_scene(FLAME);
    for arguments in [
        &["check", "scene.toml"][..],
        &["schema"],
        &["new", "--list"],
        &["new", "fresh"],
        &["completions", "bash"],
        &["man"],
        &["calibrate"],
        &["plot", "quenching", "-o", "-"],
        &["--help"],
        &["render", "--help"],
        &["--version"],
    ] {
        let told = onto_a_full_device(&folder, arguments);
        assert!(told.contains("error: standard output: No space left on device"), "{arguments:?}: {told}");
    }
}

#[test]
fn who_stops_listening_loses_progress_and_no_picture() {
    use std::io::{BufRead, BufReader};
    let folder = Folder::with_scene(FLAME);
    let mut child = start(&folder, &["render", "scene.toml", "--out", "f/f.png", "--progress", "json"]);
    let mut first = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut first).unwrap();
    assert!(first.contains("start"), "{first}");
    let run = Run::of(child.wait_with_output().unwrap());
    assert_eq!((run.code, run.errors()), (Some(1), 1), "{}", run.stderr);
    assert!(run.stderr.contains("progress was lost"), "{}", run.stderr);
    assert_eq!(folder.files("f").len(), 6);
}
