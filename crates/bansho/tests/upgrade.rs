//! The example scenes as format 1 had them, upgraded to the current format.

#![cfg(all(feature = "fire", feature = "rain", feature = "aurora"))]

use std::{fs, path::Path};

use bansho::{
    parse_scene,
    scene::edit::{EditError, upgrade},
};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/format_1");

fn each_scene(mut check: impl FnMut(&str, &str)) {
    let mut scenes = 0;
    for entry in fs::read_dir(Path::new(FOLDER)).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        check(&name, &fs::read_to_string(&path).unwrap());
        scenes += 1;
    }
    assert_eq!(scenes, 33);
}

#[test]
fn the_scenes_of_format_1_upgrade_without_a_problem() {
    each_scene(|name, old| {
        let new = upgrade(old).unwrap().unwrap_or_else(|| panic!("{name} is taken for the current format"));
        if let Err(error) = parse_scene(name, &new) {
            panic!("{error}");
        }
        assert_eq!(upgrade(&new), Ok(None), "{name}");
        // Only keys and choices change: every line, comment and number stays.
        let comments = |text: &str| -> Vec<String> {
            text.lines().filter_map(|line| Some(line.split_once("# ")?.1.to_owned())).collect()
        };
        let numbers = |text: &str| -> Vec<f64> {
            let values = text.lines().filter_map(|line| line.split('#').next()?.split_once('='));
            let parts = values.flat_map(|(_, value)| value.split(['[', ']', ',', ' ', '{', '}', '=']));
            parts.filter_map(|part| part.parse().ok()).collect()
        };
        assert_eq!(comments(old), comments(&new), "{name}");
        assert_eq!(numbers(old)[1..], numbers(&new)[1..], "{name}");
        assert_eq!(old.lines().count(), new.lines().count(), "{name}");
    });
}

#[test]
fn a_scene_of_format_1_is_one_error_that_names_the_upgrade() {
    each_scene(|name, old| {
        let error = parse_scene(name, old).err().expect("a scene of format 1 is refused");
        assert_eq!((error.problems.len(), error.omitted), (1, 0), "{error}");
        assert!(error.to_string().contains("`bansho upgrade` rewrites the file"), "{error}");
    });
}

#[test]
fn a_scene_of_a_newer_format_is_not_touched() {
    assert_eq!(upgrade("bansho = 3\n[[rain]]\n").unwrap_err(), EditError::NewerFormat { found: 3 });
}
