//! Values that all threads together make once, when they are first asked for.

use std::sync::OnceLock;

/// The value of `cell`, by `make` where it has none yet; `make` must give the same every time.
///
/// [`OnceLock::get_or_init`] lets others wait while it makes the value. A thread of a pool that waits for its fellows within `make` may
/// meanwhile be given work that asks for the same value, and would wait for itself for ever. Here nobody waits: threads that ask at the
/// same time each make the value, and one of them is kept.
pub fn get_or_compute<T>(cell: &OnceLock<T>, make: impl FnOnce() -> T) -> &T {
    if let Some(value) = cell.get() {
        return value;
    }
    let made = make();
    cell.get_or_init(|| made)
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
