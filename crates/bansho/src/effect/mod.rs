//! Fire, rain and aurora inside another program: a game, a visualizer, another renderer.
//!
//! An [`Effect`] describes what is drawn and how; [`Effect::open`] builds it, runs its simulations up to time 0 and returns a [`LiveEffect`], which follows
//! the program's own time and takes its changes: wind, parameters, camera. A [`Picture`] of it is written into the program's own buffers.
//!
//! Data flow: parameters -> [`SceneBuilder`](crate::SceneBuilder) -> `Scene` -> `CompiledScene`, `Plan` -> `Shot`, as for a scene file. Without changes, the
//! picture at a time is that of `bansho render`, to the bit.

mod changes;
mod description;
mod error;
mod live;
mod picture;

pub use self::{
    description::Effect,
    error::EffectError,
    live::{LiveEffect, MAX_ADVANCE_S},
    picture::Picture,
};

#[cfg(feature = "rayon")]
use std::sync::Arc;

/// The thread pool in which an effect works: that of the caller's thread, unless one was given. Without the feature `rayon` there is none, and everything
/// runs on the caller's thread.
#[derive(Clone, Default)]
struct Pool {
    #[cfg(feature = "rayon")]
    given: Option<Arc<rayon::ThreadPool>>,
}

impl Pool {
    #[cfg(feature = "rayon")]
    fn new(pool: Arc<rayon::ThreadPool>) -> Self {
        Self { given: Some(pool) }
    }

    /// Does `work` in the pool.
    fn run<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        #[cfg(feature = "rayon")]
        if let Some(pool) = &self.given {
            return pool.install(work);
        }
        work()
    }
}
