//! A crop has the same pixels as the whole picture: light, depth, layers and AOVs, to the bit.

use std::sync::Arc;

use bansho::KINDS;
use bansho_base::{
    frame::Frame,
    host::{assets::MemoryAssets, observer::Unobserved},
    image::Rect,
};
use bansho_render::PlanOptions;
use bansho_scene::Scene;

use crate::support::Planned;

const SIZE: [usize; 2] = [101, 67];
/// Crops that begin and end at odd pixels, so that their strips and vectors are never aligned with those of the whole picture.
const PARTS: [[usize; 4]; 6] =
    [[13, 7, 41, 29], [50, 33, 51, 34], [0, 19, 101, 5], [37, 0, 3, 67], [59, 41, 1, 1], [3, 1, 9, 11]];

fn draw(text: &str, frame: i64, crop: Option<Rect>) -> Frame {
    let assets = Arc::new(MemoryAssets::default());
    let scene = Scene::parse("scene.toml", text, KINDS).unwrap_or_else(|error| panic!("{error}"));
    let options = PlanOptions { size: Some(SIZE), crop, layers: true, aovs: true, ..PlanOptions::default() };
    let mut shot = Planned::new(scene, &options, assets).open();
    bansho::draw(&mut shot, frame, &Unobserved).unwrap()
}

/// Every plane of a frame, by its name.
fn planes(frame: &Frame) -> Vec<(String, Vec<f32>)> {
    let beauty = ["R", "G", "B", "A"].into_iter().enumerate();
    let mut planes: Vec<(String, Vec<f32>)> =
        beauty.map(|(c, name)| (name.into(), frame.beauty.pixels().iter().map(|pixel| pixel[c]).collect())).collect();
    planes.extend(frame.depth.clone().map(|depth| ("Z".into(), depth)));
    planes.extend(frame.channels.iter().map(|channel| (channel.name.clone(), channel.values.clone())));
    planes
}

fn assert_parts_agree(text: &str, frame: i64) {
    let whole = planes(&draw(text, frame, None));
    assert!(whole.iter().filter(|(name, _)| name.contains('.')).count() > 4);
    for [x, y, width, height] in PARTS {
        let part = planes(&draw(text, frame, Some(Rect { x, y, width, height })));
        assert_eq!(part.len(), whole.len());
        for ((name, whole), (_, part)) in whole.iter().zip(&part) {
            for (index, value) in part.iter().enumerate() {
                let there = whole[(y + index / width) * SIZE[0] + x + index % width];
                let same = value.to_bits() == there.to_bits();
                assert!(same, "{name} of {:?} at {index}: {value} and {there}\n{text}", [x, y, width, height]);
            }
        }
    }
}

#[test]
fn of_flame_sheets_with_sparks_and_smoke() {
    let sheet = "[[flame_sheet]]\nsparks = { rate = 60 }\nsmoke = { optical_depth = 0.6 }\n";
    assert_parts_agree(&format!("bansho = 2\n{sheet}"), 9);
    assert_parts_agree(&format!("bansho = 2\n{sheet}texture = {{ kind = \"ohshima_itahashi\" }}\n"), 9);
    assert_parts_agree(&format!("bansho = 2\n{sheet}method = \"soot_field\"\n"), 9);
}

#[test]
fn of_particle_flames() {
    // Fine sprites, which leave many columns empty, and coarse ones.
    for lines in [
        "burners = [{ diameter = 0.3 }]\n",
        "rendering = { heat_haze_gain = 2.0 }\n",
        "rendering = { sprite = \"poly6\" }\n",
    ] {
        let text =
            format!("bansho = 2\n[[flame_particles]]\nparticles = 3000\npreroll_s = 1\n{lines}[sky]\n[ground]\n");
        assert_parts_agree(&text, 4);
    }
    let far = "[camera]\nposition = [0.0, 1.0, 14.0]\ntarget = [0.3, 0.8, 0.0]\n";
    assert_parts_agree(&format!("bansho = 2\n[[flame_particles]]\nparticles = 2000\npreroll_s = 1\n{far}"), 4);
}

#[test]
fn of_volume_flames() {
    let fire = "[[flame_volume]]\nresolution = 14\npreroll_s = 0.6\n";
    assert_parts_agree(&format!("bansho = 2\n{fire}[sky]\n[ground]\n"), 4);
    let smoke = "fuel = \"heptane\"\n[[obstacle]]\nvisible = true\nposition = [0, 0.4, 0]\n[[light]]\n";
    assert_parts_agree(&format!("bansho = 2\n{fire}{smoke}"), 4);
    assert_parts_agree(&format!("bansho = 2\n[camera]\nlens = \"fisheye\"\nposition = [0, 0.5, 1.2]\n{fire}"), 4);
}

#[test]
fn of_rain_among_lamps_over_wet_ground() {
    assert_parts_agree("bansho = 2\n[[rain]]\n", 3);
    assert_parts_agree("bansho = 2\n[[rain]]\nmethod = \"billboards\"\n[camera]\nlens = \"fisheye\"\n", 3);
}

#[test]
fn of_rain_beside_an_obstacle() {
    // A pixel beside the obstacle's edge must not depend on whether the crop contains other pixels of the edge.
    let around = "[[obstacle]]\nvisible = true\nposition = [0, 0.4, 0]\n[[light]]\n[[flame_sheet]]\n";
    for method in ["drops", "billboards", "textures"] {
        assert_parts_agree(&format!("bansho = 2\n{around}[[rain]]\nmethod = \"{method}\"\n"), 4);
    }
}

#[test]
fn of_auroras() {
    let small = "[[aurora]]\npreroll_s = 0.2\nparticles = { count = 4000 }\nfield = { cells = 96 }\n";
    assert_parts_agree(&format!("bansho = 2\n{small}"), 2);
}

#[test]
fn of_phenomena_that_interleave() {
    let text = "bansho = 2\n[[flame_sheet]]\n[[flame_particles]]\nposition = [0.3, 0, 0.2]\nparticles = 1500\npreroll_s = 1\n\
                [[rain]]\n[ground]\nwetness = 0.9\n[sky]\n[[light]]\nvisible = true\nposition = [0.5, 1, -2]\n";
    assert_parts_agree(text, 4);
}

#[test]
fn of_things_that_cross_in_a_pan() {
    let text = "bansho = 2\n[camera]\nposition = [0, 1.5, 6]\nshutter_s = 0.04\n\
         target = { keys = [[0, [-1, 1, 0]], [0.2, [1, 1, 0]]], interpolation = \"linear\" }\n\
         [sky]\nluminance = 5\ntrees_deg = 5\n[ground]\n\
         [[light]]\nposition = [0.3, 1.7, 0.2]\nintensity = 900\nvisible = true\nradius = 0.2\n\
         [[obstacle]]\nvisible = true\nposition = [-0.4, 0.8, 0]\n[[rain]]\nrate_mm_per_h = 20\n\
         [[flame_sheet]]\nwidth = 0.9\nheight = 1.6\nsmoke = { optical_depth = 1 }\n";
    assert_parts_agree(text, 2);
}

#[test]
fn with_glare_from_around_the_crop() {
    // About one and three pixels for a degree, so that crops have margins within the picture, and beyond it.
    for fov_deg in [65.0, 22.0] {
        let camera = format!(
            "[camera]\nposition = [0, 1.2, 5]\ntarget = [0, 1, 0]\nvertical_fov_deg = {fov_deg}\nglare = 0.1\n"
        );
        let flame = "[[flame_sheet]]\n[ground]\n[sky]\n[[light]]\nvisible = true\nposition = [0.7, 1.4, -1]\n";
        assert_parts_agree(&format!("bansho = 2\n{flame}{camera}"), 3);
        // Hot air, for which the whole picture is drawn.
        let gas = "[[flame_particles]]\nparticles = 1500\npreroll_s = 1\n[sky]\n[ground]\n";
        assert_parts_agree(&format!("bansho = 2\n{gas}{camera}"), 3);
    }
    let panorama = "[camera]\nlens = \"panorama\"\nglare = 0.1\n[[flame_sheet]]\n[ground]\n";
    assert_parts_agree(&format!("bansho = 2\n{panorama}"), 3);
}
