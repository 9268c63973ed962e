//! The threads on which an effect works.

#[cfg(feature = "rayon")]
use std::sync::Arc;

/// The thread pool in which an effect works: that of the caller's thread, unless one was given. Without the feature `rayon` there is none, and everything
/// runs on the caller's thread.
#[derive(Clone, Default)]
pub(super) struct Pool {
    #[cfg(feature = "rayon")]
    given: Option<Arc<rayon::ThreadPool>>,
}

impl Pool {
    #[cfg(feature = "rayon")]
    pub(super) fn new(pool: Arc<rayon::ThreadPool>) -> Self {
        Self { given: Some(pool) }
    }

    /// Does `work` in the pool.
    pub(super) fn run<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        #[cfg(feature = "rayon")]
        if let Some(pool) = &self.given {
            return pool.install(work);
        }
        work()
    }
}
