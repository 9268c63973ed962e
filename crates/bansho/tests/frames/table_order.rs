//! What is nearer hides what is farther, whatever the order of the scene's tables.

use std::sync::Arc;

use bansho::KINDS;
use bansho_base::{
    frame::Frame,
    host::{assets::MemoryAssets, observer::Unobserved},
};
use bansho_render::PlanOptions;
use bansho_scene::Scene;

use crate::support::Planned;

const HEADER: &str = "\
bansho = 2
[picture]
size = [80, 60]
fps = 24
exposure_ev100 = 9
[camera]
position = [0, 0.9, 5]
target = [0, 0.9, 0]
[[light]]
position = [0.3, 1.2, 0.05]
intensity = 300
radius = 0.2
";

fn draw(tables: &[&str]) -> Frame {
    draw_with(HEADER, tables)
}

fn draw_with(header: &str, tables: &[&str]) -> Frame {
    let text = format!("{header}{}", tables.concat());
    let scene = Scene::parse("scene.toml", &text, KINDS).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let mut shot = Planned::new(scene, &PlanOptions::default(), Arc::new(MemoryAssets::default())).open();
    bansho::draw(&mut shot, 3, &Unobserved).unwrap()
}

/// The largest difference of a value, relative to the greatest one.
fn greatest_difference(a: &Frame, b: &Frame) -> f32 {
    let [a, b] = [a, b].map(|frame| frame.beauty.pixels().as_flattened());
    let most = a.iter().copied().fold(0.0, f32::max);
    assert!(most > 0.0, "nothing is seen");
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) / most
}

fn sheet(name: &str, z: f64, more: &str) -> String {
    format!(
        "[[flame_sheet]]\nname = \"{name}\"\nposition = [0, 0, {z}]\ncolor = {{ soot_optical_depth = 3 }}\n\
         smoke = {{ optical_depth = 1 }}\n{more}\n"
    )
}

fn gas(name: &str, z: f64) -> String {
    format!(
        "[[flame_particles]]\nname = \"{name}\"\nparticles = 600\npreroll_s = 0.3\n\
         burners = [{{ position = [0, 0, {z}], diameter = 0.4, heat_release_kw = 60 }}]\n"
    )
}

#[test]
fn swapped_tables_give_the_same_picture() {
    let rain = |name: &str, rate: f64| format!("[[rain]]\nname = \"{name}\"\nrate_mm_per_h = {rate}\n");
    let aurora = |name: &str| format!("[[aurora]]\nname = \"{name}\"\nparticles = {{ count = 400 }}\n");
    let mut pairs = vec![
        [rain("r", 60.0), rain("s", 20.0)],
        [rain("r", 60.0), sheet("a", 0.0, "sparks = { rate = 60 }")],
        [rain("r", 60.0), gas("g", 0.0)],
        [aurora("north"), sheet("a", 0.0, "")],
    ];
    for distance in [0.0, 0.01, 0.07, 0.2, 0.5, 1.5] {
        let soot = "method = \"soot_field\"";
        pairs.push([sheet("a", 0.0, ""), sheet("b", -distance, "sparks = { rate = 60 }")]);
        pairs.push([sheet("z", 0.0, soot), sheet("b", -distance, "")]);
    }
    for distance in [0.03, 0.2] {
        pairs.push([sheet("a", 0.0, "sparks = { rate = 60 }"), gas("g", -distance)]);
        pairs.push([gas("g", 0.0), gas("h", -distance)]);
    }
    for [first, second] in &pairs {
        let difference = greatest_difference(&draw(&[first, second]), &draw(&[second, first]));
        assert!(difference < 1e-5, "swapping changes values by {difference} of the greatest:\n{first}{second}");
    }
    let upward = HEADER.replace("target = [0, 0.9, 0]", "target = [0, 60, -60]");
    let [north, south] = [aurora("north"), aurora("south")];
    let [one, other] = [draw_with(&upward, &[&north, &south]), draw_with(&upward, &[&south, &north])];
    assert!(greatest_difference(&one, &other) < 1e-5, "swapping auroras changes the picture");
}

/// `C = C1 + (1 - a1) C2` of two pictures that were drawn alone: gray soot before what is behind it.
fn composited(near: &Frame, far: &Frame) -> Vec<f32> {
    let pixels = near.beauty.pixels().iter().zip(far.beauty.pixels());
    pixels.flat_map(|(near, far)| [0, 1, 2, 3].map(|c| near[c] + (1.0 - near[3]) * far[c])).collect()
}

#[test]
fn the_nearer_sheet_hides_the_farther_one_as_its_opacity_says() {
    let header = HEADER.split("[[light]]").next().unwrap();
    let draw = |tables: &[&str]| draw_with(header, tables);
    for distance in [0.01, 0.05, 0.2, 0.39, 1.0] {
        // The smoke of one sheet is lit by the other one, which is not drawn where it stands alone.
        let [near, far] = [("near", 0.0), ("far", -distance)].map(|(name, z)| {
            format!(
                "[[flame_sheet]]\nname = \"{name}\"\nposition = [0, 0, {z}]\ncolor = {{ soot_optical_depth = 3 }}\n\
                 smoke = {{ optical_depth = 1, albedo = 0 }}\n"
            )
        });
        let expected = composited(&draw(&[&near]), &draw(&[&far]));
        let most = expected.iter().copied().fold(0.0, f32::max);
        for tables in [[&*near, &*far], [&*far, &*near]] {
            let drawn = draw(&tables);
            let differences = drawn.beauty.pixels().as_flattened().iter().zip(&expected).map(|(a, b)| (a - b).abs());
            let greatest = differences.fold(0.0, f32::max) / most;
            assert!(greatest < 1e-5, "{distance} m behind: {greatest} of the greatest value\n{}", tables.concat());
        }
    }
}

#[test]
fn sparks_are_seen_from_above_and_in_the_wind() {
    // They rise toward the camera and drift away, out of the depth at which the flame stands.
    let text = "bansho = 2\n[picture]\nsize = [64, 64]\nexposure_ev100 = 9\n[camera]\nposition = [0, 6, 0.01]\ntarget = [0, 0, 0]\n\
                [wind]\nvelocity = [0, 0, 0]\n[[flame_sheet]]\ncolor = { luminance = 0 }\nsparks = { rate = 400, speed = 4 }\n";
    let light = |more: &str| -> f32 {
        let scene = Scene::parse("scene.toml", &format!("{text}{more}"), KINDS).unwrap();
        let mut shot = Planned::new(scene, &PlanOptions::default(), Arc::new(MemoryAssets::default())).open();
        bansho::draw(&mut shot, 50, &Unobserved).unwrap().beauty.pixels().iter().map(|pixel| pixel[1]).sum()
    };
    // Rain that is hardly there is at all depths, and lets the sheet have slices before and behind it.
    let (alone, with_rain) = (light(""), light("[[rain]]\nrate_mm_per_h = 0\n"));
    assert!(alone > 0.0 && (alone / with_rain - 1.0).abs() < 1e-4, "{alone} {with_rain}");
}

#[test]
fn things_that_cross_in_a_pan_are_the_same_in_any_order_and_on_any_number_of_threads() {
    let header = "bansho = 2\n[picture]\nsize = [80, 60]\nfps = 24\nexposure_ev100 = 7\n\
         [camera]\nposition = [0, 1, 5]\nshutter_s = 0.04\n\
         target = { keys = [[0, [-1, 0.9, 0]], [0.25, [1, 0.9, 0]]], interpolation = \"linear\" }\n";
    let mut tables = [
        "[sky]\nluminance = 5\ntrees_deg = 5\n",
        "[ground]\n",
        "[[light]]\nposition = [0.3, 1.7, 0.2]\nintensity = 900\nvisible = true\nradius = 0.2\n",
        "[[obstacle]]\nvisible = true\nposition = [-0.4, 0.8, 0]\n",
        "[[rain]]\nrate_mm_per_h = 20\n",
        "[[flame_sheet]]\nname = \"b\"\nsmoke = { optical_depth = 1 }\n",
        "[[flame_sheet]]\nname = \"a\"\nposition = [0.2, 0.1, -0.3]\nsmoke = { optical_depth = 1 }\n",
    ];
    let drawn = |threads: usize, tables: &[&str]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| draw_with(header, tables))
    };
    let expected = drawn(1, &tables);
    assert_eq!(drawn(3, &tables).beauty, expected.beauty);
    tables.reverse();
    assert!(greatest_difference(&drawn(2, &tables), &expected) < 1e-5);
}
