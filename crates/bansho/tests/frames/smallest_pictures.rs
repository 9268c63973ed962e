//! Pictures of a single row, column or pixel, and the longest ones: every scene and every phenomenon draws them, with finite pixels.
//!
//! `BANSHO_LARGEST_PICTURES=1`, as in `.ci/long`, also draws pictures of many rows of the greatest length.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use bansho::{
    CompiledScene, Effect, KINDS, Plan, PlanOptions, RainParameters, Shot, Unobserved, base::image::Rect,
    media::assets::FileAssets, scene::edit,
};

/// Sizes that leave a row, a column or a pixel, and one that halves to an odd size.
const SMALLEST: [[usize; 2]; 4] = [[1, 1], [64, 1], [1, 64], [17, 11]];
/// The greatest length of a side, pixels.
const LONGEST: usize = 16_384;

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes")
}

/// A shot of a scene. Simulations start with its first frame: what they have simulated before does not matter here.
fn shot(name: &str, text: &str) -> Shot {
    let mut text = text.to_owned();
    for (key, assignment) in [("aurora", "aurora.preroll_s=0"), ("flame_particles", "flame_particles.preroll_s=0")] {
        if text.contains(&format!("[[{key}]]")) {
            text = edit::set(&text, assignment, KINDS).unwrap_or_else(|error| panic!("{name}: {error}"));
        }
    }
    let scene = bansho::parse_scene(name, &text).unwrap_or_else(|error| panic!("{error}"));
    let compiled = CompiledScene::build(Arc::new(scene), Arc::new(FileAssets::new(scenes())), None);
    let compiled = Arc::new(compiled.unwrap_or_else(|errors| panic!("{name}: {errors}")));
    let options = PlanOptions { size: Some([16, 9]), ..PlanOptions::default() };
    let plan = Plan::new(&compiled, &options).unwrap_or_else(|error| panic!("{name}: {error}"));
    Shot::open(compiled, Arc::new(plan))
}

/// Draws the first frame of a shot in some sizes, all of the same state.
fn draw_in_sizes(name: &str, shot: &mut Shot, sizes: &[[usize; 2]]) {
    let first = shot.plan().scene().picture.first_frame;
    for &[width, height] in sizes {
        let plan = shot.plan().cropped([width, height], Rect::from_size(width, height));
        shot.replace_plan(Arc::new(plan.unwrap_or_else(|error| panic!("{name} at {width} x {height}: {error}"))));
        let frame = bansho::draw(shot, first, &Unobserved).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!([frame.beauty.width(), frame.beauty.height()], [width, height], "{name}");
        let pixels = frame.beauty.pixels().as_flattened();
        assert!(pixels.iter().all(|value| value.is_finite()), "{name} at {width} x {height}");
    }
}

#[test]
fn every_scene_is_drawn_in_a_row_a_column_and_a_pixel() {
    let mut drawn = 0;
    for file in std::fs::read_dir(scenes()).unwrap() {
        let path = file.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let text = std::fs::read_to_string(&path).unwrap();
            draw_in_sizes(&name, &mut shot(&name, &text), &SMALLEST);
            drawn += 1;
        }
    }
    assert!(drawn > 25, "{drawn} scenes");
}

/// Each phenomenon with the scene defaults of its kind, and rain over what mirrors it, by each of its methods and through each lens.
fn phenomena() -> Vec<(String, String)> {
    let alone = bansho::phenomena().map(|kind| (kind.key.to_owned(), format!("bansho = 2\n[[{}]]\n", kind.key)));
    let mut scenes: Vec<_> = alone.collect();
    for method in ["drops", "billboards", "textures"] {
        for (ground, lens) in [
            ("kind = \"land\"\nwetness = 0.9", "panorama"),
            ("kind = \"water\"", "perspective"),
            ("kind = \"water\"", "fisheye"),
        ] {
            let text = format!(
                "bansho = 2\n[camera]\nlens = \"{lens}\"\n[ground]\n{ground}\n[[light]]\nposition = [0, 3, 0]\n\
                 [[rain]]\nmethod = \"{method}\"\nrate_mm_per_h = 30\n"
            );
            scenes.push((format!("rain, {method}, {lens}, {ground}"), text));
        }
    }
    scenes
}

#[test]
fn every_phenomenon_is_drawn_in_the_smallest_and_the_longest_pictures() {
    let mut sizes = [&SMALLEST[..], &[[1, 1080], [LONGEST, 1], [1, LONGEST]]].concat();
    if std::env::var_os("BANSHO_LARGEST_PICTURES").is_some() {
        sizes.extend([[LONGEST, 2048], [2048, LONGEST]]);
    }
    for (name, text) in phenomena() {
        draw_in_sizes(&name, &mut shot(&name, &text), &sizes);
    }
}

#[test]
fn a_running_effect_can_be_shrunk_to_a_row() {
    let mut live = Effect::new(RainParameters::default()).size(64, 36).open().unwrap();
    for (width, height) in [(64, 36), (64, 1), (1, 64), (1, 1), (64, 36)] {
        live.set_size(width, height).unwrap();
        let picture = live.advance(1.0 / 30.0).unwrap();
        let beauty = &picture.frame().beauty;
        assert_eq!([beauty.width(), beauty.height()], [width, height]);
    }
}
