//! A player in a web worker, which runs this same program on a thread of its own, so that the page stays responsive while a frame
//! renders. Page and worker share no memory, only messages.

use std::{cell::RefCell, rc::Rc, sync::Arc};

use bansho::{Assets, Plan, SceneError};

use super::{
    message::PageMessage,
    pending::{Pending, WorkerUpdate},
    reply::{Reply, WorkerMessage},
};
use crate::{
    document::ReportedProblem,
    player::{Event, FrameRequest, Player, PolledPlayer},
    scenes::examples::Bundle,
};
use js_sys::Array;
use wasm_bindgen::{JsCast, JsValue, closure::Closure};
use web_sys::{DedicatedWorkerGlobalScope, MessageEvent, Worker, WorkerOptions, WorkerType};

/// The script that starts the program in a worker; `web/build` puts it beside the page.
const SCRIPT: &str = "worker.js";

/// The page's side.
pub struct WorkerPlayer {
    worker: WorkerHandle,
    wake: Rc<dyn Fn()>,
    /// Added files, to be sent again to a worker that replaces one that panicked.
    files: Vec<(String, Vec<u8>)>,
    pending: Pending,
}

/// A worker and its message queues.
struct WorkerHandle {
    worker: Worker,
    inbox: Rc<RefCell<Vec<WorkerMessage>>>,
    /// Messages to send once the worker is ready.
    outbox: Option<Vec<Array>>,
    _listen: Closure<dyn FnMut(MessageEvent)>,
    _mourn: Closure<dyn FnMut()>,
}

impl WorkerHandle {
    fn start(wake: Rc<dyn Fn()>) -> Result<Self, JsValue> {
        let options = WorkerOptions::new();
        options.set_type(WorkerType::Module);
        let worker = Worker::new_with_options(SCRIPT, &options)?;
        let inbox = Rc::new(RefCell::new(Vec::new()));
        let (heard, woken) = (inbox.clone(), wake.clone());
        let listen = Closure::new(move |event: MessageEvent| {
            heard.borrow_mut().extend(Reply::read(&event.data()).map(WorkerMessage::Reply));
            woken();
        });
        worker.set_onmessage(Some(listen.as_ref().unchecked_ref()));
        let heard = inbox.clone();
        let worker_failed = Closure::new(move || {
            heard.borrow_mut().push(WorkerMessage::Terminated);
            wake();
        });
        worker.set_onerror(Some(worker_failed.as_ref().unchecked_ref()));
        // The compiled program.
        worker.post_message(&wasm_bindgen::module())?;
        Ok(Self { worker, inbox, outbox: Some(Vec::new()), _listen: listen, _mourn: worker_failed })
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

impl Drop for WorkerHandle {
    fn drop(&mut self) {
        // Messages that are still queued are dropped.
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
        let worker = WorkerHandle::start(wake.clone())?;
        Ok(Self { worker, wake, files: Vec::new(), pending: Pending::default() })
    }

    /// Replaces a worker that terminated and sends it the newest request. Where the browser gives no other, rendering ends.
    fn restart(&mut self) {
        let Ok(worker) = WorkerHandle::start(self.wake.clone()) else { return self.pending.give_up() };
        // Messages of the old worker are dropped with it.
        self.worker = worker;
        self.files.iter().for_each(|(name, bytes)| self.worker.say(PageMessage::file(name, bytes)));
        self.tell_newest();
    }

    fn tell_newest(&mut self) {
        if let Some((number, request)) = self.pending.newest() {
            self.worker.say(PageMessage::request(number, request));
        }
    }
}

impl Player for WorkerPlayer {
    fn request(&mut self, request: FrameRequest) {
        if self.pending.push(request) {
            self.tell_newest();
        } else {
            self.restart();
        }
    }

    fn poll(&mut self) -> Vec<Event> {
        let WorkerUpdate { events, ready, terminated } = self.pending.handle_messages(self.worker.inbox.take());
        if ready {
            self.worker.flush();
        }
        if terminated {
            self.restart();
        }
        events
    }

    fn is_busy(&self) -> bool {
        self.pending.is_busy()
    }

    fn needs_polling(&self) -> bool {
        false
    }

    fn add_file(&mut self, name: &str, bytes: &[u8]) {
        self.worker.say(PageMessage::file(name, bytes));
        self.files.push((name.to_owned(), bytes.to_vec()));
    }
}

/// The worker's side.
struct WorkerMain {
    scope: DedicatedWorkerGlobalScope,
    player: PolledPlayer,
    bundle: Bundle,
    assets: Arc<dyn Assets>,
    /// Number of the current request.
    number: u64,
    /// Whether a time slice is scheduled.
    working: bool,
}

/// Runs the worker: serves the requests of the page that started it.
pub fn run_worker() {
    let scope: DedicatedWorkerGlobalScope = js_sys::global().unchecked_into();
    let worker = Rc::new(RefCell::new(WorkerMain {
        scope: scope.clone(),
        player: PolledPlayer::default(),
        bundle: Bundle::default(),
        assets: Arc::new(Bundle::default()),
        number: 0,
        working: false,
    }));
    let listen = Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
        worker.borrow_mut().hear(&event.data());
        go_on(&worker);
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

/// Schedules time slices until no request is left; messages are received between two slices.
fn go_on(worker: &Rc<RefCell<WorkerMain>>) {
    let mut own = worker.borrow_mut();
    if own.working || !own.player.is_busy() {
        return;
    }
    own.working = true;
    let next = worker.clone();
    let work = Closure::once_into_js(move || {
        next.borrow_mut().work();
        go_on(&next);
    });
    let _ = own.scope.set_timeout_with_callback(work.unchecked_ref());
}

impl WorkerMain {
    fn hear(&mut self, message: &JsValue) {
        match PageMessage::read(message, &self.assets) {
            Some(PageMessage::File(name, bytes)) => {
                self.bundle.add_file(name, bytes);
                self.assets = Arc::new(self.bundle.clone());
            }
            Some(PageMessage::Request(number, request)) => {
                self.number = number;
                self.tell_panics_of(number);
                self.player.request(request);
            }
            None => {}
        }
    }

    /// A panic ends the program on wasm: the hook sends its message to the page.
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
        Event::Checked { outcome, .. } => Reply::Checked { number, found: found(outcome) },
        Event::Drawn(picture) => Reply::Drawn { picture },
        Event::Stage(stage, picture) => Reply::Stage { stage, picture },
        Event::FullQualityFrame { number: frame, png } => Reply::FullQualityFrame { frame, png },
        Event::Failed { reason, .. } => Reply::Failed { number, reason },
        Event::Panicked { message, .. } => Reply::Panicked { number, message },
    }
}

/// What the page could only find out by building every phenomenon.
fn found(outcome: Result<Arc<Plan>, SceneError>) -> Result<f32, Vec<ReportedProblem>> {
    let faults = |error: SceneError| error.problems.iter().map(ReportedProblem::from).collect();
    outcome.map(|plan| plan.exposure_ev100).map_err(faults)
}
