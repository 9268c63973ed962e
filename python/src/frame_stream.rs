//! Frames that are drawn ahead of the one that Python takes next, several at a time: what `Shot.frames` iterates over where frames do not follow from each
//! other.
//!
//! Each frame is a task of the pool, as in the library's jobs that write files; the parts of a frame are tasks, too. Here the tasks outlive the call that
//! starts them, so that frames are drawn while Python uses earlier ones.

use std::{
    collections::BTreeMap,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use bansho::{Frame, Observer, RenderError, SceneLinear};
use pyo3::{prelude::*, types::PyDict};
use rayon::ThreadPool;

use crate::{error, frame, work};

/// An iterator over frames of light.
#[pyclass(module = "bansho._bansho", frozen)]
pub(crate) struct FrameStream {
    frames: Prefetch<bansho::Shot, Result<Frame, RenderError>>,
}

/// The numbers of the frames of a stream.
#[derive(Clone, Copy)]
pub(crate) struct FrameNumbers {
    pub(crate) first: i64,
    pub(crate) step: i64,
    pub(crate) count: usize,
}

impl FrameStream {
    /// Starts to draw frames in a pool of `threads`, as many at once as there are shots, which are independent of each other.
    pub(crate) fn new(
        shots: Vec<bansho::Shot>,
        numbers: FrameNumbers,
        threads: usize,
        task_count: Arc<work::TaskCount>,
    ) -> PyResult<Self> {
        let FrameNumbers { first, step, count } = numbers;
        let draw = move |shot: &mut bansho::Shot, index: usize, observer: &work::Interruption| {
            shot.advance(first + index as i64 * step, observer)?;
            shot.draw(&SceneLinear, observer)
        };
        Ok(Self { frames: Prefetch::start(shots, count, Box::new(draw), work::pool(threads)?, task_count) })
    }
}

#[pymethods]
impl FrameStream {
    fn __iter__(stream: PyRef<'_, Self>) -> PyRef<'_, Self> {
        stream
    }

    /// The next frame, once it is drawn.
    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        match self.frames.take(py)? {
            None => Ok(None),
            Some(Ok(drawn)) => frame::frame_dictionary(py, drawn).map(Some),
            Some(Err(failed)) => {
                self.frames.close();
                Err(error::render(&failed))
            }
        }
    }

    /// Stops drawing; there are no further frames.
    fn close(&self) {
        self.frames.close();
    }
}

/// Computes the numbers from 0 to `count` - 1 ahead with two sources, where that of `panic_at` panics, and calls `take` with each and with the largest that
/// a task computes by then: for tests.
#[pyfunction]
pub(crate) fn stream_for_test(
    py: Python<'_>,
    count: usize,
    panic_at: usize,
    message: String,
    take: Bound<'_, PyAny>,
) -> PyResult<()> {
    let largest = Arc::new(AtomicUsize::new(0));
    let of_tasks = largest.clone();
    let compute = move |(): &mut (), index: usize, _: &work::Interruption| {
        of_tasks.fetch_max(index, Ordering::Relaxed);
        assert!(index != panic_at, "{message}");
        index
    };
    let task_count = Arc::new(work::TaskCount::new());
    let indices = Prefetch::start(vec![(); 2], count, Box::new(compute), work::pool(2)?, task_count);
    while let Some(index) = indices.take(py)? {
        take.call1((index, largest.load(Ordering::Relaxed)))?;
    }
    Ok(())
}

/// The work of a task: the result at an index, from a source that no other task uses meanwhile.
type Work<S, R> = Box<dyn Fn(&mut S, usize, &work::Interruption) -> R + Send + Sync>;

/// Results of tasks of a pool, taken in order. As many as there are sources are computed ahead.
struct Prefetch<S: Send + 'static, R: Send + 'static> {
    tasks: Arc<Tasks<S, R>>,
    pool: Arc<ThreadPool>,
    /// The process whose threads compute the results.
    process: u32,
}

/// What the tasks share.
struct Tasks<S, R> {
    work: Work<S, R>,
    /// Number of results.
    count: usize,
    /// Number of sources: no task is started further ahead of the result that is taken next.
    window: usize,
    state: Mutex<State<S, R>>,
    finished: Condvar,
    interruption: work::Interruption,
    task_count: Arc<work::TaskCount>,
}

struct State<S, R> {
    /// Those that no task uses.
    sources: Vec<S>,
    /// Results, and the panics of tasks, that are not taken yet.
    results: BTreeMap<usize, thread::Result<R>>,
    /// Index of the result that is taken next.
    next: usize,
    /// Number of tasks that are started.
    started: usize,
}

impl<S: Send + 'static, R: Send + 'static> Prefetch<S, R> {
    fn start(
        sources: Vec<S>,
        count: usize,
        work: Work<S, R>,
        pool: Arc<ThreadPool>,
        task_count: Arc<work::TaskCount>,
    ) -> Self {
        let window = sources.len();
        let state = State { sources, results: BTreeMap::new(), next: 0, started: 0 };
        let tasks = Tasks {
            work,
            count,
            window,
            state: Mutex::new(state),
            finished: Condvar::new(),
            interruption: work::Interruption::default(),
            task_count,
        };
        let prefetch = Self { tasks: Arc::new(tasks), pool, process: std::process::id() };
        prefetch.fill_window();
        prefetch
    }

    /// Starts the tasks that the window has room for.
    fn fill_window(&self) {
        let indices = {
            let mut state = self.tasks.lock();
            let end = self.tasks.count.min(state.next.saturating_add(self.tasks.window));
            let indices = state.started..end;
            state.started = end;
            indices
        };
        for index in indices {
            let tasks = self.tasks.clone();
            self.pool.spawn_fifo(move || {
                let task_count = tasks.task_count.clone();
                let _guard = task_count.count();
                tasks.run(index);
                // The last task of a stream that is closed drops the sources, and is counted until then.
                drop(tasks);
            });
        }
    }

    /// The next result, once it is computed; `None` after the last one and after [`close`](Self::close). Signals are handled meanwhile.
    ///
    /// # Errors
    /// The exception of a signal handler; `InternalError` if the task panicked; `RuntimeError` in a child process.
    fn take(&self, py: Python<'_>) -> PyResult<Option<R>> {
        if std::process::id() != self.process {
            return Err(work::forked());
        }
        let result = py.detach(|| self.wait_for_next())?;
        match result {
            None => Ok(None),
            Some(Ok(result)) => {
                // Before Python uses the result, so that all threads have work meanwhile.
                self.fill_window();
                Ok(Some(result))
            }
            Some(Err(payload)) => {
                self.close();
                Err(work::panicked(payload.as_ref()))
            }
        }
    }

    fn wait_for_next(&self) -> PyResult<Option<thread::Result<R>>> {
        let mut state = self.tasks.lock();
        loop {
            let next = state.next;
            if next == self.tasks.count || self.tasks.interruption.cancelled() {
                return Ok(None);
            }
            if let Some(result) = state.results.remove(&next) {
                state.next += 1;
                return Ok(Some(result));
            }
            let (guard, waited) =
                self.tasks.finished.wait_timeout(state, work::POLL).unwrap_or_else(PoisonError::into_inner);
            state = guard;
            // Results that others finish meanwhile are no more than the window, so that signals wait no longer.
            if waited.timed_out() {
                drop(state);
                Python::attach(|py| py.check_signals()).inspect_err(|_| self.close())?;
                state = self.tasks.lock();
            }
        }
    }

    /// Asks the tasks to stop, and drops what they have computed.
    fn close(&self) {
        self.tasks.interruption.request();
        self.tasks.finished.notify_all();
        // In a child process a thread that does not exist there may hold the lock.
        if std::process::id() == self.process {
            let mut state = self.tasks.lock();
            let unused = (std::mem::take(&mut state.sources), std::mem::take(&mut state.results));
            drop(state);
            drop(unused);
        }
    }
}

impl<S: Send + 'static, R: Send + 'static> Drop for Prefetch<S, R> {
    fn drop(&mut self) {
        self.close();
    }
}

impl<S, R> Tasks<S, R> {
    fn lock(&self) -> MutexGuard<'_, State<S, R>> {
        // The lock is only held for inserts and removals, so the state is valid even if a thread panicked.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Computes the result at `index`.
    fn run(&self, index: usize) {
        if self.interruption.cancelled() {
            return;
        }
        // There are as many sources as indices in the window. One that is lost to a panic belongs to an index that stays in the window, since nothing is taken
        // after it.
        let Some(mut source) = self.lock().sources.pop() else { return };
        let result = catch_unwind(AssertUnwindSafe(|| (self.work)(&mut source, index, &self.interruption)));
        let mut state = self.lock();
        if self.interruption.cancelled() {
            // Nobody takes it: source and result are dropped after the lock is released.
            drop(state);
            return;
        }
        if result.is_ok() {
            state.sources.push(source);
        }
        state.results.insert(index, result);
        drop(state);
        self.finished.notify_all();
    }
}
