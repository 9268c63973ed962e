//! Random valid scenes of every phenomenon draw a small frame: no panic, no NaN.

use std::sync::Arc;

use bansho_base::{
    assets::MemoryAssets,
    color,
    observer::Unobserved,
    parameters::{Table, Value, sample},
    random::{Key, Purpose, uniform},
};
use bansho_render::{
    Backend, CpuBackend, Plan, PlanOptions, Scene,
    display::{BitDepth, display},
    phenomena::KINDS,
    scene::SHARED_TABLES,
};
use rayon::prelude::*;

/// How many, unless `BANSHO_RANDOM_SCENES` says otherwise, as in `.ci/run` and `.ci/long`.
const SCENES: u64 = 250;

#[test]
fn random_valid_scenes_draw_finite_pictures() {
    let asked = std::env::var("BANSHO_RANDOM_SCENES").ok().and_then(|count| count.parse().ok());
    let drawn: usize = (0..asked.unwrap_or(SCENES)).into_par_iter().filter(|&seed| draw(&scene(seed))).count();
    // Some parameters do not go together, such as core and fringe wider than the sheet, and are refused.
    assert!(drawn > 50, "only {drawn} scenes were drawn");
}

/// Draws a frame of a scene that is valid; `false` for one whose parameters do not go together.
fn draw(text: &str) -> bool {
    let assets = Arc::new(MemoryAssets::default());
    let Ok(mut scene) = Scene::parse("random.toml", text, KINDS, assets.as_ref()) else { return false };
    scene.picture.overscan = scene.picture.overscan.min(2);
    let number = scene.picture.first_frame + 1;
    let options = PlanOptions { size: Some([17, 11]), layers: true, aovs: true, ..PlanOptions::default() };
    let plan = Plan::new(scene, &options, assets).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let mut shot = CpuBackend.open(Arc::new(plan)).unwrap();
    shot.advance(number, &Unobserved).unwrap();
    shot.draw(&Unobserved).unwrap();
    let frame = shot.read().unwrap();
    let channels = frame.channels.iter().flat_map(|channel| &channel.values);
    let mut values = frame.beauty.pixels().iter().flatten().chain(channels);
    assert!(values.all(|value| value.is_finite()), "{text}");
    assert!(frame.depth.iter().flatten().all(|depth| *depth >= 0.0), "{text}");
    display(&frame, &color::View::DISPLAY, BitDepth::Eight);
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
    let mut text = String::from("bansho = 1\n");
    for shared in SHARED_TABLES.iter().filter(|shared| shared.key != "plate") {
        let header = if shared.many { format!("[[{}]]", shared.key) } else { format!("[{}]", shared.key) };
        let mut table = sample((shared.table)(), &mut uniform);
        // Random tables name no files, so no obstacle can be a mesh.
        table.entries.retain(|entry| shared.key != "obstacle" || entry.key != "shape");
        text += &lines(&header, &table);
    }
    for (index, kind) in KINDS.iter().enumerate() {
        let mut table = sample((kind.table)(), &mut uniform);
        few_particles(&mut table, kind.key);
        // Most random shapes are refused: flames wider than their sheet, auroras that cross. Most scenes do without, so that they are drawn.
        if !seed.is_multiple_of(4) {
            table.entries.retain(|entry| !["shape", "shapes"].contains(&entry.key.as_str()));
        }
        // Many together are refused if one of them is, so most scenes hold one.
        if seed.is_multiple_of(8) || seed as usize % KINDS.len() == index {
            text += &lines(&format!("[[{}]]", kind.key), &table);
        }
    }
    text
}

/// Keeps a simulation short, and without meshes, which random tables cannot name.
fn few_particles(table: &mut Table, kind: &str) {
    if kind == "flame_particles" {
        table.entries.retain(|entry| !["particles", "burners", "step_s", "preroll_s"].contains(&entry.key.as_str()));
        table.push("particles", Value::Integer(60));
        table.push("preroll_s", Value::Number(0.2));
    }
    if kind == "aurora" {
        table.entries.retain(|entry| !["particles", "preroll_s"].contains(&entry.key.as_str()));
        let mut particles = Table::default();
        particles.push("count", Value::Integer(500));
        table.push("particles", Value::Table(particles));
        table.push("preroll_s", Value::Number(0.1));
    }
}

fn lines(header: &str, table: &Table) -> String {
    let lines = table.entries.iter().map(|entry| format!("{} = {}\n", entry.key, entry.node.value));
    format!("{header}\n{}", lines.collect::<String>())
}
