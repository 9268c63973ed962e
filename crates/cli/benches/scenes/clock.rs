//! CPU time, a thread pool with pinned threads, and the reference workload.

use std::{hint::black_box, time::Duration};

use rayon::{ThreadPool, ThreadPoolBuilder};

/// CPU time of this thread; on systems that do not state it, elapsed time.
pub(crate) fn thread_time() -> Duration {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
    }
    #[cfg(not(unix))]
    {
        static START: std::sync::LazyLock<std::time::Instant> = std::sync::LazyLock::new(std::time::Instant::now);
        START.elapsed()
    }
}

/// A pool whose threads stay on their cores.
pub(crate) fn pinned_pool(threads: usize) -> Result<ThreadPool, String> {
    let cores = core_affinity::get_core_ids().unwrap_or_default();
    let pin = move |index: usize| {
        if let Some(core) = cores.get(index) {
            core_affinity::set_for_current(*core);
        }
    };
    ThreadPoolBuilder::new().num_threads(threads).start_handler(pin).build().map_err(|error| error.to_string())
}

/// CPU time of a fixed workload, ms, to which all scenes together are compared: polynomials in the first-level cache, which are vectorized, and a sum
/// over memory. The fastest of a few runs.
pub(crate) fn reference_kernel_ms() -> f64 {
    let mut small: Vec<f32> = (0..4096).map(|index| index as f32 * 1e-4).collect();
    let mut large = vec![1_f32; 4 << 20];
    let run = || {
        let start = thread_time();
        for _ in 0..400 {
            polynomials(black_box(&mut small));
        }
        large.iter_mut().for_each(|value| *value = 0.5 * *value + 0.25);
        black_box(&large);
        1e3 * (thread_time() - start).as_secs_f64()
    };
    std::iter::repeat_with(run).take(5).fold(f64::INFINITY, f64::min)
}

/// A polynomial of eighth degree of each number, kept within [0, 1].
fn polynomials(values: &mut [f32]) {
    for value in values {
        let x = *value;
        let sum = (1..9).fold(1.0, |sum, term| sum * x + 0.1 * term as f32);
        *value = sum / (1.0 + sum.abs());
    }
}
