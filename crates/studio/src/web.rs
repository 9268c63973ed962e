//! The program in a web page: on the canvas `studio`, with the example scene named in the URL's fragment.

use std::{cell::Cell, path::Path, rc::Rc, sync::Arc};

use bansho::Assets;
use bansho_studio::{
    app::{Session, Studio, function_keys},
    document::Document,
    player::{Player, PolledPlayer, WorkerPlayer},
    scenes::examples::Bundle,
};
use eframe::egui::{self, Context};
use wasm_bindgen::{JsCast, JsValue, closure::Closure};
use web_sys::{Event, HtmlCanvasElement, KeyboardEvent, Window};

/// The example without a fragment.
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
    keep_keys_from_browser(&window)?;
    let named = window.location().hash()?.trim_start_matches('#').to_owned();
    let build = move |creation: &eframe::CreationContext| {
        let ctx = creation.egui_ctx.clone();
        let session = Session::new(scene(&named), None, player(ctx), no_folder);
        let page = Page { studio: Studio::new(session, None), told: String::new(), unsaved: ask_before_leaving() };
        Ok(Box::new(page) as Box<dyn eframe::App>)
    };
    eframe::WebRunner::new().start(canvas, eframe::WebOptions::default(), Box::new(build)).await?;
    say("");
    Ok(())
}

/// The studio, and what the page around its canvas must know of it.
struct Page {
    studio: Studio,
    /// What the user was told last.
    told: String,
    unsaved: Rc<Cell<bool>>,
}

impl eframe::App for Page {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.studio.ui(ui);
        self.unsaved.set(self.studio.has_unfinished_work());
        let session = self.studio.session();
        let notice = session.notice().unwrap_or_default();
        if self.told != notice {
            notice.clone_into(&mut self.told);
            // Screen readers see no canvas.
            write("notice", notice);
        }
    }

    fn on_exit(&mut self) {
        self.studio.on_exit();
    }
}

/// Whether work would be lost where the page is left, to be kept up to date: the browser asks first then.
fn ask_before_leaving() -> Rc<Cell<bool>> {
    let unsaved = Rc::new(Cell::new(false));
    let asked = unsaved.clone();
    let ask = Closure::<dyn FnMut(Event)>::new(move |event: Event| {
        if asked.get() {
            event.prevent_default();
        }
    });
    if let Some(window) = web_sys::window() {
        window.set_onbeforeunload(Some(ask.as_ref().unchecked_ref()));
    }
    // It asks for as long as the page is open.
    ask.forget();
    unsaved
}

/// Keeps from the browser those function keys that do something here: F12 would open its tools besides.
fn keep_keys_from_browser(window: &Window) -> Result<(), JsValue> {
    let keep = Closure::<dyn FnMut(KeyboardEvent)>::new(|event: KeyboardEvent| {
        let plain = !(event.ctrl_key() || event.alt_key() || event.meta_key());
        if plain && function_keys().any(|key| key == event.key()) {
            event.prevent_default();
        }
    });
    window.add_event_listener_with_callback_and_bool("keydown", keep.as_ref().unchecked_ref(), true)?;
    // It listens for as long as the page is open.
    keep.forget();
    Ok(())
}

/// A worker, or slices of the page's own time where the browser gives none.
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
    Arc::new(Bundle::default())
}

/// Tells the user, in the middle of the page.
fn say(text: &str) {
    write("status", text);
}

/// Writes `text` into the element `id`.
fn write(id: &str, text: &str) {
    let document = web_sys::window().and_then(|window| window.document());
    if let Some(element) = document.and_then(|document| document.get_element_by_id(id)) {
        element.set_text_content(Some(text));
    }
}
