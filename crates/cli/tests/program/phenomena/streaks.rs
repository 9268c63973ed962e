//! Streak textures: the pictures have the values that their index states.

use std::{f64::consts::PI, fs};

use serde_json::Value;

use crate::support::{Folder, Run, decode_png, read_exr};

fn index(folder: &Folder, path: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.path(path)).unwrap()).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn entries<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().unwrap()
}

/// Opacities of a gray PNG by the scale of its entry.
fn opacities(folder: &Folder, entry: &Value) -> Vec<f64> {
    let png = decode_png(&fs::read(folder.path(&format!("out/streaks/{}", entry["file"].as_str().unwrap()))).unwrap());
    assert_eq!((png.width, png.height, png.channels, png.bits), (512, 512, 1, 16));
    let scale = number(&entry["opacity_scale"]) / 65_535.0;
    png.bytes.chunks_exact(2).map(|code| f64::from(u16::from_be_bytes([code[0], code[1]])) * scale).collect()
}

#[test]
fn without_options_it_writes_the_papers_24_textures_and_they_measure_right() {
    let folder = Folder::new();
    let run = folder.succeed(&["streaks"]);
    assert!(
        run.stderr.starts_with("24 textures in ") && run.stderr.ends_with("out/streaks/streaks.json\n"),
        "{}",
        run.stderr
    );
    assert_eq!(folder.names().len(), 25);
    let about = index(&folder, "out/streaks/streaks.json");
    assert_eq!(entries(&about, "textures").len(), 24);
    for entry in entries(&about, "textures") {
        let drops = entries(entry, "drops");
        let (count, diameter) = (drops.len() as f64, number(&entry["diameter_mm"]));
        assert!((count - number(&entry["mean_drop_count"])).abs() < 1.0);
        let hidden: f64 = opacities(&folder, entry).iter().sum::<f64>() / (512.0 * 512.0);
        let discs = 0.25e-6 * PI * diameter * diameter * count;
        assert!((hidden - discs).abs() <= 0.005 * discs, "{}: {hidden} {discs}", entry["file"]);
    }
    let heavy = &entries(&about, "textures")[23];
    assert_eq!((&heavy["file"], &heavy["rate_mm_per_h"]), (&"streak_20_2.png".into(), &20.0.into()));
    let drop = &entries(heavy, "drops")[0];
    assert_eq!((number(&drop["diameter_mm"]), number(&drop["velocity_m_per_s"])), (2.0, 6.49));
    assert!((number(&drop["opacity"]) - 2e-3 / (6.49 / 30.0)).abs() < 1e-9);
    // The rain of 20 mm/h: 1.2037e-3 per meter hidden, seen through for 1.6 km.
    let rain = &entries(&about, "rain")[3];
    assert!((number(&rain["extinction_per_m"]) - 1.20367e-3).abs() < 1e-8);
    assert!((number(&rain["visibility_m"]) - 1625.0).abs() < 1.0);
}

#[test]
fn a_streak_lies_where_the_index_puts_its_drop() {
    let folder = Folder::new();
    folder.succeed(&["streaks", "--rates", "1", "--diameters", "2", "--seed", "5", "--exposure-time", "1/60"]);
    let about = index(&folder, "out/streaks/streaks.json");
    let entry = &entries(&about, "textures")[0];
    let opacities = opacities(&folder, entry);
    for drop in entries(entry, "drops") {
        let [x, y] = [0, 1].map(|axis| number(&drop["position_m"][axis]));
        for share in [0.1, 0.5, 0.9] {
            let fallen = (y - share * number(&drop["length_m"])).rem_euclid(1.0);
            let (column, row) = ((x * 512.0) as usize, ((1.0 - fallen) * 512.0) as usize % 512);
            assert!(opacities[row * 512 + column] > 0.1 * number(&drop["opacity"]), "{drop}");
        }
    }
}

#[test]
fn light_makes_radiance_in_proportion_to_opacity() {
    let folder = Folder::new();
    let common = ["streaks", "--rates", "20", "--diameters", "1", "--size", "64", "--light-direction", "0,0.2,-1"];
    folder.succeed(&[&common[..], &["--format", "exr", "-o", "exr"]].concat());
    folder.succeed(&[&common[..], &["--bits", "8", "-o", "png"]].concat());
    let about = index(&folder, "exr/streaks.json");
    let radiance = &about["light"]["radiance_of_an_opaque_drop_per_illuminance_per_sr"];
    // Light from behind is scattered forward: brighter than by a white diffuser.
    assert!(number(&radiance[1]) > 1.0 / PI, "{radiance}");
    let exr = read_exr(&folder.path("exr/streak_20_1.exr"));
    let opacity = &exr.channels["opacity.V"];
    for (c, name) in ["R", "G", "B"].iter().enumerate() {
        for (value, opacity) in exr.channels[*name].iter().zip(opacity) {
            let expected = number(&radiance[c]) * f64::from(*opacity);
            assert!((f64::from(*value) - expected).abs() <= 1e-3 * expected + 1e-7, "{name}: {value} {expected}");
        }
    }
    let entry = &entries(&index(&folder, "png/streaks.json"), "textures")[0].clone();
    let lit = decode_png(&folder.files("png")["streak_20_1_lit.png"]);
    assert_eq!((lit.width, lit.channels, lit.bits), (64, 3, 8));
    let scale = number(&entry["lit"]["radiance_scale"]) / 255.0;
    for (pixel, opacity) in lit.bytes.chunks_exact(3).zip(opacity) {
        let expected = number(&radiance[1]) * f64::from(*opacity);
        assert!((f64::from(pixel[1]) * scale - expected).abs() <= 0.51 * scale, "{pixel:?} {expected}");
    }
}

#[test]
fn the_papers_textures_are_lines_of_two_diameters_over_the_velocity() {
    let folder = Folder::new();
    folder.succeed(&["streaks", "--opacity", "paper", "--bits", "8", "--terminal-velocity", "rigid_sphere"]);
    let about = index(&folder, "out/streaks/streaks.json");
    assert_eq!((entries(&about, "textures").len(), about["opacity_law"].as_str()), (24, Some("paper")));
    for bin in entries(&about, "bins") {
        let expected = 2.0 * number(&bin["diameter_mm"]) / number(&bin["velocity_m_per_s"]);
        assert!((number(&bin["opacity"]) - expected).abs() < 1e-12 && number(&bin["opacity"]) > 0.49, "{bin}");
    }
    // A line has that opacity over its length and one pixel; few of the drops of 2 mm cross.
    let entry = entries(&about, "textures").iter().find(|entry| entry["file"] == "streak_20_2.png").unwrap();
    let png = decode_png(&folder.files("out/streaks")["streak_20_2.png"]);
    let drops = entries(entry, "drops");
    let (opacity, length) = (number(&drops[0]["opacity"]), number(&drops[0]["length_m"]));
    let scale = number(&entry["opacity_scale"]) / 255.0;
    let sum: f64 = png.bytes.iter().map(|code| f64::from(*code) * scale).sum();
    let expected = drops.len() as f64 * opacity * length * 512.0;
    // Up to 3 % less, where streaks cross.
    assert!(sum / expected < 1.005, "{sum} {expected}");
    bansho::base::assert_measured!("figure 3: difference of the sum of opacities", sum / expected - 1.0, 0.0, 0.03);
}

#[test]
fn oscillating_drops_speckle_their_light_and_keep_opacity_and_mean() {
    let folder = Folder::new();
    let common = ["streaks", "--rates", "20", "--diameters", "2", "--light-direction", "0,0.2,-1", "--format", "exr"];
    folder.succeed(&[&common[..], &["-o", "steady"]].concat());
    folder.succeed(&[&common[..], &["--oscillation", "0.6", "-o", "speckled"]].concat());
    let [steady, speckled] =
        ["steady", "speckled"].map(|name| read_exr(&folder.path(&format!("{name}/streak_20_2.exr"))));
    assert_eq!(steady.channels["opacity.V"], speckled.channels["opacity.V"]);
    let sum = |values: &[f32]| values.iter().map(|value| f64::from(*value)).sum::<f64>();
    let [before, after] = [&steady, &speckled].map(|picture| &picture.channels["G"]);
    assert!((sum(after) / sum(before) - 1.0).abs() < 0.05, "{} {}", sum(before), sum(after));
    let change = before.iter().zip(after).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / sum(before);
    assert!((0.15..0.6).contains(&change), "{change}");
    let about = index(&folder, "speckled/streaks.json");
    assert!((number(&entries(&about, "bins")[0]["oscillation_hz"][0]) - 121.57).abs() < 0.05);
}

#[test]
fn variants_and_spread_drops_differ_and_any_threads_give_the_same_bytes() {
    let folder = Folder::new();
    let options = [
        "streaks",
        "--rates",
        "0,5",
        "--diameters",
        "1,3",
        "--variants",
        "2",
        "--vary-diameter",
        "--terminal-velocity",
        "rigid_sphere",
    ];
    folder.succeed(&[&options[..], &["--size", "96", "--threads", "1", "-o", "one"]].concat());
    folder.succeed(&[&options[..], &["--size", "96", "--threads", "3", "-o", "many"]].concat());
    let files = folder.files("one");
    assert!(files == folder.files("many"));
    assert_eq!(files.len(), 9);
    assert!(files["streak_5_1_0.png"] != files["streak_5_1_1.png"]);
    let about = index(&folder, "one/streaks.json");
    assert_eq!(entries(&about, "rain")[0]["visibility_m"], Value::Null);
    let empty = decode_png(&files["streak_0_3_1.png"]);
    assert!(empty.bytes.iter().all(|&byte| byte == 0), "no rain, no streak");
    let diameters: Vec<f64> = entries(&about, "textures")
        .iter()
        .filter(|entry| number(&entry["diameter_mm"]) == 1.0)
        .flat_map(|entry| entries(entry, "drops").iter().map(|drop| number(&drop["diameter_mm"])))
        .collect();
    assert!(diameters.iter().all(|diameter| (0.0..2.0).contains(diameter)));
    assert!(diameters.iter().any(|&diameter| diameter < 0.9) && diameters.iter().any(|&diameter| diameter > 1.1));
}

#[test]
fn nonsense_is_refused_and_nothing_is_written() {
    let folder = Folder::new();
    for (arguments, part) in [
        (&["--rates", "-5"][..], "--rates: rain rates: value 1 is -5; allowed: 0 to 500 mm/h"),
        (&["--rates", "1,5,3"], "--rates: rain rates: value 3 is 3 after 5; the list must ascend"),
        (&["--diameters", "1,1"], "--diameters: drop diameters: value 2 is 1 after 1; the list must ascend"),
        (&["--diameters", "-1"], "--diameters: drop diameters: value 1 is -1; allowed: 0.05 to 8 mm"),
        (&["--diameters", "1,,2"], "numbers separated by commas"),
        (&["--exposure-time", "0"], "--exposure-time: an exposure of 0 s; allowed: 0.000001 to 10 s"),
        (&["--exposure-time", "-1/30"], "allowed: 0.000001 to 10 s"),
        (&["--exposure-time", "1/0"], "a number of seconds, such as 0.02 or 1/30"),
        (&["--size", "0"], "--size: textures of 0 pixels a side; allowed: 8 to 4096"),
        (&["--cube-size", "-1"], "--cube-size: a cube of -1 m; allowed: 0.001 to 100 m"),
        (&["--cube-size", "100"], "choose a smaller cube"),
        (&["--variants", "0"], "--variants: 0 variants; allowed: 1 to 1000"),
        (&["--light-direction", "0,0,0"], "--light-direction: the light direction is the zero vector"),
        (&["--light-direction", "up"], "three numbers"),
        (&["--opacity", "papers"], "exposure_fraction, paper"),
        (
            &["--oscillation", "1.5", "--light-direction", "0,0,1"],
            "--oscillation: an oscillation of 1.5; allowed: 0 to 1",
        ),
        (
            &["--oscillation", "nan", "--light-direction", "0,0,1"],
            "--oscillation: an oscillation of NaN; allowed: 0 to 1",
        ),
        (&["--oscillation", "0.5"], "--oscillation: oscillation changes only lit textures"),
        (
            &["--oscillation", "0.5", "--opacity", "paper", "--light-direction", "0,0,1"],
            "--oscillation: the paper's streaks are lines of even brightness",
        ),
        (&["--terminal-velocity", "guessed"], "gunn_kinzer, rigid_sphere"),
        (&["--terminal-velocity", "rigid_sphere", "--diameters", "0.08,1"], "no solution for a drop of 0.08 mm"),
        (&["--format", "jpg"], "png, exr"),
    ] {
        let run = folder.run(&[&["streaks"], arguments].concat());
        assert_eq!((run.code, run.errors()), (Some(2), 1), "{arguments:?}: {}", run.stderr);
        assert!(run.stderr.contains(part), "{arguments:?}: {}", run.stderr);
        assert!(folder.names().is_empty());
    }
}

#[test]
fn a_place_that_cannot_be_written_is_an_error() {
    let folder = Folder::with_scene("");
    let run = folder.run(&["streaks", "--out", "scene.toml/streaks"]);
    assert_eq!((run.code, run.errors()), (Some(1), 1), "{}", run.stderr);
    assert!(run.stderr.contains("a part of this path is a file, not a folder"), "{}", run.stderr);
    fs::create_dir_all(folder.path("there/streaks.json")).unwrap();
    let run = folder.run(&["streaks", "--out", "there"]);
    assert_eq!((run.code, run.errors()), (Some(1), 1), "{}", run.stderr);
    assert!(run.stderr.contains("streaks.json: is a folder"), "{}", run.stderr);
    assert_eq!(folder.names(), ["scene.toml"]);
}

#[cfg(unix)]
#[test]
fn a_run_that_is_stopped_leaves_whole_textures_and_no_index_that_lies() {
    use std::process::{Command, Stdio};

    use crate::support::wait_until;
    let folder = Folder::new();
    folder.succeed(&["streaks", "--rates", "1", "--diameters", "1", "--size", "32"]);
    assert!(folder.path("out/streaks/streaks.json").exists());
    let mut command = folder.command(&["streaks", "--variants", "1000", "--size", "512"]);
    let child = command.stderr(Stdio::piped()).spawn().unwrap();
    let textures = || folder.names().iter().filter(|name| name.ends_with(".png")).count();
    wait_until("some textures", || textures() > 8);
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let run = Run::of(child.wait_with_output().unwrap());
    assert_eq!((run.code, run.errors()), (Some(130), 1));
    assert!(run.stderr.contains("stopped; finished textures are kept, without an index"), "{}", run.stderr);
    let names = folder.names();
    assert!(names.iter().all(|name| name.ends_with(".png")), "neither index nor half-written files: {names:?}");
    for name in names {
        decode_png(&fs::read(folder.path(&name)).unwrap());
    }
}

#[test]
fn progress_can_be_read_by_programs() {
    let folder = Folder::new();
    let run: Run = folder.succeed(&["streaks", "--rates", "5", "--size", "16", "--progress", "json"]);
    let events: Vec<Value> = run.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(events.len(), 8);
    assert_eq!((&events[0]["frames"], &events[7]["event"]), (&6.into(), &"done".into()));
    assert!(events[1]["file"].as_str().unwrap().starts_with("out/streaks/streak_5_"));
}
