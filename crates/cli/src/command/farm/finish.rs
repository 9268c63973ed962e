//! `bansho farm finish`

use std::path::Path;

use bansho::{
    farm::{FarmFolder, finish, task},
    job::Job,
};

use super::{flipbook_result, run_in_pool};
use crate::{args::FinishArgs, progress::ProgressReporter};

/// Checks that all frames are whole, joins tiles, and makes what is asked for.
pub(crate) fn run(args: &FinishArgs) -> anyhow::Result<()> {
    let work = &args.render.work;
    run_in_pool(work.threads, ProgressReporter::new(work.progress, work.stats), |reporter| {
        let job = Job { contact_sheet: None, ..args.render.job()? };
        let products = args.products.products(args.render.contact_sheet);
        let folder = FarmFolder::beside(&task::sequence_name(&job)?);
        let finished = finish::finish_frames(&job, &folder, args.tiles, reporter)?;
        Ok(finished.products(&products, Path::new(""), reporter)?.map(flipbook_result))
    })
}
