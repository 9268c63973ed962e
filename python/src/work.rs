//! How work is done: in a thread pool, with the interpreter released, so that signals interrupt it and a panic becomes an exception.

use std::{
    any::Any,
    collections::BTreeMap,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError, TryLockError,
        atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering},
        mpsc::{self, RecvTimeoutError},
    },
    time::Duration,
};

use bansho::Observer;
use pyo3::{exceptions::PyRuntimeError, prelude::*};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error;

/// Time between two looks at the signals of the process.
pub(crate) const POLL: Duration = Duration::from_millis(25);
/// Time between two attempts to take what another thread uses.
const RETRY: Duration = Duration::from_millis(1);

/// The largest number of threads that may be asked for.
const MOST_THREADS: usize = 1024;

/// Pools by process and number of threads. The threads of a pool do not survive a fork, so a child process makes pools of its own.
static POOLS: Mutex<BTreeMap<(u32, usize), Arc<ThreadPool>>> = Mutex::new(BTreeMap::new());

/// Asks the work to stop once a signal has come. Copies are the same request.
#[derive(Clone, Default)]
pub(crate) struct Interruption {
    is_requested: Arc<AtomicBool>,
}

impl Interruption {
    /// Asks the work to stop.
    pub(crate) fn request(&self) {
        self.is_requested.store(true, Ordering::Relaxed);
    }
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
pub(crate) fn pool(threads: usize) -> PyResult<Arc<ThreadPool>> {
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
    let done = py.detach(|| in_pool(&pool, &poll, work))?;
    poll(py)?;
    Ok(done)
}

/// Why work has no result.
enum Failure {
    /// A signal handler or the poll raised an exception.
    Raised(PyErr),
    /// The work panicked, and what it was changing may be in pieces.
    Panicked(PyErr),
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Raised(exception) | Failure::Panicked(exception) => exception,
        }
    }
}

/// Does `work` in a pool and waits for it, on a thread that does not hold the interpreter.
fn in_pool<R: Send>(
    pool: &ThreadPool,
    poll: &(impl Fn(Python<'_>) -> PyResult<()> + Send + Sync),
    work: impl FnOnce(&Interruption) -> R + Send,
) -> Result<R, Failure> {
    let interruption = Interruption::default();
    let (sender, receiver) = mpsc::channel();
    let (outcome, raised) = pool.in_place_scope(|scope| {
        let interruption = &interruption;
        scope.spawn(move |_| {
            // What the work was changing is never used after a panic: see `PoolMutex`.
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
                        interruption.request();
                        raised = Some(exception);
                    }
                }
            }
        }
    });
    match (outcome, raised) {
        (Some(Err(payload)), _) => Err(Failure::Panicked(panicked(payload.as_ref()))),
        (_, Some(exception)) => Err(Failure::Raised(exception)),
        (Some(Ok(done)), None) => Ok(done),
        (None, None) => Err(Failure::Panicked(error::internal("a thread ended before its work was done".to_owned()))),
    }
}

/// A mutex around what work in a pool changes: calls from several threads use it one after the other, and none after a panic, which may have left it in pieces.
///
/// The thread that calls takes it before its work enters the pool. A worker that took it within a job could wait there for itself: while it waits for the
/// parts of one job, it takes on others.
pub(crate) struct PoolMutex<T> {
    value: Mutex<Option<T>>,
    /// The process that used it last.
    process: AtomicU32,
}

impl<T: Send> PoolMutex<T> {
    pub(crate) fn new(value: T) -> Self {
        Self { value: Mutex::new(Some(value)), process: AtomicU32::new(std::process::id()) }
    }

    /// Does `work` with it in a pool of `threads`, as [`run`].
    ///
    /// # Errors
    /// As [`run`]; `InternalError` after a panic of an earlier call.
    pub(crate) fn run<R: Send>(
        &self,
        py: Python<'_>,
        threads: usize,
        work: impl FnOnce(&mut T, &Interruption) -> R + Send,
    ) -> PyResult<R> {
        let pool = pool(threads)?;
        py.detach(|| {
            let mut guard = self.take()?;
            let value = guard.as_mut().ok_or_else(broken)?;
            let done = in_pool(&pool, &|_| Ok(()), |interruption| work(value, interruption));
            if let Err(Failure::Panicked(_)) = done {
                *guard = None;
            }
            Ok(done?)
        })
    }

    /// Reads from it, on this thread.
    ///
    /// # Errors
    /// `InternalError` after a panic of an earlier call; the exception of a signal handler.
    pub(crate) fn read<R: Send>(&self, py: Python<'_>, read: impl FnOnce(&T) -> R + Send) -> PyResult<R> {
        // Without the interpreter, which the thread that uses it may wait for.
        py.detach(|| Ok(read(self.take()?.as_ref().ok_or_else(broken)?)))
    }

    /// Waits until no other thread uses it; signals are handled meanwhile.
    ///
    /// # Errors
    /// The exception of a signal handler; `RuntimeError` in a child process, if a thread of its parent used it during the fork.
    fn take(&self) -> PyResult<MutexGuard<'_, Option<T>>> {
        let mut waited = Duration::ZERO;
        let own = std::process::id();
        loop {
            let guard = match self.value.try_lock() {
                Ok(guard) => guard,
                Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
                Err(TryLockError::WouldBlock) => {
                    std::thread::sleep(RETRY);
                    waited += RETRY;
                    if waited >= POLL {
                        waited = Duration::ZERO;
                        if self.process.load(Ordering::Relaxed) != own {
                            // Held by a thread that does not exist in this process.
                            return Err(forked());
                        }
                        Python::attach(|py| py.check_signals())?;
                    }
                    continue;
                }
            };
            self.process.store(own, Ordering::Relaxed);
            return Ok(guard);
        }
    }
}

/// Counts the tasks of pools that use an object. The threads of pools do not survive a fork, and locks that their tasks held remain locked in the child
/// process.
pub(crate) struct TaskCount {
    running: AtomicUsize,
    /// The process that used the object last.
    process: AtomicU32,
}

impl TaskCount {
    pub(crate) fn new() -> Self {
        Self { running: AtomicUsize::new(0), process: AtomicU32::new(std::process::id()) }
    }

    /// Counts a task until the guard is dropped.
    pub(crate) fn count(&self) -> TaskGuard<'_> {
        self.running.fetch_add(1, Ordering::SeqCst);
        TaskGuard(self)
    }

    /// Checks that the object may be used in this process.
    ///
    /// # Errors
    /// `RuntimeError` in a child process, if a task of its parent used the object during the fork.
    pub(crate) fn check_process(&self) -> PyResult<()> {
        let own = std::process::id();
        if self.process.load(Ordering::Relaxed) != own {
            if self.running.load(Ordering::SeqCst) > 0 {
                return Err(forked());
            }
            self.process.store(own, Ordering::Relaxed);
        }
        Ok(())
    }
}

/// A task that is counted by a [`TaskCount`].
pub(crate) struct TaskGuard<'a>(&'a TaskCount);

impl Drop for TaskGuard<'_> {
    fn drop(&mut self) {
        self.0.running.fetch_sub(1, Ordering::SeqCst);
    }
}

/// A thread of the parent process was using it.
pub(crate) fn forked() -> PyErr {
    PyRuntimeError::new_err(
        "another thread was using this object when this process was forked; allowed: an object that is opened in this process",
    )
}

/// An earlier call panicked.
fn broken() -> PyErr {
    error::internal("an earlier call on this object failed within Bansho; open it again".to_owned())
}

/// The exception for a panic.
pub(crate) fn panicked(payload: &(dyn Any + Send)) -> PyErr {
    error::internal(message_of(payload))
}

/// What a panic says.
fn message_of(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| payload.downcast_ref::<String>().cloned());
    format!("Bansho failed: {}; this is a bug, please report it", text.unwrap_or_else(|| "an unknown panic".to_owned()))
}
