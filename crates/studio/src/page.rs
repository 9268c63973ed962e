//! The studio in a page: on the canvas `studio`, with the example that the address names after its `#`.

use std::{path::Path, sync::Arc};

use bansho::Assets;
use bansho_studio::{
    app::{Session, Studio},
    document::Document,
    examples::{Bundle, SCENES},
    player::{Player, SlicePlayer, WorkerPlayer},
};
use eframe::egui::Context;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::HtmlCanvasElement;

/// What is shown where the address names nothing.
const FIRST: &str = "campfire";

pub(super) async fn main() {
    if let Err(reason) = start().await {
        say(&format!("The studio cannot start here: {reason:?}. It needs WebGPU or WebGL 2."));
    }
}

async fn start() -> Result<(), JsValue> {
    let window = web_sys::window().ok_or("there is no window")?;
    let document = window.document().ok_or("there is no page")?;
    let canvas = document.get_element_by_id("studio").ok_or("there is no canvas")?;
    let canvas: HtmlCanvasElement = canvas.dyn_into()?;
    let named = window.location().hash()?.trim_start_matches('#').to_owned();
    let build = move |creation: &eframe::CreationContext| {
        let ctx = creation.egui_ctx.clone();
        let session = Session::new(scene(&named), None, player(ctx), no_folder);
        Ok(Box::new(Studio::new(session, None)) as Box<dyn eframe::App>)
    };
    eframe::WebRunner::new().start(canvas, eframe::WebOptions::default(), Box::new(build)).await?;
    say("");
    Ok(())
}

/// A worker, or slices of the page's own time where the browser gives none.
fn player(ctx: Context) -> Box<dyn Player> {
    match WorkerPlayer::start(move || ctx.request_repaint()) {
        Ok(player) => Box::new(player),
        Err(_) => Box::<SlicePlayer>::default(),
    }
}

/// The example `name`, or the first one.
fn scene(name: &str) -> Document {
    let find = |name: &str| SCENES.iter().find(|(file, _)| file.strip_suffix(".toml") == Some(name));
    let (file, text) = find(name).or_else(|| find(FIRST)).copied().unwrap_or(("scene.toml", "bansho = 1\n"));
    Document::new(file, text)
}

/// A page has no folders.
fn no_folder(_: &Path) -> Arc<dyn Assets> {
    Arc::new(Bundle::default())
}

/// Tells the user, in the element `status`.
fn say(text: &str) {
    let document = web_sys::window().and_then(|window| window.document());
    if let Some(status) = document.and_then(|document| document.get_element_by_id("status")) {
        status.set_text_content(Some(text));
    }
}
