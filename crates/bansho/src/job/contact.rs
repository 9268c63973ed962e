//! Contact sheets: many frames in one picture, to judge a motion at a glance.

use bansho_base::{
    image::Frame,
    observer::{Observer, Stage, StageGuard},
};
use bansho_media::{
    flipbook::{Sheet, tile_display},
    sequence::{Picture, Slot},
};
use bansho_render::fingerprint;

use super::{error::JobError, observer::JobObserver, prepare::PreparedJob, sheet::Gather, shoot::shoot};

/// Pixels between the frames of a contact sheet.
pub(super) const GUTTER: usize = 2;

/// Draws all frames of `job` into one picture and writes it.
pub(super) fn run(job: &PreparedJob, sheet: &Sheet, observer: &dyn JobObserver) -> Result<(), JobError> {
    let sink = job.format.open(&job.plan, 1, sheet.size(), 1)?;
    let show = |frame: &Frame, observer: &dyn Observer| job.format.show(frame, observer);
    let gather = Gather::new(sheet.count, observer, show);
    shoot(&job.plan, job.backend.as_ref(), &job.frames, &job.snapshots, &gather, observer)?;
    let _stage = StageGuard::begin(observer, Stage::Write);
    // The gutters are empty, so that the sheet has alpha even where a plate fills its frames.
    let picture = tile_display(&gather.into_tiles(), sheet.columns, sheet.gutter, [0; 4])?;
    sink.write(Slot { index: 0, number: job.frames[0] }, Picture::Display(&picture, &own_fingerprint(job)))?;
    Ok(sink.finish()?)
}

/// A fingerprint that no single frame has.
fn own_fingerprint(job: &PreparedJob) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    for &number in &job.frames {
        hasher.update(&fingerprint::of_frame(&job.plan, number));
    }
    job.format.fingerprint(*hasher.update(b"contact sheet").finalize().as_bytes())
}
