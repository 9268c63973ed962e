//! The studio in a window of the system.

use std::{
    io::Write,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
};

use bansho::{Assets, media::plates::FileAssets};
use bansho_studio::{
    app::{Session, Studio, window_size},
    beginnings::FLAME_SHEET,
    bench,
    document::{Document, files},
    player::ThreadPlayer,
};
use eframe::egui;

const USAGE: &str =
    "usage: bansho-studio [SCENE]\n       bansho-studio --bench [NAME]    pictures a second of each phenomenon here";

pub(super) fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let first = arguments.next();
    let second = arguments.next();
    let words = |word: &Option<std::ffi::OsString>| word.as_ref().map(|word| word.to_string_lossy().into_owned());
    match (words(&first).as_deref(), words(&second).as_deref()) {
        (Some("--help"), None) => return say(USAGE),
        (Some("--bench"), wanted) => return bench(wanted.unwrap_or_default()),
        (_, Some(_)) => return fail(USAGE),
        _ => {}
    }
    let scene = first.map(PathBuf::from);
    match run(scene) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => fail(&format!("error: {error}")),
    }
}

/// How fast the studio follows hands here, of the phenomena whose name contains `wanted`.
fn bench(wanted: &str) -> ExitCode {
    for speed in bench::measure(wanted) {
        let bench::Speed { name, pictures_per_s, advance_s, draw_s, answer_s } = match speed {
            Ok(speed) => speed,
            Err(error) => return fail(&format!("error: {error}")),
        };
        let [advance, draw, answer] = [advance_s, draw_s, answer_s].map(|seconds| 1000.0 * seconds);
        say(&format!(
            "{name:24} {pictures_per_s:6.1} pictures/s ({advance:5.1} ms simulated, {draw:5.1} ms drawn), 19 of 20 changes show within {answer:4.0} ms"
        ));
    }
    ExitCode::SUCCESS
}

fn say(message: &str) -> ExitCode {
    // Nobody is left to be told that this failed.
    let _ = writeln!(std::io::stdout(), "{message}");
    ExitCode::SUCCESS
}

fn fail(message: &str) -> ExitCode {
    // Nobody is left to be told that this failed.
    let _ = writeln!(std::io::stderr(), "{message}");
    ExitCode::FAILURE
}

fn run(scene: Option<PathBuf>) -> Result<(), Box<dyn std::error::Error>> {
    let document = match &scene {
        Some(path) => files::open(path)?,
        None => Document::new("scene", FLAME_SHEET),
    };
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Bansho Studio")
            .with_inner_size(window_size(home().as_deref())),
        ..eframe::NativeOptions::default()
    };
    let build = |creation: &eframe::CreationContext| {
        let ctx = creation.egui_ctx.clone();
        let player = ThreadPlayer::start(move || ctx.request_repaint())?;
        let session = Session::new(document, scene, Box::new(player), assets);
        Ok(Box::new(Studio::new(session, home())) as Box<dyn eframe::App>)
    };
    Ok(eframe::run_native("Bansho Studio", options, Box::new(build))?)
}

fn assets(folder: &Path) -> Arc<dyn Assets> {
    Arc::new(FileAssets::new(folder))
}

/// Where the user's programs keep their own files.
fn home() -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let base = variable("XDG_DATA_HOME")
        .or_else(|| variable("APPDATA"))
        .or_else(|| Some(variable("HOME")?.join(".local/share")))?;
    Some(base.join("bansho-studio"))
}
