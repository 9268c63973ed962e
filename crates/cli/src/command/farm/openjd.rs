//! `bansho farm openjd`

use std::path::{self, Path};

use bansho::{
    Unobserved,
    base::host::printable::printable,
    job::{Job, frames},
    media::files::{atomic, naming, provenance::PROGRAM},
};
use bansho_farm::{
    FarmFolder, machine,
    openjd::{self, TemplateOptions},
    task::{self, sequence_name},
};

use super::{arguments, random_token};
use crate::{
    args::{Frames, OpenjdArgs},
    output::{print, shell_word},
};

/// Writes the template.
pub(crate) fn run(args: &OpenjdArgs) -> anyhow::Result<()> {
    let job = job(args)?;
    let name = sequence_name(&job)?.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let prepared = job.prepare()?;
    let products = args.products.products(args.contact_sheet);
    // Which files exist where frames will be drawn is not known here.
    let anywhere = Job { overwrite: true, ..job.clone() };
    let folder = FarmFolder::beside(Path::new(&name));
    let memory_bytes = task::tile_job(&anywhere, &folder, args.tiles, 0)?.prepare()?.memory_bytes();
    let flipbook = products.check(&anywhere, Path::new("out"))?;
    let template = openjd::template(&TemplateOptions {
        name: job.scene.stem,
        scene: relative_scene(args)?,
        frame_name: name,
        frames: frames::format_list(prepared.frames()),
        size: prepared.plan().size(),
        chunk_frames: u64::from(args.chunk),
        task_s: 60 * u64::from(args.task_minutes),
        tiles: args.tiles,
        snapshots: prepared.is_stepped(),
        options: args.options.clone(),
        products,
        token: random_token(),
        program: PROGRAM.to_owned(),
        arithmetic: machine::arithmetic_digest(&Unobserved)?,
        memory_bytes,
        finish_memory_bytes: flipbook.map_or(0.0, |flipbook| flipbook.memory_bytes()).max(prepared.memory_bytes()),
    })?;
    // Options of the tasks are not of this file.
    let policy = prepared.overwrite_policy().clone().without_foreign_files();
    atomic::write_bytes(&args.out, template.as_bytes(), &policy)?;
    let shown = args.out.display().to_string();
    Ok(print(&format!("{}: written. Run it here: openjd run {}\n", printable(&shown), shell_word(&args.out)))?)
}

/// The job of all frames, with the options that follow `--`.
fn job(args: &OpenjdArgs) -> anyhow::Result<Job> {
    let scene = args.scene.display().to_string();
    // What the template states itself, so that it is refused when it is stated twice.
    let stated = ["--frames=0", "--size=1x1", "--out=a.png", "--resume", "--snapshots=a"].map(str::to_owned);
    let scene = ["--".to_owned(), scene];
    let line: Vec<String> = stated.into_iter().chain(args.options.iter().cloned()).chain(scene).collect();
    let job = arguments::render_job(&line)?;
    let stem = job.scene.stem.clone();
    Ok(Job {
        frames: args.frames.clone().map(|Frames(numbers)| numbers),
        size: args.size,
        snapshots: None,
        out: Some(args.frame_name.clone().unwrap_or_else(|| naming::default_sequence(&stem)).into()),
        resume: true,
        ..job
    })
}

/// The scene as seen from the folder of the template: Open Job Description allows no default outside of it.
fn relative_scene(args: &OpenjdArgs) -> anyhow::Result<Option<String>> {
    let template = path::absolute(&args.out)?;
    let scene = path::absolute(&args.scene)?;
    let relative = scene.strip_prefix(template.parent().unwrap_or(Path::new("/")));
    Ok(relative.ok().and_then(Path::to_str).map(str::to_owned))
}
