//! Visible obstacles in whole pictures: they hide rain, lamps and ground behind them exactly, cast shadows, and move by their keys.

use std::sync::Arc;

use bansho::{
    base::{
        frame::Frame,
        host::{assets::MemoryAssets, observer::Unobserved},
    },
    compile_scene, draw,
    render::{Plan, PlanOptions, Shot},
};

const SIZE: [usize; 2] = [96, 64];

/// Frame `number` of a scene.
fn frame(tables: &str, number: i64) -> Frame {
    let text = format!(
        "bansho = 2\n[picture]\nsize = [96, 64]\nframes = 10\nexposure_ev100 = 3\n\
         [camera]\nposition = [0, 1.5, 5]\ntarget = [0, 1.5, 0]\nvertical_fov_deg = 30\n{tables}"
    );
    let compiled = compile_scene("test.toml", &text, Arc::new(MemoryAssets::default()));
    let compiled = compiled.unwrap_or_else(|error| panic!("{error}"));
    let plan = Arc::new(Plan::new(&compiled, &PlanOptions::default()).unwrap());
    draw(&mut Shot::open(compiled, plan), number, &Unobserved).unwrap()
}

/// Largest difference of two pictures, in columns of the middle rows.
fn difference(a: &Frame, b: &Frame, columns: std::ops::Range<usize>) -> f32 {
    let pixels = (24..40).flat_map(|y| columns.clone().map(move |x| (x, y)));
    let each = pixels.map(|(x, y)| (a.beauty.at(x, y)[1] - b.beauty.at(x, y)[1]).abs());
    each.fold(0.0, f32::max)
}

const SKY: &str = "[sky]\nluminance = 0\n";
/// In the middle of the picture, 3 m before the camera.
const BOX: &str = "[[obstacle]]\nshape = \"box\"\nvisible = true\nposition = [0, 1.5, 1.5]\nsize = [0.8, 3, 1]\n";
const LAMP: &str = "[[light]]\nvisible = true\nposition = [0, 1.5, -4]\nintensity = 300\n";

#[test]
fn a_lamp_and_rain_behind_an_obstacle_are_hidden_and_rain_before_it_is_seen() {
    let rain = |near: f64| {
        format!("[[rain]]\nrate_mm_per_h = 100\nopacity_gain = 5\ndistance = {near}\nairlight_distance = 30\n")
    };
    let moon = "[[light]]\nkind = \"directional\"\ndirection = [0.2, -1, -1]\nintensity = 20\n";
    let dry = frame(&format!("{SKY}{BOX}{moon}"), 0);
    let lamp = frame(&format!("{SKY}{BOX}{moon}{LAMP}"), 0);
    // The lamp's glare arises in the lens, but is left out where the lamp is hidden.
    assert_eq!(difference(&dry, &lamp, 42..54), 0.0, "hidden");
    let wet = frame(&format!("{SKY}{BOX}{moon}{LAMP}{}", rain(12.0)), 0);
    let open = frame(&format!("{SKY}{moon}{LAMP}{}", rain(12.0)), 0);
    assert!(difference(&wet, &dry, 42..54) > 1e-4, "rain in front of the box");
    // The airlight of the lamp 9 m away is bright where nothing hides it.
    let brightest = |frame: &Frame| (42..54).map(|x| frame.beauty.at(x, 32)[1]).fold(0.0, f32::max);
    assert!(brightest(&open) > 50.0 * brightest(&wet), "{} {}", brightest(&open), brightest(&wet));
    assert!((42..54).all(|x| (wet.depth.as_ref().unwrap()[32 * SIZE[0] + x] as f64) < 3.01));
}

#[test]
fn an_obstacle_shades_the_ground_and_one_that_is_not_visible_does_not() {
    let ground = "[ground]\ntexture = 0\n[[light]]\nposition = [0, 4, 1]\nintensity = 500\n";
    let ball = |visible: bool| format!("[[obstacle]]\nposition = [0, 1.6, 0]\nradius = 0.25\nvisible = {visible}\n");
    let [bare, unseen, shaded] =
        [String::new(), ball(false), ball(true)].map(|ball| frame(&format!("{SKY}{ground}{ball}"), 0));
    assert_eq!(bare.beauty.pixels(), unseen.beauty.pixels());
    // Its shadow lies below it, behind its place; at the edge of the picture there is none.
    let change = |x: usize, y: usize| shaded.beauty.at(x, y)[1] / bare.beauty.at(x, y)[1];
    let darkest = (44..64).map(|y| change(48, y)).fold(1.0, f32::min);
    assert!(darkest < 0.05 && (change(2, 60) - 1.0).abs() < 1e-3, "{darkest} {}", change(2, 60));
}

#[test]
fn an_obstacle_and_a_light_move_by_their_keys() {
    let moving = "[[obstacle]]\nshape = \"box\"\nvisible = true\nsize = [0.3, 3, 0.3]\ncolor = [1, 1, 1]\n\
                  position = { keys = [[0, [-0.8, 1.5, 0]], [0.3, [0.8, 1.5, 0]]], interpolation = \"linear\" }\n\
                  rotation_deg = { keys = [[0, [0, 0, 0]], [0.3, [0, 90, 0]]], interpolation = \"linear\" }\n";
    let spot = "[[light]]\nkind = \"spot\"\nposition = [0, 1.5, 5]\nintensity = 300\nouter_cone_deg = 89\n";
    let middle = |number: i64| {
        let frame = frame(&format!("{SKY}{moving}{spot}direction = [0, 0, -1]\n"), number);
        let weights = (0..SIZE[0]).map(|x| (x as f32 + 0.5, frame.beauty.at(x, 32)[1].min(0.01)));
        let [sum, whole] = weights.fold([0.0; 2], |[sum, whole], (x, weight)| [sum + x * weight, whole + weight]);
        sum / whole
    };
    // 5 m away a meter is 64 / (2 tan 15 degrees) / 5 = 23.9 pixels; the middle of the exposure is half of 1/60 s after the frame begins.
    let pixels = 32.0 / 0.267_949_2 / 5.0;
    let at = |number: i64| 48.0 + pixels * (-0.8 + 1.6 * (number as f32 / 30.0 + 1.0 / 120.0) / 0.3);
    for number in [0, 4, 8] {
        assert!((middle(number) - at(number)).abs() < 0.7, "{number}: {} {}", middle(number), at(number));
    }
    // A light that turns away: at 0 s it shines on the box, at 0.2 s past it.
    let turning = "direction = { keys = [[0, [0, 0, -1]], [0.2, [0, 0, 1]]], interpolation = \"step\" }\n";
    let brightness = |number: i64| {
        let still = BOX.replace("visible = true", "visible = true\ncolor = [1, 1, 1]");
        frame(&format!("{SKY}{still}{spot}{turning}"), number).beauty.at(48, 32)[1]
    };
    assert!(brightness(0) > 0.01 && brightness(7) == 0.0, "{} {}", brightness(0), brightness(7));
}

#[test]
fn rain_beside_an_obstacle_is_as_it_is_without_it() {
    // Dark ground, so that far rain is seen before it, and few drops that are drawn one by one.
    let rain = |method: &str| {
        format!(
            "[sky]\nluminance = 3\n[ground]\ncolor = [0.01, 0.01, 0.01]\ntexture = 0\n[[rain]]\nrate_mm_per_h = 20\nmethod = \"{method}\"\n\
             distance = 1\nopacity_gain = 0\nsplashes = {{ fraction = 0 }}\n"
        )
    };
    for method in ["drops", "billboards", "textures"] {
        let alone = frame(&rain(method), 0);
        let beside = frame(&format!("{}{BOX}", rain(method)), 0);
        // The box covers columns 32 to 63. Beside it, pixels are in the same block; farther away, the ground is not in its shadow.
        let blocks = [26, 29, 66, 69].into_iter().flat_map(|x| (0..31).map(move |y| (x, y)));
        let ground = [2, 10, 85, 93].into_iter().flat_map(|x| (33..40).map(move |y| (x, y)));
        for (x, y) in blocks.chain(ground) {
            let [alone, beside] = [&alone, &beside].map(|frame| frame.beauty.at(x, y)[1]);
            assert!(alone > 0.0 && (alone - beside).abs() <= 0.02 * alone, "{method} at {x}, {y}: {alone} {beside}");
        }
    }
}

#[test]
fn what_is_wrong_with_an_obstacle_or_a_light_is_one_located_error() {
    for (table, told) in [
        ("[[obstacle]]\nshape = \"cone\"\n", "obstacle.0.shape"),
        ("[[obstacle]]\nshape = \"cylinder\"\nheight = 0\n", "obstacle.0.height"),
        ("[[obstacle]]\nroughness = 0\n", "obstacle.0.roughness"),
        ("[[obstacle]]\nvisible = 1\n", "obstacle.0.visible"),
        (
            "[[light]]\nkind = \"spot\"\ndirection = { keys = [[0, [0, 0, 1]], [1, [0, 0, 0]]] }\n",
            "light.0.direction: is the zero vector",
        ),
        ("[[rain]]\nopacity = \"papers\"\n", "rain.0.opacity"),
        ("[[rain]]\noscillation = 2\n", "rain.0.oscillation"),
        ("[[rain]]\nmethod = \"textures\"\ntexture_rates_mm_per_h = [5, 1]\n", "rain.0.texture_rates_mm_per_h"),
    ] {
        let text = format!("bansho = 2\n{table}");
        let error = compile_scene("test.toml", &text, Arc::new(MemoryAssets::default()));
        let error = error.err().unwrap_or_else(|| panic!("{table}")).to_string();
        let says_what_is_allowed = ["allowed", "expected", "must"].iter().any(|word| error.contains(word));
        assert!(error.contains(told) && error.contains("test.toml:") && says_what_is_allowed, "{table}: {error}");
    }
}
