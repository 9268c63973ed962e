//! The glare of the camera in pictures: it keeps the light, alpha and depth, leaves plates as they are, and is a layer of its own.

use std::sync::Arc;

use bansho::{GlareUse, KINDS, PlanOptions};
use bansho_base::{
    frame::Frame,
    host::{
        assets::{Encoding, MemoryAssets, Picture},
        observer::Unobserved,
    },
    image::Image,
};
use bansho_scene::Scene;

use crate::support::Planned;

const SIZE: [usize; 2] = [120, 90];
const FLAME: &str = "[[flame_sheet]]\nwidth = 0.5\nheight = 0.7\nposition = [0, 0.55, 0]\n\
                     [camera]\nposition = [0, 0.9, 6]\ntarget = [0, 0.9, 0]\nvertical_fov_deg = 40\n";

fn plan(text: &str, options: &PlanOptions, assets: MemoryAssets) -> Planned {
    let scene = Scene::parse("scene.toml", text, KINDS).unwrap_or_else(|error| panic!("{error}"));
    Planned::new(scene, options, Arc::new(assets))
}

/// Frame 5 of a scene, with a plate of this light if there is any.
fn drawn(text: &str, plate: Option<[f32; 3]>, options: &PlanOptions) -> Frame {
    let mut assets = MemoryAssets::default();
    let mut text = format!("bansho = 2\n[picture]\nexposure_ev100 = 9\nsize = {SIZE:?}\n{text}");
    if let Some([r, g, b]) = plate {
        // Brighter from left to right, so that its own glare would show.
        let pixels = (0..SIZE[0] * SIZE[1]).map(|i| [r, g, b, 1.0].map(|v: f32| v * (i % SIZE[0]) as f32)).collect();
        let image = Image::from_pixels(SIZE[0], SIZE[1], pixels).unwrap();
        assets.insert_picture("plate", Picture::opaque(image, Encoding::LinearAcescg));
        text.push_str("[plate]\nimage = \"plate\"\n");
    }
    bansho::draw(&mut plan(&text, options, assets).open(), 5, &Unobserved).unwrap()
}

fn with(glare: f64, text: &str) -> String {
    text.replace("[camera]\n", &format!("[camera]\nglare = {glare}\n"))
}

fn sum(frame: &Frame) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for pixel in frame.beauty.pixels() {
        (0..3).for_each(|c| sums[c] += f64::from(pixel[c]));
    }
    sums
}

#[test]
fn light_is_scattered_and_none_is_lost() {
    let options = PlanOptions::default();
    let [clear, scattered] = [0.0, 0.1].map(|glare| drawn(&with(glare, FLAME), None, &options));
    for (before, after) in sum(&clear).into_iter().zip(sum(&scattered)) {
        assert!((after / before - 1.0).abs() < 2e-3, "{before} became {after}");
    }
    let brightest = |frame: &Frame| frame.beauty.pixels().iter().map(|pixel| pixel[0]).fold(0.0, f32::max);
    assert!(brightest(&scattered) < 0.97 * brightest(&clear));
    let glowing = |frame: &Frame| frame.beauty.pixels().iter().filter(|pixel| pixel[0] > 0.0).count();
    assert!(glowing(&scattered) > 2 * glowing(&clear), "{} and {}", glowing(&scattered), glowing(&clear));
    assert!(scattered.beauty.at(0, 0) == [0.0; 4], "beyond its reach there is nothing");
    assert_eq!(clear.depth, scattered.depth);
    let alpha = |frame: &Frame| frame.beauty.pixels().iter().map(|pixel| pixel[3]).collect::<Vec<_>>();
    assert_eq!(alpha(&clear), alpha(&scattered));
}

#[test]
fn a_plate_has_the_glare_of_its_own_camera() {
    for haze in ["", "[[flame_particles]]\nparticles = 600\npreroll_s = 0.5\nposition = [0, 0.5, 1]\n"] {
        let options = PlanOptions::default();
        let glare_over = |plate: [f32; 3]| {
            let [clear, scattered] =
                [0.0, 0.1].map(|glare| drawn(&with(glare, &format!("{haze}{FLAME}")), Some(plate), &options));
            let pixels = clear.beauty.pixels().iter().zip(scattered.beauty.pixels());
            pixels.map(|(clear, scattered)| scattered[1] - clear[1]).collect::<Vec<_>>()
        };
        let (over_dark, over_bright) = (glare_over([0.0; 3]), glare_over([0.02, 0.03, 0.01]));
        assert!(over_dark.iter().any(|value| *value > 1e-3));
        for (index, (dark, bright)) in over_dark.iter().zip(&over_bright).enumerate() {
            assert!(
                (dark - bright).abs() < 1e-5,
                "{haze:?}, pixel {index}: {dark} over black, {bright} over the plate"
            );
        }
    }
}

#[test]
fn it_is_a_layer_and_part_of_the_sum() {
    let options = PlanOptions { layers: true, ..PlanOptions::default() };
    let frame = drawn(&with(0.1, FLAME), Some([0.001; 3]), &options);
    for (c, suffix) in ["R", "G", "B", "A"].into_iter().enumerate() {
        let layers: Vec<_> =
            frame.channels.iter().filter(|channel| channel.name.ends_with(&format!(".{suffix}"))).collect();
        assert!(layers.iter().any(|channel| channel.name == format!("glare.{suffix}")));
        for (index, pixel) in frame.beauty.pixels().iter().enumerate() {
            let total: f32 = layers.iter().map(|channel| channel.values[index]).sum();
            assert!((total - pixel[c]).abs() < 1e-5, "{suffix} of pixel {index}: {total} is not {}", pixel[c]);
        }
    }
}

#[test]
fn it_is_there_by_default_only_where_it_is_asked_for() {
    for (glare, stated, fraction) in [
        (GlareUse::Stated, None, 0.0),
        (GlareUse::Stated, Some(0.2), 0.2),
        (GlareUse::Always, None, 0.03),
        (GlareUse::Always, Some(0.0), 0.0),
        (GlareUse::Never, Some(0.2), 0.0),
    ] {
        let text = stated.map_or(FLAME.to_owned(), |value| with(value, FLAME));
        let plan = plan(
            &format!("bansho = 2\n{text}"),
            &PlanOptions { glare, ..PlanOptions::default() },
            MemoryAssets::default(),
        );
        assert_eq!(plan.glare, fraction, "{glare:?} {stated:?}");
    }
}

#[test]
fn outside_the_circle_of_a_fisheye_there_is_none() {
    let text = "[[aurora]]\npreroll_s = 0.2\nparticles = { count = 4000 }\nfield = { cells = 96 }\n[camera]\nlens = \"fisheye\"\n";
    let frame = drawn(&with(0.3, text), None, &PlanOptions::default());
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            let [dx, dy] = [x as f64 + 0.5 - 60.0, y as f64 + 0.5 - 45.0];
            let outside = dx * dx + dy * dy > 45.5 * 45.5;
            assert!(!outside || frame.beauty.at(x, y) == [0.0; 4], "({x}, {y}) {:?}", frame.beauty.at(x, y));
        }
    }
}

#[test]
fn the_glare_of_the_picture_replaces_that_of_lamps() {
    let lamp = "[[light]]\nposition = [0, 1, 0]\nintensity = 50\nvisible = true\n\
                [camera]\nposition = [0, 1, 8]\ntarget = [0, 1, 0]\nvertical_fov_deg = 60\n";
    // Almost no glare of the picture: a lamp without the 0.12 % of its own.
    let [own, replaced] = [0.0, 1e-9].map(|glare| drawn(&with(glare, lamp), None, &PlanOptions::default()));
    let around = |frame: &Frame| frame.beauty.pixels().iter().filter(|pixel| pixel[1] > 1e-4).count();
    assert!(around(&own) >= 4 * around(&replaced), "{} and {}", around(&own), around(&replaced));
    for (before, after) in sum(&own).into_iter().zip(sum(&replaced)) {
        assert!((after / before - 1.0).abs() < 0.02, "{before} became {after}");
    }
}
