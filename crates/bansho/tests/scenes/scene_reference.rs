//! The reference page of the scene file in the book is generated from the descriptors, and all example scenes of the book are valid.

use std::path::{Path, PathBuf};

use bansho::{KINDS, phenomena};
use bansho_base::{
    host::assets::MemoryAssets,
    parameters::{Descriptor, Kind, PAPER_HEADING, ProblemKind, TableDescriptor, Value},
    tables::BuildContext,
};
use bansho_scene::{FORMAT, Scene};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/reference/scene.md");

#[test]
fn the_books_page_on_the_scene_file_is_up_to_date() {
    let page = page();
    if std::env::var_os("BANSHO_BLESS").is_some() {
        std::fs::write(PAGE, &page).unwrap();
    }
    let written = std::fs::read_to_string(PAGE).unwrap();
    let differs = written.lines().zip(page.lines()).find(|(written, now)| written != now);
    assert_eq!(differs, None, "run BANSHO_BLESS=1 cargo test -p bansho --test scenes scene_reference");
    assert_eq!(written.len(), page.len());
}

#[test]
fn the_page_has_the_parameters_for_a_paper_last_in_their_table_below_a_heading() {
    let page = page();
    for kind in phenomena() {
        let (_, own) = page.split_once(&format!("\n## `{}`\n", kind.header())).unwrap();
        let own = own.split("\n#").next().unwrap();
        let [for_pictures, for_paper] = (kind.table)().by_purpose();
        let (before, after) = own.split_once(PAPER_HEADING).unwrap_or((own, ""));
        assert!(for_pictures.iter().all(|parameter| before.contains(&format!("\n| `{}` |", parameter.key))), "{own}");
        assert!(for_paper.iter().all(|parameter| after.contains(&format!("\n| `{}` |", parameter.key))), "{own}");
    }
}

#[test]
fn every_scene_in_readme_and_book_is_valid() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let inside = |folder| std::fs::read_dir(root.join(folder)).unwrap().map(|entry| entry.unwrap().path());
    let (guide, methods) = (inside("docs/src/guide"), inside("docs/src/methods"));
    let pages: Vec<PathBuf> = guide.chain(methods).chain([root.join("README.md")]).collect();
    let mut scenes = 0;
    for page in pages {
        let text = std::fs::read_to_string(&page).unwrap();
        for block in text.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next()) {
            // Excerpts omit the first line of a scene.
            let scene = if block.contains("bansho = ") { block.to_owned() } else { format!("bansho = 2\n{block}") };
            scenes += 1;
            let Err(error) = Scene::parse("example", &scene, KINDS) else { continue };
            // The plates of the examples do not exist.
            let wrong = error.problems.iter().any(|problem| !matches!(problem.kind, ProblemKind::Asset(_)));
            assert!(!wrong, "{}: {error}", page.display());
        }
    }
    assert!(scenes >= 5, "found only {scenes}");
}

#[test]
fn the_guide_lists_every_aov() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/guide/output.md");
    let page = std::fs::read_to_string(page).unwrap();
    for kind in phenomena() {
        let scene = format!("bansho = 2\n[[{}]]\n", kind.key);
        let scene = Scene::parse("aovs", &scene, KINDS).unwrap_or_else(|error| panic!("{error}"));
        let context =
            BuildContext { name: "any", seed: 0, loop_s: None, assets: &MemoryAssets::default(), previous: None };
        let phenomenon = scene.instances[0].parameters.build(&context).unwrap_or_else(|error| panic!("{error:?}"));
        for aov in phenomenon.info().aovs {
            assert!(page.contains(&format!("`{}`", aov.name)), "{}: {} is not listed", kind.key, aov.name);
            let unit = if aov.unit == "1" { "" } else { aov.unit };
            let row = page.lines().find(|line| line.contains(&format!("`{}`", aov.name))).unwrap_or_default();
            assert!(row.split('|').nth(3).is_some_and(|cell| cell.trim() == unit), "{}: {row}", aov.name);
        }
    }
}

fn page() -> String {
    let mut page = format!(
        "# The scene file\n\n\
         <!-- Written by crates/bansho/tests/scenes/scene_reference.rs from the descriptors; edit those instead. -->\n\n\
         A scene begins with its format, `bansho = {FORMAT}`. Everything else may be left out and then has the default given \
         here. How values, keys and curves are written is described in [the guide](../guide/scene-file.md). Last in each table are the keys \
         that are there only so that [a paper](../papers/sekiguchi.md) can be followed to the letter.\n"
    );
    for kind in KINDS {
        let common = if kind.is_phenomenon() { COMMON } else { "" };
        section(&mut page, &kind.header(), common, (kind.table)());
    }
    page
}

/// Keys that every phenomenon has in addition to its parameters.
const COMMON: &str = "| `name` | a string of 1 to 63 bytes without dots, none of `plate`, `sky`, `ground`, `lamps` and of names that EXR readers use themselves, such as `R`, `Z`, `depth` | the kind, numbered from the second on | \
    Unique name of this one; names its layers. |\n\
    | `enabled` | true or false | `true` | Whether it is drawn. |\n";

fn section(page: &mut String, header: &str, common: &str, table: &TableDescriptor) {
    *page += &format!("\n## `{header}`\n\n{}\n", one_line(&table.doc));
    parameters(page, common, table);
    let mut inner = Vec::new();
    tables("", table, &mut inner);
    for (key, table) in inner {
        *page += &format!("\n### `{key}` in `{header}`\n\n{}\n", one_line(&table.doc));
        parameters(page, "", table);
    }
}

fn parameters(page: &mut String, common: &str, table: &TableDescriptor) {
    let [for_pictures, for_paper] = table.by_purpose();
    if !(for_pictures.is_empty() && common.is_empty()) {
        rows(page, common, &for_pictures);
    }
    if !for_paper.is_empty() {
        *page += &format!("\n*{PAPER_HEADING}:*\n");
        rows(page, "", &for_paper);
    }
}

fn rows(page: &mut String, common: &str, parameters: &[&Descriptor]) {
    *page += &format!("\n| key | allowed | default | what it is |\n|---|---|---|---|\n{common}");
    for parameter in parameters {
        let doc = format!("{}{}", one_line(&parameter.doc), choices(&parameter.kind));
        let cells = [format!("`{}`", parameter.key), allowed(parameter), default(parameter), doc];
        *page += &format!("| {} |\n", cells.map(|cell| cell.replace('|', "\\|")).join(" | "));
    }
}

/// The tables within a table, each with its dotted key.
fn tables(prefix: &str, table: &TableDescriptor, found: &mut Vec<(String, &'static TableDescriptor)>) {
    for parameter in table.by_purpose().concat() {
        let (inner, suffix) = match &parameter.kind {
            Kind::List { item, .. } => (item.as_ref(), "[]"),
            kind => (kind, ""),
        };
        if let Kind::Table(inner) = inner {
            let key = format!("{prefix}{}{suffix}", parameter.key);
            found.push((key.clone(), inner()));
            tables(&format!("{key}."), inner(), found);
        }
    }
}

fn allowed(parameter: &Descriptor) -> String {
    let unit = if parameter.unit.is_empty() { String::new() } else { format!(" [{}]", parameter.unit) };
    let rising = if matches!(parameter.kind, Kind::Curve { rising: true, .. }) { ", never falling" } else { "" };
    format!("{}{unit}{rising}", parameter.kind.expectation())
}

fn default(parameter: &Descriptor) -> String {
    match (&parameter.kind, &parameter.default) {
        (Kind::Table(_), _) => "see below".into(),
        (_, Some(Value::List(items))) if items.is_empty() => "none".into(),
        (_, Some(value)) => format!("`{value}`"),
        (_, None) => "none".into(),
    }
}

/// What each name of a choice means.
fn choices(kind: &Kind) -> String {
    let Kind::Choice(choices) = kind else { return String::new() };
    choices.iter().map(|choice| format!(" `{}`: {}", choice.name, one_line(choice.doc))).collect()
}

fn one_line(doc: &str) -> String {
    doc.split_whitespace().collect::<Vec<_>>().join(" ")
}
