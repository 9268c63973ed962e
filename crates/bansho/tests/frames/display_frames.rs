//! A frame that is drawn as display pixels, strip by strip, has the bytes of a frame whose light was converted as a whole.

use std::sync::Arc;

use bansho::{AlphaConvention, BitDepth, DisplayOptions, KINDS, PlanOptions, Target, View};
use bansho_base::{
    frame::DisplayPixels,
    host::{assets::MemoryAssets, observer::Unobserved},
    image::Rect,
};
use bansho_scene::Scene;

use crate::support::Planned;

/// Neither side is a multiple of the rows of a strip or of the lanes of a vector.
const SIZE: [usize; 2] = [101, 67];

const FLAME: &str = "[[flame_sheet]]\n";
const HAZE_BEFORE_SKY: &str = "[sky]\n[[flame_particles]]\nparticles = 1500\npreroll_s = 1\n\
                               rendering = { heat_haze_gain = 20.0 }\n";
const MIRROR: &str = "[picture]\noverscan = 5\n[ground]\nkind = \"water\"\n[[flame_sheet]]\n[[rain]]\n";
const AURORA: &str = "[picture]\nwhite_balance_k = 4300\n[[aurora]]\npreroll_s = 0.2\nparticles = { count = 4000 }\n";

/// All ways in which light becomes display pixels.
fn all_options() -> Vec<DisplayOptions> {
    let mut all = Vec::new();
    for view in [View::DISPLAY, View::RAW] {
        for depth in [BitDepth::Eight, BitDepth::Sixteen] {
            for alpha in [AlphaConvention::Encoded, AlphaConvention::Linear] {
                all.extend([false, true].map(|over_black| DisplayOptions { view, depth, alpha, over_black }));
            }
        }
    }
    all
}

/// Draws frame 3 both ways with all options, and returns how many of its pixels are not black and transparent.
fn assert_same(tables: &str, crop: Option<Rect>) -> usize {
    let text = format!("bansho = 2\n{tables}");
    let scene = Scene::parse("scene.toml", &text, KINDS).unwrap_or_else(|error| panic!("{error}"));
    let options = PlanOptions { size: Some(SIZE), crop, ..PlanOptions::default() };
    let mut shot = Planned::new(scene, &options, Arc::new(MemoryAssets::default())).open();
    let light = bansho::draw(&mut shot, 3, &Unobserved).unwrap();
    let mut shown = 0;
    for options in all_options() {
        let drawn = shot.draw(&options, &Unobserved).unwrap();
        let converted = options.of_light(light.clone(), &mut None);
        assert!(drawn == converted, "{options:?} of {crop:?}\n{text}");
        if let DisplayPixels::Eight(pixels) = drawn.image.pixels {
            shown = pixels.iter().filter(|pixel| **pixel != [0; 4]).count();
        }
    }
    shown
}

#[test]
fn strips_have_the_bytes_of_the_whole_frame() {
    for tables in [FLAME, HAZE_BEFORE_SKY, MIRROR, AURORA] {
        assert!(assert_same(tables, None) > 200, "something is seen\n{tables}");
    }
}

#[test]
fn also_of_a_crop_beside_what_is_drawn_or_before_refracting_air() {
    let crop = Rect { x: 41, y: 21, width: 33, height: 29 };
    for tables in [FLAME, HAZE_BEFORE_SKY, AURORA] {
        assert!(assert_same(tables, Some(crop)) > 20, "something is seen\n{tables}");
        assert_same(tables, Some(Rect { x: 1, y: 1, width: 3, height: 11 }));
    }
}
