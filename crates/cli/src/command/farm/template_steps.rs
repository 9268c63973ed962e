//! `bansho farm check`, `bansho farm snapshots`, `bansho farm tile`, `bansho farm finish`: what the steps of a template run, which has no plan.

use std::path::Path;

use bansho::{base::host::plural::counted, job::Job};
use bansho_farm::{FarmError, FarmFolder, chunks::ChunkGrid, finish, machine, status, task};

use super::{flipbook_result, run_in_pool, task::wait_for};
use crate::{
    args::{CheckMachineArgs, FinishArgs, ProgressKind, SnapshotsArgs, TileArgs},
    output::print,
    progress::{JobResult, ProgressReporter},
};

/// Leaves snapshots at the beginning of the chunks whose frames are not whole.
pub(crate) fn snapshots(args: &SnapshotsArgs) -> anyhow::Result<()> {
    let work = &args.render.work;
    let mut written = 0;
    run_in_pool(work.threads, ProgressReporter::new(work.progress, work.stats), |reporter| {
        let chunk = u64::from(args.chunk);
        let job = Job { snapshot_every: Some(chunk), ..args.render.job()? };
        let folder = FarmFolder::beside(&task::sequence_name(&job)?);
        let prepared = task::tile_job(&job, &folder, args.tiles, 0)?.prepare()?;
        let grid = ChunkGrid::new(prepared.plan().frames().start, chunk, prepared.frames().to_vec());
        let unfinished = status::unfinished_chunks(&job, &folder, &grid, args.tiles)?;
        let states = job.snapshots.as_deref().filter(|_| prepared.is_stepped());
        if let Some(last) = states.and_then(|states| task::last_missing_snapshot(states, &grid, unfinished)) {
            written = prepared.write_snapshots(last, reporter)?;
        }
        Ok(None)
    })?;
    Ok(print(&format!("{} written\n", counted(written, "snapshot")))?)
}

/// Draws one tile of each frame.
pub(crate) fn tile(args: &TileArgs) -> anyhow::Result<()> {
    let work = &args.render.work;
    run_in_pool(work.threads, ProgressReporter::new(work.progress, work.stats), |reporter| {
        let count = args.tiles[0] * args.tiles[1];
        if args.tile >= count {
            return Err(FarmError::NoSuchTile { index: args.tile, count });
        }
        let job = args.render.job()?;
        let folder = FarmFolder::beside(&task::sequence_name(&job)?);
        let summary = task::tile_job(&job, &folder, args.tiles, args.tile)?.prepare()?.run(reporter)?;
        let files = vec![summary.first_file];
        Ok(Some(JobResult { unit: "frame", drawn: summary.drawn, kept: summary.kept, files }))
    })
}

/// Checks this machine.
pub(crate) fn check(args: &CheckMachineArgs) -> anyhow::Result<()> {
    let folder = FarmFolder::beside(&args.out);
    run_in_pool(Some(1), ProgressReporter::new(ProgressKind::None, false), |reporter| {
        machine::check_bytes(&args.made_by, &args.arithmetic, reporter)?;
        let token = folder.template_token();
        if args.leave_token {
            folder.write_template_token(&args.token)?;
        }
        wait_for(|| machine::check_token(token.clone(), &args.token))?;
        Ok(None)
    })
}

/// Checks that all frames are whole, joins tiles, and makes what is asked for.
pub(crate) fn finish(args: &FinishArgs) -> anyhow::Result<()> {
    let work = &args.render.work;
    run_in_pool(work.threads, ProgressReporter::new(work.progress, work.stats), |reporter| {
        let job = Job { contact_sheet: None, ..args.render.job()? };
        let products = args.products.products(args.render.contact_sheet);
        let folder = FarmFolder::beside(&task::sequence_name(&job)?);
        let finished = finish::finish_frames(&job, &folder, args.tiles, reporter)?;
        Ok(finished.products(&products, Path::new(""), reporter)?.map(flipbook_result))
    })
}
