//! The window, driven through the accessible names of its widgets, as by a screen reader.

mod aurora;
mod choosing;
mod following;
mod gestures;
mod keeping;
mod pictures;
mod practised;
mod reaching;
mod values;

use std::{
    path::Path,
    sync::Arc,
    time::{Duration, Instant},
};

use bansho::{Assets, base::math::DVec3, media::assets::FileAssets};

use super::{Session, Studio, shortcuts::SHORTCUTS};
use crate::{document::Document, player::PolledPlayer};
use eframe::egui::{self, Key, Modifiers, Role, vec2};
use egui_kittest::{Harness, HarnessBuilder, kittest::Queryable};

const SCENE: &str = "\
# A fire.
bansho = 2
[picture]
size = [64, 36]
frames = 10
[[flame_sheet]]
name = \"fire\" # the only one
height = 0.9
[[light]]
position = [0.0, 1.0, 0.0]
";

/// Timeout, also for a busy machine.
const TIMEOUT: Duration = Duration::from_secs(300);

fn assets(folder: &Path) -> Arc<dyn Assets> {
    Arc::new(FileAssets::new(folder))
}

fn window(text: &str) -> Harness<'static, Studio> {
    window_by(Harness::builder().with_size(vec2(1400.0, 900.0)), text)
}

fn window_by(builder: HarnessBuilder<Studio>, text: &str) -> Harness<'static, Studio> {
    let session = Session::new(Document::new("fire.toml", text), None, Box::<PolledPlayer>::default(), assets);
    let builder = builder.with_max_steps(64);
    let mut harness = builder.build_ui_state(|ui, studio: &mut Studio| studio.ui(ui), Studio::new(session, None));
    drawn(&mut harness);
    harness
}

/// Runs frames of the window until its picture is drawn.
fn drawn(harness: &mut Harness<'_, Studio>) {
    let began = Instant::now();
    harness.run_steps(3);
    while harness.state_mut().session().is_busy() {
        harness.step();
        assert!(began.elapsed() < TIMEOUT, "no picture");
    }
    harness.run_steps(2);
}

/// A small scene with an aurora of few particles; `rest` continues its table.
fn sky(frames: u32, rest: &str) -> String {
    format!(
        "bansho = 2\n[picture]\nsize = [64, 36]\nframes = {frames}\n[[aurora]]\npreroll_s = 0.0\n\
         particles = {{ count = 300 }} # few, to be quick\nfield = {{ cells = 31 }}\n{rest}"
    )
}

fn text(harness: &mut Harness<'_, Studio>) -> String {
    harness.state_mut().session().document.text().to_string()
}

#[test]
fn a_scene_is_shown_and_then_no_repaint_is_requested() {
    let mut harness = window(SCENE);
    let (picture, _) = harness.state_mut().session().picture().expect("a picture");
    assert_eq!(picture.size, [64, 36]);
    assert!(picture.pixels.iter().any(|pixel| pixel[0] > 100), "the fire is bright");
    harness.try_run().expect("nothing moves any more, so nothing is drawn any more");
    harness.get_by_label("64 × 36 of 64 × 36");
}

#[test]
fn parameters_are_edited_by_their_names_and_comments_stay() {
    let mut harness = window(SCENE);
    harness.get_by_role_and_label(Role::Button, "fire").click();
    harness.run_steps(3);
    let height = harness.get_by_role_and_label(Role::SpinButton, "height");
    assert_eq!(height.value().as_deref(), Some("0.900 m"));
    height.set_value_accesskit(1.5);
    drawn(&mut harness);
    let edited = text(&mut harness);
    assert!(edited.contains("height = 1.5") && edited.contains("# the only one"), "{edited}");
    harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    drawn(&mut harness);
    assert_eq!(text(&mut harness), SCENE);
}

#[test]
fn phenomena_are_hidden_and_shown_alone() {
    let mut harness = window(&format!("{SCENE}[[rain]]\n"));
    harness.get_by_label("Draw rain").click();
    drawn(&mut harness);
    assert!(text(&mut harness).contains("[[rain]]\nenabled = false"));
    harness.get_by_label("Solo rain").click();
    drawn(&mut harness);
    let edited = text(&mut harness);
    assert!(!edited.contains("[[rain]]\nenabled") && edited.contains("enabled = false"), "{edited}");
}

#[test]
fn time_is_stepped_played_and_stopped() {
    let mut harness = window(SCENE);
    harness.get_by_label("Frame on").click();
    drawn(&mut harness);
    assert_eq!(harness.state_mut().session().transport.number(), 1);
    harness.get_by_label("Play").click();
    harness.run_steps(40);
    let session = harness.state_mut().session();
    assert!(session.transport.is_playing() && session.transport.number() != 1);
    harness.get_by_label("Pause").click();
    drawn(&mut harness);
    let number = harness.state_mut().session().transport.number();
    let shown = harness.state_mut().session().picture().map(|(picture, _)| picture.number);
    assert_eq!(shown, Some(number));
}

#[test]
fn time_is_scrubbed_and_a_range_is_looped() {
    let mut harness = window(SCENE);
    let bar = harness.get_by_label("Timeline").rect();
    drag(&mut harness, bar.left_center() + vec2(8.0, 0.0), vec2(0.5 * bar.width() - 8.0, 0.0));
    assert!((4..=5).contains(&harness.state_mut().session().transport.number()));
    for (label, frame) in [("to", 4.0), ("Loop", 2.0)] {
        harness.get_by_role_and_label(Role::SpinButton, label).set_value_accesskit(frame);
        harness.run_steps(3);
    }
    assert_eq!(harness.state_mut().session().transport.range(), 2..=4);
    harness.get_by_label("Play").click();
    harness.step();
    let mut seen = std::collections::BTreeSet::new();
    for _ in 0..40 {
        harness.step();
        seen.insert(harness.state_mut().session().transport.number());
    }
    assert!(seen.len() > 1 && seen.iter().all(|number| (2..=4).contains(number)), "{seen:?}");
    harness.get_by_label_contains("pictures/s");
}

#[test]
fn a_picture_larger_than_the_viewport_is_a_preview() {
    let mut harness = window(&SCENE.replace("[64, 36]", "[1920, 1080]"));
    let (picture, _) = harness.state_mut().session().picture().expect("a picture");
    let [width, height] = picture.size;
    assert!(width < 1000, "{width}");
    harness.get_by_label(&format!("preview {width} × {height} of 1920 × 1080"));
}

#[test]
fn exposure_is_set_and_made_automatic_again() {
    let mut harness = window(SCENE);
    harness.get_by_role_and_label(Role::SpinButton, "Exposure").set_value_accesskit(7.5);
    drawn(&mut harness);
    assert!(text(&mut harness).contains("exposure_ev100 = 7.5"), "{}", text(&mut harness));
    harness.get_by_label("Auto").click();
    drawn(&mut harness);
    assert!(text(&mut harness).contains("exposure_ev100 = \"auto\""), "{}", text(&mut harness));
}

#[test]
fn phenomena_are_added_copied_and_removed() {
    let mut harness = window(SCENE);
    harness.get_by_label("Add").click();
    harness.run_steps(3);
    harness.get_by_label("rain").click();
    drawn(&mut harness);
    assert!(text(&mut harness).contains("\n[[rain]]\n"), "{}", text(&mut harness));
    for choice in ["Duplicate", "Remove"] {
        harness.get_by_role_and_label(Role::Button, "fire").click_secondary();
        harness.run_steps(3);
        harness.get_by_label(choice).click();
        drawn(&mut harness);
    }
    let edited = text(&mut harness);
    assert!(edited.contains("name = \"fire 2\"") && !edited.contains("name = \"fire\""), "{edited}");
    assert!(harness.state_mut().session().document.error().is_none());
}

#[test]
fn problems_show_their_lines_and_link_to_the_text() {
    let mut harness = window(SCENE);
    let faulty = SCENE.replace("height", "heigth");
    harness.state_mut().session().document.replace("typing", &faulty);
    drawn(&mut harness);
    assert!(harness.state_mut().session().picture().is_some(), "the last good picture stays");
    let fault = harness.get_by_label_contains("line 8: flame_sheet.0: unknown key `heigth`");
    fault.click();
    harness.run_steps(4);
    let editor = harness.get_by_role(Role::MultilineTextInput);
    assert!(editor.is_focused());
}

#[test]
fn dragging_the_picture_turns_the_camera() {
    let mut harness = window(SCENE);
    let middle = harness.get_by_label("Viewport").rect().center();
    drag(&mut harness, middle, vec2(120.0, 0.0));
    let edited = text(&mut harness);
    assert!(edited.contains("[camera]\nposition = ["), "{edited}");
    assert_eq!(harness.state_mut().session().document.undo_label(), Some("camera"));
    harness.state_mut().session().document.undo();
    assert_eq!(text(&mut harness), SCENE, "a drag is one step");
}

/// Starts a wind drag in the middle of the viewport, and returns its start.
fn blow(harness: &mut Harness<'_, Studio>) -> egui::Pos2 {
    harness.get_by_label("Blow").click();
    harness.run_steps(2);
    let middle = harness.get_by_label("Viewport").rect().center();
    press(harness, middle);
    harness.hover_at(middle + vec2(100.0, 0.0));
    harness.run_steps(3);
    assert!(text(harness).contains("velocity = ["));
    middle
}

#[test]
fn wind_drags_are_temporary_and_recorded_as_keyframes() {
    let mut harness = window(SCENE);
    let middle = blow(&mut harness);
    release(&mut harness, middle + vec2(100.0, 0.0));
    assert_eq!(text(&mut harness), SCENE, "the text is unchanged");

    let longer = SCENE.replace("frames = 10", "frames = 200");
    let mut harness = window(&longer);
    for choice in ["Blow", "Record"] {
        harness.get_by_label(choice).click();
        harness.run_steps(2);
    }
    drag_for_a_second(&mut harness, middle);
    let recorded = text(&mut harness);
    assert!(recorded.contains("velocity = { keys = [[0.0, [0.0, 0.0, 0.0]]"), "{recorded}");
    assert!(recorded.matches("], [").count() > 2, "{recorded}");
    harness.state_mut().session().document.undo();
    assert_eq!(text(&mut harness), longer, "a recording is one step");
}

#[test]
fn lamps_are_dragged() {
    let mut harness = window(SCENE);
    harness.get_by_label("Place").click();
    harness.run_steps(2);
    let lamp = seen_at(&mut harness, DVec3::Y);
    drag(&mut harness, lamp, vec2(80.0, 0.0));
    let edited = text(&mut harness);
    let plan = harness.state_mut().session().plan().unwrap().clone();
    let light: &bansho::LightParameters = plan.scene().tables.get().unwrap();
    let [x, y, z] = light.position.at(0.0);
    assert!(x > 0.1 && (y - 1.0).abs() < 0.02 && z.abs() < 0.02, "to the right, at its depth: {edited}");
}

#[test]
fn a_missing_plate_is_reported_and_relinked() {
    let folder = tempfile::tempdir().unwrap();
    let plate = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/plates/checkerboard.png");
    std::fs::copy(plate, folder.path().join("board.png")).unwrap();
    let mut harness = window(&format!("{SCENE}[plate]\nimage = \"gone.png\" # the ground\n"));
    harness.get_by_label_contains("gone.png: no such file");
    harness.get_by_label("Relink").click();
    harness.run_steps(3);
    let board = folder.path().join("board.png");
    choosing::answer(&mut harness, &board, "Relink");
    let named = format!("image = \"{}\" # the ground", board.display());
    assert!(text(&mut harness).contains(&named), "{}", text(&mut harness));
    assert!(harness.state_mut().session().document.error().is_none(), "a scene without a file finds it too");
}

#[test]
fn burners_are_dragged() {
    let scene = "bansho = 2\n[picture]\nsize = [64, 36]\nframes = 2\n\
        [[flame_particles]]\nparticles = 50\nposition = [0.0, 0.5, 0.0]\n[[flame_particles.burners]]\nposition = [0.5, 0.0, 0.0] # aside\n";
    let mut harness = window(scene);
    harness.get_by_label("Place").click();
    harness.run_steps(2);
    let burner = seen_at(&mut harness, DVec3::new(0.5, 0.5, 0.0));
    drag(&mut harness, burner, vec2(60.0, 0.0));
    let edited = text(&mut harness);
    assert!(edited.contains("# aside") && !edited.contains("[0.5, 0.0, 0.0]"), "{edited}");
    assert!(edited.contains("position = [0.0, 0.5, 0.0]"), "the flame itself stays: {edited}");
}

/// The position on the screen of a point of the scene in the first frame.
fn seen_at(harness: &mut Harness<'_, Studio>, point: DVec3) -> egui::Pos2 {
    let plan = harness.state_mut().session().plan().cloned().unwrap();
    let [width, height] = plan.size().map(|side| side as f32);
    let seen = plan.scene().camera.at(0.0, plan.size()).project(point).unwrap().pixel;
    let viewport = harness.get_by_label("Viewport").rect();
    let scale = (viewport.width() / width).min(viewport.height() / height);
    viewport.center() + vec2(seen.x as f32 - 0.5 * width, seen.y as f32 - 0.5 * height) * scale
}

#[test]
fn a_question_mark_lists_the_shortcuts() {
    let mut harness = window(SCENE);
    assert!(harness.query_by_label("Play or pause").is_none());
    harness.key_press(Key::Questionmark);
    harness.run_steps(3);
    for shortcut in &SHORTCUTS {
        assert!(harness.query_all_by_label(shortcut.name).count() >= 1, "{}", shortcut.name);
    }
}

fn press(harness: &mut Harness<'_, Studio>, at: egui::Pos2) {
    harness.hover_at(at);
    harness.step();
    harness.drag_at(at);
    harness.step();
}

fn release(harness: &mut Harness<'_, Studio>, at: egui::Pos2) {
    harness.drop_at(at);
    drawn(harness);
}

fn drag(harness: &mut Harness<'_, Studio>, from: egui::Pos2, by: egui::Vec2) {
    press(harness, from);
    for step in 1..=4 {
        harness.hover_at(from + by * (step as f32 / 4.0));
        harness.step();
    }
    release(harness, from + by);
}

/// Drags to the right for thirty frames. Playback runs during the drag and stops with it.
fn drag_for_a_second(harness: &mut Harness<'_, Studio>, from: egui::Pos2) {
    press(harness, from);
    for step in 1..30 {
        harness.hover_at(from + vec2(3.0 * step as f32, 0.0));
        harness.step();
    }
    assert!(harness.state_mut().session().transport.is_playing(), "time passes");
    release(harness, from + vec2(90.0, 0.0));
    assert!(!harness.state_mut().session().transport.is_playing());
}
