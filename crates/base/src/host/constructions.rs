//! Counts how often expensive objects are constructed, for tests that each is built only once.

use std::{
    collections::BTreeMap,
    sync::{Mutex, PoisonError},
};

static COUNTS: Mutex<BTreeMap<&'static str, u64>> = Mutex::new(BTreeMap::new());

/// Counts the construction of an object of this `kind`; called by constructors.
pub fn count(kind: &'static str) {
    *COUNTS.lock().unwrap_or_else(PoisonError::into_inner).entry(kind).or_default() += 1;
}

/// The number of constructions of each kind in this process since the last call.
pub fn take() -> BTreeMap<&'static str, u64> {
    std::mem::take(&mut *COUNTS.lock().unwrap_or_else(PoisonError::into_inner))
}
