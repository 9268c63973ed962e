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
    /// The prefix of all names.
    beginning: &'static str,
    /// The name of this tab.
    own: String,
    /// Work of closed tabs; filled once the browser has listed the locks.
    found: Rc<RefCell<Vec<RecoveredWork>>>,
    looked: bool,
}

impl BrowserTabs {
    /// Takes a name that begins with `beginning`.
    pub(super) fn begin(store: SettingsStore, beginning: &'static str) -> Self {
        let own = format!("{beginning} {:.0} {:.0}", js_sys::Date::now(), 1e9 * js_sys::Math::random());
        // Without a lock the work is offered to other pages too.
        let _ = hold(&own);
        Self { store, beginning, own, found: Rc::default(), looked: false }
    }

    /// Work of closed tabs, once it is known.
    pub(super) fn found(&mut self, ctx: &Context) -> Vec<RecoveredWork> {
        if !std::mem::replace(&mut self.looked, true) {
            let kept = self.store.names(self.beginning).into_iter().filter(|name| *name != self.own).collect();
            spawn_local(look(self.store.clone(), kept, self.found.clone(), ctx.clone()));
        }
        self.found.take()
    }

    /// Keeps `work`, or nothing; whether it could.
    pub(super) fn keep(&self, work: Option<&str>) -> bool {
        match work {
            Some(work) => self.store.write(&self.own, work),
            None => {
                self.store.remove(&self.own);
                true
            }
        }
    }
}

/// Finds those of the works `kept` that no living page holds.
async fn look(store: SettingsStore, kept: Vec<String>, found: Rc<RefCell<Vec<RecoveredWork>>>, ctx: Context) {
    let held = held().await.unwrap_or_default();
    let dead = kept.into_iter().filter(|name| !held.contains(name));
    let work = dead.filter_map(|name| {
        Some(RecoveredWork { kept_in: name.clone().into(), ..RecoveredWork::of(&store.read(&name)?)? })
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

/// Holds the lock `name` until the page is gone.
fn hold(name: &str) -> Result<(), JsValue> {
    let locks = locks()?;
    let forever = Closure::once_into_js(|| JsValue::from(Promise::new(&mut |_, _| {})));
    method(&locks, "request")?.call2(&locks, &name.into(), &forever)?;
    Ok(())
}

/// The names of all locks that are held.
async fn held() -> Result<Vec<String>, JsValue> {
    let locks = locks()?;
    let asked: Promise = method(&locks, "query")?.call0(&locks)?.dyn_into()?;
    let answer = JsFuture::from(asked).await?;
    let held: Array = Reflect::get(&answer, &"held".into())?.dyn_into()?;
    Ok(held.iter().filter_map(|lock| Reflect::get(&lock, &"name".into()).ok()?.as_string()).collect())
}
