//! The program is interrupted: finished frames are kept, and `--resume` gives the same bytes as an uninterrupted run.

use std::{
    fs,
    process::{Child, Stdio},
};

#[cfg(unix)]
use crate::support::Run;
use crate::support::{FLAME, Folder, decode_png, read_exr, wait_until};

/// Enough frames that nobody finishes them before they are stopped.
const MANY: usize = 1500;

fn long_scene() -> Folder {
    Folder::with_scene(&FLAME.replace("48, 64", "160, 120").replace("frames = 6", &format!("frames = {MANY}")))
}

fn start(folder: &Folder, arguments: &[&str]) -> Child {
    folder.command(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn finished(folder: &Folder, inside: &str) -> usize {
    folder.names().iter().filter(|name| name.starts_with(inside) && !name.ends_with(".part")).count()
}

#[cfg(unix)]
fn signal(child: &Child, name: &str) {
    let sent =
        std::process::Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

#[test]
fn killed_in_the_middle_only_whole_frames_bear_names_and_resume_completes_them() {
    let folder = long_scene();
    let numbers = ["--frames", "0-59"];
    for (extension, in_flight) in [("png", "1"), ("exr", "4")] {
        let killed = format!("{extension}/f.{extension}");
        let work = ["--threads", "4", "--frames-in-flight", in_flight];
        let mut child = start(&folder, &[&["render", "scene.toml", "--out", &killed], &work[..]].concat());
        wait_until("some frames", || finished(&folder, extension) >= 7);
        child.kill().unwrap();
        let status = child.wait().unwrap();
        assert!(!status.success(), "it must have been killed, not have finished");
        #[cfg(unix)]
        assert_eq!(status.code(), None, "a signal ended it");
        let there = finished(&folder, extension);
        assert!((7..MANY).contains(&there));
        for name in folder.names().iter().filter(|name| name.starts_with(extension) && !name.ends_with(".part")) {
            match extension {
                "png" => assert_eq!(decode_png(&fs::read(folder.path(name)).unwrap()).width, 160, "{name}"),
                _ => assert_eq!(read_exr(&folder.path(name)).size, [160, 120], "{name}"),
            }
        }
        let whole = format!("{extension} whole/f.{extension}");
        folder.succeed(&[&["render", "scene.toml", "--out", &whole], &numbers[..]].concat());
        let resume = ["render", "scene.toml", "--resume", "--out", &killed];
        let resumed = folder.succeed(&[&resume, &numbers[..], &work[..]].concat());
        assert!(resumed.stderr.contains("were kept"), "{}", resumed.stderr);
        let all = folder.files(extension);
        let expected = folder.files(&format!("{extension} whole"));
        assert_eq!(expected.len(), 60);
        assert!(expected.iter().all(|(name, bytes)| all[name] == *bytes), "{extension}");
    }
}

#[test]
fn resume_draws_broken_and_foreign_frames_and_no_others() {
    let folder = Folder::with_scene(FLAME);
    for extension in ["png", "exr"] {
        let out = format!("{extension}/f.{extension}");
        let name = |number: usize| folder.path(&format!("{extension}/f.{number:04}.{extension}"));
        folder.succeed(&["render", "scene.toml", "--out", &out]);
        let expected = folder.files(extension);
        let bytes = fs::read(name(1)).unwrap();
        fs::write(name(1), &bytes[..bytes.len() - 5]).unwrap();
        let mut spoiled = fs::read(name(2)).unwrap();
        let middle = spoiled.len() / 2;
        spoiled[middle] ^= 1;
        fs::write(name(2), spoiled).unwrap();
        folder.succeed(&[
            "render",
            "scene.toml",
            "--seed",
            "99",
            "--frames",
            "3",
            "--out",
            &format!("{extension}/f.####.{extension}"),
        ]);
        fs::write(name(4), b"").unwrap();
        fs::remove_file(name(5)).unwrap();
        let untouched = fs::metadata(name(0)).unwrap().modified().unwrap();
        let resumed = folder.succeed(&["render", "scene.toml", "--resume", "--out", &out]);
        assert!(
            resumed.stderr.starts_with("5 frames in ") && resumed.stderr.contains("1 was kept"),
            "{}",
            resumed.stderr
        );
        assert!(folder.files(extension) == expected, "{extension}");
        assert_eq!(fs::metadata(name(0)).unwrap().modified().unwrap(), untouched);
    }
}

#[test]
fn resume_does_not_trust_other_bits() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["render", "scene.toml", "--frames", "0-1", "--out", "f.png"]);
    folder.succeed(&["render", "scene.toml", "--frames", "0-1", "--out", "f.png", "--bits", "16", "--resume"]);
    assert_eq!(decode_png(&folder.files("")["f.0001.png"]).bits, 16);
}

#[cfg(unix)]
#[test]
fn a_signal_stops_it_within_a_second_with_its_own_exit_code_and_resume_continues_to_the_same_bytes() {
    use std::time::{Duration, Instant};
    for (name, code, in_flight) in [("INT", 130, "1"), ("TERM", 143, "1"), ("INT", 130, "4"), ("TERM", 143, "3")] {
        let folder = long_scene();
        let work = ["--threads", "4", "--frames-in-flight", in_flight];
        let child = start(&folder, &[&["render", "scene.toml", "--out", "f/f.png"], &work[..]].concat());
        wait_until("a frame", || finished(&folder, "f/") >= 1);
        signal(&child, name);
        let since = Instant::now();
        let run = Run::of(child.wait_with_output().unwrap());
        assert!(since.elapsed() < Duration::from_secs(1), "{:?}", since.elapsed());
        assert_eq!((run.code, run.errors()), (Some(code), 1), "{}", run.stderr);
        let files = folder.files("f");
        assert!(files.keys().all(|name| name.ends_with(".png")), "no temporary file stays: {:?}", files.keys());
        assert!(files.values().all(|bytes| decode_png(bytes).width == 160));
        let in_order = files.keys().enumerate().all(|(index, name)| *name == format!("f.{index:04}.png"));
        assert!(in_order, "no frame is named before those it follows: {:?}", files.keys());
        let frames = format!("0-{}", files.len() + 8);
        let shot = ["render", "scene.toml", "--frames", &frames];
        let resumed = folder.succeed(&[&shot[..], &["--resume", "--out", "f/f.png"], &work[..]].concat());
        let kept = if files.len() == 1 { "1 was kept".to_owned() } else { format!("{} were kept", files.len()) };
        assert!(resumed.stderr.starts_with("9 frames in ") && resumed.stderr.contains(&kept), "{}", resumed.stderr);
        folder.succeed(&[&shot[..], &["--out", "undisturbed/f.png", "--frames-in-flight", "1"][..]].concat());
        assert!(folder.files("f") == folder.files("undisturbed"), "{name}, {in_flight} in flight");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_film_leaves_nothing() {
    for extension in ["gif", "apng"] {
        let folder = long_scene();
        let child = start(&folder, &["render", "scene.toml", "--out", &format!("film.{extension}")]);
        wait_until("the film to begin", || folder.names().iter().any(|name| name.ends_with(".part")));
        signal(&child, "TERM");
        let run = Run::of(child.wait_with_output().unwrap());
        assert_eq!(run.code, Some(143));
        assert!(
            run.stderr.contains("stopped; nothing is kept, because a video is written only when"),
            "{}",
            run.stderr
        );
        assert_eq!(folder.names(), ["scene.toml"], "{extension}");
    }
}

/// The messages of a program that is interrupted after its `start` event.
#[cfg(unix)]
fn interrupted(folder: &Folder, arguments: &[&str]) -> String {
    use std::io::{BufRead, BufReader};
    let mut child = start(folder, &[arguments, &["--progress", "json"]].concat());
    let mut told = BufReader::new(child.stdout.take().unwrap());
    let mut first = String::new();
    told.read_line(&mut first).unwrap();
    assert!(first.contains("start"), "{first}");
    signal(&child, "INT");
    let run = Run::of(child.wait_with_output().unwrap());
    assert_eq!((run.code, run.errors()), (Some(130), 1), "{}", run.stderr);
    run.stderr
}

#[cfg(unix)]
#[test]
fn the_message_states_what_is_kept_after_an_interruption() {
    let folder = long_scene();
    let sheet = interrupted(&folder, &["render", "scene.toml", "--contact-sheet", "1024"]);
    assert!(sheet.contains("nothing is kept, because a sheet is written only when"), "{sheet}");
    let book =
        interrupted(&folder, &["flipbook", "scene.toml", "--grid", "64x64", "--size", "200x200", "--out", "book.png"]);
    assert!(book.contains("nothing is kept, because a flipbook is written only when"), "{book}");
    assert_eq!(folder.names(), ["scene.toml"]);
    let gas = "bansho = 2\n[picture]\nframes = 1000000\n[[flame_particles]]\nparticles = 300\n";
    folder.write("gas.toml", gas);
    let particles = interrupted(&folder, &["simulate", "gas.toml", "--particles", "p/gas.ply"]);
    assert!(
        particles.contains("stopped; finished files of particles are kept, and --frames selects the others"),
        "{particles}"
    );
    for said in [sheet, book, particles] {
        assert!(!said.contains("--resume"), "{said}");
    }
}

#[cfg(unix)]
#[test]
fn an_interruption_is_told_in_json_too() {
    let folder = long_scene();
    let child = start(&folder, &["render", "scene.toml", "--out", "f/f.png", "--progress", "json"]);
    wait_until("a frame", || finished(&folder, "f/") >= 1);
    signal(&child, "INT");
    let run = Run::of(child.wait_with_output().unwrap());
    let last: serde_json::Value = serde_json::from_str(run.stdout.lines().last().unwrap()).unwrap();
    assert_eq!((last["event"].as_str(), last["code"].as_u64()), (Some("error"), Some(130)));
}

/// Work that does not check for cancellation is ended too, whatever it waits for.
#[cfg(unix)]
#[test]
fn a_signal_ends_what_cannot_stop_by_itself_within_a_second() {
    use std::{
        os::unix::fs::PermissionsExt,
        time::{Duration, Instant},
    };
    let ended = |mut child: Child, folder: &Folder| {
        signal(&child, "TERM");
        let since = Instant::now();
        let stdin = child.stdin.take();
        let run = Run::of(child.wait_with_output().unwrap());
        drop(stdin);
        assert!(since.elapsed() < Duration::from_secs(1), "{:?}", since.elapsed());
        assert_eq!(run.code, Some(143), "{}", run.stderr);
        assert!(!folder.names().iter().any(|name| name.ends_with(".part")), "{:?}", folder.names());
        run
    };
    let folder = long_scene();
    let piped = |arguments: &[&str]| {
        let mut command = folder.command(arguments);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    // A scene that nobody finishes writing.
    for arguments in [&["check", "-"][..], &["render", "-", "--out", "a.png"]] {
        let child = piped(arguments);
        std::thread::sleep(Duration::from_millis(300));
        ended(child, &folder);
    }
    // A program that takes no frames.
    let program = folder.path("bin/ffmpeg");
    folder.write("bin/ffmpeg", "#!/bin/sh\nexec sleep 3\n");
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    let path = std::env::join_paths(
        [folder.path("bin")].into_iter().chain(std::env::split_paths(&std::env::var_os("PATH").unwrap())),
    );
    let mut command = folder.command(&["render", "scene.toml", "--size", "640x480", "--out", "film/film.mp4"]);
    command.env("PATH", path.unwrap()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().unwrap();
    wait_until("the film to begin", || folder.names().iter().any(|name| name.ends_with(".part")));
    std::thread::sleep(Duration::from_millis(500));
    let run = ended(child, &folder);
    assert_eq!(run.errors(), 1, "{}", run.stderr);
}
