//! `bansho farm finish`

use bansho::{
    farm::{film, finish},
    job::Job,
};

use super::run_in_pool;
use crate::{args::FinishArgs, progress::ProgressReporter};

/// Checks that all frames are whole, and makes the film.
pub(crate) fn run(args: &FinishArgs) -> anyhow::Result<()> {
    let work = &args.render.work;
    run_in_pool(work.threads, ProgressReporter::new(work.progress, work.stats), |reporter| {
        let job = Job { contact_sheet: None, ..args.render.job()? }.prepare()?;
        finish::check_whole(&job)?;
        if let Some(film) = &args.film {
            film::make_film(&job, film, reporter)?;
        }
        if let Some(count) = args.render.contact_sheet {
            film::make_contact_sheet(&job, count, reporter)?;
        }
        Ok(None)
    })
}
