//! The native program `bansho-studio`: its arguments, and its window by a GPU or in software.

use std::{
    io::Write,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
};

use bansho::{Assets, media::assets::FileAssets};
use bansho_studio::{
    app::{Session, Studio, window_size},
    document::{Document, files},
    player::{StartError, ThreadPlayer},
    renderer_choice::RendererChoice,
    scenes::new_scene::FLAME_SHEET,
};

use self::arguments::{Arguments, Mode};
use bansho_egui_software::window::AppCreator;
use eframe::egui;

mod arguments;

const USAGE: &str = "usage: bansho-studio [--painter auto|gpu|software] [SCENE]

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
        Mode::Scene(scene) => match run(renderer, scene) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => fail(&format!("error: {error}")),
        },
    }
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
    let base = folder_of_variable("XDG_DATA_HOME")
        .or_else(|| folder_of_variable("APPDATA"))
        .or_else(|| Some(folder_of_variable("HOME")?.join(".local/share")))?;
    Some(base.join("bansho-studio"))
}

/// The folder that an environment variable names; an empty one names none.
fn folder_of_variable(name: &str) -> Option<PathBuf> {
    std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from)
}
