//! Lazily computed values that are safe to request from within the thread pool.

use std::sync::OnceLock;

/// The value of `cell`, computed by `compute` if it has none yet. `compute` must be deterministic.
///
/// [`OnceLock::get_or_init`] blocks other threads during initialization. A pool thread that waits for parallel work within `compute` may meanwhile
/// steal a task that requests the same value, and would then deadlock with itself. Here no thread blocks: threads that request the value at the
/// same time each compute it, and one result is kept.
pub fn get_or_compute<T>(cell: &OnceLock<T>, compute: impl FnOnce() -> T) -> &T {
    if let Some(value) = cell.get() {
        return value;
    }
    let computed = compute();
    cell.get_or_init(|| computed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_may_be_asked_for_while_it_is_made() {
        let cell = OnceLock::new();
        // What a thread does that takes up other work while it waits within `make`.
        assert_eq!(*get_or_compute(&cell, || *get_or_compute(&cell, || 7)), 7);
        assert_eq!(*get_or_compute(&cell, || unreachable!("it is there")), 7);
    }
}
