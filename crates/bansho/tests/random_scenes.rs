//! Random valid scenes of every phenomenon draw a small frame: no panic, no NaN.
//!
//! `BANSHO_RANDOM_SCENES` is their number, `BANSHO_RANDOM_SEED` the first seed. Seeds that failed once are in `random_seeds.txt` and are always
//! tested first.

use std::{panic, sync::Arc};

use bansho::{FogParameters, KINDS, phenomena};
use bansho_base::{
    camera::CameraParameters,
    color,
    host::{
        assets::{Encoding, MemoryAssets, Picture},
        observer::Unobserved,
    },
    image::Image,
    math::random::{Key, Purpose, uniform},
    parameters::{Parameters, Reader, Table, Value, sample},
    tables,
};
use bansho_render::{
    CompiledScene, Plan, PlanOptions, Shot,
    display::{BitDepth, display},
};
use bansho_scene::{Scene, SceneOptions};
use rayon::prelude::*;

/// Default of `BANSHO_RANDOM_SCENES`, which is larger in `.ci/long`.
const SCENES: u64 = 250;

#[test]
fn scenes_that_failed_once_draw_finite_pictures() {
    let kept = include_str!("random_seeds.txt").lines().filter(|line| !line.starts_with('#'));
    let seeds: Vec<u64> = kept.map(|line| line.parse().expect("a seed a line")).collect();
    assert!(!seeds.is_empty());
    let outcomes: Vec<Outcome> = seeds.into_par_iter().map(outcome).collect();
    assert_finite(&outcomes);
}

#[test]
fn random_valid_scenes_draw_finite_pictures() {
    let (asked, first) = (number("BANSHO_RANDOM_SCENES").unwrap_or(SCENES), number("BANSHO_RANDOM_SEED").unwrap_or(0));
    // Some parameters do not go together, such as core and fringe wider than the sheet, and are refused: fewer than one scene in four.
    let tried = asked + asked.div_ceil(3);
    let outcomes: Vec<Outcome> = (first..first + tried).into_par_iter().map(outcome).collect();
    assert_finite(&outcomes);
    let drawn = outcomes.iter().filter(|outcome| matches!(outcome, Outcome::Drawn)).count() as u64;
    assert!(drawn >= asked, "only {drawn} of {tried} scenes were valid");
}

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

/// The result of drawing a scene.
enum Outcome {
    Drawn,
    Refused,
    /// The seed of a scene that panicked, and the message.
    Failed(u64, String),
}

fn outcome(seed: u64) -> Outcome {
    match panic::catch_unwind(|| draw(&scene(seed))) {
        Ok(true) => Outcome::Drawn,
        Ok(false) => Outcome::Refused,
        Err(said) => {
            let text = said.downcast_ref::<String>().cloned();
            Outcome::Failed(seed, text.or_else(|| Some((*said.downcast_ref::<&str>()?).to_owned())).unwrap_or_default())
        }
    }
}

/// All failures at once, each with its seed, which belongs into `random_seeds.txt` then.
fn assert_finite(outcomes: &[Outcome]) {
    let each = outcomes.iter().filter_map(|outcome| match outcome {
        Outcome::Failed(seed, said) => Some(format!("seed {seed} (to be added to random_seeds.txt): {said}")),
        Outcome::Drawn | Outcome::Refused => None,
    });
    let failed: Vec<String> = each.collect();
    assert!(failed.is_empty(), "{}", failed.join("\n\n"));
}

/// Name of the picture that flame sheets may have as texture.
const TEXTURE: &str = "texture.png";

/// Draws a frame of a scene that is valid; `false` for one whose parameters do not go together.
fn draw(text: &str) -> bool {
    let mut assets = MemoryAssets::default();
    let texels = (0..35).map(|index| [0.3 + 0.02 * index as f32, 0.5, 0.4, 1.0]).collect();
    let texture = Image::from_pixels(5, 7, texels).expect("5 x 7 pixels");
    assets.insert_picture(TEXTURE, Picture::opaque(texture, Encoding::DisplaySrgb));
    let assets = Arc::new(assets);
    let Ok(mut scene) = Scene::parse("random.toml", text, KINDS) else { return false };
    scene.picture.overscan = scene.picture.overscan.min(2);
    let number = scene.picture.first_frame + 1;
    let options =
        PlanOptions { size: Some([17, 11]), overscan: true, layers: true, aovs: true, ..PlanOptions::default() };
    let scene = scene.with_options(&SceneOptions::default()).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let Ok(compiled) = CompiledScene::build(Arc::new(scene), assets, None) else { return false };
    let compiled = Arc::new(compiled);
    let plan = Plan::new(&compiled, &options).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let mut shot = Shot::open(compiled, Arc::new(plan));
    let frame = bansho::draw(&mut shot, number, &Unobserved).unwrap();
    let channels = frame.channels.iter().flat_map(|channel| &channel.values);
    let mut values = frame.beauty.pixels().iter().flatten().chain(channels);
    assert!(values.all(|value| value.is_finite()), "{text}");
    assert!(frame.depth.iter().flatten().all(|depth| *depth >= 0.0), "{text}");
    display(&frame, &color::View::DISPLAY, BitDepth::Eight, color::AlphaConvention::Encoded);
    true
}

/// A phenomenon, in every eighth scene one of each, under random shared tables.
fn scene(seed: u64) -> String {
    let key = Key::new(seed, "random scene");
    let mut drawn = 0;
    let mut uniform = || {
        drawn += 1;
        f64::from(uniform(key.words(drawn, 0, Purpose(0))[0]))
    };
    let mut text = String::from("bansho = 2\n");
    for shared in tables::shared(KINDS).filter(|shared| !["plate", "fog"].contains(&shared.key)) {
        let mut table = sample((shared.table)(), &mut uniform);
        // Random tables name no files, so no obstacle can be a mesh; the size of the picture is fixed.
        // The settings of a camera go together only, and not with an exposure.
        let settings = ["f_number", "exposure_time_s", "iso"].map(|key| ("picture", key));
        let left_out = [&settings[..], &[("obstacle", "shape"), ("picture", "size")]].concat();
        table.entries.retain(|entry| !left_out.contains(&(shared.key, entry.key.as_str())));
        let camera = CameraParameters::read_table(&table, &mut Reader::new(), &[]);
        // Exposures of seconds are the mean of many parts: most scenes have a usual one.
        if shared.key == "camera" && !seed.is_multiple_of(16) {
            for entry in table.entries.iter_mut().filter(|entry| entry.key == "shutter_s") {
                if let Value::Number(seconds) = &mut entry.node.value {
                    *seconds *= 0.01;
                }
            }
        }
        if shared.key == "camera" && camera.fov_of_focal_length().is_some_and(|[_, widest]| widest > 170.0) {
            table.entries.retain(|entry| entry.key != "focal_length_mm");
        }
        text += &lines(&shared.header(), &table);
    }
    for (index, kind) in phenomena().enumerate() {
        let mut table = sample((kind.table)(), &mut uniform);
        keep_small(&mut table, kind.key);
        keep_compatible(&mut table, kind.key);
        // Most random shapes are refused: flames wider than their sheet, auroras that cross. Most scenes do without, so that they
        // are drawn.
        if !seed.is_multiple_of(4) {
            table.entries.retain(|entry| !["shape", "shapes"].contains(&entry.key.as_str()));
        }
        // A scene is refused if one of its phenomena is, so most scenes have only one.
        if seed.is_multiple_of(8) || seed as usize % phenomena().count() == index {
            text += &lines(&format!("[[{}]]", kind.key), &table);
        }
    }
    // Fog hides much, so most scenes have none.
    if seed.is_multiple_of(4) {
        text += &lines("[fog]", &sample(FogParameters::table(), &mut uniform));
    }
    text
}

/// Leaves out a choice that another choice of the same table does not allow: most random tables would be refused for it.
fn keep_compatible(table: &mut Table, kind: &str) {
    let is = |table: &Table, key: &str, name: &str| {
        let found = table.entries.iter().find(|entry| entry.key == key).map(|entry| &entry.node.value);
        matches!(found, Some(Value::Text(text)) if text == name)
    };
    if kind == "flame_sheet" && is(table, "method", "soot_field") {
        // A soot field has no texture to show.
        table.entries.retain(|entry| entry.key != "stage");
    }
    let rendering = table.entries.iter_mut().find(|entry| entry.key == "rendering").map(|entry| &mut entry.node.value);
    if let (true, Some(Value::Table(rendering))) = (kind == "aurora", rendering) {
        // The thesis's color table has no other lines than those of its hard spheres.
        let has_five_lines = is(rendering, "energy_deposition", "hard_sphere");
        rendering.entries.retain(|entry| has_five_lines || entry.key != "color_matching");
        // Nor are single photons drawn by other rules.
        let has_photons = is(rendering, "sampling", "single_photons");
        rendering.entries.retain(|entry| has_five_lines || !has_photons || entry.key != "sampling");
    }
    let texture = table.entries.iter_mut().find(|entry| entry.key == "texture").map(|entry| &mut entry.node.value);
    if let (true, Some(Value::Table(texture))) = (kind == "flame_sheet", texture)
        && is(texture, "kind", "picture")
    {
        texture.entries.retain(|entry| entry.key != "file");
        texture.push("file", Value::Text(TEXTURE.into()));
    }
}

/// Keeps a simulation short and rain near, and leaves out meshes, which random tables cannot name.
fn keep_small(table: &mut Table, kind: &str) {
    let mut drop = |keys: &[&str]| table.entries.retain(|entry| !keys.contains(&entry.key.as_str()));
    match kind {
        "flame_particles" => {
            drop(&["particles", "burners", "step_s", "preroll_s", "domain_min", "domain_max"]);
            table.push("particles", Value::Integer(60));
            table.push("preroll_s", Value::Number(0.2));
        }
        "flame_volume" => {
            drop(&["burners", "resolution", "quality", "step_s", "preroll_s", "domain_min", "domain_max"]);
            table.push("resolution", Value::Number(11.0));
            table.push("preroll_s", Value::Number(0.1));
        }
        "rain" => drop(&["distance", "diameters_mm"]),
        "aurora" => {
            drop(&["particles", "preroll_s"]);
            table.push("particles", one("count", 500));
            table.push("preroll_s", Value::Number(0.1));
            match table.entries.iter_mut().find(|entry| entry.key == "field").map(|entry| &mut entry.node.value) {
                Some(Value::Table(field)) => {
                    field.entries.retain(|entry| entry.key != "cells");
                    field.push("cells", Value::Integer(48));
                }
                _ => table.push("field", one("cells", 48)),
            }
        }
        _ => {}
    }
}

/// A table with one integer.
fn one(key: &str, value: i64) -> Value {
    let mut table = Table::default();
    table.push(key, Value::Integer(value));
    Value::Table(table)
}

fn lines(header: &str, table: &Table) -> String {
    let lines = table.entries.iter().map(|entry| format!("{} = {}\n", entry.key, entry.node.value));
    format!("{header}\n{}", lines.collect::<String>())
}
