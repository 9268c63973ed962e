//! Scenes of thousands of things, right and wrong: checked in a time that grows with their number and no faster.

use std::time::{Duration, Instant};

use crate::support::Folder;

/// Longer than any of these takes on a slow machine that does much else, and far less than what grows with the square takes.
const PATIENCE: Duration = Duration::from_secs(60);

/// Checks a scene within the time limit; returns exit code and messages.
fn check(scene: &str) -> (Option<i32>, String) {
    let folder = Folder::with_scene(scene);
    let begun = Instant::now();
    let run = folder.run(&["check", "scene.toml"]);
    assert!(begun.elapsed() < PATIENCE, "it took {:?}", begun.elapsed());
    (run.code, run.stderr)
}

fn repeated(table: &str, count: usize) -> String {
    // Small, so that the memory of all tables is not what is refused.
    format!("bansho = 2\npicture = {{ size = [32, 18] }}\n{}", table.repeat(count))
}

#[test]
fn ten_thousand_phenomena_are_checked() {
    for table in ["[[flame_sheet]]\n", "[[rain]]\n", "[[light]]\n", "[[obstacle]]\nshape = \"sphere\"\n"] {
        let (code, said) = check(&repeated(table, 10_000));
        assert_eq!(code, Some(0), "{table}{said}");
    }
    let (code, said) = check(&repeated("[[flame_particles]]\nparticles = 60\n", 10_000));
    assert_eq!(code, Some(0), "{said}");
}

#[test]
fn of_many_faults_a_hundred_are_told_and_the_others_counted() {
    let (code, said) = check(&repeated("[[flame_sheet]]\nheight = -1\n", 16_000));
    let errors: Vec<&str> = said.lines().filter(|line| line.starts_with("error: ")).collect();
    assert_eq!((code, errors.len()), (Some(3), 100));
    assert!(errors[0].starts_with("error: scene.toml:4:10: flame_sheet.0.height: -1 is out of range"), "{}", errors[0]);
    assert!(errors[99].starts_with("error: scene.toml:202:10: "), "{}", errors[99]);
    assert_eq!(said.lines().last(), Some("scene.toml: and 15900 more problems"));
}

#[test]
fn a_hundred_faults_are_all_told() {
    let (_, said) = check(&repeated("[[flame_sheet]]\nheight = -1\n", 100));
    assert_eq!((said.matches("error: ").count(), said.contains("more problem")), (100, false));
}

#[test]
fn a_million_unknown_keys_are_not_a_million_errors() {
    let keys: String = (0..1_000_000).map(|index| format!("k{index} = 1\n")).collect();
    for scene in [format!("bansho = 2\n[[flame_sheet]]\n{keys}"), format!("bansho = 2\n{keys}")] {
        let (code, said) = check(&scene);
        assert_eq!((code, said.matches("error: ").count()), (Some(3), 100));
        assert!(said.contains("and 999900 more problems"), "{said}");
    }
}

#[test]
fn of_a_line_of_megabytes_the_part_around_the_fault_is_shown() {
    let long = "x".repeat(5_000_000);
    for line in [format!("height = \"{long}\""), format!("{long} = 1"), format!("stage = \"{long}\"")] {
        let (code, said) = check(&format!("bansho = 2\n[[flame_sheet]]\n{line}\n"));
        assert_eq!(code, Some(3));
        assert!(said.len() < 2000 && said.starts_with("error: scene.toml:3:"), "{}", said.len());
    }
}

#[test]
fn too_many_keys_of_a_curve_are_one_fault() {
    let keys: Vec<String> = (0..100_001).map(|index| format!("[{index}, {}]", index % 7)).collect();
    let scene = format!("bansho = 2\n[[flame_sheet]]\nspeed = {{ keys = [{}] }}\n", keys.join(", "));
    let (code, said) = check(&scene);
    assert_eq!((code, said.matches("error: ").count()), (Some(3), 1));
    let told = "error: scene.toml:3:9: flame_sheet.0.speed: has 100001 items; allowed: 1 to 100000 items";
    assert!(said.starts_with(told), "{}", &said[..200]);
}

#[test]
fn what_would_take_gigabytes_to_parse_is_refused_before() {
    let (code, said) = check(&format!("bansho = 2\nx = [{}]\n", "0,".repeat(5_000_000)));
    assert_eq!((code, said.matches("error: ").count()), (Some(3), 1));
    assert!(said.contains("allowed: up to 1200000"), "{said}");
}
