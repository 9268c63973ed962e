//! Editing values: sliders, keyframes, recording, curves, and the thumbnails of stages.

use bansho::base::{math::DVec3, parameters::PAPER_HEADING};
use eframe::egui::{Event, Modifiers, PointerButton, Role, vec2};
use egui_kittest::{Harness, kittest::Queryable};

use super::{super::Studio, SCENE, drag, drag_for_a_second, drawn, seen_at, text, window};

fn slide(harness: &mut Harness<'_, Studio>, name: &str, to: f64) {
    harness.get_by_role_and_label(Role::Slider, name).set_value_accesskit(to);
    drawn(harness);
}

#[test]
fn bounded_values_have_sliders_with_their_numbers_beside() {
    let mut harness = window(SCENE);
    slide(&mut harness, "height", 2.5);
    assert!(text(&mut harness).contains("height = 2.5\n"), "{}", text(&mut harness));
    let number = harness.get_by_role_and_label(Role::SpinButton, "height");
    assert_eq!(number.value().as_deref(), Some("2.50 m"));
    assert!(
        harness.query_by_role_and_label(Role::Slider, "position").is_none(),
        "a place has no bounds to slide between"
    );
    harness.state_mut().session().document.undo();
    drawn(&mut harness);
    assert_eq!(text(&mut harness), SCENE, "one step");
}

#[test]
fn sliders_of_a_particle_flame_edit_its_parameters() {
    let mut harness =
        window("bansho = 2\n[picture]\nsize = [32, 18]\nframes = 2\n[[flame_particles]]\nparticles = 50\n");
    for (section, name, to, written) in [
        ("forces", "buoyancy", 2.0, "buoyancy = 2.0"),
        ("combustion", "flame temperature k", 2100.0, "flame_temperature_k = 2100.0"),
        ("rendering", "heat haze gain", 2.5, "heat_haze_gain = 2.5"),
    ] {
        harness.get_by_label(section).click_accesskit();
        harness.run_steps(12);
        slide(&mut harness, name, to);
        assert!(text(&mut harness).contains(written), "{}", text(&mut harness));
    }
    // The fuel of the implied burner.
    for section in ["burners", "flame particles.0.burners.0, as usual"] {
        harness.get_by_label(section).click_accesskit();
        harness.run_steps(12);
    }
    slide(&mut harness, "heat release kw", 90.0);
    assert!(text(&mut harness).contains("burners = [{ heat_release_kw = 90.0 }]"), "{}", text(&mut harness));
    assert!(harness.state_mut().session().document.error().is_none());
}

#[test]
fn the_inspector_shows_parameters_for_a_paper_last_below_a_heading() {
    let mut harness = window("bansho = 2\n[picture]\nsize = [32, 18]\nframes = 2\n[sky]\n[[rain]]\n");
    // A parameter's name and its value have the same label.
    let top = |harness: &Harness<'_, Studio>, label: &str| {
        harness.get_all_by_label(label).next().expect("it is shown").rect().top()
    };
    let heading = top(&harness, PAPER_HEADING);
    assert!(top(&harness, "simplification codes") < heading && top(&harness, "splashes") < heading);
    assert!(top(&harness, "terminal velocity") > heading && top(&harness, "opacity") > heading);
    // A search that finds none of them shows no heading.
    harness.get_by_role_and_label(Role::TextInput, "Find").focus();
    harness.run_steps(2);
    harness.event(Event::Text("simplification".to_owned()));
    harness.run_steps(3);
    assert!(harness.query_by_label(PAPER_HEADING).is_none());
}

#[test]
fn sliders_edit_rain_shutter_and_wind() {
    let mut harness = window("bansho = 2\n[picture]\nsize = [32, 18]\nframes = 2\n[sky]\n[[rain]]\n");
    slide(&mut harness, "rate mm per h", 40.0);
    assert!(text(&mut harness).contains("rate_mm_per_h = 40.0"), "{}", text(&mut harness));
    harness.get_by_label("diameters mm").click_accesskit();
    harness.run_steps(12);
    let first = harness.get_all_by_role_and_label(Role::SpinButton, "rain.0.diameters_mm.0").next().expect("a size");
    first.set_value_accesskit(0.8);
    drawn(&mut harness);
    assert!(text(&mut harness).contains("diameters_mm = [0.8, "), "{}", text(&mut harness));
    harness.get_by_role_and_label(Role::Button, "camera").click();
    harness.run_steps(3);
    let shutter = "shutter s";
    harness.get_by_role_and_label(Role::Button, shutter).click();
    drawn(&mut harness);
    slide(&mut harness, shutter, 0.02);
    assert!(text(&mut harness).contains("shutter_s = 0.02"), "{}", text(&mut harness));
    harness.get_by_role_and_label(Role::Button, "wind").click();
    harness.run_steps(3);
    let across = harness.get_all_by_role_and_label(Role::SpinButton, "velocity").next().expect("a number");
    across.set_value_accesskit(1.5);
    drawn(&mut harness);
    assert!(text(&mut harness).contains("velocity = [1.5, 0.0, 0.0]"), "{}", text(&mut harness));
    assert!(harness.state_mut().session().document.error().is_none());
}

#[test]
fn keyframes_are_set_at_two_times_and_removed() {
    let mut harness = window(SCENE);
    let path = "flame_sheet.0.position";
    harness.get_by_label(&format!("Key the value at this time: {path}")).click();
    drawn(&mut harness);
    harness.get_by_label("Frame on").click();
    drawn(&mut harness);
    harness.get_by_label(&format!("Keyed; key the value at this time: {path}")).click();
    drawn(&mut harness);
    let keyed = text(&mut harness);
    let line = keyed.lines().find(|line| line.starts_with("position = { keys")).unwrap_or_default();
    assert_eq!(line.matches("[0.0, 0.0, 0.0]").count(), 2, "{keyed}");
    harness.get_by_label(&format!("Take out the key at this time: {path}")).click();
    drawn(&mut harness);
    assert_eq!(text(&mut harness).matches("[0.0, 0.0, 0.0]").count(), 1, "{}", text(&mut harness));
    assert!(harness.state_mut().session().document.error().is_none());
}

#[test]
fn a_lamp_that_is_dragged_while_recording_leaves_keyframes() {
    let longer = SCENE.replace("frames = 10", "frames = 200");
    let mut harness = window(&longer);
    harness.get_by_label("Place").click();
    harness.get_by_label("Record").click();
    harness.run_steps(2);
    let lamp = seen_at(&mut harness, DVec3::Y);
    drag_for_a_second(&mut harness, lamp);
    let recorded = text(&mut harness);
    assert!(recorded.contains("position = { keys = [["), "{recorded}");
    assert!(recorded.matches("], [").count() > 2, "{recorded}");
    harness.state_mut().session().document.undo();
    assert_eq!(text(&mut harness), longer, "a recording is one step");
}

#[test]
fn a_burner_that_is_dragged_while_recording_leaves_keyframes() {
    let scene = "bansho = 2\n[picture]\nsize = [64, 36]\nframes = 200\n[[flame_particles]]\nparticles = 50\n";
    let mut harness = window(scene);
    harness.get_by_label("Place").click();
    harness.get_by_label("Record").click();
    harness.run_steps(2);
    let burner = seen_at(&mut harness, DVec3::ZERO);
    drag_for_a_second(&mut harness, burner);
    let recorded = text(&mut harness);
    assert!(recorded.contains("burners = [{ position = { keys = [["), "{recorded}");
    assert!(recorded.contains("]], ["), "at more than one time: {recorded}");
    assert!(harness.state_mut().session().document.error().is_none());
    harness.state_mut().session().document.undo();
    assert_eq!(text(&mut harness), scene, "a recording is one step");
}

#[test]
fn curves_are_edited_by_their_points() {
    let mut harness = window(SCENE);
    harness.get_all_by_label("texture").last().expect("the section").click();
    harness.run_steps(12);
    harness.get_by_role_and_label(Role::Canvas, "sharpen").scroll_to_me();
    harness.run_steps(12);
    let chart = harness.get_by_role_and_label(Role::Canvas, "sharpen").rect().shrink(4.0);
    let at = |[x, y]: [f32; 2]| chart.left_bottom() + vec2(x * chart.width(), -y * chart.height());
    drag(&mut harness, at([0.36, 0.97]), vec2(0.0, 0.4 * chart.height()));
    let dragged = text(&mut harness);
    let line = dragged.lines().find(|line| line.contains("sharpen = ")).unwrap_or_default().to_owned();
    assert!(line.contains("[0.36, 0.5") && !line.contains("0.97"), "{dragged}");
    harness.hover_at(at([0.6, 1.0]));
    harness.step();
    for pressed in [true, false] {
        harness.event(Event::PointerButton {
            pos: at([0.6, 1.0]),
            button: PointerButton::Secondary,
            pressed,
            modifiers: Modifiers::NONE,
        });
        harness.step();
    }
    drawn(&mut harness);
    assert!(!text(&mut harness).contains("[0.6, 1.0]"), "{}", text(&mut harness));
    assert!(harness.state_mut().session().document.error().is_none());
}

#[test]
fn vectors_and_colors_with_bounds_have_sliders() {
    let mut harness = window(SCENE);
    harness.get_by_label("light 1").click();
    harness.run_steps(3);
    let sliders: Vec<_> = harness.get_all_by_role_and_label(Role::Slider, "color").collect();
    assert_eq!(sliders.len(), 3);
    sliders[1].set_value_accesskit(0.25);
    drawn(&mut harness);
    assert!(text(&mut harness).contains("color = [1.0, 0.25, 0.75]"), "{}", text(&mut harness));
}

#[test]
fn turning_the_camera_while_recording_sets_a_keyframe() {
    let mut harness = window(SCENE);
    harness.get_by_label("Record").click();
    harness.get_by_label("Frame on").click();
    drawn(&mut harness);
    let middle = harness.get_by_label("Viewport").rect().center();
    drag(&mut harness, middle, vec2(120.0, 0.0));
    let edited = text(&mut harness);
    assert!(edited.contains("position = { keys = [["), "{edited}");
    assert!(!harness.state_mut().session().transport.is_playing());
}

#[test]
fn stages_of_the_flame_are_drawn_live() {
    let mut harness = window(SCENE);
    for name in ["texture", "thresholded", "sharpened", "colored"] {
        harness.get_by_label(&format!("Stage {name}"));
    }
    let shown = |harness: &mut Harness<'_, Studio>| {
        let session = harness.state_mut().session();
        (0..4).map(|stage| session.stage(stage).unwrap().0.pixels.clone()).collect::<Vec<_>>()
    };
    let before = shown(&mut harness);
    for (index, pixels) in before.iter().enumerate() {
        assert!(pixels.iter().any(|pixel| pixel[0] > 100), "stage {index} is not black");
        assert!(before[..index].iter().all(|other| other != pixels), "stage {index} is none of those before");
    }
    let edited = SCENE.replace("height = 0.9", "height = 0.9\ntexture = { contrast = 0.2 }");
    harness.state_mut().session().document.replace("typing", &edited);
    drawn(&mut harness);
    let after = shown(&mut harness);
    assert!((0..4).all(|stage| before[stage] != after[stage]), "they follow");
    harness.get_by_label("Frame on").click();
    drawn(&mut harness);
    assert!(shown(&mut harness)[0] != after[0], "and move");
    harness.get_by_label("Stages").click();
    harness.run_steps(12);
    assert!(harness.query_by_label("Stage texture").is_none());
    assert_eq!(harness.state_mut().session().stages, None, "what is not seen is not drawn");
}

#[test]
fn a_value_out_of_bounds_is_reported_and_not_changed() {
    let faulty =
        SCENE.replace("height = 0.9", "height = -5.0").replace("bansho = 2", "bansho = 2\n[camera]\nroll_deg = 9999.0");
    let mut harness = window(&faulty);
    harness.get_by_label_contains("-5 is out of range");
    for selection in ["fire", "camera"] {
        harness.get_by_role_and_label(Role::Button, selection).click();
        drawn(&mut harness);
        assert_eq!(text(&mut harness), faulty, "looking mends nothing");
    }
}
