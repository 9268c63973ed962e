//! `[fog]`: it dims and lights flames, grounds, obstacles and plates.

use std::sync::Arc;

use bansho_render::PlanOptions;

use crate::support::*;

/// A disc of 100 cd/m^2 in the middle of the picture, 10 m before the camera.
fn disc(more: &str) -> String {
    format!("{CAMERA}{more}[[emitter]]\nposition = [0, 0, -10]\nradius = 0.4\n")
}

fn middle(text: &str) -> f64 {
    luminance(&render(text, &PlanOptions::default(), 0), 60, 45)
}

#[test]
fn a_flame_at_the_visibility_has_two_percent_of_its_light() {
    let sky = "[sky]\nluminance = 0\n";
    let clear = middle(&disc(sky));
    let foggy = middle(&disc(&format!("{sky}[fog]\nvisibility_m = 10\n")));
    // The fog before the disc is lit by the disc itself, so that a little more than 2 % of its light arrives.
    assert!((0.0199..0.06).contains(&(foggy / clear)), "{foggy} of {clear}");
    let hazy = middle(&disc(&format!("{sky}[fog]\nvisibility_m = 1e6\n")));
    assert!((hazy / clear - 1.0).abs() < 1e-3, "{hazy} of {clear}");
}

#[test]
fn far_ground_has_the_light_of_the_horizon() {
    let street = format!("{CAMERA}[sky]\nkind = \"uniform\"\nluminance = 1\n[ground]\nheight = -1.5\ntexture = 0\n");
    let row = |text: &str, y: usize| luminance(&render(text, &PlanOptions::default(), 0), 60, y);
    let foggy = format!("{street}[fog]\nvisibility_m = 60\n");
    let horizon = row(&street, 20);
    // A pixel below the horizon, the ground is more than 100 m away.
    assert!(row(&street, 45) < 0.5 * horizon);
    assert!((row(&foggy, 45) / horizon - 1.0).abs() < 0.05, "{} of {horizon}", row(&foggy, 45));
    // Row 88 looks 43.5 of 45 pixels per meter down: the ground is 2.158 m away, of whose light exp(-3.912 / 60 * 2.158) = 0.8687 is left.
    let (clear, near) = (row(&street, 88), row(&foggy, 88));
    let expected = 0.8687 * clear + 0.1313 * horizon;
    assert!((near / expected - 1.0).abs() < 0.01, "{near}, expected {expected}");
    assert!((row(&foggy, 20) / horizon - 1.0).abs() < 1e-3, "endless fog is as bright as the uniform sky");
}

#[test]
fn a_plate_fades_with_its_depth() {
    let plate = "[plate]\nimage = \"plate.png\"\n[sky]\nluminance = 0\n";
    let assets = |depth: f32| Arc::new(checkerboard(120, 90, Some(depth)));
    let middle = |more: &str, depth: f32| {
        let plan = plan_with(&format!("{CAMERA}{plate}{more}"), &PlanOptions::default(), assets(depth));
        luminance(&draw(&mut plan.open(), 0), 60, 45)
    };
    for depth in [5.0, 10.0, 30.0] {
        let left = middle("[fog]\nvisibility_m = 20\n", depth) / middle("", depth);
        let expected = bansho_base::math::exp(-3.912 / 20.0 * f64::from(depth));
        assert!((left / expected - 1.0).abs() < 0.01, "{left} at {depth} m, expected {expected}");
    }
}

#[test]
fn fog_is_in_fingerprints_closes_loops_and_leaves_no_alpha() {
    let state = |text: &str| plan(text, &PlanOptions::default()).compiled.state_fingerprint();
    assert_ne!(state(&disc("")), state(&disc("[fog]\n")));
    assert!(parse(&disc("[fog]\n")).unwrap().shows_stated_backdrop(), "it leaves no alpha");
    let error = looped(&disc("[fog]\nvisibility_m = { keys = [[0, 10], [1, 20]] }\n"), 1.0).err().unwrap();
    assert!(error.contains("fog.visibility_m differs between its beginning and its end"), "{error}");
}
