use std::{fs, sync::Arc};

use bansho::{
    Assets, MemoryAssets,
    base::parameters::{ProblemKind, Value},
    scene::{ValuePath, operation::Operation},
};

use super::{
    files::{self, ExternalChange, RecentFiles},
    *,
};
use crate::document::{
    files::autosave::{self, Autosave},
    phenomena::operations,
};

const SCENE: &str = "\
# A fire in the rain.
bansho = 2
[picture]
size = [32, 18]
[[flame_sheet]]
name = \"fire\" # the only one
[[rain]]
";

fn scene() -> Document {
    Document::new("fire.toml", SCENE)
}

fn assets() -> Arc<dyn Assets> {
    Arc::new(MemoryAssets::default())
}

fn height(value: f64) -> Operation {
    Operation::Set { path: ValuePath::root().key("flame_sheet").index(0).key("height"), value: Value::Number(value) }
}

#[test]
fn edits_are_undone_and_redone() {
    let mut document = scene();
    document.edit("height", &[height(1.0)]).unwrap();
    document.end_step();
    let once = document.text().clone();
    document.edit("height", &[height(2.0)]).unwrap();
    assert_eq!(document.undo_label(), Some("height"));
    assert!(document.undo());
    assert_eq!(*document.text(), once);
    assert!(document.undo() && !document.undo());
    assert_eq!(**document.text(), *SCENE);
    assert!(document.redo() && document.redo() && !document.redo());
    assert!(document.text().contains("height = 2.0"));
}

#[test]
fn a_drag_is_one_undo_step() {
    let mut document = scene();
    for step in 1..=50 {
        document.edit("height", &[height(f64::from(step) * 0.1)]).unwrap();
    }
    document.end_step();
    assert!(document.undo());
    assert_eq!(**document.text(), *SCENE);
}

#[test]
fn an_open_step_can_be_discarded() {
    let mut document = scene();
    document.edit("height", &[height(1.0)]).unwrap();
    document.discard_step("blow");
    assert!(document.text().contains("height"), "that was another step");
    document.end_step();
    document.edit("blow", &[height(2.0)]).unwrap();
    document.edit("blow", &[height(3.0)]).unwrap();
    document.discard_step("blow");
    assert!(document.text().contains("height = 1.0") && document.redo_label().is_none());
    document.discard_step("height");
    assert_eq!(document.undo_label(), Some("height"), "sealed steps stay");
}

#[test]
fn an_edit_after_undo_clears_the_redo_steps() {
    let mut document = scene();
    document.edit("height", &[height(1.0)]).unwrap();
    document.undo();
    document.edit("height", &[height(3.0)]).unwrap();
    assert!(!document.redo());
    assert!(document.text().contains("height = 3.0"));
}

#[test]
fn it_is_dirty_until_saved_or_undone() {
    let mut document = scene();
    assert!(!document.is_dirty());
    document.edit("height", &[height(1.0)]).unwrap();
    assert!(document.is_dirty());
    document.undo();
    assert!(!document.is_dirty());
}

#[test]
fn problems_have_lines_and_keep_the_last_valid_plan() {
    let mut document = scene();
    document.check_now(&assets());
    let good = document.plan().unwrap().clone();
    document.edit("height", &[height(-5.0)]).unwrap();
    assert!(!document.is_checked());
    document.check_now(&assets());
    let error = document.error().unwrap();
    assert!(matches!(error.problems[0].kind, ProblemKind::OutOfRange { value: -5.0, .. }));
    let line = error.position(error.problems[0].span.clone().unwrap().start).line;
    assert_eq!(document.text().lines().nth(line - 1), Some("height = -5.0"));
    assert!(Arc::ptr_eq(document.plan().unwrap(), &good));
    document.undo();
    document.check_now(&assets());
    assert!(document.error().is_none() && document.is_checked());
}

#[test]
fn stale_check_results_are_ignored() {
    let mut document = scene();
    let before = document.revision();
    document.edit("height", &[height(1.0)]).unwrap();
    document.set_check_result(before, check("fire.toml", SCENE, &assets()).map(|scene| scene.plan));
    assert!(document.plan().is_none() && !document.is_checked());
}

#[test]
fn invalid_toml_keeps_the_last_values_and_refuses_operations() {
    let mut document = scene();
    document.replace("typing", "bansho = ");
    assert!(document.syntax_problem().is_some());
    assert_eq!(document.phenomena().len(), 2);
    assert!(document.edit("height", &[height(1.0)]).is_err());
    assert_eq!(**document.text(), *"bansho = ");
    document.undo();
    assert!(document.syntax_problem().is_none());
}

#[test]
fn phenomena_are_listed_with_the_names_the_scene_gives_them() {
    let document = scene();
    let names: Vec<String> = document.phenomena().into_iter().map(|listed| listed.name).collect();
    assert_eq!(names, ["fire", "rain"]);
}

#[test]
fn added_and_duplicated_phenomena_get_free_names_and_stay_valid() {
    let mut document = scene();
    let add = operations::add(&document, "rain");
    document.edit("add", &add).unwrap();
    let copy = operations::duplicate(&document, &document.phenomena()[0]);
    document.edit("duplicate", &copy).unwrap();
    document.check_now(&assets());
    assert!(document.error().is_none(), "{}", document.error().unwrap());
    let names: Vec<String> = document.phenomena().into_iter().map(|listed| listed.name).collect();
    assert_eq!(names, ["fire", "fire 2", "rain", "rain 2"]);
    assert!(document.text().contains("# the only one"));
}

#[test]
fn solo_hides_all_others_and_shows_them_again() {
    let mut document = scene();
    let enabled = |document: &Document| document.phenomena().iter().map(|each| each.enabled).collect::<Vec<_>>();
    let rain = document.phenomena()[1].clone();
    let alone = operations::solo(&document, &rain);
    document.edit("solo", &alone).unwrap();
    assert_eq!(enabled(&document), [false, true]);
    let back = operations::solo(&document, &document.phenomena()[1]);
    document.edit("solo", &back).unwrap();
    assert_eq!(**document.text(), *SCENE, "the text is unchanged");
}

#[test]
fn saving_is_atomic_and_external_changes_are_detected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep").join("fire.toml");
    let mut document = scene();
    document.edit("height", &[height(1.0)]).unwrap();
    let text = document.text().clone();
    files::save(&mut document, &path, text).unwrap();
    assert!(!document.is_dirty());
    assert_eq!(fs::read_to_string(&path).unwrap(), **document.text());
    assert_eq!(files::external_change(&document, &path), ExternalChange::Unchanged);
    fs::write(&path, "bansho = 2\n").unwrap();
    assert_eq!(files::external_change(&document, &path), ExternalChange::Changed("bansho = 2\n".into()));
    fs::remove_file(&path).unwrap();
    assert_eq!(files::external_change(&document, &path), ExternalChange::Deleted);
    document.set_file_missing(true);
    assert!(document.is_dirty() && !document.is_modified(), "a scene without a file is unsaved");
    let text = document.text().clone();
    files::save(&mut document, &path, text).unwrap();
    assert!(!document.is_dirty());
    assert!(files::open(&folder.path().join("none.toml")).is_err());
    fs::write(&path, b"\xff\xfe").unwrap();
    assert!(matches!(files::external_change(&document, &path), ExternalChange::Unreadable(_)), "no UTF-8");
}

#[test]
fn rescue_copies_do_not_overwrite_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let rescued = |text: &str| files::save_rescue_copy(text, &folder.path().join("fire.toml")).unwrap();
    let names = ["x", "y", "x"].map(rescued).map(|path| path.file_name().unwrap().to_owned());
    assert_eq!(names, ["fire.rescued.toml", "fire.rescued 2.toml", "fire.rescued.toml"]);
    assert_eq!(fs::read_to_string(folder.path().join("fire.rescued.toml")).unwrap(), "x");
}

#[test]
fn recent_files_are_stored_newest_first() {
    let folder = tempfile::tempdir().unwrap();
    let list = folder.path().join("recent");
    let mut recent = RecentFiles::read(list.clone());
    for name in ["a.toml", "b.toml", "a.toml"] {
        recent.add(&folder.path().join(name)).unwrap();
    }
    assert_eq!(RecentFiles::read(list), recent);
    let names: Vec<_> = recent.paths().iter().map(|path| path.file_name().unwrap()).collect();
    assert_eq!(names, ["a.toml", "b.toml"]);
}

#[test]
fn unsaved_work_of_closed_studios_is_recoverable() {
    let folder = tempfile::tempdir().unwrap();
    let autosave = Autosave::begin(folder.path(), "studio").unwrap();
    let other = Autosave::begin(folder.path(), "studio").unwrap();
    let mut document = scene();
    document.edit("height", &[height(1.0)]).unwrap();
    autosave.save(&document, Some("scenes/fire.toml".as_ref())).unwrap();
    other.save(&scene(), None).unwrap();
    assert_eq!(autosave::recoverable(folder.path()), [], "both are running");
    drop(autosave);
    let found = autosave::recoverable(folder.path());
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].origin.as_str(), found[0].text.as_str()), ("scenes/fire.toml", &**document.text()));
    found[0].discard();
    assert_eq!(autosave::recoverable(folder.path()), []);
}

#[test]
fn closing_removes_the_autosave() {
    let folder = tempfile::tempdir().unwrap();
    let autosave = Autosave::begin(folder.path(), "studio").unwrap();
    let mut document = scene();
    document.edit("height", &[height(1.0)]).unwrap();
    autosave.save(&document, None).unwrap();
    document.undo();
    autosave.save(&document, None).unwrap();
    autosave.end();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
