//! Everything but rendering.

use serde_json::Value;

use crate::support::{FLAME, Folder};

#[test]
fn a_new_scene_passes_the_check_and_is_never_overwritten() {
    let folder = Folder::new();
    folder.succeed(&["new", "fire"]);
    assert_eq!(folder.names(), ["fire.toml"]);
    let check = folder.succeed(&["check", "fire.toml"]);
    assert!(check.stdout.starts_with("fire.toml: valid. 1280 x 720"), "{}", check.stdout);
    folder.write("fire.toml", "mine");
    let again = folder.run(&["new", "fire"]);
    assert_eq!((again.code, again.errors()), (Some(1), 1));
    assert!(again.stderr.contains("fire.toml: already exists"), "{}", again.stderr);
    assert_eq!(folder.files("")["fire.toml"], b"mine");
}

#[test]
fn a_new_scene_shows_any_phenomenon() {
    let folder = Folder::new();
    for kind in ["flame_sheet", "flame_particles", "rain", "aurora"] {
        let file = format!("{kind}.toml");
        folder.succeed(&["new", kind, "--kind", kind]);
        let text = String::from_utf8(folder.files("")[&file].clone()).unwrap();
        assert!(text.contains(&format!("\n[[{kind}]]\n")), "{text}");
        assert!((15..=42).contains(&text.lines().count()) && text.contains("--all"), "{text}");
        let short = folder.succeed(&["check", &file]);
        std::fs::remove_file(folder.path(&file)).unwrap();
        folder.succeed(&["new", kind, "--kind", kind, "--all"]);
        assert!(folder.files("")[&file].len() > 4 * text.len());
        assert_eq!(folder.succeed(&["check", &file]).stdout, short.stdout);
    }
    for other in [&["--from", "drizzle"][..], &["--list"]] {
        assert_eq!(folder.run(&[&["new", "storm", "--all"], other].concat()).code, Some(2), "{other:?}");
    }
    let unknown = folder.run(&["new", "storm", "--kind", "rian"]);
    assert_eq!((unknown.code, unknown.errors()), (Some(2), 1));
    assert!(unknown.stderr.contains("no phenomenon `rian`, did you mean `rain`?"), "{}", unknown.stderr);
    let both = folder.run(&["new", "storm", "--kind", "rain", "--from", "drizzle"]);
    assert_eq!((both.code, both.errors()), (Some(2), 1));
    assert!(!folder.path("storm.toml").exists());
}

#[test]
fn every_example_can_be_copied_and_passes_the_check() {
    let folder = Folder::new();
    let list = folder.succeed(&["new", "--list"]).stdout;
    assert!(list.lines().all(|line| line.ends_with('.')), "{list}");
    for example in list.lines().filter_map(|line| line.split_whitespace().next()) {
        let file = format!("{example} copy.toml");
        folder.succeed(&["new", &file, "--from", example]);
        folder.succeed(&["check", &file]);
    }
}

#[test]
fn an_example_whose_plate_is_not_found_writes_nothing() {
    let folder = Folder::new();
    let mut command = folder.command(&["new", "fire", "--from", "hearth"]);
    let output = command.env("BANSHO_SCENES", folder.path("gone")).output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.starts_with("error: plates/hearth.jpg: this plate is not in the program, and not in "), "{error}");
    assert!(error.contains("/gone`") && error.contains("BANSHO_SCENES") && error.lines().count() == 1, "{error}");
    assert!(folder.names().is_empty());
}

#[test]
fn an_unknown_example_is_an_error_and_writes_nothing() {
    let folder = Folder::new();
    let run = folder.run(&["new", "fire", "--from", "volcano"]);
    assert_eq!((run.code, run.errors()), (Some(2), 1));
    assert!(run.stderr.contains("no example `volcano`"), "{}", run.stderr);
    assert!(folder.names().is_empty());
}

#[test]
fn check_tells_of_every_scene() {
    let folder = Folder::with_scene(FLAME);
    folder.write("bad.toml", "bansho = 2\n[picture]\nsize = [0, 0]\n");
    let run = folder.run(&["check", "bad.toml", "scene.toml", "gone.toml"]);
    assert_eq!((run.code, run.errors()), (Some(3), 2), "{}", run.stderr);
    assert!(run.stdout.contains("scene.toml: valid. 48 x 64, frames 0 to 5 at 30 fps"), "{}", run.stdout);
    assert!(run.stdout.contains("left log"));
}

#[test]
fn the_schema_knows_the_keys_of_scenes() {
    let schema = Folder::new().succeed(&["schema"]).stdout;
    let schema: serde_json::Value = serde_json::from_str(&schema).unwrap();
    assert!(schema["properties"]["picture"]["properties"]["exposure_ev100"].is_object());
    assert_eq!(schema["properties"]["flame_sheet"]["type"], "array");
}

#[test]
fn completions_and_manual_pages_know_the_options() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        assert!(folder.succeed(&["completions", shell]).stdout.contains("contact-sheet"), "{shell}");
    }
    assert!(folder.succeed(&["man"]).stdout.contains("bansho"));
    folder.succeed(&["man", "pages"]);
    let pages = folder.files("pages");
    assert!(pages.contains_key("bansho.1") && pages.contains_key("bansho-render.1"), "{:?}", pages.keys());
    assert!(String::from_utf8_lossy(&pages["bansho-render.1"]).contains("snapshots"));
}

#[test]
fn help_and_version_are_no_errors() {
    let folder = Folder::new();
    assert!(folder.succeed(&["--version"]).stdout.starts_with("bansho "));
    assert!(folder.succeed(&["render", "--help"]).stdout.contains("--resume"));
    assert_eq!(folder.run(&[]).code, Some(2));
}

#[test]
fn json_progress_is_one_object_a_line() {
    let folder = Folder::with_scene(FLAME);
    let run = folder.succeed(&["render", "scene.toml", "--progress", "json"]);
    let events: Vec<Value> = run.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((events[0]["event"].as_str(), events[0]["frames"].as_u64()), (Some("start"), Some(6)));
    let frames: Vec<_> = events.iter().filter(|event| event["event"] == "frame").collect();
    assert_eq!(frames.len(), 6);
    for frame in frames {
        assert!(folder.path(frame["file"].as_str().unwrap()).is_file());
    }
    let last = events.last().unwrap();
    assert_eq!((last["event"].as_str(), last["drawn"].as_u64()), (Some("done"), Some(6)));

    let run = folder.run(&["render", "scene.toml", "--progress", "json", "--out", "scene.toml/a.png"]);
    let event: serde_json::Value = serde_json::from_str(run.stdout.lines().last().unwrap()).unwrap();
    assert_eq!((event["event"].as_str(), event["code"].as_u64()), (Some("error"), Some(1)));
    assert_eq!(run.errors(), 1);
}

#[test]
fn nothing_but_the_last_line_is_told_without_a_terminal() {
    let folder = Folder::with_scene(FLAME);
    let run = folder.succeed(&["render", "scene.toml"]);
    assert!(run.stdout.is_empty());
    assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
    assert!(run.stderr.starts_with("6 frames in ") && run.stderr.contains("scene.0000.png"), "{}", run.stderr);
    assert!(folder.succeed(&["render", "scene.toml", "--progress", "none"]).stderr.is_empty());
    let stats = folder.succeed(&["render", "scene.toml", "--progress", "none", "--stats"]).stderr;
    assert!(["load", "draw", "view", "write", "threads"].iter().all(|word| stats.contains(word)), "{stats}");
}

#[test]
fn statistics_tell_phenomena_and_reflections_apart_and_programs_read_them() {
    let wet = format!("{FLAME}[ground]\nwetness = 1.0\n[[rain]]\nrate_mm_per_h = 20.0\n");
    let folder = Folder::with_scene(&wet);
    let run = folder.succeed(&["render", "scene.toml", "--progress", "json", "--stats"]);
    for row in ["ground", "left log, mirrored", "compositing, mirrored", "compositing", "median of 5 other frames"] {
        assert!(run.stderr.contains(row), "{row}: {}", run.stderr);
    }
    let events: Vec<Value> = run.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let [.., stats, done] = &events[..] else { panic!("{}", run.stdout) };
    assert_eq!((stats["event"].as_str(), done["event"].as_str()), (Some("stats"), Some("done")));
    assert_eq!((stats["frames"].as_u64(), stats["vector_level"].is_string()), (Some(6), true));
    let drawn = |mirrored: bool, stage: &str| {
        let rows = stats["parts"].as_array().unwrap();
        let rain = |row: &&Value| row["phenomenon"] == "rain" && row["mirrored"] == mirrored;
        rows.iter().find(rain).unwrap()["median_ms"][stage].as_f64().unwrap()
    };
    assert!(drawn(false, "draw") > 0.0 && drawn(true, "draw") > 0.0, "{stats}");
    assert_eq!(drawn(false, "advance"), 0.0, "rain is a closed form");
    let plain = folder.succeed(&["render", "scene.toml", "--progress", "json", "--overwrite"]).stdout;
    assert!(!plain.contains("\"stats\""), "{plain}");
}

#[cfg(unix)]
#[test]
fn the_studio_is_the_program_beside_this_one_and_where_there_is_none_it_says_how_to_get_it() {
    use std::{fs, os::unix::fs::PermissionsExt, process::Command};
    let folder = Folder::new();
    let program = folder.path("bansho");
    fs::copy(env!("CARGO_BIN_EXE_bansho"), &program).unwrap();
    let run = || {
        let path = folder.path("");
        let mut command = Command::new(&program);
        command.args(["studio", "fire.toml"]).current_dir(&path).env("PATH", &path).env("DISPLAY", ":0");
        command.output().unwrap()
    };
    let missing = run();
    let told = String::from_utf8(missing.stderr).unwrap();
    assert_eq!((missing.status.code(), told.matches("error:").count()), (Some(1), 1), "{told}");
    assert!(told.contains("cargo install --path crates/studio"), "{told}");

    let studio = folder.path("bansho-studio");
    fs::write(&studio, "#!/bin/sh\necho \"$@\" > opened\n").unwrap();
    fs::set_permissions(&studio, fs::Permissions::from_mode(0o755)).unwrap();
    assert!(run().status.success());
    assert_eq!(folder.files("")["opened"], b"fire.toml\n");

    // The studio's own message is not repeated.
    fs::write(&studio, "#!/bin/sh\necho 'error: no window' >&2\nexit 1\n").unwrap();
    let failed = run();
    assert_eq!((failed.status.code(), failed.stderr), (Some(1), b"error: no window\n".to_vec()));
}

#[cfg(target_os = "linux")]
#[test]
fn without_a_display_the_studio_says_in_a_line_what_to_do() {
    let folder = Folder::new();
    let mut command = folder.command(&["studio", "fire.toml"]);
    ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"].into_iter().for_each(|name| {
        command.env_remove(name);
    });
    let output = command.output().unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), told.lines().count()), (Some(1), 1), "{told}");
    assert!(told.contains("no display") && told.contains("bansho render"), "{told}");
}
