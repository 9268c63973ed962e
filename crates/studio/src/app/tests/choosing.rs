//! Opening and saving files in dialogs, and dropping files on the window.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use eframe::egui::{DroppedFile, Event, Key, Modifiers, Role};
use egui_kittest::{Harness, kittest::Queryable};

use super::{super::Studio, SCENE, drawn, sky, text, window};
use crate::editors::aurora::document::AuroraDrawing;

/// Types `path` in the open dialog and clicks `button`.
pub(super) fn answer(harness: &mut Harness<'_, Studio>, path: &Path, button: &str) {
    harness.get_by_role_and_label(Role::TextInput, "Name").focus();
    harness.run_steps(2);
    harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    harness.event(Event::Text(path.display().to_string()));
    harness.run_steps(3);
    confirm(harness, button);
}

/// Clicks `button` of the open dialog; other widgets may have the same label.
pub(super) fn confirm(harness: &mut Harness<'_, Studio>, button: &str) {
    // A dialog is positioned in its first frames.
    harness.run_steps(3);
    harness.get_all_by_label(button).last().expect("the answer").click();
    drawn(harness);
}

/// Opens `path` as with Ctrl+O.
pub(super) fn open(harness: &mut Harness<'_, Studio>, path: &Path) {
    harness.key_press_modifiers(Modifiers::COMMAND, Key::O);
    harness.run_steps(3);
    answer(harness, path, "Open");
}

pub(super) fn save(harness: &mut Harness<'_, Studio>) {
    harness.key_press_modifiers(Modifiers::COMMAND, Key::S);
    harness.run_steps(3);
}

/// Clicks menu entries one after another.
fn menu(harness: &mut Harness<'_, Studio>, choices: &[&str]) {
    for choice in choices {
        harness.get_by_label(choice).click();
        harness.run_steps(3);
    }
    drawn(harness);
}

fn notice(harness: &mut Harness<'_, Studio>) -> String {
    harness.state_mut().session().notice().unwrap_or_default().to_owned()
}

fn edited(harness: &mut Harness<'_, Studio>, to: &str) {
    harness.state_mut().session().document.replace("typing", to);
    drawn(harness);
}

#[derive(Debug)]
struct Dropped(PathBuf);

impl DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }
    fn bytes(&self) -> Result<Vec<u8>, String> {
        fs::read(&self.0).map_err(|error| error.to_string())
    }
}

fn drop_on(harness: &mut Harness<'_, Studio>, files: &[PathBuf]) {
    for file in files {
        harness.input_mut().dropped_files.push(Arc::new(Dropped(file.clone())));
    }
    harness.step();
    harness.input_mut().dropped_files.clear();
    drawn(harness);
}

/// A folder with a plate, a mesh, drawings and scenes.
fn asset_folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    fs::copy(scenes.join("plates/checkerboard.png"), folder.path().join("board.png")).unwrap();
    fs::copy(scenes.join("meshes/ring.glb"), folder.path().join("ring.glb")).unwrap();
    let svg =
        |path: &str| format!("<svg viewBox=\"0 0 100 100\"><path d=\"{path}\" stroke=\"black\" fill=\"none\"/></svg>");
    fs::write(folder.path().join("arc.svg"), svg("M 10 50 L 90 50")).unwrap();
    fs::write(folder.path().join("cross.svg"), svg("M 10 50 L 90 50 M 50 10 L 50 90")).unwrap();
    fs::write(folder.path().join("other.toml"), SCENE).unwrap();
    folder
}

#[test]
fn files_dropped_on_an_unsaved_scene_are_added_to_it() {
    let folder = asset_folder();
    let file = |name: &str| folder.path().join(name);
    let mut harness =
        window(&sky(2, "[[aurora]]\npreroll_s = 0.0\nparticles = { count = 300 }\nfield = { cells = 31 }\n"));
    drop_on(&mut harness, &[file("board.png")]);
    assert!(
        text(&mut harness).contains(&format!("image = \"{}\"", file("board.png").display())),
        "{}",
        text(&mut harness)
    );
    assert!(harness.state_mut().session().document.error().is_none(), "it is found");

    menu(&mut harness, &["aurora 2"]);
    drop_on(&mut harness, &[file("arc.svg")]);
    let session = harness.state_mut().session();
    let stated =
        |index: usize| AuroraDrawing::read(session.document.values(), index, session.assets()).unwrap().is_stated();
    assert_eq!([stated(0), stated(1)], [false, true], "the aurora that is chosen");

    let before = text(&mut harness);
    drop_on(&mut harness, &[file("cross.svg")]);
    assert_eq!(text(&mut harness), before, "sheets that cross are refused");
    assert!(notice(&mut harness).contains("meets"), "{}", notice(&mut harness));

    drop_on(&mut harness, &[file("ring.glb")]);
    assert_eq!(text(&mut harness), before);
    assert!(notice(&mut harness).contains("flame_particles"), "{}", notice(&mut harness));
    fs::write(file("words.doc"), "").unwrap();
    drop_on(&mut harness, &[file("words.doc")]);
    assert!(notice(&mut harness).starts_with("words.doc: "), "{}", notice(&mut harness));
}

#[test]
fn a_dropped_mesh_becomes_a_burner_and_all_dropped_files_are_added() {
    let folder = asset_folder();
    let file = |name: &str| folder.path().join(name);
    let mut harness =
        window("bansho = 2\n[picture]\nsize = [32, 18]\nframes = 2\n[[flame_particles]]\nparticles = 50\n");
    drop_on(&mut harness, &[file("ring.glb"), file("board.png")]);
    let edited = text(&mut harness);
    assert!(
        edited.contains("shape = \"mesh\"") && edited.contains("ring.glb") && edited.contains("board.png"),
        "{edited}"
    );
    assert!(!edited.contains("image = \"ring"), "{edited}");
    assert!(harness.state_mut().session().document.error().is_none(), "{edited}");
    drop_on(&mut harness, &[file("arc.svg"), file("other.toml")]);
    confirm(&mut harness, "Leave it");
    assert_eq!(text(&mut harness), SCENE, "a scene is opened, whatever lies with it");
}

#[test]
fn saving_appends_the_extension_and_asks_before_replacing_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut harness = window(SCENE);
    save(&mut harness);
    answer(&mut harness, &folder.path().join("fire.v2"), "Save");
    assert_eq!(fs::read_to_string(folder.path().join("fire.v2.toml")).unwrap(), SCENE);

    fs::write(folder.path().join("taken.toml"), "bansho = 2\n").unwrap();
    menu(&mut harness, &["File", "Save as…"]);
    answer(&mut harness, &folder.path().join("taken"), "Save");
    harness.get_by_label_contains("There is a file of that name");
    confirm(&mut harness, "Cancel");
    assert_eq!(fs::read_to_string(folder.path().join("taken.toml")).unwrap(), "bansho = 2\n");
    menu(&mut harness, &["File", "Save as…"]);
    answer(&mut harness, &folder.path().join("taken.toml"), "Save");
    confirm(&mut harness, "Replace it");
    assert_eq!(fs::read_to_string(folder.path().join("taken.toml")).unwrap(), SCENE);
    assert_eq!(harness.state_mut().session().path, Some(folder.path().join("taken.toml")));
}

#[test]
fn the_pending_action_follows_save_as() {
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("other.toml");
    fs::write(&other, "bansho = 2\n[[rain]]\n").unwrap();
    let mut harness = window(SCENE);
    edited(&mut harness, &SCENE.replace("0.9", "1.3"));
    open(&mut harness, &other);
    harness.get_by_label("There is unsaved work.");
    confirm(&mut harness, "Save");
    answer(&mut harness, &folder.path().join("mine.toml"), "Save");
    assert!(fs::read_to_string(folder.path().join("mine.toml")).unwrap().contains("height = 1.3"));
    assert_eq!(text(&mut harness), "bansho = 2\n[[rain]]\n", "then the other one is open");
    assert_eq!(harness.state_mut().session().path, Some(other));
}

#[test]
fn saved_examples_include_their_assets() {
    for example in ["rain over plate", "burning mesh"] {
        let folder = tempfile::tempdir().unwrap();
        let mut harness = window(SCENE);
        menu(&mut harness, &["File", "Examples"]);
        harness.get_by_label(example).click_accesskit();
        drawn(&mut harness);
        let before = text(&mut harness);
        assert!(before.contains("plates/") || before.contains("meshes/"), "{before}");
        save(&mut harness);
        answer(&mut harness, &folder.path().join("mine.toml"), "Save");
        assert_eq!(text(&mut harness), before, "the names stay");
        assert!(harness.state_mut().session().document.error().is_none(), "{example}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "the scene, and a folder of what it names");
    }
}

#[test]
fn a_scene_saved_in_another_folder_refers_to_the_same_files() {
    let folder = asset_folder();
    let scene = format!("{SCENE}[plate]\nimage = \"board.png\" # the ground\n");
    fs::write(folder.path().join("scene.toml"), &scene).unwrap();
    let mut harness = window("bansho = 2\n");
    open(&mut harness, &folder.path().join("scene.toml"));
    menu(&mut harness, &["File", "Save as…"]);
    answer(&mut harness, &folder.path().join("deep/er/scene.toml"), "Save");
    let saved = fs::read_to_string(folder.path().join("deep/er/scene.toml")).unwrap();
    assert!(saved.contains("image = \"../../board.png\" # the ground"), "{saved}");
    assert!(harness.state_mut().session().document.error().is_none());
    assert_eq!(fs::read_to_string(folder.path().join("scene.toml")).unwrap(), scene, "the first one stays");
}

#[test]
fn a_scene_that_cannot_be_saved_says_so_and_stays_unsaved() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    let mut harness = window(SCENE);
    edited(&mut harness, &SCENE.replace("0.9", "1.3"));
    open(&mut harness, &folder.path().join("none.toml"));
    assert!(notice(&mut harness).contains("none.toml: the scene cannot be read"), "{}", notice(&mut harness));
    save(&mut harness);
    answer(&mut harness, &folder.path().join("file/scene.toml"), "Save");
    assert!(notice(&mut harness).contains("scene.toml"), "{}", notice(&mut harness));
    assert!(harness.state_mut().session().document.is_dirty() && harness.state_mut().session().path.is_none());
}

#[test]
fn a_scene_that_cannot_be_saved_elsewhere_keeps_its_paths() {
    let folder = asset_folder();
    let file = |name: &str| folder.path().join(name);
    let scene = format!("{SCENE}[plate]\nimage = \"board.png\"\n");
    fs::write(file("scene.toml"), &scene).unwrap();
    let mut harness = window("bansho = 2\n");
    open(&mut harness, &file("scene.toml"));
    let refused = |harness: &mut Harness<'_, Studio>, to: &str, reason: &str, unchanged: &str| {
        menu(harness, &["File", "Save as…"]);
        answer(harness, &file(to), "Save");
        assert!(notice(harness).contains(reason), "{}", notice(harness));
        assert_eq!(text(harness), unchanged);
        assert_eq!(harness.state_mut().session().path, Some(file("scene.toml")));
    };
    refused(&mut harness, "board.png/deep/scene.toml", "not a folder", &scene);
    let faulty = format!("{scene}[light\n");
    edited(&mut harness, &faulty);
    refused(&mut harness, "deep/scene.toml", "not TOML", &faulty);
    assert!(!file("deep/scene.toml").exists() && harness.state_mut().session().document.is_dirty());
    save(&mut harness);
    assert_eq!(fs::read_to_string(file("scene.toml")).unwrap(), faulty, "where it lies its paths are right");
}

#[test]
fn replacing_an_unreadable_file_asks_first() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    fs::write(&path, SCENE).unwrap();
    let mut harness = window("bansho = 2\n");
    open(&mut harness, &path);
    edited(&mut harness, &SCENE.replace("0.9", "1.3"));
    fs::write(&path, b"\xff\xfe").unwrap();
    save(&mut harness);
    harness.get_by_label_contains("cannot be read");
    confirm(&mut harness, "Cancel");
    assert_eq!(fs::read(&path).unwrap(), b"\xff\xfe");
    save(&mut harness);
    confirm(&mut harness, "Replace it");
    assert!(fs::read_to_string(&path).unwrap().contains("height = 1.3"));
}
