//! Cuts: step keys are no motion. A frame shows one side of each, to the bit, whatever is drawn.

use std::sync::Arc;

use bansho::KINDS;
use bansho_base::{
    frame::Frame,
    host::{assets::MemoryAssets, observer::Unobserved},
};
use bansho_render::PlanOptions;
use bansho_scene::Scene;

use crate::support::Planned;

/// Everything that looks at the camera at several times: sheets with sparks, gas, rain, lamps, obstacles, wet ground, stars.
const THINGS: &str = "\
[sky]
luminance = 1.0
[ground]
wetness = 0.5
[[light]]
position = [1.0, 3.0, 0.0]
intensity = 300.0
visible = true
[[obstacle]]
position = [-0.8, 0.4, 0.5]
radius = 0.4
visible = true
[[flame_sheet]]
position = [0.8, 0.0, 0.0]
sparks.rate = 60
[[flame_particles]]
particles = 600
preroll_s = 0.3
rendering.sparks.rate = 40
[[rain]]
rate_mm_per_h = 40
";
/// What is drawn fast.
const RAIN: &str = "[sky]\nluminance = 1.0\n[[light]]\nvisible = true\n[[flame_sheet]]\nsparks.rate = 60\n[[rain]]\nrate_mm_per_h = 40\n";
const AURORA: &str = "[sky]\nkind = \"night\"\n[[aurora]]\nparticles.count = 3000\n";

fn scene(picture: &str, camera: &str, things: &str) -> String {
    format!("bansho = 2\n[picture]\nsize = [64, 36]\nexposure_ev100 = 2.0\n{picture}[camera]\n{camera}{things}")
}

fn draw(text: &str, number: i64) -> Frame {
    let scene = Scene::parse("scene.toml", text, KINDS).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let options = PlanOptions { layers: true, aovs: true, ..PlanOptions::default() };
    let mut shot = Planned::new(scene, &options, Arc::new(MemoryAssets::default())).open();
    bansho::draw(&mut shot, number, &Unobserved).unwrap()
}

/// The names of the planes in which two frames differ.
fn different_planes(a: &Frame, b: &Frame) -> Vec<String> {
    let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    let beauty = |frame: &Frame| bits(frame.beauty.pixels().as_flattened());
    assert_eq!(a.channels.len(), b.channels.len());
    let channels = a.channels.iter().zip(&b.channels).filter(|(a, b)| bits(&a.values) != bits(&b.values));
    let mut names: Vec<String> = channels.map(|(a, _)| a.name.clone()).collect();
    names.extend((beauty(a) != beauty(b)).then(|| "beauty".to_owned()));
    names.extend((a.header.camera != b.header.camera).then(|| "camera of the header".to_owned()));
    names
}

/// Draws frame `number` of a scene whose camera is cut at `key` seconds from the first of two values of a parameter to the second, and demands that it is the
/// frame of the scene without a cut, with the value `side`.
fn assert_side(picture: &str, things: &str, camera: &str, cut: (&str, [&str; 2], f64), number: i64, side: usize) {
    let (parameter, values, key) = cut;
    let [before, after] = values;
    let keyed = format!("{{ keys = [[0, {before}], [{key}, {after}]], interpolation = \"step\" }}");
    let cut = draw(&scene(picture, &format!("{camera}{parameter} = {keyed}\n"), things), number);
    let whole = draw(&scene(picture, &format!("{camera}{parameter} = {}\n", values[side]), things), number);
    let other = draw(&scene(picture, &format!("{camera}{parameter} = {}\n", values[1 - side]), things), number);
    let differences = different_planes(&cut, &whole);
    assert!(differences.is_empty(), "{parameter} cut at {key} s, frame {number}: {differences:?}");
    assert!(!different_planes(&cut, &other).is_empty(), "{parameter}: the two sides look the same");
}

const POSITION: (&str, [&str; 2]) = ("position", ["[0.0, 1.5, 6.0]", "[5.0, 1.2, -3.0]"]);

#[test]
fn an_open_shutter_shows_the_side_of_its_middle() {
    let parameters = [
        POSITION,
        ("target", ["[0.0, 0.9, 0.0]", "[1.5, 2.0, 0.0]"]),
        ("up", ["[0.0, 1.0, 0.0]", "[1.0, 0.4, 0.0]"]),
        ("roll_deg", ["0", "50"]),
        ("vertical_fov_deg", ["30", "60"]),
        ("focal_length_mm", ["20", "70"]),
    ];
    for (parameter, values) in parameters {
        // Open from 0.488 s, or from 0.492 s, for 0.02 s.
        for (offset, side) in [(-0.012, 0), (-0.008, 1)] {
            let camera = format!("shutter_s = 0.02\nshutter_offset_s = {offset}\n");
            assert_side("", THINGS, &camera, (parameter, values, 0.5), 15, side);
        }
    }
}

#[test]
fn curvilinear_lenses_and_auroras_see_one_side_too() {
    let camera = "shutter_s = 0.02\nshutter_offset_s = -0.008\nlens = \"fisheye\"\n";
    assert_side("", THINGS, camera, (POSITION.0, POSITION.1, 0.2), 6, 1);
    let values = ["[0.0, 60.0, -60.0]", "[40.0, 60.0, -60.0]"];
    let camera = "position = [0.0, 1.7, 0.0]\nshutter_s = 0.02\nshutter_offset_s = -0.012\n";
    assert_side("", AURORA, camera, ("target", values, 0.2), 6, 0);
}

#[test]
fn the_frame_before_a_cut_does_not_look_across_it() {
    // Gas is drawn along its motion to the next frame, and the motion AOVs are that motion.
    assert_side("", THINGS, "", (POSITION.0, POSITION.1, 0.5), 14, 0);
    assert_side("", THINGS, "", (POSITION.0, POSITION.1, 0.5), 15, 1);
}

#[test]
fn keys_that_are_rounded_mean_their_frame() {
    for shutter in ["", "shutter_s = 0.0\n", "shutter_s = 0.02\nshutter_offset_s = -0.01\n"] {
        for (key, frame) in [(0.6667, 20), (0.667, 20), (0.2333, 7), (0.2336, 7)] {
            assert_side("", RAIN, shutter, (POSITION.0, POSITION.1, key), frame, 1);
            assert_side("", RAIN, shutter, (POSITION.0, POSITION.1, key), frame - 1, 0);
        }
    }
    let picture = "fps = \"24000/1001\"\n";
    assert_side(picture, RAIN, "shutter_s = 0.0\n", (POSITION.0, POSITION.1, 0.5005), 12, 1);
    assert_side(picture, RAIN, "shutter_s = 0.0\n", (POSITION.0, POSITION.1, 0.501), 12, 1);
    assert_side(picture, RAIN, "shutter_s = 0.0\n", (POSITION.0, POSITION.1, 0.5), 11, 0);
}

#[test]
fn a_moving_camera_is_cut_by_two_keys_at_once() {
    let camera = |position: &str| format!("position = {position}\nshutter_s = 0.02\nshutter_offset_s = -0.01\n");
    let linear = |keys: &str| format!("{{ keys = [{keys}], interpolation = \"linear\" }}");
    let (before, after) = ("[0, [0, 1.5, 6]], [0.4995, [1, 1.5, 6]]", "[0.5, [5, 1.2, -3]], [1, [4, 1.2, -3]]");
    let cut = scene("", &camera(&linear(&format!("{before}, {after}"))), THINGS);
    for (number, side) in [(14, before), (15, after)] {
        let whole = scene("", &camera(&linear(side)), THINGS);
        let differences = different_planes(&draw(&cut, number), &draw(&whole, number));
        assert!(differences.is_empty(), "frame {number}: {differences:?}");
    }
}

#[test]
fn lamps_obstacles_and_flames_jump_at_the_frame_that_is_meant() {
    let things = |position: &dyn Fn([f64; 3], [f64; 3]) -> String| {
        format!(
            "[sky]\nluminance = 1.0\n[ground]\n[[light]]\nintensity = 300.0\nvisible = true\nposition = {}\n[[obstacle]]\nvisible = true\n\
             position = {}\n[[flame_sheet]]\nposition = {}\nsparks.rate = 100\n",
            position([-1.0, 2.5, 0.0], [1.0, 2.5, 0.0]),
            position([-1.5, 0.5, 0.0], [1.5, 0.5, 0.0]),
            position([-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]),
        )
    };
    let keyed = things(&|before, after| {
        format!("{{ keys = [[0, {before:?}], [0.6667, {after:?}]], interpolation = \"step\" }}")
    });
    let sides = [things(&|before, _| format!("{before:?}")), things(&|_, after| format!("{after:?}"))];
    for shutter in ["", "shutter_s = 0.0\n"] {
        for (number, side) in [(19, 0), (20, 1)] {
            let camera = format!("position = [0.0, 1.5, 8.0]\n{shutter}");
            let [jump, still] = [&keyed, &sides[side]].map(|things| draw(&scene("", &camera, things), number));
            let differences = different_planes(&jump, &still);
            assert!(differences.is_empty(), "frame {number}: {differences:?}");
        }
    }
}

#[test]
fn a_turn_that_nobody_asked_for_is_told_with_its_time() {
    let remark = |camera: &str| {
        let text =
            scene("frames = 61\n", &format!("position = [0.0, 0.0, 0.0]\nlens = \"fisheye\"\n{camera}"), "[sky]\n");
        let scene = Scene::parse("scene.toml", &text, KINDS).unwrap_or_else(|error| panic!("{error}"));
        let planned = Planned::new(scene, &PlanOptions::default(), Arc::new(MemoryAssets::default()));
        planned.remarks().into_iter().find(|(name, _)| name == "camera").map(|(_, remark)| remark)
    };
    let tilt = "target = { keys = [[0, [0, 60, 30]], [2, [0, 60, -30]]], interpolation = \"linear\" }\n";
    let told = remark(tilt).expect("the line of sight meets the vertical after one second");
    assert_eq!(told.key.as_deref(), Some("up"));
    assert_eq!(
        told.message,
        "the picture turns by 180 degrees at 1.003 s, between frames 30 and 31, because the camera then looks along `up`; with `up = [0, 0, -1]` it does not turn"
    );
    assert_eq!(remark(&format!("{tilt}up = [0.0, 0.0, 1.0]\n")), None);
    assert_eq!(remark("target = [0.0, 60.0, 0.0]\n"), None);
    let never = Scene::parse("scene.toml", &scene("", "up = [0, 0, 0]\n", ""), KINDS).err().expect("no direction");
    assert!(never.to_string().contains("is the zero vector"), "{never}");
}
