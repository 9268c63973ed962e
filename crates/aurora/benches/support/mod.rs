//! Support for benchmarks.

/// A pool whose threads each stay on a core of their own: unpinned they are often packed onto one.
pub(crate) fn pinned_pool(threads: usize) -> rayon::ThreadPool {
    let cores = core_affinity::get_core_ids().unwrap_or_default();
    let pin = move |index: usize| {
        if let Some(core) = cores.get(index) {
            core_affinity::set_for_current(*core);
        }
    };
    rayon::ThreadPoolBuilder::new().num_threads(threads).start_handler(pin).build().expect("a pool")
}
