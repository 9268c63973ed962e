//! Pictures that need more memory than there is.

use std::process::Command;

use crate::support::{FLAME, Folder, Run};

/// Runs the program with a limit of its memory, kB.
fn run_within(folder: &Folder, kilobytes: usize, arguments: &str) -> Run {
    let program = env!("CARGO_BIN_EXE_bansho");
    let limited = format!("ulimit -v {kilobytes}; exec {program} {arguments} --threads 1");
    Run::of(Command::new("sh").args(["-c", &limited]).current_dir(folder.path("")).output().unwrap())
}

fn check_within(folder: &Folder, kilobytes: usize, scene: &str) -> Run {
    let limited = format!("ulimit -v {kilobytes}; exec {} check {scene}", env!("CARGO_BIN_EXE_bansho"));
    Run::of(Command::new("sh").args(["-c", &limited]).current_dir(folder.path("")).output().unwrap())
}

#[test]
fn pictures_larger_than_memory_are_refused_with_the_size_that_would_fit() {
    let folder = Folder::with_scene(FLAME);
    let run = run_within(
        &folder,
        2_000_000,
        "render scene.toml --set camera.glare=0 --size 16384x16384 --frames 0 --out big.png",
    );
    assert_eq!((run.code, run.errors()), (Some(2), 1), "{}", run.stderr);
    assert!(run.stderr.contains("--size: 16384 x 16384 pixels would take "), "{}", run.stderr);
    let most: f64 = run.stderr.split("allowed: up to ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((8000.0..15_000.0).contains(&most), "{}", run.stderr);
    let part = "render scene.toml --set camera.glare=0 --size 16384x16384 --crop 0,0,64,64 --frames 0 --out part.png";
    assert_eq!(run_within(&folder, 2_000_000, part).code, Some(0), "a part of it fits");
}

#[test]
fn a_scene_larger_than_memory_is_told_at_its_line_by_check_and_render() {
    let large = Folder::with_scene(&FLAME.replace("48, 64", "16384, 16000"));
    let wide = Folder::with_scene(&FLAME.replace("seed = 7", "overscan = 4096"));
    for (folder, memory, expected, out) in [
        (large, 2_000_000, "scene.toml:4:8: picture.size: 16384 x 16000 pixels would take ", "big.png"),
        (
            wide,
            1_000_000,
            "scene.toml:6:12: picture.overscan: 8240 x 8256 pixels with this overscan would take ",
            "big.exr",
        ),
    ] {
        for run in [
            run_within(&folder, memory, &format!("render scene.toml --frames 0 --out {out}")),
            check_within(&folder, memory, "scene.toml"),
        ] {
            assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
            assert!(run.stderr.contains(expected) && run.stderr.contains("allowed: up to "), "{}", run.stderr);
        }
        assert_eq!(folder.names(), ["scene.toml"]);
    }
}

#[test]
fn channels_that_there_is_no_memory_for_are_counted() {
    let folder = Folder::with_scene(FLAME);
    let run =
        run_within(&folder, 2_500_000, "render scene.toml --size 6000x6000 --aovs --layers --frames 0 --out a.exr");
    assert_eq!((run.code, run.errors()), (Some(2), 1), "{}", run.stderr);
    assert!(run.stderr.contains("6000 x 6000 pixels with "), "{}", run.stderr);
    assert!(run.stderr.contains(" more channels would take "), "{}", run.stderr);
}

#[test]
fn the_estimated_memory_is_within_a_quarter_of_the_peak() {
    let scene = |name: &str| format!("{}/../../scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    // Rain and ground, one frame after the other and four at once; flames in the dark that cover a part of the picture; and haze that refracts a plate.
    for (name, frames, in_flight) in
        [("headlights", 4, "1"), ("headlights", 16, "4"), ("torch", 4, "1"), ("inagaki_haze", 3, "1")]
    {
        let folder = Folder::new();
        let (path, frames) = (scene(name), format!("20-{}", 19 + frames));
        let work = ["--threads", "4", "--frames-in-flight", in_flight, "--stats", "--progress", "json"];
        let render = ["render", &path, "--size", "1280x720", "--frames", &frames, "--out", "f.####.png"];
        let run = folder.succeed(&[&render[..], &work[..]].concat());
        let mut events = run.stdout.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
        let stats = events.find(|event| event["event"] == "stats").unwrap();
        let mebibytes = |key: &str| stats[key].as_f64().unwrap();
        let ratio = mebibytes("estimated_memory_mib") / mebibytes("peak_memory_mib");
        assert!((0.75..1.25).contains(&ratio), "{name}, {in_flight} in flight: {ratio}: {stats}");
        assert_eq!(stats["frames_in_flight"], serde_json::json!(in_flight.parse::<usize>().unwrap()), "{stats}");
    }
}

#[test]
fn more_frames_in_flight_than_there_is_memory_for_are_refused_with_the_number_that_fits() {
    let folder = Folder::with_scene(FLAME);
    let render = |count: &str| {
        let line =
            format!("render scene.toml --size 4000x4000 --frames 0-99 --frames-in-flight {count} --out f.####.exr");
        run_within(&folder, 2_000_000, &line)
    };
    let run = render("90");
    assert_eq!((run.code, run.errors()), (Some(2), 1), "{}", run.stderr);
    assert!(run.stderr.contains("--frames-in-flight: 90 frames in flight would take "), "{}", run.stderr);
    let most: usize = run.stderr.split("auto, or 1 to ").nth(1).unwrap().trim().parse().unwrap();
    assert!((1..10).contains(&most), "{}", run.stderr);
    for count in ["0", "-1", "many"] {
        let run = render(count);
        assert_eq!((run.code, run.errors()), (Some(2), 1), "{}", run.stderr);
        assert!(run.stderr.contains("auto, or a number of frames of at least 1"), "{}", run.stderr);
    }
    assert_eq!(folder.names(), ["scene.toml"]);
}
