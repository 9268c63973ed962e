//! What each command does.

pub(crate) mod calibrate;
pub(crate) mod check;
pub(crate) mod completions;
pub(crate) mod flipbook;
pub(crate) mod man;
pub(crate) mod new;
pub(crate) mod render;
pub(crate) mod schema;
pub(crate) mod simulate;
pub(crate) mod streaks;
pub(crate) mod studio;
pub(crate) mod upgrade;

use bansho::job::JobError;

use crate::{
    args::WorkArgs,
    interrupt,
    progress::{self, Watcher},
};

/// Does `work` in a pool of threads of its own, watched for the user.
fn watched(
    args: &WorkArgs,
    work: impl FnOnce(&Watcher) -> Result<progress::Result, JobError> + Send,
) -> anyhow::Result<()> {
    let watcher = Watcher::new(args.progress, args.stats);
    interrupt::be_patient(watcher.telling_the_end());
    // 0 stands for one thread for each core.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads.map_or(0, usize::from)).build()?;
    let result = pool.install(|| work(&watcher));
    watcher.finish(result, pool.current_num_threads())
}
