//! Browser file access: the file chooser, dropped files, files that lie beside the page, and downloads.

use std::{
    cell::RefCell,
    io::{self, Write},
    rc::Rc,
};

use eframe::egui::{Context, DroppedFileHandle};
use wasm_bindgen::{JsCast, JsValue, closure::Closure};
use wasm_bindgen_futures::{JsFuture, spawn_local};
use web_sys::{Blob, File, HtmlAnchorElement, HtmlInputElement, Response, Url};

/// A file that was chosen or dropped.
pub(super) struct ReceivedFile {
    pub(super) name: String,
    pub(super) bytes: Vec<u8>,
}

/// Files that were read and not handled yet.
pub(super) type Inbox = Rc<RefCell<Vec<ReceivedFile>>>;

/// Opens the browser's file chooser. The chosen file is added to `inbox` once it is read.
///
/// # Errors
/// The page cannot open the chooser.
pub(super) fn ask_for_file(inbox: &Inbox, ctx: &Context) -> Result<(), JsValue> {
    let input: HtmlInputElement = element("input")?;
    input.set_type("file");
    let (inbox, ctx, chosen) = (inbox.clone(), ctx.clone(), input.clone());
    let on_change = Closure::once_into_js(move || {
        let Some(file) = chosen.files().and_then(|files| files.get(0)) else { return };
        spawn_local(async move {
            if let Ok(bytes) = bytes_of(&file).await {
                inbox.borrow_mut().push(ReceivedFile { name: file.name(), bytes });
                ctx.request_repaint();
            }
        });
    });
    input.set_onchange(Some(on_change.unchecked_ref()));
    input.click();
    Ok(())
}

/// Adds a file that was dropped on the page to `inbox`, once it is read.
pub(super) fn receive_dropped(file: DroppedFileHandle, inbox: &Inbox, ctx: &Context) {
    let (inbox, ctx) = (inbox.clone(), ctx.clone());
    spawn_local(async move {
        if let Ok(bytes) = file.bytes_async().await {
            inbox.borrow_mut().push(ReceivedFile { name: file.path().display().to_string(), bytes });
            ctx.request_repaint();
        }
    });
}

/// A file that lies beside the page.
pub(super) struct FetchedFile {
    pub(super) name: String,
    /// Its content, or why there is none.
    pub(super) bytes: Result<Vec<u8>, String>,
}

/// Fetches the file at `url`, relative to the page. It is added to `fetched` as `name` once it is here, or cannot be had.
pub(super) fn fetch(url: String, name: String, fetched: &Rc<RefCell<Vec<FetchedFile>>>, ctx: &Context) {
    let (fetched, ctx) = (fetched.clone(), ctx.clone());
    spawn_local(async move {
        let bytes =
            bytes_at(&url).await.unwrap_or_else(|_| Err(format!("{url}: the server of the page does not answer")));
        fetched.borrow_mut().push(FetchedFile { name, bytes });
        ctx.request_repaint();
    });
}

/// The content of the file at `url`, or what the server says instead.
async fn bytes_at(url: &str) -> Result<Result<Vec<u8>, String>, JsValue> {
    let window = web_sys::window().ok_or_else(|| JsValue::from_str("there is no window"))?;
    let response: Response = JsFuture::from(window.fetch_with_str(url)).await?.dyn_into()?;
    if !response.ok() {
        return Ok(Err(format!("{url}: the server of the page answers {}", response.status())));
    }
    let buffer = JsFuture::from(response.array_buffer()?).await?;
    Ok(Ok(js_sys::Uint8Array::new(&buffer).to_vec()))
}

/// The content of a file in the memory of the browser, since WebAssembly memory is small.
#[derive(Default)]
pub(super) struct BlobParts(js_sys::Array);

impl BlobParts {
    /// A file with this content.
    pub(super) fn new(bytes: &[u8]) -> Self {
        Self(js_sys::Array::of1(&js_sys::Uint8Array::from(bytes)))
    }
}

impl Write for BlobParts {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.push(&js_sys::Uint8Array::from(bytes));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Downloads a file called `name`.
///
/// # Errors
/// The page cannot create files.
pub(super) fn download(name: &str, parts: &BlobParts) -> Result<(), JsValue> {
    let blob = Blob::new_with_u8_array_sequence(&parts.0)?;
    let url = Url::create_object_url_with_blob(&blob)?;
    let link: HtmlAnchorElement = element("a")?;
    link.set_href(&url);
    link.set_download(name);
    link.click();
    Url::revoke_object_url(&url)
}

async fn bytes_of(file: &File) -> Result<Vec<u8>, JsValue> {
    let buffer = JsFuture::from(file.array_buffer()).await?;
    Ok(js_sys::Uint8Array::new(&buffer).to_vec())
}

fn element<T: JsCast>(name: &str) -> Result<T, JsValue> {
    let document = web_sys::window().and_then(|window| window.document());
    let document = document.ok_or_else(|| JsValue::from_str("there is no page"))?;
    document.create_element(name)?.dyn_into().map_err(JsValue::from)
}
