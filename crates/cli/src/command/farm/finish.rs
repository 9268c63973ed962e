//! `bansho farm finish`

use bansho::farm::finish;

use super::run_in_pool;
use crate::{args::FinishArgs, progress::ProgressReporter};

/// Checks that all frames are whole, and makes the film.
pub(crate) fn run(args: &FinishArgs) -> anyhow::Result<()> {
    let work = &args.render.work;
    run_in_pool(work.threads, ProgressReporter::new(work.progress, work.stats), |reporter| {
        let job = args.render.job()?.prepare()?;
        finish::check_whole(&job)?;
        match &args.film {
            Some(film) => finish::make_film(&job, film, reporter).map(|()| None),
            None => Ok(None),
        }
    })
}
