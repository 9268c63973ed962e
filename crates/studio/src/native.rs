//! The studio in a window of the system.

use std::{
    io::Write,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
};

use bansho::{Assets, media::plates::FileAssets};
use bansho_studio::{
    app::{Session, Studio},
    document::{Document, files},
    player::ThreadPlayer,
};
use eframe::egui;

/// What a studio without a scene begins with.
const BEGINNING: &str = "bansho = 1\n\n[[flame_sheet]]\nname = \"fire\"\n";

pub(super) fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let scene = arguments.next().map(PathBuf::from);
    if arguments.next().is_some() || scene.as_ref().is_some_and(|scene| scene.as_os_str() == "--help") {
        return fail("usage: bansho-studio [SCENE]");
    }
    match run(scene) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => fail(&format!("error: {error}")),
    }
}

fn fail(message: &str) -> ExitCode {
    // Nobody is left to be told that this failed.
    let _ = writeln!(std::io::stderr(), "{message}");
    ExitCode::FAILURE
}

fn run(scene: Option<PathBuf>) -> Result<(), Box<dyn std::error::Error>> {
    let document = match &scene {
        Some(path) => files::open(path)?,
        None => Document::new("scene", BEGINNING),
    };
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default().with_title("Bansho Studio").with_inner_size([1400.0, 860.0]),
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
