//! How often things that are slow to build were built, for tests that hold "built once".

use std::{
    collections::BTreeMap,
    sync::{Mutex, PoisonError},
};

static COUNTS: Mutex<BTreeMap<&'static str, u64>> = Mutex::new(BTreeMap::new());

/// Counts the construction of a `kind` of thing; constructors call it themselves.
pub fn count(kind: &'static str) {
    *COUNTS.lock().unwrap_or_else(PoisonError::into_inner).entry(kind).or_default() += 1;
}

/// How many of each kind this process has built since the last call.
pub fn take() -> BTreeMap<&'static str, u64> {
    std::mem::take(&mut *COUNTS.lock().unwrap_or_else(PoisonError::into_inner))
}
