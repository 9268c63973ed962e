//! Scenes that follow a paper to the letter: what the pages of the book say of their keys, what `bansho check --paper` tells, and what the scenes state.

#[path = "support/sources.rs"]
mod sources;

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use bansho::{
    KINDS, Scene,
    base::{
        parameters::{Parameters, Value},
        tables::PaperSettings,
    },
    scene::parse_values,
};
use sources::{cells, read};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// A paper: its page and folder, the phenomenon that carries it out, and what its literal scenes are called.
struct Paper {
    name: &'static str,
    kind: &'static str,
    scenes: &'static [&'static str],
}

const PAPERS: [Paper; 4] = [
    Paper { name: "ohshima_itahashi", kind: "flame_sheet", scenes: &["ohshima_picture_"] },
    Paper { name: "inagaki", kind: "flame_particles", scenes: &["inagaki_figure_"] },
    Paper { name: "yoshida_dobashi_yamamoto", kind: "rain", scenes: &["yoshida_"] },
    Paper { name: "sekiguchi", kind: "aurora", scenes: &["sekiguchi_paper_"] },
];

/// Keys in which a scene departs from its paper on purpose: file, key, why.
const DEPARTURES: &[(&str, &str, &str)] = &[
    ("ohshima_picture_9.toml", "", "the paper's outlook: one field of soot, without equations"),
    ("inagaki_figure_6_physical.toml", "", "the same by physics, for comparison"),
    ("inagaki_figure_5.toml", "rendering.heat_haze_model", "the background without haze"),
    ("inagaki_figure_7.toml", "rendering.sprite", "squares instead of the flame"),
    ("inagaki_figure_7.toml", "rendering.detail", "squares have none"),
    ("inagaki_figure_7.toml", "rendering.heat_haze_model", "without haze"),
];

/// Files of the literal scenes of a paper.
fn literal_scenes(paper: &Paper) -> Vec<PathBuf> {
    let folder = Path::new(ROOT).join("scenes/papers").join(paper.name);
    let files = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let is_literal = |name: &str| name.ends_with(".toml") && paper.scenes.iter().any(|start| name.starts_with(start));
    let mut files: Vec<PathBuf> = files.filter(|path| is_literal(&file_name(path))).collect();
    files.sort();
    assert!(!files.is_empty(), "{}", folder.display());
    files
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap().to_str().unwrap().to_owned()
}

fn scene(path: &Path) -> Scene {
    bansho::parse_scene(&file_name(path), &read(path)).unwrap_or_else(|error| panic!("{error}"))
}

fn is_on_purpose(path: &Path, key: &str) -> bool {
    DEPARTURES.iter().any(|(file, purpose, _)| *file == file_name(path) && (purpose.is_empty() || *purpose == key))
}

/// The settings of the paper of a kind.
fn settings(kind: &str) -> &'static PaperSettings {
    KINDS.iter().find(|table| table.key == kind).and_then(|table| table.paper).unwrap()
}

#[test]
fn literal_scenes_depart_from_their_papers_on_purpose_only() {
    let mut faults = Vec::new();
    for path in PAPERS.iter().flat_map(literal_scenes) {
        for departure in scene(&path).paper_departures() {
            let key = departure.path.split('.').skip_while(|part| part.parse::<usize>().is_err()).skip(1);
            let key: Vec<&str> = key.collect();
            if !is_on_purpose(&path, &key.join(".")) && !is_on_purpose(&path, &departure.path) {
                faults.push(format!("{}: {departure}", file_name(&path)));
            }
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

/// The assignments `key = value` in the second column of the table under the heading "To the letter" of a paper's page. A key without a table is in that of the
/// assignment before it in its cell.
fn assignments(paper: &Paper) -> Vec<(String, String)> {
    let page = read(&Path::new(ROOT).join("docs/src/papers").join(paper.name).with_extension("md"));
    let section = page.lines().skip_while(|line| line.trim() != "## To the letter").skip(1);
    let table = section.skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|')).skip(2);
    let mut found = Vec::new();
    for row in table {
        let mut table = String::new();
        let cell = cells(row).get(1).cloned().unwrap_or_default();
        for code in cell.split('`').skip(1).step_by(2) {
            let Some((key, value)) = code.split_once(" = ") else { continue };
            if let Some((outer, _)) = key.rsplit_once('.') {
                outer.clone_into(&mut table);
            }
            let key = if key.contains('.') || table.is_empty() { key.to_owned() } else { format!("{table}.{key}") };
            found.push((key, value.to_owned()));
        }
    }
    assert!(!found.is_empty(), "{}: no table under the heading `To the letter`", paper.name);
    found
}

/// The value of a key of a scene, in the tables of a kind or in `[picture]` and `[camera]`.
fn stated(scene: &Scene, kind: &str, key: &str) -> Vec<Option<Value>> {
    if let Some(key) = key.strip_prefix("picture.") {
        return vec![scene.picture.to_table().at_path(key).cloned()];
    }
    if let Some(key) = key.strip_prefix("camera.") {
        return vec![scene.camera.to_table().at_path(key).cloned()];
    }
    let tables = scene.instances.iter().filter(|instance| instance.kind.key == kind);
    tables.map(|instance| instance.parameters.canonical().at_path(key).cloned()).collect()
}

fn agree(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::List(a), Value::List(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| agree(&a.value, &b.value))
        }
        // Pages round.
        (a, b) => match (a.as_number(), b.as_number()) {
            (Some(a), Some(b)) => (a - b).abs() <= 2e-3 * b.abs(),
            _ => a == b,
        },
    }
}

#[test]
fn what_the_pages_say_of_literal_scenes_is_what_these_state() {
    let mut faults = Vec::new();
    for paper in &PAPERS {
        let assignments = assignments(paper);
        for path in literal_scenes(paper) {
            let scene = scene(&path);
            for (key, text) in &assignments {
                let parsed = parse_values(&format!("value = {text}")).unwrap_or_else(|_| panic!("{key} = {text}"));
                let expected = &parsed.get("value").unwrap().value;
                for value in stated(&scene, paper.kind, key) {
                    if !value.as_ref().is_some_and(|value| agree(value, expected)) && !is_on_purpose(&path, key) {
                        let found = value.map_or("nothing".to_owned(), |value| value.to_string());
                        faults.push(format!("{}: {key} is {found}, on the page {text}", file_name(&path)));
                    }
                }
            }
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn the_pages_name_every_setting_of_their_papers() {
    let mut faults = Vec::new();
    for paper in &PAPERS {
        let settings = settings(paper.kind);
        let stated: BTreeSet<String> = assignments(paper).into_iter().map(|(key, _)| key).collect();
        let of_paper =
            settings.settings.iter().chain(settings.scene_settings).filter(|setting| setting.allowed != [""]);
        let missing = of_paper.filter(|setting| !stated.contains(setting.key));
        faults.extend(missing.map(|setting| format!("{}: does not state `{}`", paper.name, setting.key)));
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn a_departure_tells_the_value_and_that_of_the_paper() {
    let text = "bansho = 2\n[[rain]]\n[[rain]]\nenabled = false\n";
    let departures = bansho::parse_scene("rain", text).unwrap().paper_departures();
    let texts: Vec<String> = departures.iter().map(ToString::to_string).collect();
    assert!(texts.iter().any(|text| {
        text == "Yoshida, Dobashi & Yamamoto, section 5.1: rain.0.method = \"textures\", here \"billboards\""
    }));
    // The keys of the scene once, and none of a phenomenon that is not drawn.
    assert!(texts.iter().filter(|text| text.contains(": picture.view = ")).count() == 1, "{texts:?}");
    assert!(!texts.iter().any(|text| text.contains("rain.1")), "{texts:?}");
    let sky = bansho::parse_scene("sky", "bansho = 2\n[sky]\n").unwrap();
    assert!(sky.paper_departures().is_empty());
}
