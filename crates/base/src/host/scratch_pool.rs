//! Scratch objects that are reused by the tasks of a thread pool.
//!
//! Many small tasks balance the load between threads to the end, whereas the last of a few large tasks leaves the other threads idle. But then a task
//! should not allocate its own scratch memory.

use std::sync::{Mutex, PoisonError};

/// A pool of scratch objects: at most as many as there are concurrent tasks, created on demand.
#[derive(Debug)]
pub struct ScratchPool<T, M> {
    create: M,
    free: Mutex<Vec<T>>,
}

impl<T, M: Fn() -> T> ScratchPool<T, M> {
    /// An empty pool; `create` makes new objects.
    pub fn new(create: M) -> Self {
        Self { create, free: Mutex::default() }
    }

    /// Runs `task` with a scratch object, which is in the state in which the previous task left it.
    #[inline(always)]
    pub fn with<R>(&self, task: impl FnOnce(&mut T) -> R) -> R {
        // Its own statement, so that the lock is released before an object is created.
        let scratch = self.free.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut scratch = scratch.unwrap_or_else(&self.create);
        let result = task(&mut scratch);
        self.free.lock().unwrap_or_else(PoisonError::into_inner).push(scratch);
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_task_gives_back_the_next_one_has() {
        let pool = ScratchPool::new(Vec::new);
        pool.with(|first: &mut Vec<i32>| {
            first.push(1);
            // While the first is lent, there is another.
            pool.with(|second| second.extend([2, 3]));
        });
        pool.with(|last| assert_eq!(*last, [1]));
    }
}
