//! The native program.

use std::{
    io::Write,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::{Arc, mpsc},
};

use bansho::{Assets, media::assets::FileAssets};
use bansho_studio::{
    app::{Session, Studio, window_size},
    bench,
    document::{Document, files},
    player::{StartError, ThreadPlayer},
    scenes::new_scene::FLAME_SHEET,
};

use self::{
    arguments::{Arguments, Mode},
    renderer_choice::RendererChoice,
};
use bansho_egui_software::window::AppCreator;
use eframe::egui;

mod arguments;
mod renderer_choice;

const USAGE: &str = "usage: bansho-studio [--painter auto|gpu|software] [SCENE]
       bansho-studio --bench [NAME]           pictures a second of each phenomenon here
       bansho-studio --bench-window [NAME]    the same with the window, which must not be covered

--painter: what paints the window. `auto`, which is usual, takes a GPU where there is one.";

const TITLE: &str = "Bansho Studio";

pub(super) fn main() -> ExitCode {
    let arguments = match Arguments::parse(std::env::args_os().skip(1)) {
        Ok(arguments) => arguments,
        Err(message) => return fail(&message),
    };
    let renderer = arguments.renderer;
    match arguments.mode {
        Mode::Help => say(USAGE),
        Mode::Bench(wanted) => bench(&wanted),
        Mode::BenchWindow(wanted) => bench_window(renderer, wanted),
        Mode::Scene(scene) => match run(renderer, scene) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => fail(&format!("error: {error}")),
        },
    }
}

/// Measures the studio on the phenomena whose name contains `wanted`.
fn bench(wanted: &str) -> ExitCode {
    for speed in bench::measure(wanted) {
        let bench::Speed { name, frames_per_s, advance_s, draw_s, latency_s } = match speed {
            Ok(speed) => speed,
            Err(error) => return fail(&format!("error: {error}")),
        };
        let [advance, draw, latency] = [advance_s, draw_s, latency_s].map(|seconds| 1000.0 * seconds);
        say(&format!(
            "{name:24} {frames_per_s:6.1} pictures/s ({advance:5.1} ms simulated, {draw:5.1} ms drawn), \
             19 of 20 changes show within {latency:4.0} ms"
        ));
    }
    ExitCode::SUCCESS
}

/// Measures the window on the phenomena whose name contains `wanted`.
fn bench_window(renderer: RendererChoice, wanted: String) -> ExitCode {
    let (sender, results) = mpsc::channel();
    let build: AppCreator = Box::new(move |ctx| {
        let session = session(ctx, Document::new("scene", FLAME_SHEET), None)?;
        Ok(Box::new(bench::WindowBench::new(session, &wanted, sender)))
    });
    if let Err(error) = renderer.show(viewport(window_size(None)), build) {
        return fail(&format!("error: {error}"));
    }
    for speed in results {
        let bench::WindowSpeed { name, frames_per_s, played_size, latency_s, size } = match speed {
            Ok(speed) => speed,
            Err(error) => return fail(&format!("error: {error}")),
        };
        let ([width, height], [whole_width, whole_height]) = (played_size, size);
        say(&format!(
            "{name:24} {frames_per_s:6.1} pictures/s of {width} x {height}, \
             19 of 20 changes painted at {whole_width} x {whole_height} within {:4.0} ms",
            1000.0 * latency_s
        ));
    }
    ExitCode::SUCCESS
}

fn say(message: &str) -> ExitCode {
    // A failure to print cannot be reported.
    let _ = writeln!(std::io::stdout(), "{message}");
    ExitCode::SUCCESS
}

fn fail(message: &str) -> ExitCode {
    // A failure to print cannot be reported.
    let _ = writeln!(std::io::stderr(), "{message}");
    ExitCode::FAILURE
}

fn run(renderer: RendererChoice, scene: Option<PathBuf>) -> Result<(), Box<dyn std::error::Error>> {
    let (opened, error) = match scene.as_deref().map(files::open).transpose() {
        Ok(opened) => (opened, None),
        Err(error) => (None, Some(error.to_string())),
    };
    let build: AppCreator = Box::new(move |ctx| {
        // If the scene cannot be opened, the window shows the error and another scene.
        let scene = scene.filter(|_| opened.is_some());
        let document = opened.unwrap_or_else(|| Document::new("scene", FLAME_SHEET));
        let mut session = session(ctx, document, scene)?;
        session.set_notice(error);
        Ok(Box::new(Studio::new(session, home())))
    });
    renderer.show(viewport(window_size(home().as_deref())), build)
}

fn viewport(size: [f32; 2]) -> egui::ViewportBuilder {
    egui::ViewportBuilder::default().with_title(TITLE).with_inner_size(size)
}

/// A session on `document` from the file `scene`, with a player that requests repaints.
fn session(ctx: &egui::Context, document: Document, scene: Option<PathBuf>) -> Result<Session, StartError> {
    let ctx = ctx.clone();
    let player = ThreadPlayer::start(move || ctx.request_repaint())?;
    Ok(Session::new(document, scene, Box::new(player), assets))
}

fn assets(folder: &Path) -> Arc<dyn Assets> {
    Arc::new(FileAssets::new(folder))
}

/// The folder for settings in the user's data directory.
fn home() -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let base = variable("XDG_DATA_HOME")
        .or_else(|| variable("APPDATA"))
        .or_else(|| Some(variable("HOME")?.join(".local/share")))?;
    Some(base.join("bansho-studio"))
}
