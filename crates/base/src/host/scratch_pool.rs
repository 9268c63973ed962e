//! Things that tasks of the thread pool work with and hand on.
//!
//! Work that is cut into as many tasks as can be stays even among threads to its end, where large tasks leave one of them alone with the last.
//! But then no task should make what it works with.

use std::sync::{Mutex, PoisonError};

/// As many things as there are tasks at once, made where none is left over.
#[derive(Debug)]
pub struct ScratchPool<T, M> {
    create: M,
    free: Mutex<Vec<T>>,
}

impl<T, M: Fn() -> T> ScratchPool<T, M> {
    /// None yet; `make` makes them.
    pub fn new(create: M) -> Self {
        Self { create, free: Mutex::default() }
    }

    /// Does a task with one of them, which is as the task before left it.
    #[inline(always)]
    pub fn with<R>(&self, task: impl FnOnce(&mut T) -> R) -> R {
        let left = || self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let spare = left().pop();
        let mut spare = spare.unwrap_or_else(&self.create);
        let result = task(&mut spare);
        left().push(spare);
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_task_gives_back_the_next_one_has() {
        let spares = ScratchPool::new(Vec::new);
        spares.with(|first: &mut Vec<i32>| {
            first.push(1);
            // While the first is lent, there is another.
            spares.with(|second| second.extend([2, 3]));
        });
        spares.with(|last| assert_eq!(*last, [1]));
    }
}
