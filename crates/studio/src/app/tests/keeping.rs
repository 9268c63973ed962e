//! Unsaved work is not lost: closing, crashes, panics, other programs, and dropped files.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use eframe::egui::{Key, Role, Theme, ViewportCommand, ViewportEvent, ViewportId, vec2};
use egui_kittest::{Harness, kittest::Queryable};

use super::{super::Studio, SCENE, Session, TIMEOUT, assets, choosing, drag, drawn, text, window};
use crate::{
    document::{Document, files::autosave::Autosave},
    player::{PolledPlayer, ThreadPlayer, tests::PanickingAssets},
};

/// A window with a scene in a file in `folder`.
fn window_on_file(folder: &Path, scene: &str) -> (Harness<'static, Studio>, PathBuf) {
    let path = folder.join("scene.toml");
    fs::write(&path, scene).unwrap();
    let mut harness = window("bansho = 2\n");
    choosing::open(&mut harness, &path);
    (harness, path)
}

fn edit(harness: &mut Harness<'_, Studio>, from: &str, to: &str) {
    let edited = text(harness).replace(from, to);
    harness.state_mut().session().document.replace("typing", &edited);
    drawn(harness);
}

/// Runs frames of the window until `done`.
fn until(harness: &mut Harness<'_, Studio>, what: &str, done: impl Fn(&mut Harness<'_, Studio>) -> bool) {
    let began = Instant::now();
    while !done(harness) {
        harness.step();
        thread::sleep(Duration::from_millis(10));
        assert!(began.elapsed() < TIMEOUT, "{what}");
    }
}

/// Requests the window to close, as its close button does.
fn close(harness: &mut Harness<'_, Studio>) {
    harness.input_mut().viewports.entry(ViewportId::ROOT).or_default().events.push(ViewportEvent::Close);
    harness.step();
    harness.input_mut().viewports.entry(ViewportId::ROOT).or_default().events.clear();
    harness.run_steps(2);
}

/// Whether the window closes.
fn closes(harness: &Harness<'_, Studio>) -> bool {
    let commands = harness.output().viewport_output.get(&ViewportId::ROOT).map(|output| output.commands.clone());
    commands.unwrap_or_default().contains(&ViewportCommand::Close)
}

#[test]
fn closing_with_unsaved_work_asks() {
    let folder = tempfile::tempdir().unwrap();
    let (mut harness, path) = window_on_file(folder.path(), SCENE);
    edit(&mut harness, "height = 0.9", "height = 1.7");
    close(&mut harness);
    harness.get_by_label("There is unsaved work.");
    harness.get_by_label("Cancel").click();
    harness.run_steps(3);
    assert!(harness.query_by_label("There is unsaved work.").is_none());
    assert_eq!(fs::read_to_string(&path).unwrap(), SCENE);
    close(&mut harness);
    harness.get_all_by_label("Save").last().expect("the answer").click();
    harness.run_steps(3);
    assert!(fs::read_to_string(&path).unwrap().contains("height = 1.7"));
    assert!(closes(&harness), "then it closes");
}

#[test]
fn unsaved_work_is_discarded_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let (mut harness, path) = window_on_file(folder.path(), SCENE);
    edit(&mut harness, "height = 0.9", "height = 1.7");
    close(&mut harness);
    assert!(!closes(&harness));
    choosing::confirm(&mut harness, "Leave it");
    assert!(closes(&harness));
    assert_eq!(fs::read_to_string(&path).unwrap(), SCENE);
}

#[test]
fn a_postponed_decision_about_an_external_change_stays_open() {
    let folder = tempfile::tempdir().unwrap();
    let (mut harness, path) = window_on_file(folder.path(), SCENE);
    thread::sleep(Duration::from_millis(300));
    edit(&mut harness, "0.9", "1.5");
    let theirs = SCENE.replace("height = 0.9", "height = 2.75");
    fs::write(&path, &theirs).unwrap();
    until(&mut harness, "a conflict is asked about", |harness| harness.query_by_label("Take theirs").is_some());
    choosing::confirm(&mut harness, "Decide later");
    assert!(text(&mut harness).contains("height = 1.5"));
    choosing::save(&mut harness);
    assert_eq!(fs::read_to_string(&path).unwrap(), theirs, "it asks again");
    choosing::confirm(&mut harness, "Save mine");
    assert!(fs::read_to_string(&path).unwrap().contains("height = 1.5"));
    assert!(!harness.state_mut().session().document.is_dirty());
}

#[test]
fn a_scene_whose_file_was_deleted_is_unsaved() {
    let folder = tempfile::tempdir().unwrap();
    let (mut harness, path) = window_on_file(folder.path(), SCENE);
    thread::sleep(Duration::from_millis(300));
    fs::remove_file(&path).unwrap();
    until(&mut harness, "it is told", |harness| harness.query_by_label_contains("the file is gone").is_some());
    assert!(harness.state_mut().session().document.is_dirty());
    choosing::save(&mut harness);
    assert_eq!(fs::read_to_string(&path).unwrap(), SCENE);
    assert!(!harness.state_mut().session().document.is_dirty());
}

#[test]
fn external_changes_are_loaded_or_asked_about() {
    let folder = tempfile::tempdir().unwrap();
    let (mut harness, path) = window_on_file(folder.path(), SCENE);
    // The file is watched from the first frame on.
    thread::sleep(Duration::from_millis(300));
    fs::write(&path, SCENE.replace("height = 0.9", "height = 1.25")).unwrap();
    until(&mut harness, "an outside edit is taken", |harness| text(harness).contains("height = 1.25"));
    assert!(!harness.state_mut().session().document.is_dirty());
    edit(&mut harness, "1.25", "1.5");
    fs::write(&path, SCENE.replace("height = 0.9", "height = 2.75")).unwrap();
    until(&mut harness, "a conflict is asked about", |harness| harness.query_by_label("Take theirs").is_some());
    assert!(text(&mut harness).contains("height = 1.5"));
    choosing::confirm(&mut harness, "Take theirs");
    assert!(text(&mut harness).contains("height = 2.75"));
    harness.state_mut().session().document.undo();
    assert!(text(&mut harness).contains("height = 1.5"), "and can be taken back");
}

/// A settings folder with the autosave of a crashed studio, whose fire has that height.
fn crashed(height: &str) -> tempfile::TempDir {
    let home = tempfile::tempdir().unwrap();
    let kept = Autosave::begin(&home.path().join("unsaved"), "studio").unwrap();
    let mut document = Document::new("fire.toml", SCENE);
    document.replace("typing", &SCENE.replace("height = 0.9", &format!("height = {height}")));
    kept.save(&document, None).unwrap();
    // Dropped without `end`, as by a crash.
    home
}

/// The text of all autosaves in `home`.
fn autosaves_in(home: &Path) -> String {
    let entries = fs::read_dir(home.join("unsaved")).unwrap().map(|entry| entry.unwrap().path());
    let scenes = entries.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
    scenes.map(|path| fs::read_to_string(path).unwrap()).collect()
}

#[test]
fn recovering_asks_about_unsaved_work_and_autosaves_what_it_opens() {
    let home = crashed("3.5");
    let mut harness = window_at_home(home.path());
    edit(&mut harness, "height = 0.9", "height = 1.25");
    let recover = |harness: &mut Harness<'_, Studio>| {
        for choice in ["Recover", "a scene never saved"] {
            harness.get_by_label(choice).click();
            harness.run_steps(3);
        }
    };
    recover(&mut harness);
    harness.get_by_label("There is unsaved work.");
    assert!(text(&mut harness).contains("height = 1.25"));
    choosing::confirm(&mut harness, "Cancel");
    assert!(text(&mut harness).contains("height = 1.25") && autosaves_in(home.path()).contains("height = 3.5"));
    recover(&mut harness);
    choosing::confirm(&mut harness, "Leave it");
    assert!(text(&mut harness).contains("height = 3.5"));
    assert_eq!(
        autosaves_in(home.path()).matches("height = 3.5").count(),
        1,
        "as this studio's own work, and only once"
    );
    assert!(harness.query_by_label("Recover").is_none());
}

#[test]
fn unwanted_recovered_work_is_discarded() {
    let home = crashed("3.5");
    let mut harness = window_at_home(home.path());
    harness.get_by_label("Recover").click();
    harness.run_steps(3);
    harness.get_by_label("Not wanted: a scene never saved").click();
    drawn(&mut harness);
    assert_eq!(text(&mut harness), SCENE);
    assert!(harness.query_by_label("Recover").is_none() && !autosaves_in(home.path()).contains("height"));
}

#[test]
fn no_repaint_is_requested_after_the_autosave() {
    let home = tempfile::tempdir().unwrap();
    let mut harness = window_at_home(home.path());
    edit(&mut harness, "height = 0.9", "height = 1.25");
    let rests = |harness: &Harness<'_, Studio>| {
        let delay = harness.output().viewport_output.get(&ViewportId::ROOT).map(|output| output.repaint_delay);
        delay == Some(Duration::MAX)
    };
    // It waits for the autosave, and then requests no repaint.
    let mut repaints = 0;
    while !rests(&harness) {
        harness.step();
        repaints += 1;
        assert!(repaints < 10_000, "it never rests");
    }
    assert!(autosaves_in(home.path()).contains("height = 1.25"));
    let kept: Vec<_> = fs::read_dir(home.path().join("unsaved")).unwrap().map(|entry| entry.unwrap().path()).collect();
    kept.iter().for_each(|path| fs::remove_file(path).unwrap());
    // Ten seconds pass with repaints.
    for _ in 0..600 {
        harness.step();
    }
    assert!(rests(&harness) && autosaves_in(home.path()).is_empty(), "what did not change is not written again");
    edit(&mut harness, "height = 1.25", "height = 1.75");
    for _ in 0..400 {
        harness.step();
    }
    assert!(autosaves_in(home.path()).contains("height = 1.75"));
}

#[test]
fn a_studio_without_autosave_warns_once() {
    let home = tempfile::tempdir().unwrap();
    // A file in place of the folder for autosaves.
    fs::write(home.path().join("unsaved"), "").unwrap();
    let mut harness = window_at_home(home.path());
    let told =
        |harness: &Harness<'_, Studio>| harness.query_by_label_contains("unsaved work is not kept here").is_some();
    assert!(!told(&harness), "there is none yet");
    edit(&mut harness, "height = 0.9", "height = 1.25");
    until(&mut harness, "it is told", |harness| told(harness));
    harness.get_by_label("Dismiss").click();
    edit(&mut harness, "height = 1.25", "height = 1.75");
    for _ in 0..600 {
        harness.step();
    }
    assert!(!told(&harness));
}

#[test]
fn work_of_a_crashed_studio_is_offered() {
    let home = crashed("3.5");
    let session = Session::new(Document::new("scene", "bansho = 2\n"), None, Box::<PolledPlayer>::default(), assets);
    let studio = Studio::new(session, Some(home.path().to_path_buf()));
    let mut harness =
        Harness::builder().with_max_steps(64).build_ui_state(|ui, studio: &mut Studio| studio.ui(ui), studio);
    drawn(&mut harness);
    harness.get_by_label("Recover").click();
    harness.run_steps(3);
    harness.get_by_label("a scene never saved").click();
    drawn(&mut harness);
    assert!(text(&mut harness).contains("height = 3.5"));
    assert!(harness.query_by_label("Recover").is_none());
}

#[test]
fn a_panic_is_reported_and_a_copy_of_the_scene_saved() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    fs::write(&path, SCENE).unwrap();
    let player = ThreadPlayer::start(|| {}).unwrap();
    let session =
        Session::new(Document::new("scene.toml", SCENE), Some(path), Box::new(player), |_| Arc::new(PanickingAssets));
    let mut harness = Harness::builder()
        .with_max_steps(64)
        .build_ui_state(|ui, studio: &mut Studio| studio.ui(ui), Studio::new(session, None));
    drawn(&mut harness);
    edit(&mut harness, "[[light]]", "[plate]\nimage = \"plate.png\"\n[[light]]");
    until(&mut harness, "the panic is told", |harness| {
        harness.query_by_label_contains("a phenomenon panicked, which is a bug in it: broken on purpose").is_some()
    });
    let rescued = fs::read_to_string(folder.path().join("scene.rescued.toml")).unwrap();
    assert_eq!(rescued, text(&mut harness));
    assert!(harness.state_mut().session().picture().is_some(), "the last good picture stays");
    harness.get_by_label("Play").click();
    harness.run_steps(5);
    // While playing, drawing does not end.
    let number = |harness: &mut Harness<'_, Studio>| harness.state_mut().session().picture().map(|(own, _)| own.number);
    let (last, mended) = (number(&mut harness), text(&mut harness).replace("[plate]\nimage = \"plate.png\"\n", ""));
    harness.state_mut().session().document.replace("typing", &mended);
    until(&mut harness, "it goes on", |harness| number(harness) != last);
}

#[test]
fn a_shot_is_rendered_with_progress() {
    let folder = tempfile::tempdir().unwrap();
    let (mut harness, _) = window_on_file(folder.path(), SCENE);
    harness.get_by_label("File").click();
    harness.run_steps(3);
    harness.get_by_label("Render shot").click();
    harness.step();
    until(&mut harness, "the shot is written", |harness| harness.query_by_label_contains("written: ").is_some());
    let frames = fs::read_dir(folder.path().join("out/scene")).unwrap().count();
    assert_eq!(frames, 10);
}

#[test]
fn rendering_a_shot_is_stopped_and_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let (mut harness, _) = window_on_file(folder.path(), &SCENE.replace("frames = 10", "frames = 100000"));
    let render = |harness: &mut Harness<'_, Studio>| {
        harness.get_by_label("File").click();
        harness.run_steps(3);
        harness.get_by_label("Render shot").click();
        harness.step();
    };
    render(&mut harness);
    harness.key_press(Key::F12);
    harness.run_steps(2);
    harness.get_by_label_contains("pictures are being rendered already");
    close(&mut harness);
    assert!(!closes(&harness), "closing asks");
    harness.get_by_label_contains("Pictures are being rendered.");
    choosing::confirm(&mut harness, "Cancel");
    until(&mut harness, "progress is told", |harness| {
        let told = harness.query_by_label_contains("rendering: ").and_then(|told| told.value());
        told.is_some_and(|told| told.ends_with("of 100000") && !told.contains(": 0 "))
    });
    harness.get_by_label("Stop rendering").click();
    until(&mut harness, "it stops", |harness| harness.query_by_label("Stop rendering").is_none());
    let out = folder.path().join("out/scene");
    let frames = || fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().path());
    let stopped = frames().count();
    assert!((1..100_000).contains(&stopped), "{stopped}");
    for frame in frames() {
        let bytes = fs::read(&frame).unwrap();
        assert!(bytes.ends_with(b"IEND\xaeB\x60\x82"), "{} is whole", frame.display());
    }
    edit(&mut harness, "100000", &(stopped + 2).to_string());
    let first = frames().min().unwrap();
    let written = fs::metadata(&first).unwrap().modified().unwrap();
    render(&mut harness);
    until(&mut harness, "the rest is written", |harness| harness.query_by_label_contains("written: ").is_some());
    assert_eq!(frames().count(), stopped + 2);
    assert_eq!(fs::metadata(&first).unwrap().modified().unwrap(), written, "whole frames are kept");
}

/// A window with its settings in `home`.
fn window_at_home(home: &Path) -> Harness<'static, Studio> {
    let session = Session::new(Document::new("fire.toml", SCENE), None, Box::<PolledPlayer>::default(), assets);
    let studio = Studio::new(session, Some(home.to_path_buf()));
    let builder = Harness::builder().with_size(vec2(1200.0, 800.0)).with_max_steps(64);
    let mut harness = builder.build_ui_state(|ui, studio: &mut Studio| studio.ui(ui), studio);
    drawn(&mut harness);
    harness
}

#[test]
fn layout_theme_and_recent_files_are_restored() {
    let (home, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let path = folder.path().join("kept.toml");
    let width = |harness: &Harness<'_, Studio>| harness.get_by_label("Viewport").rect().width();
    let wide = {
        let mut harness = window_at_home(home.path());
        choosing::save(&mut harness);
        choosing::answer(&mut harness, &path, "Save");
        harness.get_by_label("View").click();
        harness.run_steps(3);
        harness.get_by_label("Light").click();
        harness.run_steps(3);
        harness.key_press(Key::F2);
        harness.run_steps(3);
        // The border between the scene's panel and the picture.
        let before = width(&harness);
        let border = harness.get_by_label("Viewport").rect().left_center() - vec2(8.0, 0.0);
        drag(&mut harness, border, vec2(60.0, 0.0));
        let wide = width(&harness);
        assert!(wide < before - 40.0, "{before} {wide}");
        harness.state_mut().on_exit();
        wide
    };
    let mut again = window_at_home(home.path());
    assert_eq!(again.ctx.theme(), Theme::Light);
    again.get_by_role(Role::MultilineTextInput);
    assert!((width(&again) - wide).abs() < 3.0, "{} {wide}", width(&again));
    again.get_by_label("File").click();
    again.run_steps(3);
    again.get_by_label("Recent").click();
    again.run_steps(3);
    again.get_by_label(&path.display().to_string()).click();
    drawn(&mut again);
    assert_eq!(again.state_mut().session().path.as_ref(), Some(&path));
    assert_eq!(text(&mut again), SCENE);
}
