//! The aurora editor: from an empty sky to a saved scene with a split.

use eframe::egui::{Event, Modifiers, Pos2, Rect, Role, pos2, vec2};
use egui_kittest::{Harness, kittest::Queryable};

use super::{super::Studio, choosing, drag, drawn, press, release, sky, text, window};
use crate::editors::aurora::document::{AuroraDrawing, Factor};

fn plane(harness: &Harness<'_, Studio>, name: &str) -> Rect {
    harness.get_by_label(name).rect()
}

/// A position on the plane, as fractions of its size from the north-west corner.
fn at(plane: Rect, x: f32, y: f32) -> Pos2 {
    pos2(plane.left() + x * plane.width(), plane.top() + y * plane.height())
}

/// Draws a line through positions on the target plane, as fractions of its size.
fn stroke(harness: &mut Harness<'_, Studio>, line: &[[f32; 2]]) {
    let plane = plane(harness, "Aurora target");
    let place = |fraction: &[f32; 2]| at(plane, fraction[0], fraction[1]);
    press(harness, place(&line[0]));
    for pair in line.windows(2) {
        for step in 1..=6 {
            harness.hover_at(place(&pair[0]).lerp(place(&pair[1]), step as f32 / 6.0));
            harness.step();
        }
    }
    release(harness, place(&line[line.len() - 1]));
}

fn click(harness: &mut Harness<'_, Studio>, at: Pos2) {
    press(harness, at);
    release(harness, at);
}

fn choose(harness: &mut Harness<'_, Studio>, button: &str) {
    harness.get_by_label(button).click();
    drawn(harness);
}

fn drawing(harness: &mut Harness<'_, Studio>) -> AuroraDrawing {
    let session = harness.state_mut().session();
    AuroraDrawing::read(session.document.values(), 0, session.assets()).unwrap()
}

#[test]
fn an_s_shape_is_drawn_split_played_saved_and_reopened() {
    let mut harness = window(&sky(4, ""));
    stroke(&mut harness, &[[0.1, 0.5], [0.5, 0.45], [0.9, 0.5]]);
    assert_eq!(drawing(&mut harness).lines(0).len(), 1);
    choose(&mut harness, "Add shape");
    harness.get_by_label("next stroke: sheet 1 of 1");
    stroke(&mut harness, &[[0.1, 0.6], [0.7, 0.6], [0.7, 0.5], [0.3, 0.5], [0.3, 0.4], [0.9, 0.4]]);
    choose(&mut harness, "Add shape");
    choose(&mut harness, "Split");
    let source = plane(&harness, "Aurora source");
    click(&mut harness, at(source, 0.5, 0.5));
    let split = drawing(&mut harness);
    assert_eq!([split.lines(1).len(), split.lines(2).len()], [1, 2], "{}", text(&mut harness));
    harness.get_by_label("next stroke: sheet 1 of 2");
    stroke(&mut harness, &[[0.1, 0.65], [0.6, 0.65], [0.7, 0.55]]);
    harness.get_by_label("next stroke: sheet 2 of 2");
    stroke(&mut harness, &[[0.3, 0.42], [0.4, 0.35], [0.9, 0.35]]);

    harness.get_by_label("Play").click();
    harness.run_steps(12);
    assert!(harness.state_mut().session().transport.is_playing());
    harness.get_by_label("Pause").click();
    drawn(&mut harness);

    let edited = text(&mut harness);
    assert!(edited.contains("# few, to be quick") && edited.matches("[[aurora.shapes]]").count() == 3, "{edited}");
    assert!(edited.contains("split = [{ sheet = 1, length_fraction = 0."), "{edited}");
    assert!(harness.state_mut().session().document.error().is_none());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    choosing::save(&mut harness);
    choosing::answer(&mut harness, &path, "Save");
    assert!(!harness.state_mut().session().document.is_dirty());

    let mut again = window("bansho = 2\n[[aurora]]\n");
    choosing::open(&mut again, &path);
    assert_eq!(drawing(&mut again).lines(2).len(), 2);
    assert_eq!(text(&mut again), edited);
}

#[test]
fn invalid_edits_are_refused_with_the_reason() {
    let mut harness = window(&sky(4, ""));
    stroke(&mut harness, &[[0.1, 0.5], [0.9, 0.5]]);
    let before = text(&mut harness);
    stroke(&mut harness, &[[0.5, 0.2], [0.5, 0.8]]);
    assert_eq!(text(&mut harness), before);
    let told = harness.get_by_label_contains("sheet 2 meets sheet 1").rect();
    let pointer = at(plane(&harness, "Aurora target"), 0.5, 0.8);
    let off = told.distance_to_pos(pointer);
    assert!(off < 60.0, "at the pointer: {off}");
    stroke(&mut harness, &[[0.3, 0.3], [0.6, 0.3]]);
    assert!(harness.query_by_label_contains("meets").is_none(), "gone with the next stroke");
    choose(&mut harness, "Split");
    let target = plane(&harness, "Aurora target");
    click(&mut harness, at(target, 0.5, 0.5));
    harness.get_by_label_contains("the first shape comes from nothing");
    choose(&mut harness, "Add shape");
    choose(&mut harness, "Merge");
    let source = plane(&harness, "Aurora source");
    click(&mut harness, at(source, 0.5, 0.5));
    harness.get_by_label_contains("sheets never branch");
    click(&mut harness, at(source, 0.9, 0.5));
    click(&mut harness, at(source, 0.6, 0.3));
    assert_eq!(drawing(&mut harness).lines(1).len(), 1, "{}", text(&mut harness));
    choose(&mut harness, "Merge");
    click(&mut harness, at(source, 0.1, 0.5));
    click(&mut harness, at(source, 0.3, 0.3));
    harness.get_by_label_contains("to a ring");
}

#[test]
fn points_are_moved_smoothed_brightened_and_erased() {
    let mut harness = window(&sky(4, ""));
    stroke(&mut harness, &[[0.1, 0.5], [0.5, 0.3], [0.9, 0.5]]);
    let peak = |harness: &mut Harness<'_, Studio>| {
        drawing(harness).points(0, 0).iter().map(|point| point.y).fold(f64::INFINITY, f64::min)
    };
    let drawn_peak = peak(&mut harness);
    choose(&mut harness, "Move");
    let target = plane(&harness, "Aurora target");
    let top = at(target, 0.5, 0.3);
    press(&mut harness, top);
    harness.hover_at(top - vec2(0.0, 20.0));
    harness.step();
    release(&mut harness, top - vec2(0.0, 40.0));
    let moved_peak = peak(&mut harness);
    assert!(moved_peak < drawn_peak - 20.0, "{drawn_peak} {moved_peak}");
    choose(&mut harness, "Smooth");
    let over = top - vec2(0.0, 40.0);
    press(&mut harness, over);
    for step in 0..6 {
        harness.hover_at(over + vec2(2.0 * step as f32, 0.0));
        harness.step();
    }
    release(&mut harness, over);
    assert!(peak(&mut harness) > moved_peak + 5.0);
    choose(&mut harness, "Brightness");
    let end = at(target, 0.12, 0.49);
    press(&mut harness, end);
    for step in 0..10 {
        harness.hover_at(end + vec2(if step % 2 == 0 { 8.0 } else { 0.0 }, 0.0));
        harness.step();
    }
    release(&mut harness, end);
    assert!(text(&mut harness).contains("flux_factor = [["), "{}", text(&mut harness));
    choose(&mut harness, "Erase");
    let end = at(target, 0.9, 0.5);
    press(&mut harness, end);
    harness.hover_at(end - vec2(3.0, 0.0));
    harness.step();
    release(&mut harness, end);
    let points = drawing(&mut harness).points(0, 0);
    assert!(points[points.len() - 1].x < 230.0, "{points:?}");
}

#[test]
fn sheets_and_points_are_linked_by_dragging() {
    let mut harness = window(&sky(4, ""));
    stroke(&mut harness, &[[0.1, 0.4], [0.9, 0.4]]);
    stroke(&mut harness, &[[0.1, 0.6], [0.9, 0.6]]);
    choose(&mut harness, "Add shape");
    choose(&mut harness, "Link");
    let [source, target] = ["Aurora source", "Aurora target"].map(|name| plane(&harness, name));
    let link = |harness: &mut Harness<'_, Studio>, from: Pos2, to: Pos2| drag(harness, from, to - from);
    link(&mut harness, at(source, 0.5, 0.4), at(target, 0.5, 0.6));
    assert!(text(&mut harness).contains("link = [{ from = 1, to = 2 }]"), "{}", text(&mut harness));
    link(&mut harness, at(source, 0.5, 0.4), at(target, 0.5, 0.4));
    link(&mut harness, at(target, 0.3, 0.4), at(target, 0.5, 0.4));
    let linked = drawing(&mut harness).linked_points(1);
    assert_eq!(linked.len(), 1, "{}", text(&mut harness));
    assert!(text(&mut harness).contains("to = 1, from_length_fraction = 0.2"), "{}", text(&mut harness));
    click(&mut harness, at(target, 0.5, 0.4));
    assert!(drawing(&mut harness).linked_points(1).is_empty(), "{}", text(&mut harness));
}

#[test]
fn energy_is_raised_and_with_shift_lowered() {
    let mut harness = window(&sky(4, ""));
    stroke(&mut harness, &[[0.1, 0.5], [0.9, 0.5]]);
    choose(&mut harness, "Ray energy");
    let from = at(plane(&harness, "Aurora target"), 0.5, 0.5);
    let mut brushed = || {
        press(&mut harness, from);
        for step in 0..10 {
            harness.hover_at(from + vec2(if step % 2 == 0 { 8.0 } else { 0.0 }, 0.0));
            harness.step();
        }
        release(&mut harness, from);
        harness.event(Event::ModifiersChanged(Modifiers::SHIFT));
        let energy = drawing(&mut harness).factors(0, 0, Factor::Energy);
        energy.into_iter().fold(0.0, f64::max)
    };
    let more = brushed();
    assert!(more > 1.1, "{more}");
    let less = brushed();
    assert!(less < more - 0.05, "{more} {less}");
}

#[test]
fn shapes_are_created_from_templates_retimed_and_removed() {
    let mut harness = window(&sky(60, ""));
    choose(&mut harness, "Template");
    choose(&mut harness, "spiral");
    assert!(text(&mut harness).contains("form = \"spiral\""), "{}", text(&mut harness));
    choose(&mut harness, "Add shape");
    harness.get_by_role_and_label(Role::SpinButton, "reached after").set_value_accesskit(3.5);
    drawn(&mut harness);
    assert!(text(&mut harness).contains("transition_s = 3.5"), "{}", text(&mut harness));
    assert_eq!(drawing(&mut harness).arrivals(), [0.0, 3.5]);
    choose(&mut harness, "Remove shape");
    assert_eq!(drawing(&mut harness).arrivals().len(), 1);
    assert!(harness.state_mut().session().document.error().is_none());
}
