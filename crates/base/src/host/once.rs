//! Lazily computed values that are safe to request from within the thread pool.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

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

/// The last value that was computed from a key. It stays as long as the same key is asked for.
///
/// Nothing is locked while a value is computed, for the same reason as in [`get_or_compute`].
#[derive(Debug)]
pub struct LastValue<K, V>(Mutex<Option<(K, Arc<V>)>>);

impl<K, V> Default for LastValue<K, V> {
    fn default() -> Self {
        Self::new()
    }
}

impl<K, V> LastValue<K, V> {
    /// No value yet.
    pub const fn new() -> Self {
        Self(Mutex::new(None))
    }

    fn lock(&self) -> MutexGuard<'_, Option<(K, Arc<V>)>> {
        // A value is always whole, so a poisoned lock is usable.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps the value of a key, and returns it.
    pub fn insert(&self, key: K, value: V) -> Arc<V> {
        let value = Arc::new(value);
        *self.lock() = Some((key, value.clone()));
        value
    }
}

impl<K: PartialEq, V> LastValue<K, V> {
    /// The value, if it is that of this key.
    pub fn get(&self, key: &K) -> Option<Arc<V>> {
        self.lock().as_ref().filter(|(known, _)| known == key).map(|(_, value)| value.clone())
    }

    /// The value of this key, computed by `compute` if it is not the last one.
    pub fn get_or_compute(&self, key: K, compute: impl FnOnce() -> V) -> Arc<V> {
        match self.get(&key) {
            Some(value) => value,
            None => self.insert(key, compute()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_may_be_asked_for_while_it_is_made() {
        let cell = OnceLock::new();
        // As when a thread steals a task while it waits within `compute`.
        assert_eq!(*get_or_compute(&cell, || *get_or_compute(&cell, || 7)), 7);
        assert_eq!(*get_or_compute(&cell, || unreachable!("it is there")), 7);
    }

    #[test]
    fn the_last_value_is_kept_for_its_key_alone_and_may_be_asked_for_while_it_is_made() {
        let last = LastValue::default();
        assert_eq!(last.get(&1), None);
        let first = last.get_or_compute(1, || *last.get_or_compute(1, || "one"));
        assert!(Arc::ptr_eq(&first, &last.get_or_compute(1, || unreachable!("it is there"))));
        assert_eq!(*last.get_or_compute(2, || "two"), "two");
        assert_eq!(last.get(&1), None);
        assert_eq!(last.insert(3, "three"), last.get(&3).unwrap());
    }
}
