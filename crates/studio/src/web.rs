//! The program in a web page: on the canvas `studio`, with the example scene named in the URL's fragment.

use std::{cell::Cell, path::Path, rc::Rc, sync::Arc};

use bansho::Assets;
use bansho_studio::{
    app::{Session, Studio, function_keys},
    document::Document,
    player::{Player, PolledPlayer, WorkerPlayer},
    scenes::examples::BundledAssets,
};
use eframe::egui::{self, Context};
use wasm_bindgen::{JsCast, JsValue, closure::Closure};
use web_sys::{Event, HtmlCanvasElement, KeyboardEvent, Window};

/// The example that is shown without a fragment.
const FIRST: &str = "campfire";

pub(super) async fn main() {
    if let Err(reason) = start().await {
        show_status(&format!("The studio cannot start here: {reason:?}. It needs WebGPU or WebGL 2."));
    }
}

async fn start() -> Result<(), JsValue> {
    let window = web_sys::window().ok_or("there is no window")?;
    let document = window.document().ok_or("there is no page")?;
    let canvas = document.get_element_by_id("studio").ok_or("there is no canvas")?;
    let canvas: HtmlCanvasElement = canvas.dyn_into()?;
    prevent_default_keys(&window)?;
    let named = window.location().hash()?.trim_start_matches('#').to_owned();
    let creator: eframe::AppCreator<'static> = Box::new(move |creation| {
        let ctx = creation.egui_ctx.clone();
        let session = Session::new(scene(&named), None, player(ctx), no_folder);
        let page =
            Page { studio: Studio::new(session, None), shown_notice: String::new(), unsaved: ask_before_leaving() };
        Ok(Box::new(page))
    });
    eframe::WebRunner::new().start(canvas, eframe::WebOptions::default(), creator).await?;
    show_status("");
    Ok(())
}

/// The studio, and the state of the page around its canvas.
struct Page {
    studio: Studio,
    /// The message in the page.
    shown_notice: String,
    /// Whether the browser asks before the page is left.
    unsaved: Rc<Cell<bool>>,
}

impl eframe::App for Page {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.studio.ui(ui);
        self.unsaved.set(self.studio.has_unfinished_work());
        let session = self.studio.session();
        let notice = session.notice().unwrap_or_default();
        if self.shown_notice != notice {
            notice.clone_into(&mut self.shown_notice);
            // Screen readers do not read the canvas.
            write("notice", notice);
        }
    }

    fn on_exit(&mut self) {
        self.studio.on_exit();
    }
}

/// Lets the browser ask before the page is left while the returned flag is set.
fn ask_before_leaving() -> Rc<Cell<bool>> {
    let unsaved = Rc::new(Cell::new(false));
    let is_unsaved = unsaved.clone();
    let on_before_unload = Closure::<dyn FnMut(Event)>::new(move |event: Event| {
        if is_unsaved.get() {
            event.prevent_default();
        }
    });
    if let Some(window) = web_sys::window() {
        window.set_onbeforeunload(Some(on_before_unload.as_ref().unchecked_ref()));
    }
    // The callback lives as long as the page.
    on_before_unload.forget();
    unsaved
}

/// Prevents the browser's default action for the function keys that the studio uses: F12 would open the developer tools.
fn prevent_default_keys(window: &Window) -> Result<(), JsValue> {
    let on_key_down = Closure::<dyn FnMut(KeyboardEvent)>::new(|event: KeyboardEvent| {
        let plain = !(event.ctrl_key() || event.alt_key() || event.meta_key());
        if plain && function_keys().any(|key| key == event.key()) {
            event.prevent_default();
        }
    });
    window.add_event_listener_with_callback_and_bool("keydown", on_key_down.as_ref().unchecked_ref(), true)?;
    // The callback lives as long as the page.
    on_key_down.forget();
    Ok(())
}

/// A player in a worker, or one in time slices of the page if the browser cannot start workers.
fn player(ctx: Context) -> Box<dyn Player> {
    match WorkerPlayer::start(move || ctx.request_repaint()) {
        Ok(player) => Box::new(player),
        Err(_) => Box::<PolledPlayer>::default(),
    }
}

/// The example `name`, or the first one.
fn scene(name: &str) -> Document {
    match bansho_example_scenes::find(name).or_else(|| bansho_example_scenes::find(FIRST)) {
        Some(scene) => Document::new(format!("{}.toml", scene.name), scene.text),
        None => Document::new("scene.toml", "bansho = 2\n"),
    }
}

/// A page has no folders.
fn no_folder(_: &Path) -> Arc<dyn Assets> {
    Arc::new(BundledAssets::default())
}

/// Shows `text` in the middle of the page.
fn show_status(text: &str) {
    write("status", text);
}

/// Writes `text` into the element `id`.
fn write(id: &str, text: &str) {
    let document = web_sys::window().and_then(|window| window.document());
    if let Some(element) = document.and_then(|document| document.get_element_by_id(id)) {
        element.set_text_content(Some(text));
    }
}
