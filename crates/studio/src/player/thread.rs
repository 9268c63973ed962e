//! A player on a thread of its own, with a rayon pool.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
        mpsc,
    },
    thread::JoinHandle,
    time::Duration,
};

use super::{Event, FrameRequest, Player, engine::Engine, interruption::Interruption, panic_message};

/// Renders on a thread of its own, in a rayon pool with one thread per core.
pub struct ThreadPlayer {
    slot: Arc<RequestSlot>,
    /// Events; `None` marks the end of a request.
    events: mpsc::Receiver<Option<Event>>,
    /// Events received by [`wait`](Player::wait).
    waited: Vec<Event>,
    worker: Option<JoinHandle<()>>,
}

/// The slot with the newest request.
#[derive(Default)]
struct RequestSlot {
    request: Mutex<Option<FrameRequest>>,
    request_added: Condvar,
    /// Number of requests so far; work on an older one can be cancelled.
    newest: AtomicU64,
    /// Number of the last finished request.
    done: AtomicU64,
    closing: AtomicBool,
}

impl RequestSlot {
    fn request(&self) -> MutexGuard<'_, Option<FrameRequest>> {
        // The request is replaced as a whole, so that a poisoned lock holds a valid one.
        self.request.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for a request; `None` when the player closes.
    fn take(&self) -> Option<(FrameRequest, u64)> {
        let mut slot = self.request();
        loop {
            if self.closing.load(Ordering::Relaxed) {
                return None;
            }
            if let Some(request) = slot.take() {
                return Some((request, self.newest.load(Ordering::Relaxed)));
            }
            slot = self.request_added.wait(slot).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Whether request `number` is obsolete: the player closes, or the work `may_stop` for a newer request.
    fn is_obsolete(&self, number: u64, may_stop: bool) -> bool {
        self.closing.load(Ordering::Relaxed) || (may_stop && self.newest.load(Ordering::Relaxed) != number)
    }
}

impl ThreadPlayer {
    /// Starts the thread; `wake` is called from it whenever there are events to [`poll`](Player::poll).
    ///
    /// # Errors
    /// The system cannot start threads.
    pub fn start(wake: impl Fn() + Send + 'static) -> Result<Self, StartError> {
        let pool = rayon::ThreadPoolBuilder::new().thread_name(|index| format!("draw {index}")).build()?;
        let slot = Arc::new(RequestSlot::default());
        let (sender, events) = mpsc::channel();
        let work = {
            let slot = slot.clone();
            move || {
                pool.install(move || {
                    work(&slot, &mut |event| {
                        let wakes = event.is_some();
                        // The receiver is dropped when the window closes.
                        let _ = sender.send(event);
                        if wakes {
                            wake();
                        }
                    });
                });
            }
        };
        let worker = std::thread::Builder::new().name("player".into()).spawn(work)?;
        Ok(Self { slot, events, waited: Vec::new(), worker: Some(worker) })
    }
}

/// Why a player cannot start.
#[derive(Debug, thiserror::Error)]
#[error("the system cannot start threads for drawing: {0}")]
pub enum StartError {
    /// Of the rayon pool.
    Pool(#[from] rayon::ThreadPoolBuildError),
    /// Of the player.
    Thread(#[from] std::io::Error),
}

/// Serves requests until the player closes. Obsolete work is cancelled: a simulation at once, since it resumes where it stopped;
/// a drawing only if the drawing before it was not cancelled too, so that continuous dragging still shows pictures.
fn work(slot: &RequestSlot, send: &mut dyn FnMut(Option<Event>)) {
    let mut engine = Engine::default();
    let mut must_draw = false;
    while let Some((request, number)) = slot.take() {
        let interruption = Interruption::new(|advancing| slot.is_obsolete(number, advancing || !must_draw));
        let outcome =
            catch_unwind(AssertUnwindSafe(|| engine.process(&request, &interruption, &mut |event| send(Some(event)))));
        slot.done.store(number, Ordering::Relaxed);
        must_draw = matches!(&outcome, Ok(Err(error)) if error.is_stop());
        match outcome {
            Ok(Ok(())) => {}
            Ok(Err(error)) if error.is_stop() => {}
            Ok(Err(error)) => send(Some(Event::Failed { revision: request.revision, reason: error.to_string() })),
            Err(panic) => {
                engine.reset_after_panic();
                let message = panic_message(panic.as_ref());
                send(Some(Event::Panicked { revision: request.revision, number: request.number, message }));
            }
        }
        // Ends a wait: this request has no more events.
        send(None);
    }
}

impl Player for ThreadPlayer {
    fn request(&mut self, request: FrameRequest) {
        let mut slot = self.slot.request();
        *slot = Some(request);
        // Counted under the lock, so that the request is taken with its own number.
        self.slot.newest.fetch_add(1, Ordering::Relaxed);
        drop(slot);
        self.slot.request_added.notify_one();
    }

    fn poll(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.waited).into_iter().chain(self.events.try_iter().flatten()).collect()
    }

    fn wait(&mut self, timeout: Duration) {
        if self.waited.is_empty() {
            self.waited.extend(self.events.recv_timeout(timeout).ok().flatten());
        }
    }

    fn is_busy(&self) -> bool {
        self.slot.done.load(Ordering::Relaxed) != self.slot.newest.load(Ordering::Relaxed)
    }

    fn needs_polling(&self) -> bool {
        false
    }
}

impl Drop for ThreadPlayer {
    fn drop(&mut self) {
        self.slot.closing.store(true, Ordering::Relaxed);
        drop(self.slot.request());
        self.slot.request_added.notify_one();
        if let Some(worker) = self.worker.take() {
            // Panics of phenomena were caught and reported.
            let _ = worker.join();
        }
    }
}
