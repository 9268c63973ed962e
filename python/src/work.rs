//! How work is done: in a thread pool, with the interpreter released, so that signals interrupt it and a panic becomes an exception.

use std::{
    any::Any,
    collections::BTreeMap,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, RecvTimeoutError},
    },
    time::Duration,
};

use bansho::Observer;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error;

/// Time between two looks at the signals of the process.
const POLL: Duration = Duration::from_millis(25);

/// The largest number of threads that may be asked for.
const MOST_THREADS: usize = 1024;

/// Pools by process and number of threads. The threads of a pool do not survive a fork, so a child process makes pools of its own.
static POOLS: Mutex<BTreeMap<(u32, usize), Arc<ThreadPool>>> = Mutex::new(BTreeMap::new());

/// Asks the work to stop once a signal has come.
#[derive(Default)]
pub(crate) struct Interruption {
    is_requested: AtomicBool,
}

impl Observer for Interruption {
    fn cancelled(&self) -> bool {
        self.is_requested.load(Ordering::Relaxed)
    }
}

/// The number of threads that `threads` asks for: without a number one for each core.
///
/// # Errors
/// `ValueError` unless it is within 1 to [`MOST_THREADS`].
pub(crate) fn thread_count(threads: Option<i64>) -> PyResult<usize> {
    match threads {
        None => Ok(std::thread::available_parallelism().map_or(1, usize::from).min(MOST_THREADS)),
        Some(count) => match usize::try_from(count) {
            Ok(count @ 1..=MOST_THREADS) => Ok(count),
            _ => Err(error::value(format!("threads: {count}; allowed: 1 to {MOST_THREADS}, or None for one a core"))),
        },
    }
}

/// The pool of this process with that many threads.
fn pool(threads: usize) -> PyResult<Arc<ThreadPool>> {
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let key = (std::process::id(), threads);
    if let Some(pool) = pools.get(&key) {
        return Ok(pool.clone());
    }
    let built = ThreadPoolBuilder::new().num_threads(threads).thread_name(|index| format!("bansho {index}")).build();
    let pool = Arc::new(built.map_err(|reason| error::internal(format!("threads cannot be started: {reason}")))?);
    pools.insert(key, pool.clone());
    Ok(pool)
}

/// Does `work` in a pool of `threads`, with the interpreter released. Signals are handled every 25 ms: the work is then asked to stop.
///
/// # Errors
/// The exception of a signal handler, such as `KeyboardInterrupt`, or `InternalError` if the work panics.
pub(crate) fn run<R: Send>(
    py: Python<'_>,
    threads: usize,
    work: impl FnOnce(&Interruption) -> R + Send,
) -> PyResult<R> {
    run_and_poll(py, threads, |_| Ok(()), work)
}

/// As [`run`], and calls `poll` with the interpreter every 25 ms while the work is done, and once when it is.
///
/// # Errors
/// As [`run`], or the exception that `poll` returns.
pub(crate) fn run_and_poll<R: Send>(
    py: Python<'_>,
    threads: usize,
    poll: impl Fn(Python<'_>) -> PyResult<()> + Send + Sync,
    work: impl FnOnce(&Interruption) -> R + Send,
) -> PyResult<R> {
    let pool = pool(threads)?;
    let interruption = Interruption::default();
    let (outcome, raised) = py.detach(|| {
        let (sender, receiver) = mpsc::channel();
        pool.in_place_scope(|scope| {
            let interruption = &interruption;
            scope.spawn(move |_| {
                // What the work was changing is never used after a panic: it is behind a lock, which a panic poisons.
                let outcome = catch_unwind(AssertUnwindSafe(|| work(interruption)));
                // The receiver outlives the scope.
                let _ = sender.send(outcome);
            });
            let mut raised = None;
            loop {
                match receiver.recv_timeout(POLL) {
                    Ok(outcome) => return (Some(outcome), raised),
                    Err(RecvTimeoutError::Disconnected) => return (None, raised),
                    Err(RecvTimeoutError::Timeout) if raised.is_some() => {}
                    Err(RecvTimeoutError::Timeout) => {
                        let handled = Python::attach(|py| py.check_signals().and_then(|()| poll(py)));
                        if let Err(exception) = handled {
                            interruption.is_requested.store(true, Ordering::Relaxed);
                            raised = Some(exception);
                        }
                    }
                }
            }
        })
    });
    if let Some(exception) = raised {
        return Err(exception);
    }
    match outcome {
        Some(Ok(done)) => {
            poll(py)?;
            Ok(done)
        }
        Some(Err(payload)) => Err(error::internal(message_of(payload.as_ref()))),
        None => Err(error::internal("a thread ended before its work was done".to_owned())),
    }
}

/// Locks what an earlier call may have left in pieces.
///
/// # Errors
/// `InternalError` after a panic: what was locked then is of no use any more.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> Result<MutexGuard<'_, T>, Poisoned> {
    mutex.lock().map_err(|_| Poisoned)
}

/// An earlier call panicked.
#[derive(Clone, Copy, Debug, thiserror::Error)]
#[error("an earlier call on this object failed within Bansho; open it again")]
pub(crate) struct Poisoned;

impl From<Poisoned> for PyErr {
    fn from(poisoned: Poisoned) -> Self {
        error::internal(poisoned.to_string())
    }
}

/// What a panic says.
fn message_of(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
    format!("Bansho failed: {}; this is a bug, please report it", text.unwrap_or_else(|| "an unknown panic".to_owned()))
}
