//! All phenomena with all options, with any number of threads: no deadlock, and the same bytes.

use std::{process::Stdio, time::Duration};

use crate::support::{FLAME, Folder};

/// How long a few small frames may take, whatever else the machine does.
const PATIENCE: Duration = Duration::from_secs(120);

/// The contents of each scene.
pub(super) const SCENES: [(&str, &str); 5] = [
    ("a flame sheet", "[[flame_sheet]]\n"),
    ("a particle flame", "[[flame_particles]]\nparticles = 6000\npreroll_s = 0.3\n"),
    ("rain", "[sky]\n[[rain]]\nrate_mm_per_h = 30.0\n"),
    (
        "two auroras",
        "[camera]\ntarget = [0.0, 60.0, -100.0]\n[[aurora]]\nparticles = { count = 2000 }\nfield = { cells = 31 }\n\
      [[aurora]]\nparticles = { count = 2000 }\nfield = { cells = 31 }\nrendering = { sampling = \"single_collisions\" }\n",
    ),
    (
        "fire in rain",
        "[[flame_particles]]\nparticles = 500\npreroll_s = 0.1\n[[flame_particles]]\nparticles = 500\npreroll_s = 0.1\n\
      [[flame_sheet]]\n[[rain]]\nrate_mm_per_h = 5.0\n",
    ),
];

fn scene(what: &str, plate: &str) -> String {
    format!("bansho = 2\n[picture]\nsize = [192, 256]\nframes = 4\n{plate}{what}")
}

/// Runs, and must be done in time.
fn finish(folder: &Folder, what: &str, arguments: &[&str]) {
    let mut program = folder.command(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let begun = std::time::Instant::now();
    let status = loop {
        if let Some(status) = program.try_wait().unwrap() {
            break status;
        }
        if begun.elapsed() > PATIENCE {
            program.kill().unwrap();
            program.wait().unwrap();
            panic!("{what}: {arguments:?} hangs");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    assert!(status.success(), "{what}: {arguments:?}: {}", folder.run(arguments).stderr);
}

#[test]
fn all_that_is_measured_of_a_phenomenon_is_the_same_by_any_number_of_threads() {
    for (what, stands) in SCENES {
        let folder = Folder::with_scene(&scene(stands, "[plate]\nimage = \"plate.png\"\n"));
        folder.write("alone.toml", &scene(stands, ""));
        folder.write("behind.toml", FLAME);
        folder.succeed(&["render", "behind.toml", "--frames", "3", "--out", "plate.png"]);
        for threads in ["1", "2", "16"] {
            let out = |file: &str| format!("{threads}/{file}");
            let all = ["render", "scene.toml", "--aovs", "--layers", "--threads", threads, "--out", &out("f.####.exr")];
            finish(&folder, what, &all);
            let book = ["flipbook", "alone.toml", "--grid", "2x2", "--size", "192x256", "--threads", threads, "--out"];
            finish(&folder, what, &[&book[..], &[&out("book.png")]].concat());
        }
        let one = folder.files("1");
        assert_eq!(one.len(), 8, "{what}: {:?}", one.keys());
        for threads in ["2", "16"] {
            let differ: Vec<_> =
                folder.files(threads).into_iter().filter(|(name, bytes)| one[name] != *bytes).collect();
            assert!(
                differ.is_empty(),
                "{what} by {threads} threads: {:?}",
                differ.iter().map(|(name, _)| name).collect::<Vec<_>>()
            );
        }
    }
}

#[test]
fn any_number_of_frames_in_flight_gives_the_same_files() {
    let folder = Folder::with_scene(&scene("[[flame_sheet]]\n[sky]\n[[rain]]\nrate_mm_per_h = 30.0\n[ground]\n", ""));
    for (count, threads) in [("1", "4"), ("3", "4"), ("40", "2"), ("auto", "5"), ("2", "1")] {
        let work = ["--frames", "0-6", "--frames-in-flight", count, "--threads", threads];
        for file in ["f.####.png", "f.####.exr", "film.apng"] {
            let out = format!("{count}/{file}");
            finish(&folder, count, &[&["render", "scene.toml", "--out", &out], &work[..]].concat());
        }
        let sheet = format!("{count}/sheet.png");
        finish(
            &folder,
            count,
            &[&["render", "scene.toml", "--contact-sheet", "7", "--out", &sheet], &work[..]].concat(),
        );
    }
    let one = folder.files("1");
    assert_eq!(one.len(), 16, "{:?}", one.keys());
    for count in ["3", "40", "auto", "2"] {
        assert!(folder.files(count) == one, "{count} frames in flight give other files");
    }
}
