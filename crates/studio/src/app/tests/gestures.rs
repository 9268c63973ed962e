//! Undo steps, and accidental edits that must not happen.

use eframe::egui::{Event, Key, Modifiers, MouseWheelSource, MouseWheelUnit, Role, TouchPhase, vec2};
use egui_kittest::{Harness, kittest::Queryable};

use super::{super::Studio, SCENE, blow, drag, drawn, press, release, sky, text, window};

fn undo(harness: &mut Harness<'_, Studio>) {
    harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    drawn(harness);
}

fn steps(harness: &mut Harness<'_, Studio>) -> Vec<String> {
    harness.state_mut().session().document.undo_labels().map(str::to_owned).collect()
}

/// Scrolls over the picture.
fn scroll(harness: &mut Harness<'_, Studio>, lines: f32) {
    let middle = harness.get_by_label("Viewport").rect().center();
    harness.hover_at(middle);
    harness.step();
    let wheel = Event::MouseWheel {
        unit: MouseWheelUnit::Line,
        delta: vec2(0.0, lines),
        phase: TouchPhase::Move,
        source: MouseWheelSource::Wheel,
        modifiers: Modifiers::NONE,
    };
    harness.event(wheel);
    harness.run_steps(20);
    drawn(harness);
}

fn position(harness: &mut Harness<'_, Studio>) -> [f64; 3] {
    let camera = harness.state_mut().session().plan().unwrap().scene().camera.clone();
    camera.position.at(0.0)
}

#[test]
fn scrolling_dollies_in_one_step() {
    let mut harness = window(SCENE);
    let before = position(&mut harness);
    scroll(&mut harness, 1.0);
    assert!(position(&mut harness)[2] < 0.95 * before[2], "{:?}", position(&mut harness));
    assert_eq!(steps(&mut harness), ["camera"]);
    harness.run_steps(60);
    scroll(&mut harness, -1.0);
    assert_eq!(steps(&mut harness), ["camera"; 2], "later turns are another step");
    undo(&mut harness);
    undo(&mut harness);
    assert_eq!(text(&mut harness), SCENE);
}

#[test]
fn the_picture_is_panned_with_shift() {
    let mut harness = window(SCENE);
    let middle = harness.get_by_label("Viewport").rect().center();
    harness.event(Event::ModifiersChanged(Modifiers::SHIFT));
    drag(&mut harness, middle, vec2(120.0, 0.0));
    let camera = harness.state_mut().session().plan().unwrap().scene().camera.clone();
    let [position, target] = [camera.position.at(0.0), camera.target.at(0.0)];
    assert!(position[0] < -0.05 && (position[0] - target[0]).abs() < 2e-3, "{position:?} {target:?}");
}

#[test]
fn turning_the_default_camera_of_an_aurora_keeps_its_view() {
    let mut harness = window(&sky(2, ""));
    let seen = |harness: &mut Harness<'_, Studio>| {
        let camera = harness.state_mut().session().plan().unwrap().scene().camera.clone();
        (camera.position.at(0.0), camera.target.at(0.0), camera.vertical_fov_deg.at(0.0))
    };
    let (before, _, field) = seen(&mut harness);
    harness.get_by_role_and_label(Role::Button, "camera").click();
    harness.run_steps(3);
    let value = harness.get_by_role_and_label(Role::SpinButton, "vertical fov deg").value();
    assert_eq!(value.as_deref(), Some("62.0°"), "the inspector says what is seen");
    let viewport = harness.get_by_label("Viewport").rect();
    harness.run_steps(20);
    assert_eq!(harness.get_by_label("Viewport").rect(), viewport, "the inspector is as wide as it was");
    let middle = viewport.center();
    for by in [vec2(30.0, 0.0), vec2(0.0, 300.0)] {
        drag(&mut harness, middle, by);
        let (after, target, now) = seen(&mut harness);
        assert_eq!((after, now), (before, field), "the camera only looks elsewhere: {}", text(&mut harness));
        assert!(target[1] > 0.0, "{target:?}");
    }
    assert_eq!(steps(&mut harness), ["camera"; 2]);
    undo(&mut harness);
    undo(&mut harness);
    assert_eq!(text(&mut harness), sky(2, ""));
}

#[test]
fn keyframing_the_default_camera_of_an_aurora_keeps_its_view() {
    let mut harness = window(&sky(2, ""));
    harness.get_by_role_and_label(Role::Button, "camera").click();
    harness.run_steps(3);
    harness.get_by_label("Key the value at this time: camera.target").click();
    drawn(&mut harness);
    let camera = harness.state_mut().session().plan().unwrap().scene().camera.clone();
    assert_eq!((camera.target.at(0.0), camera.vertical_fov_deg.at(0.0)), ([0.0, 32.0, -57.0], 62.0));
}

#[test]
fn a_press_without_a_drag_changes_no_curve() {
    let mut harness = window(SCENE);
    harness.get_by_label("Curves").click();
    harness.run_steps(6);
    let chart = harness.get_by_role_and_label(Role::Canvas, "B(s)  blue").rect().shrink(4.0);
    let curve = highest(&mut harness);
    // The chart's maximum is a quarter above its highest point.
    let at = chart.left_bottom() + vec2(curve.0 * chart.width(), -0.8 * chart.height());
    press(&mut harness, at);
    harness.hover_at(at - vec2(0.0, 0.1 * chart.height()));
    harness.run_steps(3);
    let held = highest(&mut harness);
    for _ in 0..20 {
        harness.step();
    }
    assert_eq!(highest(&mut harness), held, "it neither grows nor shrinks under the hand");
    assert!(held.1 > 1.05 * curve.1 && held.1 < 1.3 * curve.1, "{curve:?} {held:?}");
    release(&mut harness, at - vec2(0.0, 0.1 * chart.height()));
    undo(&mut harness);
    assert_eq!(text(&mut harness), SCENE);
}

/// The highest point of the flame's blue curve.
fn highest(harness: &mut Harness<'_, Studio>) -> (f32, f32) {
    use bansho::base::parameters::{Parameters, Reader, Value};
    use bansho::fire::sheet::FlameSheetParameters;
    let document = &harness.state_mut().session().document;
    let Some(Value::List(sheets)) = document.values().get("flame_sheet").map(|node| &node.value) else {
        panic!("a sheet")
    };
    let Value::Table(table) = &sheets[0].value else { panic!("a table") };
    let sheet = FlameSheetParameters::read_table(table, &mut Reader::new(), &[]);
    let highest = sheet.color.blue.points().iter().copied().max_by(|a, b| a[1].total_cmp(&b[1])).unwrap();
    (highest[0] as f32, highest[1] as f32)
}

#[test]
fn rising_curves_stay_valid() {
    let mut harness = window(SCENE);
    harness.get_all_by_label("texture").last().expect("the section").click();
    harness.run_steps(12);
    harness.get_by_role_and_label(Role::Canvas, "threshold across").scroll_to_me();
    harness.run_steps(12);
    let chart = harness.get_by_role_and_label(Role::Canvas, "threshold across").rect().shrink(4.0);
    let at = chart.left_bottom() + vec2(0.82 * chart.width(), -0.45 * chart.height());
    for by in [0.5, -0.9] {
        drag(&mut harness, at, vec2(0.0, by * chart.height()));
        assert!(text(&mut harness).contains("threshold_across = [["), "{}", text(&mut harness));
        assert!(harness.state_mut().session().document.error().is_none(), "{}", text(&mut harness));
        undo(&mut harness);
    }
}

#[test]
fn a_recording_does_not_loop() {
    let short = SCENE.replace("frames = 10", "frames = 6");
    let mut harness = window(&short);
    for choice in ["Blow", "Record"] {
        harness.get_by_label(choice).click();
        harness.run_steps(2);
    }
    let middle = harness.get_by_label("Viewport").rect().center();
    press(&mut harness, middle);
    for step in 1..60 {
        harness.hover_at(middle + vec2(2.0 * step as f32, 0.0));
        harness.step();
    }
    let session = harness.state_mut().session();
    assert_eq!((session.transport.number(), session.transport.is_playing()), (5, false), "it stops at the end");
    release(&mut harness, middle + vec2(120.0, 0.0));
    let recorded = text(&mut harness);
    assert!(recorded.contains("velocity = { keys = [[0.0, [0.0, 0.0, 0.0]]"), "the calm before it stays: {recorded}");
    let velocity = recorded.lines().find(|line| line.starts_with("velocity")).unwrap_or_default();
    assert!(!velocity.ends_with("[0.0, 0.0, 0.0]]] }"), "it blows to the end: {recorded}");
}

#[test]
fn dragging_the_wind_of_the_papers_gas_sets_a_force_per_volume() {
    /// The gas of Inagaki et al., few particles of it.
    const GAS: &str = "bansho = 2\n[picture]\nsize = [64, 36]\nframes = 30\n[[flame_particles]]\nparticles = 60\n\
                       [[flame_particles.burners]]\nspeed = 2.0\n[flame_particles.forces]\nwind_model = \"body_force\"\n";
    let dragged_x = |scene: &str| -> f64 {
        let mut harness = window(scene);
        let middle = blow(&mut harness);
        let edited = text(&mut harness);
        release(&mut harness, middle);
        let start = edited.find("velocity = [").unwrap() + "velocity = [".len();
        edited[start..].split(',').next().unwrap().parse().unwrap()
    };
    let velocity = dragged_x(&GAS.replace("body_force", "entrainment"));
    assert!(velocity > 1.0, "{velocity} m/s");
    // The same drag: 0.1 N/m^3 over the height instead of 8 m/s.
    for (response, unit) in [(1.0, 1.0), (0.01, 100.0)] {
        let force = dragged_x(&format!("{GAS}wind_response = {response}\n"));
        assert!((force - velocity * 0.1 / 8.0 * unit).abs() < 1e-3 * unit, "{force} for {velocity} m/s");
    }
    let mut harness = window(GAS);
    let hint = super::super::viewport::wind_drag::wind_hint(super::super::viewport::wind_drag::wind_scale(
        harness.state_mut().session(),
    ));
    assert!(hint.ends_with("it is 0.1 N/m^3"), "{hint}");
}

#[test]
fn saving_during_a_wind_drag_saves_no_temporary_wind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let mut harness = window(SCENE);
    super::choosing::save(&mut harness);
    super::choosing::answer(&mut harness, &path, "Save");
    let middle = blow(&mut harness);
    super::choosing::save(&mut harness);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), SCENE);
    release(&mut harness, middle + vec2(100.0, 0.0));
    assert_eq!(text(&mut harness), SCENE);
}

#[test]
fn adding_a_shape_that_lengthens_the_shot_is_one_step() {
    let mut harness = window(&sky(2, ""));
    harness.get_by_label("Add shape").click();
    drawn(&mut harness);
    assert!(
        text(&mut harness).contains("shapes") && !text(&mut harness).contains("frames = 2\n"),
        "{}",
        text(&mut harness)
    );
    assert_eq!(steps(&mut harness), ["add shape"]);
    undo(&mut harness);
    assert_eq!(text(&mut harness), sky(2, ""));
    harness.key_press_modifiers(Modifiers::COMMAND, Key::Y);
    drawn(&mut harness);
    assert!(text(&mut harness).contains("shapes"), "done again by key");
}

#[test]
fn dragging_a_point_of_a_template_is_one_step() {
    let scene = sky(2, "extent_km = 800.0\n[[aurora.shapes]]\nsheets = [{ form = \"arc\" }]\n");
    let mut harness = window(&scene);
    harness.get_by_label("Move").click();
    drawn(&mut harness);
    let target = harness.get_by_label("Aurora target").rect();
    let session = harness.state_mut().session();
    let drawing =
        crate::editors::aurora::document::AuroraDrawing::read(session.document.values(), 0, session.assets()).unwrap();
    let point = drawing.points(0, 0)[0];
    let scale = target.width() / drawing.extent_km() as f32;
    let from = target.center() + vec2(point.x as f32, point.y as f32) * scale;
    drag(&mut harness, from, vec2(0.0, -30.0));
    assert!(text(&mut harness).contains("points = [["), "{}", text(&mut harness));
    assert_eq!(steps(&mut harness), ["move point"]);
    undo(&mut harness);
    assert_eq!(text(&mut harness), scene);
}

#[test]
fn retiming_a_shape_that_counts_frames_is_one_step() {
    let shapes = "[[aurora.shapes]]\nsheets = [{ form = \"arc\" }]\n[[aurora.shapes]]\nsheets = [{ form = \"arc\" }]\ntransition_frames = 2\n";
    let mut harness = window(&sky(90, shapes));
    let shape = harness.get_by_label("Shape 2").rect().center();
    drag(&mut harness, shape, vec2(-60.0, 0.0));
    let edited = text(&mut harness);
    assert!(edited.contains("transition_s = ") && !edited.contains("transition_frames"), "{edited}");
    assert_eq!(steps(&mut harness), ["time of shape"]);
    undo(&mut harness);
    assert_eq!(text(&mut harness), sky(90, shapes));
}

#[test]
fn typing_is_undone_by_line_and_pause() {
    let mut harness = window(SCENE);
    harness.key_press(Key::F2);
    harness.run_steps(3);
    harness.get_by_role(Role::MultilineTextInput).focus();
    harness.run_steps(2);
    harness.key_press_modifiers(Modifiers::COMMAND, Key::End);
    harness.run_steps(2);
    let mut type_in = |words: &str| {
        for letter in words.chars() {
            match letter {
                '\n' => harness.key_press(Key::Enter),
                letter => harness.event(Event::Text(letter.to_string())),
            }
            harness.run_steps(1);
        }
        harness.state_mut().session().document.undo_labels().count()
    };
    assert_eq!(type_in("# warm"), 1, "letters are one step");
    assert_eq!(type_in("\n# and bright"), 2, "a line is another");
    harness.run_steps(20);
    let mut type_in = |words: &str| {
        harness.event(Event::Text(words.to_owned()));
        harness.run_steps(2);
        harness.state_mut().session().document.undo_labels().count()
    };
    assert_eq!(type_in("!"), 3, "and so is what comes after a rest");
    undo(&mut harness);
    assert!(text(&mut harness).ends_with("# warm\n# and bright"), "{}", text(&mut harness));
}

#[test]
fn the_edit_menu_undoes_redoes_and_goes_back_several_steps() {
    let mut harness = window(SCENE);
    for (label, height) in [("one", "1.0"), ("two", "2.0"), ("three", "3.0")] {
        let edited = SCENE.replace("0.9", height);
        harness.state_mut().session().document.replace(label, &edited);
        drawn(&mut harness);
    }
    let choose = |harness: &mut Harness<'_, Studio>, choices: &[&str]| {
        for choice in choices {
            harness.get_by_label(choice).click();
            harness.run_steps(3);
        }
        harness.key_press(Key::Escape);
        drawn(harness);
    };
    choose(&mut harness, &["Edit", "Undo three"]);
    assert!(text(&mut harness).contains("height = 2.0"));
    choose(&mut harness, &["Edit", "Redo three"]);
    assert!(text(&mut harness).contains("height = 3.0"));
    choose(&mut harness, &["Edit", "Undo back to", "3. one"]);
    assert_eq!(text(&mut harness), SCENE);
}

#[test]
fn shapes_stay_under_the_pointer_that_drags_them_in_time() {
    let arc = "[[aurora.shapes]]\nsheets = [{ form = \"arc\" }]\n";
    // The last shape is after the end of the shot, so that the timeline ends with it.
    let mut harness = window(&sky(31, &format!("{arc}{arc}transition_s = 0.4\n{arc}transition_s = 3.6\n")));
    let at = |harness: &Harness<'_, Studio>, shape: &str| harness.get_by_label(shape).rect().center().x;
    let arrivals = |harness: &mut Harness<'_, Studio>| {
        let session = harness.state_mut().session();
        let drawing =
            crate::editors::aurora::document::AuroraDrawing::read(session.document.values(), 0, session.assets())
                .unwrap();
        drawing.arrivals().to_vec()
    };
    // Once selected, its time is shown beside the timeline, which is shorter then.
    harness.get_by_label("Shape 3").click();
    drawn(&mut harness);
    let (first, last) = (at(&harness, "Shape 1"), at(&harness, "Shape 3"));
    let end_s = arrivals(&mut harness)[2];
    // Grabbed 1.5 pixels off its center, it is dragged to three quarters of the timeline, by less than a pixel per frame.
    let handle = harness.get_by_label("Shape 3").rect().center();
    let by = 0.25 * (first - last);
    press(&mut harness, handle + vec2(1.5, 0.0));
    for step in 1..=200 {
        harness.hover_at(handle + vec2(1.5 + by * (step as f32 / 200.0), 0.0));
        harness.step();
    }
    harness.step();
    assert!((at(&harness, "Shape 3") - last - by).abs() < 1.5, "{} {last} {by}", at(&harness, "Shape 3"));
    release(&mut harness, handle + vec2(1.5 + by, 0.0));
    let times = arrivals(&mut harness);
    assert!((times[2] - 0.75 * end_s).abs() < 0.02, "{times:?} of {end_s}");
    assert_eq!(at(&harness, "Shape 3"), last, "the line ends with it again");
}
