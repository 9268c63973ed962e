//! Data-parallel iterators, by rayon or on the calling thread: the only way by which the library's crates run work in parallel.
//!
//! With the feature `rayon` of this crate (`bansho` enables it by default) this module re-exports rayon: work runs in the pool whose
//! `ThreadPool::install` called it, otherwise in rayon's global pool, whose threads rayon starts when it is first used. Without the feature,
//! [`sequential`] gives rayon's names to the iterators of the standard library, everything runs on the calling thread, and the library starts
//! no thread: for games, which divide the cores among their own jobs, and for hosts without threads.
//!
//! Both give the same bytes, by the rules that make the result independent of the number of threads: items do not affect each other, results
//! are in the order of the items, and `reduce_with` is only given operations that are associative to the bit, such as a maximum.
//!
//! ```
//! use bansho_base::host::parallel::prelude::*;
//!
//! let squares: Vec<u32> = [1_u32, 2, 3].par_iter().with_min_len(1024).map(|value| value * value).collect();
//! assert_eq!(squares, [1, 4, 9]);
//! ```

pub mod sequential;

#[cfg(feature = "rayon")]
pub use rayon::{current_num_threads, join};
#[cfg(not(feature = "rayon"))]
pub use sequential::{current_num_threads, join};

/// The traits of the iterators, to be imported as a whole.
pub mod prelude {
    #[cfg(not(feature = "rayon"))]
    pub use super::sequential::prelude::*;
    #[cfg(feature = "rayon")]
    pub use rayon::prelude::*;
}
