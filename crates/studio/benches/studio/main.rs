//! The studio as its user waits for it, with the phenomena one by one: pictures per second while a scene plays, and the time from an edit to
//! its picture, with document, checks, player and the conversion to an egui image.
//!
//! `cargo bench -p bansho-studio --bench studio -- [--window [--painter auto|gpu|software]] [NAME]` measures the scenes whose name contains
//! NAME; with `--window`, by a window, which must not be covered.

#![allow(clippy::print_stdout, reason = "it reports to the terminal")]

mod scenes;
mod window;

use std::{
    path::Path,
    sync::{Arc, mpsc},
    thread,
    time::{Duration, Instant},
};

use bansho::Assets;
use bansho_studio::{
    app::{Session, color_image},
    document::Document,
    player::ThreadPlayer,
    renderer_choice::RendererChoice,
    scenes::{examples::BundledAssets, new_scene::FLAME_SHEET},
};
use eframe::egui;

use scenes::{BENCH_SCENES, BenchScene, EDITS, PICTURE, percentile_95};
use window::{WindowBench, WindowSpeed};

/// Why a scene cannot be measured.
type Error = Box<dyn std::error::Error + Send + Sync>;

/// Number of frames played.
const PLAYED: i64 = 60;

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let (mut is_bench, mut in_window, mut renderer, mut wanted) =
        (false, false, RendererChoice::default(), String::new());
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            // Given by `cargo bench`.
            "--bench" => is_bench = true,
            // Another program's way to see it start.
            "--test" | "--list" => return Ok(()),
            "--window" => in_window = true,
            "--painter" => renderer = RendererChoice::named(&arguments.next().unwrap_or_default())?,
            option if option.starts_with('-') => return Err(format!("no such option: {option}").into()),
            name => name.clone_into(&mut wanted),
        }
    }
    let wanted: Vec<&BenchScene> = BENCH_SCENES.iter().filter(|scene| scene.name.contains(&wanted)).collect();
    if !is_bench {
        return Ok(());
    }
    if in_window { measure_window(renderer, wanted) } else { wanted.into_iter().try_for_each(measure) }
}

fn bundled_assets(_: &Path) -> Arc<dyn Assets> {
    Arc::new(BundledAssets::default())
}

/// Plays and edits a scene without a window, and prints its speed.
fn measure(scene: &BenchScene) -> Result<(), Error> {
    let player = ThreadPlayer::start(|| {})?;
    let mut session = Session::new(Document::new(scene.name, scene.text()), None, Box::new(player), bundled_assets);
    // Drafts would have fewer particles than the name of the scene says.
    session.draft = false;
    // The first picture includes one-time work.
    wait_for_picture(&mut session, scene)?;
    let began = Instant::now();
    let (mut advance_s, mut draw_s) = (0.0, 0.0);
    for _ in 0..PLAYED {
        session.transport.step(1);
        let [advance, draw] = wait_for_picture(&mut session, scene)?;
        (advance_s, draw_s) = (advance_s + advance, draw_s + draw);
    }
    let pictures_per_s = PLAYED as f64 / began.elapsed().as_secs_f64();
    let mut latencies = Vec::with_capacity(EDITS);
    for step in 0..EDITS {
        let began = Instant::now();
        scene.edit(&mut session, step)?;
        wait_for_picture(&mut session, scene)?;
        latencies.push(began.elapsed().as_secs_f64());
    }
    let [advance, draw] = [advance_s, draw_s].map(|seconds| 1000.0 * seconds / PLAYED as f64);
    println!(
        "{:24} {pictures_per_s:6.1} pictures/s ({advance:5.1} ms simulated, {draw:5.1} ms drawn), \
         19 of 20 changes show within {:4.0} ms",
        scene.name,
        1000.0 * percentile_95(latencies)
    );
    Ok(())
}

/// Updates the session, as the window does, until the current frame of the current revision is drawn at full size. Returns the times to
/// simulate and to draw it, s.
fn wait_for_picture(session: &mut Session, scene: &BenchScene) -> Result<[f64; 2], Error> {
    loop {
        session.update(0.0, PICTURE, false);
        let (revision, number) = (session.document.revision(), session.transport.number());
        if let Some((picture, _)) = session.picture()
            && (picture.revision, picture.number, picture.size) == (revision, number, PICTURE)
        {
            let times = [picture.advance_s, picture.draw_s];
            std::hint::black_box(color_image(picture));
            return Ok(times);
        }
        scene.check(session)?;
        thread::sleep(Duration::from_micros(200));
    }
}

/// Plays and edits the scenes in a window that `renderer` paints, and prints their speed.
fn measure_window(renderer: RendererChoice, scenes: Vec<&'static BenchScene>) -> Result<(), Error> {
    let (sender, results) = mpsc::channel();
    let viewport =
        egui::ViewportBuilder::default().with_title("Bansho Studio, measured").with_inner_size([1560.0, 780.0]);
    let build = Box::new(move |context: &egui::Context| {
        let context = context.clone();
        let player = ThreadPlayer::start(move || context.request_repaint())?;
        let session = Session::new(Document::new("scene", FLAME_SHEET), None, Box::new(player), bundled_assets);
        Ok(Box::new(WindowBench::new(session, scenes, sender)) as Box<_>)
    });
    renderer.show(viewport, build).map_err(|error| error.to_string())?;
    for speed in results {
        let WindowSpeed { name, pictures_per_s, played_size, latency_s, size } = speed?;
        let ([width, height], [whole_width, whole_height]) = (played_size, size);
        println!(
            "{name:24} {pictures_per_s:6.1} pictures/s of {width} x {height}, \
             19 of 20 changes painted at {whole_width} x {whole_height} within {:4.0} ms",
            1000.0 * latency_s
        );
    }
    Ok(())
}
