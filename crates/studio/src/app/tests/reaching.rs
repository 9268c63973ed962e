//! New scenes, searching parameters, renaming, curves on the picture, and showing only the picture.

use eframe::egui::{Event, Key, Role, vec2};
use egui_kittest::kittest::Queryable;

use super::{SCENE, drag, drawn, text, window};

#[test]
fn a_new_scene_is_made_from_its_template_and_asks_about_unsaved_work() {
    let mut harness = window(SCENE);
    for (name, begins) in [("Rain", "[[rain]]"), ("Nothing", "bansho = 2")] {
        for choice in ["File", "New", name] {
            harness.get_by_label(choice).click();
            harness.run_steps(3);
        }
        assert!(text(&mut harness).contains(begins), "{}", text(&mut harness));
    }
    assert!(harness.query_by_label("There is unsaved work.").is_none());
    harness.state_mut().session().document.replace("typing", SCENE);
    for choice in ["File", "New", "Flame sheet"] {
        harness.get_by_label(choice).click();
        harness.run_steps(3);
    }
    harness.get_by_label("There is unsaved work.");
    assert_eq!(text(&mut harness), SCENE);
}

#[test]
fn parameters_are_found_by_name_and_description() {
    let mut harness = window(SCENE);
    assert!(harness.query_by_label("tongue width").is_none(), "its section is closed");
    let find = |harness: &mut egui_kittest::Harness<'_, super::Studio>, words: &str| {
        harness.get_by_role_and_label(Role::TextInput, "Find").focus();
        harness.run_steps(2);
        harness.key_press_modifiers(eframe::egui::Modifiers::COMMAND, Key::A);
        harness.event(Event::Text(words.to_owned()));
        harness.run_steps(20);
    };
    find(&mut harness, "Tongue width");
    harness.get_by_role_and_label(Role::SpinButton, "tongue width");
    assert!(harness.query_by_role_and_label(Role::SpinButton, "height").is_none());
    find(&mut harness, "sheet heights per second");
    harness.get_by_role_and_label(Role::SpinButton, "speed");
    find(&mut harness, "no such thing");
    harness.get_by_label("Nothing here is called so.");
}

#[test]
fn a_phenomenon_is_renamed() {
    let mut harness = window(SCENE);
    harness.get_by_role_and_label(Role::Button, "fire").click_secondary();
    harness.run_steps(3);
    harness.get_by_role_and_label(Role::TextInput, "Name").focus();
    harness.run_steps(2);
    harness.key_press_modifiers(eframe::egui::Modifiers::COMMAND, Key::A);
    harness.event(Event::Text("hearth".to_owned()));
    harness.run_steps(2);
    assert_eq!(text(&mut harness), SCENE, "not letter by letter");
    harness.key_press(Key::Enter);
    drawn(&mut harness);
    let edited = text(&mut harness);
    assert!(edited.contains("name = \"hearth\" # the only one"), "{edited}");
    assert!(harness.state_mut().session().document.error().is_none());
}

#[test]
fn curves_are_edited_on_top_of_the_picture() {
    let mut harness = window(SCENE);
    harness.get_by_label("Curves").click();
    harness.run_steps(6);
    let viewport = harness.get_by_label("Viewport").rect();
    let chart = harness.get_by_role_and_label(Role::Canvas, "V(w)  threshold").rect();
    assert!(viewport.contains_rect(chart), "{viewport} {chart}");
    let before = harness.state_mut().session().picture().map(|(picture, _)| picture.pixels.clone());
    let chart = chart.shrink(4.0);
    // The point (0.6, 0.55). The chart's maximum is a quarter above the highest point, but within the bounds.
    let at = chart.left_bottom() + vec2(0.6 * chart.width(), -0.55 * chart.height());
    drag(&mut harness, at, vec2(0.0, 0.3 * chart.height()));
    assert!(text(&mut harness).contains("threshold = [["), "{}", text(&mut harness));
    let after = harness.state_mut().session().picture().map(|(picture, _)| picture.pixels.clone());
    assert!(before != after, "the flame follows");
    harness.get_by_label("light 1").click();
    harness.run_steps(3);
    assert!(harness.query_by_label("Curves").is_none(), "a lamp has none");
}

#[test]
fn a_key_shows_only_the_picture() {
    let mut harness = window(SCENE);
    let width = harness.get_by_label("Viewport").rect().width();
    harness.key_press(Key::F);
    drawn(&mut harness);
    assert!(harness.get_by_label("Viewport").rect().width() > width + 400.0);
    assert!(harness.query_by_label("Scene").is_none());
    harness.key_press(Key::F);
    drawn(&mut harness);
    harness.get_by_label("Scene");
}
