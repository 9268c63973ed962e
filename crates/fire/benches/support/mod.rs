//! Shared by benchmarks.

/// A thread pool with each thread pinned to its own core: unpinned threads are often scheduled on the same core.
pub(crate) fn pinned_pool(threads: usize) -> rayon::ThreadPool {
    let cores = core_affinity::get_core_ids().unwrap_or_default();
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads).start_handler(move |index| {
        if let Some(core) = cores.get(index) {
            core_affinity::set_for_current(*core);
        }
    });
    builder.build().expect("a pool")
}
