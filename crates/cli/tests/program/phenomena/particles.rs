//! What is simulated in steps: particles as files, and frames from snapshots.

use crate::support::Folder;

/// A small particle flame that is soon developed.
const GAS: &str = "\
bansho = 2
[picture]
size = [48, 64]
frames = 8
[camera]
position = [0.0, 0.4, 2.6]
target = [0.0, 0.4, 0.0]
[[flame_particles]]
particles = 250
preroll_s = 0.25
";

/// Properties and rows of a binary PLY.
fn read_ply(bytes: &[u8]) -> (Vec<String>, Vec<Vec<f32>>) {
    let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    assert!(header.starts_with("ply\nformat binary_little_endian 1.0\n"), "{header}");
    let names: Vec<String> =
        header.lines().filter_map(|l| l.strip_prefix("property float ")).map(str::to_owned).collect();
    let count: usize = header.lines().find_map(|l| l.strip_prefix("element vertex ")).unwrap().parse().unwrap();
    let values: Vec<f32> = bytes[end..].as_chunks().0.iter().map(|four| f32::from_le_bytes(*four)).collect();
    assert_eq!(values.len(), names.len() * count);
    (names.clone(), values.chunks(names.len()).map(<[f32]>::to_vec).collect())
}

#[test]
fn particles_are_written_a_file_a_frame() {
    let folder = Folder::with_scene(GAS);
    folder.succeed(&["simulate", "scene.toml", "--particles", "gas/p.####.ply", "--frames", "2,5"]);
    let files = folder.files("gas");
    assert_eq!(files.keys().collect::<Vec<_>>(), ["p.0002.ply", "p.0005.ply"]);
    let (names, rows) = read_ply(&files["p.0005.ply"]);
    assert_eq!(names, ["x", "y", "z", "vx", "vy", "vz", "temperature", "density"]);
    assert!(rows.len() > 50, "{} particles", rows.len());
    for row in &rows {
        assert!(row.iter().all(|value| value.is_finite()), "{row:?}");
        assert!((-0.5..4.0).contains(&row[1]) && (250.0..2500.0).contains(&row[6]) && row[7] > 0.0, "{row:?}");
    }
    let rising = rows.iter().filter(|row| row[4] > 0.0).count();
    assert!(rising * 10 > rows.len() * 9, "hot gas rises");
    // One frame alone is the same as in its turn, and may have a plain name.
    folder.succeed(&["simulate", "scene.toml", "--particles", "one.ply", "--frames", "5"]);
    assert_eq!(folder.files("")["one.ply"], files["p.0005.ply"]);
}

#[test]
fn an_auroras_electrons_lie_on_the_shell_at_100_km() {
    let folder = Folder::with_scene(
        "bansho = 2\n[[aurora]]\npreroll_s = 0.2\nflux_mw_per_m2 = 20\nenergy_ev = 3000\nswirls = { displacement_km = 0 }\nparticles = { count = 2000 }\n",
    );
    folder.succeed(&["simulate", "scene.toml", "--particles", "aurora.ply", "--frames", "3"]);
    let (names, rows) = read_ply(&folder.files("")["aurora.ply"]);
    assert_eq!(names, ["x", "y", "z", "vx", "vy", "vz", "energy", "power"]);
    assert!((1800..2400).contains(&rows.len()), "{} particles", rows.len());
    let mut power = 0.0;
    for row in &rows {
        let [x, y, z] = [row[0], row[1] + 6.371e6, row[2]].map(f64::from);
        assert!(((x * x + y * y + z * z).sqrt() - 6.471e6).abs() < 2.0, "{row:?}");
        assert!(row[..2].iter().chain([&row[2]]).all(|place| place.abs() < 3.1e5), "{row:?}");
        assert!((1000.0..9000.0).contains(&row[6]) && row[7] >= 0.0, "{row:?}");
        power += f64::from(row[7]);
    }
    // Two sheets, 1050 km together and as thick as two cells of 600 / 255 km, at 0.02 W/m^2: 99 MW, of
    // which ends that fade leave 69.
    assert!((5.7e7..8.5e7).contains(&power), "{power} W");
}

#[test]
fn the_drops_of_rain_are_those_in_the_picture() {
    let folder = Folder::with_scene(
        "bansho = 2\n[picture]\nsize = [160, 90]\nframes = 2\n[[rain]]\nmethod = \"drops\"\nsplashes = { fraction = 0.0 }\n",
    );
    folder.succeed(&["simulate", "scene.toml", "--particles", "drops.ply", "--frames", "1"]);
    let (names, rows) = read_ply(&folder.files("")["drops.ply"]);
    assert_eq!(names, ["x", "y", "z", "vx", "vy", "vz", "diameter_mm", "opacity"]);
    for row in &rows {
        assert!((-10.0..-3.0).contains(&row[4]) && (0.9..2.1).contains(&row[6]), "{row:?}");
        assert!(row[7] > 0.0 && row[7] < 0.05, "{row:?}");
    }
    folder.succeed(&["render", "scene.toml", "--frames", "1", "--metadata", "--out", "f.png"]);
    let about: serde_json::Value = serde_json::from_slice(&folder.files("")["f.json"]).unwrap();
    assert!(rows.len() > 100);
    assert_eq!(about["phenomena"]["rain"]["drops_in_view"]["value"].as_f64(), Some(rows.len() as f64), "{about}");
}

#[test]
fn what_has_no_particles_or_no_such_name_is_refused_before_anything_is_written() {
    let folder = Folder::with_scene(GAS);
    let name = folder.run(&["simulate", "scene.toml", "--particles", "gas.obj"]);
    assert_eq!((name.code, name.errors()), (Some(2), 1));
    assert!(name.stderr.contains("`.obj` is not supported here; allowed: .ply"), "{}", name.stderr);
    folder.write("sheet.toml", "bansho = 2\n[[flame_sheet]]\n");
    let sheet = folder.run(&["simulate", "sheet.toml", "--particles", "gas.ply"]);
    assert_eq!((sheet.code, sheet.errors()), (Some(2), 1));
    assert!(sheet.stderr.contains("this scene has no particles to export"), "{}", sheet.stderr);
    folder.write("faulty.toml", "bansho = 2\n[[flame_particles]]\nparticles = -3\n");
    assert_eq!(folder.run(&["simulate", "faulty.toml", "--particles", "gas.ply"]).code, Some(3));
    assert_eq!(folder.names(), ["faulty.toml", "scene.toml", "sheet.toml"]);
}

#[test]
fn a_simulated_loop_is_one_period_and_refuses_fuel_that_jumps() {
    let folder = Folder::with_scene(GAS);
    folder.succeed(&["render", "scene.toml", "--loop", "0.2", "-o", "turn/f.####.png"]);
    assert_eq!(folder.files("turn").len(), 6);
    folder
        .write("jumps.toml", &format!("{GAS}[[flame_particles.burners]]\nflow = {{ keys = [[0, 1], [0.1, 0.5]] }}\n"));
    let jumps = folder.run(&["render", "jumps.toml", "--loop", "0.2"]);
    assert_eq!((jumps.code != Some(0), jumps.errors()), (true, 1));
    assert!(
        jumps.stderr.contains("burners.0.flow") && jumps.stderr.contains("0.2 s is not seamless"),
        "{}",
        jumps.stderr
    );
}

#[test]
fn frames_from_snapshots_or_alone_are_those_of_the_whole_run() {
    let folder = Folder::with_scene(GAS);
    let snapshots = ["--snapshots", "states", "--snapshot-every", "3"];
    folder.succeed(&[&["render", "scene.toml", "-o", "whole/f.####.png"], &snapshots[..]].concat());
    assert_eq!(folder.files("states").len(), 3);
    let whole = folder.files("whole");
    folder.succeed(&["render", "scene.toml", "-o", "alone/f.####.png", "--frames", "5-7", "--threads", "1"]);
    folder.succeed(&[&["render", "scene.toml", "-o", "part/f.####.png", "--frames", "5-7"], &snapshots[..]].concat());
    for (name, bytes) in folder.files("alone").into_iter().chain(folder.files("part")) {
        assert!(whole[&name] == bytes, "{name} differs");
    }
}

#[test]
fn a_snapshot_that_is_damaged_or_of_another_scene_is_refused_and_made_anew() {
    let folder = Folder::with_scene(GAS);
    let render = ["render", "scene.toml", "-o", "f.####.png", "--snapshots", "states", "--snapshot-every", "4"];
    folder.succeed(&render);
    let (state, frame) = (folder.files("states")["state.4.bansho"].clone(), folder.files("")["f.0006.png"].clone());
    let mut damaged = state.clone();
    damaged[200] ^= 1;
    folder.write("other.toml", &GAS.replace("particles = 250", "particles = 200"));
    folder.succeed(&["render", "other.toml", "-o", "o.png", "--frames", "4", "--snapshots", "others"]);
    let foreign = folder.files("others")["state.0.bansho"].clone();
    let cases = [
        (damaged, "the snapshot is damaged"),
        (Vec::new(), "the snapshot is damaged"),
        (foreign, "the snapshot belongs to another scene"),
    ];
    // Frame 4 itself is not drawn: its snapshot is replaced on the way to a later frame.
    let later = [&render[..], &["--frames", "5-6"]].concat();
    for (bytes, reason) in cases {
        std::fs::write(folder.path("states/state.4.bansho"), bytes).unwrap();
        let again = folder.succeed(&later);
        assert!(again.stderr.contains(&format!("state.4.bansho: not used: {reason}")), "{}", again.stderr);
        assert!(folder.files("states")["state.4.bansho"] == state && folder.files("")["f.0006.png"] == frame);
    }
    assert!(!folder.succeed(&later).stderr.contains("not used"));
}

#[cfg(target_os = "linux")]
#[test]
fn more_particles_than_there_is_memory_for_are_refused_with_the_number_that_would_fit() {
    use std::process::Command;

    use crate::support::Run;
    let folder = Folder::with_scene(&GAS.replace("particles = 250", "particles = 4000000"));
    assert_eq!(folder.run(&["check", "scene.toml"]).code, Some(0), "3 GiB, which are not filled");
    let program = env!("CARGO_BIN_EXE_bansho");
    let limited = format!("ulimit -v 2000000; exec {program} render scene.toml --frames 0");
    let run = Command::new("sh").args(["-c", &limited]).current_dir(folder.path("")).output().unwrap();
    let run = Run::of(run);
    assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
    assert!(
        run.stderr.contains(
            "scene.toml:9:13: flame_particles.0.particles: 4000000 particles would take 2 GiB; allowed: up to "
        )
    );
    let most: i64 = run.stderr.split("up to ").nth(1).unwrap().split_whitespace().next().unwrap().parse().unwrap();
    assert!((400_000..3_000_000).contains(&most), "{most} of 2 GB");
}

#[test]
fn a_flame_that_cannot_be_seen_is_told() {
    let burner = "[[flame_particles.burners]]\n";
    let ball = "[[obstacle]]\nshape = \"sphere\"\nradius = 0.5\n";
    for (more, expected) in [
        (format!("{burner}flow = 0.0\n"), "flame_particles: none of its burners emits gas"),
        (format!("{burner}{ball}"), "flame_particles: its burner 1 is inside an obstacle"),
    ] {
        let folder = Folder::with_scene(&format!("{GAS}{more}"));
        let run = folder.succeed(&["render", "scene.toml", "--frames", "0"]);
        assert!(run.stderr.contains(expected), "{}", run.stderr);
    }
    let folder = Folder::with_scene(&format!("{GAS}{burner}"));
    let run = folder.succeed(&["render", "scene.toml", "--frames", "0"]);
    assert!(!run.stderr.contains("warning"), "{}", run.stderr);
}
