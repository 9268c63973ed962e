//! Scenes that follow a paper to the letter: what the pages of the book say of their keys, what `bansho check --paper` tells, and what the scenes state.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use bansho::{
    KINDS, Scene,
    base::{
        parameters::{Parameters, Table, Value},
        tables::{PaperSettings, PaperValues},
    },
    scene::parse_values,
};

use crate::sources::{cells, read};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// A paper: its page and folder, and the phenomenon that carries it out.
struct Paper {
    name: &'static str,
    kind: &'static str,
}

const PAPERS: [Paper; 4] = [
    Paper { name: "ohshima_itahashi", kind: "flame_sheet" },
    Paper { name: "inagaki", kind: "flame_particles" },
    Paper { name: "yoshida_dobashi_yamamoto", kind: "rain" },
    Paper { name: "sekiguchi", kind: "aurora" },
];

/// Keys in which scenes depart from their paper on purpose, and why.
struct Departure {
    files: &'static [&'static str],
    keys: &'static [&'static str],
    reason: &'static str,
}

const DEPARTURES: &[Departure] = &[
    Departure {
        files: &["ohshima_picture_9.toml"],
        keys: &[
            "method",
            "texture.kind",
            "texture.thinning",
            "color.kind",
            "color.glow",
            "shape.convergence",
            "shape.eddies",
            "shape.sway",
            "shape.flicker",
        ],
        reason: "the paper's outlook: one field of soot, without equations; the texture and the shape of the sheet do not matter",
    },
    Departure {
        files: &["ohshima_in_3d.toml"],
        keys: &["texture.kind"],
        reason: "the texture (20) from a table, filtered for sheets of different sizes",
    },
    Departure {
        files: &["inagaki_figure_6_physical.toml"],
        keys: &["rendering.heat_haze_model"],
        reason: "figure 6 by the refraction of physics, for comparison",
    },
    Departure {
        files: &["inagaki_figure_7.toml"],
        keys: &["rendering.sprite"],
        reason: "the figure shows density as squares",
    },
    Departure {
        files: &[
            "driving_in_rain.toml",
            "driving_toward_camera.toml",
            "lamp_post_afar.toml",
            "lamp_post_near.toml",
            "rain_that_swells.toml",
        ],
        keys: &["method", "terminal_velocity", "opacity", "distance", "camera.shutter_s"],
        reason: "Bansho's own figures, for comparison: real drops, farther than 5 m, with the shutter of the camera",
    },
    Departure {
        files: LITERAL_AURORAS,
        keys: &["particles.repulsion_force"],
        reason: "as (2.14) is printed, particles drift together; the page tells by how much",
    },
    Departure {
        files: &["sekiguchi_paper_1_green_border.toml", "sekiguchi_paper_4_green_border.toml"],
        keys: &["rendering.hard_spheres.quenching_radius_pm"],
        reason: "a second set, whose lower border is green as in nature",
    },
    Departure { files: MAPS, keys: &["picture.size"], reason: "a map of the drawn square is a square" },
    Departure {
        files: &["sekiguchi_figure_2_14_left.toml", "sekiguchi_figure_2_14_right.toml"],
        keys: &["particles.neighbor_search"],
        reason: "the page measures where particles gather with the whole reach of the spline",
    },
    Departure {
        files: &["sekiguchi_figure_2_14_left.toml"],
        keys: &["particles.relocation.enabled"],
        reason: "the figure shows particles without relocation",
    },
];

/// Figures of chapter 2, and figure 3.14.
const MAPS: &[&str] = &[
    "sekiguchi_figure_2_9.toml",
    "sekiguchi_figure_2_10.toml",
    "sekiguchi_figure_2_11.toml",
    "sekiguchi_figure_2_12.toml",
    "sekiguchi_figure_2_14_left.toml",
    "sekiguchi_figure_2_14_right.toml",
    "sekiguchi_figure_2_15.toml",
    "sekiguchi_figure_3_14.toml",
];

/// All scenes of the thesis.
const LITERAL_AURORAS: &[&str] = &[
    "sekiguchi_figure_2_9.toml",
    "sekiguchi_figure_2_10.toml",
    "sekiguchi_figure_2_11.toml",
    "sekiguchi_figure_2_12.toml",
    "sekiguchi_figure_2_13_cubic_spline.toml",
    "sekiguchi_figure_2_13_poly6_spiky.toml",
    "sekiguchi_figure_2_14_left.toml",
    "sekiguchi_figure_2_14_right.toml",
    "sekiguchi_figure_2_15.toml",
    "sekiguchi_figure_3_14.toml",
    "sekiguchi_paper_1.toml",
    "sekiguchi_paper_1_green_border.toml",
    "sekiguchi_paper_2.toml",
    "sekiguchi_paper_3.toml",
    "sekiguchi_paper_4.toml",
    "sekiguchi_paper_4_green_border.toml",
    "sekiguchi_paper_5.toml",
];

/// All scenes in the folder of a paper.
fn scenes(paper: &Paper) -> Vec<PathBuf> {
    let folder = Path::new(ROOT).join("scenes/papers").join(paper.name);
    let files = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = files.filter(|path| file_name(path).ends_with(".toml")).collect();
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

/// Files and keys in which scenes depart on purpose.
fn on_purpose() -> BTreeSet<(String, String)> {
    let of_departure = |departure: &Departure| -> Vec<(String, String)> {
        assert!(departure.reason.len() > 10, "{:?}: no reason", departure.keys);
        let pairs = departure.files.iter().flat_map(|file| departure.keys.iter().map(move |key| (*file, *key)));
        pairs.map(|(file, key)| (file.to_owned(), key.to_owned())).collect()
    };
    DEPARTURES.iter().flat_map(of_departure).collect()
}

/// The settings of the paper of a kind.
fn settings(kind: &str) -> &'static PaperSettings {
    KINDS.iter().find(|table| table.key == kind).and_then(|table| table.paper).unwrap()
}

/// The keys in which a scene departs from its paper, by what `bansho check --paper` tells and by the page, each with what is told of it.
fn departures(paper: &Paper, scene: &Scene) -> Vec<(String, String)> {
    let is_index = |part: &&str| part.parse::<usize>().is_ok();
    let told = scene.paper_departures().into_iter().map(|departure| {
        // `aurora.0.field.cells` is the key `field.cells`; keys of the whole scene have no index.
        let of_table = departure.path.strip_prefix(paper.kind);
        let parts: Vec<&str> = of_table.unwrap_or(&departure.path).split('.').collect();
        let parts = parts.iter().skip_while(|part| part.is_empty() || is_index(part));
        let key: Vec<&str> = parts.map(|part| if is_index(part) { "*" } else { *part }).collect();
        (key.join("."), departure.to_string())
    });
    let by_page = assignments(paper).into_iter().filter_map(|(key, text)| {
        let expected = value_of(&key, &text);
        let mut stated = stated(scene, paper.kind, &key).into_iter();
        let value = stated.find(|value| !value.as_ref().is_some_and(|value| agree(value, &expected)))?;
        let found = value.map_or("nothing".to_owned(), |value| value.to_string());
        let told = format!("{key} is {found}, on the page {text}");
        Some((key, told))
    });
    told.chain(by_page).collect()
}

#[test]
fn scenes_depart_from_their_papers_on_purpose_only() {
    let on_purpose = on_purpose();
    let mut found = BTreeSet::new();
    let mut faults = Vec::new();
    for paper in &PAPERS {
        for path in scenes(paper) {
            for (key, told) in departures(paper, &scene(&path)) {
                let departure = (file_name(&path), key);
                if !on_purpose.contains(&departure) {
                    faults.push(format!("{}: {told}", departure.0));
                }
                found.insert(departure);
            }
        }
    }
    let stale = on_purpose.difference(&found);
    faults.extend(stale.map(|(file, key)| format!("{file}: {key} follows the paper, but is listed as a departure")));
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

/// The page of a paper in the book.
fn page(paper: &Paper) -> String {
    read(&Path::new(ROOT).join("docs/src/papers").join(paper.name).with_extension("md"))
}

/// The assignments `key = value` in the second column of the table under the heading "To the letter" of a paper's page. A key without a table is in that of the
/// assignment before it in its cell.
fn assignments(paper: &Paper) -> Vec<(String, String)> {
    let page = page(paper);
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

/// A value of a page.
fn value_of(key: &str, text: &str) -> Value {
    let parsed = parse_values(&format!("value = {text}")).unwrap_or_else(|_| panic!("{key} = {text}"));
    parsed.get("value").unwrap().value.clone()
}

/// The values of a key of a scene, in the tables of a kind or in those of which a scene has one.
fn stated(scene: &Scene, kind: &str, key: &str) -> Vec<Option<Value>> {
    let in_table = |table: &Table, key: &str| table.at_path(key).cloned();
    match key.split_once('.') {
        Some(("picture", key)) => return vec![in_table(&scene.picture.to_table(), key)],
        Some(("camera", key)) => return vec![in_table(&scene.camera.to_table(), key)],
        Some(("sky", key)) => {
            let sky = scene.tables.iter().find(|table| table.kind.key == "sky");
            return vec![sky.and_then(|sky| in_table(&sky.parameters.canonical(), key))];
        }
        _ => {}
    }
    let tables = scene.instances.iter().filter(|instance| instance.kind.key == kind);
    let of_table = |table: Table| match key.split_once(".*.") {
        None => vec![in_table(&table, key)],
        Some((list, key)) => {
            let Some(Value::List(items)) = table.at_path(list) else { return Vec::new() };
            // No transition leads to the first shape.
            let items = items.iter().skip(1);
            items.map(|item| if let Value::Table(item) = &item.value { in_table(item, key) } else { None }).collect()
        }
    };
    tables.flat_map(|instance| of_table(instance.parameters.canonical())).collect()
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
fn pages_and_settings_state_the_same_values() {
    let mut faults = Vec::new();
    for paper in &PAPERS {
        let settings = settings(paper.kind);
        let assignments = assignments(paper);
        for setting in settings.settings.iter().chain(settings.scene_settings) {
            let is_named = |page: &str| page.contains(&format!("`{}`", setting.key));
            let is_stated = match setting.allowed {
                PaperValues::OneOf([""]) => true,
                PaperValues::OneOf(_) => assignments.iter().any(|(key, _)| key == setting.key),
                PaperValues::AboveZero => is_named(&page(paper)),
            };
            if !is_stated {
                faults.push(format!("{}: the page does not state `{}`", paper.name, setting.key));
            }
        }
        for (key, text) in assignments {
            let expected = value_of(&key, &text);
            let of_key = settings.settings.iter().chain(settings.scene_settings).find(|setting| setting.key == key);
            let is_allowed = of_key.is_some_and(|setting| match setting.allowed {
                PaperValues::OneOf(texts) => {
                    texts.iter().any(|text| !text.is_empty() && agree(&value_of(&key, text), &expected))
                }
                PaperValues::AboveZero => expected.as_number().is_some_and(|number| number > 0.0),
            });
            if !is_allowed {
                faults.push(format!("{}: `{key} = {text}` of the page is not among the settings", paper.name));
            }
        }
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
