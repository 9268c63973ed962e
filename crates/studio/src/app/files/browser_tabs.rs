//! Autosave in browser tabs. Tabs of one origin share the local storage. Each stores its unsaved work under a name of its own and holds
//! a lock of that name while it is open (Web Locks API), so that the work of open tabs is not offered for recovery. Without locks, as
//! over plain HTTP, the work of open tabs is offered too; they store it again when it changes.

use std::{cell::RefCell, rc::Rc};

use eframe::egui::Context;
use js_sys::{Array, Function, Promise, Reflect};
use wasm_bindgen::{JsCast, JsValue, closure::Closure};
use wasm_bindgen_futures::{JsFuture, spawn_local};

use crate::{document::files::autosave::RecoveredWork, session::settings_store::SettingsStore};

/// The autosaves of all tabs.
pub(super) struct BrowserTabs {
    store: SettingsStore,
    /// The first word of all names.
    prefix: &'static str,
    /// The name of this tab.
    own: String,
    /// Work of closed tabs; filled once the browser has listed the locks.
    found: Rc<RefCell<Vec<RecoveredWork>>>,
    /// Whether the search for work of closed tabs was started.
    searched: bool,
}

impl BrowserTabs {
    /// Starts autosaving under a new name with the first word `prefix`.
    pub(super) fn begin(store: SettingsStore, prefix: &'static str) -> Self {
        let own = format!("{prefix} {:.0} {:.0}", js_sys::Date::now(), 1e9 * js_sys::Math::random());
        // Without a lock, the work is offered to other tabs too.
        let _ = hold_lock(&own);
        Self { store, prefix, own, found: Rc::default(), searched: false }
    }

    /// Work of closed tabs that was found since the last call.
    pub(super) fn take_found(&mut self, ctx: &Context) -> Vec<RecoveredWork> {
        if !std::mem::replace(&mut self.searched, true) {
            let stored = self.store.names(self.prefix).into_iter().filter(|name| *name != self.own).collect();
            spawn_local(search(self.store.clone(), stored, self.found.clone(), ctx.clone()));
        }
        self.found.take()
    }

    /// Stores `work`, or removes the stored work. Returns whether that succeeded.
    pub(super) fn store(&self, work: Option<&str>) -> bool {
        match work {
            Some(work) => self.store.write(&self.own, work),
            None => {
                self.store.remove(&self.own);
                true
            }
        }
    }
}

/// Finds those of the `stored` names whose locks no open tab holds.
async fn search(store: SettingsStore, stored: Vec<String>, found: Rc<RefCell<Vec<RecoveredWork>>>, ctx: Context) {
    let held = held_locks().await.unwrap_or_default();
    let of_closed_tabs = stored.into_iter().filter(|name| !held.contains(name));
    let work = of_closed_tabs.filter_map(|name| {
        Some(RecoveredWork { stored_as: name.clone().into(), ..RecoveredWork::decode(&store.read(&name)?)? })
    });
    found.borrow_mut().extend(work);
    ctx.request_repaint();
}

fn locks() -> Result<JsValue, JsValue> {
    let navigator = Reflect::get(&js_sys::global(), &"navigator".into())?;
    Reflect::get(&navigator, &"locks".into())
}

fn method(of: &JsValue, name: &str) -> Result<Function, JsValue> {
    Reflect::get(of, &name.into())?.dyn_into()
}

/// Holds the lock `name` until the page is closed.
fn hold_lock(name: &str) -> Result<(), JsValue> {
    let locks = locks()?;
    let forever = Closure::once_into_js(|| JsValue::from(Promise::new(&mut |_, _| {})));
    method(&locks, "request")?.call2(&locks, &name.into(), &forever)?;
    Ok(())
}

/// The names of all held locks.
async fn held_locks() -> Result<Vec<String>, JsValue> {
    let locks = locks()?;
    let query: Promise = method(&locks, "query")?.call0(&locks)?.dyn_into()?;
    let answer = JsFuture::from(query).await?;
    let held: Array = Reflect::get(&answer, &"held".into())?.dyn_into()?;
    Ok(held.iter().filter_map(|lock| Reflect::get(&lock, &"name".into()).ok()?.as_string()).collect())
}
