//! A player in a web worker, which runs this same program on a thread of its own, so that the page stays responsive while a frame
//! renders. Page and worker share no memory, only messages.

use std::{cell::RefCell, rc::Rc, sync::Arc};

use bansho::{Assets, Plan, SceneError};

use super::{
    message::PageMessage,
    pending::{Pending, Reply, WorkerMessage, WorkerUpdate},
};
use crate::{
    document::{CheckReport, ReportedProblem},
    player::{Event, FrameRequest, Player, PolledPlayer},
    scenes::examples::BundledAssets,
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
    _on_message: Closure<dyn FnMut(MessageEvent)>,
    _on_error: Closure<dyn FnMut()>,
}

impl WorkerHandle {
    fn start(wake: Rc<dyn Fn()>) -> Result<Self, JsValue> {
        let options = WorkerOptions::new();
        options.set_type(WorkerType::Module);
        let worker = Worker::new_with_options(SCRIPT, &options)?;
        let inbox = Rc::new(RefCell::new(Vec::new()));
        let (received, wake_page) = (inbox.clone(), wake.clone());
        let on_message = Closure::new(move |event: MessageEvent| {
            received.borrow_mut().extend(Reply::read(&event.data()).map(WorkerMessage::Reply));
            wake_page();
        });
        worker.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
        let received = inbox.clone();
        let on_error = Closure::new(move || {
            received.borrow_mut().push(WorkerMessage::Terminated);
            wake();
        });
        worker.set_onerror(Some(on_error.as_ref().unchecked_ref()));
        // The compiled program.
        worker.post_message(&wasm_bindgen::module())?;
        Ok(Self { worker, inbox, outbox: Some(Vec::new()), _on_message: on_message, _on_error: on_error })
    }

    fn send(&mut self, message: Array) {
        match &mut self.outbox {
            Some(outbox) => outbox.push(message),
            // Arrays of numbers, texts and bytes can always be copied.
            None => drop(self.worker.post_message(&message)),
        }
    }

    fn flush(&mut self) {
        for message in self.outbox.take().unwrap_or_default() {
            self.send(message);
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
    /// Starts a worker; `wake` is called whenever there are events to [`poll`](Player::poll).
    ///
    /// # Errors
    /// The browser cannot start workers.
    pub fn start(wake: impl Fn() + 'static) -> Result<Self, JsValue> {
        let wake: Rc<dyn Fn()> = Rc::new(wake);
        let worker = WorkerHandle::start(wake.clone())?;
        Ok(Self { worker, wake, files: Vec::new(), pending: Pending::default() })
    }

    /// Replaces a worker that terminated, and sends the newest request to the new one. If none can be started, all requests end.
    fn restart(&mut self) {
        let Ok(worker) = WorkerHandle::start(self.wake.clone()) else { return self.pending.finish_all() };
        // Messages of the old worker are dropped with it.
        self.worker = worker;
        self.files.iter().for_each(|(name, bytes)| self.worker.send(PageMessage::file(name, bytes)));
        self.send_newest();
    }

    fn send_newest(&mut self) {
        if let Some((number, request)) = self.pending.newest() {
            self.worker.send(PageMessage::request(number, request));
        }
    }
}

impl Player for WorkerPlayer {
    fn request(&mut self, request: FrameRequest) {
        if self.pending.push(request) {
            self.send_newest();
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
        self.worker.send(PageMessage::file(name, bytes));
        self.files.push((name.to_owned(), bytes.to_vec()));
    }
}

/// The worker's side.
struct WorkerMain {
    scope: DedicatedWorkerGlobalScope,
    player: PolledPlayer,
    bundle: BundledAssets,
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
        bundle: BundledAssets::default(),
        assets: Arc::new(BundledAssets::default()),
        number: 0,
        working: false,
    }));
    let on_message = Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
        worker.borrow_mut().receive(&event.data());
        schedule_work(&worker);
    });
    scope.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
    // The callback lives as long as the worker.
    on_message.forget();
    post(&scope, Reply::Ready);
}

fn post(scope: &DedicatedWorkerGlobalScope, reply: Reply) {
    // Arrays of numbers, texts and bytes can always be copied.
    let _ = scope.post_message(&reply.write());
}

/// Schedules time slices until no request is left; messages are received between two slices.
fn schedule_work(worker: &Rc<RefCell<WorkerMain>>) {
    let mut own = worker.borrow_mut();
    if own.working || !own.player.is_busy() {
        return;
    }
    own.working = true;
    let next = worker.clone();
    let work = Closure::once_into_js(move || {
        next.borrow_mut().work();
        schedule_work(&next);
    });
    let _ = own.scope.set_timeout_with_callback(work.unchecked_ref());
}

impl WorkerMain {
    fn receive(&mut self, message: &JsValue) {
        match PageMessage::read(message, &self.assets) {
            Some(PageMessage::File { name, bytes }) => {
                self.bundle.add_file(name, bytes);
                self.assets = Arc::new(self.bundle.clone());
            }
            Some(PageMessage::Request { number, request }) => {
                self.number = number;
                self.report_panics_of(number);
                self.player.request(request);
            }
            None => {}
        }
    }

    /// A panic ends the program on wasm: the hook sends its message to the page.
    fn report_panics_of(&self, number: u64) {
        std::panic::set_hook(Box::new(move |panic| {
            let message = panic.payload_as_str().unwrap_or("no reason given");
            let location = panic.location().map(|location| format!(" ({location})")).unwrap_or_default();
            let scope: DedicatedWorkerGlobalScope = js_sys::global().unchecked_into();
            post(&scope, Reply::Panicked { number, message: format!("{message}{location}") });
        }));
    }

    fn work(&mut self) {
        self.working = false;
        for event in self.player.poll() {
            post(&self.scope, reply(self.number, event));
        }
        if !self.player.is_busy() {
            post(&self.scope, Reply::Done { number: self.number });
        }
    }
}

fn reply(number: u64, event: Event) -> Reply {
    match event {
        Event::Checked { outcome, .. } => Reply::Checked { number, report: check_report(outcome) },
        Event::Drawn(picture) => Reply::Drawn { picture },
        Event::Stage(stage, picture) => Reply::Stage { stage, picture },
        Event::FullQualityFrame { number: frame, png } => Reply::FullQualityFrame { frame, png },
        Event::Failed { reason, .. } => Reply::Failed { number, reason },
        Event::Panicked { message, .. } => Reply::Panicked { number, message },
    }
}

/// The results of a check for which all phenomena must be built.
fn check_report(outcome: Result<Arc<Plan>, SceneError>) -> CheckReport {
    let plan = outcome.map_err(|error| error.problems.iter().map(ReportedProblem::from).collect::<Vec<_>>())?;
    Ok(plan.exposure_ev100)
}
