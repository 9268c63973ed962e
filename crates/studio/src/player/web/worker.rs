//! Wishes fulfilled by a worker of the page, which runs this same program in a thread of its own: however long a picture
//! takes, the page answers. Nothing is shared; both sides hear messages only.

use std::{cell::RefCell, rc::Rc, sync::Arc};

use bansho::{Assets, Plan, SceneError};

use super::{
    message::Order,
    pending::{News, Pending},
    reply::{Heard, Reply},
};
use crate::{
    document::Found,
    player::{Event, Player, SlicePlayer, Wish},
    scenes::examples::Bundle,
};
use js_sys::Array;
use wasm_bindgen::{JsCast, JsValue, closure::Closure};
use web_sys::{DedicatedWorkerGlobalScope, MessageEvent, Worker, WorkerOptions, WorkerType};

/// The script that starts the program in a worker; the page's maker puts it beside the page.
const SCRIPT: &str = "worker.js";

/// The page's side.
pub struct WorkerPlayer {
    link: Link,
    wake: Rc<dyn Fn()>,
    /// What a worker must know that takes the place of one that panicked.
    files: Vec<(String, Vec<u8>)>,
    pending: Pending,
}

/// A worker, and what it said.
struct Link {
    worker: Worker,
    inbox: Rc<RefCell<Vec<Heard>>>,
    /// What waits until it listens.
    outbox: Option<Vec<Array>>,
    _listen: Closure<dyn FnMut(MessageEvent)>,
    _mourn: Closure<dyn FnMut()>,
}

impl Link {
    fn start(wake: Rc<dyn Fn()>) -> Result<Self, JsValue> {
        let options = WorkerOptions::new();
        options.set_type(WorkerType::Module);
        let worker = Worker::new_with_options(SCRIPT, &options)?;
        let inbox = Rc::new(RefCell::new(Vec::new()));
        let (heard, woken) = (inbox.clone(), wake.clone());
        let listen = Closure::new(move |event: MessageEvent| {
            heard.borrow_mut().extend(Reply::read(&event.data()).map(Heard::Said));
            woken();
        });
        worker.set_onmessage(Some(listen.as_ref().unchecked_ref()));
        let heard = inbox.clone();
        let mourn = Closure::new(move || {
            heard.borrow_mut().push(Heard::Ended);
            wake();
        });
        worker.set_onerror(Some(mourn.as_ref().unchecked_ref()));
        // The program, compiled already.
        worker.post_message(&wasm_bindgen::module())?;
        Ok(Self { worker, inbox, outbox: Some(Vec::new()), _listen: listen, _mourn: mourn })
    }

    fn say(&mut self, message: Array) {
        match &mut self.outbox {
            Some(outbox) => outbox.push(message),
            // Arrays of numbers, texts and bytes can always be copied.
            None => drop(self.worker.post_message(&message)),
        }
    }

    fn flush(&mut self) {
        for message in self.outbox.take().unwrap_or_default() {
            self.say(message);
        }
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        // Nobody is there any more for what is still on its way.
        self.worker.set_onmessage(None);
        self.worker.set_onerror(None);
        self.worker.terminate();
    }
}

impl WorkerPlayer {
    /// Starts a worker; `wake` is called whenever there is something to [`poll`](Player::poll).
    ///
    /// # Errors
    /// The browser gives no workers.
    pub fn start(wake: impl Fn() + 'static) -> Result<Self, JsValue> {
        let wake: Rc<dyn Fn()> = Rc::new(wake);
        let link = Link::start(wake.clone())?;
        Ok(Self { link, wake, files: Vec::new(), pending: Pending::default() })
    }

    /// Another worker in place of one that is gone, and the newest wish for it. Where none can be had, nothing more is drawn, as the panic
    /// told.
    fn restart(&mut self) {
        let Ok(link) = Link::start(self.wake.clone()) else { return self.pending.give_up() };
        // What the old one may still say goes with it.
        self.link = link;
        self.files.iter().for_each(|(name, bytes)| self.link.say(Order::file(name, bytes)));
        self.tell_newest();
    }

    fn tell_newest(&mut self) {
        if let Some((number, wish)) = self.pending.newest() {
            self.link.say(Order::wish(number, wish));
        }
    }
}

impl Player for WorkerPlayer {
    fn wish(&mut self, wish: Wish) {
        if self.pending.note(wish) {
            self.tell_newest();
        } else {
            self.restart();
        }
    }

    fn poll(&mut self) -> Vec<Event> {
        let News { events, listens, gone } = self.pending.take_in(self.link.inbox.take());
        if listens {
            self.link.flush();
        }
        if gone {
            self.restart();
        }
        events
    }

    fn is_busy(&self) -> bool {
        self.pending.is_busy()
    }

    fn waits_for_poll(&self) -> bool {
        false
    }

    fn give(&mut self, name: &str, bytes: &[u8]) {
        self.link.say(Order::file(name, bytes));
        self.files.push((name.to_owned(), bytes.to_vec()));
    }
}

/// The worker's side.
struct Workshop {
    scope: DedicatedWorkerGlobalScope,
    player: SlicePlayer,
    bundle: Bundle,
    assets: Arc<dyn Assets>,
    /// Of the wish that is being fulfilled.
    number: u64,
    /// Whether work goes on by itself.
    working: bool,
}

/// Fulfils the wishes of the page that this program is the worker of.
pub fn serve() {
    let scope: DedicatedWorkerGlobalScope = js_sys::global().unchecked_into();
    let shop = Rc::new(RefCell::new(Workshop {
        scope: scope.clone(),
        player: SlicePlayer::default(),
        bundle: Bundle::default(),
        assets: Arc::new(Bundle::default()),
        number: 0,
        working: false,
    }));
    let listen = Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
        shop.borrow_mut().hear(&event.data());
        go_on(&shop);
    });
    scope.set_onmessage(Some(listen.as_ref().unchecked_ref()));
    // It listens for as long as the worker lives.
    listen.forget();
    say(&scope, Reply::Ready);
}

fn say(scope: &DedicatedWorkerGlobalScope, reply: Reply) {
    // Arrays of numbers, texts and bytes can always be copied.
    let _ = scope.post_message(&reply.write());
}

/// Works until nothing is wished for, with a look at new messages between any two slices.
fn go_on(shop: &Rc<RefCell<Workshop>>) {
    let mut own = shop.borrow_mut();
    if own.working || !own.player.is_busy() {
        return;
    }
    own.working = true;
    let next = shop.clone();
    let work = Closure::once_into_js(move || {
        next.borrow_mut().work();
        go_on(&next);
    });
    let _ = own.scope.set_timeout_with_callback(work.unchecked_ref());
}

impl Workshop {
    fn hear(&mut self, message: &JsValue) {
        match Order::read(message, &self.assets) {
            Some(Order::File(name, bytes)) => {
                self.bundle.give(name, bytes);
                self.assets = Arc::new(self.bundle.clone());
            }
            Some(Order::Wish(number, wish)) => {
                self.number = number;
                self.tell_panics_of(number);
                self.player.wish(wish);
            }
            None => {}
        }
    }

    /// A panic ends the program here; its last words go to the page.
    fn tell_panics_of(&self, number: u64) {
        std::panic::set_hook(Box::new(move |panic| {
            let said = panic.payload_as_str().unwrap_or("no reason given");
            let place = panic.location().map(|location| format!(" ({location})")).unwrap_or_default();
            let scope: DedicatedWorkerGlobalScope = js_sys::global().unchecked_into();
            say(&scope, Reply::Panicked { number, message: format!("{said}{place}") });
        }));
    }

    fn work(&mut self) {
        self.working = false;
        for event in self.player.poll() {
            say(&self.scope, reply(self.number, event));
        }
        if !self.player.is_busy() {
            say(&self.scope, Reply::Done { number: self.number });
        }
    }
}

fn reply(number: u64, event: Event) -> Reply {
    match event {
        Event::Judged { outcome, .. } => Reply::Judged { number, found: found(outcome) },
        Event::Drawn(picture) => Reply::Drawn { picture },
        Event::Stage(stage, picture) => Reply::Stage { stage, picture },
        Event::Still { number: frame, png } => Reply::Still { frame, png },
        Event::Failed { reason, .. } => Reply::Failed { number, reason },
        Event::Panicked { message, .. } => Reply::Panicked { number, message },
    }
}

/// What the page cannot find out by itself without making every phenomenon.
fn found(outcome: Result<Arc<Plan>, SceneError>) -> Result<f32, Vec<Found>> {
    let faults = |error: SceneError| error.problems.iter().map(Found::from).collect();
    outcome.map(|plan| plan.exposure_ev100).map_err(faults)
}
